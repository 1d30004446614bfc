"""The main job: from two targets to a motion that has been checked."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from boom_model import ActuatorHorizontal, Boom, InfeasibleError, InputError, Loads, inverse_dynamics
from boom_model.arrays import Array, checked
from boom_model.dynamics import PayloadAs
from boom_model.inverse_kinematics import Hold
from planner.checks import check_rows
from planner.path import JointLine
from planner.report import Report, assumptions
from planner.targets import Target, resolve
from planner.time_law import Motion, TimeLaw
from planner.trajectory import STEP, Trajectory, at_rest, sample

CHECKS_PER_STEP = 10
"""A planned move is checked on a grid this many times finer than it is sampled."""

_ROUNDING = 1e-9


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
    report: Report
    motion: Motion | None
    """The continuous motion behind the samples; None of an empty move."""


def plan(
    boom: Boom,
    start: Target,
    goal: Target,
    *,
    profile: str = Profile.CUBIC,
    duration: float | None = None,
    pitch: float = -np.pi / 2.0,
    hold: Hold | None = None,
    step: float = STEP,
) -> Move:
    """A move from start to goal, straight in joint space, rest to rest, checked on a grid finer than its samples.

    Args:
        start, goal: a pose's name, a joint position (5,) [rad, the extension in m], or a TipTarget.
        profile: "cubic", "time-optimal" or "jerk-limited".
        duration: [s]; None is the least that the limits allow. A longer one slows the least-time motion evenly.
        pitch, hold: for tip targets; None holds the actuator horizontal.
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
    hold = ActuatorHorizontal() if hold is None else hold
    q_start = resolve(boom, start, pitch, hold)
    q_goal = resolve(boom, goal, pitch, hold, reference=q_start)
    if np.array_equal(q_start, q_goal):
        return _empty(boom, profile, q_start)
    path = JointLine(q_start, q_goal)
    motion = Motion(path, _timed(_least_time_law(boom, path, profile), profile, duration))
    trajectory = sample(motion, step)
    loads = inverse_dynamics(boom, trajectory.q, trajectory.qd, trajectory.qdd)
    report = check(boom, sample(motion, step / CHECKS_PER_STEP), profile=profile)
    return Move(boom, profile, trajectory, loads, report, motion)


def check(boom: Boom, trajectory: Trajectory, *, payload_as: PayloadAs = "mass", profile: str = "recorded") -> Report:
    """The limit and drive checks of any motion, at its samples.

    Args:
        payload_as: see `inverse_dynamics`.
        profile: what the report calls the motion.
    """
    loads = inverse_dynamics(boom, trajectory.q, trajectory.qd, trajectory.qdd, payload_as=payload_as, reactions=False)
    return Report(
        profile=str(profile),
        duration=trajectory.duration,
        rows=check_rows(boom, trajectory, loads, payload_as),
        notes=trajectory.notes,
        assumptions=assumptions(boom, trajectory.qddd is not None),
    )


def _least_time_law(boom: Boom, path: JointLine, profile: Profile) -> TimeLaw:
    """Each profile's third-party library is imported where it is used: they are slow to import."""
    if profile is Profile.TIME_OPTIMAL:
        from planner.profiles.time_optimal import time_optimal

        return time_optimal(boom, path)
    if profile is Profile.JERK_LIMITED:
        from planner.profiles.jerk_limited import jerk_limited

        return jerk_limited(boom, path)
    from planner.profiles.cubic import cubic

    return cubic(boom, path)


def _timed(law: TimeLaw, profile: Profile, duration: float | None) -> TimeLaw:
    if duration is None:
        return law
    if duration < law.duration * (1.0 - _ROUNDING):
        raise InfeasibleError(
            f"duration {duration:g} s is too short: the {profile} profile needs at least {law.duration:.6g} s within the limits"
        )
    return law.stretched(duration / law.duration)


def _empty(boom: Boom, profile: Profile, q: Array) -> Move:
    still = at_rest(q)
    note = "start and goal are the same joint position: an empty move, of no duration"
    trajectory = Trajectory(still.t, still.q, still.qd, still.qdd, notes=(note,))
    loads = inverse_dynamics(boom, trajectory.q, trajectory.qd, trajectory.qdd)
    return Move(boom, profile, trajectory, loads, check(boom, trajectory, profile=profile), None)
