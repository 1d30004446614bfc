"""Column buckling of a link: the thesis's formula, and the eigenvalue of the tapered column.

A column under the end load P and the axial load n of its own body force buckles where

    int E I v''^2 dx = int (P + n(x)) v'^2 dx,     n(x) = int_x^L rho w H a_x dx

for some deflection v that its supports allow (Timoshenko and Gere, Theory of Elastic Stability,
section 2.8). In the arm's plane I = w H^3 / 12. Out of it I = t^2 w H / 12 for loose plates of
thickness t = w / plates. That is linear in the heights, as n is. So the critical load is a concave
function of the heights, of the first degree, and P is held where a matrix that is linear in them is
positive semidefinite.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from boom_model.arrays import Array, Mask
from boom_model.link_design.beam import Beam, beyond_each, outboard_share

if TYPE_CHECKING:
    from scipy.sparse import csc_array, csr_array

THESIS_LENGTH_FACTOR = 0.7
"""K of eq. 3.38."""

Plane = Literal["across", "in-plane"]

_ELEMENTS = 60
"""Hermite cubics. The critical load of a smooth column is then right to 1e-7; rounding spoils finer
meshes."""


def euler_load(elastic_modulus: float, second_moment: float, length: float, factor: float = THESIS_LENGTH_FACTOR) -> float:
    """Return P_cr = pi^2 E I / (K L)^2 [N] of a prism (thesis, eq. 3.38)."""
    return float(np.pi**2 * elastic_modulus * second_moment / (factor * length) ** 2)


def critical_load(beam: Beam, H: Array, axial_acceleration: Array, plane: Plane = "across") -> float:
    """Return the critical end load [N] of the tapered column under its own body force.

    It is below 0 where the link does not even carry its own body force. Across the arm's plane a
    cantilever is clamped at its root and pinned at its end, as K = 0.7 of the thesis has it. In the
    plane its end is free. A strut is pinned at both ends.

    Args:
        beam: the beam.
        H: (n + 1,) heights [m].
        axial_acceleration: (2,) a_x as a polynomial of x, constant first [m/s^2, 1/s^2]. Above 0 it
            compresses the link.
        plane: the plane of buckling: across the plane of the arm, or in it.
    """
    from scipy.sparse.linalg import eigsh

    mesh, pressing = _Mesh.of(beam), _pressing(beam, axial_acceleration)
    heights = mesh.at_points(H)
    bending = _across(beam) * heights if plane == "across" else beam.material.elastic_modulus * beam.width / 12.0 * heights**3
    axial = beyond_each(pressing * H) + outboard_share(beam) * pressing * H
    own = mesh.at_points(axial)
    K = mesh.assembled(mesh.curvature, bending) - mesh.assembled(mesh.slope, own)
    G = mesh.assembled(mesh.slope, np.ones_like(own))
    free = _free(beam, mesh.elements, plane)
    # No eigenvalue is below minus the largest own load: the one nearest to that is the smallest.
    shift, start = -max(float(axial.max()), 0.0), np.ones(free.size)
    K, G = K[free][:, free], G[free][:, free]
    return float(eigsh(K, 1, G, sigma=shift, v0=start, return_eigenvectors=False)[0])


@dataclass(frozen=True, eq=False)
class ColumnForms:
    """Column that must hold an end load out of the plane, by matrices linear in the heights.

    Each element has four coordinates: deflection and slope of its near end, its mean slope, and the
    slope of its far end. Its matrix is bending . H - axial . (1 + n), with n the axial load of the
    body force at the stations, relative to the end load.

    The column holds the end load where all elements together are positive semidefinite. They are if
    for each joint there is a symmetric (2, 2) matrix of its deflection and slope such that every
    element is positive semidefinite by itself, after the matrix of its near joint is added and that
    of its far joint is subtracted (Agler and others, Positive semidefinite matrices with a given
    sparsity pattern, 1988).
    """

    bending: "csr_array"
    """(10 e, n + 1) upper triangles, column by column"""
    axial: "csr_array"
    """(10 e, n + 1)"""
    pressing: Array
    """(n + 1,) body force of each station, per height and relative to the end load"""
    outboard: Array
    """(n + 1,) share of its own body force that loads the station"""
    free: Mask
    """(e, 4) coordinates that the supports leave"""
    near: Array
    """(e, 2, 4) deflection and slope of the near end, from the coordinates"""
    far: Array
    """(e, 2, 4)"""


def column_forms(beam: Beam, axial_acceleration: Array, end_load: float) -> ColumnForms:
    """Build the matrices of a column that must hold an end load > 0 [N] and its body force."""
    from scipy.sparse import csr_array

    mesh, n = _Mesh.of(beam), beam.slices
    e, h = mesh.elements, mesh.lengths
    unit = 1.0 / np.sqrt(h.mean() * end_load)  # this slope, all along an element, takes about 1 from its matrix
    near, far = np.zeros((e, 2, 4)), np.zeros((e, 2, 4))
    near[:, 0, 0] = near[:, 1, 1] = far[:, 0, 0] = far[:, 1, 3] = 1.0
    far[:, 0, 2] = h / beam.length
    near[-1, 0] = -far[-1, 0] * np.array([0.0, 0.0, 1.0, 0.0])  # the far end of the last element is held
    free = np.ones((e, 4), dtype=bool)
    free[[0, -1], 0] = False
    free[0, 1] = beam.support != "cantilever"
    column, row = np.tril_indices(4)

    def forms(shapes: Array) -> "csr_array":
        """Integrate the products of the coordinates' derivatives; a deflection alone has none."""
        local = unit * np.stack([np.zeros_like(shapes[0]), shapes[1], shapes[2] * h[mesh.element, None], shapes[3]])
        products = local[row] * local[column] * mesh.weights  # (10, n, 3)
        at = 10 * mesh.element + np.arange(10)[:, None]
        slices = np.broadcast_to(np.arange(n), at.shape)
        values = np.stack([products @ (1.0 - mesh.share), products @ mesh.share])
        return csr_array((values.ravel(), (np.tile(at.ravel(), 2), np.stack([slices, slices + 1]).ravel())), (10 * e, n + 1))

    return ColumnForms(
        bending=_across(beam) * forms(mesh.curvature),
        axial=end_load * forms(mesh.slope),
        pressing=_pressing(beam, axial_acceleration) / end_load,
        outboard=outboard_share(beam),
        free=free,
        near=near,
        far=far,
    )


def _across(beam: Beam) -> float:
    """Return E I / H [N m] of loose plates, out of the arm's plane."""
    return float(beam.material.elastic_modulus * beam.width * (beam.width / beam.plates) ** 2 / 12.0)


def _pressing(beam: Beam, axial_acceleration: Array) -> Array:
    """Return the body force of each station per height (n + 1,) [N/m]."""
    a: Array = axial_acceleration[0] + axial_acceleration[1] * beam.stations
    return beam.material.density * beam.width * beam.weights * a


@dataclass(frozen=True, eq=False)
class _Mesh:
    """Hermite cubics with their derivatives at three points a slice.

    Each element covers whole slices, so that no station is favoured.
    """

    elements: int
    lengths: Array
    """(e,) [m]"""
    element: NDArray[np.intp]
    """(n,) each slice's"""
    first: NDArray[np.intp]
    """(e,) each element's first slice"""
    share: Array
    """(3,) of a slice, where the points lie"""
    weights: Array
    """(3,) of the points [m]"""
    slope: Array
    """(4, n, 3) v' of the shapes: deflection and slope of the near end, then of the far end"""
    curvature: Array
    """(4, n, 3)"""

    @staticmethod
    def of(beam: Beam) -> "_Mesh":
        n, dx = beam.slices, beam.step
        elements = min(n, _ELEMENTS)
        ends = np.rint(np.linspace(0, n, elements + 1)).astype(int)
        points, gauss = np.polynomial.legendre.leggauss(3)
        share = (points + 1.0) / 2.0
        element, lengths = np.repeat(np.arange(elements), np.diff(ends)), np.diff(ends) * dx
        h = np.broadcast_to(lengths[element, None], (n, 3))
        s = ((np.arange(n)[:, None] + share) - ends[element, None]) * dx / h
        slope = np.array([6 * s**2 - 6 * s, h * (1 - 4 * s + 3 * s**2), 6 * s - 6 * s**2, h * (3 * s**2 - 2 * s)]) / h
        curvature = np.array([12 * s - 6, h * (6 * s - 4), 6 - 12 * s, h * (6 * s - 2)]) / h**2
        return _Mesh(elements, lengths, element, ends[:-1], share, gauss / 2.0 * dx, slope, curvature)

    def at_points(self, values: Array) -> Array:
        """Interpolate values at stations (n + 1,) to the points (n, 3)."""
        interpolated: Array = values[:-1, None] * (1.0 - self.share) + values[1:, None] * self.share
        return interpolated

    def assembled(self, shapes: Array, values: Array) -> "csc_array":
        """Integrate values (n, 3) times the products of shapes, over all degrees of freedom."""
        from scipy.sparse import csc_array

        of = np.arange(4)
        products = (shapes[:, None] * shapes * (values * self.weights)).sum(axis=-1)
        local = np.add.reduceat(products, self.first, axis=-1)  # (4, 4, e)
        at = 2 * np.arange(self.elements)
        rows, columns = np.broadcast_arrays(at + of[:, None, None], at + of[:, None])
        size = 2 * self.elements + 2
        return csc_array((local.ravel(), (rows.ravel(), columns.ravel())), (size, size))


def _free(beam: Beam, elements: int, plane: Plane) -> NDArray[np.intp]:
    """Return the degrees of freedom (deflection and slope of each node) that the supports leave."""
    free = np.ones(2 * elements + 2, dtype=bool)
    free[0] = False
    if beam.support == "cantilever":
        free[1] = False
    if beam.support == "pinned" or plane == "across":
        free[-2] = False
    return np.flatnonzero(free)
