"""The day of a row scan: drives, turns and the boom's moves in time; the same as a mission."""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import groupby, pairwise
from typing import TYPE_CHECKING

import numpy as np

from boom_model import BaseMotion, Boom, inverse_dynamics
from boom_model.arrays import Array
from planner.field.plots import PlotMap
from planner.field.scan_rows import Beside, Row, length, turn
from planner.field.scan_task import Leg, ScanTask, Visit, first_line, ground_name, targets_of
from planner.motion.trajectory import Trajectory
from planner.planning import Move, plan
from planner.timing.path_limits import load_ratio

if TYPE_CHECKING:
    from planner.field.scan import Scan

STARTS = 1.0
"""Assumed acceleration of a vehicle that starts, stops or turns [m/s^2]."""
SHORTEST_HOLD = 0.01
"""Of a mission [s]."""
_DIGITS = 9
_KNOTS = 0.05  # [s] between samples of a motion in a mission file

Work = list[tuple[Beside, Visit]]
Planned = Callable[[str, str], str]
"""Plans the tip's move between two targets where there is none yet, and returns its words."""


@dataclass(frozen=True, eq=False)
class Day:
    """What the legs of a day are made from."""

    task: ScanTask
    offset: float
    rows: tuple[Row, ...]
    visits: dict[int, Visit]
    """By plot."""
    moves: dict[str, Move]
    planned: Planned


def legs(day: Day) -> tuple[Leg, ...]:
    """Return the vehicle's day, row by row, with a turn between two of them."""
    found: list[Leg] = []
    here = ""
    for row in day.rows:
        work = [(each, day.visits[each.plot]) for each in row.plots if day.visits[each.plot].lines]
        if not work:
            continue
        if day.task.speed is None:
            mine = list(_stops(day, row, work, here))
        elif all(visit.ground for _, visit in work):
            mine = list(_over_ground(day, row, work, here))
        else:
            mine = list(_beside(day, row, work, here))
        if found:
            ahead = found[-1].ahead
            assert ahead is not None, "a row's last leg looks along the row"
            way = turn(found[-1].way[-1], ahead, mine[0].way[0], day.task.turn_radius)
            found.append(_driven(day, "turn", way, None, here, mine[0].start))
        found += mine
        here = mine[-1].goal
    return tuple(found)


def _driven(day: Day, what: str, way: Array, ahead: Array | None, here: str, goal: str, speed: float | None = None) -> Leg:
    """Return a drive during which the tip goes from one target to another.

    It lasts as long as the longer of the two.
    """
    moves = (day.planned(here, goal),) if here != goal else ()
    seconds = sum(day.moves[name].report.duration for name in moves)
    return Leg(what, max(length(way) / (speed or day.task.drive_speed), seconds), way, ahead, moves, here, goal)


def _stops(day: Day, row: Row, work: Work, here: str) -> Iterator[Leg]:
    last = None
    for each, visit in work:
        targets = targets_of(visit, day.task)
        for stop in visit.stops:
            place = row.at(each.along + stop, day.offset)[None]
            order = targets[::-1] if here == targets[-1] else targets
            if last is not None:
                yield _driven(day, "drive", np.vstack([last, place]), row.ahead, here, order[0])
            moves = tuple(f"{a} to {b}" for a, b in pairwise(order))
            seconds = max(sum(day.moves[name].report.duration for name in moves), 1.0 / day.task.rate)
            yield Leg("stop", seconds, place, row.ahead, moves, order[0], order[-1], each.plot)
            last, here = place, order[-1]


def _beside(day: Day, row: Row, work: Work, here: str) -> Iterator[Leg]:
    speed = day.task.speed or 1.0
    ends = np.array([row.at(x, day.offset) for x in row.span])
    targets = targets_of(max((visit for _, visit in work), key=lambda visit: len(visit.lines)), day.task)
    order = targets[::-1] if here == targets[-1] else targets
    for number, target in enumerate(order):
        if number:
            yield _driven(day, "back", ends[::-1], row.ahead, order[number - 1], target)
        yield Leg("pass", length(ends) / speed, ends, row.ahead, (), target, target)


def _over_ground(day: Day, row: Row, work: Work, here: str) -> Iterator[Leg]:
    speed = day.task.speed or 1.0
    last = None
    side = next((k for k, lines in enumerate(work[0][1].ground[0]) if lines.crossing.targets[0] == here), 0)
    for number in range(len(work[0][1].ground)):
        for position, (each, visit) in enumerate(work):
            crossing = visit.ground[number][side % len(visit.ground[number])].crossing
            begin = each.along + first_line(each, crossing.lines, day.task) + crossing.begin
            ends = np.array([row.at(begin + x, day.offset) for x in (0.0, crossing.travel)])
            start, goal = crossing.targets
            if last is not None:
                way, what = np.vstack([last, ends[:1]]), "drive" if position else "back"
                yield _driven(day, what, way, row.ahead, here, start, speed if position else None)
            name = ground_name(visit.kind, number, side % len(visit.ground[number]))
            yield Leg("pass", day.moves[name].report.duration, ends, row.ahead, (name,), start, goal, each.plot)
            last, here, side = ends[1:], goal, (side + crossing.lines) % 2


def held(boom: Boom, task: ScanTask, moves: dict[str, Move], leg: Leg) -> Array:
    """Return the joint position (5,) at a leg's begin."""
    for name, move in moves.items():
        start, _, goal = name.partition(" to ")
        if leg.start in (start, goal):
            position: Array = move.trajectory.q[-1 if leg.start == goal else 0]
            return position
    return np.asarray(plan(boom, leg.start, leg.start, constraint=task.constraint).trajectory.q[0])


def starting_ratio(boom: Boom, day: Day, found: tuple[Leg, ...]) -> float:
    """Return the largest demand over limit of a drive while the vehicle starts, stops or turns.

    The mount accelerates by STARTS ahead, back or to either side, at every position from which the
    vehicle drives.
    """
    first = {leg.start: leg for leg in found}
    q = np.repeat([held(boom, day.task, day.moves, leg) for leg in first.values()], 4, axis=0)
    ways = STARTS * np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    still = np.zeros_like(q)
    base = BaseMotion.of(acceleration=np.tile(ways, (len(first), 1)))
    tau = inverse_dynamics(boom, q, still, still, base=base, reactions=False).tau
    return float(load_ratio(boom, tau, still, still).max())


def mission_text(scan: "Scan") -> str:
    """Return the day as a mission: from and to transport, with what is alike put together.

    The boom holds still while the vehicle drives and turns. All of that time is spread evenly over
    the holds, so that the mission lasts as long as the day.
    """
    task = scan.task
    how = "with stops" if task.speed is None else f"at {task.speed:g} m/s"
    lines = mission_head(task, scan.plots, how, sum(bool(visit.lines) for visit in scan.visits))
    body = _ground_steps(scan) if any(visit.ground for visit in scan.visits) else _line_steps(scan)
    return "\n".join([*lines, *body, *_step(scan, "transport", line=False)]) + "\n"


def mission_head(task: ScanTask, plots: PlotMap, how: str, count: int) -> list[str]:
    """Return the lines of a mission file before its steps.

    Args:
        task: of the scan.
        plots: the map.
        how: the vehicle drives, in words.
        count: of plots that the mission covers.
    """
    return [
        f"# {len(plots.names)} plots of {plots.source}, as boom scan planned them.",
        'name = "row scan"',
        'basis = "estimated"',
        f"source = {json.dumps(f'boom scan {how}', ensure_ascii=False)}",
        f"plots = {count}",
        'start = "transport"',
        f'constraint = "{task.constraint}"',
    ]


def _line_steps(scan: "Scan") -> list[str]:
    """Return the steps of stops, or of passes of a boom that stands still."""
    task = scan.task
    stopped = task.speed is None
    kind = "stop" if stopped else "pass"
    blocks = _blocks(scan)
    moved = sum(scan.moves[name].report.duration for leg in scan.legs for name in leg.moves)
    holds = len(blocks) if stopped else sum(leg.what == kind for leg in scan.legs)
    hold = f"{max((scan.duration - moved) / max(holds, 1), SHORTEST_HOLD):.4f}"
    lines: list[str] = []
    here = ""
    for targets, group in groupby(blocks):
        count = len(list(group))
        order = targets[::-1] if here == targets[-1] else targets
        if here != order[0]:
            lines += _step(scan, order[0], line=bool(here))
        there, back = (_sweep(scan, each, hold) for each in (order, order[::-1]))
        if count > 1:
            lines += ["", "[[steps]]", f"repeat = {count // 2}", *(_inner(line) for line in there + back)]
        if count % 2:
            lines += there
        here = order[-1] if count % 2 else order[0]
    return lines


def _blocks(scan: "Scan") -> list[tuple[str, ...]]:
    """Return the targets of every stop, or of every row of passes."""
    found = []
    for _, group in groupby(zip(scan.beside, scan.visits, strict=True), lambda pair: pair[0].row):
        mine = [visit for _, visit in group if visit.lines]
        if not mine:
            continue
        if scan.task.speed is None:
            found += [targets_of(visit, scan.task) for visit in mine for _ in visit.stops]
        else:
            found.append(targets_of(max(mine, key=lambda visit: len(visit.lines)), scan.task))
    return found


def _sweep(scan: "Scan", targets: tuple[str, ...], hold: str) -> list[str]:
    """Return the steps from the first target on, with a hold after the last, or at each."""
    held = ["", "[[steps]]", f"hold_s = {hold}"]
    if scan.task.speed is None:
        return [line for target in targets[1:] for line in _step(scan, target, line=True)] + held
    return held + [line for target in targets[1:] for line in (*_step(scan, target, line=True), *held)]


def _ground_steps(scan: "Scan") -> list[str]:
    """Return the steps of lines over the ground: samples, the way forward, and a hold."""
    passed = [leg for leg in scan.legs if leg.what == "pass"]
    kinds = {visit.kind: visit for visit in scan.visits if visit.ground}
    sweeps = [(kind, number, sides) for kind, visit in kinds.items() for number, sides in enumerate(visit.ground)]
    forward = {
        ground_name(kind, number, k): each.crossing.forward for kind, number, sides in sweeps for k, each in enumerate(sides)
    }
    done = [(leg.moves[0], " to ".join(forward[leg.moves[0]])) for leg in passed]
    moved = sum(scan.moves[name].report.duration for names in done for name in names)
    hold = f"{max((scan.duration - moved) / max(len(passed), 1), SHORTEST_HOLD):.4f}"
    lines: list[str] = []
    for kind, number, sides in sweeps:
        names = [ground_name(kind, number, side) for side in range(len(sides))]
        count = sum(leg.moves[0] in names for leg in passed)
        each = [
            [
                *("", "[[steps]]", f"motion = {sample_rows(scan.moves[name].trajectory)}"),
                *_step(scan, forward[name][1], line=True),
                *("", "[[steps]]", f"hold_s = {hold}"),
            ]
            for name in names
        ]
        lines += [
            "",
            "[[steps]]",
            f'to = "{position_words(scan.moves[names[0]].trajectory.q[0])}"',
            f'profile = "{scan.task.profile}"',
        ]
        if count >= len(names):
            repeated = [line for steps in each for line in steps]
            lines += ["", "[[steps]]", f"repeat = {count // len(names)}", *(_inner(line) for line in repeated)]
        lines += each[0] if count % len(names) else []
    return lines


def position_words(q: Array) -> str:
    """Return a joint position (5,) as a target in degrees and metres."""
    yaw, inner, lower, extension, wrist = q
    angles = [f"{np.degrees(x):.10g}" for x in (yaw, inner, lower, wrist)]
    return f"q={','.join(angles[:3])},{extension:.10g},{angles[3]}"


def sample_rows(motion: Trajectory) -> str:
    """Return a motion as the samples t, q1..q5 of a mission's step."""
    every = max(1, round(_KNOTS / float(motion.t[1] - motion.t[0])))
    at = np.unique(np.append(np.arange(0, len(motion.t), every), len(motion.t) - 1))
    rows = np.column_stack([motion.t[at], motion.q[at]])
    return "[\n" + "".join(f"  [{', '.join(f'{x:.{_DIGITS}f}' for x in row)}],\n" for row in rows) + "]"


def _step(scan: "Scan", target: str, *, line: bool) -> list[str]:
    return step_lines(target, scan.task.profile, "line" if line else "joint")


def step_lines(target: str, profile: str, along: str = "joint") -> list[str]:
    """Return the lines of a mission's move to a target."""
    return ["", "[[steps]]", f'to = "{target}"', f'profile = "{profile}"', *(['along = "line"'] if along == "line" else [])]


def _inner(line: str) -> str:
    return line.replace("[[steps]]", "[[steps.steps]]")
