"""Probability that a point with a normal error lies in a polygon, exactly.

With the error whitened, the normal distribution is round about the point, and a polygon's
probability is the signed sum of those of the triangles from the point to its edges. For an edge at
distance h whose ends are at t1 and t2 along it, that of the triangle is

    (atan(t2 / h) - atan(t1 / h)) / (2 pi) - (T(h, t2 / h) - T(h, t1 / h))

with Owen's T(h, a), the probability of X > h and 0 < Y < a X.
"""

from typing import Any

import numpy as np
from scipy.special import owens_t

from boom_model.arrays import Array

_LEAST = 1e-6  # [m] standard deviation that a point without error is given
_LEAST_DISTANCE = 1e-12


def probability(rings: list[Array], mean: Array, covariance: Array) -> Array:
    """Return the probability (n,) that points lie in a polygon.

    Args:
        rings: the outer ring (k, 2) and its holes, each closed or not.
        mean: (n, 2) points [m].
        covariance: (n, 2, 2) of each [m^2].
    """
    whiten = np.linalg.inv(np.linalg.cholesky(covariance + _LEAST**2 * np.eye(2)))
    total = np.zeros(len(mean))
    for number, ring in enumerate(rings):
        corners = np.einsum("nij,nkj->nki", whiten, ring[None, :, :] - mean[:, None, :])
        inside = np.abs(_signed(corners, np.roll(corners, -1, axis=1)).sum(axis=1))
        total += inside if number == 0 else -inside
    return np.clip(total, 0.0, 1.0)


def rings_of(polygon: Any) -> list[Array]:
    """Return the rings of shapely's polygon, the outer one first, each (k, 2)."""
    return [np.asarray(ring.coords, dtype=float)[:-1, :2] for ring in (polygon.exterior, *polygon.interiors)]


def _signed(a: Array, b: Array) -> Array:
    """Return the signed probability (...) of triangles from the origin to edges a, b (..., 2)."""
    edge = b - a
    length = np.maximum(np.linalg.norm(edge, axis=-1), _LEAST_DISTANCE)
    cross = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    h = np.abs(cross) / length
    along = edge / length[..., None]
    t1, t2 = (a * along).sum(axis=-1), (b * along).sum(axis=-1)
    near = h < _LEAST_DISTANCE
    apart = np.where(near, 1.0, h)
    wedge = (np.arctan2(t2, apart) - np.arctan2(t1, apart)) / (2.0 * np.pi)
    beyond = owens_t(apart, t2 / apart) - owens_t(apart, t1 / apart)
    signed: Array = np.where(near, 0.0, np.sign(cross) * (wedge - beyond))
    return signed
