"""The two Denavit-Hartenberg loops of the thesis, and the frame of each body.

Frame 1 is the base, frame 11 the tip. Row i of a table takes frame i to frame i+1 (thesis, tables
2-1 and 2-2 with the corrections of rows 8 and 6). In a linkage of unequal links, psi and chi of
`linkage` take the places of theta3 and theta2. Transforms are named T_parent_child: T multiplies
the coordinates of a point in the child and gives those in the parent.
"""

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array, checked, read_only
from boom_model.boom import Boom
from boom_model.kinematics.linkage import accelerations, rates, require_closed
from boom_model.kinematics.linkage import directions as linkage_directions

Loop = Literal["inner", "outer"]

_CHUNK = 1024
"""Number of states computed at a time, so that the working arrays fit the processor's cache."""

BODY_FRAMES: dict[str, tuple[Loop, int]] = {
    "base": ("outer", 2),
    "lower": ("outer", 5),
    "inner": ("inner", 5),
    "outer": ("outer", 6),
    "upper": ("outer", 8),
    "extension": ("outer", 9),
    "end_effector": ("outer", 10),
}
"""Loop and frame in which the centre of mass and the inertia of each body are given.

Those of the payload are given in frame 11, the tip.
"""

R_LINK_BODY = {
    "base": read_only([[1, 0, 0], [0, 0, 1], [0, -1, 0]]),
    "lower": read_only(np.eye(3)),
    "inner": read_only(np.eye(3)),
    "outer": read_only(np.eye(3)),
    "upper": read_only([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]),
    "extension": read_only([[0, 0, -1], [1, 0, 0], [0, -1, 0]]),
    "end_effector": read_only([[0, -1, 0], [1, 0, 0], [0, 0, 1]]),
    "payload": read_only([[0, -1, 0], [1, 0, 0], [0, 0, 1]]),
}
"""Rotation from a body's DH frame to its link axes (e, p, n).

e points at the link's angle from the arm's forward horizontal, p a quarter turn further, and n is
the normal of the arm's plane. The link's angle is 0 for the base, theta2 for inner and outer,
theta3 for lower, upper and extension, and theta3 + theta5 for end effector and payload.
"""

THETA_RATES = {
    "inner": read_only(
        [[1, 0, 0, 0, 0], *[[0] * 5] * 2, [0, 1, 0, 0, 0], [0, -1, 1, 0, 0], *[[0] * 5] * 3, [0, 0, 0, 0, 1], [0] * 5]
    ),
    "outer": read_only(
        [
            *([1, 0, 0, 0, 0], [0] * 5, [0] * 5, [0, 0, 1, 0, 0], [0, 1, -1, 0, 0]),
            *([0, -1, 1, 0, 0], [0] * 5, [0] * 5, [0, 0, 0, 0, 1], [0] * 5),
        ]
    ),
}
"""Rates of the angles theta_i of all rows (10, 5) in a parallelogram: d(theta_i)/dt =
THETA_RATES[loop][i] @ qd."""

SLIDING_ROW = 7
"""Index of the row whose d_i belongs to the extension: d(d_i)/dt = qd[3]."""


def dh_rows(boom: Boom, q: ArrayLike, loop: Loop) -> Array:
    """Return the rows (alpha_{i-1}, a_{i-1}, d_i, theta_i) of one loop, (..., 10, 4), in rad and m.

    Args:
        boom: the boom.
        q: (..., 5) joint positions [rad, m].
        loop: "inner" (thesis, table 2-1) or "outer" (table 2-2).

    Raises:
        InputError: q is not finite or not (..., 5).
        InfeasibleError: the linkage cannot close at q.
    """
    q = checked("q", q, 5)
    g = boom.geometry
    t1, t2, t3, t4, t5 = np.moveaxis(q, -1, 0)
    psi = require_closed(boom, q)  # theta3 in a parallelogram
    chi = linkage_directions(boom, t2, t3).outer  # theta2 in a parallelogram
    right, half = np.pi / 2.0, np.pi
    a: tuple[float, ...]
    theta: tuple[Any, ...]
    if loop == "inner":
        alpha = (0, 0, 0, right, 0, 0, 0, right, right, 0)
        a = (0, 0, g.L2, 0, g.L9, 0, 0, g.L6, 0, g.L8)
        theta = (t1, 0, 0, t2, psi - t2 - right, 0, 0, half, t5, 0)
    else:
        alpha = (0, 0, 0, right, 0, 0, 0, right, right, 0)
        a = (0, 0, g.L2, 0, g.L3, g.L4, g.L5, g.L6, 0, g.L8)
        theta = (t1, 0, 0, t3, 2.0 * half - t3 + chi, half + psi - chi, right, half, t5, 0)
    d = (0, g.L1, 0, 0, 0, 0, 0, g.L7 + t4, 0, 0)
    rows = np.empty((*q.shape[:-1], 10, 4))
    for column, entries in enumerate((alpha, a, d, theta)):
        for row, entry in enumerate(entries):
            rows[..., row, column] = entry
    return rows


def theta_motion(boom: Boom, q: Array, qd: Array, qdd: Array, loop: Loop) -> tuple[Array, Array]:
    """Return the first and second time derivatives (..., 10) of theta_i of all rows of a loop."""
    known = THETA_RATES[loop].T
    spin, spin_up = qd @ known, qdd @ known
    if boom.geometry.is_parallelogram:
        return spin, spin_up
    turned = (spin, qd, rates(boom, q, qd)), (spin_up, qdd, accelerations(boom, q, qd, qdd))
    for rows, given, linkage in turned:
        psi, chi = linkage.upper - given[..., 2], linkage.outer - given[..., 1]
        if loop == "inner":
            rows[..., 4] += psi
        else:
            rows[..., 4] += chi
            rows[..., 5] += psi - chi
    return spin, spin_up


def frame_transforms(boom: Boom, q: ArrayLike, loop: Loop) -> Array:
    """Return T_1_i of every frame of one loop, (..., 11, 4, 4) (thesis, eqs. 2.2 and 2.17).

    The entry [..., i-1, :, :] is T_1_i.

    Raises:
        InputError: q is not finite or not (..., 5).
    """
    q = checked("q", q, 5)
    states = q.reshape(-1, 5)
    T = np.empty((len(states), 11, 4, 4))
    T[:, 0] = np.eye(4)
    for start in range(0, len(states), _CHUNK):
        part = slice(start, start + _CHUNK)
        steps = _steps(dh_rows(boom, states[part], loop))
        for i in range(10):
            np.matmul(T[part, i], steps[:, i], out=T[part, i + 1])
    return T.reshape(*q.shape[:-1], 11, 4, 4)


def _steps(rows: Array) -> Array:
    """Return T_i_i+1 (n, 10, 4, 4) of DH rows (n, 10, 4)."""
    alpha, a, d, theta = np.moveaxis(rows, -1, 0)
    ca, sa, ct, st = np.cos(alpha), np.sin(alpha), np.cos(theta), np.sin(theta)
    steps = np.zeros((*theta.shape, 4, 4))
    steps[..., 0, :] = np.stack([ct, -st, np.zeros_like(ct), a], axis=-1)
    steps[..., 1, :] = np.stack([st * ca, ct * ca, -sa, -sa * d], axis=-1)
    steps[..., 2, :] = np.stack([st * sa, ct * sa, ca, ca * d], axis=-1)
    steps[..., 3, 3] = 1.0
    return steps


def body_transforms(boom: Boom, q: ArrayLike) -> dict[str, Array]:
    """Return T_1_body (..., 4, 4) of every body of `BODY_FRAMES` and of the tip (frame 11)."""
    loops = {loop: frame_transforms(boom, q, loop) for loop in ("inner", "outer")}
    poses = {name: loops[loop][..., frame - 1, :, :] for name, (loop, frame) in BODY_FRAMES.items()}
    return poses | {"tip": loops["outer"][..., 10, :, :]}
