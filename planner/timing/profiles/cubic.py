"""Cubic time law, rest to rest (thesis, eqs. 2.72-2.78)."""

from boom_model import BaseMotion, Boom
from planner.paths.path import Path
from planner.timing.path_limits import least_stretch
from planner.timing.time_law import TimeLaw


def cubic(boom: Boom, path: Path, base: BaseMotion | None = None) -> TimeLaw:
    """Time s(t) = 3 (t/T)^2 - 2 (t/T)^3 with the least T that keeps all limits.

    Its acceleration jumps to 6/T^2 at both ends, where the thesis's tables 2-4 and 3-1 print 0.
    """
    law = TimeLaw.from_pieces([1.0], [[-2.0], [3.0], [0.0], [0.0]])
    return law.stretched(least_stretch(boom, path, law, base))
