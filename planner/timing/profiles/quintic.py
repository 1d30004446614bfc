"""Quintic time law, rest to rest with no acceleration at either end."""

from boom_model import BaseMotion, Boom
from planner.paths.path import Path
from planner.timing.path_limits import least_stretch
from planner.timing.time_law import TimeLaw


def quintic(boom: Boom, path: Path, base: BaseMotion | None = None) -> TimeLaw:
    """Time s(t) = 10 (t/T)^3 - 15 (t/T)^4 + 6 (t/T)^5 with the least T that keeps all limits.

    Its jerk is finite, 60/T^3 at most, but held to no limit.
    """
    law = TimeLaw.from_pieces([1.0], [[6.0], [-15.0], [10.0], [0.0], [0.0], [0.0]])
    return law.stretched(least_stretch(boom, path, law, base))
