"""Jerk-limited law along a path (ruckig, community edition)."""

import numpy as np
from ruckig import InputParameter, Result, Ruckig, Trajectory

from boom_model import BaseMotion, Boom, InfeasibleError
from planner.constraints import least_stretch
from planner.path import Path
from planner.profiles.cubic import cubic
from planner.time_law import Motion, TimeLaw

_SAMPLES = 20_001
_ROUNDING = 1e-9


def jerk_limited(boom: Boom, path: Path, base: BaseMotion | None = None) -> TimeLaw:
    """A law from rest to rest under velocity, acceleration and jerk limits, slowed where the path or a drive asks for it.

    One law s(t) for all joints, its limits the least of limit / |p'| over joints and path. On a straight joint path it is the
    least-time one, and the move keeps the coupled limit on the way; on a curved one it is slowed evenly until the curvature's
    share of acceleration and jerk keeps the limits too.

    Raises:
        InfeasibleError: ruckig found no law; carries its result.
    """
    limits = boom.limits
    unit = cubic(boom, path, base).duration  # solved in units of the cubic's duration: ruckig fails on very large limits
    step = np.abs(path(np.linspace(0.0, 1.0, _SAMPLES), 1)).max(axis=0)
    with np.errstate(divide="ignore"):
        velocity, acceleration, jerk = (
            float(np.min(limit / step)) * unit**power
            for power, limit in enumerate((limits.velocity, limits.acceleration, limits.jerk), start=1)
        )
    problem = InputParameter(1)
    problem.current_position, problem.target_position = [0.0], [1.0]
    problem.max_velocity, problem.max_acceleration, problem.max_jerk = [velocity], [acceleration], [jerk]
    solver, solution = Ruckig(1), Trajectory(1)
    result = solver.calculate(problem, solution)
    if result != Result.Working:  # ruckig's name for success offline
        raise InfeasibleError(f"no jerk-limited motion: ruckig answers {result.name}")
    profile = solution.profiles[0][0]
    p, v, a, j = (np.array(x)[:7] for x in (profile.p, profile.v, profile.a, profile.j))
    law = TimeLaw.from_pieces(profile.t, [j / 6.0, a / 2.0, v, p], jerk_limited=True).stretched(unit)
    law = law.stretched(max(1.0, least_stretch(boom, path, law, base)))
    _, _, _, qddd = Motion(path, law)(np.linspace(0.0, law.duration, _SAMPLES))
    over = float((np.abs(qddd) / limits.jerk).max())
    return law.stretched(max(1.0, np.cbrt(over))) if over > 1.0 + _ROUNDING else law
