"""Stopping in the middle of a move."""

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
"""Moments of each part of a move at which a stop is tried."""

_LOOKS = 33
_TRIES = 7
_WORTH_LEAVING = 0.8
_MOST_SHARE = 8.0  # on a curved path the steepest place ahead may lie beyond the stop
_SLOPES = 2001


class Way(StrEnum):
    """Where a stop goes."""

    ON_PATH = "on the path"
    OFF_PATH = "off the path"
    """Each joint brakes by itself: the tip leaves its path."""
    FINISH = "finishes the move"
    """No stop that keeps the limits is shorter."""


@dataclass(frozen=True, eq=False)
class Stop:
    """From a motion's state at a moment to rest."""

    motion: Motion
    way: Way

    @property
    def duration(self) -> float:
        return self.motion.duration


@dataclass(frozen=True)
class WorstStop:
    """The worst of the stops of a move: the longest, and the one that takes the tip farthest."""

    time_s: float
    time_at_s: float
    """When the longest begins."""
    time_way: Way
    distance_m: float
    """Of the tip, along its way."""
    distance_at_s: float
    distance_way: Way


def stop(boom: Boom, motion: Motion, at: float, base: BaseMotion | None = None) -> Stop:
    """The shortest stop found from the moment `at` [s] of a motion, within the limits of joints and drives.

    ruckig's velocity interface brings s(t) to rest with the hardest even limit on its deceleration (and jerk, where the
    motion's is limited) that keeps the limits on the way. On a curved path the curvature alone can take all of a joint's
    acceleration: where that makes the stop a quarter longer, or impossible, each joint brakes by itself, off the path. What is
    longer than finishing the move is not used. A boom with shapes to keep away from stops on its path.

    Raises:
        InputError: the moment is not within the motion.
    """
    at = scalar("moment", at)
    if not 0.0 <= at <= motion.duration:
        raise InputError(f"moment is {at:g} s; the motion lasts from 0 to {motion.duration:g} s")
    return _stops(boom, motion, np.array([at]), base)[0]


def worst_stop(boom: Boom, motions: Sequence[Motion], base: BaseMotion | None = None) -> WorstStop:
    """The longest and the farthest stop from MOMENTS equal moments of each motion."""
    begun = 0.0
    every: list[tuple[Stop, float, float]] = []
    for motion in motions:
        moments = np.linspace(0.0, motion.duration, MOMENTS + 1)[1:-1]
        stops = _stops(boom, motion, moments, base)
        q = np.stack([each.motion(np.linspace(0.0, each.duration, _LOOKS))[0] for each in stops])
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

    found = _hardest(boom, on_path, moments, base, most=1.0 if isinstance(motion.path, JointLine) else _MOST_SHARE)
    for i, (braked, _) in enumerate(found):
        if braked is not None and braked.duration < stops[i].duration:
            stops[i] = Stop(braked, Way.ON_PATH)
    # Off the path nobody knows what is in the way.
    held_back = [i for i, (_, share) in enumerate(found) if share < 1.0 and boom.keep_out is None]
    for i, (braked, _) in zip(held_back, _hardest(boom, off_path, moments[held_back], base), strict=True):
        if braked is not None and braked.duration < _WORTH_LEAVING * stops[i].duration:
            stops[i] = Stop(braked, Way.OFF_PATH)
    return stops


def _hardest(
    boom: Boom, brake: Callable[[float, float], Motion | None], moments: Array, base: BaseMotion | None, most: float = 1.0
) -> list[tuple[Motion | None, float]]:
    """The hardest braking of each moment that keeps the limits, and its share, by bisection of all moments at once."""
    found: list[Motion | None] = [None] * len(moments)
    soft, hard = np.zeros(len(moments)), np.full(len(moments), most)
    share = np.ones(len(moments))
    for _ in range(_TRIES if most == 1.0 else _TRIES + 2):
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
    """By moment, the least of the acceleration and jerk limits over |p'| on the rest of the path."""
    s = np.linspace(0.0, 1.0, _SLOPES)
    ahead = np.maximum.accumulate(np.abs(motion.path(s, 1))[::-1], axis=0)[::-1]
    at = np.clip(np.searchsorted(s, np.asarray(motion.law.s(moments)), side="right") - 1, 0, _SLOPES - 1)
    with np.errstate(divide="ignore"):
        accelerations, jerks = ((limit / ahead[at]).min(axis=-1) for limit in (boom.limits.acceleration, boom.limits.jerk))
    return dict(zip(moments.tolist(), zip(accelerations.tolist(), jerks.tolist(), strict=True), strict=True))


def _path_brake(motion: Motion, at: float, share: float, limits: tuple[float, float]) -> Motion | None:
    """s(t) from a moment to rest with a share of the path's limits; None where it runs over the path's end."""
    law, unit = motion.law, motion.duration  # as in `jerk_limited`: ruckig wants numbers of order one
    state = [[float(law.s(at, order)) * unit**order] for order in range(3)]
    found = brake_to_rest(state, [share * limits[0] * unit**2], [share * limits[1] * unit**3] if law.jerk_limited else None)
    if found is None:
        return None
    braked = TimeLaw.from_pieces(found[0][0], found[0][1], jerk_limited=law.jerk_limited).stretched(unit)
    return None if float(braked.s(braked.duration)) > 1.0 else Motion(motion.path, braked)


def _joint_brake(boom: Boom, motion: Motion, at: float, share: float) -> Motion | None:
    """Every joint from a moment to rest by itself, with a share of the joints' limits."""
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
    """Whether each motion keeps the limits of joints and drives; False where there is none."""
    kept = np.zeros(len(motions), dtype=bool)
    there = [i for i, motion in enumerate(motions) if motion is not None]
    if not there:
        return kept
    states = [motion(motion.law.times(_LOOKS)) for motion in motions if motion is not None]
    starts = np.cumsum([0, *(len(each[0]) for each in states)])[:-1]
    q, qd, qdd, qddd = (np.concatenate(each) for each in zip(*states, strict=True))
    tau = inverse_dynamics(boom, q, qd, qdd, base=base, friction=True, reactions=False).tau
    jerk = qddd if all(motion.law.jerk_limited for motion in motions if motion is not None) else None
    ratio = np.maximum.reduce([load_ratio(boom, tau, qd, qdd), *rate_ratios(boom, qd, qdd, jerk).values()])
    ratio = np.where(boom.limits.contain(q)[:, None], ratio, np.inf)
    kept[there] = np.maximum.reduceat(ratio.max(axis=-1), starts) <= 1.0 + RATIO_TOLERANCE
    return kept
