"""Four-bar linkage: direction of the upper link and of the outer link, exact for unequal links.

The lower link L3 (direction theta3) and the inner link L9 (theta2) turn about the shoulder. The
outer link L4 (direction chi, from pin 6 to pin 7) and the upper link L5 (direction psi, from pin 8
to pin 7) close the loop:

    L3 e(theta3) + L4 e(chi) = L9 e(theta2) + L5 e(psi)

In a parallelogram psi = theta3 and chi = theta2. Otherwise, with a = L9 - L4 and b = L5 - L3,
psi - theta3 is about (a + b cos(delta)) / (L3 sin(delta)), delta = theta3 - theta2: it grows where
the linkage gets flat, and close to that the links may not reach each other.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array
from boom_model.boom import Boom, Geometry
from boom_model.errors import InfeasibleError


class Directions(NamedTuple):
    """Directions of the upper and the outer link, or a rate of them; both (...)."""

    upper: Array
    """psi [rad]: direction of the upper link, which carries the actuator."""
    outer: Array
    """chi [rad]"""


def directions(boom: Boom, theta2: ArrayLike, theta3: ArrayLike) -> Directions:
    """Return psi and chi, NaN where the links do not reach each other.

    Of the two ways to assemble the loop it is the one without crossed links.
    """
    theta2, theta3 = np.broadcast_arrays(np.asarray(theta2, dtype=float), np.asarray(theta3, dtype=float))
    g = boom.geometry
    if g.is_parallelogram:
        return Directions(theta3, theta2)
    x, y = g.L3 * np.cos(theta3) - g.L9 * np.cos(theta2), g.L3 * np.sin(theta3) - g.L9 * np.sin(theta2)
    psi = np.arctan2(y, x) - _handed(theta3 - theta2) * _corner(g.L5, np.hypot(x, y), g.L4)
    x, y = g.L5 * np.cos(psi) - x, g.L5 * np.sin(psi) - y
    return Directions(_near(psi, theta3), _near(np.arctan2(y, x), theta2))


def lower_angle(boom: Boom, theta2: ArrayLike, psi: ArrayLike) -> Array:
    """Return theta3 for a direction psi of the upper link: the inverse of `directions`.

    It is NaN where the links do not reach each other, or only with crossed links.
    """
    theta2, psi = np.broadcast_arrays(np.asarray(theta2, dtype=float), np.asarray(psi, dtype=float))
    g = boom.geometry
    if g.is_parallelogram:
        return psi
    x, y = g.L9 * np.cos(theta2) + g.L5 * np.cos(psi), g.L9 * np.sin(theta2) + g.L5 * np.sin(psi)
    hand = _handed(psi - theta2)
    theta3 = _near(np.arctan2(y, x) + hand * _corner(g.L3, np.hypot(x, y), g.L4), psi)
    return np.where(_handed(theta3 - theta2) == hand, theta3, np.nan)


def require_closed(boom: Boom, q: Array) -> Array:
    """Return psi (...) at q (..., 5).

    Raises:
        InfeasibleError: the links do not reach each other; gives the angle.
    """
    psi = directions(boom, q[..., 1], q[..., 2]).upper
    apart = np.isnan(psi)
    if apart.any():
        delta = float(np.degrees((q[..., 2] - q[..., 1])[apart].flat[0]))
        g = boom.geometry
        raise InfeasibleError(
            f"the linkage cannot close at lower - inner = {delta:.6g} deg: "
            f"L3 {g.L3:.6g}, L4 {g.L4:.6g}, L5 {g.L5:.6g} and L9 {g.L9:.6g} m do not reach each other"
        )
    return psi


def rates(boom: Boom, q: Array, qd: Array) -> Directions:
    """Return the rates of psi and chi [rad/s] at joint velocities qd (..., 5)."""
    if boom.geometry.is_parallelogram:
        return Directions(qd[..., 2], qd[..., 1])
    at = directions(boom, q[..., 1], q[..., 2])
    return _solved(boom.geometry, q, at, _pull(boom.geometry, q, at, qd))


def accelerations(boom: Boom, q: Array, qd: Array, qdd: Array) -> Directions:
    """Return the second derivatives of psi and chi [rad/s^2], from the loop's second derivative."""
    if boom.geometry.is_parallelogram:
        return Directions(qdd[..., 2], qdd[..., 1])
    g, at, rate = boom.geometry, directions(boom, q[..., 1], q[..., 2]), rates(boom, q, qd)

    def pulled(along: Array) -> Array:
        """Return the component of what the known terms leave open, along a link's direction."""
        square = g.L3 * np.cos(along - q[..., 2]) * qd[..., 2] ** 2 - g.L9 * np.cos(along - q[..., 1]) * qd[..., 1] ** 2
        square = square + g.L4 * np.cos(along - at.outer) * rate.outer**2 - g.L5 * np.cos(along - at.upper) * rate.upper**2
        return square

    turned = _pull(g, q, at, qdd)
    return _solved(g, q, at, Directions(turned.upper - pulled(at.outer), turned.outer - pulled(at.upper)))


def length_derivatives(boom: Boom, q: Array) -> Array:
    """Return d psi/d (L3, L4, L5, L9) (..., 4) [rad/m] at constant theta2 and theta3."""
    g, at = boom.geometry, directions(boom, q[..., 1], q[..., 2])
    moved = (np.cos(at.outer - q[..., 2]), np.ones_like(at.outer), -np.cos(at.outer - at.upper), -np.cos(at.outer - q[..., 1]))
    slope: Array = np.stack(moved, axis=-1) / (g.L5 * np.sin(at.outer - at.upper))[..., None]
    return slope


def _pull(g: Geometry, q: Array, at: Directions, rate: Array) -> Directions:
    """Return what the turning lower and inner links take, across the outer and upper link."""
    across = [
        g.L3 * np.sin(along - q[..., 2]) * rate[..., 2] - g.L9 * np.sin(along - q[..., 1]) * rate[..., 1]
        for along in (at.outer, at.upper)
    ]
    return Directions(*across)


def _solved(g: Geometry, q: Array, at: Directions, pull: Directions) -> Directions:
    sine = np.sin(at.outer - at.upper)
    return Directions(pull.upper / (g.L5 * sine), pull.outer / (g.L4 * sine))


def _handed(delta: Array) -> Array:
    """Return +1 where theta3 is ahead of theta2 by less than half a turn, else -1."""
    return np.where(np.sin(delta) >= 0.0, 1.0, -1.0)


def _corner(a: float, b: Array, opposite: float) -> Array:
    """Return the angle of a triangle between sides a and b; NaN where there is no such triangle."""
    with np.errstate(divide="ignore", invalid="ignore"):
        cosine = (a**2 + b**2 - opposite**2) / (2.0 * a * b)
    return np.arccos(np.where(np.abs(cosine) <= 1.0, cosine, np.nan))


def _near(angle: Array, reference: Array) -> Array:
    """Return an angle less than half a turn from a reference."""
    turned: Array = reference + np.mod(angle - reference + np.pi, 2.0 * np.pi) - np.pi
    return turned
