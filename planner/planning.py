"""Planning and checking of a move between two targets."""

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
from boom_model.measured import measured_lines
from planner.checks.certificate import certificate_of
from planner.checks.drives.duty import Duty
from planner.checks.energy import energy_of
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
from planner.timing.profile import SHORTEST, TimingProfile
from planner.timing.time_law import Motion
from planner.timing.timing import timed

if TYPE_CHECKING:
    import pyarrow as pa
    from matplotlib.figure import Figure

_ROUNDING = 1e-9
_EARLY = 1e-3


@dataclass(frozen=True, eq=False, repr=False)
class Move:
    """Motion and its report. Anything that the report does not need is computed on first use."""

    profile: str
    """Name of the profile, or of a motion that was not planned here."""
    trajectory: Trajectory
    """Samples of the motion. Those of a plan refer to the continuous motion behind them."""
    evaluation: Evaluation
    """Evaluation behind the report: a plan on its fine grid, any other motion at its samples."""
    report: Report
    """Report without the stop analysis; see `full_report`."""

    @property
    def boom(self) -> Boom:
        """Boom that moves."""
        return self.evaluation.boom

    @property
    def vehicle(self) -> VehicleCase:
        """Motion of the vehicle under the boom."""
        return self.evaluation.vehicle

    @property
    def motions(self) -> tuple[Motion, ...]:
        """Continuous motions of a plan from stop to stop; () for an empty move or other motions."""
        planned = self.evaluation.planned
        return () if planned is None else planned.motions

    @cached_property
    def sampled(self) -> Evaluation:
        """Evaluation at the trajectory's samples, for plots and files."""
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
        """Parts of the torques at the samples, including friction."""
        return _parts(self.sampled)

    @cached_property
    def stop(self) -> WorstStop | None:
        """Longest and farthest stop on the way of a plan; None for other motions."""
        return worst_stop(self.boom, self.motions, self.vehicle.tilt) if self.motions else None

    @cached_property
    def full_report(self) -> Report:
        """Report with the stop analysis, which takes longer than the rest of the report."""
        return replace(self.report, stop=self.stop)

    def torque_limits(self) -> Array:
        """Return the torque (n, 5) [Nm] that each drive allows at the samples' speeds.

        It is infinite where no limit is known. It bounds the joint torque plus the torque for the
        drive's own inertia; see `drive_torque_limit`.
        """
        limits = np.full(self.trajectory.q.shape, np.inf)
        for i, drive in enumerate(self.boom.drives):
            limit = None if drive is None else drive_torque_limit(drive, self.trajectory.qd[:, i])
            if limit is not None:
                limits[:, i] = limit
        return limits

    def to_table(self) -> "pa.Table":
        """Return the samples and torques: t, q1..q5, qd1..qd5, qdd1..qdd5, tau1..tau5 in SI."""
        return motion_table(self.trajectory, self.loads.tau)

    def plot(self) -> "Figure":
        """Return a figure of positions, velocities, accelerations and torques over time."""
        from planner.reports.move_pictures import move_figure

        return move_figure(self.boom, self.trajectory, self.loads.tau)

    def record(self, path: str | Path) -> None:
        """Write the move as a Rerun recording, which `boom view` or `rerun` shows.

        Raises:
            InputError: the file cannot be written. An existing file is left unchanged.
        """
        from planner.recording import write_recording  # slow to import, and a room above this one

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
    """Plan a move from rest at start to rest at goal; check it on a grid finer than its samples.

    `MoveSpec.of` describes the arguments, with their units.

    Raises:
        InputError: an input is malformed or not finite.
        InfeasibleError: a target is out of reach or outside the limits, the duration is too short,
            a keep-out shape blocks the way, or no motion respects the drive limits.

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
    """Plan and check the move that `spec` describes.

    Raises:
        InputError: as `plan`.
        InfeasibleError: as `plan`.
    """
    planned = plan_motion(boom, spec)
    return _move(evaluate(boom, planned, vehicle=spec.vehicle), planned.trajectory, str(spec.profile))


def plan_motion(boom: Boom, spec: MoveSpec, reference: ArrayLike | None = None) -> PlannedMotion:
    """Plan the motions of a move from stop to stop, without loads or checks.

    Args:
        boom: the boom.
        spec: the move.
        reference: joint position (5,). The start of a tip line or arc is chosen nearest to it; None
            is the middle of the joint ranges.

    Raises:
        InputError: as `plan`.
        InfeasibleError: as `plan`.
    """
    paths, notes = legs(boom, spec.targets, spec.pitch, spec.constraint, spec.along, spec.stop_at_via, reference)
    if not paths:
        q = resolve(boom, spec.start, spec.pitch, spec.constraint)
        note = "start and goal are the same joint position: an empty move of duration 0 s"
        return PlannedMotion((), q, spec.step, (note,))
    motions = timed(boom, paths, spec.timing, spec.vehicle.tilt)
    total = sum(motion.duration for motion in motions)
    if spec.rate is not None and spec.duration is not None and total > spec.duration * (1.0 + _ROUNDING):
        notes = (*notes, f"duration increased from {spec.duration:g} s to {total:g} s to fit the controller's rate")
    if spec.profile.needs_duration and spec.duration is not None and total < spec.duration * (1.0 - _EARLY):
        early = f"the copper loss is least in {total:.4g} s; the rest of the {spec.duration:g} s would cost more in motion"
        notes = (*notes, f"{early}: the motors hold the load all the time, and a brake can hold it at the goal")
    return PlannedMotion(motions, motions[0].path(0.0), spec.step, notes, spec.profile.limits_average_torque)


def plan_each_profile(boom: Boom, start: Target, goal: Target, track: Track = iter) -> list[Trajectory]:
    """Plan the move with every profile in its shortest time, and return the samples.

    Args:
        boom: the boom.
        start: where the move starts; see `MoveSpec.of`.
        goal: where the move ends; see `MoveSpec.of`.
        track: iterates over the profiles, and may show progress.

    Raises:
        InputError: as `plan`.
        InfeasibleError: as `plan`.
    """
    specs = [MoveSpec.of(start, goal, profile=profile) for profile in SHORTEST]
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
    """Check any motion against the limits of joints and drives, with the joints' known friction.

    A trajectory of a plan is checked on the plan's fine grid, so its report is the plan's. Any
    other trajectory is checked at its samples.

    Args:
        boom: the boom.
        trajectory: the motion.
        payload_as: see `inverse_dynamics`.
        vehicle: motion of the vehicle under the boom.
        profile: name of the motion in the report.
        duty: duty cycle that the samples represent; None is the motion repeated without a pause.

    Raises:
        InputError: as `evaluate`.
    """
    return check_motion(boom, trajectory, payload_as=payload_as, vehicle=vehicle, profile=profile, duty=duty).report


def check_motion(
    boom: Boom,
    trajectory: Trajectory,
    *,
    payload_as: PayloadAs = "mass",
    vehicle: str | VehicleCase = LEVEL,
    profile: str = "recorded",
    duty: Duty | None = None,
) -> Move:
    """Check any motion, and return it with loads and report, as `write_recording` takes it.

    Args:
        boom: the boom.
        trajectory: the motion.
        payload_as: see `inverse_dynamics`.
        vehicle: motion of the vehicle under the boom.
        profile: name of the motion in the report.
        duty: as in `check`.

    Raises:
        InputError: as `evaluate`.
    """
    case = load_case(vehicle) if isinstance(vehicle, str) else vehicle
    return _move(evaluate(boom, trajectory, vehicle=case, payload_as=payload_as), trajectory, str(profile), duty)


def torques(boom: Boom, trajectory: Trajectory, payload_as: PayloadAs = "mass", vehicle: VehicleCase = LEVEL) -> Array:
    """Compute joint torques (n, 5) at a trajectory's samples, with the joints' known friction.

    Args:
        boom: the boom.
        trajectory: the samples.
        payload_as: see `inverse_dynamics`.
        vehicle: motion of the vehicle under the boom.

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
        energy=energy_of(evaluation) if duty is None else None,
        measured=measured_lines(evaluation.boom),
    )
    return Move(profile, trajectory, evaluation, report)


def _peaks(evaluation: Evaluation) -> tuple[TorquePeak, ...]:
    """Return the largest torque of each joint and its parts."""
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
    planned = "" if vehicle.is_steady else "; planning accounts for the slope only, the checks for all of it"
    return (vehicle.sentence + planned,)
