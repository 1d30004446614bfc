"""A row scan: stops or passes of the vehicle, the boom's moves, and what of each plot is seen.

The vehicle drives along each row of plots, to and fro from row to row, with the plots on its left.
With stops, the boom sweeps lines of the tip along the row, at one pitch and height, beside each
other over the plot.

While the vehicle drives past, there are two ways. On lines across the plot, the vehicle's motion is
taken off: they are straight over the ground (`scan_ground`), and the boom's speed limits the
vehicle's. Or the boom stands still over one line along the row, and the vehicle passes once for
each; between passes it drives back. The fewest passes that the boom can follow are taken.

All plots with the same place beside the track get the same moves, so a move is planned once. What
is seen is counted from the motions as planned, footprint by footprint.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from boom_model import Boom, InfeasibleError, InputError, forward_kinematics, inverse_kinematics
from boom_model.arrays import Array
from boom_model.kinematics.constraints import parse_constraint
from planner.field.extra import library
from planner.field.plots import PlotMap
from planner.field.scan_day import Day, legs, mission_text, starting_ratio
from planner.field.scan_ground import DOWN, GroundLines, fastest_crossing, ground_lines, ground_move, mirrored
from planner.field.scan_rows import Beside, Row, rows_of
from planner.field.scan_task import Leg, PassOption, ScanTask, Visit, first_line, ground_name, targets_of
from planner.planning import Move, plan, torques
from planner.progress import Track

_WINDOW = 0.1  # [m] steps in which the reach along a line is sought
_WIDEST = 3.0  # [m]
_OFFSETS = np.arange(1.0, 2.61, 0.1)
_SAME = 3  # decimals [m] to which plots beside a track are the same
_PHASES = 4  # of the sensor's clock against the plot, of which the worst coverage counts
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Scan:
    """A planned scan."""

    task: ScanTask
    offset: float
    plots: PlotMap
    rows: tuple[Row, ...]
    beside: tuple[Beside, ...]
    visits: tuple[Visit, ...]
    """In the order of the drive, as `beside`."""
    moves: dict[str, Move]
    """Every distinct move, by its words."""
    options: tuple[PassOption, ...]
    """What other numbers of passes would do; () with stops."""
    coverage: Array
    """(plots,) share of each plot that is seen"""
    overlap: Array
    """(plots,) area seen over that seen at least once"""
    legs: tuple[Leg, ...]
    """The vehicle's day, from the first row to the last."""
    seconds: Array
    """(plots,) of work over each plot: at its stops, or from edge to edge in every pass [s]"""
    energy: Array
    """(plots,) work of the joints, without what they give back [J]"""
    starting: float
    """Largest demand over limit of a drive that holds while the vehicle starts, stops or turns."""

    @property
    def passes(self) -> int:
        """Along each row; 0 with stops."""
        if self.task.speed is None:
            return 0
        return max(len(visit.ground) or len(visit.lines) for visit in self.visits)

    @property
    def duration(self) -> float:
        """Of the day, without the way from the transport pose and back [s]."""
        return sum(leg.duration for leg in self.legs)

    @cached_property
    def mission(self) -> str:
        """The day as a mission file's text."""
        return mission_text(self)

    @cached_property
    def track(self) -> Array:
        """(m, 2) of the mount at its stops or the ends of its passes, in the map's plane [m]."""
        kind = "stop" if self.task.speed is None else "pass"
        return np.concatenate([leg.way for leg in self.legs if leg.what == kind] or [np.empty((0, 2))])

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
        InfeasibleError: no plot can be reached, a move cannot be planned, or the boom or the sensor
            is too slow for the speed.
    """
    _check(task)
    rows = rows_of(plots)
    beside = tuple(each for row in rows for each in row.plots)
    period = min(row.period for row in rows)
    offset = _best_offset(boom, beside[0], task) if task.offset is None else task.offset
    stopped = task.speed is None
    wide = [row.width for row in rows for _ in row.plots]
    across = [each.y if stopped else width for each, width in zip(beside, wide, strict=True)]  # a pass has one line for all
    kinds: dict[tuple[float, ...], list[int]] = {}
    for k, each in enumerate(beside):
        kinds.setdefault(tuple(np.round((*each.x, *each.y, *across[k]), _SAME)), []).append(k)
    firsts = [beside[members[0]] for members in kinds.values()]
    passes, options = _passes(boom, firsts, max(len(_lines(y, task)) for y in across), period, offset, task)
    visits: list[Visit] = [Visit((), (), 0.0, "")] * len(beside)
    moves: dict[str, Move] = {}
    seen: dict[int, tuple[float, float, float, float]] = {}
    for number, kind in enumerate(track(list(kinds))):
        first = beside[kinds[kind][0]]
        visit = replace(_visit(boom, first, across[kinds[kind][0]], offset, task), kind=number)
        if passes and visit.lines and not visit.reason:
            visit = replace(visit, ground=_ground(boom, first, period, offset, task, passes))
        found = _looked(boom, first, visit, offset, task, moves)
        for k in kinds[kind]:
            visits[k], seen[k] = visit, found
    if not any(visit.lines for visit in visits):
        raise InfeasibleError(f"no plot can be reached with the track {offset:g} m from the rows: {visits[0].reason}")
    figures = np.array([seen[k] for k in range(len(beside))])
    order = np.argsort([each.plot for each in beside])
    coverage, overlap, seconds, energy = figures[order].T

    def planned(start: str, goal: str) -> str:
        _planned(boom, start, goal, task, moves)
        return f"{start} to {goal}"

    by_plot = {each.plot: visit for each, visit in zip(beside, visits, strict=True)}
    parts = Day(task, offset, rows, by_plot, moves, planned)
    day = legs(parts)
    starting = starting_ratio(boom, parts, day)
    return Scan(
        task, offset, plots, rows, beside, tuple(visits), moves, options, coverage, overlap, day, seconds, energy, starting
    )  # fmt: skip


def _check(task: ScanTask) -> None:
    if task.speed is None:
        if task.passes is not None:
            raise InputError("passes are driven at a speed; give the speed, too")
        return
    fastest = _fastest(task)
    if task.speed > fastest:
        raise InfeasibleError(
            f"at {task.speed:g} m/s, {task.rate:g} Hz and a footprint of {task.footprint[1]:g} m leave gaps; "
            f"{fastest:.3g} m/s is the fastest"
        )


def _fastest(task: ScanTask) -> float:
    """Return the speed [m/s] up to which footprints of a still boom overlap as asked."""
    return task.footprint[1] * (1.0 - task.overlap) * task.rate


def _spread(low: float, high: float, side: float, overlap: float) -> Array:
    """Return the middles [m] of the fewest overlapping footprints between two edges."""
    width = high - low
    if side >= width:
        return np.array([0.5 * (low + high)])
    count = int(np.ceil((width - side * overlap) / (side * (1.0 - overlap)) - 1e-9))
    return np.linspace(low + side / 2.0, high - side / 2.0, max(count, 2))


def _lines(y: tuple[float, float], task: ScanTask) -> Array:
    """Return where the middles of the lines are, from edge to edge of a plot [m]."""
    return _spread(*y, task.footprint[0], task.overlap)


def lines_of(row: Row, task: ScanTask) -> Array:
    """Return where the middles of a row's lines are, to the left of its middle [m]."""
    return _lines(row.width, task)


def _strips(y: tuple[float, float], task: ScanTask, passes: int) -> list[tuple[float, float]]:
    """Return from where to where [m] the tip goes in every pass; strips overlap as lines do."""
    side = task.footprint[0]
    sweep = ((y[1] - y[0]) + (passes - 1) * task.overlap * side) / passes - side
    lows = np.linspace(y[0] + side / 2.0, y[1] - side / 2.0 - sweep, passes)
    return [(float(low), float(low + sweep)) for low in lows]


def _passes(
    boom: Boom, kinds: list[Beside], most: int, period: float, offset: float, task: ScanTask
) -> tuple[int, tuple[PassOption, ...]]:
    """Return the fewest passes over the ground at the task's speed, and what each number allows.

    It is 0 where the boom stands still over one line in each pass.
    """
    if task.speed is None:
        return 0, ()
    options, chosen = [], 0
    for passes in range(1, most):
        option = _option(boom, kinds, period, offset, task, passes)
        options.append(option)
        if not chosen and task.passes in (None, passes) and option.speed >= task.speed * (1.0 - _ROUNDING):
            chosen = passes
    options.append(PassOption(most, 0.0, _fastest(task), "the sensor's rate"))
    if task.passes is not None and task.passes != chosen:
        possible = {option.passes: option.speed for option in options}
        if task.passes not in possible:
            raise InputError(f"{task.passes} passes; the plots take 1 to {most}")
        if task.passes < most:
            raise InfeasibleError(
                f"with {task.passes} pass{'es' if task.passes > 1 else ''} along a row, the boom follows the ground up to "
                f"{possible[task.passes]:.3g} m/s; {task.speed:g} m/s takes {_enough(options, task.speed)} passes"
            )
    return chosen, tuple(options)


def _enough(options: list[PassOption], speed: float) -> int:
    return next(option.passes for option in options if option.speed >= speed)


def _option(boom: Boom, kinds: list[Beside], period: float, offset: float, task: ScanTask, passes: int) -> PassOption:
    """Return the largest speed of a number of passes; one that is asked for is planned in full."""
    speed, sweep, limit = np.inf, 0.0, "the lines over the plot"
    for each in kinds:
        along = _spread(*each.x, task.footprint[1], task.overlap)
        for low, high in _strips(each.y, task, passes):
            y, sweep = (low + offset, high + offset), max(sweep, high - low)
            spacing = float(along[1] - along[0]) if len(along) > 1 else 0.0
            found = fastest_crossing(boom, y, len(along), spacing, period, task.tip_height, task.constraint, task.profile)
            if found is None:
                return PassOption(passes, sweep, 0.0, "the tip's reach")
            best = found[0]
            if task.speed is not None and best >= task.speed:
                whole = ground_lines(boom, found[1], task.constraint, task.profile)
                best, limit = whole.speed, whole.limit
            speed = min(speed, best)
    return PassOption(passes, sweep, speed, limit)


def _ground(
    boom: Boom, plot: Beside, period: float, offset: float, task: ScanTask, passes: int
) -> tuple[tuple[GroundLines, ...], ...]:
    along = _spread(*plot.x, task.footprint[1], task.overlap)
    spacing = float(along[1] - along[0]) if len(along) > 1 else 0.0
    found = []
    for low, high in _strips(plot.y, task, passes):
        y = (low + offset, high + offset)
        best = fastest_crossing(boom, y, len(along), spacing, period, task.tip_height, task.constraint, task.profile)
        if best is not None:
            lines = ground_lines(boom, best[1], task.constraint, task.profile)
            both = best[1].lines % 2 == 1
            found.append((lines, mirrored(boom, lines, task.constraint)) if both else (lines,))
    return tuple(found)


def _window(boom: Boom, lines: Array, task: ScanTask, most: float) -> float:
    """Return how far the tip may go to either side on every line, in steps of 0.1 m.

    It is negative where a line is out of reach.
    """
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


def _best_offset(boom: Boom, plot: Beside, task: ScanTask) -> float:
    """Return the offset of the track with the widest window, the middle of several."""
    lines = _lines(plot.y, task)
    most = 0.5 * (plot.x[1] - plot.x[0]) if task.speed is None else 0.0
    windows = np.array([_window(boom, lines + offset, task, min(most, _WIDEST)) for offset in _OFFSETS])
    best = _OFFSETS[windows >= windows.max() - 1e-9]
    return float(np.round(best[len(best) // 2], 6))


def _visit(boom: Boom, plot: Beside, y: tuple[float, float], offset: float, task: ScanTask) -> Visit:
    """Return the stops at a plot, and which lines between two edges y the boom reaches."""
    lines = _lines(y, task) + offset
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


def _looked(
    boom: Boom, plot: Beside, visit: Visit, offset: float, task: ScanTask, moves: dict[str, Move]
) -> tuple[float, float, float, float]:
    """Plan a plot's moves; return the share seen, the overlap, the seconds and the energy."""
    if not visit.lines:
        return 0.0, 0.0, 0.0, 0.0
    length = plot.x[1] - plot.x[0]
    if visit.ground and task.speed is not None:
        looks, energy = _ground_looks(boom, plot, visit, task, moves)
        return *_seen(plot, offset, looks), len(visit.ground) * length / task.speed, energy
    targets = targets_of(visit, task)
    for a, b in pairwise(targets):
        for start, goal in ((a, b), (b, a)):  # every other stop is swept the other way
            _planned(boom, start, goal, task, moves)
    swept = [moves[f"{a} to {b}"] for a, b in pairwise(targets)]
    if task.speed is not None:
        still = [_still(boom, target, task) for target in targets]
        step = task.speed / task.rate
        looks = []
        for phase in np.arange(_PHASES) * step / _PHASES:
            steps = np.arange(plot.x[0] - phase, plot.x[1] + step, step)
            looks.append(np.concatenate([marked + np.array([x, 0.0]) for marked in still for x in steps]))
        return *_seen(plot, offset, looks), len(targets) * length / task.speed, 0.0
    marks = [_footprints(boom, move.trajectory.q[_shots(move, task)], task) for move in swept] or [
        _still(boom, targets[0], task)
    ]
    seconds = len(visit.stops) * max(sum(move.report.duration for move in swept), 1.0 / task.rate)
    look = np.concatenate([marked + np.array([x, 0.0]) for x in visit.stops for marked in marks])
    return *_seen(plot, offset, [look]), seconds, len(visit.stops) * sum(_work(boom, move) for move in swept)


def _planned(boom: Boom, start: str, goal: str, task: ScanTask, moves: dict[str, Move]) -> Move:
    name = f"{start} to {goal}"
    if name not in moves:
        try:
            moves[name] = plan(boom, start, goal, along="line", profile=task.profile, constraint=task.constraint)
        except InfeasibleError:  # a line from row to row may lead past the mount
            moves[name] = plan(boom, start, goal, profile=task.profile, constraint=task.constraint)
    return moves[name]


def _ground_looks(boom: Boom, plot: Beside, visit: Visit, task: ScanTask, moves: dict[str, Move]) -> tuple[list[Array], float]:
    """Plan the moves over the ground; return the footprints for every phase, and the energy."""
    speed, energy = task.speed or 0.0, 0.0
    looks: list[list[Array]] = [[] for _ in range(_PHASES)]
    for number, both in enumerate(visit.ground):
        crossing = both[0].crossing
        for side, each in enumerate(both):
            moves[ground_name(visit.kind, number, side)] = ground_move(boom, each, speed)
            _planned(boom, *each.crossing.forward, task, moves)
        move = moves[ground_name(visit.kind, number, 0)]
        energy += _work(boom, move) + _work(boom, moves[" to ".join(both[0].crossing.forward)])
        begin = first_line(plot, crossing.lines, task) + crossing.begin
        for phase in range(_PHASES):
            t = (np.arange(int(move.report.duration * task.rate)) + phase / _PHASES) / task.rate
            at = np.searchsorted(move.trajectory.t, t).clip(max=len(move.trajectory.t) - 1)
            marks = _footprints(boom, move.trajectory.q[at], task)
            travelled = np.stack([begin + speed * move.trajectory.t[at], np.zeros(len(at))], axis=-1)
            looks[phase].append(marks + travelled[:, None, :])
    return [np.concatenate(each) for each in looks], energy


def _shots(move: Move, task: ScanTask) -> Array:
    """Return the samples at which the sensor looks: at its rate from the begin, and at the end."""
    t = move.trajectory.t
    return np.unique(np.append(np.searchsorted(t, np.arange(0.0, t[-1], 1.0 / task.rate)), len(t) - 1))


def _work(boom: Boom, move: Move) -> float:
    motion = move.trajectory
    return float(np.trapezoid(np.maximum(torques(boom, motion) * motion.qd, 0.0).sum(axis=1), motion.t))


def _seen(plot: Beside, offset: float, looks: list[Array]) -> tuple[float, float]:
    """Return the share of a plot that footprints (n, 4, 2) see, and how often; the worst look."""
    shapely = library("shapely")
    area = shapely.box(plot.x[0], plot.y[0] + offset, plot.x[1], plot.y[1] + offset)
    found = []
    for look in looks:
        pieces = shapely.intersection(shapely.polygons(look), area)
        union = shapely.union_all(pieces)
        found.append((union.area / area.area, float(shapely.area(pieces).sum() / max(union.area, 1e-12))))
    return min(found)


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
