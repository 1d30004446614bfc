"""The convex problem behind a least mass, and lower bounds that do not depend on its solver.

    minimise   a . H
    subject to lower <= H <= upper,  |H_{i+1} - H_i| <= taper_i,  P_cr(H) >= P,
               sum_i C_ki / H_i^3 + D_ki / H_i <= 1

with a > 0, C >= 0 and D >= 0. P_cr, the critical load out of the plane, is concave and of the first
degree. Any multipliers of the constraints, none below 0, give a Lagrangian that is at most a . H
where the constraints hold. So its minimum is a lower bound of the cost (weak duality). Here it is a
sum over the stations, and its minimum has a closed form.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from boom_model.arrays import Array
from boom_model.errors import InfeasibleError
from boom_model.link_design.buckling import ColumnForms


@dataclass(frozen=True, eq=False)
class Column:
    """A column that must hold an end load P out of the plane."""

    capacity: Callable[[Array], float]
    """P_cr(H) / P"""
    forms: ColumnForms
    smoothing: float = 0.0
    """Cost of a squared second difference of the heights, relative to their mean, over the mean
    cost of a height. It only selects among heights that the column hardly tells apart."""


@dataclass(frozen=True, eq=False)
class Problem:
    """See the module. There are n stations and d deflections."""

    cost: Array
    """a (n,), above 0"""
    lower: Array
    """(n,), above 0"""
    upper: Array
    """(n,); inf: no limit"""
    taper: Array | None
    """(n - 1,) largest change between neighbours; None: no limit"""
    bending: Array
    """C (d, n), at least 0"""
    shear: Array
    """D (d, n), at least 0"""
    column: Column | None = None
    """None: no buckling constraint"""

    def deflections(self, H: Array) -> Array:
        """Return sum_i C_ki / H_i^3 + D_ki / H_i (d,)."""
        found: Array = self.bending @ H**-3.0 + self.shear @ (1.0 / H)
        return found


@dataclass(frozen=True, eq=False)
class Multipliers:
    """Multipliers of all constraints except the bounds of the heights.

    The Lagrangian is

        (a + slope) . H + constant + sum_k z_k (sum_i C_ki / H_i^3 + D_ki / H_i - 1)
    """

    deflections: Array
    """z (d,), at least 0"""
    slope: Array
    """(n,) of tapers and column: slope . H + constant <= 0 for all heights that keep both"""
    constant: float


def check_feasible(problem: Problem) -> None:
    """Check that the upper heights keep all constraints. They are best for each but the taper.

    Raises:
        InfeasibleError: they do not; names the constraint.
    """
    top = problem.upper
    short = np.flatnonzero(problem.lower >= top)
    if short.size:
        i = int(short[np.argmax((problem.lower - top)[short])])
        raise InfeasibleError(
            f"stress or minimum height needs {problem.lower[i]:.6g} m at station {i}, not below the maximum height "
            f"of {top[i]:.6g} m"
        )
    if not np.isfinite(top).all():
        return
    worst = float(problem.deflections(top).max(initial=0.0))
    if worst >= 1.0:
        raise InfeasibleError(f"at the maximum height of {top.max():.6g} m the deflection is still {worst:.4g} times its limit")
    if problem.column is not None and (weakest := problem.column.capacity(top)) <= 1.0:
        raise InfeasibleError(f"at the maximum height of {top.max():.6g} m the link holds {weakest:.4g} of the buckling load")


def excess(problem: Problem, H: Array) -> float:
    """Return the largest relative violation of heights, tapers, deflections; none below 0."""
    found = [float((H / problem.upper).max()), float(problem.deflections(H).max(initial=0.0))]
    if problem.taper is not None:
        found.append(float((np.abs(np.diff(H)) / problem.taper).max()))
    return max(found) - 1.0


def separable_least(cost: Array, bending: Array, shear: Array, lower: Array, upper: Array) -> Array:
    """Minimise cost H + bending / H^3 + shear / H between the bounds, for each station (n,)."""
    rising = cost > 0.0
    a = np.where(rising, cost, 1.0)
    free = np.sqrt((shear + np.sqrt(shear**2 + 12.0 * a * bending)) / (2.0 * a))
    return np.clip(np.where(rising, free, np.inf), lower, upper)


def lower_multipliers(problem: Problem, m: Multipliers) -> Array:
    """Return the multipliers (n,) of the lower heights: the Lagrangian's slope, where above 0."""
    p, z = problem, m.deflections
    rise = p.cost + m.slope - 3.0 * (z @ p.bending) / p.lower**4 - (z @ p.shear) / p.lower**2
    return np.maximum(rise, 0.0)


def convex_share(cost: Array, slope: Array) -> float:
    """Return the largest share, at most 1, of a slope that leaves cost + slope at 0 or above."""
    return min(1.0, float((cost / np.maximum(-slope, 1e-300)).min()))


def dual_value(problem: Problem, m: Multipliers, value: float) -> float:
    """Return a lower bound of a . H, from multipliers and a cost that feasible heights have.

    No height that costs less is above value / a. Rounding can leave cost + slope just below 0 at
    some station, and the bound poor. Smaller multipliers of tapers and column are just as valid, so
    the largest share of them that avoids this is tried as well.
    """
    p, z = problem, m.deflections
    bending, shear, top = z @ p.bending, z @ p.shear, np.minimum(p.upper, value / p.cost)
    found = []
    for share in (1.0, convex_share(p.cost, m.slope)):
        cost = p.cost + share * m.slope
        H = separable_least(cost, bending, shear, p.lower, top)
        found.append(float(cost @ H + bending @ H**-3.0 + shear @ (1.0 / H) - z.sum()) + share * m.constant)
    return max(found)
