"""Motion under given joint torques, by numerical integration of the rigid boom."""

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
    """The motion from state q, qd (5,) under `torque`, at times t (n,), by the explicit Runge-Kutta method of order 8.

    Position limits do not stop it: what the motion does beyond them is for `check` to say.

    Args:
        base: the vehicle's motion at a time, each entry (3,); None rests on level ground.
        friction, drive_inertia: as in `inverse_dynamics`.
        rtol, atol: the integrator's tolerances on q and qd.

    Raises:
        InputError: not finite, of the wrong shape, or times that do not increase.
        InfeasibleError: the integrator gave up; carries its message.
    """
    from scipy.integrate import solve_ivp

    t = checked("t", t)
    start = np.concatenate([checked("q", q, 5), checked("qd", qd, 5)])
    if start.shape != (10,) or t.ndim != 1 or t.size < 2 or (np.diff(t) <= 0.0).any():
        raise InputError(
            f"q and qd must be (5,), and t (n,) increasing with n >= 2; q and qd make {start.shape}, t is {t.shape}"
        )

    def accelerations(time: float, state: Array) -> Array:
        p, v = state[:5], state[5:]
        motion = None if base is None else base(time)
        return forward_dynamics(boom, p, v, torque(time, p, v), base=motion, friction=friction, drive_inertia=drive_inertia)

    def slope(time: float, state: Array) -> Array:
        return np.concatenate([state[5:], accelerations(time, state)])

    found = solve_ivp(slope, (t[0], t[-1]), start, method="DOP853", t_eval=t, rtol=rtol, atol=atol)
    if not found.success:
        raise InfeasibleError(f"the simulation ended at {found.t[-1] if found.t.size else t[0]:g} s: {found.message}")
    states = found.y.T
    qdd = np.stack([accelerations(time, state) for time, state in zip(t, states, strict=True)])
    return Trajectory.from_samples(t, states[:, :5], states[:, 5:], qdd)
