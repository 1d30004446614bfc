"""Attitude of the vehicle: roll, pitch and heading, and what an error of each does to a point.

The vehicle's axes are x forward, y left, z up, as those of frame 1. Angles follow aviation, as the
makers of inertial sensors do: heading clockwise from true north, pitch with the nose up, roll with
the right side down. With north-east-down axes n, and forward-right-down axes b,

    R_n_b = R_z(heading) R_y(pitch) R_x(roll).
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from boom_model import InputError
from boom_model.arrays import Array, checked

NAMES = ("roll", "pitch", "heading")
_NED_ENU = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])  # its own inverse
_FRD_FLU = np.diag([1.0, -1.0, -1.0])


def rotation(roll: ArrayLike, pitch: ArrayLike, heading: ArrayLike) -> Array:
    """Return R_enu_body (..., 3, 3) of angles [rad], each (...).

    Raises:
        InputError: an angle is not finite.
    """
    given = [checked(name, a) for name, a in (("roll", roll), ("pitch", pitch), ("heading", heading))]
    angles = np.stack(np.broadcast_arrays(*given[::-1]), axis=-1)
    R: Array = _NED_ENU @ Rotation.from_euler("ZYX", angles.reshape(-1, 3)).as_matrix() @ _FRD_FLU
    return R.reshape(*angles.shape[:-1], 3, 3)


def angles(R_enu_body: ArrayLike) -> Array:
    """Return roll, pitch, heading in [0, 2 pi) (..., 3) [rad] of R_enu_body (..., 3, 3)."""
    R = np.asarray(R_enu_body, dtype=float)
    R_n_b = _NED_ENU @ R @ _FRD_FLU
    # The same as Rotation.as_euler("ZYX"), which warns where the nose points straight up.
    roll = np.arctan2(R_n_b[..., 2, 1], R_n_b[..., 2, 2])
    pitch = np.arcsin(np.clip(-R_n_b[..., 2, 0], -1.0, 1.0))
    heading = np.arctan2(R_n_b[..., 1, 0], R_n_b[..., 0, 0])
    return np.stack([roll, pitch, heading % (2.0 * np.pi)], axis=-1)


def error_axes(R_enu_body: ArrayLike) -> Array:
    """Return the axes (..., 3, 3) of roll, pitch and heading, as columns in east-north-up.

    A small error d of the three angles moves the point R r by sum_i d_i (axis_i x R r). Roll turns
    about the body's forward axis, heading about the vertical (down), and pitch about the horizontal
    axis square to the heading, to the right.
    """
    R = np.asarray(R_enu_body, dtype=float)
    heading = np.arctan2(R[..., 0, 0], R[..., 1, 0])
    zero, one = np.zeros_like(heading), np.ones_like(heading)
    right = np.stack([np.cos(heading), -np.sin(heading), zero], axis=-1)
    down = np.stack([zero, zero, -one], axis=-1)
    return np.stack([R[..., :, 0], right, down], axis=-1)


def of_directions(body: ArrayLike, enu: ArrayLike) -> Array:
    """Return the R_enu_body (3, 3) that fits measured directions (k, 3) best (Wahba's problem).

    Raises:
        InputError: fewer than two directions that are not parallel.
    """
    b, e = checked("directions of the body", body, 3), checked("directions measured", enu, 3)
    if len(b) < 2 or np.linalg.matrix_rank(b, tol=1e-6) < 2:
        raise InputError(f"{len(b)} directions; an attitude needs two that are not parallel")
    found, _ = Rotation.align_vectors(e, b)
    return np.asarray(found.as_matrix(), dtype=float)
