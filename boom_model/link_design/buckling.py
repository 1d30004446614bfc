"""Column buckling of a link: the thesis's formula for a prism, and an eigenvalue for a taper.

A column under the end load P and the axial load of its own body force is stable until, for some
deflection v(x) that its supports allow,

    int E I v''^2 dx = int (P + n(x)) v'^2 dx,     n(x) = int_x^L rho w H a_x

(Timoshenko and Gere, Theory of Elastic Stability, section 2.8). Out of the plane of the arm, I =
t^2 w H / 12 for separate plates of thickness t = w / plates. I is then linear in the heights, and
so is n. The critical load is therefore a concave function of the heights, homogeneous of degree
one, and its gradient gives an upper bound everywhere. In the plane of the arm, I = w H^3 / 12.
"""

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from boom_model.arrays import Array
from boom_model.link_design.beam import Beam, before_each, beyond_each, outboard_share

THESIS_LENGTH_FACTOR = 0.7
"""K of eq. 3.38."""

Plane = Literal["across", "in-plane"]

_ELEMENTS = 60
"""Number of cubic Hermite elements.

The critical load of a smooth column is then accurate to 1e-7; finer meshes add rounding errors.
"""


def euler_load(elastic_modulus: float, second_moment: float, length: float, factor: float = THESIS_LENGTH_FACTOR) -> float:
    """Return the Euler load P_cr = pi^2 E I / (K L)^2 [N] of a prism (thesis, eq. 3.38)."""
    return float(np.pi**2 * elastic_modulus * second_moment / (factor * length) ** 2)


_MODES = 16


class Buckling(NamedTuple):
    """A critical end load and its derivatives by the heights."""

    load: float
    """[N]; negative if the link cannot even carry its own body force."""
    gradient: Array
    """(n + 1,) d load / d H [N/m]"""
    curvature: Array
    """(modes, n + 1): out of the plane, d^2 load / dH^2 = -curvature^T curvature"""


def critical_load(beam: Beam, H: Array, axial_acceleration: Array, plane: Plane = "across") -> Buckling:
    """Return the critical end load of the tapered column under its own body force.

    It uses cubic Hermite elements. Across the plane of the arm, a cantilever is clamped at its root
    and guided at its end, as the thesis's K = 0.7 implies, and a strut is pinned at both ends. In
    the plane of the arm, the end of a cantilever is free.

    Args:
        beam: the beam.
        H: (n + 1,) heights [m].
        axial_acceleration: (2,) a_x as a polynomial of x, constant term first [m/s^2, 1/s^2]; a
            positive value compresses the link.
        plane: plane of the deflection.
    """
    from scipy.linalg import eigh

    n, dx = beam.slices, beam.step
    elements = min(n, _ELEMENTS)
    ends = np.rint(np.linspace(0, n, elements + 1)).astype(int)  # whole slices, so that all stations are treated alike
    points, gauss = np.polynomial.legendre.leggauss(3)
    share = (points + 1.0) / 2.0
    element = np.repeat(np.arange(elements), np.diff(ends))[:, None]
    h = np.broadcast_to((np.diff(ends) * dx)[element], (n, 3))
    s = ((np.arange(n)[:, None] + share) - ends[element]) * dx / h
    slope = np.array([6 * s**2 - 6 * s, h * (1 - 4 * s + 3 * s**2), 6 * s - 6 * s**2, h * (3 * s**2 - 2 * s)]) / h
    curvature = np.array([12 * s - 6, h * (6 * s - 4), 6 - 12 * s, h * (6 * s - 2)]) / h**2
    weights = gauss / 2.0 * dx

    def at_points(values: Array) -> Array:
        """Interpolate values (n + 1,) at the integration points (n, 3)."""
        interpolated: Array = values[:-1, None] * (1.0 - share) + values[1:, None] * share
        return interpolated

    def to_stations(values: Array) -> Array:
        """Apply the adjoint of `at_points` with the weights of the integral.

        The shapes are (..., n, 3) and (..., n + 1).
        """
        total: Array = np.zeros((*values.shape[:-2], n + 1))
        total[..., :-1] += values @ (weights * (1.0 - share))
        total[..., 1:] += values @ (weights * share)
        return total

    E, w = beam.material.elastic_modulus, beam.width
    if plane == "across":
        per_height = np.full((n, 3), E * w * (w / beam.plates) ** 2 / 12.0)
        bending = per_height * at_points(H)
    else:
        bending, per_height = E * w / 12.0 * at_points(H) ** 3, E * w / 4.0 * at_points(H) ** 2
    pressing = beam.material.density * w * beam.weights * (axial_acceleration[0] + axial_acceleration[1] * beam.stations)
    own = at_points(beyond_each(pressing * H) + outboard_share(beam) * pressing * H)

    def stiffness(shapes: Array, values: Array) -> Array:
        local = np.einsum("aki,bki,ki->kab", shapes, shapes, values * weights)
        return _assembled(np.add.reduceat(local, ends[:-1], axis=0), elements)[np.ix_(free, free)]

    free = _free(beam, elements, plane)
    K = stiffness(curvature, bending) - stiffness(slope, own)
    values, vectors = eigh(K, stiffness(slope, np.ones((n, 3))))
    v = np.zeros((len(values), 2 * elements + 2))
    v[:, free] = vectors.T
    local = v[:, 2 * element + np.arange(4)]  # (modes, n, 4), scaled to int v'^2 dx = 1
    bent = np.einsum("mka,aki->mki", local, curvature)
    turned = np.einsum("mka,aki->mki", local, slope)
    weight = to_stations(turned[0] * turned)
    coupled = to_stations(per_height * bent[0] * bent) - pressing * (before_each(weight) + outboard_share(beam) * weight)
    curved = coupled[1:] * np.sqrt(2.0 / (values[1:] - values[0]))[:, None]
    return Buckling(float(values[0]), coupled[0], curved)


def _free(beam: Beam, elements: int, plane: Plane) -> NDArray[np.intp]:
    """Return the degrees of freedom that the supports leave: deflection and slope at each node."""
    free = np.ones(2 * elements + 2, dtype=bool)
    free[0] = False
    if beam.support == "cantilever":
        free[1] = False
    if beam.support == "pinned" or plane == "across":
        free[-2] = False
    return np.flatnonzero(free)


def _assembled(local: Array, elements: int) -> Array:
    """Assemble element matrices (e, 4, 4) into one (2 e + 2, 2 e + 2)."""
    whole = np.zeros((2 * elements + 2,) * 2)
    at = 2 * np.arange(elements)[:, None] + np.arange(4)
    np.add.at(whole, (at[:, :, None], at[:, None, :]), local)
    return whole
