"""Comparison of the profiles on one move."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from boom_model import Boom, InfeasibleError
from planner.checks.kinds import CheckKind
from planner.move_spec import MoveSpec
from planner.planning import Move, plan_move
from planner.progress import Track
from planner.reports.markdown import table
from planner.reports.report import Report
from planner.timing.limit_ratios import Limit
from planner.timing.path_limits import jerk_stretch
from planner.timing.profile import PROFILES, SHORTEST, TimeOptimal, TimingProfile


@dataclass(frozen=True)
class ProfileRow:
    """Duration of one profile and its largest ratios of demand to limit.

    A ratio is None if the limit is not known.
    """

    profile: str
    duration_s: float
    """Duration [s]."""
    velocity: float
    acceleration: float
    jerk: float | None
    """Ratio of the jerk; None if the acceleration jumps, because the jerk is then infinite."""
    gearbox_torque: float | None
    motor_torque: float | None
    """Ratio to the torque that the motor gives at its speed with a stepper's margin."""
    motor_speed: float | None
    """Ratio to the speed up to which the motor's curve gives the required torque."""
    stop_s: float
    """Duration of the longest stop [s]."""
    stop_m: float
    """Distance of the tip in the farthest stop [m]."""
    verdict: str


HEADER = (
    "profile",
    "duration",
    "velocity",
    "acceleration",
    "jerk",
    "gearbox",
    "motor torque",
    "motor speed",
    "worst stop",
    "verdict",
)
"""Columns of `cells`; a ratio is demand / limit."""


def profile_moves(boom: Boom, spec: MoveSpec, track: Track = iter) -> tuple[dict[str, Move], dict[str, str]]:
    """Plan a move with every profile, and with the time-optimal one also with bounded jerk.

    Args:
        boom: the boom.
        spec: the move. Its own profile is ignored.
        track: iterates over the profiles, and may show progress.

    Returns:
        Moves by the name of the profile, and the reasons for those that are infeasible.

    Raises:
        InputError: as `plan`.
        InfeasibleError: as `plan`, if no profile can make the move.
    """
    profiles: list[tuple[str, TimingProfile]] = [(str(name), PROFILES[name]()) for name in SHORTEST]
    profiles.append(("time-optimal, jerk bound", TimeOptimal(jerk_bound=True)))
    moves: dict[str, Move] = {}
    refused: dict[str, str] = {}
    for name, profile in track(profiles):
        try:
            moves[name] = plan_move(boom, replace(spec, profile=profile))
        except InfeasibleError as error:
            refused[name] = str(error)
    if not moves:
        raise InfeasibleError(next(iter(refused.values())))
    return moves, refused


def profile_table(boom: Boom, spec: MoveSpec) -> tuple[ProfileRow, ...]:
    """Return the rows of `profile_moves`."""
    return profile_rows(profile_moves(boom, spec)[0])


def profile_rows(moves: Mapping[str, Move]) -> tuple[ProfileRow, ...]:
    """Return a row for each named move."""
    return tuple(_row(name, move) for name, move in moves.items())


def profile_markdown(rows: Sequence[ProfileRow]) -> str:
    """Return the rows as a Markdown table."""
    return "\n".join(table(HEADER, map(cells, rows))) + "\n"


def cells(row: ProfileRow) -> tuple[str, ...]:
    """Return a row as text, in the columns of HEADER."""

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
        row.verdict,
    )


def _row(name: str, move: Move) -> ProfileRow:
    report = move.full_report
    if report.certificate is None or report.stop is None:  # an empty move
        return ProfileRow(name, 0.0, 0.0, 0.0, 0.0, None, None, None, 0.0, 0.0, report.verdict)
    worst = {each.limit: each.ratio for each in report.certificate.worst}
    continuous = all(_continuous(move, i) for i in range(len(move.motions)))
    jerk = max(jerk_stretch(move.boom, motion.path, motion.law) ** 3 for motion in move.motions) if continuous else None
    return ProfileRow(
        profile=name,
        duration_s=report.duration,
        velocity=worst[Limit.VELOCITY],
        acceleration=worst[Limit.ACCELERATION],
        jerk=jerk,
        gearbox_torque=worst.get(Limit.GEARBOX_TORQUE),
        motor_torque=worst.get(Limit.MOTOR_TORQUE),
        motor_speed=_motor_speed(report),
        stop_s=report.stop.time_s,
        stop_m=report.stop.distance_m,
        verdict=report.verdict,
    )


def _continuous(move: Move, part: int) -> bool:
    """Return whether the acceleration of a part is continuous and zero at both ends."""
    motion = move.motions[part]
    inner = np.asarray(motion.law.s.x)[1:-1]
    before, after = (motion(inner + side * 1e-9 * motion.duration)[2] for side in (-1.0, 1.0))
    ends = motion(np.array([0.0, motion.duration]))[2]
    scale = move.boom.limits.acceleration
    return bool((np.abs(after - before) < 1e-3 * scale).all() and (np.abs(ends) < 1e-3 * scale).all())


def _motor_speed(report: Report) -> float | None:
    rows = [row for row in report.rows if row.kind is CheckKind.MOTOR_SPEED and row.demand is not None and row.limit]
    return max((row.demand / row.limit for row in rows if row.demand is not None and row.limit), default=None)
