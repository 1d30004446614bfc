"""The certificate of a planned motion: its worst ratio to each limit, recomputed from the model."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from boom_model import BaseMotion, Boom
from planner.checks.evaluation import Evaluation
from planner.timing.limit_ratios import RATIO_TOLERANCE
from planner.timing.time_law import Motion
from planner.timing.worst_ratios import States, WorstRatio, states_of, worst_of


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


def certify(
    boom: Boom,
    motions: Sequence[Motion],
    base: BaseMotion | None = None,
    average_torque: bool = False,
    evaluated: Evaluation | None = None,
) -> Certificate:
    """Return the worst ratio to each limit, with what the planner says of its own solves.

    Only the base's tilt is counted: what else a vehicle does was not planned for.

    Args:
        boom: the boom.
        motions: the motions from stop to stop, in turn.
        base: how the base is tilted; None is level.
        average_torque: whether the gearboxes' average torque was asked for too.
        evaluated: of the same motions on the same base; its states are not evaluated again.
    """
    states = _states(boom, motions, base, evaluated)
    worst = worst_of(boom, motions, states, average_torque)
    laws = [motion.law for motion in motions]
    return Certificate(len(states.t), worst, sum(law.iterations for law in laws), max(law.residual for law in laws))


def certified(evaluation: Evaluation) -> Certificate | None:
    """Return the certificate of an evaluated plan; None of an empty one, and where only samples are known."""
    planned = evaluation.planned
    if planned is None or not planned.motions:
        return None
    seen = evaluation if evaluation.vehicle.is_steady and evaluation.payload_as == "mass" else None
    return certify(evaluation.boom, planned.motions, evaluation.vehicle.tilt, planned.average_torque, seen)


def _states(boom: Boom, motions: Sequence[Motion], base: BaseMotion | None, evaluated: Evaluation | None) -> States:
    """The evaluation's states, and those beside every jump and of what is missing to LEAST_SAMPLES a part, in order of time."""
    if evaluated is None:
        return states_of(boom, motions, base, [0] * len(motions))
    starts = np.cumsum([0.0, *(motion.duration for motion in motions)])
    edges = np.searchsorted(evaluated.t, starts)
    edges[-1] = len(evaluated.t)
    more = states_of(boom, motions, base, np.diff(edges).tolist())
    motion = evaluated.trajectory
    known = np.zeros_like(motion.q) if motion.qddd is None else motion.qddd
    order = np.argsort(np.concatenate([motion.t, more.t]), kind="stable")
    seen = (motion.t, motion.q, motion.qd, motion.qdd, known, evaluated.tau)
    return States(*(np.concatenate(pair)[order] for pair in zip(seen, more, strict=True)))
