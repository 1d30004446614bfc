"""Mass matrix and bias torque in closed form.

The vectors b, the constant matrix Q and the plane of the arm are those of `newton_euler`. The
torque of joint i follows from d'Alembert's principle:

    tau_i = sum_ab db_a/dq_i . Q_ab A_b            A_b: acceleration of b_b less gravity

The vectors b and their derivatives are linear in nine features of the position:

    f = (1, c2, c3, ct, s2, s3, st, rho c3, rho s3)      c, s: cosine and sine; 2, 3, t, rho as in b

A is linear in the accelerations of joints and base, and in products of two rates. Therefore each
coefficient of tau is a constant quadratic form in f.

A batch takes about twenty calls of NumPy, and hundreds with Newton-Euler. This is faster for many
small batches one after the other, as in an integrator.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from boom_model.arrays import Array, read_only
from boom_model.boom import Boom
from boom_model.dynamics.newton_euler import regrouped

_COSINES, _SINES, _RHO_3, _AT_3 = slice(1, 4), slice(4, 7), slice(7, 9), slice(2, 6, 3)  # entries of f
_ANGLES = read_only([[0, 0, 0], [1, 0, 0], [0, 1, 1], [0, 0, 0], [0, 0, 1]])
"""q @ _ANGLES: theta2, theta3, theta3 + theta5."""

_PRODUCTS = np.triu_indices(9)
"""Pairs of features."""

_PAIRS = np.triu_indices(7)
"""Pairs of rates: of the plane about z, theta2' to theta5', of the plane about x and about n."""

_JOINT_PAIRS = np.triu_indices(5)
_ONE_THREAD = 2**18
"""Multiplications of a product that OpenBLAS takes on one thread; see `newton_euler`."""

_FIRST_PAIR = 10
"""Column of the first pair in `Forms.moving`."""


class Forms(NamedTuple):
    """Constant quadratic forms in f (45, 5 k): k coefficients of each torque; payload as mass."""

    inertia: Array
    """k = 5: joint accelerations, the mass matrix."""
    level: Array
    """k = 21: joint accelerations; gravity; products of two joint rates, for a base at rest."""
    moving: Array
    """k = 38: joint accelerations; acceleration of the base less gravity along x, z and n; angular
    acceleration of the plane about x and n; products of two of the seven rates."""
    tip: Array
    """(9, 15), linear in f: 3 coefficients a joint, of a force at the tip along x, z and n."""


def mass_forms(boom: Boom, q: Array) -> Array:
    """Return M (n, 5, 5) at joint positions q (n, 5)."""
    return _evaluate(_forms(boom).inertia, _features(boom, q))


def mass_and_bias(
    boom: Boom, q: Array, qd: Array, base: Sequence[Array] | None, tip_force: Array | None
) -> tuple[Array, Array]:
    """Return M (n, 5, 5) and the torque (n, 5) without joint acceleration.

    Args:
        boom: the boom.
        q: joint positions (n, 5).
        qd: joint velocities (n, 5).
        base: angular velocity, angular acceleration, acceleration and up, each (n, 3) along frame
            1; None is at rest on level ground.
        tip_force: (n, 3) along frame 1.
    """
    forms, f, count = _forms(boom), _features(boom, q), len(q)
    if base is None:
        G = _evaluate(forms.level, f)
        causes = np.empty((count, 16))
        causes[:, 0] = boom.gravity
        np.multiply(qd.take(_JOINT_PAIRS[0], axis=1), qd.take(_JOINT_PAIRS[1], axis=1), out=causes[:, 1:])
        bias = _times(G[:, :, 5:], causes)
    else:
        G = _evaluate(forms.moving, f)
        w, wd, a, up = (_into_plane(q, x) for x in base)
        yaw = qd[:, 0]
        rates = np.column_stack([yaw + w[:, 1], qd[:, 1:], w[:, 0], w[:, 2]])
        causes = np.zeros((count, 38))
        causes[:, 0] = wd[:, 1]  # about the yaw axis, as the yaw's own acceleration
        causes[:, 5:8] = a + boom.gravity * up
        causes[:, 8], causes[:, 9] = wd[:, 0] - yaw * w[:, 2], wd[:, 2] + yaw * w[:, 0]  # the thesis's eq. 2.40
        causes[:, _FIRST_PAIR:] = rates[:, _PAIRS[0]] * rates[:, _PAIRS[1]]
        bias = _times(G, causes)
    if tip_force is not None:
        bias -= _times((f @ forms.tip).reshape(count, 5, 3), _into_plane(q, tip_force))
    return G[:, :, :5], bias


def _features(boom: Boom, q: Array) -> Array:
    f = np.empty((len(q), 9))
    angles = q @ _ANGLES
    f[:, 0] = 1.0
    np.cos(angles, out=f[:, _COSINES])
    np.sin(angles, out=f[:, _SINES])
    np.multiply(f[:, _AT_3], (boom.geometry.L7 + q[:, 3])[:, None], out=f[:, _RHO_3])
    return f


def _evaluate(forms: Array, f: Array) -> Array:
    """Return the quadratic forms at features (n, 9) as (n, 5, k)."""
    count, coefficients = len(f), forms.shape[1] // 5
    products = f.take(_PRODUCTS[0], axis=1) * f.take(_PRODUCTS[1], axis=1)
    if count == 1:  # BLAS rounds a vector's product differently; a state must not depend on its batch
        return (np.concatenate([products, products]) @ forms)[:1].reshape(1, 5, coefficients)
    parts = -(-count * forms.size // _ONE_THREAD)
    if parts <= 1:
        return (products @ forms).reshape(count, 5, coefficients)
    values = np.empty((count, forms.shape[1]))
    for k in range(parts):
        part = slice(count * k // parts, count * (k + 1) // parts)
        np.matmul(products[part], forms, out=values[part])
    return values.reshape(count, 5, coefficients)


def _times(G: Array, causes: Array) -> Array:
    product: Array = (G @ causes[:, :, None])[:, :, 0]
    return product


def _into_plane(q: Array, vectors: Array) -> Array:
    """Return vectors (n, 3), given along frame 1, along x, z and n of the plane."""
    c, s = np.cos(q[:, 0]), np.sin(q[:, 0])
    x, y = vectors[:, 0], vectors[:, 1]
    return np.column_stack([c * x + s * y, vectors[:, 2], s * x - c * y])


@lru_cache(maxsize=16)
def _forms(boom: Boom) -> Forms:
    model, b = regrouped(boom, "mass"), _vectors()
    by = [_by_turn(1), *map(_by_joint, range(1, 5)), _by_turn(0), _by_turn(2)]  # in the order of the rates
    partial = [d(b) for d in by]
    pairs = [by[i](partial[j]) + (by[j](partial[i]) if i != j else 0.0) for i, j in zip(*_PAIRS, strict=True)]
    carried = np.zeros((3, 9, 3, 11))
    carried[:, 0, :, 0] = np.eye(3)  # the base's acceleration is that of o alone
    causes = [*partial[:5], *carried, *partial[5:], *pairs]
    moving = np.einsum("ipca,ab,kqcb->pqik", partial[:5], model.torque_rows, causes, optimize=True)
    moving = moving + np.where(np.eye(9)[:, :, None, None], 0.0, np.swapaxes(moving, 0, 1))
    moving = moving[_PRODUCTS]
    joints = [_FIRST_PAIR + k for k, pair in enumerate(zip(*_PAIRS, strict=True)) if max(pair) < 5]
    return Forms(
        inertia=read_only(moving[..., :5].reshape(45, -1)),
        level=read_only(moving[..., [0, 1, 2, 3, 4, 6, *joints]].reshape(45, -1)),
        moving=read_only(moving.reshape(45, -1)),
        tip=read_only(np.einsum("ipca,a->pic", partial[:5], model.tip).reshape(9, -1)),
    )


def _vectors() -> Array:
    """Return the vectors b along x, z and n as constants (9, 3, 11) times f."""
    b = np.zeros((9, 3, 11))
    b[0, [0, 1, 2], [1, 2, 3]] = 1.0  # x, z, n
    for e, c, s in ((4, 1, 4), (6, 2, 5), (9, 3, 6)):  # e = (c, s, 0), p = (-s, c, 0)
        b[c, 0, e] = b[s, 1, e] = b[c, 1, e + 1] = 1.0
        b[s, 0, e + 1] = -1.0
    b[7, 0, 8] = b[8, 1, 8] = 1.0
    return b


def _by_joint(joint: int) -> Callable[[Array], Array]:
    """Return the derivative of (9, 3, 11) constants times f by theta2 to theta5 (joint 1 to 4)."""
    D = np.zeros((9, 9))  # of f_p by q: sum_r D_pr f_r
    for cosine, sine in {1: [(1, 4)], 2: [(2, 5), (3, 6), (7, 8)], 3: [], 4: [(3, 6)]}[joint]:
        D[cosine, sine], D[sine, cosine] = -1.0, 1.0
    if joint == 3:
        D[7, 2] = D[8, 5] = 1.0
    return lambda x: np.einsum("pr,pca->rca", D, x)


def _by_turn(axis: int) -> Callable[[Array], Array]:
    """Return the derivative of vectors (9, 3, 11) by the plane's turn about x, z or n: axis x b."""
    return lambda x: np.cross(np.eye(3)[axis], x, axisb=1, axisc=1)
