"""A row scan: where the vehicle stops or how often it drives past, what the boom does there, and what of each plot is seen.

The vehicle drives along each row of plots, to and fro from row to row, with the plots on its left.
With stops, the boom sweeps lines of the tip along the row, at one pitch and height, beside each
other over the plot. While it drives, the boom stands still over one of these lines, and the
vehicle passes once for each; the boom changes lines at the end of the row.

All plots with the same place beside the track get the same moves, so a move is planned once. What
is seen is counted from the motions as planned, footprint by footprint.
"""

from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np

from boom_model import Boom, InfeasibleError, InputError, forward_kinematics, inverse_kinematics
from boom_model.arrays import Array
from boom_model.kinematics.constraints import parse_constraint
from planner.field.extra import library
from planner.field.plots import PlotMap
from planner.planning import Move, plan, torques
from planner.progress import Track

DOWN = -np.pi / 2.0
_WINDOW = 0.1  # [m] steps in which the reach along a line is sought
_WIDEST = 3.0  # [m]
_OFFSETS = np.arange(1.0, 2.61, 0.1)
_STEP = 0.1  # [m] between points of a line whose reach is tried
_MOST_PLOTS = 5000
_SAME = 3  # decimals [m] to which plots beside a track are the same


@dataclass(frozen=True)
class ScanTask:
    """What to scan with, in SI."""

    footprint: tuple[float, float]
    """Of the sensor on the canopy, along the arm and across it [m]."""
    rate: float = 4.0
    """Of the sensor [Hz]."""
    tip_height: float = 0.9
    """Of the tip over the mount [m]: canopy and distance, less the height of the mount."""
    overlap: float = 0.1
    """Of two lines beside each other, as a share of the footprint."""
    offset: float | None = None
    """From the track to the middle of a row [m]; None is where the fewest stops do."""
    speed: float | None = None
    """Of the vehicle past the plots [m/s]; None is with stops."""
    drive_speed: float = 1.0
    """Of the vehicle from stop to stop [m/s]."""
    profile: str = "jerk-limited"
    constraint: str = "horizontal"


@dataclass(frozen=True, eq=False)
class Beside:
    """A plot as its track sees it: x along the track from the middle of the plot, y to the left [m]."""

    plot: int
    row: int
    along: float
    """Of its middle along the track [m]."""
    x: tuple[float, float]
    y: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Visit:
    """A plot's part of the scan."""

    stops: tuple[float, ...]
    """Of the mount, along the plot from its middle [m]."""
    lines: tuple[float, ...]
    """Of the tip, to the left of the track [m]."""
    half: float
    """How far the tip goes to either side of the mount [m]."""
    reason: str
    """Why a line cannot be reached; empty where all can."""


@dataclass(frozen=True, eq=False)
class Scan:
    """A planned scan."""

    task: ScanTask
    offset: float
    plots: PlotMap
    beside: tuple[Beside, ...]
    visits: tuple[Visit, ...]
    moves: dict[str, Move]
    """Every distinct move, by its words."""
    coverage: Array
    """(plots,) share of each plot that is seen"""
    overlap: Array
    """(plots,) area seen over that seen at least once"""
    seconds: Array
    """(plots,) over each plot, the drive to the next stop included [s]"""
    energy: Array
    """(plots,) work of the joints, without what they give back [J]"""
    mission: str
    """The day as a mission file's text."""
    track: Array
    """(m, 2) of the mount, in the plane of the map [m]"""

    @property
    def crossed(self) -> int:
        """How many plots the mount's track crosses: the vehicle stands over them."""
        line = library("shapely").LineString(self.track)
        return len(self.plots.tree.query(line, predicate="intersects"))

    @property
    def unreachable(self) -> dict[str, str]:
        """Plots that are not reached whole, and why."""
        return {self.plots.names[b.plot]: v.reason for b, v in zip(self.beside, self.visits, strict=True) if v.reason}


def plan_scan(boom: Boom, plots: PlotMap, task: ScanTask, track: Track = iter) -> Scan:
    """Plan the scan of a map.

    Args:
        boom: the boom, with its keep-out shapes.
        plots: the map; its plots need rows and ranges.
        task: the sensor, the track and the moves.
        track: iterates over the distinct kinds of plot, and may show the progress.

    Raises:
        InputError: the map has no rows, or the task is malformed.
        InfeasibleError: no plot can be reached, a move cannot be planned, or the sensor is too slow
            for the speed.
    """
    _check(plots, task)
    beside, axis, turns = _beside(plots)
    offset = _best_offset(boom, beside, task) if task.offset is None else task.offset
    kinds: dict[tuple[float, ...], list[int]] = {}
    for k, each in enumerate(beside):
        kinds.setdefault(tuple(np.round((*each.x, *each.y), _SAME)), []).append(k)
    visits: list[Visit] = [Visit((), (), 0.0, "")] * len(beside)
    moves: dict[str, Move] = {}
    seen: dict[int, tuple[float, float, float, float]] = {}
    for kind in track(list(kinds)):
        first = beside[kinds[kind][0]]
        visit = _visit(boom, first, offset, task)
        found = _looked(boom, first, visit, offset, task, moves)
        for k in kinds[kind]:
            visits[k], seen[k] = visit, found
    if not any(visit.lines for visit in visits):
        raise InfeasibleError(f"no plot can be reached with the track {offset:g} m from the rows: {visits[0].reason}")
    figures = np.array([seen[k] for k in range(len(beside))])
    order = np.argsort([each.plot for each in beside])
    coverage, overlap, seconds, energy = figures[order].T
    return Scan(
        task, offset, plots, tuple(beside), tuple(visits), moves, coverage, overlap, seconds, energy,
        _mission(plots, beside, visits, task), _track(beside, visits, offset, axis, turns),
    )  # fmt: skip


def _check(plots: PlotMap, task: ScanTask) -> None:
    if None in plots.rows or None in plots.ranges:
        raise InputError(f"{plots.source}: a scan needs the row and the range of every plot")
    if len(plots.names) > _MOST_PLOTS:
        raise InputError(f"{plots.source}: {len(plots.names):,} plots; a scan takes {_MOST_PLOTS:,}")
    if task.speed is not None:
        fastest = task.footprint[1] * (1.0 - task.overlap) * task.rate
        if task.speed > fastest:
            raise InfeasibleError(
                f"at {task.speed:g} m/s, {task.rate:g} Hz and a footprint of {task.footprint[1]:g} m leave gaps; "
                f"{fastest:.3g} m/s is the fastest"
            )


def _beside(plots: PlotMap) -> tuple[list[Beside], Array, dict[int, Array]]:
    """Return the plots as their tracks see them, in the order of the drive, the axis of the rows, and each row's middle."""
    middles = np.array([polygon.centroid.coords[0] for polygon in plots.polygons])
    rows, ranges = np.array(plots.rows, dtype=int), np.array(plots.ranges, dtype=int)
    corners = plots.polygons[0].minimum_rotated_rectangle.exterior.coords
    sides = np.diff(np.array(corners)[:3], axis=0)
    axis = sides[int(np.argmax(np.linalg.norm(sides, axis=1)))]
    for row in np.unique(rows):
        mine = np.flatnonzero(rows == row)
        if len(mine) > 1:
            ends = mine[np.argsort(ranges[mine])][[0, -1]]
            axis = middles[ends[1]] - middles[ends[0]]
            break
    axis = axis / np.linalg.norm(axis)
    found, turns = [], {}
    for number, row in enumerate(np.unique(rows)):
        ahead = axis if number % 2 == 0 else -axis
        left = np.array([-ahead[1], ahead[0]])
        mine = np.flatnonzero(rows == row)
        mine = mine[np.argsort(ranges[mine])][:: 1 if number % 2 == 0 else -1]
        turns[int(row)] = middles[mine].mean(axis=0)
        for k in mine:
            flat = np.array(plots.polygons[k].exterior.coords)[:, :2]
            x, y = (flat - middles[k]) @ ahead, (flat - turns[int(row)]) @ left
            along = float((middles[k] - turns[int(row)]) @ ahead)
            found.append(Beside(int(k), int(row), along, (float(x.min()), float(x.max())), (float(y.min()), float(y.max()))))
    return found, axis, turns


def _lines(y: tuple[float, float], task: ScanTask) -> Array:
    """Return where the middles of the lines are, from edge to edge of a plot [m]."""
    width, side = y[1] - y[0], task.footprint[0]
    if side >= width:
        return np.array([0.5 * (y[0] + y[1])])
    count = int(np.ceil((width - side * task.overlap) / (side * (1.0 - task.overlap)) - 1e-9))
    return np.linspace(y[0] + side / 2.0, y[1] - side / 2.0, max(count, 2))


def _window(boom: Boom, lines: Array, task: ScanTask, most: float) -> float:
    """Return how far the tip may go to either side on every line, in steps of 0.1 m; negative where a line is out of reach."""
    half = -1.0
    constraint = parse_constraint(task.constraint)
    for reach in np.arange(0.0, most + _WINDOW, _WINDOW):
        for x in {reach, -reach}:
            for y in lines:
                found = inverse_kinematics(boom, (float(x), float(y), task.tip_height), DOWN, constraint)
                if not any(solution.within_limits for solution in found.solutions):
                    return half
        half = float(min(reach, most))
    return half


def _best_offset(boom: Boom, beside: list[Beside], task: ScanTask) -> float:
    """Return the offset of the track with the widest window, the middle of several."""
    lines = _lines(beside[0].y, task)
    most = 0.5 * (beside[0].x[1] - beside[0].x[0]) if task.speed is None else 0.0
    windows = np.array([_window(boom, lines + offset, task, min(most, _WIDEST)) for offset in _OFFSETS])
    best = _OFFSETS[windows >= windows.max() - 1e-9]
    return float(np.round(best[len(best) // 2], 6))


def _visit(boom: Boom, plot: Beside, offset: float, task: ScanTask) -> Visit:
    """Return where the vehicle stops at a plot, and which lines of it the boom reaches."""
    lines = _lines(plot.y, task) + offset
    reached = [float(y) for y in lines if _window(boom, np.array([y]), task, 0.0) >= 0.0]
    lost = [f"{y:.2f}" for y in lines if float(y) not in reached]
    reason = f"the tip reaches no line at {', '.join(lost)} m beside the mount, {task.tip_height:g} m over it" if lost else ""
    if not reached:
        return Visit((), (), 0.0, reason)
    if task.speed is not None:
        return Visit((0.0,), tuple(reached), 0.0, reason)
    length, side = plot.x[1] - plot.x[0], task.footprint[1]
    half = _window(boom, np.array(reached), task, min(0.5 * length, _WIDEST))
    for count in range(1, 100):
        part = length / count
        needed = max(0.5 * (part - side) + 0.5 * side * task.overlap, 0.0)
        if needed <= half + 1e-9:
            middles = plot.x[0] + part * (np.arange(count) + 0.5)
            return Visit(tuple(float(x) for x in middles), tuple(reached), float(needed), reason)
    return Visit((), (), 0.0, reason or "the tip has no room along the row")


def _points(visit: Visit, task: ScanTask) -> list[str]:
    """Return the targets of the tip over one stop, to and fro from line to line."""
    targets = []
    for number, y in enumerate(visit.lines):
        half = visit.half
        ends = (-half, half) if number % 2 == 0 else (half, -half)
        targets += [f"tip={x + 0.0:.4f},{y:.4f},{task.tip_height:.4f}" for x in (ends if half > 0.0 else (0.0,))]
    return targets


def _looked(
    boom: Boom, plot: Beside, visit: Visit, offset: float, task: ScanTask, moves: dict[str, Move]
) -> tuple[float, float, float, float]:
    """Plan a plot's moves; return the share seen, the overlap, the seconds and the energy."""
    shapely = library("shapely")
    if not visit.lines:
        return 0.0, 0.0, 0.0, 0.0
    targets = _points(visit, task)
    stop_seconds = energy = 0.0
    marks: list[Array] = []
    for a, b in pairwise(targets):
        for start, goal in ((a, b), (b, a)):  # every other stop is swept the other way
            name = f"{start} to {goal}"
            if name not in moves:
                moves[name] = plan(boom, start, goal, along="line", profile=task.profile, constraint=task.constraint)
        move = moves[f"{a} to {b}"].trajectory
        stop_seconds += move.duration
        tau = torques(boom, move)
        energy += float(np.trapezoid(np.maximum(tau * move.qd, 0.0).sum(axis=1), move.t))
        at = np.unique(np.append(np.searchsorted(move.t, np.arange(0.0, move.duration, 1.0 / task.rate)), len(move.t) - 1))
        marks.append(_footprints(boom, move.q[at], task))
    length = plot.x[1] - plot.x[0]
    if task.speed is None:
        if not marks:
            marks = [_still(boom, targets[0], task)]
        spots = [marked + np.array([x, 0.0]) for x in visit.stops for marked in np.concatenate(marks)]
        seconds = len(visit.stops) * (max(stop_seconds, 1.0 / task.rate) + length / len(visit.stops) / task.drive_speed)
        energy *= len(visit.stops)
    else:
        steps = np.arange(plot.x[0], plot.x[1] + task.speed / task.rate, task.speed / task.rate)
        spots = [marked + np.array([x, 0.0]) for target in targets for marked in _still(boom, target, task) for x in steps]
        seconds = len(targets) * length / task.speed
    area = shapely.box(plot.x[0], plot.y[0] + offset, plot.x[1], plot.y[1] + offset)
    pieces = shapely.intersection(shapely.polygons(np.array(spots)), area)
    union = shapely.union_all(pieces)
    return union.area / area.area, float(shapely.area(pieces).sum() / max(union.area, 1e-12)), seconds, energy


def _footprints(boom: Boom, q: Array, task: ScanTask) -> Array:
    """Return the corners (n, 4, 2) of the footprint beside the mount, x forward, y left [m]."""
    tip = forward_kinematics(boom, q)
    out = np.stack([np.cos(q[:, 0]), np.sin(q[:, 0])], axis=-1)
    across = np.stack([-out[:, 1], out[:, 0]], axis=-1)
    half = 0.5 * np.array(task.footprint)
    signs = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * half
    corners: Array = tip.position[:, None, :2] + signs[:, :1] * out[:, None, :] + signs[:, 1:] * across[:, None, :]
    return corners


def _still(boom: Boom, target: str, task: ScanTask) -> Array:
    move = plan(boom, target, target, constraint=task.constraint)
    return _footprints(boom, move.trajectory.q[:1], task)


def _mission(plots: PlotMap, beside: list[Beside], visits: list[Visit], task: ScanTask) -> str:
    """Return the scan as a mission: from and to transport, a line at a time, holding while the vehicle drives.

    Stops or passes that are alike repeat in pairs, the second swept the other way.
    """
    lines = [
        f"# {len(plots.names)} plots of {plots.source}, as boom scan planned them.",
        'name = "row scan"',
        'basis = "estimated"',
        f'source = "boom scan {"with stops" if task.speed is None else f"at {task.speed:g} m/s"}"',
        'start = "transport"',
        f'constraint = "{task.constraint}"',
    ]
    here = ""
    for (targets, hold), group in groupby(_blocks(beside, visits, task)):
        count = len(list(group))
        order = targets[::-1] if here == targets[-1] else targets
        if here != order[0]:
            lines += _step(task, order[0], line=bool(here))
        there, back = _sweep(order, hold, task), _sweep(order[::-1], hold, task)
        if count > 1:
            lines += ["", "[[steps]]", f"repeat = {count // 2}", *(_inner(line) for line in there + back)]
        if count % 2:
            lines += there
        here = order[-1] if count % 2 else order[0]
    return "\n".join([*lines, *_step(task, "transport", line=False)]) + "\n"


def _blocks(beside: list[Beside], visits: list[Visit], task: ScanTask) -> list[tuple[tuple[str, ...], str]]:
    """Return the targets of every stop, or of every row of passes, and how long the boom holds then [s]."""
    found = []
    for _, group in groupby(zip(beside, visits, strict=True), lambda pair: pair[0].row):
        mine = [(each, visit) for each, visit in group if visit.lines]
        if not mine:
            continue
        if task.speed is not None:
            length = max(e.along + e.x[1] for e, _ in mine) - min(e.along + e.x[0] for e, _ in mine)
            found.append((tuple(_points(mine[0][1], task)), f"{max(length / task.speed, 0.01):.3f}"))
            continue
        for each, visit in mine:
            hold = max((each.x[1] - each.x[0]) / len(visit.stops) / task.drive_speed, 0.01)
            found += [(tuple(_points(visit, task)), f"{hold:.3f}")] * len(visit.stops)
    return found


def _sweep(targets: tuple[str, ...], hold: str, task: ScanTask) -> list[str]:
    """Return the steps from the first target on: holding after the last, or, driving past, at each."""
    held = ["", "[[steps]]", f"hold_s = {hold}"]
    if task.speed is None:
        return [line for target in targets[1:] for line in _step(task, target, line=True)] + held
    return held + [line for target in targets[1:] for line in (*_step(task, target, line=True), *held)]


def _step(task: ScanTask, target: str, *, line: bool) -> list[str]:
    return ["", "[[steps]]", f'to = "{target}"', f'profile = "{task.profile}"', *(['along = "line"'] if line else [])]


def _inner(line: str) -> str:
    return line.replace("[[steps]]", "[[steps.steps]]")


def _track(beside: list[Beside], visits: list[Visit], offset: float, axis: Array, turns: dict[int, Array]) -> Array:
    """Return the stops, or the ends of the passes, of the mount in the plane of the map (m, 2)."""
    points = []
    for number, row in enumerate(dict.fromkeys(each.row for each in beside)):
        ahead = axis if number % 2 == 0 else -axis
        left = np.array([-ahead[1], ahead[0]])
        for each, visit in zip(beside, visits, strict=True):
            if each.row == row:
                points += [turns[row] - offset * left + (each.along + x) * ahead for x in visit.stops]
    return np.array(points)
