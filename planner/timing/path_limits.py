"""Joint and drive limits along a path, as conditions on the speed and acceleration of the path.

On a path p(s), with u = s'' and x = s'^2, the joint velocities are p' s', the joint accelerations
p' u + p'' x, and the joint torques without friction

    a u + b x + c,   c = tau(p, 0, 0),   a = tau(p, 0, p') - c,   b = tau(p, p', p'') - c.

The gearbox transmits this torque plus friction. The motor also accelerates its own inertia, and its
limit decreases with its speed, and so with x.
"""

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import numpy as np

from boom_model import JOINTS, Boom, InfeasibleError, breakdown, forward_kinematics, inverse_dynamics
from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH
from boom_model.drives.limits import gear_limits, motor_limits, rotors, static_limits
from boom_model.dynamics.base_motion import BaseMotion
from planner.paths.path import JointLine, Path
from planner.timing.roots import just_kept
from planner.timing.time_law import Motion, TimeLaw

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

_FINITE = 1e12
_LEAST_SHARE = 1e-6
_SLOPES = 20_001
_BETWEEN = 20
_ROUNDING = 1e-9
_LOAD_INTERVALS = 500
_LOOKS, _CURVED_LOOKS = 2001, 10_001


class InfeasiblePathError(InfeasibleError):
    """No time law travels a path within the limits; names drive, place, demand and limit."""

    def __init__(self, message: str, joint: str, s: float, demand: float, limit: float) -> None:
        """Keep the joint, the place s on the path, the demand and the limit [Nm]."""
        super().__init__(message)
        self.joint, self.s, self.demand, self.limit = joint, s, demand, limit


@dataclass(frozen=True, eq=False)
class PathDynamics:
    """Terms of the joint torques at points s (n,) of a path."""

    boom: Boom
    path: Path
    s: Array
    p1: Array
    """(n, 5) p'"""
    p2: Array
    """(n, 5) p''"""
    a: Array
    """(n, 5) joint torque per u"""
    b: Array
    """(n, 5) joint torque per x"""
    c: Array
    """(n, 5) static torque"""
    coulomb: Array
    """(n, 5) Coulomb friction, in the direction of the path"""
    viscous: Array
    """(n, 5) viscous friction per s'"""
    base: BaseMotion | None
    cap: Array
    """(n,) bound on x, in addition to that from the joint velocities"""

    def at(self, points: Array) -> "PathDynamics":
        """Return the terms at the points with these indices."""
        names = ("s", "p1", "p2", "a", "b", "c", "coulomb", "viscous", "cap")
        return replace(self, **{name: getattr(self, name)[points] for name in names})

    @property
    def x_max(self) -> Array:
        """(n,) largest x that the velocity limits and the cap allow."""
        return np.minimum(_largest_x(self.boom, self.p1), self.cap)

    def friction_tangent(self, x: Array) -> tuple[Array, Array]:
        """Return intercept and slope over x, each (n, 5), of a line above joint friction.

        Friction is coulomb + viscous sqrt(x), and the line is its tangent at x (n,). The two ends
        use the x of the point next to them. Where that is 0, the largest x that the velocity limits
        allow replaces it.
        """
        if not self.viscous.any():
            return self.coulomb, np.zeros_like(self.coulomb)
        largest = np.minimum(self.x_max, _FINITE)
        x = np.concatenate([x[1:2], x[1:-1], x[-2:-1]])
        root = np.sqrt(np.where(x > 0.0, np.clip(x, _LEAST_SHARE * largest, None), largest))[:, None]
        half = self.viscous / 2.0
        return self.coulomb + half * root, half / root

    @property
    def static_ratio(self) -> Array:
        """(n, 5) static torque divided by the limit of motor and gearbox at rest."""
        held: Array = np.abs(self.c) / static_limits(self.boom)
        return held


def gear_ratio(boom: Boom, tau: Array) -> Array:
    """Return the ratio of joint torques (..., 5) to the start-stop torque of the gearboxes.

    The ratio is 0 where that torque is unknown.
    """
    ratio: Array = np.abs(tau) / gear_limits(boom)
    return ratio


def motor_ratio(boom: Boom, tau: Array, qd: Array, qdd: Array) -> Array:
    """Return the ratio (..., 5) of motor torque to `motor_limits` at the motor's speed.

    Motor torque is joint torque plus the torque that accelerates the inertia of the drive, both at
    the joint. The ratio is 0 for a joint without a motor limit.
    """
    limits = motor_limits(boom, qd)
    driven = np.abs(tau + rotors(boom) * qdd)
    if (limits > 0.0).all():
        ratio: Array = driven / limits
        return ratio
    return np.divide(driven, limits, out=np.full_like(driven, np.inf), where=limits > 0.0)


def load_ratio(boom: Boom, tau: Array, qd: Array, qdd: Array) -> Array:
    """Return the larger of `gear_ratio` and `motor_ratio`, (..., 5)."""
    return np.maximum(gear_ratio(boom, tau), motor_ratio(boom, tau, qd, qdd))


def limited_by_drives(boom: Boom) -> bool:
    """Return whether any gearbox or motor has a torque limit."""
    return bool(np.isfinite(static_limits(boom)).any())


def path_dynamics(boom: Boom, path: Path, s: Array, base: BaseMotion | None = None) -> PathDynamics:
    """Return the torque terms of a path at s (n,), from one batch of inverse dynamics.

    Args:
        boom: the boom.
        path: the path.
        s: places on the path, (n,).
        base: tilt of the base, which must not move; None is level.
    """
    p, p1, p2 = (path(s, order) for order in range(3))
    zero = np.zeros_like(p)
    states = [p, p, p], [zero, zero, p1], [zero, p1, p2]
    static, pushed, carried = inverse_dynamics(boom, *states, base=base, reactions=False).tau
    coulomb, viscous = boom.friction.dry(np.sign(p1)), boom.friction.viscous * p1
    cap = np.full(len(s), np.inf)
    return PathDynamics(boom, path, s, p1, p2, pushed - static, carried - static, static, coulomb, viscous, base, cap)


def _largest_x(boom: Boom, p1: Array) -> Array:
    with np.errstate(divide="ignore"):
        bound: Array = np.min((boom.limits.velocity / np.abs(p1)) ** 2, axis=-1)
    return bound


def demand_ratios(boom: Boom, path: Path, law: TimeLaw, t: Array, base: BaseMotion | None = None) -> tuple[Array, Array]:
    """Return the largest ratios, each (n,), to acceleration limits and to drive limits.

    They are those of a law at times t (n,).
    """
    q, p1, qd, qdd = _along(path, law, t)
    tau = inverse_dynamics(boom, q, qd, qdd, base=base, reactions=False).tau
    drives = _drive_ratio(boom, tau, qd, qdd, boom.friction.dry(np.sign(p1)))
    return (np.abs(qdd) / boom.limits.acceleration).max(axis=1), drives.max(axis=1)


def _along(path: Path, law: TimeLaw, t: Array) -> tuple[Array, Array, Array, Array]:
    """Return q, p', qd and qdd (n, 5) of a law at times t (n,), joint by joint in memory."""
    s, v, u = law.s.derivatives(t, 2)
    s = np.clip(s, 0.0, 1.0)
    q, p1, p2 = (path(s, order).T for order in range(3))
    return q.T, p1.T, (p1 * v).T, (p1 * u + p2 * v**2).T


def least_stretch(boom: Boom, path: Path, law: TimeLaw, base: BaseMotion | None = None, samples: int = _LOOKS) -> float:
    """Return the smallest factor on the duration of a law with which it respects the limits.

    A factor below 1 means that the law can be faster. A law slowed by k has 1/k of the velocities
    and 1/k^2 of the accelerations, so k for the joint limits is explicit. The drive limits may need
    a larger k, which is found as a root. If a drive cannot even hold the static load somewhere,
    slowing does not help, and the result is k for the joint limits.
    """
    q, p1, qd, qdd = _along(path, law, Motion(path, law).times(samples))
    least = _joint_stretch(boom, qd, qdd)
    if not limited_by_drives(boom):
        return least
    dynamic = inverse_dynamics(boom, q, qd / least, qdd / least**2, base=base, reactions=False).tau
    rubbing = boom.friction.dry(np.sign(p1))
    if (_drive_ratio(boom, dynamic, qd / least, qdd / least**2, rubbing) <= 1.0).all():
        return least
    zero = np.zeros_like(q)
    static = inverse_dynamics(boom, q, zero, zero, base=base, reactions=False).tau
    return _drive_stretch(boom, least, qd, qdd, static, (dynamic - static) * least**2, rubbing)


@dataclass(frozen=True, eq=False)
class PathLoads:
    """Torques a u + b x + c of a path, interpolated along it for a search that needs them often.

    The interpolation is linear, because the terms can jump at a waypoint, where a smoother
    interpolant overshoots.
    """

    boom: Boom
    path: Path
    torques: "BSpline"
    """function of s with values (3, 5): a, b and c"""

    @staticmethod
    def along(boom: Boom, path: Path, base: BaseMotion | None = None) -> "PathLoads":
        """Return the loads of a path. `base` may be tilted, but must not move."""
        from scipy.interpolate import make_interp_spline

        s = spread(path, _LOAD_INTERVALS)
        demands = path_dynamics(boom, path, s, base)
        return PathLoads(boom, path, make_interp_spline(s, np.stack([demands.a, demands.b, demands.c], axis=1), k=1))

    def stretch(self, law: TimeLaw, t: Array, floor: float) -> float:
        """Return the smallest factor >= `floor` with which a law respects the limits at t (n,)."""
        s, v, u = law.s.derivatives(t, 2)
        s, v, u = np.clip(s, 0.0, 1.0), v[:, None], u[:, None]
        p1 = self.path(s, 1)
        qd, qdd = p1 * v, p1 * u + self.path(s, 2) * v**2
        least = max(floor, _joint_stretch(self.boom, qd, qdd))
        if not limited_by_drives(self.boom):
            return least
        a, b, c = np.moveaxis(self.torques(s), 1, 0)
        rubbing = self.boom.friction.dry(np.sign(p1))
        return _drive_stretch(self.boom, least, qd, qdd, c, a * u + b * v**2, rubbing)


def _joint_stretch(boom: Boom, qd: Array, qdd: Array) -> float:
    limits = boom.limits
    return float(max((np.abs(qd) / limits.velocity).max(), np.sqrt((np.abs(qdd) / limits.acceleration).max())))


def _drive_ratio(boom: Boom, tau: Array, qd: Array, qdd: Array, rubbing: Array) -> Array:
    """Return the largest drive ratio (n, 5) of `load_ratio`, without friction and with it.

    Both count, so that friction is no help while braking.

    Args:
        boom: the boom.
        tau: torques without friction, (n, 5).
        qd: joint velocities, (n, 5).
        qdd: joint accelerations, (n, 5).
        rubbing: Coulomb friction, (n, 5).
    """
    ratio, viscous = load_ratio(boom, tau, qd, qdd), boom.friction.viscous
    if not (rubbing.any() or viscous.any()):
        return ratio
    return np.maximum(ratio, load_ratio(boom, tau + rubbing + viscous * qd, qd, qdd))


def _drive_stretch(boom: Boom, least: float, qd: Array, qdd: Array, static: Array, dynamic: Array, rubbing: Array) -> float:
    """Return the smallest factor k >= `least` with which a law respects the drive limits.

    Its torques are static + dynamic / k^2 + friction. Return `least` if a drive cannot even hold
    the static load.
    """
    zero = np.zeros_like(qd)
    if (_drive_ratio(boom, static, zero, zero, rubbing) >= 1.0).any():
        return least

    def excess(k: float) -> float:
        return float(_drive_ratio(boom, static + dynamic / k**2, qd / k, qdd / k**2, rubbing).max()) - 1.0

    if excess(least) <= 0.0:
        return least
    slow = 2.0 * least
    while excess(slow) > 0.0:
        slow *= 2.0
    return just_kept(excess, slow / 2.0, slow)


def peak_rate_ratios(boom: Boom, motion: Motion, t: Array) -> tuple[float, float, float]:
    """Return the largest ratios of joint velocity, acceleration, jerk to their limits at t (n,)."""
    limits = boom.limits
    if isinstance(motion.path, JointLine):  # the largest rates of the law decide
        peaks = (float(np.abs(rate).max()) for rate in motion.law.s.derivatives(t, 3)[1:])
        velocity, acceleration, jerk = (peak / limit for peak, limit in zip(peaks, path_limits(boom, motion.path), strict=True))
        return velocity, acceleration, jerk
    _, *rates = motion(t)
    velocity, acceleration, jerk = (
        float((np.abs(rate) / limit).max())
        for rate, limit in zip(rates, (limits.velocity, limits.acceleration, limits.jerk), strict=True)
    )
    return velocity, acceleration, jerk


def jerk_stretch(boom: Boom, path: Path, law: TimeLaw, samples: int = 20_001) -> float:
    """Return the smallest factor on the duration of a law with which it respects the jerk limits.

    A factor below 1 means that the law can be faster.
    """
    motion = Motion(path, law)
    return float(np.cbrt(peak_rate_ratios(boom, motion, motion.times(samples))[2]))


def looks(path: Path) -> int:
    """Return the number of points at which a planner tests a motion along a path."""
    return _LOOKS if isinstance(path, JointLine) else _CURVED_LOOKS


def spread(path: Path, intervals: int) -> Array:
    """Return places s from 0 to 1 with steps of at most 1 / intervals.

    They include the knots of the path, with at least `_BETWEEN` steps between two knots.
    """
    edges = np.concatenate([[0.0], path.knots, [1.0]])
    steps = np.maximum(np.ceil(np.diff(edges) * intervals - _ROUNDING), _BETWEEN if len(path.knots) else 1).astype(int)
    return np.unique(np.concatenate([np.linspace(a, b, n + 1) for a, b, n in zip(edges[:-1], edges[1:], steps, strict=True)]))


def path_limits(boom: Boom, path: Path) -> tuple[float, float, float]:
    """Return the smallest limit / |p'| over joints and path, for velocity, acceleration and jerk.

    On a straight path these are the limits on the first, second and third time derivative of s.
    """
    points = np.linspace(0.0, 1.0, 1 if isinstance(path, JointLine) else _SLOPES)
    step = np.abs(path(points, 1)).max(axis=0)
    limits = boom.limits
    with np.errstate(divide="ignore"):
        velocity, acceleration, jerk = (
            float(np.min(limit / step)) for limit in (limits.velocity, limits.acceleration, limits.jerk)
        )
    return velocity, acceleration, jerk


def shares(boom: Boom, q: Array, qd: Array, qdd: Array, joint: int, base: BaseMotion | None) -> str:
    """Return the components of the torque of a joint at one state (5,) as text."""
    parts = breakdown(boom, q, qd, qdd, base=base, friction=True)
    unit = "N" if IS_LENGTH[joint] else "Nm"
    named = {field.name: float(getattr(parts, field.name)[joint]) for field in fields(parts)}
    named["drive inertia, at the motor"] = float(rotors(boom)[joint] * qdd[joint])
    return ", ".join(f"{name} {value:.1f} {unit}" for name, value in named.items() if abs(value) >= 0.05)


def explain_infeasible(demands: PathDynamics) -> InfeasiblePathError:
    """Return the error for a path without a time law.

    It names the drive with the largest ratio of static torque to its limit.
    """
    ratio = demands.static_ratio
    at, worst = np.unravel_index(int(np.argmax(ratio)), ratio.shape)
    joint, s, demand = JOINTS[worst], float(demands.s[at]), float(abs(demands.c[at, worst]))
    limit = float(static_limits(demands.boom)[worst])
    q = demands.path(s)
    tip = ", ".join(f"{x:.3f}" for x in forward_kinematics(demands.boom, q).position)
    if demand > limit:
        parts = shares(demands.boom, q, np.zeros(5), np.zeros(5), int(worst), demands.base)
        why = f"joint {joint} needs {demand:.1f} Nm only to hold its load there ({parts}), and its drive allows {limit:.1f} Nm"
    else:
        why = (
            f"the solver finds no speed within every limit; joint {joint} is nearest to its drive limit there: it needs "
            f"{demand:.1f} Nm to hold its load, and its drive allows {limit:.1f} Nm"
        )
    message = f"no time-optimal motion: at {s:.1%} of the path (tip {tip} m) {why}"
    return InfeasiblePathError(message, joint, s, demand, limit)
