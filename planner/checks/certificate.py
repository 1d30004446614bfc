"""Certificate of a planned motion: the worst ratio to each limit, recomputed from the model."""

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
    """Worst ratio of demand to limit over a planned motion, for each limit."""

    samples: int
    """Number of points at which the ratios were computed."""
    worst: tuple[WorstRatio, ...]
    iterations: int
    """Number of solves of the planner, summed over the parts of the motion."""
    residual: float
    """Largest change of a ratio that one more solve could make, over the parts of the motion."""

    @property
    def broken(self) -> tuple[WorstRatio, ...]:
        """Ratios above 1 by more than the tolerance."""
        return tuple(worst for worst in self.worst if worst.ratio > 1.0 + RATIO_TOLERANCE)


def certify(
    boom: Boom,
    motions: Sequence[Motion],
    base: BaseMotion | None = None,
    average_torque: bool = False,
    evaluated: Evaluation | None = None,
) -> Certificate:
    """Compute the worst ratio to each limit; add the planner's solve count and residual.

    Of the vehicle's motion only the tilt counts, because planning accounts for the tilt only.

    Args:
        boom: the boom.
        motions: the motions from stop to stop, in order.
        base: tilt of the base; None is level.
        average_torque: whether to include the gearboxes' average torque.
        evaluated: evaluation of the same motions on the same base, if there is one. Its states
            are reused.
    """
    parts = _states(boom, motions, base, evaluated)
    worst = worst_of(boom, motions, parts, average_torque)
    laws = [motion.law for motion in motions]
    samples = sum(len(part.t) for part in parts)
    return Certificate(samples, worst, sum(law.iterations for law in laws), max(law.residual for law in laws))


def certificate_of(evaluation: Evaluation) -> Certificate | None:
    """Return the certificate of an evaluated plan; None for an empty move and for mere samples."""
    planned = evaluation.planned
    if planned is None or not planned.motions:
        return None
    seen = evaluation if evaluation.vehicle.is_steady and evaluation.payload_as == "mass" else None
    return certify(evaluation.boom, planned.motions, evaluation.vehicle.tilt, planned.average_torque, seen)


def _states(boom: Boom, motions: Sequence[Motion], base: BaseMotion | None, evaluated: Evaluation | None) -> list[States]:
    """Return the states to certify, in parts in order of time.

    These are the evaluation's states, the states on both sides of every jump, and as many more as
    each part needs for LEAST_SAMPLES.
    """
    if evaluated is None:
        return [states_of(boom, motions, base, [0] * len(motions))]
    starts = np.cumsum([0.0, *(motion.duration for motion in motions)])
    edges = np.searchsorted(evaluated.t, starts)
    edges[-1] = len(evaluated.t)
    more = states_of(boom, motions, base, np.diff(edges).tolist())
    motion = evaluated.trajectory
    return [States(motion.t, motion.q, motion.qd, motion.qdd, motion.qddd, evaluated.tau), more]
