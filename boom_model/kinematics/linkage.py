"""Four-bar linkage: direction of the upper link and of the outer link, exact for unequal links.

The lower link L3 (direction theta3) and the inner link L9 (theta2) turn about the shoulder. The
outer link L4 (direction chi, from pin 6 to pin 7) and the upper link L5 (direction psi, from pin 8
to pin 7) close the loop:

    L3 e(theta3) + L4 e(chi) = L9 e(theta2) + L5 e(psi)

In a parallelogram psi = theta3 and chi = theta2. Otherwise, with a = L9 - L4 and b = L5 - L3,
psi - theta3 is about (a + b cos(delta)) / (L3 sin(delta)), delta = theta3 - theta2: it grows where
the linkage gets flat, and close to that the links may not reach each other.
"""

from math import nan
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array
from boom_model.boom import Boom, Geometry
from boom_model.errors import InfeasibleError

Value = Array | float
"""(n,), or the number of a single state: Python's own arithmetic is ten times quicker on it."""

Unit = tuple[Value, Value]
"""Cosine and sine of an angle."""

_TINY = 1e-300  # [m^2]: keeps a division by zero off where pins 6 and 8 meet


class Directions(NamedTuple):
    """Directions of the upper and the outer link, or a rate of them; both (...)."""

    upper: Array
    """psi [rad]: direction of the upper link, which carries the actuator."""
    outer: Array
    """chi [rad]"""


class Loop(NamedTuple):
    """The closed loop at states, with what its motion takes."""

    upper: Unit
    """of psi"""
    outer: Unit
    """of chi"""
    upper_by: tuple[Value, Value]
    """Derivatives of psi by theta2 and theta3."""
    outer_by: tuple[Value, Value]
    """Derivatives of chi by theta2 and theta3."""
    squares: tuple[tuple[Value, ...], tuple[Value, ...]]
    """Second derivatives of psi and of chi, at constant rates of theta2 and theta3, by the squared
    rates of theta2, theta3, chi and psi."""

    def rates(self, inner: Value, lower: Value) -> tuple[Value, Value]:
        """Return the rates of psi and chi at the rates of theta2 and theta3."""
        upper, outer = (by[0] * inner + by[1] * lower for by in (self.upper_by, self.outer_by))
        return upper, outer

    def accelerations(self, rates: tuple[Value, Value], inner: Value, lower: Value) -> tuple[Value, Value]:
        """Return the second derivatives of psi and chi; those of theta2 and theta3 are given."""
        upper, outer = self.rates(*rates)
        turned = (rates[0] * rates[0], rates[1] * rates[1], outer * outer, upper * upper)
        upper, outer = self.rates(inner, lower)
        for factors, square in zip(zip(*self.squares, strict=True), turned, strict=True):
            upper, outer = upper + factors[0] * square, outer + factors[1] * square
        return upper, outer


def directions(boom: Boom, theta2: ArrayLike, theta3: ArrayLike) -> Directions:
    """Return psi and chi, NaN where the links do not reach each other.

    Of the two ways to assemble the loop it is the one without crossed links.
    """
    theta2, theta3 = np.broadcast_arrays(np.asarray(theta2, dtype=float), np.asarray(theta3, dtype=float))
    if boom.geometry.is_parallelogram:
        return Directions(theta3, theta2)
    upper, outer = _closed(boom.geometry, (np.cos(theta2), np.sin(theta2)), (np.cos(theta3), np.sin(theta3)))
    return Directions(_near(np.arctan2(upper[1], upper[0]), theta3), _near(np.arctan2(outer[1], outer[0]), theta2))


def solved_loop(g: Geometry, inner: Unit, lower: Unit) -> Loop:
    """Return the loop at theta2 and theta3, each given by cosine and sine.

    With u(a, b) = sin(a - b), psi and chi turn at

        psi' = (L3 u(chi, theta3) theta3' - L9 u(chi, theta2) theta2') / (L5 u(chi, psi))
        chi' = (L3 u(psi, theta3) theta3' - L9 u(psi, theta2) theta2') / (L4 u(chi, psi))

    Raises:
        InfeasibleError: the links do not reach each other, or the outer link is in line with the
            upper one, so that psi does not follow theta2 and theta3; gives the angle.
    """
    upper, outer = _closed(g, inner, lower)
    sine = _sine(outer, upper)
    if not np.all(np.abs(sine) > 0.0):  # False for NaN
        raise _cannot_close(g, np.asarray(sine), inner, lower)
    by, squares = [], []
    for length, across in ((g.L5, outer), (g.L4, upper)):
        share = 1.0 / (length * sine)
        by.append((-g.L9 * share * _sine(across, inner), g.L3 * share * _sine(across, lower)))
        lengths = ((g.L9, inner), (-g.L3, lower), (-g.L4, outer), (g.L5, upper))
        squares.append(tuple(size * share * _cosine(across, link) for size, link in lengths))
    return Loop(upper, outer, by[0], by[1], (squares[0], squares[1]))


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


def within_reach(boom: Boom, q: Array, margin: float) -> Array:
    """Return q (..., 5) with theta3 moved to where the links reach each other.

    lower - inner is then `margin` [rad] within that range; positions beyond it have no loads. In a
    parallelogram nothing is moved.
    """
    g = boom.geometry
    if g.is_parallelogram:
        return q
    # pins 6 and 8 are between |L4 - L5| and L4 + L5 apart
    far, near = (
        float(np.arccos(np.clip((g.L3**2 + g.L9**2 - apart**2) / (2.0 * g.L3 * g.L9), -1.0, 1.0)))
        for apart in (g.L4 + g.L5, g.L4 - g.L5)
    )
    moved = q.copy()
    moved[..., 2] = q[..., 1] + np.clip(q[..., 2] - q[..., 1], near + margin, far - margin)
    return moved


def require_closed(boom: Boom, q: Array) -> Array:
    """Return psi (...) at q (..., 5).

    Raises:
        InfeasibleError: the links do not reach each other; gives the angle.
    """
    psi = directions(boom, q[..., 1], q[..., 2]).upper
    if np.isnan(psi).any():
        raise _cannot_close(boom.geometry, psi, *_units(q))
    return psi


def rates(boom: Boom, q: Array, qd: Array) -> Directions:
    """Return the rates of psi and chi [rad/s] at joint velocities qd (..., 5)."""
    if boom.geometry.is_parallelogram:
        return Directions(qd[..., 2], qd[..., 1])
    return Directions(*map(np.asarray, solved_loop(boom.geometry, *_units(q)).rates(qd[..., 1], qd[..., 2])))


def accelerations(boom: Boom, q: Array, qd: Array, qdd: Array) -> Directions:
    """Return the second derivatives of psi and chi [rad/s^2], from the loop's second derivative."""
    if boom.geometry.is_parallelogram:
        return Directions(qdd[..., 2], qdd[..., 1])
    loop = solved_loop(boom.geometry, *_units(q))
    return Directions(*map(np.asarray, loop.accelerations((qd[..., 1], qd[..., 2]), qdd[..., 1], qdd[..., 2])))


def length_derivatives(boom: Boom, q: Array) -> Array:
    """Return d psi/d (L3, L4, L5, L9) (..., 4) [rad/m] at constant theta2 and theta3."""
    g, at = boom.geometry, directions(boom, q[..., 1], q[..., 2])
    moved = (np.cos(at.outer - q[..., 2]), np.ones_like(at.outer), -np.cos(at.outer - at.upper), -np.cos(at.outer - q[..., 1]))
    slope: Array = np.stack(moved, axis=-1) / (g.L5 * np.sin(at.outer - at.upper))[..., None]
    return slope


def _units(q: Array) -> tuple[Unit, Unit]:
    return (np.cos(q[..., 1]), np.sin(q[..., 1])), (np.cos(q[..., 2]), np.sin(q[..., 2]))


def _closed(g: Geometry, inner: Unit, lower: Unit) -> tuple[Unit, Unit]:
    """Return cosine and sine of psi and chi, NaN where the links do not reach each other.

    Pin 7 lies L5 from pin 8 and L4 from pin 6; Heron's formula gives its distance from the line
    between them.
    """
    x, z = g.L3 * lower[0] - g.L9 * inner[0], g.L3 * lower[1] - g.L9 * inner[1]  # from pin 8 to pin 6
    square = x * x + z * z
    area = ((g.L4 + g.L5) ** 2 - square) * (square - (g.L4 - g.L5) ** 2)
    ahead = _sine(lower, inner)
    height: Value
    if isinstance(area, float):
        height = area**0.5 if area >= 0.0 else nan
        height, share = height if ahead >= 0.0 else -height, 0.5 / max(square, _TINY)
    else:
        height = np.where(ahead >= 0.0, 1.0, -1.0) * np.sqrt(np.where(area >= 0.0, area, np.nan))
        share = 0.5 / np.maximum(square, _TINY)
    along, across = share * (square + (g.L5 - g.L4) * (g.L5 + g.L4)), share * height
    upper = along * x + across * z, along * z - across * x
    outer = (upper[0] - x) / g.L4, (upper[1] - z) / g.L4
    return (upper[0] / g.L5, upper[1] / g.L5), outer


def _sine(a: Unit, b: Unit) -> Value:
    """Return the sine of the angle a - b."""
    return a[1] * b[0] - a[0] * b[1]


def _cosine(a: Unit, b: Unit) -> Value:
    return a[0] * b[0] + a[1] * b[1]


def _cannot_close(g: Geometry, sine: Array, inner: Unit, lower: Unit) -> InfeasibleError:
    """Return the error for the first state whose sine of outer less upper angle is NaN or 0."""
    bad = np.isnan(sine) | (sine == 0.0)
    delta = np.mod(np.degrees(np.arctan2(_sine(lower, inner), _cosine(lower, inner))) + 90.0, 360.0) - 90.0
    at = float(np.broadcast_to(delta, sine.shape)[bad].flat[0])
    why = "do not reach each other" if np.isnan(sine).any() else "bring the outer link in line with the upper one"
    lengths = f"L3 {g.L3:.6g}, L4 {g.L4:.6g}, L5 {g.L5:.6g} and L9 {g.L9:.6g} m"
    return InfeasibleError(f"the linkage cannot close at lower - inner = {at:.6g} deg: {lengths} {why}")


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
