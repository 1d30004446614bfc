"""The profiles side by side on one move."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from boom_model import Boom, InfeasibleError
from planner.paths.targets import Target
from planner.planning import Move, plan
from planner.progress import Track
from planner.reports.markdown import table
from planner.reports.report import Report
from planner.timing.path_limits import jerk_stretch
from planner.timing.timing import Profile


@dataclass(frozen=True)
class ProfileRow:
    """What one profile takes and asks for; ratios are demand / limit at worst, None where nothing gives the limit."""

    profile: str
    duration_s: float
    velocity: float
    acceleration: float
    jerk: float | None
    """None where the acceleration jumps, which takes an infinite jerk."""
    gearbox_torque: float | None
    motor_torque: float | None
    """Of the torque that the motor drives at its speed with the margin of a stepper."""
    motor_speed: float | None
    """Of the speed up to which the motor's curve gives the torque that is asked of it."""
    stop_s: float
    stop_m: float
    verdict: str


HEADER = ("profile", "duration", "velocity", "acceleration", "jerk", "gearbox", "motor torque", "motor speed", "worst stop")


def profile_moves(
    boom: Boom, start: Target, goal: Target, track: Track = iter, **options: Any
) -> tuple[dict[str, Move], dict[str, str]]:
    """One move with every profile, the time-optimal one also with its jerk bounded, by name; and why the others cannot be.

    Args:
        track: iterates over the profiles, and may show how far it is.
        options: of `plan`, other than the profile's.

    Raises:
        InputError: as `plan`.
        InfeasibleError: as `plan`, where no profile can make the move.
    """
    timings: list[tuple[str, dict[str, Any]]] = [(profile.value, {"profile": profile}) for profile in Profile]
    timings.append(("time-optimal, jerk bound", {"profile": Profile.TIME_OPTIMAL, "jerk_bound": True}))
    moves: dict[str, Move] = {}
    refused: dict[str, str] = {}
    for name, timing in track(timings):
        try:
            moves[name] = plan(boom, start, goal, **timing, **options)
        except InfeasibleError as error:
            refused[name] = str(error)
    if not moves:
        raise InfeasibleError(next(iter(refused.values())))
    return moves, refused


def profile_table(boom: Boom, start: Target, goal: Target, **options: Any) -> tuple[ProfileRow, ...]:
    """The rows of `profile_moves`, with the same arguments."""
    return profile_rows(profile_moves(boom, start, goal, **options)[0])


def profile_rows(moves: Mapping[str, Move]) -> tuple[ProfileRow, ...]:
    """A row for each move, by name."""
    return tuple(_row(name, move) for name, move in moves.items())


def profile_markdown(rows: Sequence[ProfileRow]) -> str:
    """The rows as a table in Markdown."""
    return "\n".join(table(HEADER, map(cells, rows))) + "\n"


def cells(row: ProfileRow) -> tuple[str, ...]:
    """A row for people, under HEADER."""

    def shown(ratio: float | None) -> str:
        return "-" if ratio is None else f"{ratio:.3f}"

    ratios = (row.velocity, row.acceleration)
    jerk = "jumps" if row.jerk is None else shown(row.jerk)
    drives = map(shown, (row.gearbox_torque, row.motor_torque, row.motor_speed))
    return (
        row.profile,
        f"{row.duration_s:.3f} s",
        *map(shown, ratios),
        jerk,
        *drives,
        f"{row.stop_s:.2f} s, {row.stop_m:.2f} m",
    )


def _row(name: str, move: Move) -> ProfileRow:
    report = move.report
    if report.certificate is None or report.stop is None:  # an empty move
        return ProfileRow(name, 0.0, 0.0, 0.0, 0.0, None, None, None, 0.0, 0.0, report.verdict)
    worst = {each.limit: each.ratio for each in report.certificate.worst}
    continuous = all(_continuous(move, i) for i in range(len(move.motions)))
    jerk = max(jerk_stretch(move.boom, motion.path, motion.law) ** 3 for motion in move.motions) if continuous else None
    return ProfileRow(
        profile=name,
        duration_s=report.duration,
        velocity=worst["velocity"],
        acceleration=worst["acceleration"],
        jerk=jerk,
        gearbox_torque=worst.get("gearbox torque"),
        motor_torque=worst.get("motor torque"),
        motor_speed=_motor_speed(report),
        stop_s=report.stop.time_s,
        stop_m=report.stop.distance_m,
        verdict=report.verdict,
    )


def _continuous(move: Move, part: int) -> bool:
    """Whether the acceleration of a part neither jumps on the way nor at its ends."""
    motion = move.motions[part]
    inner = np.asarray(motion.law.s.x)[1:-1]
    before, after = (motion(inner + side * 1e-9 * motion.duration)[2] for side in (-1.0, 1.0))
    ends = motion(np.array([0.0, motion.duration]))[2]
    scale = move.boom.limits.acceleration
    return bool((np.abs(after - before) < 1e-3 * scale).all() and (np.abs(ends) < 1e-3 * scale).all())


def _motor_speed(report: Report) -> float | None:
    rows = [row for row in report.rows if row.check == "motor speed" and row.demand is not None and row.limit]
    return max((row.demand / row.limit for row in rows if row.demand is not None and row.limit), default=None)
