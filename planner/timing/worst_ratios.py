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
    qddd: Array
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


def worst_of(boom: Boom, motions: Sequence[Motion], states: States, average_torque: bool) -> tuple[WorstRatio, ...]:
    """Return the worst ratio of states to each limit.

    The jerk is included if every motion limits it.

    Args:
        boom: the boom.
        motions: the motions of the states.
        states: see `states_of`.
        average_torque: whether to include the average torque of the gearboxes.
    """
    jerk = states.qddd if all(motion.law.jerk_limited for motion in motions) else None
    worst = []
    for limit, ratio in limit_ratios(boom, states.q, states.qd, states.qdd, jerk, states.tau).items():
        at, joint = np.unravel_index(int(np.argmax(ratio)), ratio.shape)
        worst.append(WorstRatio(limit, JOINTS[joint], float(ratio[at, joint]), float(states.t[at])))
    if average_torque:
        worst += _averages(boom, states)
    return tuple(worst)


def worst_ratios(
    boom: Boom, motions: Sequence[Motion], base: BaseMotion | None = None, average_torque: bool = False
) -> tuple[WorstRatio, ...]:
    """Return the worst ratio to each limit over motions that follow each other.

    Torques include friction. If the supply of a motor is unknown, its torque is compared with the
    limit at standstill, and the limit is named accordingly.
    """
    return worst_of(boom, motions, states_of(boom, motions, base, [0] * len(motions)), average_torque)


def joint_stretch(boom: Boom, motion: Motion) -> float:
    """Return the smallest factor on the duration of a motion with which it respects joint limits.

    A motion slowed by k has 1/k of the velocity, 1/k^2 of the acceleration and 1/k^3 of the jerk. A
    factor below 1 means that the motion can be faster.
    """
    velocity, acceleration, jerk = peak_rate_ratios(boom, motion, motion.times(LEAST_SAMPLES))
    return float(max(velocity, np.sqrt(acceleration), np.cbrt(jerk) if motion.law.jerk_limited else 0.0))


def _averages(boom: Boom, states: States) -> list[WorstRatio]:
    """Return the largest ratio of a gearbox to its average torque limit."""
    ratios = []
    for i, drive in enumerate(boom.drives):
        limit = None if drive is None else drive.gearbox.max_average_torque
        if limit is not None:
            share = (mean(states.t, states.tau[:, i], states.qd[:, i]) or 0.0) / limit
            ratios.append(WorstRatio(Limit.AVERAGE_TORQUE, JOINTS[i], share, None))
    return [max(ratios, key=lambda each: each.ratio)] if ratios else []
