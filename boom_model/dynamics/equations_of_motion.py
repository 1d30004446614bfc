"""Equations of motion, M(q) qdd + C(q, qd) qd + g(q) = tau, and energies.

Torques are `inverse_dynamics` at a state where the other terms vanish. The mass matrix and forward
dynamics of a parallelogram come from `closed_form`, which uses the same regrouped masses.
"""

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array, broadcast, checked
from boom_model.boom import Boom
from boom_model.dynamics.base_motion import BaseMotion
from boom_model.dynamics.closed_form import mass_and_bias, mass_forms
from boom_model.dynamics.newton_euler import (
    BASE_ENTRIES,
    element_velocities,
    inverse_dynamics,
    matched,
    regrouped,
    weight_torque,
)
from boom_model.kinematics.frames import body_transforms

_CHUNK = 1280
"""States at once, so that working memory does not grow with the batch."""


def mass_matrix(boom: Boom, q: ArrayLike, *, drive_inertia: bool = False) -> Array:
    """Return the mass matrix M(q) (..., 5, 5): joint torque per joint acceleration.

    The payload counts as a mass. With `drive_inertia`, the reflected inertia of the drives is added
    to the diagonal.

    Raises:
        InputError: q is not finite or not (..., 5).
    """
    q = checked("q", q, 5)
    states = q.reshape(-1, 5)
    M = np.empty((len(states), 5, 5))
    forms = mass_forms if boom.geometry.is_parallelogram else _by_elements
    for start in range(0, len(states), _CHUNK):
        M[start : start + _CHUNK] = forms(boom, states[start : start + _CHUNK])
    if drive_inertia:
        M = M + _drive_inertia(boom)
    M = (M + np.swapaxes(M, -1, -2)) / 2.0  # symmetric to the last bit
    return M.reshape(*q.shape, 5)


def mass_matrix_and_bias(
    boom: Boom, q: ArrayLike, qd: ArrayLike, *, base: BaseMotion | None = None, tip_force: ArrayLike | None = None
) -> tuple[Array, Array]:
    """Return M(q) (..., 5, 5) and the torque C(q, qd) qd + g(q) (..., 5) at qdd = 0.

    They equal `mass_matrix` and `inverse_dynamics` with qdd = 0. On small batches this function
    takes a fraction of their time.

    Args:
        boom: the boom.
        q: joint positions (..., 5).
        qd: joint velocities (..., 5); q and qd broadcast.
        base: motion of the base, as in `inverse_dynamics`.
        tip_force: force on the tip, as in `inverse_dynamics`.

    Raises:
        InputError: an input is not finite or of the wrong shape, or shapes do not match.
    """
    q, qd = broadcast(q=q, qd=qd)
    shape = q.shape[:-1]
    states, rates = q.reshape(-1, 5), qd.reshape(-1, 5)
    outside = None if base is None else [matched(f"base {name}", getattr(base, name), shape) for name in BASE_ENTRIES]
    push = None if tip_force is None else matched("tip_force", tip_force, shape)

    if not boom.geometry.is_parallelogram:
        bias = inverse_dynamics(boom, q, qd, np.zeros(5), base=base, tip_force=tip_force, reactions=False).tau
        return mass_matrix(boom, q), bias
    if len(states) <= _CHUNK:
        M, bias = mass_and_bias(boom, states, rates, outside, push)
    else:
        parts = []
        for start in range(0, len(states), _CHUNK):
            part = slice(start, start + _CHUNK)
            given = None if outside is None else [x[part] for x in outside]
            parts.append(mass_and_bias(boom, states[part], rates[part], given, None if push is None else push[part]))
        M, bias = (np.concatenate(each) for each in zip(*parts, strict=True))
    return M.reshape(*q.shape, 5), bias.reshape(q.shape)


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
    q = checked("q", q, 5)
    if q.ndim == 1 or (base is not None and base.moves):
        return inverse_dynamics(boom, q, np.zeros(5), np.zeros(5), base=base, reactions=False).tau
    states, tau = q.reshape(-1, 5), np.empty((5, q.size // 5)).T
    up = None if base is None else matched("base up", base.up, q.shape[:-1])
    for start in range(0, len(states), _CHUNK):
        part = slice(start, start + _CHUNK)
        tau[part] = weight_torque(boom, states[part], None if up is None else up[part])
    return tau.reshape(q.shape)


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
    M, bias = mass_matrix_and_bias(boom, q, qd, base=base)
    if friction:
        bias = bias + boom.friction.torque(qd)
    if drive_inertia:
        M = M + _drive_inertia(boom)
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
    poses, bodies = body_transforms(boom, q), {**boom.bodies, "tip": boom.payload}  # the payload is placed in the tip's frame
    heights = {name: (poses[name][..., :3, :3] @ body.com + poses[name][..., :3, 3]) @ up for name, body in bodies.items()}
    return boom.gravity * np.asarray(sum(bodies[name].mass * z for name, z in heights.items()))


def _by_elements(boom: Boom, q: Array) -> Array:
    """Return M (n, 5, 5) of any linkage, sum_ab db_a/dq_i . Q_ab db_b/dq_j.

    The vectors b and Q are those of `newton_euler`.
    """
    moved = element_velocities(boom, q).transpose(3, 0, 1, 2)  # (n, 5, 3, m)
    carried = moved @ regrouped(boom, "mass").torque_rows
    shape = (len(q), 5, -1)
    return np.asarray(moved.reshape(shape) @ np.swapaxes(carried.reshape(shape), -1, -2))


def _drive_inertia(boom: Boom) -> Array:
    return np.diag(boom.drive_inertia)


def _falling(boom: Boom) -> BaseMotion:
    """Return a base in free fall, where gravity has no effect."""
    return BaseMotion.of(acceleration=(0.0, 0.0, -boom.gravity))
