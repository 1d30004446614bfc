"""Time-optimal law along a path, by reachability analysis (toppra)."""

import math
from dataclasses import replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import toppra
from toppra.constraint import DiscretizationType, LinearConstraint
from toppra.constraint.linear_constraint import canlinear_colloc_to_interpolate
from toppra.interpolator import AbstractGeometricPath
from toppra.solverwrapper.cy_seidel_solverwrapper import seidelWrapper

from boom_model import BaseMotion, Boom
from boom_model.arrays import Array
from boom_model.drives.drive import drive_torque_tangent
from boom_model.drives.limits import gear_limits, motor_limits, rotors, static_limits
from planner.paths.path import JointLine, Path
from planner.timing.path_limits import (
    PathDynamics,
    demand_ratios,
    explain_infeasible,
    path_dynamics,
    spread,
)
from planner.timing.time_law import TimeLaw

GRID_INTERVALS = 500
_ROUGH_INTERVALS = 50  # of a first law, on which the tangents settle for a tenth of the price
_SOLVES = 20
_CONVERGED = 3e-4  # share of a limit that tangents at the law itself would add where it is met: the next solve gains less
_MET = 1e-3
_INSIDE = np.linspace(0.0, 1.0, 9)[1:-1]  # of a step
_REPAIRS = 8
_FINITE = 1e12
_ROUNDING = 1e-8
_TRIES = 10

_Rows = tuple[Array, Array, Array]


def time_optimal(
    boom: Boom,
    path: Path,
    base: BaseMotion | None = None,
    *,
    even: bool = False,
    jerk_share: float | None = None,
) -> TimeLaw:
    """Find the least-time law from rest to rest within velocity, acceleration and drive limits.

    The path acceleration is constant over each of the `GRID_INTERVALS` steps in s, and the
    conditions hold at both ends of each (toppra's interpolation scheme). Between them the torques
    can exceed their limits by the square of the step. The steps are equal, and shorter between
    knots of the path that are near to each other. On a curved path the speed is capped where a
    limit is broken inside a step all the same, and the law solved for again.

    A drive's limit falls with its speed and viscous friction grows with it; toppra holds only what
    is linear in u and x. Both are therefore replaced by their tangents, which never allow more than
    the true ones: taken at low speed first, then at the speeds of the solve before, until that adds
    nothing where a limit is met. Every solve keeps the true limits. The tangents settle on a rough
    grid, from which the full one starts.

    Args:
        boom: the boom.
        path: the path.
        base: tilt of the base, which must not move; None is level.
        even: whether all steps are equal, and none is looked into. Between near knots such a law is
            smoother, and must be slowed for what it breaks.
        jerk_share: the share of the joints' jerk limits that |p'''| s'^3 may take, the part that
            the path's shape asks for; None holds it to no limit.

    Raises:
        InfeasiblePathError: no law keeps the limits, or a drive could not stop and hold its load
            somewhere; names the joint, the place, the demand and the limit.
    """
    s = np.linspace(0.0, 1.0, GRID_INTERVALS + 1) if even else spread(path, GRID_INTERVALS)
    demands = path_dynamics(boom, path, s, base)
    if jerk_share is not None:
        demands = replace(demands, cap=jerk_share ** (2.0 / 3.0) * _shape_cap(boom, path, s))
    if (demands.static_ratio > 1.0).any():  # a swing might carry the load past such a place, but could not stop at it
        raise explain_infeasible(demands)
    unit = _time_scale(demands)
    few = np.unique(np.linspace(0, len(s) - 1, min(len(s) - 1, _ROUGH_INTERVALS) + 1).astype(int))
    rough, found = _iterate(demands.at(few), path, np.zeros(len(few)), unit), None
    if rough is not None:
        unit = float(_durations(s[few], rough.speed).sum())
        found = _iterate(demands, path, np.interp(s, s[few], rough.speed**2), unit)
    if found is None:
        found = _iterate(demands, path, np.zeros_like(s), unit)
    if found is None:
        raise explain_infeasible(demands)
    return _law(s, found) if even or isinstance(path, JointLine) else _repaired(demands, found, unit)


def _shape_cap(boom: Boom, path: Path, s: Array) -> Array:
    """Return the largest x (n,) at which |p'''| x^(3/2) keeps the jerk limits around s (n,)."""
    bend = (np.abs(path((s[1:] + s[:-1]) / 2.0, 3)) / boom.limits.jerk).max(axis=1)
    beside = np.maximum(np.append(bend, 0.0), np.append(0.0, bend))
    with np.errstate(divide="ignore"):
        cap: Array = beside ** (-2.0 / 3.0)
    return cap


def _repaired(demands: PathDynamics, found: "_Found", unit: float) -> TimeLaw:
    """Return the law of a solve, slower where a limit is exceeded inside a step.

    Where a joint turns back p' is 0 and p'' may jump: there the speed that both ends of a step
    allow can be too much between them, however short the step. It is capped at both ends, and
    solved for again; of all these laws that is taken which is the shortest once it is slowed by
    what it still breaks.
    """
    laws: list[tuple[float, TimeLaw]] = []
    for _ in range(_REPAIRS):
        law, x = _law(demands.s, found), found.speed**2
        acceleration, drives = _between(demands, law)
        held = demands.static_ratio.max(axis=1)  # of a drive's load, which no slowness lessens
        too_fast = np.maximum(acceleration, (drives - held) / np.maximum(1.0 - held, _ROUNDING))
        laws.append((law.duration * math.sqrt(max(1.0, too_fast.max())), law))
        if max(acceleration.max(), drives.max()) <= 1.0 + _MET:
            break
        demands = replace(demands, cap=np.where(too_fast > 1.0, x / too_fast, demands.cap))
        again = _iterate(demands, demands.path, x, unit)
        if again is None:
            break
        found = again
    return min(laws, key=lambda each: each[0])[1]


def _between(demands: PathDynamics, law: TimeLaw) -> tuple[Array, Array]:
    """Return twice (n,): the worst ratio to acceleration and drive limits around each point."""
    start, length = law.s.x[:-1, None], np.diff(law.s.x)[:, None]
    t = start + length * _INSIDE
    ratios = demand_ratios(demands.boom, demands.path, law, t.ravel(), demands.base)
    steps = [each.reshape(t.shape).max(axis=1) for each in ratios]
    acceleration, drives = (np.maximum(np.append(each, 0.0), np.append(0.0, each)) for each in steps)
    return acceleration, drives


def _law(s: Array, found: "_Found") -> TimeLaw:
    acceleration = np.diff(found.speed**2) / (2.0 * np.diff(s))
    law = TimeLaw.from_pieces(_durations(s, found.speed), [acceleration / 2.0, found.speed[:-1], s[:-1]])
    return replace(law, iterations=found.solves, residual=found.gain)


class _Found(NamedTuple):
    """What the solves on one grid came to."""

    speed: Array
    """(n,) s'"""
    solves: int
    gain: float
    """see `_gain`"""


def _durations(s: Array, speed: Array) -> Array:
    durations: Array = 2.0 * np.diff(s) / (speed[:-1] + speed[1:])
    return durations


def _time_scale(demands: PathDynamics) -> float:
    """Return a time [s] of the order of the duration, in whose unit s' and s'' are about one."""
    boom = demands.boom
    pushed = np.abs(demands.p1) / boom.limits.acceleration, np.abs(demands.a) / static_limits(boom)
    fastest = float((np.abs(demands.p1) / boom.limits.velocity).max())
    return max(fastest, *(float(np.sqrt(part.max())) for part in pushed))


def _iterate(demands: PathDynamics, path: Path, x: Array, unit: float) -> _Found | None:
    """Return the law of the last solve, the first with tangents at x (n,); None if infeasible."""
    found, fixed = None, breakable_rows(limit_rows(demands, x, moving=False), demands)
    rows = limit_rows(demands, x, moving=True)
    for solves in range(1, _SOLVES + 1):
        a, b, c = (np.hstack(pair) for pair in zip(fixed, breakable_rows(rows, demands), strict=True))
        solved = _solve(_Condition((a, b, c), demands.x_max, unit), path, demands.s)
        if solved is None:
            break
        speed = solved / unit
        old, rows = rows, limit_rows(demands, speed**2, moving=True)
        found = _Found(speed, solves, _gain(demands.s, speed, old, rows))
        if found.gain <= _CONVERGED:
            break
    return found


def _gain(s: Array, speed: Array, old: _Rows, new: _Rows) -> float:
    """Return how much more the new rows allow at a law's x, where it meets the old ones."""
    a, b, c = old
    x = speed[:, None] ** 2
    u = np.diff(x, axis=0) / (2.0 * np.diff(s)[:, None])
    before, after = a * np.concatenate([u[:1], u]), a * np.concatenate([u, u[-1:]])
    met = np.maximum(before, after) + b * x + c > 1.0 - _MET
    return float(np.max((b - new[1]) * x + c - new[2], where=met, initial=0.0))


def breakable_rows(rows: _Rows, demands: PathDynamics) -> _Rows:
    """Return the rows that some u and x within the joint limits can break; the others cost time."""
    a, b, c = rows
    x = np.minimum(demands.x_max, _FINITE)
    with np.errstate(divide="ignore"):
        u = (demands.boom.limits.acceleration + np.abs(demands.p2) * x[:, None]) / np.abs(demands.p1)
    fastest = np.minimum(u.min(axis=1), _FINITE)[:, None]
    kept = (np.abs(a) * fastest + np.maximum(b * x[:, None], 0.0) + c > 1.0 - _ROUNDING).any(axis=0)
    return a[:, kept], b[:, kept], c[:, kept]


def limit_rows(demands: PathDynamics, x: Array, *, moving: bool | None = None) -> _Rows:
    """Return conditions a u + b x + c <= 1 as three arrays (n, m).

    The drives' curves are taken at their tangents.

    Args:
        demands: the terms of the joint torques.
        x: where the tangents touch, (n,).
        moving: whether to return only the rows that change with the tangents, or only the others;
            None is all.
    """
    boom = demands.boom
    at_rest, gears, inertias = motor_limits(boom, np.zeros(5)), gear_limits(boom), rotors(boom)
    intercepts, slopes = (part.T for part in demands.friction_tangent(x))
    # Joint, sign, limit; share of the load, inertia, share of the friction.
    kinds: list[tuple[int, float, float, float, float, float]] = []
    curved = {}
    for i, drive in enumerate(boom.drives):
        if not moving:
            kinds += [(i, sign, boom.limits.acceleration[i], 0.0, 1.0, 0.0) for sign in (1.0, -1.0)]
        if drive is None:
            continue
        tangent = None if moving is False else drive_torque_tangent(drive, demands.p1[:, i] * np.sqrt(x))
        # without friction as well: it earns no credit while braking
        for sign, rubs in product((1.0, -1.0), (0.0, 1.0) if intercepts[i].any() else (0.0,)):
            wanted = moving is None or moving == bool(rubs and slopes[i].any())
            if np.isfinite(gears[i]) and wanted:
                kinds.append((i, sign, gears[i], 1.0, 0.0, rubs))
            if np.isfinite(at_rest[i]):
                motor = (i, sign, at_rest[i], 1.0, inertias[i], rubs)
                if wanted:
                    kinds.append(motor)
                if tangent is not None:
                    curved[len(kinds)] = tangent
                    kinds.append(motor)
    if not kinds:
        none = np.empty((len(x), 0))
        return none, none, none
    joint = [i for i, *_ in kinds]
    sign, limit, loaded, inertia, rubs = np.array([rest for _, *rest in kinds]).T[:, :, None]
    p1, p2 = demands.p1.T[joint], demands.p2.T[joint]
    a = sign * (loaded * demands.a.T[joint] + inertia * p1)
    b = sign * (loaded * (demands.b.T[joint] + rubs * slopes[joint]) + inertia * p2)
    c = sign * (loaded * (demands.c.T[joint] + rubs * intercepts[joint]))
    for row, (intercept, slope) in curved.items():
        b[row] -= slope * p1[row] ** 2
        c[row] -= intercept
    a, b, c = a / limit, b / limit, c / limit
    c[list(curved)] += 1.0
    return a.T, b.T, c.T


def _solve(condition: "_Condition", path: Path, s: Array) -> Array | None:
    """Return s' at the grid points by reachability analysis; None if infeasible.

    s' is in the unit of time of the condition.

    Backwards from rest the largest x from which rest can be reached, then forwards as fast as these
    allow. toppra's own loop also asks for the least such x; here it is 0, because the load can be
    held at rest everywhere.
    """
    solver = seidelWrapper([condition], _ToppraPath(path), s)
    steps, top, x = solver.get_deltas(), [0.0] * len(s), [0.0] * len(s)
    highest, onwards = np.array([1e-9, -1.0]), np.stack([-2.0 * steps, np.full(len(steps), -1.0)], axis=1)
    free = math.nan
    for i in range(len(steps) - 1, -1, -1):
        top[i] = solver.solve_stagewise_optim(i, None, highest, free, free, 0.0, top[i + 1])[1]
        if math.isnan(top[i]):
            return None
    for i, step in enumerate(steps.tolist()):
        for _ in range(_TRIES):  # rounding may put x a little above what can be reached from
            u = float(solver.solve_stagewise_optim(i, None, onwards[i], x[i], x[i], 0.0, top[i + 1])[0])
            if not math.isnan(u):
                break
            x[i] *= 1.0 - 1e-3
        else:
            return None
        reached = x[i] + 2.0 * step * u
        x[i + 1] = min(top[i + 1], max(reached - _ROUNDING, reached * (1.0 - 1e-4), 0.0))
    return np.sqrt(x)


class _Condition(LinearConstraint):  # type: ignore[misc]
    """Rows a u + b x + c <= 1 in toppra's form, with time in units of `unit` seconds."""

    def __init__(self, rows: tuple[Array, Array, Array], x_max: Array, unit: float) -> None:
        super().__init__()
        self.set_discretization_type(DiscretizationType.Interpolation)
        self.identical = True
        self._rows, self._x_max, self._square = rows, x_max, unit**2

    def compute_constraint_params(self, path: AbstractGeometricPath, gridpoints: Array, *_: object) -> Any:
        a, b, c = self._rows
        x_max = np.minimum(self._x_max * self._square, toppra.constants.MAXX)
        x_bound = np.stack([np.zeros_like(x_max), x_max], axis=-1)
        F, g = np.eye(a.shape[1]), np.ones(a.shape[1])
        # The helper hands its sixth and seventh argument back in their places: the bounds on u and
        # on x.
        return canlinear_colloc_to_interpolate(
            a / self._square, b / self._square, c, F, g, None, x_bound, gridpoints, identical=True
        )


class _ToppraPath(AbstractGeometricPath):  # type: ignore[misc]
    """toppra's view of a path; the conditions above have been evaluated already."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def __call__(self, path_positions: Array, order: int = 0) -> Array:
        return self._path(path_positions, order)

    @property
    def dof(self) -> int:
        return 5

    @property
    def path_interval(self) -> Array:
        return np.array([0.0, 1.0])
