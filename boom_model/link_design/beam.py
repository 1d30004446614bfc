"""A link as a tapered beam with rectangular sections: forces, von Mises stress and deflection.

Axes of the link: x points from its root (A, frame 5 of the inner link) to its end (B, frame 8); y
is across the link in the plane of the arm. The heights H (n + 1,) are given at the stations x_i = i
L / n and are linear between them. The width w is that of all plates together. With the load f, m at
the end and the body force -rho w H a(x) from the link's own motion and weight (thesis, eqs.
3.4-3.10):

    N(x) = f_x - int_x^L rho w H a_x,   V(x) = f_y - int_x^L rho w H a_y,
    M(x) = m + f_y (L - x) - int_x^L rho w H a_y (xi - x) dxi

a is the acceleration minus gravity. The mass between the middles of its neighbouring slices is
lumped at each station. The rotary inertia of the sections (rho I alpha) is neglected, as in
Euler-Bernoulli theory; it is 1e-5 of the moment in the thesis's case.
"""

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array, checked, read_only, scalar
from boom_model.errors import InputError
from boom_model.link_design.materials import Material

Support = Literal["cantilever", "pinned"]


@dataclass(frozen=True)
class Beam:
    """The properties of a link that do not change while its heights are chosen."""

    length: float
    """Distance between the pins [m]."""
    width: float
    """Width of all plates together [m]."""
    material: Material
    slices: int = 1000
    plates: int = 2
    """Number of plates, side by side and not connected.

    They share the load in the plane of the arm, and buckle out of it separately.
    """
    support: Support = "cantilever"
    """"cantilever" is clamped at its root, and its end deflects.

    "pinned" is a strut between two pins, and its middle deflects.
    """

    def __post_init__(self) -> None:
        for name, value in (("length", self.length), ("width", self.width)):
            if not scalar(name, value) > 0.0:
                raise InputError(f"{name} is {value:g} m; it must be above 0 m")
        for name, count, least in (("slices", self.slices, 2), ("plates", self.plates, 1)):
            if count != int(count) or count < least:
                raise InputError(f"{name} is {count}; it must be a whole number of at least {least}")
        if self.slices > MOST_SLICES:
            raise InputError(f"slices is {self.slices}; it must be at most {MOST_SLICES}")

    @property
    def stations(self) -> Array:
        """Positions x (n + 1,) [m]."""
        return np.linspace(0.0, self.length, self.slices + 1)

    @property
    def step(self) -> float:
        """Length of a slice [m]."""
        return self.length / self.slices

    @property
    def weights(self) -> Array:
        """Length (n + 1,) [m] that each station stands for, by the trapezoid rule."""
        weights = np.full(self.slices + 1, self.step)
        weights[[0, -1]] *= 0.5
        return weights

    @property
    def lever(self) -> Array:
        """Moment (n + 1,) [m] of a unit force at the cantilever's end or at the strut's middle.

        That is the point whose deflection is computed.
        """
        x = self.stations
        return self.length - x if self.support == "cantilever" else np.minimum(x, self.length - x) / 2.0


MOST_SLICES = 100_000

SHEAR_FACTOR = 5.0 / 6.0
"""Shear factor of a rectangle in Timoshenko's theory."""


@dataclass(frozen=True, eq=False)
class LoadCases:
    """Loads on a link at k instants, along its own axes."""

    end_force: Array
    """(k, 2) force on the link at its end [N], along x and y."""
    end_moment: Array
    """(k,) moment on the link at its end [Nm]."""
    acceleration: Array
    """(k, 2, 2) a_x and a_y as polynomials of x, constant term first [m/s^2, 1/s^2].

    They are accelerations minus gravity.
    """
    clamp: Array
    """(k,) distance from the root at which the link is clamped [m]; 0 unless it telescopes."""

    @staticmethod
    def of(
        end_force: ArrayLike, acceleration: ArrayLike, end_moment: ArrayLike | None = None, clamp: ArrayLike | None = None
    ) -> "LoadCases":
        """Return load cases of checked arrays of the shapes above.

        Raises:
            InputError: a value is not finite, or the shapes do not match.
        """
        force = checked("end force", end_force, 2)
        if force.ndim != 2 or not len(force):
            raise InputError(f"end force has shape {force.shape}; it must be (k, 2) with at least one case")
        body = checked("acceleration", acceleration, 2)
        given = [(name, np.zeros(len(force)) if a is None else checked(name, a)) for name, a in
                 (("end moment", end_moment), ("clamp", clamp))]  # fmt: skip
        for name, array, shape in (("acceleration", body, (len(force), 2, 2)), *((n, a, (len(force),)) for n, a in given)):
            if array.shape != shape:
                raise InputError(f"{name} has shape {array.shape}; with {len(force)} load cases it must be {shape}")
        return LoadCases(read_only(force), read_only(given[0][1]), read_only(body), read_only(given[1][1]))

    @property
    def count(self) -> int:
        """Number of load cases k."""
        return len(self.end_force)

    def at(self, index: ArrayLike) -> "LoadCases":
        """Return some of the cases, by their numbers."""
        pick = np.atleast_1d(np.asarray(index, dtype=int))
        return LoadCases(*(read_only(a[pick]) for a in (self.end_force, self.end_moment, self.acceleration, self.clamp)))


class Forces(NamedTuple):
    """Internal forces at the stations, (k, n + 1) each."""

    N: Array
    """[N], positive in tension"""
    V: Array
    """[N]"""
    M: Array
    """[Nm]"""


def body_acceleration(beam: Beam, cases: LoadCases) -> Array:
    """Return a_x and a_y (k, 2, n + 1) at the stations [m/s^2]."""
    a = cases.acceleration
    acceleration: Array = a[..., :1] + a[..., 1:] * beam.stations
    return acceleration


def internal_forces(beam: Beam, H: ArrayLike, cases: LoadCases) -> Forces:
    """Return normal force, shear force and bending moment in each load case.

    H (n + 1,) are the heights [m].

    Raises:
        InputError: H is not finite or has another shape.
    """
    H = _heights(beam, H)
    x, L = beam.stations, beam.length
    lumps = -beam.material.density * beam.width * beam.weights * H * body_acceleration(beam, cases)
    half = outboard_share(beam) * lumps
    beyond = beyond_each(lumps)
    N = cases.end_force[:, :1] + beyond[:, 0] + half[:, 0]
    V = cases.end_force[:, 1:] + beyond[:, 1] + half[:, 1]
    M = cases.end_moment[:, None] + cases.end_force[:, 1:] * (L - x) + beyond_each(lumps[:, 1] * x) - x * beyond[:, 1]
    if beam.support == "pinned":  # the pin at the end carries the force that makes the moment at the root zero
        V, M = V - M[:, :1] / L, M - M[:, :1] * (1.0 - x / L)
    clamped = x < cases.clamp[:, None] - 1e-12
    return Forces(*(np.where(clamped, 0.0, f) for f in (N, V, M)))


def added_by_height(beam: Beam, cases: LoadCases, weights: Forces) -> Array:
    """Return d/dH_j (n + 1,) of sum_i (weights.N N + weights.V V + weights.M M)_i over all cases.

    It is `internal_forces` in reverse.
    """
    x, L = beam.stations, beam.length
    wN, wV, wM = (np.where(x < cases.clamp[:, None] - 1e-12, 0.0, w) for w in weights)
    from_moment = before_each(wM) * x - before_each(wM * x)
    along, across = before_each(wN) + outboard_share(beam) * wN, before_each(wV) + outboard_share(beam) * wV + from_moment
    if beam.support == "pinned":
        root = (wV / L).sum(axis=1) + (wM * (1.0 - x / L)).sum(axis=1)
        across = across - root[:, None] * x
    a = body_acceleration(beam, cases)
    gradient: Array = -beam.material.density * beam.width * beam.weights * (along * a[:, 0] + across * a[:, 1]).sum(axis=0)
    return gradient


def mass(beam: Beam, H: ArrayLike) -> float:
    """Return the mass rho w int H dx [kg] (thesis, eq. 3.1)."""
    return float(beam.material.density * beam.width * (beam.weights @ _heights(beam, H)))


def von_mises(beam: Beam, H: ArrayLike, forces: Forces) -> Array:
    """Return the von Mises stress (k, n + 1) [Pa] (Appendix D; eqs. 3.11-3.14).

        sqrt((|N|/A + |M| H/2 / I)^2 + 3 (V/A)^2),  A = w H,  I = w H^3/12

    H (n + 1,) are the heights [m].
    """
    H = _heights(beam, H)
    area = beam.width * H
    normal = np.abs(forces.N) / area + 6.0 * np.abs(forces.M) / (area * H)
    stress: Array = np.hypot(normal, np.sqrt(3.0) * forces.V / area)
    return stress


def stress_height(beam: Beam, forces: Forces, limit: float) -> Array:
    """Return the least heights (k, n + 1) [m] at which `von_mises` is at most `limit` [Pa].

    Each is the single positive root of (limit w)^2 H^4 = (|N| H + 6 |M|)^2 + 3 V^2 H^2. Newton's
    method finds it from above, where the difference is convex.
    """
    N, V, M = (np.abs(f) for f in forces)
    s = limit * beam.width
    quadratic, linear, constant = N**2 + 3.0 * V**2, 12.0 * N * M, 36.0 * M**2
    bound = N + np.sqrt(3.0) * V
    H: Array = (bound + np.sqrt(bound**2 + 24.0 * s * M)) / (2.0 * s)
    for _ in range(60):
        value = s**2 * H**4 - (quadratic * H**2 + linear * H + constant)
        slope = 4.0 * s**2 * H**3 - (2.0 * quadratic * H + linear)
        down = np.divide(value, slope, out=np.zeros_like(H), where=slope > 0.0)
        H = H - np.maximum(down, 0.0)
        if (down <= 4e-16 * H).all():
            break
    return H


def deflection_coefficients(beam: Beam, M: Array) -> Array:
    """Return c (k, n + 1) [m^4] of the deflection sum_i c_i / H_i^3.

        c = 12 |M| lever dx / (E w)

    This is the moment-area method (thesis, eqs. 3.18-3.36). It uses |M|, as Appendix D
    does: if the moment changes its sign along the beam, the sum is an upper bound.
    """
    c: Array = 12.0 * np.abs(M) * beam.lever * beam.weights / (beam.material.elastic_modulus * beam.width)
    return c


def shear_coefficients(beam: Beam, V: Array) -> Array:
    """Return d (k, n + 1) [m^2] of the deflection sum_i d_i / H_i caused by shear.

        d = 1.2 |V| |dlever/dx| dx / (G w)

    This is Timoshenko's theory.
    """
    per_force = 1.0 if beam.support == "cantilever" else 0.5
    d: Array = np.abs(V) * per_force * beam.weights / (SHEAR_FACTOR * beam.material.shear_modulus * beam.width)
    return d


def deflection(beam: Beam, H: ArrayLike, forces: Forces, *, shear: bool = False) -> Array:
    """Return the deflection (k,) [m] of a cantilever's end or a strut's middle.

    See `deflection_coefficients` and `shear_coefficients`.

    Args:
        beam: the beam.
        H: (n + 1,) heights [m].
        forces: its internal forces.
        shear: whether to include the deflection by shear. The thesis does not.
    """
    H = _heights(beam, H)
    total: Array = (deflection_coefficients(beam, forces.M) / H**3).sum(axis=-1)
    if shear:
        total = total + (shear_coefficients(beam, forces.V) / H).sum(axis=-1)
    return total


def _heights(beam: Beam, H: ArrayLike) -> Array:
    H = checked("heights", H)
    if H.shape != (beam.slices + 1,):
        raise InputError(f"heights have shape {H.shape}; with {beam.slices} slices they must be ({beam.slices + 1},)")
    return H


def outboard_share(beam: Beam) -> Array:
    """Return the share of a station's own mass that lies beyond it (n + 1,)."""
    share = np.full(beam.slices + 1, 0.5)
    share[0], share[-1] = 1.0, 0.0
    return share


def beyond_each(values: Array) -> Array:
    """Return the sum over the stations beyond each one, along the last axis."""
    total: Array = np.cumsum(values[..., ::-1], axis=-1)[..., ::-1] - values
    return total


def before_each(values: Array) -> Array:
    """Return the sum over the stations before each one, along the last axis."""
    total: Array = np.cumsum(values, axis=-1) - values
    return total
