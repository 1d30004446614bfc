"""Tip pose and Jacobian in closed form; motion of every frame and body by recursion.

With rho = L7 + theta4 and phi = theta3 + theta5, in the arm's vertical plane (r forward, z up):

    r = L2 + L9 cos(theta2) - rho cos(theta3) + L6 sin(theta3) - L8 sin(phi)
    z = L1 + L9 sin(theta2) - rho sin(theta3) - L6 cos(theta3) + L8 cos(phi)

Where the linkage is no parallelogram, psi(theta2, theta3) of `linkage` takes the place of theta3.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array, broadcast, checked
from boom_model.boom import Boom
from boom_model.dynamics.base_motion import BaseMotion
from boom_model.errors import InputError
from boom_model.kinematics.frames import BODY_FRAMES, SLIDING_ROW, Loop, frame_transforms, theta_motion
from boom_model.kinematics.linkage import accelerations, directions, rates, require_closed
from boom_model.trigonometry import cosine_and_sine


@dataclass(frozen=True)
class TipPose:
    """Position and orientation of the tip in frame 1."""

    position: Array
    """(..., 3) [m]"""
    rotation: Array
    """(..., 3, 3): R_1_11, thesis eq. 2.18 with entry (1, 3) corrected to +sin(theta1)."""
    pitch: Array
    """(...) elevation of the end effector above the boom's forward horizontal [rad].

    It is in (-pi, pi]; -pi/2 faces down.
    """


def forward_kinematics(boom: Boom, q: ArrayLike) -> TipPose:
    """Return the tip pose in closed form (thesis, eqs. 2.18 and 2.19).

    Args:
        boom: the boom.
        q: (..., 5) joint positions [rad, the extension in m].

    Raises:
        InputError: q is not finite or not (..., 5).

    >>> boom = Boom.load()
    >>> [round(float(x), 3) for x in forward_kinematics(boom, boom.pose("phenotyping")).position]
    [0.0, 2.29, 0.978]
    """
    q = _with_actuator(boom, checked("q", q, 5))
    r, z = _tip_in_plane(boom, q)
    c1, s1 = np.cos(q[..., 0]), np.sin(q[..., 0])
    phi = q[..., 2] + q[..., 4]
    cp, sp = np.cos(phi), np.sin(phi)
    zero = np.zeros_like(cp)
    rotation = np.stack(
        [
            np.stack([-c1 * sp, -c1 * cp, s1], axis=-1),
            np.stack([-s1 * sp, -s1 * cp, -c1], axis=-1),
            np.stack([cp, -sp, zero], axis=-1),
        ],
        axis=-2,
    )
    return TipPose(np.stack([c1 * r, s1 * r, z], axis=-1), rotation, np.asarray(np.arctan2(cp, -sp)))


def jacobian(boom: Boom, q: ArrayLike) -> Array:
    """Return the geometric Jacobian of the tip in frame 1, (..., 6, 5): [v; omega] = J qd.

    The upper rows give velocity [m/s], the lower ones angular velocity [rad/s]. In a parallelogram
    the inner link does not rotate the tip. Derived from thesis eq. 2.19.

    Raises:
        InputError: q is not finite or not (..., 5).
    """
    q = checked("q", q, 5)
    return _by_joints(boom, q, _actuator_jacobian(boom, _with_actuator(boom, q)))


def position_jacobian(boom: Boom, q: ArrayLike) -> Array:
    """Return the upper rows of `jacobian`, (..., 3, 5): v = J qd.

    Raises:
        InputError: q is not finite or not (..., 5).
    """
    q = checked("q", q, 5)
    J = _linear_jacobian(boom, _with_actuator(boom, q))
    return _by_joints(boom, q, np.moveaxis(J, (0, 1), (-2, -1)))


def _linear_jacobian(boom: Boom, q: Array) -> Array:
    """Return the upper rows of `_actuator_jacobian`, (3, 5, ...).

    In memory, each entry of all states is one run of numbers.
    """
    g = boom.geometry
    rho = g.L7 + q[..., 3]
    (c1, s1), (c2, s2), (c3, s3) = (cosine_and_sine(q[..., i]) for i in range(3))
    cp, sp = cosine_and_sine(q[..., 2] + q[..., 4])
    r = g.L2 + g.L9 * c2 - rho * c3 + g.L6 * s3 - g.L8 * sp
    dr = (-g.L9 * s2, rho * s3 + g.L6 * c3 - g.L8 * cp, -c3, -g.L8 * cp)
    dz = (g.L9 * c2, -rho * c3 + g.L6 * s3 - g.L8 * sp, -s3, -g.L8 * sp)
    J = np.empty((3, 5, *r.shape))
    J[0, 0], J[1, 0], J[2, 0] = -s1 * r, c1 * r, 0.0
    for i in range(4):
        J[0, i + 1], J[1, i + 1], J[2, i + 1] = c1 * dr[i], s1 * dr[i], dz[i]
    return J


def _actuator_jacobian(boom: Boom, q: Array) -> Array:
    """Return the Jacobian by (theta1, theta2, psi, theta4, theta5), whose values are q."""
    c1, s1 = cosine_and_sine(q[..., 0])
    J = np.zeros((6, 5, *c1.shape))
    J[:3] = _linear_jacobian(boom, q)
    J[5, 0] = 1.0
    for turning in (2, 4):
        J[3, turning], J[4, turning] = s1, -c1
    return np.moveaxis(J, (0, 1), (-2, -1))


def jacobian_rate(boom: Boom, q: ArrayLike, qd: ArrayLike) -> Array:
    """Return the time derivative of `jacobian`, (..., 6, 5).

    The acceleration of the tip is J qdd + dJ/dt qd.

    Raises:
        InputError: q or qd is not finite or not (..., 5), or they do not broadcast.
    """
    q, qd = broadcast(q=q, qd=qd)
    turned, turning = _with_actuator(boom, q), qd
    if not boom.geometry.is_parallelogram:
        turning = qd.copy()
        turning[..., 2] = rates(boom, q, qd).upper
    J_rate = _by_joints(boom, q, _actuator_jacobian_rate(boom, turned, turning))
    if not boom.geometry.is_parallelogram:  # psi'' - D qdd is quadratic in qd; its polar form gives the columns
        across, still = _actuator_jacobian(boom, turned)[..., 2], np.zeros_like(q)
        for i in (1, 2):
            unit = np.zeros_like(q)
            unit[..., i] = 1.0
            both, less = (accelerations(boom, q, qd + sign * unit, still).upper for sign in (1.0, -1.0))
            J_rate[..., i] += across * ((both - less) / 4.0)[..., None]
    return J_rate


def _actuator_jacobian_rate(boom: Boom, q: Array, qd: Array) -> Array:
    """Return the time derivative of `_actuator_jacobian` at coordinates and their rates."""
    g = boom.geometry
    v1, v2, v3, v4, _ = np.moveaxis(qd, -1, 0)
    rho, vt = g.L7 + q[..., 3], qd[..., 2] + qd[..., 4]
    c1, s1 = np.cos(q[..., 0]), np.sin(q[..., 0])
    c2, s2 = np.cos(q[..., 1]), np.sin(q[..., 1])
    c3, s3 = np.cos(q[..., 2]), np.sin(q[..., 2])
    ct, st = np.cos(q[..., 2] + q[..., 4]), np.sin(q[..., 2] + q[..., 4])
    # Each column in the arm's plane, (r, z), and its rate there; the yaw rotates it in addition.
    r, _ = _tip_in_plane(boom, q)
    across = (-g.L9 * s2, rho * s3 + g.L6 * c3 - g.L8 * ct, -c3, -g.L8 * ct)
    r_rates = (-g.L9 * c2 * v2, v4 * s3 + (rho * c3 - g.L6 * s3) * v3 + g.L8 * st * vt, s3 * v3, g.L8 * st * vt)
    z_rates = (-g.L9 * s2 * v2, -v4 * c3 + (rho * s3 + g.L6 * c3) * v3 - g.L8 * ct * vt, -c3 * v3, -g.L8 * ct * vt)
    r_rate = sum(a * v for a, v in zip(across, np.moveaxis(qd[..., 1:], -1, 0), strict=True))
    zero = np.zeros_like(r)
    columns = [np.stack([-c1 * v1 * r - s1 * r_rate, c1 * r_rate - s1 * v1 * r, zero, zero, zero, zero], axis=-1)]
    for a, a_rate, z_rate, turns in zip(across, r_rates, z_rates, (0.0, 1.0, 0.0, 1.0), strict=True):
        x_rate, y_rate = c1 * a_rate - s1 * v1 * a, s1 * a_rate + c1 * v1 * a
        columns.append(np.stack([x_rate, y_rate, z_rate, c1 * v1 * turns, s1 * v1 * turns, zero], axis=-1))
    return np.stack(columns, axis=-1)


def manipulability(boom: Boom, q: ArrayLike) -> Array:
    """Return Yoshikawa's manipulability of the tip's translation, (...): sqrt(det(J_v J_v^T)).

    It is 0 at a singularity. Its columns have the units m/rad, and m/m for the extension, so
    compare it between poses, not between arms.

    Raises:
        InputError: q is not finite or not (..., 5).
    """
    J = jacobian(boom, q)[..., :3, :]
    measure: Array = np.sqrt(np.maximum(np.linalg.det(J @ np.swapaxes(J, -1, -2)), 0.0))
    return measure


def transmission_angle(boom: Boom, q: ArrayLike) -> Array:
    """Return the acute angle (...) between the outer and the upper link, at pin 7 [rad].

    Pin forces grow as the inverse of its sine. In a parallelogram it is that between the inner and
    the lower link: 0 where the linkage is flat, pi/2 where it is rectangular.

    Raises:
        InputError: q is not finite or not (..., 5).
        InfeasibleError: a linkage of unequal links cannot close at q.
    """
    q = checked("q", q, 5)
    if boom.geometry.is_parallelogram:
        _, sine = cosine_and_sine(q[..., 2] - q[..., 1])
    else:
        at = directions(boom, q[..., 1], q[..., 2])
        require_closed(boom, q)
        sine = np.sin(at.upper - at.outer)
    angle: Array = np.arcsin(np.minimum(np.abs(sine), 1.0))
    return angle


@dataclass(frozen=True, eq=False)
class FrameMotion:
    """Motion of every frame of a loop relative to the ground, along the axes of frame 1.

    Entry i - 1 belongs to frame i.
    """

    T: Array
    """(..., 11, 4, 4): T_1_i."""
    velocity: Array
    """(..., 11, 3) of the origin [m/s]"""
    angular_velocity: Array
    """(..., 11, 3) [rad/s]"""
    acceleration: Array
    """(..., 11, 3) of the origin [m/s^2], without gravity"""
    angular_acceleration: Array
    """(..., 11, 3) [rad/s^2]"""


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """Motion of a body relative to the ground, along the axes of frame 1.

    Each field is (..., 3), except T.
    """

    T: Array
    """(..., 4, 4): T_1_body."""
    com: Array
    """position of the centre of mass [m]"""
    velocity: Array
    """of the centre of mass [m/s]"""
    angular_velocity: Array
    """[rad/s]"""
    acceleration: Array
    """of the centre of mass [m/s^2], without gravity"""
    angular_acceleration: Array
    """[rad/s^2]"""


def frame_motion(
    boom: Boom, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, loop: Loop, base: BaseMotion | None = None
) -> FrameMotion:
    """Return the motion of the frames of one loop by outward recursion, along the axes of frame 1.

    The equations are the thesis's 2.39-2.43, as corrected.

    Raises:
        InputError: an input is not finite or of the wrong shape, or shapes do not match.
    """
    q, qd, qdd = broadcast(q=q, qd=qd, qdd=qdd)
    T = frame_transforms(boom, q, loop)
    spin, spin_up = theta_motion(boom, q, qd, qdd, loop)
    base = BaseMotion.of() if base is None else base
    start = (base.velocity, base.angular_velocity, base.acceleration, base.angular_acceleration)
    try:
        v, w, a, w1 = (np.broadcast_to(x, (*q.shape[:-1], 3)) for x in start)
    except ValueError:
        raise InputError(f"base motion does not match states of shape {q.shape}") from None
    frames = [(v, w, a, w1)]
    for row in range(10):
        r = T[..., row + 1, :3, 3] - T[..., row, :3, 3]
        z = T[..., row + 1, :3, 2]
        v = v + np.cross(w, r)
        a = a + np.cross(w1, r) + np.cross(w, np.cross(w, r))
        if row == SLIDING_ROW:
            slide = qd[..., 3, None] * z
            v, a = v + slide, a + 2.0 * np.cross(w, slide) + qdd[..., 3, None] * z
        turn = spin[..., row, None] * z
        w1 = w1 + np.cross(w, turn) + spin_up[..., row, None] * z
        w = w + turn
        frames.append((v, w, a, w1))
    return FrameMotion(T, *(np.stack(part, axis=-2) for part in zip(*frames, strict=True)))


def body_motion(
    boom: Boom, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, base: BaseMotion | None = None
) -> dict[str, BodyMotion]:
    """Return the motion of every body and its centre of mass by name (thesis, eq. 2.44).

    The payload moves with frame 11.

    Raises:
        InputError: an input is not finite or of the wrong shape, or shapes do not match.
    """
    loops = {loop: frame_motion(boom, q, qd, qdd, loop, base) for loop in ("inner", "outer")}
    placed = {**BODY_FRAMES, "payload": ("outer", 11)}
    motions = {}
    for name, body in {**boom.bodies, "payload": boom.payload}.items():
        loop, frame = placed[name]
        m, i = loops[loop], frame - 1
        w, w1 = m.angular_velocity[..., i, :], m.angular_acceleration[..., i, :]
        r = m.T[..., i, :3, :3] @ body.com
        motions[name] = BodyMotion(
            T=m.T[..., i, :, :],
            com=m.T[..., i, :3, 3] + r,
            velocity=m.velocity[..., i, :] + np.cross(w, r),
            angular_velocity=w,
            acceleration=m.acceleration[..., i, :] + np.cross(w1, r) + np.cross(w, np.cross(w, r)),
            angular_acceleration=w1,
        )
    return motions


def _with_actuator(boom: Boom, q: Array) -> Array:
    """Return q with the actuator's direction psi in the place of theta3."""
    if boom.geometry.is_parallelogram:
        return q
    turned = q.copy()
    turned[..., 2] = require_closed(boom, q)
    return turned


def _by_joints(boom: Boom, q: Array, J: Array) -> Array:
    """Return a Jacobian by the joints from one by (theta1, theta2, psi, theta4, theta5), at q."""
    if boom.geometry.is_parallelogram:
        return J
    by_2, by_3 = (rates(boom, q, np.broadcast_to(np.eye(5)[i], q.shape)).upper for i in (1, 2))
    joined = J.copy()
    joined[..., 1] += J[..., 2] * by_2[..., None]
    joined[..., 2] *= by_3[..., None]
    return joined


def _tip_in_plane(boom: Boom, q: Array) -> tuple[Array, Array]:
    g = boom.geometry
    _, t2, t3, t4, t5 = np.moveaxis(q, -1, 0)
    rho, phi = g.L7 + t4, t3 + t5
    r: Array = g.L2 + g.L9 * np.cos(t2) - rho * np.cos(t3) + g.L6 * np.sin(t3) - g.L8 * np.sin(phi)
    z: Array = g.L1 + g.L9 * np.sin(t2) - rho * np.sin(t3) - g.L6 * np.cos(t3) + g.L8 * np.cos(phi)
    return r, z
