"""The convex problem behind a least mass, by an interior-point method, with a lower bound that needs no trust in it.

    minimise   a . H
    subject to lower <= H <= upper,  |H_{i+1} - H_i| <= taper_i,  sum_i C_ki / H_i^3 <= 1,  P(H) >= 1

with C >= 0 and P concave and of the first degree. Multipliers z fulfil the optimality conditions (Karush, Kuhn, Tucker) up to
the gap. Without taper and P these say that a station is as high as its lower bound asks or as (3 z . C_i / a_i)^(1/4): material
goes where it takes most off the deflections. Method: Mehrotra's predictor and corrector with slacks (Nocedal and Wright,
Numerical Optimization, section 19.3); the
Newton matrix is tridiagonal plus a few columns. The deflections enter as 1 - (sum_i C_ki / H_i^3)^(-1/3) <= 0:
the same set, but of the first degree in H, which Newton's method follows in large steps.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from boom_model.arrays import Array
from boom_model.errors import InfeasibleError

GAP = 1e-8
"""Relative duality gap at which the method stops."""

_EXCESS = 1e-7
"""By which a constraint may be missed, as a share; only tapers and the upper heights still are in the answer."""

_MOST_ITERATIONS = 200
_PATIENCE = 60


@dataclass(frozen=True, eq=False)
class Problem:
    """See the module; n stations, d deflections."""

    cost: Array
    """a (n,), above 0"""
    lower: Array
    upper: Array
    taper: Array | None
    """(n - 1,) largest change between neighbours; None leaves it free"""
    deflections: Array
    """C (d, n), at least 0"""
    capacity: "Callable[[Array], Capacity] | None" = None
    """P; None asks for none"""


class Capacity(NamedTuple):
    """P at some heights."""

    value: float
    gradient: Array
    """(n,)"""
    curvature: Array
    """(m, n): P'' = -curvature^T curvature"""


class Multipliers(NamedTuple):
    """One for each constraint, at least 0."""

    lower: Array
    upper: Array
    rising: Array
    falling: Array
    deflections: Array
    capacity: Array
    """(1,), or (0,) where none is asked for"""


@dataclass(frozen=True, eq=False)
class Optimum:
    """Heights, multipliers, and how good they are."""

    heights: Array
    multipliers: Multipliers
    value: float
    lower_bound: float
    """Least a . H that any feasible heights can have: the Lagrange dual at the multipliers; far off, or -inf, where the method
    stalls."""
    iterations: int


def solve(problem: Problem) -> Optimum:
    """The least a . H.

    Raises:
        InfeasibleError: not even the upper heights keep the constraints; says which one, or the method does not converge.
    """
    check_feasible(problem)
    p = _scaled(problem)
    scale = float(problem.upper.max())
    x = _start(p)
    s = np.maximum(-_values(p, x, _capacity(p, x)), 1e-3)
    z = 0.1 * float(p.cost @ x) / s.size / s
    best: tuple[float, Array, Multipliers] | None = None
    lower_bound, gap, improved = -np.inf, np.inf, 0
    for iteration in range(_MOST_ITERATIONS):
        capacity = _capacity(p, x)
        f = _values(p, x, capacity)
        s = np.maximum(s, -f)  # a slack that the constraint has is no error
        multipliers = _multipliers(p, x, z)
        value, excess = float(p.cost @ x), float(np.max(f))
        # Scaled up by what they miss, heights keep deflections and capacity, which are of the first degree.
        parts = _split(p, f)
        missed = max(float(parts.deflections.max(initial=0.0)), float(parts.capacity.max(initial=0.0)))
        kept = np.maximum(x, p.lower) * (1.0 + missed)
        lower_bound = max(
            lower_bound, *(_dual_value(p, m, capacity) for m in (multipliers, _balanced(p, x, multipliers, capacity)))
        )
        if excess <= _EXCESS and (best is None or p.cost @ kept < best[0]):
            best = float(p.cost @ kept), kept, multipliers
        if best is not None and best[0] - lower_bound < 0.9 * gap:
            gap, improved = best[0] - lower_bound, iteration
        mean, error = float(s @ z) / s.size, float(np.abs(f + s).max())
        patience = _PATIENCE if best is None or gap > 1e-3 * best[0] else 5
        if best is not None and (gap <= GAP * best[0] or iteration > improved + patience):
            break
        try:
            newton = _Newton(p, x, s, z, capacity)
        except np.linalg.LinAlgError:  # rounding, at the very end
            break
        _, ds, dz = newton.step(f + s, s * z)
        reach_s, reach_z = _reach(s, ds), _reach(z, dz)
        ahead = float((s + reach_s * ds) @ (z + reach_z * dz)) / s.size
        target = max(mean * min((ahead / mean) ** 3, 0.5), 0.1 * error * value / s.size)  # no nearer than the errors allow
        dx, ds, dz = newton.step(f + s, s * z + ds * dz * min(reach_s, reach_z) - target)
        reach_s, reach_z = 0.99 * min(_reach(s, ds), _reach(x, dx)), 0.99 * _reach(z, dz)
        x, s, z = x + reach_s * dx, s + reach_s * ds, z + reach_z * dz
    if best is None:
        raise InfeasibleError(f"the least mass was not found: no feasible heights after {iteration} steps")
    value, x, m = best
    m = m._replace(deflections=m.deflections * scale, capacity=m.capacity * scale)
    return Optimum(np.clip(x * scale, problem.lower, problem.upper), m, value * scale, lower_bound * scale, iteration)


def _start(p: Problem) -> Array:
    """The lower heights, with the tapers up to them, filled up to the level that keeps deflections and capacity, and more."""
    least = p.lower
    if p.taper is not None:
        climb = np.concatenate([[0.0], np.cumsum(p.taper)])
        outwards = np.maximum.accumulate(least + climb) - climb
        inwards = np.maximum.accumulate((least - climb)[::-1])[::-1] + climb
        least = np.maximum(outwards, inwards)
    low, high = 0.0, 1.0
    for _ in range(12):
        level = (low + high) / 2.0
        x = np.maximum(least, level)
        f = _split(p, _values(p, x, _capacity(p, x)))
        kept = max(f.deflections.max(initial=0.0), f.capacity.max(initial=0.0)) <= 0.0
        low, high = (low, level) if kept else (level, high)
    x = np.maximum(least, high)
    return x + 0.05 * (x if p.taper is None else float(x.min()))


def _capacity(p: Problem, x: Array) -> Capacity | None:
    return None if p.capacity is None else p.capacity(x)


def check_feasible(problem: Problem) -> None:
    """Whether the upper heights keep every constraint: they are the best for all of them but the taper.

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
    worst = float((problem.deflections / top**3).sum(axis=1).max(initial=0.0))
    if worst >= 1.0:
        raise InfeasibleError(f"at the maximum height of {top.max():.6g} m the deflection is still {worst:.4g} times its limit")
    capacity = _capacity(problem, top)
    if capacity is not None and (weakest := capacity.value) <= 1.0:
        raise InfeasibleError(f"at the maximum height of {top.max():.6g} m the link holds {weakest:.4g} of the buckling load")


def _scaled(problem: Problem) -> Problem:
    """In units of the largest upper height."""
    s, capacity = float(problem.upper.max()), problem.capacity
    return Problem(
        cost=problem.cost,
        lower=problem.lower / s,
        upper=problem.upper / s,
        taper=None if problem.taper is None else problem.taper / s,
        deflections=problem.deflections / s**3,
        capacity=None if capacity is None else lambda x: _in_units(capacity(x * s), s),
    )


def _in_units(c: Capacity, s: float) -> Capacity:
    return Capacity(c.value, c.gradient * s, c.curvature * s)


def _reach(values: Array, step: Array) -> float:
    """How much of a step keeps values above 0, at most all of it."""
    down = step < 0.0
    return min(1.0, float(np.min(-values[down] / step[down], initial=np.inf)))


def _split(p: Problem, stacked: Array) -> Multipliers:
    n, tapers = p.cost.size, 0 if p.taper is None else p.taper.size
    parts = np.split(stacked, np.cumsum([n, n, tapers, tapers, len(p.deflections)]))
    return Multipliers(*parts)


def _values(p: Problem, x: Array, capacity: Capacity | None) -> Array:
    """Every constraint as f <= 0."""
    slope = np.diff(x)
    tapers = [] if p.taper is None else [slope - p.taper, -slope - p.taper]
    short = [] if capacity is None else [1.0 - capacity.value]
    return np.concatenate([p.lower - x, x - p.upper, *tapers, 1.0 - (p.deflections @ x**-3.0) ** (-1.0 / 3.0), short])


class _Newton:
    """The optimality conditions' linear system at heights x, slacks s and multipliers z, factored once for two steps."""

    def __init__(self, p: Problem, x: Array, s: Array, z: Array, capacity: Capacity | None) -> None:
        from scipy.linalg import cholesky_banded

        self._p, self._s, self._z = p, s, z
        S = p.deflections @ x**-3.0
        self._gradients = S[:, None] ** (-4.0 / 3.0) * p.deflections * x**-4.0
        multipliers, weights = _split(p, z), _split(p, z / s)
        curved = multipliers.deflections * S ** (-4.0 / 3.0)
        bands = np.zeros((2, x.size))
        bands[1] = weights.lower + weights.upper + 4.0 * (curved @ p.deflections) * x**-5.0
        if p.taper is not None:
            both = weights.rising + weights.falling
            bands[1, 1:] += both
            bands[1, :-1] += both
            bands[0, 1:] = -both
            bands[1] *= 1.0 + 1e-15
        self._factor = cholesky_banded(bands)
        self._capacity = np.empty((0, x.size)) if capacity is None else capacity.gradient[None]
        bent = np.empty((0, x.size)) if capacity is None else capacity.curvature
        self._columns = np.concatenate([self._gradients, self._capacity, bent]).T
        along = weights.deflections - 4.0 * multipliers.deflections * S ** (1.0 / 3.0)
        self._weights = np.concatenate([along, weights.capacity, np.full(len(bent), multipliers.capacity.sum())])
        self._solved = self._banded(self._columns)
        self._residual = p.cost + self._transposed(z)

    def step(self, infeasible: Array, complementary: Array) -> tuple[Array, Array, Array]:
        """Changes of x, s and z that take f + s and s z - target, as given, to 0."""
        s, z, U, W = self._s, self._z, self._columns, self._weights
        down = -(self._residual + self._transposed((z * infeasible - complementary) / s))
        dx = self._banded(down)
        if W.size:  # Woodbury: (B + U W U^T)^-1
            dx = dx - self._solved @ np.linalg.solve(np.eye(W.size) + W[:, None] * (U.T @ self._solved), W * (U.T @ dx))
        slope = np.diff(dx)
        tapers = [] if self._p.taper is None else [slope, -slope]
        ds = -infeasible - np.concatenate([-dx, dx, *tapers, -(self._gradients @ dx), -(self._capacity @ dx)])
        return dx, ds, -(complementary + z * ds) / s

    def _banded(self, right: Array) -> Array:
        from scipy.linalg import cho_solve_banded

        solved: Array = cho_solve_banded((self._factor, False), right)
        return solved

    def _transposed(self, stacked: Array) -> Array:
        """sum of the constraints' gradients, weighted."""
        p = self._p
        w = _split(p, stacked)
        total = w.upper - w.lower - w.deflections @ self._gradients - w.capacity @ self._capacity
        if p.taper is not None:
            push = w.rising - w.falling
            total[1:] += push
            total[:-1] -= push
        return total


def _multipliers(p: Problem, x: Array, stacked: Array) -> Multipliers:
    """Of the constraints as `Problem` states them."""
    z = _split(p, stacked)
    return z._replace(deflections=z.deflections * (p.deflections @ x**-3.0) ** (-4.0 / 3.0) / 3.0)


def _balanced(p: Problem, x: Array, m: Multipliers, capacity: Capacity | None) -> Multipliers:
    """With the tapers' multipliers summed up from each run of active tapers' start, which balances its stations but the last.

    The method's own lose digits where they are large.
    """
    if p.taper is None:
        return m
    pull = 3.0 * x**-4.0 * (m.deflections @ p.deflections)
    eased = 0.0 if capacity is None else m.capacity[0] * capacity.gradient
    total = np.cumsum(p.cost + m.upper - m.lower - pull - eased)
    active = np.abs(np.diff(x)) >= p.taper * (1.0 - 1e-4)
    start = np.maximum.accumulate(np.where(active, 0, np.arange(1, x.size)))
    push = np.where(active, total[:-1] - np.where(start > 0, total[start - 1], 0.0), 0.0)
    return m._replace(rising=np.maximum(push, 0.0), falling=np.maximum(-push, 0.0))


def _dual_value(p: Problem, z: Multipliers, capacity: Capacity | None) -> float:
    """min over lower <= x <= upper of the Lagrangian without the bounds' own multipliers: closed, for it is separable.

    The capacity's gradient stands for it: being concave and of the first degree, it is nowhere above gradient . x.
    """
    cost = p.cost - (0.0 if capacity is None else z.capacity[0] * capacity.gradient)
    constant = float(z.capacity.sum() - z.deflections.sum())
    if p.taper is not None:
        push = z.rising - z.falling
        cost[1:] += push
        cost[:-1] -= push
        constant -= float((z.rising + z.falling) @ p.taper)
    pull = z.deflections @ p.deflections
    free = np.where(cost > 0.0, (3.0 * pull / np.where(cost > 0.0, cost, 1.0)) ** 0.25, np.inf)
    x = np.clip(free, p.lower, p.upper)
    return float(cost @ x + pull @ x**-3.0) + constant
