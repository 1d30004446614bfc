"""Equations of motion, M(q) qdd + C(q, qd) qd + g(q) = tau, and energies.

Each term is `inverse_dynamics` at a state where the other terms vanish; there is no second model.
"""

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array, broadcast, checked
from boom_model.boom import Boom
from boom_model.drives.drive import reflected_inertia
from boom_model.dynamics.base_motion import BaseMotion
from boom_model.dynamics.newton_euler import inverse_dynamics
from boom_model.kinematics.forward import body_motion

_ACCELERATIONS = np.eye(5)


def mass_matrix(boom: Boom, q: ArrayLike, *, drive_inertia: bool = False) -> Array:
    """Return the mass matrix M(q) (..., 5, 5): joint torque per joint acceleration.

    The payload counts as a mass. With `drive_inertia`, the reflected inertia of the drives is added
    to the diagonal.

    Raises:
        InputError: q is not finite or not (..., 5).
    """
    q = checked("q", q, 5)[..., None, :]
    M = inverse_dynamics(boom, q, np.zeros(5), _ACCELERATIONS, base=_falling(boom), reactions=False).tau
    if drive_inertia:
        M = M + np.diag([(drive and reflected_inertia(drive)) or 0.0 for drive in boom.drives])
    return (M + np.swapaxes(M, -1, -2)) / 2.0  # symmetric to the last bit


def velocity_torque(boom: Boom, q: ArrayLike, qd: ArrayLike) -> Array:
    """Return the Coriolis and centrifugal torque C(q, qd) qd (..., 5).

    Raises:
        InputError: q or qd is not finite or not (..., 5), or they do not broadcast.
    """
    return inverse_dynamics(boom, q, qd, np.zeros(5), base=_falling(boom), reactions=False).tau


def gravity_torque(boom: Boom, q: ArrayLike, *, base: BaseMotion | None = None) -> Array:
    """Return the static torque g(q) (..., 5) that keeps the joints at rest.

    It balances gravity and, where `base` is given, the tilt and motion of the base.

    Raises:
        InputError: q is not finite or not (..., 5).
    """
    return inverse_dynamics(boom, q, np.zeros(5), np.zeros(5), base=base, reactions=False).tau


def forward_dynamics(
    boom: Boom,
    q: ArrayLike,
    qd: ArrayLike,
    tau: ArrayLike,
    *,
    base: BaseMotion | None = None,
    friction: bool = False,
    drive_inertia: bool = False,
) -> Array:
    """Return the joint accelerations (..., 5) under joint torques.

        qdd = M^-1 (tau - inverse_dynamics(q, qd, 0))

    The arrays q, qd and tau have shape (..., 5) and broadcast. `base` and `friction` act as in
    `inverse_dynamics`, `drive_inertia` as in `mass_matrix`. Coulomb friction is 0 at rest: it
    brakes a moving joint, but there is no stiction.

    Raises:
        InputError: an input is not finite or of the wrong shape, or shapes do not match.
    """
    q, qd, tau = broadcast(q=q, qd=qd, tau=tau)
    bias = inverse_dynamics(boom, q, qd, np.zeros(5), base=base, friction=friction, reactions=False).tau
    M = mass_matrix(boom, q, drive_inertia=drive_inertia)
    return np.asarray(np.linalg.solve(M, (tau - bias)[..., None])[..., 0])


def kinetic_energy(boom: Boom, q: ArrayLike, qd: ArrayLike) -> Array:
    """Return the kinetic energy (1/2) qd . M(q) qd (...) [J] on a base at rest.

    Raises:
        InputError: q or qd is not finite or not (..., 5), or they do not broadcast.
    """
    q, qd = broadcast(q=q, qd=qd)
    momentum = (mass_matrix(boom, q) @ qd[..., None])[..., 0]
    energy: Array = 0.5 * np.sum(qd * momentum, axis=-1)
    return energy


def potential_energy(boom: Boom, q: ArrayLike, *, up: ArrayLike = (0.0, 0.0, 1.0)) -> Array:
    """Return the potential energy, the sum of m g (up . c) over bodies and payload (...) [J].

    Heights of the centres of mass c are measured from the origin of frame 1 along `up`, a unit
    vector (3,) in frame 1; its default is level ground.

    Raises:
        InputError: q is not finite or not (..., 5), or `up` is not finite or not (3,).
    """
    q, up = checked("q", q, 5), checked("up", up, 3)
    zero = np.zeros(5)
    masses = {**boom.bodies, "payload": boom.payload}
    heights = {name: motion.com @ up for name, motion in body_motion(boom, q, zero, zero).items()}
    return boom.gravity * np.asarray(sum(masses[name].mass * z for name, z in heights.items()))


def _falling(boom: Boom) -> BaseMotion:
    """Return a base in free fall, where gravity has no effect."""
    return BaseMotion.of(acceleration=(0.0, 0.0, -boom.gravity))
