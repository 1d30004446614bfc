"""Trapezoidal law: constant acceleration, constant speed, constant deceleration."""

import numpy as np

from boom_model import BaseMotion, Boom
from planner.paths.path import Path
from planner.timing.path_limits import least_stretch, path_limits
from planner.timing.time_law import TimeLaw


def trapezoidal(boom: Boom, path: Path, base: BaseMotion | None = None) -> TimeLaw:
    """Return the trapezoid with the smallest limit / |p'| of speed and acceleration.

    The minimum is over joints and path. With speed v and acceleration a, the law takes 1/v + v/a if
    v^2 <= a. Otherwise it is a triangle, which takes 2 / sqrt(a). It is slowed evenly where the
    curvature of the path or a drive requires it.
    """
    velocity, acceleration, _ = path_limits(boom, path)
    speed = min(velocity, np.sqrt(acceleration))
    ramp = speed / acceleration
    cruise = max(1.0 / speed - ramp, 0.0)
    covered = acceleration * ramp**2 / 2.0
    pieces = [[acceleration / 2.0, 0.0, -acceleration / 2.0], [0.0, speed, speed], [0.0, covered, 1.0 - covered]]
    law = TimeLaw.from_pieces([ramp, cruise, ramp], pieces)
    return law.stretched(max(1.0, least_stretch(boom, path, law, base)))
