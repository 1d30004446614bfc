"""A row scan along a log: the tip stays on its line over the ground while the vehicle weaves.

The mount's motion is a quintic spline fitted to the log, a knot a second: the boom follows what is
slower than that. At every time, the tip is in the mount's frame at

    p(t) = R(t)^T (ground(t) - mount(t))

with ground(t) beside the mount on the straight line of the pass, at the scan's height over the
mount. The n-th time that the vehicle passes a row, the tip is on the row's n-th line. Motions are
checked against the limits of joints and drives with the mount's velocity, acceleration and tilt as
the motion of the base.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from boom_model import BaseMotion, Boom, InfeasibleError, InputError, forward_kinematics, inverse_dynamics
from boom_model.arrays import Array
from boom_model.kinematics.constraints import parse_constraint
from planner.field import attitude
from planner.field.extra import library
from planner.field.plots import PlotMap
from planner.field.rig import Rig
from planner.field.scan import lines_of
from planner.field.scan_ground import DOWN
from planner.field.scan_rows import Row, rows_of
from planner.field.scan_task import ScanTask
from planner.field.vehicle_log import VehicleLog
from planner.motion.trajectory import STEP, Trajectory, sample
from planner.paths.clearance import require_path_clear
from planner.paths.tip_path import TipPath, follow
from planner.timing.limit_ratios import Limit, limit_ratios
from planner.timing.time_law import Motion, TimeLaw

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

_KNOT = 1.0  # [s] between knots of the mount's motion
_BEYOND = 2.0  # [s] of the log on both sides of a pass that are fitted as well
_ALONG = np.cos(np.radians(20.0))  # of the angle between the way driven and the row
_NEAR, _FAR = 0.5, 3.5  # [m] between the mount and the middle of a row that it passes
_SMOOTH = 0.5  # [s] before and after a fix, over which its velocity is taken
_SLOWEST = 0.02  # [m/s] at which the vehicle drives
_FEWEST = 20
_MASTS = (Limit.POSITION, Limit.LINKAGE)
_TOLERANCE = 1e-4  # [m] of the tip over the ground


@dataclass(frozen=True, eq=False)
class MountMotion:
    """Smooth motion of the mount in east, north, up, from a log."""

    spline: "BSpline"
    """Of the time from the begin: east, north, up [m], roll, pitch, heading [rad]."""
    begin: float
    """Of the pass, in the log's time [s]."""
    duration: float
    """[s]"""
    residual: float
    """Root mean square distance of the fixes from it [m]."""

    def pose(self, t: Array) -> tuple[Array, Array]:
        """Return positions (..., 3) [m] and R_enu_mount (..., 3, 3) at times t (...)."""
        values = self.spline(t)
        return values[..., :3], attitude.rotation(values[..., 3], values[..., 4], values[..., 5])

    def base(self, t: Array) -> BaseMotion:
        """Return the motion of the base at times t (n,); turn rates by central differences."""
        h = 1e-3
        _, R = self.pose(t)
        rate = _rates(self.pose(t - h)[1], R, self.pose(t + h)[1], h)
        rates = [_rates(self.pose(at - h)[1], self.pose(at)[1], self.pose(at + h)[1], h) for at in (t - h, t + h)]
        velocity, acceleration = (np.einsum("nji,nj->ni", R, self.spline(t, order)[:, :3]) for order in (1, 2))
        return BaseMotion.of(velocity, rate, acceleration, (rates[1] - rates[0]) / (2.0 * h), R[:, 2, :])


@dataclass(frozen=True, eq=False)
class WeavingCurve:
    """The tip's curve in the mount's frame, over s from 0 to 1, evenly in time."""

    mount: MountMotion
    origin: Array
    """(2,) a point of the line on the ground [m]"""
    ahead: Array
    """(2,) unit vector along it"""
    height: float
    """Of the tip over the mount [m]."""

    def __call__(self, s: Array) -> Array:
        """Return positions (..., 3) at s (...)."""
        place, R = self.mount.pose(np.asarray(s, dtype=float) * self.mount.duration)
        flat = self.origin + ((place[..., :2] - self.origin) @ self.ahead)[..., None] * self.ahead
        ground = np.concatenate([flat, place[..., 2:] + self.height], axis=-1)
        curve: Array = np.einsum("...ji,...j->...i", R, ground - place)
        return curve

    @property
    def length(self) -> float:
        """Length [m]."""
        return float(np.linalg.norm(np.diff(self(np.linspace(0.0, 1.0, 2001)), axis=0), axis=-1).sum()) + _TOLERANCE


@dataclass(frozen=True, eq=False)
class Pass:
    """One way of the vehicle past a row."""

    row: int
    line: float
    """Of the tip, beside the track (mean) [m]."""
    curve: WeavingCurve
    path: TipPath | None
    trajectory: Trajectory | None
    """Of the boom; None where the tip does not reach the line."""
    reason: str
    ratios: dict[Limit, float]
    """Largest demand over limit, with the mount's motion."""

    @property
    def speed(self) -> float:
        """Mean of the vehicle [m/s]."""
        places = self.curve.mount.pose(np.array([0.0, self.curve.mount.duration]))[0]
        return float(np.linalg.norm(np.diff(places[:, :2], axis=0)) / self.curve.mount.duration)

    @property
    def worst(self) -> float:
        """Largest of the ratios that grow with speed."""
        return max((ratio for limit, ratio in self.ratios.items() if limit not in _MASTS), default=0.0)


@dataclass(frozen=True, eq=False)
class TrackScan:
    """A scan along a log."""

    task: ScanTask
    plots: PlotMap
    source: str
    passes: tuple[Pass, ...]
    lines: dict[int, int]
    """Lines that each row takes."""
    footprints: tuple[Array, ...]
    """Of each pass, corners (n, 4, 2) in the plane of the map [m]."""
    track: Array
    """(n, 2) of the mount [m]"""
    notes: tuple[str, ...]

    @cached_property
    def coverage(self) -> Array:
        """(plots,) share of each plot that is seen."""
        shapely = library("shapely")
        shares = np.zeros(len(self.plots.names))
        if not any(len(each) for each in self.footprints):
            return shares
        shapes = shapely.polygons(np.concatenate([each for each in self.footprints if len(each)]))
        for k, touched in _by_plot(self.plots, shapes).items():
            polygon = self.plots.polygons[k]
            shares[k] = shapely.intersection(shapely.union_all(shapes[touched]), polygon).area / polygon.area
        return shares

    @property
    def unreachable(self) -> dict[str, str]:
        """Plots without all their lines, and why."""
        found: dict[str, str] = {}
        for row in rows_of(self.plots):
            mine = [each for each in self.passes if each.row == row.number]
            whole = [each for each in mine if each.trajectory is not None]
            lost = next((each.reason for each in mine if each.reason), "")
            if len(whole) < self.lines[row.number]:
                why = lost or f"the vehicle passes {len(mine)} times with row {row.number} on its left"
                why += f"; it takes {self.lines[row.number]} lines"
                found |= {self.plots.names[each.plot]: why for each in row.plots}
        return found


def scan_along(boom: Boom, plots: PlotMap, task: ScanTask, log: VehicleLog, rig: Rig | None = None) -> TrackScan:
    """Plan the boom's motion along a log of the vehicle.

    Args:
        boom: the boom.
        plots: the map; its plots need rows and ranges.
        task: the sensor and the tip's height; the log gives track and speed.
        log: of the vehicle.
        rig: where antenna and mount are; None takes the log as the mount's own.

    Raises:
        InputError: the map has no rows, or the log passes none of them.
    """
    rows = rows_of(plots)
    place, angles = _mount_of(log, plots, rig)
    passes: list[Pass] = []
    counts: dict[int, int] = {}
    for row, first, last in _ways(rows, place, log):
        lines = lines_of(row, task)
        number = counts.get(row.number, 0)
        if number >= len(lines):
            continue
        counts[row.number] = number + 1
        mount = _fitted(log.t, place, angles, first, last)
        passes.append(_pass(boom, task, row, float(lines[number]), mount))
    if not passes:
        raise InputError(f"{log.source}: it passes no row of {plots.source} on its left, {_NEAR:g} to {_FAR:g} m away")
    notes = () if rig is not None else (f"{log.source}: taken as the mount's own position and attitude (assumed; --rig)",)
    prints = tuple(_prints(boom, task, each) for each in passes)
    return TrackScan(
        task, plots, log.source, tuple(passes), {row.number: len(lines_of(row, task)) for row in rows}, prints, place[:, :2],
        (*notes, *log.notes, *log.warnings),
    )  # fmt: skip


def _mount_of(log: VehicleLog, plots: PlotMap, rig: Rig | None) -> tuple[Array, Array]:
    """Return the mount's places (n, 3) in the map's frame and its roll, pitch, heading (n, 3)."""
    R_ecef_body = log.R_ecef_body if rig is None else log.R_ecef_body @ rig.R_body_imu.T
    lever = np.zeros(3) if rig is None else rig.mount - rig.antenna
    R_body_mount = np.eye(3) if rig is None else rig.R_body_mount
    place = plots.frame.enu(log.ecef + R_ecef_body @ lever)
    R = np.einsum("ji,njk->nik", plots.frame.R_ecef_enu, R_ecef_body @ R_body_mount)
    return place, np.unwrap(attitude.angles(R), axis=0)


def _ways(rows: tuple[Row, ...], place: Array, log: VehicleLog) -> list[tuple[Row, int, int]]:
    """Return the first and the last fix of each way past a row on the left, in order of time."""
    times = [np.clip(log.t + dt, log.t[0], log.t[-1]) for dt in (-_SMOOTH, _SMOOTH)]
    ends = [np.stack([np.interp(t, log.t, column) for column in place[:, :2].T], axis=-1) for t in times]
    velocity = (ends[1] - ends[0]) / (times[1] - times[0])[:, None]
    speed = np.linalg.norm(velocity, axis=1)
    found = []
    for row in rows:
        away = place[:, :2] - row.middle
        along, across = away @ row.ahead, away @ row.left
        cosine = (velocity @ row.ahead) / np.maximum(speed, 1e-9)
        left = np.sign(cosine) * -across
        low, high = row.span
        inside = (along >= low) & (along <= high) & (np.abs(cosine) > _ALONG) & (speed > _SLOWEST)
        inside &= (left > _NEAR) & (left < _FAR)
        edges = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(int)))
        found += [(row, int(a), int(b) - 1) for a, b in edges.reshape(-1, 2) if b - a >= _FEWEST]
    nearest: dict[tuple[int, int], tuple[float, Row]] = {}
    for row, first, last in found:  # a way between two rows is that of the nearer one
        middle = 0.5 * (place[first, :2] + place[last, :2])
        distance = abs(float((middle - row.middle) @ row.left))
        key = next((k for k in nearest if first <= k[1] and k[0] <= last), (first, last))
        if key not in nearest or distance < nearest[key][0]:
            nearest.pop(key, None)
            nearest[first, last] = (distance, row)
    return sorted(((row, first, last) for (first, last), (_, row) in nearest.items()), key=lambda way: way[1])


def _fitted(t: Array, place: Array, angles: Array, first: int, last: int) -> MountMotion:
    """Return the smooth motion of the mount between two fixes."""
    from scipy.interpolate import make_lsq_spline

    a = int(np.searchsorted(t, t[first] - _BEYOND))
    b = int(np.searchsorted(t, t[last] + _BEYOND, side="right"))
    since, values = t[a:b] - t[first], np.column_stack([place[a:b], angles[a:b]])
    inner = np.linspace(since[0], since[-1], max(2, int((since[-1] - since[0]) / _KNOT)))[1:-1]
    knots = np.concatenate([[since[0]] * 6, inner, [since[-1]] * 6])
    spline = make_lsq_spline(since, values, knots, k=5)
    off = np.linalg.norm(spline(since)[:, :3] - values[:, :3], axis=1)
    return MountMotion(spline, float(t[first]), float(t[last] - t[first]), float(np.sqrt((off**2).mean())))


def _pass(boom: Boom, task: ScanTask, row: Row, line: float, mount: MountMotion) -> Pass:
    origin = row.middle + line * row.left
    curve = WeavingCurve(mount, origin, row.ahead, task.tip_height)
    beside = float(curve(np.linspace(0.0, 1.0, 50))[:, 1].mean())
    try:
        path = follow(boom, curve, DOWN, parse_constraint(task.constraint), tolerance=_TOLERANCE)
        require_path_clear(boom, path)
    except InfeasibleError as error:
        why = str(error).partition(": ")[0]
        return Pass(row.number, beside, curve, None, None, f"on the line {beside:.2f} m beside the mount, {why}", {})
    law = TimeLaw.from_pieces([mount.duration], [[1.0 / mount.duration], [0.0]], jerk_limited=True)
    motion = sample(Motion(path, law), STEP)
    base = mount.base(motion.t)
    tau = inverse_dynamics(boom, motion.q, motion.qd, motion.qdd, base=base, friction=True, reactions=False).tau
    found = limit_ratios(boom, motion.q, motion.qd, motion.qdd, motion.qddd, tau)
    return Pass(row.number, beside, curve, path, motion, "", {limit: float(ratio.max()) for limit, ratio in found.items()})


def _prints(boom: Boom, task: ScanTask, each: Pass) -> Array:
    """Return the corners (n, 4, 2) [m] of what the sensor sees in a pass, in the map's plane."""
    if each.trajectory is None:
        return np.empty((0, 4, 2))
    t = np.arange(0.0, each.trajectory.duration, 1.0 / task.rate)
    q = each.trajectory.q[np.searchsorted(each.trajectory.t, t).clip(max=len(each.trajectory.t) - 1)]
    tip = forward_kinematics(boom, q).position
    place, R = each.curve.mount.pose(t)
    c, s = np.cos(q[:, 0]), np.sin(q[:, 0])
    out, across = np.stack([c, s, 0.0 * c], axis=-1), np.stack([-s, c, 0.0 * c], axis=-1)
    signs = 0.5 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * task.footprint
    corners = [(place + np.einsum("nij,nj->ni", R, tip + a * out + b * across))[:, :2] for a, b in signs]
    return np.stack(corners, axis=1)


def _by_plot(plots: PlotMap, shapes: Any) -> dict[int, Array]:
    which, touched = plots.tree.query(shapes, predicate="intersects")
    return {int(k): which[touched == k] for k in np.unique(touched)}


def _rates(before: Array, now: Array, after: Array, h: float) -> Array:
    """Return the angular velocity (n, 3) in the body's axes, from turns at t - h, t and t + h."""
    skew = np.einsum("nji,njk->nik", now, (after - before) / (2.0 * h))
    rate: Array = 0.5 * np.stack(
        [skew[:, 2, 1] - skew[:, 1, 2], skew[:, 0, 2] - skew[:, 2, 0], skew[:, 1, 0] - skew[:, 0, 1]], axis=-1
    )
    return rate
