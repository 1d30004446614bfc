"""The main job: from two targets to a motion that has been checked."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from boom_model import JOINTS, Boom, Breakdown, Loads, breakdown
from boom_model.arrays import Array
from boom_model.boom import LOAD_UNITS
from boom_model.drives.drive import drive_torque_limit
from boom_model.dynamics.newton_euler import PayloadAs
from boom_model.kinematics.constraints import Constraint
from planner.checks.certificate import certificate_of
from planner.checks.drives.duty import Duty
from planner.checks.evaluation import Evaluation, at_samples, evaluate
from planner.checks.motion_checks import check_rows
from planner.checks.stopping import WorstStop, worst_stop
from planner.motion.planned import PlannedMotion
from planner.motion.trajectory import STEP, Trajectory, motion_table
from planner.motion.vehicle import LEVEL, VehicleCase, load_case
from planner.move_spec import MoveSpec
from planner.paths.legs import legs
from planner.paths.targets import Target, resolve
from planner.progress import Track
from planner.reports.report import Report, TorquePeak, assumptions, torque_peaks
from planner.timing.profile import PROFILES, TimingProfile
from planner.timing.time_law import Motion
from planner.timing.timing import timed

if TYPE_CHECKING:
    import pyarrow as pa
    from matplotlib.figure import Figure

_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False, repr=False)
class Move:
    """A motion and its report. What the report does not need is evaluated when it is asked for."""

    profile: str
    """The profile's name, or what a motion from elsewhere is called."""
    trajectory: Trajectory
    """The samples. Those of a plan know the continuous motion that they were taken from."""
    evaluation: Evaluation
    """What the report was made from: a plan on its fine grid, a motion from elsewhere at its samples."""
    report: Report
    """Without the stop analysis; see `full_report`."""

    @property
    def boom(self) -> Boom:
        return self.evaluation.boom

    @property
    def vehicle(self) -> VehicleCase:
        return self.evaluation.vehicle

    @property
    def motions(self) -> tuple[Motion, ...]:
        """The continuous motions behind a plan's samples, from stop to stop; none of an empty move or other motions."""
        planned = self.evaluation.planned
        return () if planned is None else planned.motions

    @cached_property
    def sampled(self) -> Evaluation:
        """The evaluation at the trajectory's samples, for what is shown or written at them."""
        evaluation = self.evaluation
        if evaluation.trajectory is self.trajectory:
            return evaluation
        return at_samples(self.boom, self.trajectory, vehicle=self.vehicle, payload_as=evaluation.payload_as)

    @property
    def loads(self) -> Loads:
        """Joint torques, pin forces and mount wrench at the samples."""
        return self.sampled.loads

    @cached_property
    def parts(self) -> Breakdown:
        """Parts of the torques at the samples, friction included."""
        return _parts(self.sampled)

    @cached_property
    def stop(self) -> WorstStop | None:
        """The longest and the farthest stop on the way of a plan; None of other motions."""
        return worst_stop(self.boom, self.motions, self.vehicle.tilt) if self.motions else None

    @cached_property
    def full_report(self) -> Report:
        """The report with the stop analysis, which takes longer than the rest of it."""
        return replace(self.report, stop=self.stop)

    def torque_limits(self) -> Array:
        """Joint torque (n, 5) that each drive allows at the samples' speeds [Nm]; infinite where no limit is known.

        See `drive_torque_limit`: it bounds the torque with the drive's own inertia added.
        """
        limits = np.full(self.trajectory.q.shape, np.inf)
        for i, drive in enumerate(self.boom.drives):
            limit = None if drive is None else drive_torque_limit(drive, self.trajectory.qd[:, i])
            if limit is not None:
                limits[:, i] = limit
        return limits

    def to_table(self) -> "pa.Table":
        """The samples with their torques: t, q1..q5, qd1..qd5, qdd1..qdd5, tau1..tau5 in SI."""
        return motion_table(self.trajectory, self.loads.tau)

    def plot(self) -> "Figure":
        """A figure of positions, speeds, accelerations and torques over time."""
        from planner.reports.move_pictures import move_figure

        return move_figure(self.boom, self.trajectory, self.loads.tau)

    def record(self, path: str | Path) -> None:
        """Writes the move as a Rerun recording; `boom view` or `rerun` shows it.

        Raises:
            InputError: the file cannot be written; an old one is left as it was.
        """
        from planner.recording import write_recording  # above this module in the order of rooms, and slow to import

        write_recording(path, self)

    def __repr__(self) -> str:
        count = len(self.trajectory.t)
        return f"Move({self.profile}, {self.report.duration:.3f} s, {count} samples, {self.report.verdict})"

    def _repr_html_(self) -> str:
        limits, tau = self.torque_limits(), self.loads.tau
        rows = []
        for i, joint in enumerate(JOINTS):
            at = int(np.abs(tau[:, i]).argmax())
            limit = limits[at, i]
            allowed = "-" if np.isinf(limit) else f"{limit:.1f} {LOAD_UNITS[i]}"
            verdict = self.report.verdict_of(joint)
            cells = (joint, f"{tau[at, i]:.1f} {LOAD_UNITS[i]}", allowed, f"{self.trajectory.t[at]:.2f} s", verdict)
            rows.append("".join(f"<td>{cell}</td>" for cell in cells))
        header = "".join(f"<th>{name}</th>" for name in ("joint", "largest torque", "drive allows then", "at", "verdict"))
        table = "".join(f"<tr>{row}</tr>" for row in rows)
        return (
            f"<p>{self.profile}, {self.report.duration:.3f} s: {self.report.summary}</p><table><tr>{header}</tr>{table}</table>"
        )


def plan(
    boom: Boom,
    start: Target,
    goal: Target,
    *,
    profile: str | TimingProfile = "cubic",
    constraint: str | Constraint = "horizontal",
    pitch: str | float | None = "down",
    via: Sequence[Target] = (),
    stop_at_via: bool = True,
    along: str | ArrayLike = "joint",
    duration: float | None = None,
    rate: float | None = None,
    vehicle: str | VehicleCase = LEVEL,
    step: float = STEP,
) -> Move:
    """A move from start to goal, rest to rest, checked on a grid finer than its samples. `MoveSpec.of` has the arguments.

    Raises:
        InputError: an input is malformed or not finite.
        InfeasibleError: a target is out of reach or outside the limits, the duration is too short, something to be kept
            away from is in the way, or no motion keeps the drives' limits.

    >>> move = plan(Boom.load(), "transport", "phenotyping", profile="time-optimal")
    >>> move
    Move(time-optimal, 4.333 s, 435 samples, INCOMPLETE)
    """
    spec = MoveSpec.of(
        start,
        goal,
        via=via,
        stop_at_via=stop_at_via,
        constraint=constraint,
        pitch=pitch,
        along=along,
        profile=profile,
        duration=duration,
        rate=rate,
        vehicle=vehicle,
        step=step,
    )
    return plan_move(boom, spec)


def plan_move(boom: Boom, spec: MoveSpec) -> Move:
    """`plan` of a description."""
    planned = plan_motion(boom, spec)
    return _move(evaluate(boom, planned, vehicle=spec.vehicle), planned.trajectory, str(spec.profile))


def plan_motion(boom: Boom, spec: MoveSpec, reference: ArrayLike | None = None) -> PlannedMotion:
    """The motions of a move from stop to stop, without loads or checks.

    Args:
        reference: joint position (5,) that the start of a tip line or arc is nearest to; None is the middle of the ranges.

    Raises:
        InputError, InfeasibleError: as `plan`.
    """
    paths, notes = legs(boom, spec.targets, spec.pitch, spec.constraint, spec.along, spec.stop_at_via, reference)
    if not paths:
        q = resolve(boom, spec.start, spec.pitch, spec.constraint)
        note = "start and goal are the same joint position: an empty move, of no duration"
        return PlannedMotion((), q, spec.step, (note,))
    motions = timed(boom, paths, spec.timing, spec.vehicle.tilt)
    lasts = sum(motion.duration for motion in motions)
    if spec.rate is not None and spec.duration is not None and lasts > spec.duration * (1.0 + _ROUNDING):
        notes = (*notes, f"lengthened from {spec.duration:g} s to {lasts:g} s by the controller's clock")
    return PlannedMotion(motions, motions[0].path(0.0), spec.step, notes, spec.profile.limits_average_torque)


def plan_each_profile(boom: Boom, start: Target, goal: Target, track: Track = iter) -> list[Trajectory]:
    """The move in the least time of each profile, as samples alone.

    Args:
        track: iterates over the profiles, and may show how far it is.

    Raises:
        InputError, InfeasibleError: as `plan`.
    """
    specs = [MoveSpec.of(start, goal, profile=profile) for profile in PROFILES]
    return [replace(plan_motion(boom, spec).trajectory, planned=None) for spec in track(specs)]


def check(
    boom: Boom,
    trajectory: Trajectory,
    *,
    payload_as: PayloadAs = "mass",
    vehicle: str | VehicleCase = LEVEL,
    profile: str = "recorded",
    duty: Duty | None = None,
) -> Report:
    """The limit and drive checks of any motion, with the joints' friction where it is known.

    A trajectory of a plan is checked between its samples too, so that its report is the plan's; any other at its samples.

    Args:
        payload_as: see `inverse_dynamics`.
        vehicle: what the vehicle does meanwhile.
        profile: what the report calls the motion.
        duty: the cycle that the samples stand for; None is the motion alone.
    """
    return examine(boom, trajectory, payload_as=payload_as, vehicle=vehicle, profile=profile, duty=duty).report


def examine(
    boom: Boom,
    trajectory: Trajectory,
    *,
    payload_as: PayloadAs = "mass",
    vehicle: str | VehicleCase = LEVEL,
    profile: str = "recorded",
    duty: Duty | None = None,
) -> Move:
    """Any motion with its loads and its checks, as `write_recording` takes it; for the arguments see `check`."""
    case = load_case(vehicle) if isinstance(vehicle, str) else vehicle
    return _move(evaluate(boom, trajectory, vehicle=case, payload_as=payload_as), trajectory, str(profile), duty)


def torques(boom: Boom, trajectory: Trajectory, payload_as: PayloadAs = "mass", vehicle: VehicleCase = LEVEL) -> Array:
    """Joint torques (n, 5) at a trajectory's samples, with the joints' friction where it is known.

    Raises:
        InputError: as `inverse_dynamics`, or a torque is not finite.
    """
    return at_samples(boom, trajectory, vehicle=vehicle, payload_as=payload_as, reactions=False).tau


def _move(evaluation: Evaluation, trajectory: Trajectory, profile: str, duty: Duty | None = None) -> Move:
    grid, vehicle = evaluation.trajectory, evaluation.vehicle
    report = Report(
        profile=profile,
        duration=grid.duration if duty is None else duty.duration,
        rows=check_rows(evaluation, duty),
        notes=(*grid.notes, *_vehicle_notes(vehicle)),
        assumptions=assumptions(evaluation.boom, grid.qddd is not None),
        peaks=_peaks(evaluation),
        certificate=certificate_of(evaluation),
    )
    return Move(profile, trajectory, evaluation, report)


def _peaks(evaluation: Evaluation) -> tuple[TorquePeak, ...]:
    """The largest torque of each joint, in parts."""
    at = np.abs(evaluation.tau).argmax(axis=0)
    return torque_peaks(evaluation.t[at], _parts(evaluation, at))


def _parts(evaluation: Evaluation, samples: Array | slice = slice(None)) -> Breakdown:
    motion, base = evaluation.trajectory, evaluation.vehicle.base(evaluation.t[samples])
    states = (motion.q[samples], motion.qd[samples], motion.qdd[samples])
    with np.errstate(over="ignore", invalid="ignore"):
        return breakdown(evaluation.boom, *states, base=base, payload_as=evaluation.payload_as, friction=True)


def _vehicle_notes(vehicle: VehicleCase) -> tuple[str, ...]:
    if vehicle is LEVEL:
        return ()
    planned = "" if vehicle.is_steady else "; a plan knows its slope alone, the checks all of it"
    return (vehicle.sentence + planned,)
