"""The thesis's two-stage search of Appendix D, with heights in steps of delta-H.

The first stage is for stress, the second for deflection.

Stage 1 walks from B to A and raises each slice until its von Mises stress is below the limit. A
slice is as high as its station on the side of A. Stage 2 freezes the moments of stage 1. Step by
step, it raises the station that reduces the deflection most.

Both stages give the contour of Appendix D without its repetitions. In stage 1, a slice starts its
search at the height of its neighbour, because heights grow towards A. In stage 2, a step at one
station does not change the gain at any other, so the result is one sorted list of all steps. (The
tangents of eq. 3.36, which couple neighbours, differ from their angles by less than 1e-9.)
"""

from dataclasses import dataclass

import numpy as np

from boom_model.arrays import Array, read_only
from boom_model.errors import InfeasibleError, InputError
from boom_model.link_design.beam import Beam, LoadCases

MOST_STEPS = 200_000
"""Largest height of a station in steps of delta-H."""


@dataclass(frozen=True, eq=False)
class ThesisLoad:
    """A load case in the form of Appendix D, along frame 5.

    The loads need not occur at one instant: each component is the largest of a move.
    """

    applied: Array
    """(2,) |force| at B along x and y [N]; the force compresses the link and pushes it down."""
    acceleration: Array
    """(3,) acceleration minus gravity that Appendix D assigns to frame 5 [m/s^2]."""
    angular_velocity: Array
    angular_acceleration: Array

    @property
    def cases(self) -> LoadCases:
        """The load as a load case of the beam, including the link's own weight."""
        (ax, ay, _), (wx, wy, wz), spin = self.acceleration, self.angular_velocity, self.angular_acceleration[2]
        return LoadCases.of([-self.applied], [[[ax, -(wy**2 + wz**2)], [ay, spin + wx * wy]]])


THESIS_LOAD = ThesisLoad(
    applied=read_only([758.1, 859.9]),
    acceleration=read_only([8.4931, 9.9124, 0.1649]),
    angular_velocity=read_only([0.2933, 0.4231, 0.314]),
    angular_acceleration=read_only([0.3265, 0.3770, 0.2513]),
)
"""Load case of the thesis, section 3.5, with the digits of Appendix D."""

THESIS_STEP = 1e-4
"""delta-H of the thesis [m]"""


@dataclass(frozen=True, eq=False)
class ThesisDesign:
    """Result of both stages, at the stations from A to B."""

    stress_heights: Array
    """(n + 1,) heights after stage 1 [m]"""
    stress: Array
    """(n + 1,) von Mises stress of stage 1 [Pa]"""
    moments: Array
    """(n + 1,) absolute bending moments, frozen after stage 1 [Nm]"""
    coefficients: Array
    """(n + 1,) c of the deflection sum c / H^3 [m^4], eq. 3.36"""
    heights: Array
    """(n + 1,) heights after stage 2 [m]"""
    stress_mass: float
    """Mass after stage 1 [kg], with each slice as high as its station on the side of A"""
    mass: float
    """Mass after stage 2 [kg]"""
    stress_deflection: float
    """Deflection after stage 1 [m], by the method's formula and frozen moments"""
    deflection: float
    """Deflection after stage 2 [m]"""
    steps: int
    """Number of steps of stage 2"""


def thesis_design(
    beam: Beam, load: ThesisLoad, *, stress_limit: float, deflection_limit: float, step: float = THESIS_STEP
) -> ThesisDesign:
    """Design a link by the thesis's method (sections 3.3 and 3.4, Appendix D).

    Args:
        beam: a cantilever.
        load: its single load case.
        stress_limit: von Mises stress [Pa] that every station stays below.
        deflection_limit: largest deflection of the end [m].
        step: delta-H [m].

    Raises:
        InputError: a limit or the step is not above 0, the step is too small for the heights, or
            the beam is not a cantilever.
        InfeasibleError: a station would be more than MOST_STEPS steps high, and higher than a fifth
            of the length.
    """
    if beam.support != "cantilever":
        raise InputError("the thesis's method designs cantilevers only; use the exact method for a strut between two pins")
    for name, value in (("stress limit", stress_limit), ("deflection limit", deflection_limit), ("step", step)):
        if not (np.isfinite(value) and value > 0.0):
            raise InputError(f"{name} is {value:g}; it must be finite and above 0")
    stress_steps, stress, moments = _stress_stage(beam, load, stress_limit, step)
    before = step * stress_steps
    arm = beam.length - beam.stations
    arms = np.zeros_like(arm)
    arms[:-1] += arm[:-1]
    arms[1:] += arm[:-1]
    c = 12.0 * moments * beam.step / 2.0 * arms / (beam.material.elastic_modulus * beam.width)
    added = _deflection_stage(stress_steps, c, deflection_limit, step, beam.length)
    after = step * (stress_steps + added)
    slice_mass = beam.material.density * beam.width * beam.step
    return ThesisDesign(
        stress_heights=read_only(before),
        stress=read_only(stress),
        moments=read_only(moments),
        coefficients=read_only(c),
        heights=read_only(after),
        stress_mass=float(slice_mass * before[:-1].sum()),
        mass=float(slice_mass * after[:-1].sum()),
        stress_deflection=float((c / before**3).sum()),
        deflection=float((c / after**3).sum()),
        steps=int(added.sum()),
    )


def _stress_stage(beam: Beam, load: ThesisLoad, limit: float, step: float) -> tuple[Array, Array, Array]:
    """Return heights in steps, stresses and moments from A to B, by a walk from B to A."""
    w, L, dx, n = beam.width, beam.length, beam.step, beam.slices
    density = beam.material.density
    fx, fy = map(float, load.applied)
    ax0, ay0, _ = map(float, load.acceleration)
    wx, wy, wz = map(float, load.angular_velocity)
    _, _, turn = map(float, load.angular_acceleration)
    ax1, ay1 = -(wy**2 + wz**2), turn + wx * wy
    steps, stresses, moments = np.zeros(n + 1), np.zeros(n + 1), np.zeros(n + 1)

    def stress(H: float, N: float, V: float, M: float) -> float:
        return float(np.hypot(abs(N) / (w * H) + 6.0 * abs(M) / (w * H * H), np.sqrt(3.0) * V / (w * H)))

    k = 1
    while (found := stress(k * step, fx, fy, 0.0)) >= limit:
        k = _raised(k, step, L)
    steps[n], stresses[n] = k, found
    mass = first = second = across_x = across_y = across_z = 0.0  # sums over the slices so far, about B
    for i in range(1, n + 1):
        middle = (i - 0.5) * dx
        while True:
            H = k * step
            m = density * w * dx * H
            total, moment = mass + m, first + m * middle
            com = moment / total
            apart = second + m * middle**2 - total * com**2
            Ix = across_x + m / 12.0 * (H * H + w * w)
            Iy = across_y + m / 12.0 * (dx * dx + w * w) + apart
            Iz = across_z + m / 12.0 * (dx * dx + H * H) + apart
            N = fx + total * (ax0 + ax1 * (L - com))
            V = fy + total * (ay0 + ay1 * (L - com))
            spin = Iz * turn + wx * wy * (Iy - Ix)
            M = i * dx * V - com * (V - fy) - spin  # signs of Appendix D: its x starts at B, its rates are along frame 5
            found = stress(H, N, V, M)
            if found < limit:
                break
            k = _raised(k, step, L)
        mass, first, second = total, moment, second + m * middle**2
        across_x, across_y, across_z = Ix, Iy - apart, Iz - apart
        steps[n - i], stresses[n - i], moments[n - i] = k, found, abs(M)
    return steps, stresses, moments


def _raised(k: int, step: float, length: float) -> int:
    if k >= MOST_STEPS:
        raise _too_high(step, length, "the stress limit")
    return k + 1


def _too_high(step: float, length: float, what: str) -> InputError | InfeasibleError:
    """Return the error for a search that reaches MOST_STEPS.

    The step is too small if MOST_STEPS steps are less than a fifth of the length. Otherwise there
    is no such link.
    """
    most = MOST_STEPS * step
    if most < 0.2 * length * (1.0 - 1e-9):
        least = 0.2 * length / MOST_STEPS
        return InputError(f"step is {step:g} m; {what} needs more than {MOST_STEPS} steps; use {least:.2g} m or more")
    return InfeasibleError(f"{what} needs a height of more than {most:g} m, above a fifth of the length of {length:g} m")


def _deflection_stage(start: Array, c: Array, limit: float, step: float, length: float) -> Array:
    """Return the steps added at each station (n + 1,) until sum c / H^3 is at most the limit.

    Each step is the one that reduces the deflection most.
    """
    deflection = float((c / (step * start) ** 3).sum())
    if deflection <= limit:
        return np.zeros_like(start)
    # There are enough levels once every station's last step gains less than the last step taken.
    levels = 64
    while True:
        heights = step * (start[:, None] + np.arange(levels + 1))
        gains = -np.diff(c[:, None] / heights**3, axis=1)
        order = np.argsort(-gains, axis=None, kind="stable")
        taken = np.cumsum(gains.ravel()[order])
        last = int(np.searchsorted(taken, deflection - limit))
        if last < order.size and gains.ravel()[order[last]] >= gains[:, -1].max():
            return np.bincount(order[: last + 1] // levels, minlength=start.size).astype(float)
        levels *= 2
        if levels > MOST_STEPS:
            raise _too_high(step, length, f"the deflection limit of {limit:g} m")
