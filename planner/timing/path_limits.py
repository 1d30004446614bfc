"""The limits of the joints and of their drives along a path, as conditions on its speed and acceleration.

On a path p(s), with u = s'' and x = s'^2, joint velocities are p' s', accelerations p' u + p'' x and torques

    a u + b x + c,   c = tau(p, 0, 0),   a = tau(p, 0, p') - c,   b = tau(p, p', p'') - c,

to which friction adds. The gearbox bears this torque; the motor accelerates its own inertia besides, and its limit falls with
its speed, that is with x.
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
    """A path that no time law can travel within the limits: the drive that fails, where, and by how much."""

    def __init__(self, message: str, joint: str, s: float, demand: float, limit: float) -> None:
        super().__init__(message)
        self.joint, self.s, self.demand, self.limit = joint, s, demand, limit


@dataclass(frozen=True, eq=False)
class PathDynamics:
    """What a path asks of the joints at points s (n,)."""

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
    """(n,) a bound on x besides the joint velocities'"""

    def at(self, points: Array) -> "PathDynamics":
        """The same at some of the points, by their numbers."""
        names = ("s", "p1", "p2", "a", "b", "c", "coulomb", "viscous", "cap")
        return replace(self, **{name: getattr(self, name)[points] for name in names})

    @property
    def x_max(self) -> Array:
        """(n,) the largest x that the joint velocities and the cap allow."""
        return np.minimum(_largest_x(self.boom, self.p1), self.cap)

    def friction_tangent(self, x: Array) -> tuple[Array, Array]:
        """(n, 5) twice: intercept and slope over x of a line that friction, coulomb + viscous sqrt(x), never exceeds.

        Its tangent at x (n,); at the ends, where x is 0, that of the point beside them, and without any x that at the largest
        one that the joint velocities allow.
        """
        largest = np.minimum(self.x_max, _FINITE)
        x = np.concatenate([x[1:2], x[1:-1], x[-2:-1]])
        root = np.sqrt(np.where(x > 0.0, np.clip(x, _LEAST_SHARE * largest, None), largest))[:, None]
        half = self.viscous / 2.0
        return self.coulomb + half * root, half / root

    @property
    def static_ratio(self) -> Array:
        """(n, 5) of merely holding the load, over what motor and gearbox allow at rest."""
        held: Array = np.abs(self.c) / static_limits(self.boom)
        return held


def gear_ratio(boom: Boom, tau: Array) -> Array:
    """Joint torques (..., 5) over the gearboxes' start-stop torque; 0 where none is given."""
    ratio: Array = np.abs(tau) / gear_limits(boom)
    return ratio


def motor_ratio(boom: Boom, tau: Array, qd: Array, qdd: Array) -> Array:
    """Joint torques (..., 5) and what the drives' own inertia adds, over `motor_limits` at that speed; 0 where none is."""
    limits = motor_limits(boom, qd)
    driven = np.abs(tau + rotors(boom) * qdd)
    return np.divide(driven, limits, out=np.full_like(driven, np.inf), where=limits > 0.0)


def load_ratio(boom: Boom, tau: Array, qd: Array, qdd: Array) -> Array:
    """(..., 5) the larger of gearbox and motor torque over their limits."""
    return np.maximum(gear_ratio(boom, tau), motor_ratio(boom, tau, qd, qdd))


def limited_by_drives(boom: Boom) -> bool:
    """Whether any gearbox or motor limits a torque."""
    return bool(np.isfinite(static_limits(boom)).any())


def path_dynamics(boom: Boom, path: Path, s: Array, base: BaseMotion | None = None) -> PathDynamics:
    """The path's demands at s (n,) on a base that is tilted at most, with all the dynamics in one batch."""
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
    """(n,) twice: the largest ratio to a joint's acceleration limit, and to a drive's, at times t (n,) of a law."""
    s, v, u = (np.asarray(law.s(t, order))[:, None] for order in range(3))
    q, p1, p2 = (path(np.clip(s[:, 0], 0.0, 1.0), order) for order in range(3))
    qd, qdd = p1 * v, p1 * u + p2 * v**2
    tau = inverse_dynamics(boom, q, qd, qdd, base=base, reactions=False).tau
    drives = _drive_ratio(boom, tau, qd, qdd, boom.friction.dry(np.sign(p1)))
    return (np.abs(qdd) / boom.limits.acceleration).max(axis=1), drives.max(axis=1)


def least_stretch(boom: Boom, path: Path, law: TimeLaw, base: BaseMotion | None = None, samples: int = _LOOKS) -> float:
    """The factor by which a law must be slowed (or may be hastened, below 1) to keep the limits along its path.

    Slowed by k, velocities fall as 1/k and accelerations as 1/k^2: the joint limits give k at once. What the drives ask for
    besides is a root above it. Where a drive cannot even hold the load somewhere no slowness mends the move, and the joint
    limits alone decide.
    """
    t = Motion(path, law).times(samples)
    s, v, u = (np.asarray(law.s(t, order))[:, None] for order in range(3))
    q, p1, p2 = (path(np.clip(s[:, 0], 0.0, 1.0), order) for order in range(3))
    qd, qdd = p1 * v, p1 * u + p2 * v**2
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
    """A path's torques a u + b x + c, interpolated along it: for a search that asks for them many times.

    Linearly: beside a waypoint they can jump, and anything smoother overshoots there.
    """

    boom: Boom
    path: Path
    torques: "BSpline"
    """s to (3, 5): a, b and c"""

    @staticmethod
    def along(boom: Boom, path: Path, base: BaseMotion | None = None) -> "PathLoads":
        """The loads of a path on a base that is tilted at most."""
        from scipy.interpolate import make_interp_spline

        s = spread(path, _LOAD_INTERVALS)
        demands = path_dynamics(boom, path, s, base)
        return PathLoads(boom, path, make_interp_spline(s, np.stack([demands.a, demands.b, demands.c], axis=1), k=1))

    def stretch(self, law: TimeLaw, t: Array, floor: float) -> float:
        """The least factor from `floor` on by which a law must be slowed to keep the limits at times t (n,)."""
        s, v, u = (np.asarray(law.s(t, order)) for order in range(3))
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
    """(n, 5) the larger of gearbox and motor torque over their limits, without friction and with it.

    Friction earns no credit while braking.

    Args:
        tau: (n, 5) torques without friction.
        rubbing: (n, 5) Coulomb friction.
    """
    ratio, viscous = load_ratio(boom, tau, qd, qdd), boom.friction.viscous
    if not (rubbing.any() or viscous.any()):
        return ratio
    return np.maximum(ratio, load_ratio(boom, tau + rubbing + viscous * qd, qd, qdd))


def _drive_stretch(boom: Boom, least: float, qd: Array, qdd: Array, static: Array, dynamic: Array, rubbing: Array) -> float:
    """The least factor from `least` on at which torques static + dynamic / k^2, and friction, keep the drives' limits.

    `least` itself where a drive cannot even hold the load.
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
    """The largest ratios of the joints' velocity, acceleration and jerk to their limits at times t (n,)."""
    limits = boom.limits
    if isinstance(motion.path, JointLine):  # the peaks of the law decide
        peaks = (float(np.abs(motion.law.s(t, order)).max()) for order in (1, 2, 3))
        velocity, acceleration, jerk = (peak / limit for peak, limit in zip(peaks, path_limits(boom, motion.path), strict=True))
        return velocity, acceleration, jerk
    _, *rates = motion(t)
    velocity, acceleration, jerk = (
        float((np.abs(rate) / limit).max())
        for rate, limit in zip(rates, (limits.velocity, limits.acceleration, limits.jerk), strict=True)
    )
    return velocity, acceleration, jerk


def jerk_stretch(boom: Boom, path: Path, law: TimeLaw, samples: int = 20_001) -> float:
    """The factor by which a law must be slowed to keep the joints' jerk limits; below 1 where it may be hastened."""
    motion = Motion(path, law)
    return float(np.cbrt(peak_rate_ratios(boom, motion, motion.times(samples))[2]))


def looks(path: Path) -> int:
    """Points at which a planner looks at a motion along a path before it is certified."""
    return _LOOKS if isinstance(path, JointLine) else _CURVED_LOOKS


def spread(path: Path, intervals: int) -> Array:
    """Places s from 0 to 1 in so many steps, and in at least `_BETWEEN` between two knots of the path, which are among them."""
    edges = np.concatenate([[0.0], path.knots, [1.0]])
    steps = np.maximum(np.ceil(np.diff(edges) * intervals - _ROUNDING), _BETWEEN if len(path.knots) else 1).astype(int)
    return np.unique(np.concatenate([np.linspace(a, b, n + 1) for a, b, n in zip(edges[:-1], edges[1:], steps, strict=True)]))


def path_limits(boom: Boom, path: Path) -> tuple[float, float, float]:
    """The least of limit / |p'| over joints and path, for velocity, acceleration and jerk.

    On a straight path they bound the first, second and third time derivative of s.
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
    """The torque of a joint at one state (5,) in parts, for people."""
    parts = breakdown(boom, q, qd, qdd, base=base, friction=True)
    unit = "N" if IS_LENGTH[joint] else "Nm"
    named = {field.name: float(getattr(parts, field.name)[joint]) for field in fields(parts)}
    named["drive inertia, at the motor"] = float(rotors(boom)[joint] * qdd[joint])
    return ", ".join(f"{name} {value:.1f} {unit}" for name, value in named.items() if abs(value) >= 0.05)


def explain_infeasible(demands: PathDynamics) -> InfeasiblePathError:
    """The reason why a path has no time law: the drive nearest to its limit, or beyond it, while it merely holds the load."""
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
            f"the solver finds no speed that keeps every limit; joint {joint} comes nearest to one there, with {demand:.1f} Nm "
            f"to hold its load of the {limit:.1f} Nm that its drive allows"
        )
    message = f"no time-optimal motion: at {s:.1%} of the path (tip {tip} m) {why}"
    return InfeasiblePathError(message, joint, s, demand, limit)
