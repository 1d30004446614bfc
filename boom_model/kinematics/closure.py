"""Closure of the linkage in the arm's plane, for a given actuator angle or a given extension.

With phi = pitch - 90 deg and r = +-hypot(x, y), where the minus sign means the base turned by 180
degrees, the inner link must satisfy

    L9 e(theta2) = (F + rho c3 - L6 s3,  G + rho s3 + L6 c3),
    F = r - L2 - L8 cos(pitch),   G = z - L1 - L8 sin(pitch)

The length of the left side is L9 (thesis, eqs. 2.20-2.38 with their corrections; H = L9^2 - F^2 -
G^2 - L6^2). This gives

    for a given actuator angle:   rho^2 + b rho + c = 0,
                                  b = 2 (F c3 + G s3),  c = 2 L6 (G c3 - F s3) - H
    for a given extension:        e cos(theta3) + d sin(theta3) = H - rho^2,
                                  d = 2 (rho G - F L6),  e = 2 (rho F + G L6)

Here theta3 is the direction of the actuator. Where the linkage is no parallelogram,
`linkage.lower_angle` gives the lower link's angle from it.
"""

from typing import NamedTuple

import numpy as np

from boom_model.arrays import Array, Mask
from boom_model.boom import IS_LENGTH, LIMIT_TOLERANCE, Boom

_TANGENT = 1e-13  # relative gap attributed to rounding: the target is on the boundary of the reach


class Closure(NamedTuple):
    """A solution of the closure, NaN where there is none.

    A double root is reported for root = +1 only.
    """

    theta2: Array
    theta3: Array
    rho: Array
    exists: Mask


def closed_by_extension(boom: Boom, rho: Array, F: Array, G: Array, root: Array | float) -> Closure:
    """Return the closure for an extension given as rho = L7 + theta4; root is +1 or -1.

    All broadcast.
    """
    g = boom.geometry
    d, e = 2.0 * (rho * G - F * g.L6), 2.0 * (rho * F + G * g.L6)
    f = g.L9**2 - F**2 - G**2 - g.L6**2 - rho**2
    amplitude = np.hypot(d, e)
    gap, scale = amplitude - np.abs(f), g.L9**2 + F**2 + G**2 + g.L6**2 + rho**2
    ratio = np.divide(f, amplitude, out=np.zeros_like(f), where=amplitude > 0.0)
    theta3 = np.arctan2(d, e) + root * np.arccos(np.clip(ratio, -1.0, 1.0))
    return _closure(boom, theta3, rho, F, G, gap, scale, amplitude > 0.0, root)


def closed_by_angle(boom: Boom, theta3: Array, F: Array, G: Array, root: Array | float) -> Closure:
    """Return the closure for an actuator angle theta3; root is +1 or -1. All broadcast."""
    g = boom.geometry
    c3, s3 = np.cos(theta3), np.sin(theta3)
    half_b = F * c3 + G * s3
    gap = g.L9**2 - (G * c3 - F * s3 + g.L6) ** 2  # half_b^2 - c, without the squares that cancel
    rho = -half_b + root * np.sqrt(np.maximum(gap, 0.0))
    return _closure(boom, theta3, rho, F, G, gap, np.full_like(gap, g.L9**2), np.isfinite(rho), root)


def _closure(
    boom: Boom, theta3: Array, rho: Array, F: Array, G: Array, gap: Array, scale: Array, possible: Mask, root: Array | float
) -> Closure:
    double = gap <= _TANGENT * scale
    exists = possible & np.isfinite(gap) & (gap >= -_TANGENT * scale) & ~(double & (np.asarray(root) < 0.0))
    c3, s3 = np.cos(theta3), np.sin(theta3)
    theta2 = np.arctan2(G + rho * s3 + boom.geometry.L6 * c3, F + rho * c3 - boom.geometry.L6 * s3)
    theta2, theta3, rho = (np.where(exists, part, np.nan) for part in np.broadcast_arrays(theta2, theta3, rho))
    return Closure(theta2, theta3, rho, exists)


def turned_into_limits(boom: Boom, q: Array) -> Array:
    """Return angles turned by whole turns into their limits, or else to the nearer limit.

    On a tie they are turned above the limits.
    """
    limits, turn = boom.limits, 2.0 * np.pi
    above = np.mod(q - limits.lower, turn)
    above = limits.lower + np.where(turn - above <= LIMIT_TOLERANCE, above - turn, above)
    below = above - turn
    nearer_below = limits.lower - below < above - limits.upper - LIMIT_TOLERANCE
    return np.where(IS_LENGTH, q, np.where(nearer_below, below, above))
