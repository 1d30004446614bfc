"""Cubic polynomials in time through waypoints, from rest to rest.

They are eqs. 2.72-2.78 of the thesis, with a waypoint between.
"""

from collections.abc import Callable

import numpy as np

from boom_model import JOINTS, BaseMotion, Boom, InfeasibleError, inverse_dynamics
from boom_model.arrays import Array
from planner.paths.path import SplinePath, overshoot, spaced
from planner.timing.path_limits import least_stretch, load_ratio
from planner.timing.roots import just_kept
from planner.timing.time_law import Motion, TimeLaw

_EVALUATIONS = 60  # of the search, a segment
_MOST_EVALUATIONS = 600
_COARSE, _FINE = 501, 8001
_SPREAD = 0.3
_TRIES = 240  # durations of a segment that are tried
_LOOKS = 129


def cubic_through(boom: Boom, waypoints: Array, base: BaseMotion | None = None) -> Motion:
    """Find a cubic spline in time through waypoints (n, 5), from rest to rest.

    Its acceleration is continuous.

    The durations between waypoints are those of the shortest such motion within the limits of
    joints and drives, as the simplex search of Nelder and Mead finds it (Lin, Chang and Luh, IEEE
    Trans. Automatic Control 28, 1983): a good one, not provably the best. Where the spline
    overshoots a position limit its velocities at the waypoints are PCHIP's instead, and the
    acceleration jumps there.

    Raises:
        InfeasibleError: the motion would leave the position limits.
    """
    from scipy.interpolate import CubicHermiteSpline, CubicSpline, PchipInterpolator
    from scipy.optimize import minimize

    def smooth(knots: Array) -> SplinePath:
        return SplinePath(CubicSpline(knots, waypoints, bc_type="clamped"), waypoints)

    def tight(knots: Array) -> SplinePath:
        slopes = np.asarray(PchipInterpolator(knots, waypoints)(knots, 1))
        slopes[[0, -1]] = 0.0
        return SplinePath(CubicHermiteSpline(knots, waypoints, slopes), waypoints)

    first = np.log(np.diff(spaced(boom, waypoints)))
    simplex = np.vstack([first, first + _SPREAD * np.eye(len(first))])[:, :-1] - first[-1]  # only the proportions count

    def shortest(spline: Callable[[Array], SplinePath]) -> Motion:
        def duration(shares: Array) -> float:
            return least_stretch(boom, spline(_knots(shares)), _evenly(), base, _COARSE)

        budget = min(_EVALUATIONS * len(first), _MOST_EVALUATIONS)
        options = {"initial_simplex": simplex[:-1], "maxfev": budget, "xatol": 1e-3, "fatol": 1e-4}
        found = minimize(duration, simplex[0], method="Nelder-Mead", options=options)  # type: ignore[call-overload]
        path = spline(_knots(found.x))
        return Motion(path, _evenly().stretched(least_stretch(boom, path, _evenly(), base, _FINE)))

    motion = shortest(smooth)
    if overshoot(boom, motion.path) is not None:
        motion = shortest(tight)
    beyond = overshoot(boom, motion.path)
    if beyond is not None:
        raise InfeasibleError(f"the cubics through the waypoints leave the limits {beyond}; stop at one of them instead")
    return motion


def cubic_with_velocities(
    boom: Boom, waypoints: Array, velocities: Array, duration: float | None = None, base: BaseMotion | None = None
) -> Motion:
    """Time a cubic per segment of waypoints (n, 5), with inner `velocities` (n - 2, 5).

    Each segment takes the least duration that keeps the limits of joints and drives; the
    acceleration jumps at the waypoints. A longer `duration` lengthens all segments alike and leaves
    the velocities.

    Raises:
        InfeasibleError: no duration of a segment keeps the limits (which segment, and the joint
            that comes nearest), the duration is too short, or the motion leaves the position
            limits.
    """
    from scipy.interpolate import CubicHermiteSpline

    still = np.zeros((1, 5))
    slopes = np.concatenate([still, velocities, still])
    lengths = np.array(
        [_least_segment(boom, k, waypoints[k : k + 2], slopes[k : k + 2], base) for k in range(len(waypoints) - 1)]
    )
    least = float(lengths.sum())
    if duration is not None:
        if duration < least:
            raise InfeasibleError(
                f"duration {duration:g} s is too short: with these velocities the cubics need at least {least:.6g} s, in which "
                "each segment already takes a joint or a drive to its limit"
            )
        lengths *= duration / least
    total = float(lengths.sum())
    knots = np.append(0.0, np.cumsum(lengths)) / total
    path = SplinePath(CubicHermiteSpline(knots, waypoints, slopes * total), waypoints)
    beyond = overshoot(boom, path)
    if beyond is not None:
        raise InfeasibleError(f"with these velocities the cubics leave the limits {beyond}")
    return Motion(path, _evenly().stretched(total))


def _evenly() -> TimeLaw:
    return TimeLaw.from_pieces([1.0], [[1.0], [0.0]])


def _knots(shares: Array) -> Array:
    lengths = np.exp(np.append(shares, 0.0))
    knots: Array = np.append(0.0, np.cumsum(lengths)) / lengths.sum()
    knots[-1] = 1.0
    return knots


def _least_segment(boom: Boom, segment: int, q: Array, qd: Array, base: BaseMotion | None) -> float:
    """Return the shortest duration [s] within the limits of a cubic between two states q, qd."""
    tau = np.linspace(0.0, 1.0, _LOOKS)[:, None]
    rise, slope = tau**2 * (3.0 - 2.0 * tau), 6.0 * tau * (1.0 - tau)
    bend = 6.0 - 12.0 * tau

    def ratio(lengths: Array) -> Array:
        h = lengths[:, None, None]
        leave, arrive = qd[0], qd[1]
        at = q[0] + (q[1] - q[0]) * rise + h * (leave * tau * (1.0 - tau) ** 2 - arrive * tau**2 * (1.0 - tau))
        speed = (q[1] - q[0]) / h * slope + leave * (1.0 - tau) * (1.0 - 3.0 * tau) + arrive * tau * (3.0 * tau - 2.0)
        rate = (q[1] - q[0]) / h**2 * bend + (leave * (6.0 * tau - 4.0) + arrive * (6.0 * tau - 2.0)) / h
        loads = inverse_dynamics(boom, at, speed, rate, base=base, friction=True, reactions=False).tau
        kinematic = np.maximum(np.abs(speed) / boom.limits.velocity, np.abs(rate) / boom.limits.acceleration)
        worst: Array = np.maximum(kinematic, load_ratio(boom, loads, speed, rate)).max(axis=1)
        return worst

    scale = float((np.abs(q[1] - q[0]) / boom.limits.velocity + np.abs(qd).max(axis=0) / boom.limits.acceleration).max())
    tried = scale * np.geomspace(0.1, 1e3, _TRIES)
    ratios = ratio(tried)
    good = (ratios <= 1.0).all(axis=-1)
    if not good.any():
        nearest = ratios[int(np.argmin(ratios.max(axis=-1)))]
        worst = int(np.argmax(nearest))
        raise InfeasibleError(
            f"no cubic between waypoints {segment} and {segment + 1} keeps the limits with these velocities: joint "
            f"{JOINTS[worst]} comes nearest with {nearest[worst]:.3g} times what velocity, acceleration or drive allow"
        )
    first = int(np.argmax(good))
    if first == 0:
        return float(tried[0])
    return just_kept(lambda length: float(ratio(np.array([length])).max()) - 1.0, float(tried[first - 1]), float(tried[first]))
