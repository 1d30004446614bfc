"""Jerk-limited law along a path (ruckig, community edition)."""

from ruckig import InputParameter, Result, Ruckig, RuckigError, Trajectory

from boom_model import BaseMotion, Boom, InfeasibleError
from planner.paths.path import Path
from planner.timing.path_limits import jerk_stretch, least_stretch, path_limits
from planner.timing.profiles.cubic import cubic
from planner.timing.profiles.jerk_bound import jerk_bounded
from planner.timing.profiles.ruckig_pieces import pieces
from planner.timing.time_law import TimeLaw

_ROUNDING = 1e-9


def jerk_limited(boom: Boom, path: Path, base: BaseMotion | None = None) -> TimeLaw:
    """Find a law from rest to rest within velocity, acceleration, jerk and drive limits.

    It is ruckig's: the least-time one where the path is straight and no drive limits. Elsewhere it
    must be slowed, and the time-optimal law with its jerk bounded can be the faster of the two:
    then that is taken.

    Raises:
        InfeasibleError: ruckig found no law; carries its result.
    """
    law, slowed = evenly_limited(boom, path, base)
    if slowed <= 1.0 + _ROUNDING:
        return law
    try:
        other = jerk_bounded(boom, path, base)
    except InfeasibleError:  # a drive cannot hold the load: no law helps, and the checks report it
        return law
    return min(law, other, key=lambda each: each.duration)


def evenly_limited(boom: Boom, path: Path, base: BaseMotion | None = None) -> tuple[TimeLaw, float]:
    """Return the law of ruckig, and the factor by which it is slowed.

    One law s(t) for all joints, its limits the least of limit / |p'| over joints and path, slowed
    evenly where the path's curvature or a drive asks for it.

    Raises:
        InfeasibleError: ruckig found no law; carries its result.
    """
    unit = cubic(boom, path, base).duration  # solved in units of the cubic's duration: ruckig fails on very large limits
    velocity, acceleration, jerk = (limit * unit**power for power, limit in enumerate(path_limits(boom, path), start=1))
    problem = InputParameter(1)
    problem.current_position, problem.target_position = [0.0], [1.0]
    problem.max_velocity, problem.max_acceleration, problem.max_jerk = [velocity], [acceleration], [jerk]
    solver, solution = Ruckig(1), Trajectory(1)
    try:
        result = solver.calculate(problem, solution)
    except RuckigError as error:
        raise InfeasibleError(f"no jerk-limited motion: {' '.join(str(error).split())[:100]}") from None
    if result != Result.Working:  # ruckig's name for success offline
        raise InfeasibleError(f"no jerk-limited motion: ruckig answers {result.name}")
    law = TimeLaw.from_pieces(*pieces(solution.profiles[0][0]), jerk_limited=True).stretched(unit)
    slowed = max(1.0, least_stretch(boom, path, law, base), jerk_stretch(boom, path, law))
    return law.stretched(slowed), slowed
