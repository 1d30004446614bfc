"""Law of least copper loss within a given duration, by a second-order cone program (Clarabel).

The current of a motor follows its torque, so its loss is r T^2 with r = 2 R (I / T_run)^2. At the
motor, without the gearbox's losses, T = (tau + J qdd) / N with the drive's own inertia J at the
joint. Along the path this is linear in x = s'^2 and u = s'': T = q(u, x). The loss of a move,

    E = int sum_i r_i q_i(u, x)^2 / sqrt(x) ds,

is convex, because q^2 / z is convex in (q, z) and falls with z, and sqrt(x) is concave. So is a
duration of at most T, int ds / sqrt(x) <= T. A duration of at least T is not: where motors hold a
load they lose power all the time, and the loss would be least if the arm hurried on and lingered
where its load is lightest.
"""

from dataclasses import dataclass
from typing import Any

import clarabel
import numpy as np
from scipy import sparse

from boom_model import BaseMotion, Boom, InfeasibleError, InputError
from boom_model.arrays import Array
from boom_model.drives.drive import reflected_inertia
from boom_model.drives.power import copper_per_torque
from planner.paths.path import Path
from planner.timing.path_limits import PathDynamics, least_stretch, looks, path_dynamics, spread
from planner.timing.profiles.time_optimal import breakable_rows, limit_rows, time_optimal
from planner.timing.time_law import TimeLaw

GRID_INTERVALS = 200
_SHORT = 1e-5  # share of the duration that is left for rounding, and for limits broken between grid points
_WHOLE = 5e-4  # share of the duration within which all of it is taken
_NEAR = 0.05  # share beyond the least duration within which the fastest law stands in where the solver finds none
_TRIES = 4
_FINITE = 1e12
_TOLERANCES = (1e-6, 1e-5)  # relative, tried in turn: x is small beside the ends, and rounding may take over
_LEAST = 1e-12  # [W]

_Blocks = list[tuple[Any, Array]]
"""Rows A and bounds b of A v <= b, or of cones b - A v. Sparse matrices are `Any`: their types
differ between versions."""


@dataclass(frozen=True, eq=False)
class Loss:
    """Copper loss along a path, on the intervals of a grid, with torques at both ends of each."""

    s: Array
    """(n,) grid."""
    a: Array
    """(2, n - 1, m) root of the loss per u, at the start and the end of each interval, for each
    motor [sqrt(W) s^2]."""
    b: Array
    """(2, n - 1, m) per x."""
    c: Array
    """(2, n - 1, m) of the load held at rest [sqrt(W)]."""

    def of(self, x: Array) -> float:
        """Return the loss [J] of a law with x (n,), whose s'' is constant in each interval."""
        step, z = np.diff(self.s), np.sqrt(x)
        u = np.diff(x) / (2.0 * step)
        ends = np.stack([x[:-1], x[1:]])[:, :, None]
        q = self.a * u[:, None] + self.b * ends + self.c
        return float((step / (z[1:] + z[:-1]) * (q**2).sum(axis=(0, 2))).sum())


def copper_loss(demands: PathDynamics) -> Loss:
    """Return the copper loss of a path from its demands on a grid.

    Raises:
        InputError: no joint has a motor with wiring, winding data, running torque and inertias.
    """
    columns = []
    for i, drive in enumerate(demands.boom.drives):
        per_torque = None if drive is None else copper_per_torque(drive)
        inertia = None if drive is None else reflected_inertia(drive)
        if drive is None or per_torque is None or inertia is None:
            continue
        root = np.sqrt(per_torque) / drive.gearbox.ratio
        a = demands.a[:, i] + inertia * demands.p1[:, i]
        b = demands.b[:, i] + inertia * demands.p2[:, i]
        columns.append(root * np.stack([a, b, demands.c[:, i] + demands.coulomb[:, i]]))
    if not columns:
        raise InputError("least-energy: no joint has a motor with wiring, winding data, running torque and inertias")
    a, b, c = np.stack(columns, axis=-1)
    return Loss(demands.s, *(np.stack([part[:-1], part[1:]]) for part in (a, b, c)))


def least_energy(boom: Boom, path: Path, duration: float, base: BaseMotion | None = None) -> TimeLaw:
    """Return the law of least copper loss in at most `duration` [s], within all limits.

    It takes less where going slower costs more, which is so where the motors hold a load. Limits
    that depend on the speed are taken at their tangent at the fastest law, which never allows more
    than they do. Coulomb friction counts as on a moving joint; viscous friction enters the limits
    alone.

    Args:
        boom: the boom.
        path: the path.
        duration: largest duration [s], not below that of `time_optimal`.
        base: tilt of the base.

    Raises:
        InputError: as `copper_loss`.
        InfeasibleError: as `time_optimal`, the duration is too short, or the solver finds no law.
    """
    fastest = time_optimal(boom, path, base)
    if duration < fastest.duration * (1.0 - _SHORT):
        raise InfeasibleError(f"duration {duration:g} s is too short: the path takes at least {fastest.duration:.6g} s")
    demands = path_dynamics(boom, path, spread(path, GRID_INTERVALS), base)
    loss = copper_loss(demands)
    t = np.linspace(0.0, fastest.duration, 20 * len(demands.s))
    tangent = np.interp(demands.s, fastest.s(t), fastest.s(t, 1)) ** 2
    within = (1.0 - _SHORT) * duration
    for _ in range(_TRIES):
        x = _solved(demands, loss, tangent, within)
        if x is None:
            break
        law = _law(demands.s, x)
        law = law.stretched(max(1.0, least_stretch(boom, path, law, base, looks(path))))
        if law.duration <= duration:
            whole = law.duration >= (1.0 - _WHOLE) * duration
            return law.stretched(duration / law.duration) if whole else law
        within *= duration / law.duration * (1.0 - 10.0 * _SHORT)
    if duration <= fastest.duration * (1.0 + _NEAR):  # no room for a choice
        return fastest
    raise InfeasibleError(f"least-energy: the solver finds no law for {duration:g} s within the limits; try a longer duration")


def _law(s: Array, x: Array) -> TimeLaw:
    z, acceleration = np.sqrt(x), np.diff(x) / (2.0 * np.diff(s))
    return TimeLaw.from_pieces(2.0 * np.diff(s) / (z[:-1] + z[1:]), [acceleration / 2.0, z[:-1], s[:-1]])


def _solved(demands: PathDynamics, loss: Loss, tangent: Array, duration: float) -> Array | None:
    """Return x (n,) of least loss; None if the solver finds none.

    The variables are x, z <= sqrt(x), and for each interval the loss e and the duration d per step,
    with time in units of `duration` and the loss in units of a slow law's:

        minimise sum step e,   e (z_k + z_k+1) >= |q|^2,   d (z_k + z_k+1) >= 2,   sum step d <= 1

    Args:
        demands: the path's demands.
        loss: the loss along the path.
        tangent: (n,) x at which limits that depend on the speed are linearised.
        duration: largest duration [s].
    """
    n, step, square = len(demands.s), np.diff(demands.s), duration**2
    k, eye = n - 1, sparse.identity(n, format="csr")
    low, high = eye[:-1], eye[1:]
    u = sparse.diags(0.5 / step) @ (high - low)
    blocks: _Blocks = [(_at(0, eye[[0, n - 1]], n), np.zeros(2))]
    blocks += [(_at(0, -eye, n), np.zeros(n)), (_at(0, eye, n), np.minimum(demands.x_max * square, _FINITE))]
    a, b, c = breakable_rows(limit_rows(demands, tangent), demands)
    for j in range(a.shape[1]):
        for at, side in ((slice(None, -1), low), (slice(1, None), high)):
            limited = sparse.diags(a[at, j] / square) @ u + sparse.diags(b[at, j] / square) @ side
            blocks.append((_at(0, limited, n), 1.0 - c[at, j]))
    blocks.append((_at(3, sparse.csr_matrix(step[None, :]), n), np.ones(1)))
    cones: list[Any] = [clarabel.ZeroConeT(2), clarabel.NonnegativeConeT(sum(part.shape[0] for part, _ in blocks[1:]))]
    x, z = _at(0, eye, n), _at(1, eye, n)
    _add_cones(blocks, cones, [(x, 1.0), (x, -1.0), (2.0 * z, 0.0)])  # z^2 <= x
    width, each = _at(1, low + high, n), sparse.identity(k, format="csr")
    e, d = _at(2, each, n), _at(3, each, n)
    _add_cones(blocks, cones, [(d + width, 0.0), (d - width, 0.0), (0.0 * d, 2.0 * np.sqrt(2.0))])
    slowed = tangent * (_law(demands.s, tangent).duration / duration) ** 2
    root = 2.0 / np.sqrt(max(loss.of(slowed) / duration, _LEAST))
    entries = [(e + width, 0.0), (e - width, 0.0)]
    for end, side in enumerate((low, high)):
        for motor in range(loss.a.shape[2]):
            per_u, per_x, held = (root * part[end, :, motor] for part in (loss.a / square, loss.b / square, loss.c))
            entries.append((_at(0, sparse.diags(per_u) @ u + sparse.diags(per_x) @ side, n), held))
    _add_cones(blocks, cones, entries)
    cost = np.concatenate([np.zeros(2 * n), step, np.zeros(k)])
    A, bound = sparse.vstack([part for part, _ in blocks], format="csc"), np.concatenate([limit for _, limit in blocks])
    for tolerance in _TOLERANCES:
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tolerance
        quadratic = sparse.csc_matrix((len(cost), len(cost)))
        solution = clarabel.DefaultSolver(quadratic, cost, A, bound, cones, settings).solve()
        if solution.status in (clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved):
            found: Array = np.maximum(np.asarray(solution.x[:n]) / square, 0.0)
            found[[0, -1]] = 0.0
            return found
    return None


def _at(place: int, part: Any, n: int) -> Any:
    """Return a block of rows with `part` on the variables x, z, e or d."""
    sizes = (n, n, n - 1, n - 1)
    return sparse.hstack([part if i == place else sparse.csr_matrix((part.shape[0], size)) for i, size in enumerate(sizes)])


def _add_cones(blocks: _Blocks, cones: list[Any], entries: list[tuple[Any, Any]]) -> None:
    """Add a second-order cone per row: the first entry is at least the norm of the others.

    An entry is a matrix on the variables and a constant.
    """
    size, count = len(entries), entries[0][0].shape[0]
    order = np.arange(size * count).reshape(size, count).T.ravel()
    constants = np.concatenate([np.broadcast_to(constant, count) for _, constant in entries])
    blocks.append((-sparse.vstack([part for part, _ in entries], format="csr")[order], constants[order]))
    cones.extend([clarabel.SecondOrderConeT(size)] * count)
