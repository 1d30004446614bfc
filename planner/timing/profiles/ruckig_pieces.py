"""ruckig's answers as polynomials."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from boom_model.arrays import Array

Numbers = Sequence[float] | Array


def pieces(profile: Any) -> tuple[Array, Array]:
    """Durations (9,) and coefficients (4, 9), highest power first, of one joint in ruckig.

    The first two pieces brake a state that is beyond its limits, the other seven are the profile
    itself.
    """
    brake = profile.brake
    t = np.array([*brake.t, *profile.t])
    p, v, a, j = (np.array([*first, *then[:7]]) for first, then in zip(
        (brake.p, brake.v, brake.a, brake.j), (profile.p, profile.v, profile.a, profile.j), strict=True
    ))  # fmt: skip
    return t, np.stack([j / 6.0, a / 2.0, v, p])


def brake_to_rest(state: Sequence[Numbers], acceleration: Numbers, jerk: Numbers | None) -> list[tuple[Array, Array]] | None:
    """Return ruckig's polynomials to rest from position, velocity and acceleration, per joint.

    None where it finds nothing. Without a limit on jerk an acceleration is given up at once.
    """
    from ruckig import ControlInterface, InputParameter, Result, Ruckig, RuckigError, Synchronization, Trajectory

    count = len(acceleration)
    problem = InputParameter(count)
    problem.control_interface, problem.synchronization = ControlInterface.Velocity, Synchronization.No
    problem.current_position, problem.current_velocity = [list(map(float, each)) for each in state[:2]]
    # Without a limit on jerk an acceleration is given up at once.
    problem.current_acceleration = [0.0] * count if jerk is None else list(map(float, state[2]))
    problem.target_velocity = problem.target_acceleration = [0.0] * count
    problem.max_acceleration = list(map(float, acceleration))
    problem.max_jerk = [float("inf")] * count if jerk is None else list(map(float, jerk))
    solution = Trajectory(count)
    try:
        result = Ruckig(count).calculate(problem, solution)
    except RuckigError:  # its way to say that it found nothing
        return None
    if result != Result.Working or not solution.duration > 0.0:
        return None
    return [pieces(profile) for profile in solution.profiles[0]]
