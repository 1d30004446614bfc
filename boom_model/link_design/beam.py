"""A link as a tapered beam of rectangular sections: internal forces, von Mises stress, deflection.

Axes of the link: x from its root (A, frame 5 of the inner link) to its end (B, frame 8), y across it in the arm's plane.
Heights H (n + 1,) stand at stations x_i = i L / n and run linearly between them; the width w is that of all plates together.
With the load f, m at the end and the body force -rho w H a(x) of the link's own motion and weight (thesis, eqs. 3.4-3.10):

    N(x) = f_x - int_x^L rho w H a_x,   V(x) = f_y - int_x^L rho w H a_y,
    M(x) = m + f_y (L - x) - int_x^L rho w H a_y (xi - x) dxi

a is the acceleration less gravity; a station carries the mass between the middles of its slices. Rotary inertia of the sections
(rho I alpha) is left out, as Euler-Bernoulli's theory does: 1e-5 of the moment in the thesis's case.
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
    """What of a link does not change while its heights are chosen."""

    length: float
    """Between the pins [m]."""
    width: float
    """Of all plates together [m]."""
    material: Material
    slices: int = 1000
    plates: int = 2
    """Loose side by side: they share the load in the arm's plane, and buckle out of it one by one."""
    support: Support = "cantilever"
    """"cantilever" is held at its root, and its end deflects; "pinned" is a strut between two pins, and its middle does."""

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
        """x (n + 1,) [m]."""
        return np.linspace(0.0, self.length, self.slices + 1)

    @property
    def step(self) -> float:
        return self.length / self.slices

    @property
    def weights(self) -> Array:
        """Length (n + 1,) [m] that each station stands for: the trapezoid rule's."""
        weights = np.full(self.slices + 1, self.step)
        weights[[0, -1]] *= 0.5
        return weights

    @property
    def lever(self) -> Array:
        """Moment (n + 1,) [m] of a unit force where the deflection counts: at a cantilever's end, at a strut's middle."""
        x = self.stations
        return self.length - x if self.support == "cantilever" else np.minimum(x, self.length - x) / 2.0


MOST_SLICES = 100_000

SHEAR_FACTOR = 5.0 / 6.0
"""Of a rectangle, in Timoshenko's theory."""


@dataclass(frozen=True, eq=False)
class LoadCases:
    """What a link bears at each of k instants, along its own axes."""

    end_force: Array
    """(k, 2) on the link at its end [N], x along it, y across."""
    end_moment: Array
    """(k,) on the link at its end [Nm]."""
    acceleration: Array
    """(k, 2, 2) a_x and a_y as polynomials of x, constant first: acceleration less gravity [m/s^2, 1/s^2]."""
    clamp: Array
    """(k,) where the link is held, from its root [m]: 0, but for what telescopes."""

    @staticmethod
    def of(
        end_force: ArrayLike, acceleration: ArrayLike, end_moment: ArrayLike | None = None, clamp: ArrayLike | None = None
    ) -> "LoadCases":
        """Load cases from arrays of the shapes above, checked.

        Raises:
            InputError: not finite, or shapes that do not match.
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
        return len(self.end_force)

    def at(self, index: ArrayLike) -> "LoadCases":
        """Some of the cases, by their numbers."""
        pick = np.atleast_1d(np.asarray(index, dtype=int))
        return LoadCases(*(read_only(a[pick]) for a in (self.end_force, self.end_moment, self.acceleration, self.clamp)))


class Forces(NamedTuple):
    """Internal forces at the stations, (k, n + 1) each."""

    N: Array
    """[N], tension positive"""
    V: Array
    """[N]"""
    M: Array
    """[Nm]"""


def body_acceleration(beam: Beam, cases: LoadCases) -> Array:
    """a_x and a_y (k, 2, n + 1) at the stations [m/s^2]."""
    a = cases.acceleration
    acceleration: Array = a[..., :1] + a[..., 1:] * beam.stations
    return acceleration


def internal_forces(beam: Beam, H: ArrayLike, cases: LoadCases) -> Forces:
    """Normal force, shear and bending moment of a beam of heights H (n + 1,) [m] under each load case.

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
    if beam.support == "pinned":  # the end's pin carries what keeps the root free of moment
        V, M = V - M[:, :1] / L, M - M[:, :1] * (1.0 - x / L)
    held = x < cases.clamp[:, None] - 1e-12
    return Forces(*(np.where(held, 0.0, f) for f in (N, V, M)))


def added_by_height(beam: Beam, cases: LoadCases, weights: Forces) -> Array:
    """d/dH_j (n + 1,) of sum_i (weights.N N + weights.V V + weights.M M)_i over all cases, `internal_forces` in reverse."""
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
    """rho w int H dx [kg] (thesis, eq. 3.1)."""
    return float(beam.material.density * beam.width * (beam.weights @ _heights(beam, H)))


def von_mises(beam: Beam, H: ArrayLike, forces: Forces) -> Array:
    """sqrt((|N|/A + |M| H/2 / I)^2 + 3 (V/A)^2) (k, n + 1) [Pa], A = w H, I = w H^3/12 (Appendix D; eqs. 3.11-3.14)."""
    H = _heights(beam, H)
    area = beam.width * H
    normal = np.abs(forces.N) / area + 6.0 * np.abs(forces.M) / (area * H)
    stress: Array = np.hypot(normal, np.sqrt(3.0) * forces.V / area)
    return stress


def stress_height(beam: Beam, forces: Forces, limit: float) -> Array:
    """Least heights (k, n + 1) [m] at which `von_mises` is at most `limit` [Pa].

    The one positive root of (limit w)^2 H^4 = (|N| H + 6 |M|)^2 + 3 V^2 H^2, by Newton's method from above, where the
    difference is convex.
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
    """c (k, n + 1) [m^4] of the deflection sum_i c_i / H_i^3, by moment area (thesis, eqs. 3.18-3.36): 12 |M| lever dx / (E w).

    The size of M stands there, as in Appendix D: where a moment changes its sign along the beam, the sum is an upper bound.
    """
    c: Array = 12.0 * np.abs(M) * beam.lever * beam.weights / (beam.material.elastic_modulus * beam.width)
    return c


def shear_coefficients(beam: Beam, V: Array) -> Array:
    """d (k, n + 1) [m^2] of the deflection sum_i d_i / H_i that shear adds (Timoshenko): 1.2 |V| |dlever/dx| dx / (G w)."""
    per_force = 1.0 if beam.support == "cantilever" else 0.5
    d: Array = np.abs(V) * per_force * beam.weights / (SHEAR_FACTOR * beam.material.shear_modulus * beam.width)
    return d


def deflection(beam: Beam, H: ArrayLike, forces: Forces, *, shear: bool = False) -> Array:
    """Deflection (k,) [m] of a cantilever's end or a strut's middle: see the coefficients above.

    Args:
        shear: whether to count the sections' shear. The thesis does not.
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
    """How much of a station's own mass lies beyond it (n + 1,)."""
    share = np.full(beam.slices + 1, 0.5)
    share[0], share[-1] = 1.0, 0.0
    return share


def beyond_each(values: Array) -> Array:
    """Sum over the stations beyond each, along the last axis."""
    total: Array = np.cumsum(values[..., ::-1], axis=-1)[..., ::-1] - values
    return total


def before_each(values: Array) -> Array:
    """Sum over the stations before each, along the last axis."""
    total: Array = np.cumsum(values, axis=-1) - values
    return total
