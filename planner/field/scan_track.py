"""A row scan along a log: the tip stays on its line over the ground while the vehicle weaves.

The mount's motion is a quintic spline fitted to the log, a knot a second: the boom follows what is
slower than that. At every time, the tip is in the mount's frame at

    p(t) = R(t)^T (ground(t) - mount(t))

with ground(t) beside the mount on the straight line of the pass, at the scan's height over the
mount. The n-th time that the vehicle passes a row, the tip is on the row's n-th line. Motions are
checked against the limits of joints and drives with the mount's velocity, acceleration and tilt as
the motion of the base.

Before a pass, the boom comes from rest to its speed: it follows p(t) from half a LEAD before the
begin, at a rate that grows from 0 to 1 within a LEAD; after the pass, the same the other way round.
Between two passes the tip goes to its next line (`scan_track_day`), if the log leaves the time.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from boom_model import Boom, InfeasibleError, InputError, forward_kinematics, inverse_dynamics
from boom_model.arrays import Array
from boom_model.kinematics.constraints import parse_constraint
from planner.field.extra import library
from planner.field.plots import PlotMap
from planner.field.rig import Rig
from planner.field.scan import lines_of
from planner.field.scan_ground import DOWN
from planner.field.scan_mount import LoggedMount, MountMotion, fitted, logged_mount
from planner.field.scan_rows import Row, rows_of
from planner.field.scan_task import ScanTask
from planner.field.scan_track_day import SWAY, Way, track_mission, way_between
from planner.field.vehicle_log import VehicleLog
from planner.motion.planned import PlannedMotion
from planner.motion.trajectory import STEP, Trajectory
from planner.paths.clearance import require_path_clear
from planner.paths.tip_path import follow
from planner.planning import Move, check_motion
from planner.timing.limit_ratios import Limit, limit_ratios
from planner.timing.time_law import Motion, TimeLaw

LEAD = 1.0
"""Time in which the boom comes to its speed before a pass, and to rest after it [s]."""
_ALONG = np.cos(np.radians(20.0))  # of the angle between the way driven and the row
_NEAR, _FAR = 0.5, 3.5  # [m] between the mount and the middle of a row that it passes
_SMOOTH = 0.5  # [s] before and after a fix, over which its velocity is taken
_SLOWEST = 0.02  # [m/s] at which the vehicle drives
_FEWEST = 20
_MASTS = (Limit.POSITION, Limit.LINKAGE)
_TOLERANCE = 1e-4  # [m] of the tip over the ground


@dataclass(frozen=True, eq=False)
class WeavingCurve:
    """The tip's curve in the mount's frame, over s from 0 to 1, evenly in time.

    It goes from half a LEAD before the pass to half a LEAD after it.
    """

    mount: MountMotion
    origin: Array
    """(2,) a point of the line on the ground [m]"""
    ahead: Array
    """(2,) unit vector along it"""
    height: float
    """Of the tip over the mount [m]."""

    def __call__(self, s: Array) -> Array:
        """Return positions (..., 3) at s (...)."""
        place, R = self.mount.pose(np.asarray(s, dtype=float) * (self.mount.duration + LEAD) - 0.5 * LEAD)
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
    move: Move | None
    """Of the boom from rest to rest, checked on level ground; None where the tip does not reach the
    line, or is not there in time."""
    trajectory: Trajectory | None
    """The part of it on the line, from the begin of the pass on."""
    reason: str
    ratios: dict[Limit, float]
    """Largest demand over limit from rest to rest, with the mount's motion."""
    late: bool = False
    """Whether the boom is not there in time."""

    @property
    def speed(self) -> float:
        """Mean of the vehicle [m/s]."""
        places = self.curve.mount.pose(np.array([0.0, self.curve.mount.duration]))[0]
        return float(np.linalg.norm(np.diff(places[:, :2], axis=0)) / self.curve.mount.duration)

    @property
    def span(self) -> tuple[float, float]:
        """From rest to rest, in the log's time [s]."""
        return self.curve.mount.begin - LEAD, self.curve.mount.begin + self.curve.mount.duration + LEAD

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
    ways: tuple[Way, ...]
    """Between those passes whose line is reached."""
    lines: dict[int, int]
    """Lines that each row takes."""
    footprints: tuple[Array, ...]
    """Of each pass, corners (n, 4, 2) in the plane of the map [m]."""
    mount: LoggedMount
    notes: tuple[str, ...]

    @property
    def track(self) -> Array:
        """(n, 2) of the mount [m]."""
        return self.mount.place[:, :2]

    @property
    def reached(self) -> tuple[Pass, ...]:
        """Passes whose line is reached."""
        return tuple(each for each in self.passes if each.move is not None)

    @property
    def duration(self) -> float:
        """From the begin of the first pass to the end of the last, both at rest [s]."""
        reached = self.reached
        return reached[-1].span[1] - reached[0].span[0] if reached else 0.0

    @cached_property
    def mission(self) -> str:
        """The passes as a mission file's text.

        Raises:
            InfeasibleError: no line is reached.
        """
        return track_mission(self)

    @property
    def coverage(self) -> Array:
        """(plots,) share of each plot that is seen."""
        return self._looks[0]

    @property
    def overlap(self) -> Array:
        """(plots,) area seen over that seen at least once; 0 where nothing is."""
        return self._looks[1]

    @cached_property
    def _looks(self) -> tuple[Array, Array]:
        shapely = library("shapely")
        shares, times = np.zeros((2, len(self.plots.names)))
        if not any(len(each) for each in self.footprints):
            return shares, times
        shapes = shapely.polygons(np.concatenate([each for each in self.footprints if len(each)]))
        for k, touched in _by_plot(self.plots, shapes).items():
            polygon = self.plots.polygons[k]
            pieces = shapely.intersection(shapes[touched], polygon)
            seen = shapely.union_all(pieces).area
            shares[k], times[k] = seen / polygon.area, shapely.area(pieces).sum() / max(seen, 1e-12)
        return shares, times

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
    mount = logged_mount(log, plots, rig)
    passes: list[Pass] = []
    ways: list[Way] = []
    counts: dict[int, int] = {}
    last: Pass | None = None
    gaps: list[str] = []
    for row, first, end in _ways(rows, mount):
        gap = mount.gap(mount.t[first] - LEAD, mount.t[end] + LEAD)
        if gap is not None:
            why = f"no fix for {gap[1]:.1f} s from {gap[0]:.10g} s on"
            gaps.append(f"{log.source}: {why}; that pass along row {row.number} is left out")
            continue
        lines = lines_of(row, task)
        number = counts.get(row.number, 0)
        if number >= len(lines):
            continue
        counts[row.number] = number + 1
        here = None if last is None or last.move is None else last.move.trajectory.q[-1]
        each = _pass(boom, task, row, float(lines[number]), fitted(mount, first, end), here)
        if last is not None and each.move is not None:
            way, late = _joined(boom, task, last, each)
            each = each if not late else replace(each, move=None, trajectory=None, ratios={}, reason=late, late=True)
            ways += [way] if way is not None else []
        last = last if each.move is None else each
        passes.append(each)
    if not passes:
        missed = f"{log.source}: it passes no row of {plots.source} on its left, {_NEAR:g} to {_FAR:g} m away"
        raise InputError("; ".join([missed, *gaps]))
    notes = () if rig is not None else (f"{log.source}: taken as the mount's own position and attitude (assumed; --rig)",)
    prints = tuple(_prints(boom, task, each) for each in passes)
    return TrackScan(
        task, plots, log.source, tuple(passes), tuple(ways), {row.number: len(lines_of(row, task)) for row in rows}, prints,
        mount, (*gaps, *notes, SWAY, *log.notes, *log.warnings),
    )  # fmt: skip


def _ways(rows: tuple[Row, ...], mount: LoggedMount) -> list[tuple[Row, int, int]]:
    """Return the first and the last fix of each way past a row on the left, in order of time."""
    place = mount.place
    times = [np.clip(mount.t + dt, mount.t[0], mount.t[-1]) for dt in (-_SMOOTH, _SMOOTH)]
    ends = [np.stack([np.interp(t, mount.t, column) for column in place[:, :2].T], axis=-1) for t in times]
    velocity = (ends[1] - ends[0]) / (times[1] - times[0])[:, None]
    speed = np.linalg.norm(velocity, axis=1)
    led = (mount.t >= mount.t[0] + LEAD) & (mount.t <= mount.t[-1] - LEAD)
    found = []
    for row in rows:
        away = place[:, :2] - row.middle
        along, across = away @ row.ahead, away @ row.left
        cosine = (velocity @ row.ahead) / np.maximum(speed, 1e-9)
        left = np.sign(cosine) * -across
        low, high = row.span
        inside = (along >= low) & (along <= high) & (np.abs(cosine) > _ALONG) & (speed > _SLOWEST)
        inside &= (left > _NEAR) & (left < _FAR) & led
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


def _pass(boom: Boom, task: ScanTask, row: Row, line: float, mount: MountMotion, here: Array | None) -> Pass:
    origin = row.middle + line * row.left
    curve = WeavingCurve(mount, origin, row.ahead, task.tip_height)
    beside = float(curve(np.linspace(0.0, 1.0, 50))[:, 1].mean())
    try:
        path = follow(boom, curve, DOWN, parse_constraint(task.constraint), here, tolerance=_TOLERANCE)
        require_path_clear(boom, path)
    except InfeasibleError as error:
        why = str(error).partition(": ")[0]
        return Pass(row.number, beside, curve, None, None, f"on the line {beside:.2f} m beside the mount, {why}", {})
    motion = Motion(path, _eased(mount.duration))
    planned = PlannedMotion((motion,), path(0.0), STEP, (f"the tip stays on a line along row {row.number} over the ground",))
    move = check_motion(boom, planned.trajectory, profile="pass along the log")
    t = np.linspace(0.0, mount.duration, int(np.ceil(mount.duration / STEP)) + 1)
    whole = move.trajectory
    base = mount.base(whole.t - LEAD)
    tau = inverse_dynamics(boom, whole.q, whole.qd, whole.qdd, base=base, friction=True, reactions=False).tau
    found = limit_ratios(boom, whole.q, whole.qd, whole.qdd, whole.qddd, tau)
    ratios = {limit: float(ratio.max()) for limit, ratio in found.items()}
    return Pass(row.number, beside, curve, move, Trajectory.from_samples(t, *motion(t + LEAD)), "", ratios)


def _eased(duration: float) -> TimeLaw:
    """Return the time law of a pass: rate 3 x^2 - 2 x^3, x = t / LEAD, then 1, then back to 0."""
    T = LEAD
    pieces = np.array(
        [
            [-0.5 / T**3, 0.0, 0.5 / T**3],
            [1.0 / T**2, 0.0, -1.0 / T**2],
            [0.0, 0.0, 0.0],
            [0.0, 1.0, 1.0],
            [0.0, 0.5 * T, 0.5 * T + duration],
        ]
    )
    return TimeLaw.from_pieces([T, duration, T], pieces / (duration + T), jerk_limited=True)


def _joined(boom: Boom, task: ScanTask, last: Pass, each: Pass) -> tuple[Way | None, str]:
    """Return the way from one pass to the next, or why the boom is not there in time."""
    assert last.move is not None
    assert each.move is not None
    gap = each.span[0] - last.span[1]
    try:
        way = way_between(boom, task, last.move.trajectory.q[-1], each.move.trajectory.q[0], gap)
    except InfeasibleError as error:
        return None, f"the tip cannot go to the line {each.line:.2f} m beside the mount: {error}"
    if way.duration > gap:
        takes = f"the tip takes {way.duration:.1f} s to the line {each.line:.2f} m beside the mount"
        return None, f"{takes}; the log leaves {max(gap, 0.0):.1f} s"
    return way, ""


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
