"""Worst ratio of motions to each limit, recomputed from the model on a separate grid."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from boom_model import JOINTS, BaseMotion, Boom, inverse_dynamics
from boom_model.arrays import Array
from planner.timing.limit_ratios import Limit, limit_ratios
from planner.timing.path_limits import peak_rate_ratios
from planner.timing.time_law import Motion
from planner.timing.travel_mean import average_torque as mean

LEAST_SAMPLES = 5_000
"""Smallest number of points at which a part of a motion is certified, besides both sides of a jump.

On 84 motions, of every profile along straight, smooth and tip paths, the worst ratio on 2,001
points was at most 2e-6 below that on 100,000 points. RATIO_TOLERANCE is 500 times this.
"""


@dataclass(frozen=True)
class WorstRatio:
    """Largest demand / limit for one kind of limit."""

    limit: str
    joint: str
    ratio: float
    """Defined for position and linkage in `limit_ratios`."""
    at_s: float | None
    """None for a limit on the whole motion."""


class States(NamedTuple):
    """States and torques at times t (n,), each (n, 5)."""

    t: Array
    q: Array
    qd: Array
    qdd: Array
    qddd: Array | None
    """None unless a motion limits the jerk."""
    tau: Array


def states_of(boom: Boom, motions: Sequence[Motion], base: BaseMotion | None, seen: Sequence[int]) -> States:
    """Return the states on both sides of every jump, and more up to LEAST_SAMPLES per motion.

    Args:
        boom: the boom.
        motions: motions that follow each other.
        base: tilt of the base; None is level.
        seen: number of points of each motion that are evaluated elsewhere.
    """
    starts = np.cumsum([0.0, *(motion.duration for motion in motions)])
    times = [motion.times(max(1, LEAST_SAMPLES - count)) for motion, count in zip(motions, seen, strict=True)]
    t = np.concatenate([start + part for start, part in zip(starts[:-1], times, strict=True)])
    states = [motion(part) for motion, part in zip(motions, times, strict=True)]
    q, qd, qdd, qddd = (np.concatenate(each) for each in zip(*states, strict=True))
    tau = inverse_dynamics(boom, q, qd, qdd, base=base, friction=True, reactions=False).tau
    return States(t, q, qd, qdd, qddd, tau)


def worst_of(boom: Boom, motions: Sequence[Motion], parts: Sequence[States], average_torque: bool) -> tuple[WorstRatio, ...]:
    """Return the worst ratio to each limit over all parts, the first of equal ones.

    The jerk is included if every motion limits it.

    Args:
        boom: the boom.
        motions: the motions of the states.
        parts: states in order of time, as from `states_of`.
        average_torque: whether to include the average torque of the gearboxes.
    """
    jerk_limited, worst = all(motion.law.jerk_limited for motion in motions), dict[Limit, WorstRatio]()
    for states in parts:
        jerk = states.qddd if jerk_limited else None
        for limit, ratio in limit_ratios(boom, states.q, states.qd, states.qdd, jerk, states.tau).items():
            found = _largest(limit, states.t, ratio)
            if limit not in worst or _order(found) > _order(worst[limit]):
                worst[limit] = found
    averages = _averages(boom, parts) if average_torque else []
    return (*(worst[limit] for limit in Limit if limit in worst), *averages)


def _largest(limit: Limit, t: Array, ratio: Array) -> WorstRatio:
    """Return the largest of the ratios (n, 5) at times t (n,), the first of equal ones."""
    at = ratio.argmax(axis=0).tolist()
    joint = min(range(len(at)), key=lambda i: (-ratio[at[i], i], at[i]))
    return WorstRatio(limit, JOINTS[joint], float(ratio[at[joint], joint]), float(t[at[joint]]))


def _order(worst: WorstRatio) -> tuple[float, float]:
    return worst.ratio, -(worst.at_s or 0.0)


def worst_ratios(
    boom: Boom, motions: Sequence[Motion], base: BaseMotion | None = None, average_torque: bool = False
) -> tuple[WorstRatio, ...]:
    """Return the worst ratio to each limit over motions that follow each other.

    Torques include friction. If the supply of a motor is unknown, its torque is compared with the
    limit at standstill, and the limit is named accordingly.
    """
    return worst_of(boom, motions, [states_of(boom, motions, base, [0] * len(motions))], average_torque)


def joint_stretch(boom: Boom, motion: Motion) -> float:
    """Return the smallest factor on the duration of a motion with which it respects joint limits.

    A motion slowed by k has 1/k of the velocity, 1/k^2 of the acceleration and 1/k^3 of the jerk. A
    factor below 1 means that the motion can be faster.
    """
    velocity, acceleration, jerk = peak_rate_ratios(boom, motion, motion.times(LEAST_SAMPLES))
    return float(max(velocity, np.sqrt(acceleration), np.cbrt(jerk) if motion.law.jerk_limited else 0.0))


def _averages(boom: Boom, parts: Sequence[States]) -> list[WorstRatio]:
    """Return the largest ratio of a gearbox to its average torque limit."""
    t, tau, qd = (np.concatenate(each) for each in zip(*((part.t, part.tau, part.qd) for part in parts), strict=True))
    order, ratios = np.argsort(t, kind="stable"), []
    for i, drive in enumerate(boom.drives):
        limit = None if drive is None else drive.gearbox.max_average_torque
        if limit is not None:
            share = (mean(t[order], tau[order, i], qd[order, i]) or 0.0) / limit
            ratios.append(WorstRatio(Limit.AVERAGE_TORQUE, JOINTS[i], share, None))
    return [max(ratios, key=lambda each: each.ratio)] if ratios else []
