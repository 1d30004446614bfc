"""What a planned motion asks of each limit at worst, recomputed from the model on a grid finer than the planner's."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from boom_model import JOINTS, BaseMotion, Boom, inverse_dynamics
from boom_model.arrays import Array
from planner.checks.drives.duty import Duty
from planner.checks.evaluation import Evaluation
from planner.timing.limit_ratios import RATIO_TOLERANCE, Limit, limit_ratios
from planner.timing.time_law import Motion

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


@dataclass(frozen=True)
class Certificate:
    """The worst ratio to each limit over a planned motion."""

    samples: int
    worst: tuple[WorstRatio, ...]
    iterations: int
    """Solves of the planner, over all parts of the motion."""
    residual: float
    """What one more solve could still add, as a share of a limit, the most of the parts."""

    @property
    def broken(self) -> tuple[WorstRatio, ...]:
        """The ratios that are too large."""
        return tuple(worst for worst in self.worst if worst.ratio > 1.0 + RATIO_TOLERANCE)


@dataclass(frozen=True, eq=False)
class _States:
    """States and torques at times t (n,), each (n, 5)."""

    t: Array
    q: Array
    qd: Array
    qdd: Array
    qddd: Array
    tau: Array


def certify(
    boom: Boom,
    motions: Sequence[Motion],
    base: BaseMotion | None = None,
    average_torque: bool = False,
    evaluated: Evaluation | None = None,
) -> Certificate:
    """Positions, linkage, velocities, accelerations, jerks where they are limited, gearbox and motor torque.

    Friction is counted. Only the base's tilt is: what else a vehicle does was not planned for. A motor whose supply is not
    given is held against its torque at standstill, and the limit named so.

    Args:
        average_torque: whether the gearboxes' average torque was asked for too.
        evaluated: of the same motions on the same base; its states are not evaluated again.
    """
    jerk_limited = all(motion.law.jerk_limited for motion in motions)
    states = _states(boom, motions, base, evaluated)
    jerk = states.qddd if jerk_limited else None
    worst = []
    for limit, ratio in limit_ratios(boom, states.q, states.qd, states.qdd, jerk, states.tau).items():
        at, joint = np.unravel_index(int(np.argmax(ratio)), ratio.shape)
        worst.append(WorstRatio(limit, JOINTS[joint], float(ratio[at, joint]), float(states.t[at])))
    if average_torque:
        worst += _averages(boom, states)
    laws = [motion.law for motion in motions]
    return Certificate(len(states.t), tuple(worst), sum(law.iterations for law in laws), max(law.residual for law in laws))


def certified(evaluation: Evaluation) -> Certificate | None:
    """The certificate of an evaluated plan; None of an empty one, and where only samples are known."""
    planned = evaluation.planned
    if planned is None or not planned.motions:
        return None
    seen = evaluation if evaluation.vehicle.is_steady and evaluation.payload_as == "mass" else None
    return certify(evaluation.boom, planned.motions, evaluation.vehicle.tilt, planned.average_torque, seen)


def _states(boom: Boom, motions: Sequence[Motion], base: BaseMotion | None, evaluated: Evaluation | None) -> _States:
    """The evaluation's states, and those beside every jump and of what is missing to LEAST_SAMPLES a part, in order of time."""
    starts = np.cumsum([0.0, *(motion.duration for motion in motions)])
    seen = [0] * len(motions)
    if evaluated is not None:
        edges = np.searchsorted(evaluated.t, starts)
        edges[-1] = len(evaluated.t)
        seen = np.diff(edges).tolist()
    times = [motion.times(max(1, LEAST_SAMPLES - count)) for motion, count in zip(motions, seen, strict=True)]
    t = np.concatenate([start + part for start, part in zip(starts[:-1], times, strict=True)])
    states = [motion(part) for motion, part in zip(motions, times, strict=True)]
    q, qd, qdd, qddd = (np.concatenate(each) for each in zip(*states, strict=True))
    tau = inverse_dynamics(boom, q, qd, qdd, base=base, friction=True, reactions=False).tau
    if evaluated is None:
        return _States(t, q, qd, qdd, qddd, tau)
    motion = evaluated.trajectory
    known = np.zeros_like(motion.q) if motion.qddd is None else motion.qddd
    order = np.argsort(np.concatenate([motion.t, t]), kind="stable")
    pairs = ((motion.t, t), (motion.q, q), (motion.qd, qd), (motion.qdd, qdd), (known, qddd), (evaluated.tau, tau))
    return _States(*(np.concatenate(pair)[order] for pair in pairs))


def _averages(boom: Boom, states: _States) -> list[WorstRatio]:
    """The gearbox nearest to its average torque, or beyond it."""
    duty, ratios = Duty.alone(states.t), []
    for i, drive in enumerate(boom.drives):
        limit = None if drive is None else drive.gearbox.max_average_torque
        if limit is not None:
            mean = duty.travel_mean(states.tau[:, i], states.qd[:, i]) or 0.0
            ratios.append(WorstRatio(Limit.AVERAGE_TORQUE, JOINTS[i], mean / limit, None))
    return [max(ratios, key=lambda each: each.ratio)] if ratios else []
