"""Regressor of the closed linkage: joint torques are linear in the masses, tau = Y(q, qd, qdd) pi.

A body has ten inertial parameters about the origin of its own frame, along that frame's axes:

    pi = (m, m cx, m cy, m cz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz)

They are the entries of its pseudo-inertia P = int (1, r) (1, r)^T dm, a symmetric 4 x 4 matrix:

    P = [[m, m c^T], [m c, (1/2) tr(I) 1 - I]]

P is positive definite exactly if some solid has these parameters (Wensing, Kim and Slotine 2018).
Let z_a(q) be the places of the body's origin and of a metre along its axes (see `newton_euler`).
Virtual work gives for each joint k

    tau_k = tr(P G_k),    G_k[a, b] = (dz_a / dq_k) . (d^2 z_b / dt^2 - gravity)

The z obey the closed linkage already. This is therefore G^T Y_tree(G q, G qd, G qdd), where x = G q
are the coordinates of the tree that a cut of the loop leaves.

On a base at rest 29 combinations of the 70 parameters (the payload's belong to the end effector's)
have an effect:

    9  in-plane inertia and its two differences along the links at theta2, theta3, theta3 + theta5
    6  first moments along and across these links, which gravity shows
    1  mass that the extension carries, and 2 first moments that it moves along theta3
    3  products of the links at theta2 with those at theta3, through pins 6 and 8
    1  constant inertia about the yaw axis
    7  products with the normal of the arm's plane

A base that tilts and turns shows 6 more: the yawing body's first moments across its axis, and the
rest of its inertia. Unequal links show 8 more, weakly, because the lower and the outer link no
longer turn with the upper and the inner one.
"""

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array, broadcast, read_only
from boom_model.boom import Body, Boom
from boom_model.dynamics.base_motion import BaseMotion
from boom_model.dynamics.newton_euler import base_series, body_elements, element_accelerations, element_velocities
from boom_model.kinematics.frames import BODY_FRAMES, R_LINK_BODY

REGRESSOR_BODIES = (*BODY_FRAMES, "payload")
"""Bodies in the order of the regressor's columns, ten columns each."""

PARAMETER_NAMES = ("m", "mcx", "mcy", "mcz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
"""Parameters of a body, in the order of the regressor's columns."""

_CHUNK = 512
"""Samples at once, so that the working arrays stay small."""


def regressor(boom: Boom, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, *, base: BaseMotion | None = None) -> Array:
    """Return Y (..., 5, 80) such that Y pi is `inverse_dynamics(boom, q, qd, qdd, base=base).tau`.

    pi (80,) is `inertial_parameters(boom)`. Y depends on the lengths and the gravity of the boom,
    not on its masses. The payload is a mass. Friction and the drives' own inertia are left out;
    their torques are linear in qd, sign(qd) and qdd.

    Args:
        boom: the boom.
        q: (..., 5) joint positions [rad, the extension in m].
        qd: (..., 5) velocities.
        qdd: (..., 5) accelerations. The three broadcast.
        base: how the vehicle moves the base, each entry (3,) or (..., 3); None is at rest on level
            ground.

    Raises:
        InputError: as `inverse_dynamics`.
        InfeasibleError: a linkage of unequal links cannot close at q.
    """
    positions, rates, accelerations = broadcast(q=q, qd=qd, qdd=qdd)
    shape = positions.shape[:-1]
    motion = [np.reshape(x, (-1, 5)) for x in (positions, rates, accelerations)]
    outside, grouped = base_series(base, shape), _grouped(boom)
    Y = np.empty((len(motion[0]), 5, grouped.shape[1]))
    for start in range(0, len(Y), _CHUNK):
        part = slice(start, start + _CHUNK)
        state = [x[part] for x in motion]
        A = element_accelerations(boom, *state, *(x[part] for x in outside)).transpose(2, 0, 1)  # (n, 3, m)
        moved = element_velocities(boom, state[0]).transpose(3, 0, 2, 1)  # (n, 5, m, 3)
        work = moved.reshape(len(A), -1, 3) @ A
        Y[part] = work.reshape(len(A), 5, -1) @ grouped
    return Y.reshape(*shape, *Y.shape[1:])


def inertial_parameters(boom: Boom) -> Array:
    """Return pi (80,), the parameters of each of REGRESSOR_BODIES in turn."""
    bodies = {**boom.bodies, "payload": boom.payload}
    return np.concatenate([body_parameters(bodies[name]) for name in REGRESSOR_BODIES])


def body_parameters(body: Body) -> Array:
    """Return the ten parameters of a body, about the origin of its frame."""
    return parameters_of_pseudo_inertia(pseudo_inertia(body))


def pseudo_inertia(body: Body) -> Array:
    """Return the pseudo-inertia (4, 4) of a body, about the origin of its frame."""
    P = np.empty((4, 4))
    P[0, 0] = body.mass
    P[0, 1:] = P[1:, 0] = body.mass * body.com
    P[1:, 1:] = 0.5 * np.trace(body.inertia) * np.eye(3) - body.inertia + body.mass * np.outer(body.com, body.com)
    return P


def parameters_of_pseudo_inertia(P: ArrayLike) -> Array:
    """Return the ten parameters (..., 10) of pseudo-inertias (..., 4, 4)."""
    P = np.asarray(P, dtype=float)
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = (P[..., 1 + i, 1:].T for i in range(3))
    entries = [P[..., 0, 0].T, *(P[..., 0, i].T for i in (1, 2, 3)), yy + zz, -xy, xx + zz, -xz, -yz, xx + yy]
    return np.stack([entry.T for entry in entries], axis=-1)


def pseudo_inertia_of_parameters(parameters: ArrayLike) -> Array:
    """Return the pseudo-inertias (..., 4, 4) of ten parameters (..., 10)."""
    m, hx, hy, hz, xx, xy, yy, xz, yz, zz = np.moveaxis(np.asarray(parameters, dtype=float), -1, 0)
    half = 0.5 * (xx + yy + zz)
    rows = [[m, hx, hy, hz], [hx, half - xx, -xy, -xz], [hy, -xy, half - yy, -yz], [hz, -xz, -yz, half - zz]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def body_of_pseudo_inertia(P: Array) -> Body:
    """Return the body with a pseudo-inertia (4, 4) of positive mass.

    Raises:
        InputError: a figure is not plausible.
    """
    mass = float(P[0, 0])
    com = P[0, 1:] / mass
    spread = P[1:, 1:] - mass * np.outer(com, com)
    return Body(mass, read_only(com), read_only(np.trace(spread) * np.eye(3) - spread))


def _grouped(boom: Boom) -> Array:
    """Return what each parameter adds to int g g^T dm of `newton_euler`, flattened: (m^2, 80)."""
    along_link, P = body_elements(boom), pseudo_inertia_of_parameters(np.eye(10))
    columns = []
    for name in REGRESSOR_BODIES:
        origin, axes = along_link[name][:1], along_link[name][1:]
        g = np.vstack([origin, R_LINK_BODY[name].T @ axes])  # the origin, and what a metre along the body's own axes adds
        columns.append((g.T @ P @ g).reshape(10, -1).T)
    return np.hstack(columns)
