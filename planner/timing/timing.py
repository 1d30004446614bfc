"""Timing of paths by a profile, with a given duration and the clock of a controller."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from boom_model import JOINTS, BaseMotion, Boom, InfeasibleError, InputError
from boom_model.arrays import Array, scalar
from planner.paths.clearance import require_path_clear
from planner.paths.path import JointLine, Path, SplinePath
from planner.timing.path_limits import least_stretch, looks, shares
from planner.timing.profile import Cubic, LeastEnergy, Profile, TimeOptimal, TimingProfile, parse_profile
from planner.timing.time_law import Motion
from planner.timing.worst_ratios import WorstRatio, joint_stretch, worst_ratios

__all__ = ["Profile", "Timing", "timed"]

_ROUNDING = 1e-9
_MISSED = 1e-5  # relative; a smaller excess over a limit is not corrected
_TRIES = 5  # slowing may not converge: on a very short tip line, rounding changes the derivatives each time


@dataclass(frozen=True, eq=False)
class Timing:
    """Requested timing of a motion."""

    profile: TimingProfile
    duration: float | None = None
    """[s]; None is the shortest that the limits allow."""
    rate: float | None = None
    """Rate of a controller [Hz]; the motion and its parts last whole periods of it."""

    @staticmethod
    def of(
        profile: str | TimingProfile,
        duration: float | None = None,
        jerk_bound: bool = False,
        average_torque: bool = False,
        velocities: Array | None = None,
        rate: float | None = None,
    ) -> "Timing":
        """Return a checked timing.

        Args:
            profile: a profile, or its word with the options of `parse_profile`.
            duration: [s]; None is the shortest that the limits allow.
            jerk_bound: see `parse_profile`.
            average_torque: see `parse_profile`.
            velocities: see `parse_profile`.
            rate: rate of a controller [Hz].

        Raises:
            InputError: the profile is unknown, a number is not positive, or an option belongs to
                another profile.
        """
        if not isinstance(profile, TimingProfile):
            profile = parse_profile(profile, jerk_bound=jerk_bound, average_torque=average_torque, velocities=velocities)
        for name, value, unit in (("duration", duration, "s"), ("rate", rate, "Hz")):
            if value is not None and not scalar(name, value) > 0.0:
                raise InputError(f"{name} is {value:g} {unit}; it must be above 0 {unit}")
        if duration is None and profile.needs_duration:
            raise InputError(f"the {profile} profile needs a duration")
        return Timing(profile, duration, rate)


def timed(boom: Boom, paths: Sequence[Path], timing: Timing, base: BaseMotion | None) -> tuple[Motion, ...]:
    """Return a motion from rest to rest along each path; their total duration is the requested one.

    Raises:
        InputError: one period of the rate is longer than the move, or velocities at waypoints do
            not match the path.
        InfeasibleError: the duration is too short, no motion respects the drive limits, or a motion
            comes too near to a shape.
    """
    if isinstance(timing.profile, Cubic) and timing.profile.velocities is not None:
        return (_with_velocities(boom, paths, timing, timing.profile.velocities, base),)
    if isinstance(timing.profile, LeastEnergy):
        return _least_energy(boom, paths, timing, base)
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


def _least_energy(boom: Boom, paths: Sequence[Path], timing: Timing, base: BaseMotion | None) -> tuple[Motion, ...]:
    """Return the motions of least copper loss.

    Each lasts its share of the duration, as their least times share it.
    """
    if timing.duration is None:
        raise InputError(f"the {timing.profile} profile needs a duration")
    shortest = replace(timing, profile=TimeOptimal())
    fastest = [_least(boom, path, shortest, base) for path in paths]
    least, asked = sum(motion.duration for motion in fastest), timing.duration
    if asked < least * (1.0 - _ROUNDING):
        raise InfeasibleError(_too_short(boom, fastest, timing, asked, least, base))
    motions = []
    for path, fast in zip(paths, fastest, strict=True):
        within = replace(timing, profile=LeastEnergy(fast.duration * max(1.0, asked / least)))
        motion = _least(boom, path, within, base)
        length = motion.duration
        if timing.rate is not None:
            length = float(np.ceil(length * timing.rate * (1.0 - _ROUNDING)) / timing.rate)
        motions.append(_slowed(motion, length / motion.duration))
    return tuple(motions)


def _slowed(motion: Motion, factor: float) -> Motion:
    return replace(motion, law=motion.law.stretched(factor))


def _least(boom: Boom, path: Path, timing: Timing, base: BaseMotion | None) -> Motion:
    """Return the shortest motion of the profile.

    It is slowed if a finer grid than the profile's shows that it exceeds a limit.
    """
    motion = timing.profile.motion(boom, path, base)
    if isinstance(path, JointLine) and timing.profile.exact_on_lines:
        return motion
    motion = _slowed(motion, max(1.0, least_stretch(boom, motion.path, motion.law, base, looks(motion.path))))
    for _ in range(_TRIES):
        missed = joint_stretch(boom, motion)
        if missed <= 1.0 + _MISSED:
            break
        motion = _slowed(motion, missed)
    return motion


def _with_velocities(boom: Boom, paths: Sequence[Path], timing: Timing, velocities: Array, base: BaseMotion | None) -> Motion:
    from planner.timing.profiles.cubic_through import cubic_with_velocities

    path = paths[0] if len(paths) == 1 else None
    count = len(path.waypoints) - 2 if isinstance(path, SplinePath) else 0
    if not isinstance(path, SplinePath) or velocities.shape != (count, 5):
        raise InputError(
            f"velocities have shape {velocities.shape}; with {count} waypoints, not counting those where the move already "
            f"is, it must be ({count}, 5)"
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
    """Return the message for a duration that is too short, with the limit exceeded most."""
    hasty = [_slowed(motion, asked / least) for motion in motions]
    worst = max(worst_ratios(boom, hasty, base, timing.profile.limits_average_torque), key=lambda each: each.ratio)
    when = "" if worst.at_s is None else f" at {worst.at_s:.2f} s"
    parts = f" ({_parts(boom, hasty, worst, base)})" if worst.limit in _INSTANT else ""
    return (
        f"duration {asked:g} s is too short: the {timing.profile} profile needs at least {least:.6g} s within the limits; in "
        f"{asked:g} s {_exceeded(worst)}{when}{parts}"
    )


def _exceeded(worst: WorstRatio) -> str:
    if np.isfinite(worst.ratio):
        return f"{worst.joint} would reach {worst.ratio:.3g} times its {worst.limit} limit"
    return f"{worst.joint} would be too fast for its motor to give any torque"


_INSTANT = ("gearbox torque", "motor torque", "motor torque at standstill")


def _parts(boom: Boom, motions: Sequence[Motion], worst: WorstRatio, base: BaseMotion | None) -> str:
    """Return the components of the worst torque as text."""
    at = worst.at_s or 0.0
    for motion in motions:
        if at <= motion.duration:
            break
        at -= motion.duration
    q, qd, qdd, _ = motion(at)
    return shares(boom, q, qd, qdd, JOINTS.index(worst.joint), base)
