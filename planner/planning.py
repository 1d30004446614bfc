"""The main job: from two targets to a motion that has been checked."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from boom_model import (
    ActuatorHorizontal,
    BaseMotion,
    Boom,
    Breakdown,
    InputError,
    Loads,
    breakdown,
    inverse_dynamics,
    up_on_slope,
)
from boom_model.arrays import Array, checked
from boom_model.dynamics.newton_euler import PayloadAs
from boom_model.kinematics.constraints import Hold
from planner.checks.certificate import certify
from planner.checks.drives.duty import Duty
from planner.checks.drives.joint_view import Shock
from planner.checks.motion_checks import check_rows
from planner.checks.stopping import worst_stop
from planner.motion.trajectory import STEP, Trajectory, at_rest, check_size, joined, sample
from planner.motion.vehicle import VehicleCase, base_motion
from planner.paths.legs import Along, legs
from planner.paths.targets import Target, resolve
from planner.progress import Track
from planner.reports.report import Report, assumptions, torque_peaks
from planner.timing.time_law import Motion
from planner.timing.timing import Profile, Timing, timed

CHECKS_PER_STEP = 10
"""A planned move is checked on a grid this many times finer than it is sampled."""

_ROUNDING = 1e-9

SHOCK_SAMPLES = 20
"""Samples that a shock must have for its peak to be seen, to 0.3 %."""


@dataclass(frozen=True, eq=False)
class Move:
    """A move, its loads, and what the checks say of it."""

    boom: Boom
    profile: str
    """A `Profile`, or what a motion from elsewhere is called."""
    trajectory: Trajectory
    loads: Loads
    parts: Breakdown
    """The torques' breakdown, friction included."""
    report: Report
    motions: tuple[Motion, ...]
    """The continuous motions behind a plan's samples, from stop to stop; none of an empty move or a motion from elsewhere."""
    vehicle: VehicleCase | None = None


def plan(
    boom: Boom,
    start: Target,
    goal: Target,
    *,
    profile: str = Profile.CUBIC,
    duration: float | None = None,
    pitch: float | None = -np.pi / 2.0,
    hold: Hold | None = None,
    via: Sequence[Target] = (),
    stop_at_via: bool = True,
    via_velocities: ArrayLike | None = None,
    along: Along = "joint",
    jerk_bound: bool = False,
    average_torque: bool = False,
    vehicle: VehicleCase | None = None,
    step: float = STEP,
    rate: float | None = None,
) -> Move:
    """A move from start to goal, rest to rest, checked on a grid finer than its samples.

    Args:
        start, goal: a pose's name, a joint position (5,) [rad, the extension in m], or a TipTarget.
        profile: "cubic", "quintic", "trapezoidal", "jerk-limited" or "time-optimal".
        duration: [s]; None is the least that the limits allow. A longer one slows the least-time motion evenly.
        pitch, hold: for tip targets. No pitch lets the hold choose it, no hold holds the actuator horizontal.
        via: targets on the way.
        stop_at_via: whether the move stops at them; else it goes through them on a smooth path.
        via_velocities: (k, 5) [rad/s, the extension's m/s] at the k targets on the way, of the cubic that goes through them
            without a stop; None makes its acceleration continuous instead.
        along: "joint" goes straight in joint space; "line" leads the tip straight from tip target to tip target at constant
            pitch; a point (3,) [m] leads it along the arc of a circle through that point.
        jerk_bound: holds the time-optimal profile to the jerk limits, with no acceleration at the ends.
        average_torque: holds the time-optimal profile to the gearboxes' average torque.
        vehicle: what the vehicle does during the move. The plan knows its slope; track and shock are in the checks alone.
        step: longest sampling step [s].
        rate: a controller's [Hz]: the samples are on its clock, and the move lasts a whole number of its periods, from stop
            to stop. Takes the place of `step`.

    Raises:
        InputError: an input is malformed or not finite.
        InfeasibleError: a target is out of reach or outside the limits, the duration is too short, something to be kept
            away from is in the way, or no motion keeps the drives' limits.

    >>> move = plan(Boom.load(), "transport", "phenotyping", profile="time-optimal")
    >>> round(move.report.duration, 3), str(move.report.verdict)
    (4.333, 'INCOMPLETE')
    """
    if via_velocities is not None:
        stop_at_via = False
        via_velocities = checked("via_velocities", via_velocities, 5)
    timing = Timing.of(profile, duration, jerk_bound, average_torque, via_velocities, rate)
    step = step if rate is None else 1.0 / rate
    if duration is not None:
        check_size(duration, step)
    hold = ActuatorHorizontal() if hold is None else hold
    paths, notes = legs(boom, (start, *via, goal), pitch, hold, along, stop_at_via)
    if not paths:
        q = resolve(boom, start, pitch, hold)
        note = "start and goal are the same joint position: an empty move, of no duration"
        return _move(boom, timing.profile, vehicle, at_rest(q, (note,)), None, ())
    tilt = None if vehicle is None else BaseMotion.of(up=up_on_slope(vehicle.roll, vehicle.pitch))
    motions = timed(boom, paths, timing, tilt)
    lasts = sum(motion.duration for motion in motions)
    if rate is not None and duration is not None and lasts > duration * (1.0 + _ROUNDING):
        notes = (*notes, f"lengthened from {duration:g} s to {lasts:g} s by the controller's clock")
    finer = step / CHECKS_PER_STEP
    if vehicle is not None and vehicle.peak != 0.0:
        finer = min(finer, vehicle.shock_duration / (2 * SHOCK_SAMPLES))
    coarse, fine = (joined([sample(motion, each) for motion in motions], notes) for each in (step, finer))
    return _move(boom, timing.profile, vehicle, coarse, fine, motions, tilt, average_torque)


def plan_each_profile(boom: Boom, start: Target, goal: Target, track: Track = iter) -> list[Trajectory]:
    """The move in the least time of each profile, as samples.

    Args:
        track: iterates over the profiles, and may show how far it is.

    Raises:
        InputError, InfeasibleError: as `plan`.
    """
    return [plan(boom, start, goal, profile=profile).trajectory for profile in track(list(Profile))]


def check(
    boom: Boom,
    trajectory: Trajectory,
    *,
    payload_as: PayloadAs = "mass",
    vehicle: VehicleCase | None = None,
    profile: str = "recorded",
    duty: Duty | None = None,
) -> Report:
    """The limit and drive checks of any motion, at its samples, with the joints' friction where it is known.

    Args:
        payload_as: see `inverse_dynamics`.
        vehicle: what the vehicle does meanwhile; None rests on level ground.
        profile: what the report calls the motion.
        duty: the cycle that the samples stand for; None is the motion alone.
    """
    return examine(boom, trajectory, payload_as=payload_as, vehicle=vehicle, profile=profile, duty=duty).report


def examine(
    boom: Boom,
    trajectory: Trajectory,
    *,
    payload_as: PayloadAs = "mass",
    vehicle: VehicleCase | None = None,
    profile: str = "recorded",
    duty: Duty | None = None,
) -> Move:
    """Any motion with its loads and its checks, as `write_recording` takes it; for the arguments see `check`."""
    loads, parts, base = _loads(boom, trajectory, vehicle, payload_as)
    shock = None if vehicle is None or vehicle.peak == 0.0 else _shock(boom, trajectory, vehicle, payload_as)
    report = Report(
        profile=str(profile),
        duration=trajectory.duration if duty is None else duty.duration,
        rows=check_rows(
            boom,
            trajectory,
            loads,
            base=base,
            payload_as=payload_as,
            shock=shock,
            bases=() if vehicle is None else (vehicle.origin.basis,),
            duty=duty,
        ),
        notes=(*trajectory.notes, *_vehicle_notes(vehicle)),
        assumptions=assumptions(boom, trajectory.qddd is not None),
        peaks=torque_peaks(trajectory.t, parts),
    )
    return Move(boom, str(profile), trajectory, loads, parts, report, (), vehicle)


def torques(boom: Boom, trajectory: Trajectory, payload_as: PayloadAs = "mass", vehicle: VehicleCase | None = None) -> Array:
    """Joint torques (n, 5) of a motion, on level ground without a vehicle, with the joints' friction where it is known.

    Raises:
        InputError: as `inverse_dynamics`, or a torque is not finite.
    """
    base = None if vehicle is None else base_motion(vehicle, trajectory.t)
    return _finite_loads(boom, trajectory, base, payload_as, reactions=False).tau


def _loads(
    boom: Boom, trajectory: Trajectory, vehicle: VehicleCase | None, payload_as: PayloadAs = "mass"
) -> tuple[Loads, Breakdown, BaseMotion | None]:
    """Loads with friction, their breakdown, and the base's motion.

    Raises:
        InputError: as `_finite_loads`.
    """
    base = None if vehicle is None else base_motion(vehicle, trajectory.t)
    states = (trajectory.q, trajectory.qd, trajectory.qdd)
    loads = _finite_loads(boom, trajectory, base, payload_as)
    with np.errstate(over="ignore", invalid="ignore"):
        parts = breakdown(boom, *states, base=base, payload_as=payload_as, friction=True)
    return loads, parts, base


def _finite_loads(
    boom: Boom, trajectory: Trajectory, base: BaseMotion | None, payload_as: PayloadAs, reactions: bool = True
) -> Loads:
    """Loads with friction.

    Raises:
        InputError: a load is not finite, because a state of the motion is absurdly large; names the sample.
    """
    states = (trajectory.q, trajectory.qd, trajectory.qdd)
    with np.errstate(over="ignore", invalid="ignore"):
        loads = inverse_dynamics(boom, *states, base=base, payload_as=payload_as, friction=True, reactions=reactions)
    finite = np.isfinite(loads.tau).all(axis=-1)
    if not finite.all():
        at = int(np.argmin(finite))
        raise InputError(f"sample {at}, t = {trajectory.t[at]:g} s: its torques are not finite; its state is too large")
    return loads


def _shock(boom: Boom, trajectory: Trajectory, vehicle: VehicleCase, payload_as: PayloadAs) -> Shock:
    """What the joints bear without the shock, and whether the samples see it."""
    calm, _, _ = _loads(boom, trajectory, replace(vehicle, peak=0.0), payload_as)
    start, end = vehicle.shock_start, vehicle.shock_start + vehicle.shock_duration
    whole = trajectory.t[0] <= start and end <= trajectory.t[-1]
    inside = (trajectory.t >= start) & (trajectory.t <= end)
    resolved = bool(whole and inside.sum() >= SHOCK_SAMPLES)
    return Shock(calm.tau, resolved, inside, vehicle.shock_duration, vehicle.shock_events)


def _move(
    boom: Boom,
    profile: Profile,
    vehicle: VehicleCase | None,
    trajectory: Trajectory,
    fine: Trajectory | None,
    motions: tuple[Motion, ...],
    base: BaseMotion | None = None,
    average_torque: bool = False,
) -> Move:
    loads, parts, _ = _loads(boom, trajectory, vehicle)
    report = check(boom, trajectory if fine is None else fine, profile=profile, vehicle=vehicle)
    if motions:
        certificate = certify(boom, motions, base, average_torque)
        report = replace(report, certificate=certificate, stop=worst_stop(boom, motions, base))
    return Move(boom, profile, trajectory, loads, parts, report, motions, vehicle)


def _vehicle_notes(vehicle: VehicleCase | None) -> tuple[str, ...]:
    if vehicle is None:
        return ()
    planned = "" if vehicle.is_steady else "; a plan knows its slope alone, the checks all of it"
    return (vehicle.sentence + planned,)
