"""Shortest stops in the middle of a move."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from boom_model import BaseMotion, Boom, forward_kinematics, inverse_dynamics
from boom_model.arrays import Array, Mask, scalar
from boom_model.boom import LIMIT_TOLERANCE
from boom_model.errors import InputError
from planner.paths.path import JointLine, SplinePath
from planner.timing.limit_ratios import RATIO_TOLERANCE, rate_ratios
from planner.timing.path_limits import load_ratio
from planner.timing.profiles.ruckig_pieces import brake_to_rest
from planner.timing.time_law import Motion, TimeLaw

MOMENTS = 100
"""Number of equal parts of a motion; a stop is computed at each boundary between two of them."""

_STOP_SAMPLES = 33
_BISECTIONS = 7
_OFF_PATH_GAIN = 0.8  # leave the path only for a stop shorter by this factor
_MAX_SHARE = 8.0  # above 1 because the steepest part of a curved path may lie beyond the stop
_PATH_SAMPLES = 2001


class Way(StrEnum):
    """Kind of stop."""

    ON_PATH = "on the path"
    OFF_PATH = "off the path"
    """Each joint brakes independently, so the tip leaves its path."""
    FINISH = "finishes the move"
    """No shorter stop respects the limits."""


@dataclass(frozen=True, eq=False)
class Stop:
    """Motion from a state of a move to rest."""

    motion: Motion
    way: Way

    @property
    def duration(self) -> float:
        """Time to rest [s]."""
        return self.motion.duration


@dataclass(frozen=True)
class WorstStop:
    """Longest stop of a move, and the stop over which the tip travels farthest."""

    time_s: float
    time_at_s: float
    """Time in the move at which the longest stop begins."""
    time_way: Way
    distance_m: float
    """Distance that the tip travels in the farthest stop."""
    distance_at_s: float
    distance_way: Way


def stop(boom: Boom, motion: Motion, at: float, base: BaseMotion | None = None) -> Stop:
    """Return the shortest stop found that respects the limits of joints and drives.

    ruckig's velocity interface brings s(t) to rest with one limit on its deceleration, and on its
    jerk if the motion's jerk is limited. Bisection finds the largest such limit that respects the
    limits of joints and drives. On a curved path the curvature alone can use all of a joint's
    acceleration. If that makes the stop a quarter longer, or impossible, each joint brakes
    independently and the tip leaves the path. A stop that takes longer than finishing the move is
    discarded. A boom with keep-out shapes stops on its path.

    Args:
        boom: the boom.
        motion: the motion to stop.
        at: time in the motion at which the stop begins [s].
        base: tilt of the base; None is level.

    Raises:
        InputError: `at` is not within the motion.
    """
    at = scalar("moment", at)
    if not 0.0 <= at <= motion.duration:
        raise InputError(f"moment is {at:g} s; it must be from 0 to {motion.duration:g} s, the motion's duration")
    return _stops(boom, motion, np.array([at]), base)[0]


def worst_stop(boom: Boom, motions: Sequence[Motion], base: BaseMotion | None = None) -> WorstStop:
    """Return the longest and the farthest stop of consecutive motions; see MOMENTS."""
    begun = 0.0
    every: list[tuple[Stop, float, float]] = []
    for motion in motions:
        moments = np.linspace(0.0, motion.duration, MOMENTS + 1)[1:-1]
        stops = _stops(boom, motion, moments, base)
        q = np.stack([each.motion(np.linspace(0.0, each.duration, _STOP_SAMPLES))[0] for each in stops])
        lengths = np.linalg.norm(np.diff(forward_kinematics(boom, q).position, axis=1), axis=-1).sum(axis=-1)
        every += zip(stops, lengths.tolist(), (begun + moments).tolist(), strict=True)
        begun += motion.duration
    slow, far = max(every, key=lambda each: each[0].duration), max(every, key=lambda each: each[1])
    return WorstStop(slow[0].duration, slow[2], slow[0].way, far[1], far[2], far[0].way)


def _stops(boom: Boom, motion: Motion, moments: Array, base: BaseMotion | None) -> list[Stop]:
    stops = [Stop(Motion(motion.path, motion.law.after(at)), Way.FINISH) for at in moments]
    limits = _limits_from(boom, motion, moments)

    def on_path(at: float, share: float) -> Motion | None:
        return _path_brake(motion, at, share, limits[at])

    def off_path(at: float, share: float) -> Motion | None:
        return _joint_brake(boom, motion, at, share)

    found = _hardest(boom, on_path, moments, base, most=1.0 if isinstance(motion.path, JointLine) else _MAX_SHARE)
    for i, (braked, _) in enumerate(found):
        if braked is not None and braked.duration < stops[i].duration:
            stops[i] = Stop(braked, Way.ON_PATH)
    # Clearance was planned on the path only, so a boom with keep-out shapes stays on it.
    held_back = [i for i, (_, share) in enumerate(found) if share < 1.0 and boom.keep_out is None]
    for i, (braked, _) in zip(held_back, _hardest(boom, off_path, moments[held_back], base), strict=True):
        if braked is not None and braked.duration < _OFF_PATH_GAIN * stops[i].duration:
            stops[i] = Stop(braked, Way.OFF_PATH)
    return stops


def _hardest(
    boom: Boom, brake: Callable[[float, float], Motion | None], moments: Array, base: BaseMotion | None, most: float = 1.0
) -> list[tuple[Motion | None, float]]:
    """Return, for each moment, the hardest braking that respects the limits, and its share.

    All moments are bisected together. A motion is None if no braking respects the limits.
    """
    found: list[Motion | None] = [None] * len(moments)
    soft, hard = np.zeros(len(moments)), np.full(len(moments), most)
    share = np.ones(len(moments))
    for _ in range(_BISECTIONS if most == 1.0 else _BISECTIONS + 2):
        tried = [brake(at, each) for at, each in zip(moments, share, strict=True)]
        kept = _kept(boom, tried, base)
        for i in np.flatnonzero(kept):
            found[i] = tried[i]
        soft, hard = np.where(kept, share, soft), np.where(kept, hard, share)
        if (soft == hard).all():
            break
        share = np.where(soft == hard, soft, np.where(soft < 1.0, (soft + np.minimum(hard, 1.0)) / 2.0, np.sqrt(soft * hard)))
    return list(zip(found, soft.tolist(), strict=True))


def _limits_from(boom: Boom, motion: Motion, moments: Array) -> dict[float, tuple[float, float]]:
    """Return, for each moment, the least of limit / |p'| on the rest of the path.

    The first number is for the acceleration limits, the second for the jerk limits.
    """
    s = np.linspace(0.0, 1.0, _PATH_SAMPLES)
    ahead = np.maximum.accumulate(np.abs(motion.path(s, 1))[::-1], axis=0)[::-1]
    at = np.clip(np.searchsorted(s, np.asarray(motion.law.s(moments)), side="right") - 1, 0, _PATH_SAMPLES - 1)
    with np.errstate(divide="ignore"):
        accelerations, jerks = ((limit / ahead[at]).min(axis=-1) for limit in (boom.limits.acceleration, boom.limits.jerk))
    return dict(zip(moments.tolist(), zip(accelerations.tolist(), jerks.tolist(), strict=True), strict=True))


def _path_brake(motion: Motion, at: float, share: float, limits: tuple[float, float]) -> Motion | None:
    """Return the braking on the path with a share of the path's limits.

    None if there is no such braking or it passes the end of the path.
    """
    law, unit = motion.law, motion.duration  # as in `jerk_limited`: ruckig needs numbers of order one
    state = [[float(law.s(at, order)) * unit**order] for order in range(3)]
    found = brake_to_rest(state, [share * limits[0] * unit**2], [share * limits[1] * unit**3] if law.jerk_limited else None)
    if found is None:
        return None
    braked = TimeLaw.from_pieces(found[0][0], found[0][1], jerk_limited=law.jerk_limited).stretched(unit)
    return None if float(braked.s(braked.duration)) > 1.0 else Motion(motion.path, braked)


def _joint_brake(boom: Boom, motion: Motion, at: float, share: float) -> Motion | None:
    """Return the braking of each joint independently, with a share of the joints' limits."""
    from scipy.interpolate import PPoly

    q, qd, qdd, _ = motion(at)
    jerk = share * boom.limits.jerk if motion.law.jerk_limited else None
    found = brake_to_rest([q, qd, qdd], share * boom.limits.acceleration, jerk)
    if found is None:
        return None
    duration = max(float(t.sum()) for t, _ in found)
    laws = [
        TimeLaw.from_pieces(t, c) if t.any() else TimeLaw.from_pieces([duration], [[0.0], [0.0], [0.0], [at_rest]])
        for (t, c), at_rest in zip(found, q, strict=True)
    ]
    breaks = np.unique(np.concatenate([law.s.x for law in laws]))
    breaks = breaks[np.append(True, np.diff(breaks) > LIMIT_TOLERANCE * duration)]
    coefficients = np.stack([law.on(breaks) for law in laws], axis=-1)
    spline = PPoly(coefficients * duration ** np.arange(3.0, -1.0, -1.0)[:, None, None], breaks / duration)
    law = TimeLaw.from_pieces(np.diff(breaks) / breaks[-1], [np.ones(len(breaks) - 1), breaks[:-1] / breaks[-1]])
    return Motion(SplinePath(spline, q[None]), TimeLaw(law.s, motion.law.jerk_limited).stretched(float(breaks[-1])))


def _kept(boom: Boom, motions: list[Motion | None], base: BaseMotion | None) -> Mask:
    """Return whether each motion respects the limits of joints and drives; False if it is None."""
    kept = np.zeros(len(motions), dtype=bool)
    there = [i for i, motion in enumerate(motions) if motion is not None]
    if not there:
        return kept
    states = [motion(motion.law.times(_STOP_SAMPLES)) for motion in motions if motion is not None]
    starts = np.cumsum([0, *(len(each[0]) for each in states)])[:-1]
    q, qd, qdd, qddd = (np.concatenate(each) for each in zip(*states, strict=True))
    tau = inverse_dynamics(boom, q, qd, qdd, base=base, friction=True, reactions=False).tau
    jerk = qddd if all(motion.law.jerk_limited for motion in motions if motion is not None) else None
    ratio = np.maximum.reduce([load_ratio(boom, tau, qd, qdd), *rate_ratios(boom, qd, qdd, jerk).values()])
    ratio = np.where(boom.limits.contain(q)[:, None], ratio, np.inf)
    kept[there] = np.maximum.reduceat(ratio.max(axis=-1), starts) <= 1.0 + RATIO_TOLERANCE
    return kept
