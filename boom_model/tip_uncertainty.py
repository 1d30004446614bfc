"""Derivatives of the tip by the figures of a calibration, and the tip's covariance from theirs.

    x = p(q; lengths),    q_i = scale_i reading_i + offset_i - c_i w_i(tau_i)
    cov x = J C J^T,      J = dx / d(lengths, offset, scale, c)

C is the covariance of the calibration and w_i the printed wind-up of a gearbox. What the
calibration held counts as exact.
"""

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array, broadcast, checked
from boom_model.boom import Boom
from boom_model.calibration import INNER, LENGTHS, OFFSETS, SCALE, UPPER, WIND_UPS
from boom_model.drives.wind_up import wind_up
from boom_model.dynamics.equations_of_motion import gravity_torque
from boom_model.kinematics.forward import forward_kinematics, jacobian
from boom_model.kinematics.linkage import directions, length_derivatives, rates, require_closed

_FLAT = 1e-3  # sine of the angle between the linkage's directions, below which its inequality moves the tip without bound


def tip_covariance(boom: Boom, q: ArrayLike, tau: ArrayLike | None = None) -> Array | None:
    """Return the tip's covariance (..., 3, 3) in frame 1 [m^2] by the calibration's uncertainty.

    It is linear in the errors. It is NaN where the linkage is flat and its inequality was measured.

    Args:
        boom: the boom; None is returned if it is not calibrated.
        q: (..., 5) joint positions.
        tau: (..., 5) joint torques that wind the gearboxes up; None is the static torque [Nm, N].

    Raises:
        InputError: q or tau is not finite or not (..., 5).
        InfeasibleError: the linkage cannot close.
    """
    known = boom.calibration
    if known is None:
        return None
    q = checked("q", q, 5)
    if tau is not None:
        q, tau = broadcast(q=q, tau=tau)
    flat = q.reshape(-1, 5)
    J = _by_parameters(boom, flat, known.parameters, None if tau is None else np.reshape(tau, (-1, 5)))
    covariance: Array = (J @ known.covariance @ np.swapaxes(J, -1, -2)).reshape(*q.shape[:-1], 3, 3)
    return covariance


def tip_deviation(boom: Boom, q: ArrayLike, tau: ArrayLike | None = None) -> Array | None:
    """Return the standard deviation (...) of the tip [m], sqrt(tr cov x).

    This is the root of the mean squared distance. Arguments and errors are those of
    `tip_covariance`.
    """
    covariance = tip_covariance(boom, q, tau)
    return None if covariance is None else np.asarray(np.sqrt(np.trace(covariance, axis1=-2, axis2=-1)))


def _by_parameters(boom: Boom, q: Array, names: tuple[str, ...], tau: Array | None) -> Array:
    known, arm = boom.calibration, np.zeros(3)
    assert known is not None
    by_joints, by_lengths = tip_by_joints(boom, q, arm), tip_by_lengths(boom, q, arm)
    yields, readings = printed_wind_up(boom, q, tau), known.readings(q)
    J = np.zeros((len(q), 3, len(names)))
    for k, name in enumerate(names):
        if name in LENGTHS:
            J[..., k] = by_lengths[name]
        elif name in OFFSETS:
            J[..., k] = by_joints[..., OFFSETS.index(name)]
        elif name in WIND_UPS:
            i = WIND_UPS.index(name)
            J[..., k] = -by_joints[..., i] * yields[:, i, None]
        elif name == SCALE:
            J[..., k] = by_joints[..., 3] * readings[:, 3, None]
    if {UPPER, INNER} & set(names):
        at = directions(boom, q[:, 1], q[:, 2])
        J[np.abs(np.sin(at.outer - at.upper)) < _FLAT] = np.nan
    return J


def printed_wind_up(boom: Boom, q: Array, tau: Array | None = None) -> Array:
    """Return the wind-up (n, 5) [rad] of each joint by its gearbox's printed curve; 0 without one.

    The torque is `tau` (n, 5), or the static one at q (n, 5).
    """
    tau, yields = gravity_torque(boom, q) if tau is None else tau, np.zeros(q.shape)
    for i, drive in enumerate(boom.drives):
        angle = None if drive is None else wind_up(drive.gearbox, tau[:, i])
        if angle is not None:
            yields[:, i] = angle
    return yields


def tip_by_joints(boom: Boom, q: Array, arm: Array) -> Array:
    """Return the derivative (n, 3, 5) by q (n, 5) of a point fixed to frame 11.

    The point is at `arm` (3,) from the tip, in that frame [m].
    """
    pose, J = forward_kinematics(boom, q), jacobian(boom, q)
    moved: Array = J[:, :3] + np.cross(J[:, 3:], (pose.rotation @ arm)[..., None], axis=1)
    return moved


def tip_by_lengths(boom: Boom, q: Array, arm: Array) -> dict[str, Array]:
    """Return the derivative (n, 3) of the same point by each of LENGTHS, at q (n, 5).

    Those by L5 - L3 and L9 - L4 grow without bound where the linkage gets flat.
    """
    forward = np.stack([np.cos(q[:, 0]), np.sin(q[:, 0]), np.zeros(len(q))], axis=-1)
    up = np.array([0.0, 0.0, 1.0])
    psi = require_closed(boom, q)
    c2, s2, c, s = np.cos(q[:, 1]), np.sin(q[:, 1]), np.cos(psi), np.sin(psi)
    cp, sp = np.cos(psi + q[:, 4]), np.sin(psi + q[:, 4])

    def in_plane(x: Array, z: Array) -> Array:
        return np.asarray(forward * x[:, None] + up * z[:, None])

    # the joint's column turns all that hangs on the upper link by psi' = d psi / d theta3
    turn = rates(boom, q, np.broadcast_to(np.eye(5)[2], q.shape)).upper
    by_psi = tip_by_joints(boom, q, arm)[..., 2] / turn[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = length_derivatives(boom, q)  # by L3, L4, L5, L9
    equal = np.zeros(len(q))  # links that stay equal keep psi
    lower, outer = (
        (equal, equal) if boom.geometry.is_parallelogram else (slopes[:, 0] + slopes[:, 2], slopes[:, 1] + slopes[:, 3])
    )
    radial = in_plane(c2, s2)
    return {
        "L1": np.broadcast_to(up, (len(q), 3)),
        "L2": forward,
        "L3": by_psi * lower[:, None],
        "L4": by_psi * outer[:, None] + radial,
        "L6": in_plane(s, -c),
        "L7": in_plane(-c, -s),
        "L8": in_plane(-sp, cp),
        UPPER: by_psi * slopes[:, 2, None],
        INNER: by_psi * slopes[:, 3, None] + radial,
    }
