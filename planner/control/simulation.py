"""Simulation of the rigid boom under given joint torques."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from boom_model import BaseMotion, Boom, forward_dynamics
from boom_model.arrays import Array, checked
from boom_model.errors import InfeasibleError, InputError
from planner.motion.trajectory import Trajectory

Torque = Callable[[float, Array, Array], ArrayLike]
"""Joint torques (5,) at time t [s] and state q, qd (5,)."""


def simulate(
    boom: Boom,
    q: ArrayLike,
    qd: ArrayLike,
    torque: Torque,
    t: ArrayLike,
    *,
    base: Callable[[float], BaseMotion] | None = None,
    friction: bool = False,
    drive_inertia: bool = False,
    rtol: float = 1e-9,
    atol: float = 1e-10,
) -> Trajectory:
    """Simulate the motion from a state with the explicit Runge-Kutta method of order 8.

    Position limits do not stop the motion; `check` reports whether it exceeds them.

    Args:
        boom: the boom.
        q: initial joint position (5,).
        qd: initial joint velocity (5,).
        torque: joint torque as a function of time and state.
        t: times (n,) of the samples [s]; the simulation starts at the first.
        base: motion of the vehicle as a function of time, each entry (3,); None is at rest on
            level ground.
        friction: as in `inverse_dynamics`.
        drive_inertia: as in `inverse_dynamics`.
        rtol: relative tolerance of the integrator on q and qd.
        atol: absolute tolerance of the integrator on q and qd.

    Raises:
        InputError: an input is not finite or has the wrong shape, or the times do not increase.
        InfeasibleError: the integrator failed; the message contains its reason.
    """
    from scipy.integrate import solve_ivp

    t = checked("t", t)
    start = np.concatenate([checked("q", q, 5), checked("qd", qd, 5)])
    if start.shape != (10,) or t.ndim != 1 or t.size < 2 or (np.diff(t) <= 0.0).any():
        raise InputError(
            f"q and qd must be (5,), and t (n,) increasing with n >= 2; together q and qd are {start.shape}, t is {t.shape}"
        )

    def accelerations(time: float, state: Array) -> Array:
        p, v = state[:5], state[5:]
        motion = None if base is None else base(time)
        return forward_dynamics(boom, p, v, torque(time, p, v), base=motion, friction=friction, drive_inertia=drive_inertia)

    def slope(time: float, state: Array) -> Array:
        return np.concatenate([state[5:], accelerations(time, state)])

    found = solve_ivp(slope, (t[0], t[-1]), start, method="DOP853", t_eval=t, rtol=rtol, atol=atol)
    if not found.success:
        raise InfeasibleError(f"the simulation stopped at {found.t[-1] if found.t.size else t[0]:g} s: {found.message}")
    states = found.y.T
    qdd = np.stack([accelerations(time, state) for time, state in zip(t, states, strict=True)])
    return Trajectory.from_samples(t, states[:, :5], states[:, 5:], qdd)
