"""The limits of the joints and of their drives along a path, as conditions on its speed and acceleration.

On a path p(s), with u = s'' and x = s'^2, joint velocities are p' s', accelerations p' u + p'' x and torques

    a u + b x + c,   c = tau(p, 0, 0),   a = tau(p, 0, p') - c,   b = tau(p, p', p'') - c,

to which friction adds. The gearbox bears this torque; the motor accelerates its own inertia besides, and its limit falls with
its speed, that is with x.
"""

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike

from boom_model import JOINTS, Boom, InfeasibleError, breakdown, forward_kinematics, inverse_dynamics
from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH
from boom_model.drives.drive import drive_inertia, motor_limit
from boom_model.dynamics.base_motion import BaseMotion
from planner.paths.path import JointLine, Path
from planner.timing.time_law import Motion, TimeLaw

_LEAST_STRETCH_STEPS = 60
_FINITE = 1e12
_LEAST_SHARE = 1e-6
_SLOPES = 20_001
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

    def at(self, points: Array) -> "PathDynamics":
        """The same at some of the points, by their numbers."""
        names = ("s", "p1", "p2", "a", "b", "c", "coulomb", "viscous")
        return replace(self, **{name: getattr(self, name)[points] for name in names})

    @property
    def x_max(self) -> Array:
        """(n,) the bound that the joint velocities set on x."""
        return _largest_x(self.boom, self.p1)

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

    def torque_ratio(self, u: Array, x: Array) -> Array:
        """(n, 5) the larger of gearbox and motor torque over their limits, at u and x (n,); 0 where no drive limits.

        With friction and without: it earns no credit while braking.
        """
        u, x = u[:, None], x[:, None]
        smooth = self.a * u + self.b * x + self.c
        qd, qdd = self.p1 * np.sqrt(x), self.p1 * u + self.p2 * x
        rubbed = smooth + self.coulomb + self.viscous * np.sqrt(x)
        return np.maximum(load_ratio(self.boom, smooth, qd, qdd), load_ratio(self.boom, rubbed, qd, qdd))

    @property
    def static_ratio(self) -> Array:
        """(n, 5) of merely holding the load, over what motor and gearbox allow at rest."""
        held: Array = np.abs(self.c) / static_limits(self.boom)
        return held


def rotors(boom: Boom) -> Array:
    """(5,) what the drives' own inertia adds to the motors' share, eta N^2 (J_rotor + J_gear) [kg m^2]."""
    return np.array([drive_inertia(drive) if drive else 0.0 for drive in boom.drives])


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


def gear_limits(boom: Boom) -> Array:
    """(5,) start-stop torque of the gearboxes [Nm]; infinite where none is given."""
    limits = [None if drive is None else drive.gearbox.start_stop_torque for drive in boom.drives]
    return np.array([np.inf if limit is None else limit for limit in limits])


def motor_limits(boom: Boom, speed: ArrayLike) -> Array:
    """`motor_limit` of every joint at joint speeds (..., 5), likewise shaped; infinite where no motor limits."""
    speed = np.asarray(speed, dtype=float)
    limits = np.full_like(speed, np.inf)
    for i, drive in enumerate(boom.drives):
        limit = None if drive is None else motor_limit(drive, speed[..., i])
        if limit is not None:
            limits[..., i] = limit
    return limits


def static_limits(boom: Boom) -> Array:
    """(5,) torque that motor and gearbox allow at rest [Nm]; infinite where no drive limits."""
    return np.minimum(gear_limits(boom), motor_limits(boom, np.zeros(5)))


def path_dynamics(boom: Boom, path: Path, s: Array, base: BaseMotion | None = None) -> PathDynamics:
    """The path's demands at s (n,) on a base that is tilted at most, with all the dynamics in one batch."""
    p, p1, p2 = (path(s, order) for order in range(3))
    zero = np.zeros_like(p)
    states = [p, p, p], [zero, zero, p1], [zero, p1, p2]
    static, pushed, carried = inverse_dynamics(boom, *states, base=base, reactions=False).tau
    coulomb, viscous = boom.friction.coulomb * np.sign(p1), boom.friction.viscous * p1
    return PathDynamics(boom, path, s, p1, p2, pushed - static, carried - static, static, coulomb, viscous, base)


def _largest_x(boom: Boom, p1: Array) -> Array:
    with np.errstate(divide="ignore"):
        bound: Array = np.min((boom.limits.velocity / np.abs(p1)) ** 2, axis=-1)
    return bound


def least_stretch(boom: Boom, path: Path, law: TimeLaw, base: BaseMotion | None = None, samples: int = _LOOKS) -> float:
    """The factor by which a law must be slowed (or may be hastened, below 1) to keep the limits along its path.

    Slowed by k, a law's u and x fall as 1/k^2: the joint limits give k at once, the drives' by bisection above it. Where a
    drive cannot even hold the load somewhere no slowness mends the move, and the joint limits alone decide.
    """
    t = Motion(path, law).times(samples)
    demands = path_dynamics(boom, path, np.clip(np.asarray(law.s(t)), 0.0, 1.0), base)
    x, u = np.asarray(law.s(t, 1)) ** 2, np.asarray(law.s(t, 2))
    acceleration = np.abs(demands.p1 * u[:, None] + demands.p2 * x[:, None]) / boom.limits.acceleration
    least = float(np.sqrt(max(acceleration.max(), (x / demands.x_max).max())))
    at_rest = np.abs(demands.torque_ratio(np.zeros_like(u), np.zeros_like(x))).max()

    def kept(k: float) -> bool:
        return bool((demands.torque_ratio(u / k**2, x / k**2) <= 1.0).all())

    if at_rest >= 1.0 or kept(least):
        return least
    slow = 2.0 * least
    while not kept(slow):
        slow *= 2.0
    fast = slow / 2.0
    for _ in range(_LEAST_STRETCH_STEPS):
        middle = (fast + slow) / 2.0
        fast, slow = (fast, middle) if kept(middle) else (middle, slow)
    return slow


def jerk_stretch(boom: Boom, path: Path, law: TimeLaw, samples: int = 20_001) -> float:
    """The factor by which a law must be slowed to keep the joints' jerk limits; below 1 where it may be hastened."""
    motion = Motion(path, law)
    _, _, _, qddd = motion(motion.times(samples))
    return float(np.cbrt((np.abs(qddd) / boom.limits.jerk).max()))


def looks(path: Path) -> int:
    """Points at which a planner looks at a motion along a path before it is certified."""
    return _LOOKS if isinstance(path, JointLine) else _CURVED_LOOKS


def path_limits(boom: Boom, path: Path) -> tuple[float, float, float]:
    """The least of limit / |p'| over joints and path, for velocity, acceleration and jerk.

    On a straight path they bound the first, second and third time derivative of s.
    """
    step = np.abs(path(np.linspace(0.0, 1.0, _SLOPES), 1)).max(axis=0)
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
