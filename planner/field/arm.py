"""Lever arm from the antenna over mount and arm to the sensor, its rate and its covariance.

    r = r_mount + R_body_mount (p_11(q) + R_1_11(q) x) - r_antenna

q is the measured joint position less the wind-up of the gearboxes under gravity, so the arm's sag
counts. To first order, the covariance is the sum of those of the joints (J S J^T), the sensor, the
mount, the antenna, and the mounting angles of mount and inertial sensor (s^2 (|r|^2 1 - r r^T)).
Backlash, hysteresis and step error of a drive are taken as evenly distributed over +-their width,
as `boom_model.tip_deflection` takes them: s = width / sqrt(3).
"""

import numpy as np

from boom_model import JOINTS, BaseMotion, Boom, forward_kinematics, inverse_dynamics, jacobian, wind_up
from boom_model.arrays import Array
from planner.field.earth import axes, geodetic_of
from planner.field.geotag import LeverArm
from planner.field.rig import Rig

_UNEVEN = 1.0 / np.sqrt(3.0)


def yielding(boom: Boom, q: Array, up: Array) -> Array:
    """Return the joint positions (n, 5) of the arm at rest where its motors stand at q (n, 5).

    Args:
        boom: the boom.
        q: (n, 5) [rad, m].
        up: (n, 3) unit vector against gravity, along frame 1.
    """
    tau = inverse_dynamics(boom, q, np.zeros(5), np.zeros(5), base=BaseMotion.of(up=up), reactions=False).tau
    found = np.array(q, dtype=float)
    for i, drive in enumerate(boom.drives):
        angle = None if drive is None else wind_up(drive.gearbox, tau[..., i])
        if angle is not None:
            found[..., i] -= angle
    return found


def up_in_mount(rig: Rig, ecef: Array, R_ecef_body: Array) -> Array:
    """Return unit vectors (n, 3) against gravity along frame 1, at places ecef (n, 3) [m]."""
    latitude, longitude, _ = geodetic_of(ecef)
    up: Array = np.einsum("nij,ni->nj", R_ecef_body, axes(latitude, longitude)[..., 2]) @ rig.R_body_mount
    return up


def play(boom: Boom) -> tuple[Array, tuple[str, ...]]:
    """Return the standard deviation (5,) [rad, m] of the joints by their drives, and unknowns."""
    variance, unknown = np.zeros(5), []
    for i, drive in enumerate(boom.drives):
        if drive is None:
            unknown.append(f"{JOINTS[i]} has no drive: its wind-up, backlash and hysteresis are not counted")
            continue
        gearbox, motor = drive.gearbox, drive.motor
        step = None if motor.microstep_accuracy is None else motor.microstep_accuracy / gearbox.ratio
        known = {"wind-up": gearbox.torsion_stiffness, "backlash": gearbox.backlash, "hysteresis": gearbox.hysteresis}
        missing = [name for name, value in known.items() if value is None]
        if missing:
            unknown.append(f"{JOINTS[i]}: no {', '.join(missing)} is printed")
        for width in (gearbox.backlash, gearbox.hysteresis, step):
            variance[i] += ((width or 0.0) * _UNEVEN) ** 2
    return np.sqrt(variance), tuple(unknown)


def in_mount(boom: Boom, q: Array, point: Array) -> Array:
    """Return where a point of the tip's frame is in frame 1, (n, 3) [m].

    Args:
        boom: the boom.
        q: (n, 5) joint positions, wind-up taken off [rad, m].
        point: (3,) or (n, 3) in frame 11 [m].
    """
    tip = forward_kinematics(boom, q)
    place: Array = tip.position + np.einsum("nij,nj->ni", tip.rotation, np.broadcast_to(point, (len(q), 3)))
    return place


def lever_arm(boom: Boom, rig: Rig, q: Array, qd: Array, point: Array) -> LeverArm:
    """Return the lever arm from the antenna to a point of the tip's frame.

    Args:
        boom: the boom.
        rig: the rig.
        q: (n, 5) joint positions, wind-up taken off [rad, m].
        qd: (n, 5) their rates.
        point: (3,) or (n, 3) in frame 11 [m].
    """
    tip, J = forward_kinematics(boom, q), jacobian(boom, q)
    offset = np.einsum("nij,nj->ni", tip.rotation, np.broadcast_to(point, (len(q), 3)))
    J_point = J[:, :3, :] + np.swapaxes(np.cross(np.swapaxes(J[:, 3:, :], -1, -2), offset[:, None, :]), -1, -2)
    in_mount = tip.position + offset
    R = rig.R_body_mount
    r = rig.mount + in_mount @ R.T - rig.antenna
    J_body = R @ J_point
    joint_variance = rig.joint_std**2 + play(boom)[0] ** 2
    covariance = (J_body * joint_variance) @ np.swapaxes(J_body, -1, -2)
    covariance += (rig.sensor_std**2 + rig.mount_std**2 + rig.antenna_std**2) * np.eye(3)
    covariance += rig.mount_turn_std**2 * _across(in_mount @ R.T) + rig.imu_std**2 * _across(r)
    return LeverArm.of(r, covariance, np.einsum("nij,nj->ni", J_body, qd))


def _across(r: Array) -> Array:
    """Return |r|^2 1 - r r^T (n, 3, 3): the covariance of d x r for d of unit covariance."""
    squares: Array = (r**2).sum(axis=-1)[:, None, None] * np.eye(3) - r[:, :, None] * r[:, None, :]
    return squares
