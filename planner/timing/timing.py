"""From paths to motions: each profile's own law, the duration that is asked for, a controller's clock."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from boom_model import JOINTS, BaseMotion, Boom, InfeasibleError, InputError
from boom_model.arrays import Array, scalar
from planner.paths.clearance import require_path_clear
from planner.paths.path import Path, SplinePath
from planner.timing.path_limits import least_stretch, looks, shares
from planner.timing.time_law import Motion, TimeLaw
from planner.timing.worst_ratios import WorstRatio, joint_stretch, worst_ratios

_ROUNDING = 1e-9
_MISSED = 1e-5  # relative; what is missed by less is left as it is
_TRIES = 5  # the derivatives of a very short line of the tip are rounding in part, and come out otherwise each time


class Profile(StrEnum):
    """How a path is timed."""

    CUBIC = "cubic"
    QUINTIC = "quintic"
    TRAPEZOIDAL = "trapezoidal"
    JERK_LIMITED = "jerk-limited"
    TIME_OPTIMAL = "time-optimal"


@dataclass(frozen=True, eq=False)
class Timing:
    """What is asked of a motion's timing."""

    profile: Profile = Profile.CUBIC
    duration: float | None = None
    """[s]; None is the least."""
    jerk_bound: bool = False
    """Hold the time-optimal law to the jerk limits as well."""
    average_torque: bool = False
    """Hold the time-optimal law to the gearboxes' average torque as well."""
    velocities: Array | None = None
    """(k, 5) of the cubic at its waypoints; None makes its acceleration continuous."""
    rate: float | None = None
    """[Hz] of a controller, on whose clock the motion and its parts end."""

    @staticmethod
    def of(
        profile: str,
        duration: float | None = None,
        jerk_bound: bool = False,
        average_torque: bool = False,
        velocities: Array | None = None,
        rate: float | None = None,
    ) -> "Timing":
        """Timing, checked.

        Raises:
            InputError: no such profile, not a positive number, or an option of another profile.
        """
        try:
            known = Profile(profile)
        except ValueError:
            raise InputError(f"profile is {profile!r}; there are: {', '.join(Profile)}") from None
        for name, value, unit in (("duration", duration, "s"), ("rate", rate, "Hz")):
            if value is not None and not scalar(name, value) > 0.0:
                raise InputError(f"{name} is {value:g} {unit}; it must be above 0 {unit}")
        for name, given in (("jerk_bound", jerk_bound), ("average_torque", average_torque)):
            if given and known is not Profile.TIME_OPTIMAL:
                raise InputError(f"{name} is for the time-optimal profile, not for {known}")
        if velocities is not None and known is not Profile.CUBIC:
            raise InputError(f"velocities at waypoints are for the cubic profile, not for {known}")
        return Timing(known, duration, jerk_bound, average_torque, velocities, rate)


def timed(boom: Boom, paths: Sequence[Path], timing: Timing, base: BaseMotion | None) -> tuple[Motion, ...]:
    """A motion along each path, from rest to rest, of the duration that is asked for in all.

    Raises:
        InfeasibleError: the duration is too short, no motion keeps the drives' limits, or it comes too near to a shape.
    """
    if timing.velocities is not None:
        return (_with_velocities(boom, paths, timing, base),)
    motions = [_least(boom, path, timing, base) for path in paths]
    least = sum(motion.duration for motion in motions)
    asked = least if timing.duration is None else timing.duration
    if asked < least * (1.0 - _ROUNDING):
        raise InfeasibleError(_too_short(boom, motions, timing, asked, least, base))
    lengths = [motion.duration * max(1.0, asked / least) for motion in motions]
    if timing.rate is not None:
        if timing.rate * least < 1.0:
            raise InputError(f"rate is {timing.rate:g} Hz: one period is longer than the move, which takes {least:.4g} s")
        lengths = [np.ceil(length * timing.rate * (1.0 - _ROUNDING)) / timing.rate for length in lengths]
    return tuple(_slowed(motion, length / motion.duration) for motion, length in zip(motions, lengths, strict=True))


def _slowed(motion: Motion, factor: float) -> Motion:
    return replace(motion, law=motion.law.stretched(factor))


def _least(boom: Boom, path: Path, timing: Timing, base: BaseMotion | None) -> Motion:
    """The profile's least-time motion, slowed by what its own look at the path missed."""
    if timing.profile is Profile.CUBIC and isinstance(path, SplinePath):
        from planner.timing.profiles.cubic_through import cubic_through

        motion = cubic_through(boom, path.waypoints, base)
        require_path_clear(boom, motion.path)  # another path than the one that was looked at
    else:
        motion = Motion(path, _law(boom, path, timing, base))
    motion = _slowed(motion, max(1.0, least_stretch(boom, motion.path, motion.law, base, looks(motion.path))))
    for _ in range(_TRIES):
        missed = joint_stretch(boom, motion)
        if missed <= 1.0 + _MISSED:
            break
        motion = _slowed(motion, missed)
    return motion


def _law(boom: Boom, path: Path, timing: Timing, base: BaseMotion | None) -> TimeLaw:
    """Each profile's third-party library is imported where it is used: they are slow to import."""
    match timing.profile:
        case Profile.CUBIC:
            from planner.timing.profiles.cubic import cubic

            return cubic(boom, path, base)
        case Profile.QUINTIC:
            from planner.timing.profiles.quintic import quintic

            return quintic(boom, path, base)
        case Profile.TRAPEZOIDAL:
            from planner.timing.profiles.trapezoidal import trapezoidal

            return trapezoidal(boom, path, base)
        case Profile.JERK_LIMITED:
            from planner.timing.profiles.jerk_limited import jerk_limited

            return jerk_limited(boom, path, base)
        case Profile.TIME_OPTIMAL:
            from planner.timing.profiles.average_torque import within_average_torque
            from planner.timing.profiles.jerk_bound import jerk_bounded, with_jerk_bound
            from planner.timing.profiles.jerk_limited import evenly_limited
            from planner.timing.profiles.time_optimal import time_optimal

            if timing.average_torque:
                law = within_average_torque(boom, path, base)
                return with_jerk_bound(boom, path, law, base) if timing.jerk_bound else law
            if not timing.jerk_bound:
                return time_optimal(boom, path, base)
            laws = jerk_bounded(boom, path, base), evenly_limited(boom, path, base)[0]
            return min(laws, key=lambda each: each.duration)


def _with_velocities(boom: Boom, paths: Sequence[Path], timing: Timing, base: BaseMotion | None) -> Motion:
    from planner.timing.profiles.cubic_through import cubic_with_velocities

    velocities = timing.velocities
    path = paths[0] if len(paths) == 1 else None
    count = len(path.waypoints) - 2 if isinstance(path, SplinePath) else 0
    if velocities is None or not isinstance(path, SplinePath) or velocities.shape != (count, 5):
        given = None if velocities is None else velocities.shape
        raise InputError(
            f"velocities have shape {given}; with {count} waypoints, without those where the move already is, it must be "
            f"({count}, 5)"
        )
    motion = cubic_with_velocities(boom, path.waypoints, velocities, timing.duration, base)
    if timing.rate is not None:
        whole = float(np.ceil(motion.duration * timing.rate * (1.0 - _ROUNDING)) / timing.rate)
        motion = cubic_with_velocities(boom, path.waypoints, velocities, whole, base)
    require_path_clear(boom, motion.path)
    return motion


def _too_short(
    boom: Boom, motions: Sequence[Motion], timing: Timing, asked: float, least: float, base: BaseMotion | None
) -> str:
    """How far a duration is from the least, and which limit it would break most."""
    hasty = [_slowed(motion, asked / least) for motion in motions]
    worst = max(worst_ratios(boom, hasty, base, timing.average_torque)[0], key=lambda each: each.ratio)
    when = "" if worst.at_s is None else f" at {worst.at_s:.2f} s"
    parts = f" ({_parts(boom, hasty, worst, base)})" if worst.limit in _INSTANT else ""
    return (
        f"duration {asked:g} s is too short: the {timing.profile} profile needs at least {least:.6g} s within the limits; in "
        f"{asked:g} s {worst.joint} would reach {worst.ratio:.3g} times its {worst.limit} limit{when}{parts}"
    )


_INSTANT = ("gearbox torque", "motor torque", "motor torque at standstill")


def _parts(boom: Boom, motions: Sequence[Motion], worst: WorstRatio, base: BaseMotion | None) -> str:
    """What the worst torque consists of."""
    at = worst.at_s or 0.0
    for motion in motions:
        if at <= motion.duration:
            break
        at -= motion.duration
    q, qd, qdd, _ = motion(at)
    return shares(boom, q, qd, qdd, JOINTS.index(worst.joint), base)
