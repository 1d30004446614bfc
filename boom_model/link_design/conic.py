"""The convex problem of a link as a conic program, solved by Clarabel.

With w_i >= 1 / H_i and y_i >= 1 / H_i^3 the deflections are linear. Two second-order cones state
this: w H >= 1 and y H >= w^2. They need a third of the iterations of the power cone
y^(1/4) H^(3/4) >= 1, and cover the 1 / H of shear as well. Buckling out of the plane is a set of
positive semidefinite matrices of at most four rows, see `buckling.ColumnForms`. (Cutting planes
converge too slowly: after 60 of them the load was still missed by 2 %.)

Clarabel (Goulart and Chen, Clarabel: an interior-point solver for conic programs, 2024) is imported
here only. It calls no BLAS except for the small matrices of buckling, so its steps do not depend on
the processor. It needs numbers near 1. So heights are in units of heights near the answer, each of
which costs about 1, and each station's share of a deflection is about 1.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from boom_model.arrays import Array
from boom_model.errors import InfeasibleError
from boom_model.link_design.beam import before_each
from boom_model.link_design.buckling import ColumnForms
from boom_model.link_design.problem import (
    Multipliers,
    Problem,
    check_feasible,
    dual_value,
    excess,
    lower_multipliers,
    separable_least,
)

GAP = 1e-8
"""Relative duality gap that needs no further try, with the heights found as units."""

_MOST_TRIES = 3

_EXCESS = 1e-7
"""Relative violation that is allowed; in the answer only upper heights and tapers have any"""

_TOLERANCE = 1e-12
"""Clarabel's own, for the scaled problem. It stops earlier where rounding prevents progress."""


@dataclass(frozen=True, eq=False)
class Optimum:
    """Heights with their multipliers and a lower bound."""

    heights: Array
    """(n,)"""
    multipliers: Multipliers
    lower: Array
    """(n,) multipliers of the lower heights"""
    value: float
    lower_bound: float
    """No feasible heights cost less; see `problem.dual_value`"""


def solve(problem: Problem, near: Array | None = None) -> Optimum:
    """Find the heights of least cost a . H.

    With a smoothed column the heights are those of the smoothed problem, at their own cost. The
    multipliers and the bound are those of the problem without smoothing.

    Args:
        problem: the problem.
        near: (n,) heights near the answer, if known.

    Raises:
        InfeasibleError: not even the upper heights keep the constraints (says which one), or the
            solver does not converge.
    """
    p = problem
    check_feasible(p)
    unit = _guess(p) if near is None else np.clip(near, p.lower, p.upper)
    best, value, lower_bound = None, np.inf, -np.inf
    multipliers: Multipliers | None = None
    smoothed = p.column is not None and p.column.smoothing > 0.0
    for smooth in [True, False] if smoothed else [False] * _MOST_TRIES:
        heights, found = _by_clarabel(p, unit, smooth)
        if not np.isfinite(heights).all():
            break
        multipliers = found
        unit = np.clip(heights, p.lower, p.upper)
        kept = _repaired(p, unit)
        if kept is not None and p.cost @ kept < value and (smooth or best is None or not smoothed):
            best, value = kept, float(p.cost @ kept)
        if best is not None:
            lower_bound = max(lower_bound, dual_value(p, multipliers, value))
            if value - lower_bound <= GAP * value:
                break
    if best is None or multipliers is None:
        raise InfeasibleError("the least mass was not found: the solver of its conic program does not converge")
    return Optimum(best, multipliers, lower_multipliers(p, multipliers), value, lower_bound)


def _guess(p: Problem) -> Array:
    """Guess heights: one multiplier for all deflections, such that these hold, then the tapers."""
    low, high = -30.0, 30.0
    for _ in range(40):
        level = (low + high) / 2.0
        price = np.exp(level) * float(p.cost.sum())
        H = separable_least(p.cost, price * p.bending.sum(axis=0), price * p.shear.sum(axis=0), p.lower, p.upper)
        low, high = (level, high) if p.deflections(H).max(initial=0.0) > 1.0 else (low, level)
    return _tapered(p, H)


def _tapered(p: Problem, H: Array) -> Array:
    """Return the lowest heights that keep the tapers and are not below H."""
    if p.taper is None:
        return H
    climb = np.concatenate([[0.0], np.cumsum(p.taper)])
    outwards = np.maximum.accumulate(H + climb) - climb
    inwards = np.maximum.accumulate((H - climb)[::-1])[::-1] + climb
    found: Array = np.minimum(np.maximum(outwards, inwards), p.upper)
    return found


def _repaired(p: Problem, H: Array) -> Array | None:
    """Raise heights to keep tapers, then scale them up to keep deflections and the column's load.

    Deflections fall at least like 1 / H. Returns None where too much is missing.
    """
    H = _tapered(p, H)
    ratios = p.deflections(H)
    if p.column is not None:
        capacity = p.column.capacity(H)
        ratios = np.append(ratios, 1.0 / capacity if capacity > 0.0 else np.inf)
    most = float(ratios.max(initial=1.0))
    if not most < 2.0:
        return None
    kept: Array = np.minimum(H * most, p.upper)
    return kept if excess(p, kept) <= _EXCESS else None


class _Program:
    """A conic program A x + s = b, s in cones, collected block by block."""

    def __init__(self, size: int) -> None:
        self.size, self.cones, self._right = size, list[Any](), list[Array]()
        self._entries: list[tuple[NDArray[np.intp], NDArray[np.intp], Array]] = []

    def add(self, cones: list[Any], right: Array, *entries: tuple[ArrayLike, ArrayLike, ArrayLike]) -> slice:
        """Add rows by their (rows, columns, values), rows counted from 0; return where they are."""
        first = sum(r.size for r in self._right)
        for rows, columns, values in entries:
            at, of, value = (np.ravel(a) for a in np.broadcast_arrays(rows, columns, values))
            self._entries.append((first + at, of, value))
        self.cones += cones
        self._right.append(right)
        return slice(first, first + right.size)

    def solve(self, cost: Array, quadratic: Any) -> tuple[Array, Array]:
        """Minimise x . quadratic . x / 2 + cost . x; return x and the multipliers of the cones.

        Raises:
            InfeasibleError: there is no x.
        """
        import clarabel
        from scipy.sparse import csc_matrix

        b = np.concatenate(self._right)
        rows, columns, values = (np.concatenate(each) for each in zip(*self._entries, strict=True))
        A = csc_matrix((values, (rows, columns)), shape=(b.size, self.size))
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.direct_solve_method = "qdldl"
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = _TOLERANCE
        # The problem is scaled already. Refinement takes a third of the time and gains no digits.
        settings.equilibrate_enable = settings.iterative_refinement_enable = False
        found = clarabel.DefaultSolver(quadratic, cost, A, b, self.cones, settings).solve()
        if "PrimalInfeasible" in str(found.status):
            raise InfeasibleError("no heights keep all of the limits together")
        return np.asarray(found.x), np.asarray(found.z)


def _by_clarabel(p: Problem, unit: Array, smooth: bool) -> tuple[Array, Multipliers]:
    """Solve with heights in the given units; return heights and multipliers.

    Variables: u = H / unit; w >= 1 / u and y >= 1 / u^3 where a deflection needs them; for a column
    the axial load of its body force at the stations, and a symmetric (2, 2) matrix at each joint.
    """
    from clarabel import NonnegativeConeT, SecondOrderConeT
    from scipy.sparse import csc_matrix, diags_array, triu

    n, d = p.cost.size, len(p.bending)
    bending, shear = p.bending / unit**3, p.shear / unit
    bent = np.flatnonzero((bending + shear).sum(axis=0) > 1e-14 * bending.sum())
    m, worth = bent.size, float(p.cost @ unit) / n
    forms = None if p.column is None else p.column.forms
    joints = 0 if forms is None else len(forms.free) - 1
    u, w, y = np.arange(n), n + np.arange(m), n + m + np.arange(m)
    program = _Program(n + 2 * m + (0 if forms is None else n + 3 * joints))
    program.add([NonnegativeConeT(n)], -p.lower / unit, (u, u, -1.0))
    top = np.flatnonzero(np.isfinite(p.upper))
    program.add([NonnegativeConeT(top.size)], (p.upper / unit)[top], (np.arange(top.size), top, 1.0))
    k = np.arange(d)[:, None]
    deflections = program.add(
        [NonnegativeConeT(d)], np.full(d, float(n)), (k, w, n * shear[:, bent]), (k, y, n * bending[:, bent])
    )
    scale = None if p.taper is None else p.taper + unit[1:]
    tapers = [
        program.add(
            [NonnegativeConeT(n - 1)],
            p.taper / scale,
            (u[:-1], u[1:], sign * unit[1:] / scale),
            (u[:-1], u[:-1], -sign * unit[:-1] / scale),
        )
        for sign in (1.0, -1.0)
        if p.taper is not None and scale is not None
    ]
    i = 6 * np.arange(m)  # (w + u, w - u, 2) and (y + u, y - u, 2 w) in second-order cones
    program.add(
        [SecondOrderConeT(3)] * (2 * m),
        np.tile([0.0, 0.0, 2.0, 0.0, 0.0, 0.0], m),
        ([i, i + 1, i + 3, i + 4], bent, [[-1.0], [1.0], [-1.0], [1.0]]),
        ([i, i + 1, i + 5], w, [[-1.0], [-1.0], [-2.0]]),
        ([i + 3, i + 4], y, -1.0),
    )
    quadratic = csc_matrix((program.size, program.size))
    elements = slice(0)
    if forms is not None:
        elements = _add_column(program, forms, unit, n + 2 * m)
        if smooth and p.column is not None:
            size = np.sqrt(p.column.smoothing) * unit / unit.mean()
            bend = diags_array([size[:-2], -2.0 * size[1:-1], size[2:]], offsets=[0, 1, 2], shape=(n - 2, program.size))
            quadratic = csc_matrix(triu(bend.T @ bend))
            quadratic.sort_indices()
    x, dual = program.solve(np.concatenate([p.cost * unit / worth, np.zeros(program.size - n)]), quadratic)
    dual = worth * dual
    slope, constant = np.zeros(n), 0.0
    if p.taper is not None and scale is not None:
        rising, falling = (np.maximum(dual[rows], 0.0) / scale for rows in tapers)
        slope[1:] += rising - falling
        slope[:-1] -= rising - falling
        constant -= float((rising + falling) @ p.taper)
    if forms is not None:
        by_column, load = _column_slope(forms, dual[elements])
        slope, constant = slope + by_column, constant + load
    return x[:n] * unit, Multipliers(n * np.maximum(dual[deflections], 0.0), slope, constant)


_COLUMN, _ROW = np.tril_indices(4)
"""Position of each of the ten entries of an element's matrix"""

_TIMES = np.where(_ROW == _COLUMN, 1.0, np.sqrt(2.0))
"""Clarabel scales off-diagonal entries by this"""


def _entries(forms: ColumnForms) -> NDArray[np.intp]:
    """Return the entries that the supports leave, out of ten an element."""
    return np.flatnonzero(forms.free[:, _ROW] & forms.free[:, _COLUMN])


def _add_column(program: _Program, forms: ColumnForms, unit: Array, first: int) -> slice:
    """Add a column whose variables start at `first`; return the rows of its elements."""
    from clarabel import PSDTriangleConeT, ZeroConeT

    n, joints = unit.size, len(forms.free) - 1
    u, axial, handed = np.arange(n), first + np.arange(n), first + n + np.arange(3 * joints).reshape(joints, 3)
    # From one station to the next the axial load changes by the body forces between them.
    outboard = forms.outboard * forms.pressing * unit
    inboard = forms.pressing * unit - outboard
    program.add(
        [ZeroConeT(n)],
        np.zeros(n),
        (u, axial, 1.0),
        (u, u, -outboard),
        (u[:-1], axial[1:], -1.0),
        (u[:-1], u[1:], -inboard[1:]),
    )
    kept = _entries(forms)
    times = _TIMES[kept % 10]
    bending, pressed = ((times[:, None] * form[kept]).tocoo() for form in (forms.bending, forms.axial))
    taken = []
    for ends, joint, sign in ((forms.near, kept // 10 - 1, -1.0), (forms.far, kept // 10, 1.0)):
        v, slope = ends[:, 0], ends[:, 1]
        of_joint = [v[:, _ROW] * v[:, _COLUMN], v[:, _ROW] * slope[:, _COLUMN] + slope[:, _ROW] * v[:, _COLUMN]]
        of_joint.append(slope[:, _ROW] * slope[:, _COLUMN])
        there = np.flatnonzero((joint >= 0) & (joint < joints))
        values = sign * times[:, None] * np.stack(of_joint, axis=-1).reshape(-1, 3)[kept]
        taken.append((there[:, None], handed[joint[there]], values[there]))
    return program.add(
        [PSDTriangleConeT(int(size)) for size in forms.free.sum(axis=1)],
        -np.asarray(pressed.sum(axis=1)).ravel(),
        (bending.row, bending.col, -bending.data * unit[bending.col]),
        (pressed.row, axial[pressed.col], pressed.data),
        *taken,
    )


def _column_slope(forms: ColumnForms, dual: Array) -> tuple[Array, float]:
    """Return slope and constant of a column in the Lagrangian, by its elements' multipliers.

    For any deflection v that the supports allow, heights that hold the load fulfil
    v . K(H) v >= v . G v, which is linear in them. The multipliers are nearly those of one v: the
    largest eigenvectors of the elements, joined. Slopes at the joints and mean slopes are a
    deflection if the mean slopes add up to 0. So the bound is valid, however good the multipliers.
    """
    packed = np.zeros(10 * len(forms.free))
    kept = _entries(forms)
    packed[kept] = dual / _TIMES[kept % 10]
    Z = np.zeros((len(forms.free), 4, 4))
    Z[:, _ROW, _COLUMN] = Z[:, _COLUMN, _ROW] = packed.reshape(-1, 10)
    values, vectors = np.linalg.eigh(Z)
    v = vectors[..., -1] * np.sqrt(np.maximum(values[:, -1:], 0.0))
    far, near = (np.einsum("eij,ej->ei", ends, v) for ends in (forms.far, forms.near))
    turned = (far[:-1] * near[1:]).sum(axis=1) < 0.0
    v[1:] *= np.where(np.cumsum(turned) % 2, -1.0, 1.0)[:, None]
    v[1:, 1] = v[:-1, 3] = (v[1:, 1] + v[:-1, 3]) / 2.0
    length = forms.far[:, 0, 2]
    v[:, 2] -= (length @ v[:, 2]) / length.sum()
    energy = (v[:, _ROW] * v[:, _COLUMN] * _TIMES**2).ravel()
    axial = energy @ forms.axial
    own = forms.pressing * (before_each(axial) + forms.outboard * axial)
    return own - energy @ forms.bending, float(axial.sum())
