"""Passes along a log in time: the tip's ways from line to line, and all of it as a mission."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from boom_model import Boom, InfeasibleError, forward_kinematics
from boom_model.arrays import Array
from planner.field.scan_day import SHORTEST_HOLD, mission_head, position_words, sample_rows, step_lines
from planner.field.scan_task import ScanTask
from planner.motion.planned import PlannedMotion
from planner.move_spec import MoveSpec
from planner.planning import Move, check_motion, plan_motion

if TYPE_CHECKING:
    from planner.field.scan_track import TrackScan

SWAY = "a mission file and the verdicts of moves are for level ground: the vehicle's sway is in the worst ratios alone"
_SAME = 1e-7  # [rad or m] of the joints at the end of a pass and at the begin of the next
_DECIMALS = 9


@dataclass(frozen=True, eq=False)
class Way:
    """The boom between two passes: it goes to the next line, and waits there."""

    target: str
    """Of the move, as a mission has it."""
    along: str
    """line, or joint where there is no line"""
    move: Move | None
    """None where the boom is there already."""
    gap: float
    """Time that the log leaves [s]."""

    @property
    def duration(self) -> float:
        """Of the move [s]."""
        return 0.0 if self.move is None else self.move.report.duration

    @property
    def hold(self) -> float:
        """Of the boom at the next line [s]."""
        return self.gap - self.duration


def way_between(boom: Boom, task: ScanTask, start: Array, goal: Array, gap: float) -> Way:
    """Return the tip's way between two joint positions (5,): on a line, or joint by joint.

    Raises:
        InfeasibleError: there is neither.
    """
    if np.abs(goal - start).max() < _SAME:
        return Way("", "joint", None, gap)
    target, planned = _tip(boom, goal), None
    try:
        planned = _planned(task, boom, _tip(boom, start), target, "line", start)
        off = [np.abs(planned.trajectory.q[k] - q).max() for k, q in ((0, start), (-1, goal))]
        planned = planned if max(off) < _SAME else None
    except InfeasibleError:  # the line may lead past the mount
        pass
    along = "joint" if planned is None else "line"
    if planned is None:
        target = position_words(goal)
        planned = _planned(task, boom, position_words(start), target, along, start)
    return Way(target, along, check_motion(boom, planned.trajectory, profile=task.profile), gap)


def _planned(task: ScanTask, boom: Boom, start: str, goal: str, along: str, reference: Array) -> PlannedMotion:
    spec = MoveSpec.of(start, goal, along=along, profile=task.profile, constraint=task.constraint)
    return plan_motion(boom, spec, reference)


def _tip(boom: Boom, q: Array) -> str:
    return "tip=" + ",".join(f"{round(float(v), _DECIMALS) + 0.0:.10g}" for v in forward_kinematics(boom, q).position)


def track_mission(scan: "TrackScan") -> str:
    """Return the passes as a mission: from and to transport, with ways and holds between.

    From the first pass to the last it takes the time of the log.

    Raises:
        InfeasibleError: no line is reached.
    """
    passes = scan.reached
    if not passes:
        raise InfeasibleError(f"{scan.source}: no line is reached, so there is nothing to do: {scan.passes[0].reason}")
    rows = {each.row for each in passes}
    plots = sum(number in rows for number in scan.plots.rows)
    lines = mission_head(scan.task, scan.plots, f"along {scan.source}", plots)
    lines.insert(1, "# The vehicle's sway is not in it: it is for level ground.")
    first = passes[0].move
    assert first is not None
    lines += step_lines(position_words(first.trajectory.q[0]), scan.task.profile)
    for number, each in enumerate(passes):
        assert each.move is not None
        lines += ["", "[[steps]]", f"motion = {sample_rows(each.move.trajectory)}"]
        if number == len(passes) - 1:
            break
        way = scan.ways[number]
        lines += step_lines(way.target, scan.task.profile, way.along) if way.move is not None else []
        lines += ["", "[[steps]]", f"hold_s = {way.hold:.4f}"] if way.hold > SHORTEST_HOLD else []
    return "\n".join([*lines, *step_lines("transport", scan.task.profile)]) + "\n"
