"""The worst ratio of motions to each limit, recomputed from the model on a grid of its own."""

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
"""Points at which a part of a motion is certified at least, besides both sides of every jump.

2,001 were measured to miss at most 2e-6 of a limit that 100,000 see, on 84 motions of every profile along straight, smooth and
tip paths: RATIO_TOLERANCE is 500 times that.
"""


@dataclass(frozen=True)
class WorstRatio:
    """The largest demand / limit of one kind of limit."""

    limit: str
    joint: str
    ratio: float
    """For a position: distance from the middle of its range over half the range; for the linkage: limit / angle."""
    at_s: float | None
    """None of what the whole motion decides."""


class States(NamedTuple):
    """States and torques at times t (n,), each (n, 5)."""

    t: Array
    q: Array
    qd: Array
    qdd: Array
    qddd: Array
    tau: Array


def states_of(boom: Boom, motions: Sequence[Motion], base: BaseMotion | None, seen: Sequence[int]) -> States:
    """Return the states beside every jump of motions in turn, and as many as are missing to LEAST_SAMPLES of each.

    Args:
        base: how the base is tilted; None is level.
        seen: how many points of each motion are known already.
    """
    starts = np.cumsum([0.0, *(motion.duration for motion in motions)])
    times = [motion.times(max(1, LEAST_SAMPLES - count)) for motion, count in zip(motions, seen, strict=True)]
    t = np.concatenate([start + part for start, part in zip(starts[:-1], times, strict=True)])
    states = [motion(part) for motion, part in zip(motions, times, strict=True)]
    q, qd, qdd, qddd = (np.concatenate(each) for each in zip(*states, strict=True))
    tau = inverse_dynamics(boom, q, qd, qdd, base=base, friction=True, reactions=False).tau
    return States(t, q, qd, qdd, qddd, tau)


def worst_of(boom: Boom, motions: Sequence[Motion], states: States, average_torque: bool) -> tuple[WorstRatio, ...]:
    """Return the worst ratio of states to each limit; jerks count where every motion limits them.

    Args:
        average_torque: whether the gearboxes' average torque counts too.
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
    """Return the worst ratio to each limit over motions in turn.

    Friction is counted. A motor whose supply is not given is compared with its torque at standstill, and the limit named so.
    """
    return worst_of(boom, motions, states_of(boom, motions, base, [0] * len(motions)), average_torque)


def joint_stretch(boom: Boom, motion: Motion) -> float:
    """Return the factor by which a motion must be slowed to keep the joints' velocity, acceleration and jerk.

    Slowed by k, they fall as 1/k, 1/k^2 and 1/k^3. Below 1 where the motion may be hastened.
    """
    velocity, acceleration, jerk = peak_rate_ratios(boom, motion, motion.times(LEAST_SAMPLES))
    return float(max(velocity, np.sqrt(acceleration), np.cbrt(jerk) if motion.law.jerk_limited else 0.0))


def _averages(boom: Boom, states: States) -> list[WorstRatio]:
    """The gearbox nearest to its average torque, or beyond it."""
    ratios = []
    for i, drive in enumerate(boom.drives):
        limit = None if drive is None else drive.gearbox.max_average_torque
        if limit is not None:
            share = (mean(states.t, states.tau[:, i], states.qd[:, i]) or 0.0) / limit
            ratios.append(WorstRatio(Limit.AVERAGE_TORQUE, JOINTS[i], share, None))
    return [max(ratios, key=lambda each: each.ratio)] if ratios else []
