"""Tip pose and Jacobian in closed form.

With rho = L7 + theta4 and phi = theta3 + theta5, in the arm's vertical plane (r forward, z up):

    r = L2 + L9 cos(theta2) - rho cos(theta3) + L6 sin(theta3) - L8 sin(phi)
    z = L1 + L9 sin(theta2) - rho sin(theta3) - L6 cos(theta3) + L8 cos(phi)
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array, checked
from boom_model.boom import Boom


@dataclass(frozen=True)
class TipPose:
    """Where the tip is and how it points, in frame 1."""

    position: Array
    """(..., 3) [m]"""
    rotation: Array
    """(..., 3, 3): R_1_11, thesis eq. 2.18 with entry (1, 3) corrected to +sin(theta1)."""
    pitch: Array
    """(...) elevation of the end effector above the boom's forward horizontal [rad], in (-pi, pi]: down is -pi/2."""


def forward_kinematics(boom: Boom, q: ArrayLike) -> TipPose:
    """Tip pose in closed form (thesis, eqs. 2.18 and 2.19).

    Args:
        q: (..., 5) joint positions [rad, the extension in m].

    Raises:
        InputError: q is not finite or not (..., 5).
    """
    q = checked("q", q, 5)
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
    """Geometric Jacobian of the tip in frame 1, shape (..., 6, 5): [v; omega] = J qd.

    Rows are velocity [m/s] over angular velocity [rad/s]; the inner link does not turn the tip, because the parallelogram
    keeps the actuator's direction. Differentiates thesis eq. 2.19.

    Raises:
        InputError: q is not finite or not (..., 5).
    """
    q = checked("q", q, 5)
    g = boom.geometry
    rho = g.L7 + q[..., 3]
    c1, s1 = np.cos(q[..., 0]), np.sin(q[..., 0])
    c2, s2 = np.cos(q[..., 1]), np.sin(q[..., 1])
    c3, s3 = np.cos(q[..., 2]), np.sin(q[..., 2])
    cp, sp = np.cos(q[..., 2] + q[..., 4]), np.sin(q[..., 2] + q[..., 4])
    r, _ = _tip_in_plane(boom, q)
    zero, one = np.zeros_like(r), np.ones_like(r)
    dr = (-g.L9 * s2, rho * s3 + g.L6 * c3 - g.L8 * cp, -c3, -g.L8 * cp)
    dz = (g.L9 * c2, -rho * c3 + g.L6 * s3 - g.L8 * sp, -s3, -g.L8 * sp)
    columns = [np.stack([-s1 * r, c1 * r, zero, zero, zero, one], axis=-1)]
    for i, turn in enumerate((zero, one, zero, one)):
        columns.append(np.stack([c1 * dr[i], s1 * dr[i], dz[i], s1 * turn, -c1 * turn, zero], axis=-1))
    return np.stack(columns, axis=-1)


def _tip_in_plane(boom: Boom, q: Array) -> tuple[Array, Array]:
    g = boom.geometry
    _, t2, t3, t4, t5 = np.moveaxis(q, -1, 0)
    rho, phi = g.L7 + t4, t3 + t5
    r: Array = g.L2 + g.L9 * np.cos(t2) - rho * np.cos(t3) + g.L6 * np.sin(t3) - g.L8 * np.sin(phi)
    z: Array = g.L1 + g.L9 * np.sin(t2) - rho * np.sin(t3) - g.L6 * np.cos(t3) + g.L8 * np.cos(phi)
    return r, z
