"""What a planned motion asks of each limit at worst, recomputed from the model on a grid finer than the planner's."""

from collections.abc import Sequence
from dataclasses import dataclass

from boom_model import BaseMotion, Boom
from planner.timing.time_law import Motion
from planner.timing.worst_ratios import WorstRatio, worst_ratios

__all__ = ["RATIO_TOLERANCE", "Certificate", "WorstRatio", "certify"]

RATIO_TOLERANCE = 1e-3
"""How far above 1 a ratio may be: what a planner may miss between the points that it looks at."""


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


def certify(boom: Boom, motions: Sequence[Motion], base: BaseMotion | None = None, average_torque: bool = False) -> Certificate:
    """The motions' worst ratios, as `worst_ratios` finds them, with what their planner says of its own solves.

    Only the base's tilt is counted: what else a vehicle does was not planned for.

    Args:
        average_torque: whether the gearboxes' average torque was asked for too.
    """
    worst, samples = worst_ratios(boom, motions, base, average_torque)
    laws = [motion.law for motion in motions]
    return Certificate(samples, worst, sum(law.iterations for law in laws), max(law.residual for law in laws))
