"""The thesis's two-stage search as its Appendix D does it: heights in steps of delta-H, stress first, then deflection.

Stage 1 walks from B to A and raises each slice until its von Mises stress is below the limit; a slice is as high as its station
towards A. Stage 2 freezes the moments of stage 1 and raises, step by step, the station that takes most off the deflection. Both
give Appendix D's contour without its repetitions: a slice starts its search at its neighbour's height, for heights grow towards
A; and since a step at one station changes no other's gain, stage 2 is one sorted list of all steps (the tangents of eq. 3.36,
which couple neighbours, are within 1e-9 of their angles).
"""

from dataclasses import dataclass

import numpy as np

from boom_model.arrays import Array, read_only
from boom_model.errors import InfeasibleError, InputError
from boom_model.link_design.beam import Beam, LoadCases

MOST_STEPS = 200_000
"""Steps of delta-H that a station may be high."""


@dataclass(frozen=True, eq=False)
class ThesisLoad:
    """A load case as Appendix D has it, along frame 5. One instant that need not have been: each component is a largest one."""

    applied: Array
    """(2,) sizes of the force at B along x and y [N]; it presses the link together and down."""
    acceleration: Array
    """(3,) acceleration less gravity that Appendix D gives to frame 5 [m/s^2]."""
    angular_velocity: Array
    angular_acceleration: Array

    @property
    def cases(self) -> LoadCases:
        """As a load case of the beam: pressed together and down, and its own weight with it."""
        (ax, ay, _), (wx, wy, wz), spin = self.acceleration, self.angular_velocity, self.angular_acceleration[2]
        return LoadCases.of([-self.applied], [[[ax, -(wy**2 + wz**2)], [ay, spin + wx * wy]]])


THESIS_LOAD = ThesisLoad(
    applied=read_only([758.1, 859.9]),
    acceleration=read_only([8.4931, 9.9124, 0.1649]),
    angular_velocity=read_only([0.2933, 0.4231, 0.314]),
    angular_acceleration=read_only([0.3265, 0.3770, 0.2513]),
)
"""Thesis, section 3.5 with Appendix D's digits."""

THESIS_STEP = 1e-4
"""delta-H [m]"""


@dataclass(frozen=True, eq=False)
class ThesisDesign:
    """Both stages, at the stations from A to B."""

    stress_heights: Array
    """(n + 1,) after stage 1 [m]"""
    stress: Array
    """(n + 1,) von Mises stress of stage 1 [Pa]"""
    moments: Array
    """(n + 1,) sizes of the bending moments, frozen after stage 1 [Nm]"""
    coefficients: Array
    """(n + 1,) c of the deflection sum c / H^3 [m^4], eq. 3.36"""
    heights: Array
    """(n + 1,) after stage 2 [m]"""
    stress_mass: float
    """[kg], the slices being as high as their station towards A"""
    mass: float
    stress_deflection: float
    """[m], by the method's own formula and frozen moments"""
    deflection: float
    steps: int
    """of stage 2"""


def thesis_design(
    beam: Beam, load: ThesisLoad, *, stress_limit: float, deflection_limit: float, step: float = THESIS_STEP
) -> ThesisDesign:
    """The thesis's method (sections 3.3 and 3.4, Appendix D).

    Args:
        beam: a cantilever.
        load: its one load case.
        stress_limit: von Mises stress [Pa] that every station stays below.
        deflection_limit: of the end [m].
        step: delta-H [m].

    Raises:
        InputError: a limit or the step is not above 0, the step is too small for the heights, or the beam is no cantilever.
        InfeasibleError: a station would be more than MOST_STEPS steps high, and that more than a fifth of the length.
    """
    if beam.support != "cantilever":
        raise InputError("the thesis's method is for a cantilever; a strut between two pins needs the exact method")
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
    """Heights in steps, stresses and moments at the stations from A to B, by a walk from B to A."""
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
    mass = first = second = across_x = across_y = across_z = 0.0  # of the slices so far, about B
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
            M = i * dx * V - com * (V - fy) - spin  # Appendix D's signs: its x runs from B, its rates along frame 5
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
        raise _too_high(step, length, "to hold the stress, a slice")
    return k + 1


def _too_high(step: float, length: float, what: str) -> InputError | InfeasibleError:
    """What stops a search at MOST_STEPS: the step, unless heights beyond a beam's are asked for."""
    most = MOST_STEPS * step
    if most < 0.2 * length * (1.0 - 1e-9):
        least = 0.2 * length / MOST_STEPS
        return InputError(f"step is {step:g} m; {what} needs more than {MOST_STEPS} of it: {least:.2g} m is small enough")
    return InfeasibleError(f"{what} needs more than {most:g} m of height: no such link")


def _deflection_stage(start: Array, c: Array, limit: float, step: float, length: float) -> Array:
    """Steps added at each station (n + 1,) until sum c / H^3 is at most the limit, each the one that takes most off."""
    deflection = float((c / (step * start) ** 3).sum())
    if deflection <= limit:
        return np.zeros_like(start)
    # No station needs to be higher than where its last step gains less than the greedy search's last step anywhere does.
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
            raise _too_high(step, length, f"a deflection of {limit:g} m")
