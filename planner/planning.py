"""The main job: from two targets to a motion that has been checked."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from boom_model import (
    ActuatorHorizontal,
    BaseMotion,
    Boom,
    Breakdown,
    InfeasibleError,
    InputError,
    Loads,
    breakdown,
    inverse_dynamics,
    up_on_slope,
)
from boom_model.arrays import Array, checked
from boom_model.dynamics import PayloadAs
from boom_model.holds import Hold
from planner.checks import Shock, check_rows
from planner.constraints import least_stretch
from planner.path import JointLine, Path, TipArc, TipLine, TipPath, follow
from planner.report import Report, assumptions, torque_peaks
from planner.targets import Target, TipTarget, resolve
from planner.time_law import Motion, TimeLaw
from planner.trajectory import STEP, Trajectory, at_rest, check_size, joined, sample
from planner.vehicle import VehicleCase, base_motion

CHECKS_PER_STEP = 10
"""A planned move is checked on a grid this many times finer than it is sampled."""

SHOCK_SAMPLES = 20
"""Samples that a shock must have for its peak to be seen, to 0.3 %."""

_ROUNDING = 1e-9
_CURVED_SAMPLES = 40_001


Along = Literal["joint", "line"] | ArrayLike
"""What leads a move: the joints, or the tip on a line or on an arc through a point."""


class Profile(StrEnum):
    """How a path is timed."""

    CUBIC = "cubic"
    TIME_OPTIMAL = "time-optimal"
    JERK_LIMITED = "jerk-limited"


@dataclass(frozen=True, eq=False)
class Move:
    """A planned move, its loads, and what the checks say of it."""

    boom: Boom
    profile: Profile
    trajectory: Trajectory
    loads: Loads
    parts: Breakdown
    """The torques' breakdown, friction included."""
    report: Report
    motions: tuple[Motion, ...]
    """The continuous motions behind the samples, from stop to stop; none of an empty move."""
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
    along: Along = "joint",
    vehicle: VehicleCase | None = None,
    step: float = STEP,
) -> Move:
    """A move from start to goal, rest to rest, checked on a grid finer than its samples.

    Args:
        start, goal: a pose's name, a joint position (5,) [rad, the extension in m], or a TipTarget.
        profile: "cubic", "time-optimal" or "jerk-limited".
        duration: [s]; None is the least that the limits allow. A longer one slows the least-time motion evenly.
        pitch, hold: for tip targets. No pitch lets the hold choose it, no hold holds the actuator horizontal.
        via: targets on the way, with a stop at each.
        along: "joint" goes straight in joint space; "line" leads the tip straight from tip target to tip target at constant
            pitch; a point (3,) [m] leads it along the arc of a circle through that point.
        vehicle: what the vehicle does during the move. The plan knows its slope; track and shock are in the checks alone.
        step: sampling step [s].

    Raises:
        InputError: an input is malformed or not finite.
        InfeasibleError: a target is out of reach or outside the limits, the duration is too short, or no motion keeps the
            drives' limits.
    """
    try:
        profile = Profile(profile)
    except ValueError:
        raise InputError(f"profile is {profile!r}; there are: {', '.join(Profile)}") from None
    if duration is not None and not float(checked("duration", duration)) > 0.0:
        raise InputError(f"duration is {duration:g} s; it must be above 0 s")
    if duration is not None:
        check_size(duration, step)
    hold = ActuatorHorizontal() if hold is None else hold
    paths = _paths(boom, (start, *via, goal), pitch, hold, along)
    if not paths:
        q = resolve(boom, start, pitch, hold)
        note = "start and goal are the same joint position: an empty move, of no duration"
        return _move(boom, profile, vehicle, at_rest(q, (note,)), None, ())
    tilt = None if vehicle is None else BaseMotion.of(up=up_on_slope(vehicle.roll, vehicle.pitch))
    laws = [_least_time_law(boom, path, profile, tilt) for path in paths]
    factor = _stretch(sum(law.duration for law in laws), profile, duration)
    motions = tuple(Motion(path, law.stretched(factor)) for path, law in zip(paths, laws, strict=True))
    notes = tuple(path.sentence for path in paths if isinstance(path, TipPath))
    finer = step / CHECKS_PER_STEP
    if vehicle is not None and vehicle.peak != 0.0:
        finer = min(finer, vehicle.shock_duration / (2 * SHOCK_SAMPLES))
    coarse, fine = (joined([sample(motion, each) for motion in motions], notes) for each in (step, finer))
    return _move(boom, profile, vehicle, coarse, fine, motions)


def _paths(boom: Boom, targets: Sequence[Target], pitch: float | None, hold: Hold, along: Along) -> list[Path]:
    """A path between each target and the next, on branches that go on from each other; none between equal positions."""
    if isinstance(along, str) and along == "joint":
        stops: list[Array] = []
        for target in targets:
            stops.append(resolve(boom, target, pitch, hold, reference=stops[-1] if stops else None))
        return [JointLine(a, b) for a, b in pairwise(stops) if not np.array_equal(a, b)]
    if isinstance(along, str) and along != "line":
        raise InputError(f"along is {along!r}; it must be 'joint', 'line' or a point of an arc")
    if not isinstance(along, str) and len(targets) != 2:
        raise InputError("an arc goes from one tip target to another, with no stop on the way")
    if pitch is None:
        raise InputError("a line or an arc of the tip goes at constant pitch, which must be given")
    places = [_place(target) for target in targets]
    paths: list[Path] = []
    last: Array | None = None
    for a, b in pairwise(places):
        if np.array_equal(a, b):
            continue
        curve = TipLine(a, b) if isinstance(along, str) else TipArc.through(a, along, b)
        path = follow(boom, curve, pitch, hold, reference=last)
        paths.append(path)
        last = path(1.0)
    return paths


def _place(target: Target) -> Array:
    if not isinstance(target, TipTarget):
        raise InputError(f"{target!r} is no tip target; a line or an arc of the tip goes between tip targets")
    return checked("tip target", target.position)


def plan_each_profile(boom: Boom, start: Target, goal: Target) -> list[Trajectory]:
    """The move in the least time of each profile, as samples.

    Raises:
        InputError, InfeasibleError: as `plan`.
    """
    return [plan(boom, start, goal, profile=profile).trajectory for profile in Profile]


def check(
    boom: Boom,
    trajectory: Trajectory,
    *,
    payload_as: PayloadAs = "mass",
    vehicle: VehicleCase | None = None,
    profile: str = "recorded",
) -> Report:
    """The limit and drive checks of any motion, at its samples, with the joints' friction where it is known.

    Args:
        payload_as: see `inverse_dynamics`.
        vehicle: what the vehicle does meanwhile; None rests on level ground.
        profile: what the report calls the motion.
    """
    loads, parts, base = _loads(boom, trajectory, vehicle, payload_as)
    shock = None if vehicle is None or vehicle.peak == 0.0 else _shock(boom, trajectory, vehicle, payload_as)
    return Report(
        profile=str(profile),
        duration=trajectory.duration,
        rows=check_rows(
            boom,
            trajectory,
            loads,
            base=base,
            payload_as=payload_as,
            shock=shock,
            bases=() if vehicle is None else (vehicle.origin.basis,),
        ),
        notes=(*trajectory.notes, *_vehicle_notes(vehicle)),
        assumptions=assumptions(boom, trajectory.qddd is not None),
        peaks=torque_peaks(trajectory.t, parts),
    )


def torques(boom: Boom, trajectory: Trajectory, payload_as: PayloadAs = "mass") -> Array:
    """Joint torques (n, 5) of a motion on level ground, with the joints' friction where it is known.

    Raises:
        InputError: as `inverse_dynamics`, or a torque is not finite.
    """
    return _loads(boom, trajectory, None, payload_as)[0].tau


def _loads(
    boom: Boom, trajectory: Trajectory, vehicle: VehicleCase | None, payload_as: PayloadAs = "mass"
) -> tuple[Loads, Breakdown, BaseMotion | None]:
    """Loads with friction, their breakdown, and the base's motion.

    Raises:
        InputError: a load is not finite, because a state of the motion is absurdly large; names the sample.
    """
    base = None if vehicle is None else base_motion(vehicle, trajectory.t)
    states = (trajectory.q, trajectory.qd, trajectory.qdd)
    with np.errstate(over="ignore", invalid="ignore"):
        loads = inverse_dynamics(boom, *states, base=base, payload_as=payload_as, friction=True)
        finite = np.isfinite(loads.tau).all(axis=-1)
        if not finite.all():
            at = int(np.argmin(finite))
            raise InputError(f"sample {at}, t = {trajectory.t[at]:g} s: its torques are not finite; its state is too large")
        parts = breakdown(boom, *states, base=base, payload_as=payload_as, friction=True)
    return loads, parts, base


def _shock(boom: Boom, trajectory: Trajectory, vehicle: VehicleCase, payload_as: PayloadAs) -> Shock:
    """What the joints bear without the shock, and whether the samples see it."""
    calm, _, _ = _loads(boom, trajectory, replace(vehicle, peak=0.0), payload_as)
    start, end = vehicle.shock_start, vehicle.shock_start + vehicle.shock_duration
    inside = trajectory.t[0] <= start and end <= trajectory.t[-1]
    samples = int(((trajectory.t >= start) & (trajectory.t <= end)).sum())
    return Shock(calm.tau, inside and samples >= SHOCK_SAMPLES)


def _move(
    boom: Boom,
    profile: Profile,
    vehicle: VehicleCase | None,
    trajectory: Trajectory,
    fine: Trajectory | None,
    motions: tuple[Motion, ...],
) -> Move:
    loads, parts, _ = _loads(boom, trajectory, vehicle)
    report = check(boom, trajectory if fine is None else fine, profile=profile, vehicle=vehicle)
    return Move(boom, profile, trajectory, loads, parts, report, motions, vehicle)


def _vehicle_notes(vehicle: VehicleCase | None) -> tuple[str, ...]:
    if vehicle is None:
        return ()
    planned = "" if vehicle.is_steady else "; a plan knows its slope alone, the checks all of it"
    return (vehicle.sentence + planned,)


def _least_time_law(boom: Boom, path: Path, profile: Profile, base: BaseMotion | None) -> TimeLaw:
    """Each profile's third-party library is imported where it is used: they are slow to import."""
    if profile is Profile.TIME_OPTIMAL:
        from planner.profiles.time_optimal import time_optimal

        law = time_optimal(boom, path, base)
    elif profile is Profile.JERK_LIMITED:
        from planner.profiles.jerk_limited import jerk_limited

        law = jerk_limited(boom, path, base)
    else:
        from planner.profiles.cubic import cubic

        law = cubic(boom, path, base)
    if isinstance(path, TipPath):  # its curvature can peak between the points that a profile looks at
        law = law.stretched(max(1.0, least_stretch(boom, path, law, base, samples=_CURVED_SAMPLES)))
    return law


def _stretch(least: float, profile: Profile, duration: float | None) -> float:
    """The factor that slows the least duration to the one given."""
    if duration is None:
        return 1.0
    if duration < least * (1.0 - _ROUNDING):
        raise InfeasibleError(
            f"duration {duration:g} s is too short: the {profile} profile needs at least {least:.6g} s within the limits"
        )
    return duration / least
