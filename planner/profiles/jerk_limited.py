"""Jerk-limited law along a straight joint path (ruckig, community edition)."""

import numpy as np
from ruckig import InputParameter, Result, Ruckig, Trajectory

from boom_model import Boom, InfeasibleError
from planner.constraints import least_stretch
from planner.path import JointLine
from planner.profiles.cubic import cubic
from planner.time_law import TimeLaw


def jerk_limited(boom: Boom, path: JointLine) -> TimeLaw:
    """The least-time law from rest to rest under velocity, acceleration and jerk limits, slowed if a drive's torque asks.

    One law s(t) for all joints, its limits the least of limit / |goal - start| over the joints: the move is exactly straight
    in joint space, and so keeps the coupled limit on the way.

    Raises:
        InfeasibleError: ruckig found no law; carries its result.
    """
    limits = boom.limits
    unit = cubic(boom, path).duration  # solved in units of the cubic's duration: ruckig fails on very large limits
    step = np.abs(path.goal - path.start)
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
    return law.stretched(max(1.0, least_stretch(boom, path, law)))
