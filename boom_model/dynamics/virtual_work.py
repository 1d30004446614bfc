"""Dynamics by virtual work, for a linkage of unequal links.

With F = m (a - gravity) and N = I w' + w x (I w) of every body, and its velocities at the joint
rate e_k, v_k of its centre of mass and w_k,

    tau_k = sum over the bodies of F . v_k + N . w_k

The columns v_k and w_k are the Jacobian of the closed loop. The pin forces follow from the
equilibrium of the outer link and of all beyond pins 7 and 8; the mount bears the sum of all bodies.
"""

from typing import NamedTuple

import numpy as np

from boom_model.arrays import Array
from boom_model.boom import Boom
from boom_model.dynamics.base_motion import BaseMotion
from boom_model.kinematics.forward import BodyMotion, body_motion, jacobian
from boom_model.kinematics.frames import frame_transforms
from boom_model.kinematics.linkage import directions

_BEYOND_PINS = ("upper", "extension", "end_effector", "payload")


class Balance(NamedTuple):
    """Joint torques (n, 5), pin forces (3, n, 3) in frame 4, and mount wrench (n, 6) in frame 1."""

    tau: Array
    pins: Array
    mount: Array


class _Wrench(NamedTuple):
    """What a body's motion takes: force and moment about its centre of mass, along frame 1."""

    force: Array
    moment: Array
    at: Array


def balance(
    boom: Boom,
    q: Array,
    qd: Array,
    qdd: Array,
    base: BaseMotion,
    *,
    payload_as_force: bool,
    tip_force: Array | None,
    tip_moment: Array | None,
) -> Balance:
    """Return the loads at states (n, 5); the arguments are those of `inverse_dynamics`, already checked.

    Raises:
        InfeasibleError: the linkage cannot close at a state.
    """
    motions = body_motion(boom, q, qd, qdd, base)
    wrenches = {name: _wrench(boom, name, motion, base, payload_as_force) for name, motion in motions.items()}
    tau = np.zeros(q.shape)
    for k in range(5):
        moved = body_motion(boom, q, np.broadcast_to(np.eye(5)[k], q.shape), np.zeros(5))
        for name, wrench in wrenches.items():
            tau[..., k] += (wrench.force * moved[name].velocity + wrench.moment * moved[name].angular_velocity).sum(axis=-1)
    J, tip = jacobian(boom, q), frame_transforms(boom, q, "outer")[..., 10, :3, 3]
    push = np.zeros((*q.shape[:-1], 3)) if tip_force is None else np.broadcast_to(tip_force, (*q.shape[:-1], 3))
    twist = np.zeros((*q.shape[:-1], 3)) if tip_moment is None else np.broadcast_to(tip_moment, (*q.shape[:-1], 3))
    tau -= (np.concatenate([push, twist], axis=-1)[..., None, :] @ J)[..., 0, :]
    wrenches["tip"] = _Wrench(-push, -twist, tip)
    return Balance(tau, _pins(boom, q, wrenches), _mount(wrenches))


def _wrench(boom: Boom, name: str, motion: BodyMotion, base: BaseMotion, payload_as_force: bool) -> _Wrench:
    body = boom.payload if name == "payload" else boom.bodies[name]
    lift = boom.gravity * base.up
    if name == "payload" and payload_as_force:
        force = np.broadcast_to(body.mass * lift, motion.com.shape)
        return _Wrench(force, np.zeros_like(motion.com), motion.com)
    R, w = motion.T[..., :3, :3], motion.angular_velocity
    inertia = R @ body.inertia @ np.swapaxes(R, -1, -2)
    moment = (inertia @ motion.angular_acceleration[..., None])[..., 0] + np.cross(w, (inertia @ w[..., None])[..., 0])
    return _Wrench(body.mass * (motion.acceleration + lift), moment, motion.com)


def _mount(wrenches: dict[str, _Wrench]) -> Array:
    force = sum((w.force for w in wrenches.values()), np.zeros(3))
    moment = sum((w.moment + np.cross(w.at, w.force) for w in wrenches.values()), np.zeros(3))
    return -np.concatenate([force, moment], axis=-1)


def _pins(boom: Boom, q: Array, wrenches: dict[str, _Wrench]) -> Array:
    """Return the forces at pins 6, 7 and 8, in the arm's plane."""
    g = boom.geometry
    psi, chi = directions(boom, q[..., 1], q[..., 2])
    forward = np.stack([np.cos(q[..., 0]), np.sin(q[..., 0]), np.zeros(q.shape[:-1])], axis=-1)
    normal = np.stack([np.sin(q[..., 0]), -np.cos(q[..., 0]), np.zeros(q.shape[:-1])], axis=-1)

    def needed(bodies: tuple[str, ...], pin: Array) -> tuple[Array, Array]:
        """Force (n, 2) forward and up, and moment (n) about the plane's normal at a pin."""
        force = sum((wrenches[name].force for name in bodies), np.zeros(3))
        moment = sum((wrenches[b].moment + np.cross(wrenches[b].at - pin, wrenches[b].force) for b in bodies), np.zeros(3))
        return np.stack([(force * forward).sum(axis=-1), force[..., 2]], axis=-1), (moment * normal).sum(axis=-1)

    outer, inner = frame_transforms(boom, q, "outer"), frame_transforms(boom, q, "inner")
    F_outer, M_outer = needed(("outer",), outer[..., 5, :3, 3])
    F_top, M_top = needed((*_BEYOND_PINS, "tip"), inner[..., 5, :3, 3])
    with np.errstate(divide="ignore", invalid="ignore"):
        along_outer, along_upper = M_top / (g.L5 * np.sin(chi - psi)), M_outer / (g.L4 * np.sin(chi - psi))
        f7 = along_outer[..., None] * np.stack([np.cos(chi), np.sin(chi)], axis=-1)
        f7 = f7 + along_upper[..., None] * np.stack([np.cos(psi), np.sin(psi)], axis=-1)
    pins = np.zeros((3, *q.shape[:-1], 3))
    for pin, force in enumerate((F_outer + f7, f7, F_top - f7)):
        pins[pin, ..., 0], pins[pin, ..., 2] = force[..., 0], force[..., 1]
    return pins
