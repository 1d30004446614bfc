"""Time-optimal law along a path, by reachability analysis (toppra)."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import toppra
from toppra.algorithm import TOPPRA
from toppra.constraint import DiscretizationType, LinearConstraint
from toppra.constraint.linear_constraint import canlinear_colloc_to_interpolate
from toppra.interpolator import AbstractGeometricPath

from boom_model import BaseMotion, Boom
from boom_model.arrays import Array
from boom_model.drives import drive_torque_tangent
from planner.constraints import (
    PathDynamics,
    explain_infeasible,
    gear_limits,
    jerk_stretch,
    least_stretch,
    motor_limits,
    path_dynamics,
    rotors,
)
from planner.path import Path
from planner.profiles.cubic import cubic
from planner.time_law import TimeLaw

GRID_INTERVALS = 500
_SOLVES = 20
_CONVERGED = 1e-5  # relative gain of a solve, below which the next is not worth its time
_NARROWEST = -2.5  # of the windows to average over: the power of ten, as a share of the duration
_WINDOWS = 11
_WINDOW_TOLERANCE = 1e-3


def time_optimal(boom: Boom, path: Path, base: BaseMotion | None = None, intervals: int = GRID_INTERVALS) -> TimeLaw:
    """The least-time law from rest to rest under velocity, acceleration and drive torque limits.

    The path acceleration is constant over each of the `intervals` equal steps in s, and the conditions hold at both ends of
    each step (toppra's interpolation scheme). Between them the torques can exceed their limits by the square of the step.

    A drive's limit falls with its speed, and toppra holds only what is linear in u and x. The curve is therefore replaced by
    its tangent, which never allows more; the first solve takes the tangent at the curve's corner, each further one at the
    speeds of the one before, until the duration no longer falls. Every solve keeps the true curve.

    Raises:
        InfeasiblePathError: no law keeps the limits, or a drive could not stop and hold its load somewhere;
            names the joint, the place, the demand and the limit.
    """
    s = np.linspace(0.0, 1.0, intervals + 1)
    demands = path_dynamics(boom, path, s, base)
    if (demands.static_ratio > 1.0).any():  # a swing might carry the load past such a place, but could not stop at it
        raise explain_infeasible(demands)
    unit = cubic(boom, path, base).duration  # solved in units of the cubic's duration, where s' and s'' are of order one
    best, duration, x, solves, gain = None, np.inf, np.zeros_like(s), 0, 0.0
    for _ in range(_SOLVES):
        speed = _solve(_Condition(_rows(demands, x), demands.x_max, unit), path, s)
        took = np.inf if speed is None else float(np.sum(2.0 * np.diff(s) / (speed[:-1] + speed[1:])))
        solves += 1
        gain = 1.0 if np.isinf(duration) else max(0.0, 1.0 - took / duration)
        if speed is None or took >= duration * (1.0 - _CONVERGED):
            break
        best, duration, x = speed, took, (speed / unit) ** 2
    if best is None:
        raise explain_infeasible(demands)
    step = np.diff(s)
    durations = 2.0 * step / (best[:-1] + best[1:])
    acceleration = (best[1:] ** 2 - best[:-1] ** 2) / (2.0 * step)
    law = TimeLaw.from_pieces(durations, [acceleration / 2.0, best[:-1], s[:-1]]).stretched(unit)
    return replace(law, iterations=solves, residual=gain)


def with_jerk_bound(boom: Boom, path: Path, law: TimeLaw, base: BaseMotion | None = None) -> TimeLaw:
    """A law averaged over a window and slowed until it keeps the joints' jerk limits besides their others.

    Averaging s(t) neither leaves the path nor starts or ends in motion, makes the acceleration continuous and 0 at both ends,
    and bounds the jerk by the jump of the acceleration over the window. What it shifts past a limit an even slowing mends; the
    window is the one that makes the whole shortest. Of the time-optimal law of a straight path under joint limits alone this
    makes the least-time jerk-limited one; elsewhere it is not the optimum.
    """
    from scipy.optimize import minimize_scalar

    def smooth(exponent: float) -> TimeLaw:
        smoothed = law.averaged(law.duration * 10.0**exponent)
        return smoothed.stretched(max(1.0, jerk_stretch(boom, path, smoothed), least_stretch(boom, path, smoothed, base)))

    exponents = np.linspace(_NARROWEST, 0.0, _WINDOWS)
    least = int(np.argmin([smooth(exponent).duration for exponent in exponents]))
    around = exponents[max(least - 1, 0)], exponents[min(least + 1, _WINDOWS - 1)]
    found = minimize_scalar(lambda x: smooth(x).duration, bounds=around, method="bounded", options={"xatol": _WINDOW_TOLERANCE})
    return min(smooth(float(found.x)), smooth(float(exponents[least])), key=lambda each: each.duration)


def _rows(demands: PathDynamics, x: Array) -> tuple[Array, Array, Array]:
    """Conditions a u + b x + c <= 1 as three arrays (n, m), the drives' curves taken at their tangent at x (n,)."""
    boom, zero = demands.boom, np.zeros_like(demands.s)
    at_rest, gears, inertias = motor_limits(boom, np.zeros(5)), gear_limits(boom), rotors(boom)
    intercepts, slopes = demands.friction_tangent(x)
    columns = []
    for i, drive in enumerate(boom.drives):
        p1, p2, limit = demands.p1[:, i], demands.p2[:, i], boom.limits.acceleration[i]
        for sign in (1.0, -1.0):
            columns.append((sign * p1 / limit, sign * p2 / limit, zero))
        if drive is None:
            continue
        tangent = drive_torque_tangent(drive, p1 * np.sqrt(x))
        torques = [(demands.b[:, i], demands.c[:, i])]
        if intercepts[:, i].any():  # without friction as well: it earns no credit while braking
            torques.append((demands.b[:, i] + slopes[:, i], demands.c[:, i] + intercepts[:, i]))
        for sign, (carried, held) in product((1.0, -1.0), torques):
            a, b, c = sign * demands.a[:, i], sign * carried, sign * held
            if np.isfinite(gears[i]):
                columns.append((a / gears[i], b / gears[i], c / gears[i]))
            if np.isfinite(at_rest[i]):
                a, b = a + sign * inertias[i] * p1, b + sign * inertias[i] * p2
                columns.append((a / at_rest[i], b / at_rest[i], c / at_rest[i]))
                if tangent is not None:
                    intercept, slope = tangent[0], tangent[1] * p1**2
                    columns.append((a / at_rest[i], (b - slope) / at_rest[i], (c - intercept) / at_rest[i] + 1.0))
    a, b, c = (np.stack(part, axis=-1) for part in zip(*columns, strict=True))
    return a, b, c


def _solve(condition: "_Condition", path: Path, s: Array) -> Array | None:
    """s' at the grid points, in the condition's unit of time; None where there is none."""
    with _quiet():  # what toppra would warn of, the caller explains
        solver = TOPPRA([condition], _ToppraPath(path), gridpoints=s, solver_wrapper="seidel")
        _, speed, _ = solver.compute_parameterization(0.0, 0.0)
    return None if speed is None or np.isnan(speed).any() else np.asarray(speed)


@contextmanager
def _quiet() -> Iterator[None]:
    log = logging.getLogger("toppra")
    level = log.level
    log.setLevel(logging.ERROR)
    try:
        yield
    finally:
        log.setLevel(level)


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
        # The helper hands its sixth and seventh argument back in their places: the bounds on u and on x.
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
