"""The limits of the joints and of their drives along a path, as conditions on its speed and acceleration.

On a path p(s), with u = s'' and x = s'^2, joint velocities are p' s', accelerations p' u + p'' x and torques

    a u + b x + c,   c = tau(p, 0, 0),   a = tau(p, 0, p') - c,   b = tau(p, p', p'') - c,

the torque being the one that the drive's output must give, its reflected inertia included. A drive's limit falls with its
speed, that is with x.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from boom_model import JOINTS, Boom, InfeasibleError, forward_kinematics, inverse_dynamics
from boom_model.arrays import Array
from boom_model.base_motion import BaseMotion
from boom_model.drives import drive_inertia, drive_torque_limit
from planner.path import Path
from planner.time_law import TimeLaw

_LEAST_STRETCH_STEPS = 60


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
    """(n, 5) torque per u, at the drive's output"""
    b: Array
    """(n, 5) torque per x"""
    c: Array
    """(n, 5) static torque"""

    @property
    def x_max(self) -> Array:
        """(n,) the bound that the joint velocities set on x."""
        with np.errstate(divide="ignore"):
            bound: Array = np.min((self.boom.limits.velocity / np.abs(self.p1)) ** 2, axis=-1)
        return bound

    def torque_ratio(self, u: Array, x: Array) -> Array:
        """(n, 5) |torque| over the drive's limit at the joint's speed, at u and x (n,); 0 where no drive limits."""
        torque = np.abs(self.a * u[:, None] + self.b * x[:, None] + self.c)
        limit = drive_limits(self.boom, self.p1 * np.sqrt(x)[:, None])
        return np.divide(torque, limit, out=np.full_like(torque, np.inf), where=limit > 0.0)

    @property
    def static_ratio(self) -> Array:
        """(n, 5) `torque_ratio` of merely holding the load."""
        still = np.zeros_like(self.s)
        return self.torque_ratio(still, still)


def drive_limits(boom: Boom, speed: ArrayLike) -> Array:
    """`drive_torque_limit` of every joint at joint speeds (..., 5), likewise shaped; infinite where no drive limits."""
    speed = np.asarray(speed, dtype=float)
    limits = np.full_like(speed, np.inf)
    for i, drive in enumerate(boom.drives):
        limit = None if drive is None else drive_torque_limit(drive, speed[..., i])
        if limit is not None:
            limits[..., i] = limit
    return limits


def path_dynamics(boom: Boom, path: Path, s: Array, base: BaseMotion | None = None) -> PathDynamics:
    """The path's demands at s (n,) on a base that is tilted at most, with all the dynamics in one batch."""
    p, p1, p2 = (path(s, order) for order in range(3))
    zero = np.zeros_like(p)
    states = [p, p, p], [zero, zero, p1], [zero, p1, p2]
    static, pushed, carried = inverse_dynamics(boom, *states, base=base, reactions=False).tau
    inertia = np.array([drive_inertia(drive) if drive else 0.0 for drive in boom.drives])
    a, b = pushed - static + inertia * p1, carried - static + inertia * p2
    return PathDynamics(boom, path, s, p1, p2, a, b, static)


def least_stretch(boom: Boom, path: Path, law: TimeLaw, base: BaseMotion | None = None, samples: int = 2001) -> float:
    """The factor by which a law must be slowed (or may be hastened, below 1) to keep the limits along its path.

    Slowed by k, a law's u and x fall as 1/k^2: the joint limits give k at once, the drives' by bisection above it. A load
    that a drive cannot even hold is left out, because no slowness mends it.
    """
    t = np.linspace(0.0, law.duration, samples)
    demands = path_dynamics(boom, path, np.clip(np.asarray(law.s(t)), 0.0, 1.0), base)
    x, u = np.asarray(law.s(t, 1)) ** 2, np.asarray(law.s(t, 2))
    acceleration = np.abs(demands.p1 * u[:, None] + demands.p2 * x[:, None]) / boom.limits.acceleration
    least = float(np.sqrt(max(acceleration.max(), (x / demands.x_max).max())))
    mendable = demands.static_ratio < 1.0

    def kept(k: float) -> bool:
        return bool((demands.torque_ratio(u / k**2, x / k**2)[mendable] <= 1.0).all())

    if kept(least):
        return least
    slow = 2.0 * least
    while not kept(slow):
        slow *= 2.0
    fast = slow / 2.0
    for _ in range(_LEAST_STRETCH_STEPS):
        middle = (fast + slow) / 2.0
        fast, slow = (fast, middle) if kept(middle) else (middle, slow)
    return slow


def explain_infeasible(demands: PathDynamics) -> InfeasiblePathError:
    """The reason why a path has no time law: the drive nearest to its limit, or beyond it, while it merely holds the load."""
    ratio = demands.static_ratio
    at, worst = np.unravel_index(int(np.argmax(ratio)), ratio.shape)
    joint, s, demand = JOINTS[worst], float(demands.s[at]), float(abs(demands.c[at, worst]))
    limit = float(drive_limits(demands.boom, np.zeros(5))[worst])
    tip = ", ".join(f"{x:.3f}" for x in forward_kinematics(demands.boom, demands.path(s)).position)
    if demand > limit:
        why = f"joint {joint} needs {demand:.1f} Nm only to hold its load there, and its drive allows {limit:.1f} Nm"
    else:
        why = (
            f"the solver finds no speed that keeps every limit; joint {joint} comes nearest to one there, with {demand:.1f} Nm "
            f"to hold its load of the {limit:.1f} Nm that its drive allows"
        )
    message = f"no time-optimal motion: at {s:.1%} of the path (tip {tip} m) {why}"
    return InfeasiblePathError(message, joint, s, demand, limit)
