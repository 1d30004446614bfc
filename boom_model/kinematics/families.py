"""Family of joint positions that reach a target, and its best member under a choosing constraint.

At a given tip position and pitch the arm has a self-motion of one parameter, theta2.
With W = (F, G) of `closure` and V = W - L9 e(theta2),

    rho = sqrt(|V|^2 - L6^2),   theta3 = angle(-V) - atan2(L6, rho),   theta5 = phi - theta3.

The values of theta2 at which a limit is reached have a closed form. For limits of the extension and
of the actuator's angle it is that of the inverse kinematics. For the coupled limit, on the angle
delta between lower and inner link, it follows from

    |W|^2 = (L9 - rho cos(delta) + L6 sin(delta))^2 + (rho sin(delta) + L6 cos(delta))^2.

Between two neighbouring values the family is either entirely within the limits or entirely outside,
so the feasible intervals are exact. The least cost is at an end of an interval, at a stationary
point in closed form, or at a minimum that a scan of the whole interval finds and golden section
refines.

Where the linkage is no parallelogram, theta3 above is the actuator's direction, and the limits of
the lower link are found on a grid of theta2 and by bisection: a feasible interval shorter than a
step of the grid can be missed.
"""

from typing import NamedTuple

import numpy as np

from boom_model.arrays import Array, Mask
from boom_model.boom import Boom
from boom_model.golden_section import golden_section
from boom_model.kinematics.closure import closed_by_angle, closed_by_extension, turned_into_limits
from boom_model.kinematics.constraints import ChoosingConstraint, LeastExtension, NearestHorizontal
from boom_model.kinematics.linkage import lower_angle

_SCAN = 64
_REFINEMENTS = 60
_GRID = 121  # values of theta2 at which a linkage of unequal links is tried: 1 deg apart on the shipped boom


class Targets(NamedTuple):
    """Targets, each with its side of the base; all arrays have shape (n,)."""

    theta1: Array
    F: Array
    G: Array
    phi: Array


def targets_at(boom: Boom, position: Array, pitch: Array | float, side: Array | float) -> Targets:
    """Return the targets of tip positions (..., 3) at pitches (...), on a side of the base.

    Args:
        boom: the boom.
        position: of the tip in frame 1 [m].
        pitch: [rad]
        side: 1 where the yaw points towards the tip, -1 where the arm reaches over the base; it
            broadcasts.
    """
    g = boom.geometry
    x, y, z = np.moveaxis(position, -1, 0)
    F = side * np.hypot(x, y) - g.L2 - g.L8 * np.cos(pitch)
    G = z - g.L1 - g.L8 * np.sin(pitch)
    theta1 = np.arctan2(y, x) + np.where(np.asarray(side) < 0.0, np.pi, 0.0)
    theta1, G, phi = (np.broadcast_to(each, F.shape) for each in (theta1, G, np.asarray(pitch) - np.pi / 2.0))
    return Targets(theta1, F, G, phi)


def member(boom: Boom, targets: Targets, theta2: Array) -> Array:
    """Return the family's joint positions (n, k, 5) at theta2 (n, k).

    They are NaN where the actuator cannot close the loop.
    """
    g = boom.geometry
    theta1, F, G, phi = (x[:, None] for x in targets)
    x, z = F - g.L9 * np.cos(theta2), G - g.L9 * np.sin(theta2)
    square = x * x + z * z - g.L6**2
    rho = np.sqrt(np.where(square > 0.0, square, np.nan))
    psi = np.arctan2(-z, -x) - np.arctan2(g.L6, rho)
    theta3 = lower_angle(boom, theta2, psi)
    q = np.stack(np.broadcast_arrays(theta1, theta2, theta3, rho - g.L7, phi - psi), axis=-1)
    return turned_into_limits(boom, q)


def best_member(boom: Boom, targets: Targets, constraint: ChoosingConstraint) -> tuple[Array, Mask]:
    """Return the member of least cost within the limits (n, 5), and whether there is one (n,)."""
    ends = _ends(boom, targets, constraint)
    if not boom.geometry.is_parallelogram:
        ends = _with_boundaries(boom, targets, ends)
    at_ends = member(boom, targets, ends)
    best, cost = _least(boom, constraint, at_ends, ends)
    if not isinstance(constraint, LeastExtension | NearestHorizontal):  # their minimum is at an end
        best, cost = _inside(boom, targets, constraint, ends, best, cost)
    exists = np.isfinite(cost)
    q = member(boom, targets, best[:, None])[:, 0]
    q[~exists] = np.nan
    return q, exists


def _ends(boom: Boom, targets: Targets, constraint: ChoosingConstraint) -> Array:
    """Return candidate values of theta2 (n, k) within its own limits, in increasing order.

    They are the values at which a limit is reached, and the stationary points of costs that have a
    closed form.
    """
    limits, g = boom.limits, boom.geometry
    _, F, G, phi = targets
    lower, upper = limits.lower, limits.upper
    angles = [np.full_like(F, lower[2]), np.full_like(F, upper[2]), phi - lower[4], phi - upper[4]]
    deltas = [limits.linkage]
    points = [np.full_like(F, lower[1]), np.full_like(F, upper[1])]
    if isinstance(constraint, LeastExtension):
        points.append(np.arctan2(G, F))  # the inner link points at the wrist
    if isinstance(constraint, NearestHorizontal):
        angles.append(np.full_like(F, np.pi))
        deltas += [np.pi / 2.0, -np.pi / 2.0]  # theta3 is stationary there
    for root in (1.0, -1.0):
        for rho in (g.L7 + lower[3], g.L7 + upper[3]):
            points.append(closed_by_extension(boom, np.full_like(F, rho), F, G, root).theta2)
        points += [closed_by_angle(boom, angle, F, G, root).theta2 for angle in angles]
        points += [_at_linkage_angle(boom, F, G, delta, root) for delta in deltas]
    theta2 = np.stack(points, axis=-1)
    theta2 = lower[1] + np.mod(theta2 - lower[1] + 1e-12, 2.0 * np.pi) - 1e-12
    theta2 = np.where((theta2 >= lower[1] - 1e-12) & (theta2 <= upper[1] + 1e-12), theta2, lower[1])
    return np.sort(np.clip(theta2, lower[1], upper[1]), axis=-1)


def _with_boundaries(boom: Boom, targets: Targets, ends: Array) -> Array:
    """Return candidate values of theta2 with those where the lower link reaches a limit."""
    limits = boom.limits
    grid = np.broadcast_to(np.linspace(limits.lower[1], limits.upper[1], _GRID), (len(ends), _GRID))
    theta2 = np.sort(np.concatenate([ends, grid], axis=-1), axis=-1)

    def within(theta2: Array) -> Mask:
        return np.asarray(limits.contain(member(boom, targets, theta2)))

    low, high = theta2[:, :-1].copy(), theta2[:, 1:].copy()
    at_low, changes = within(low), within(low) != within(high)
    for _ in range(_REFINEMENTS):
        middle = (low + high) / 2.0
        same = within(middle) == at_low
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    inside = np.where(at_low, low, high)
    return np.sort(np.concatenate([ends, np.where(changes, inside, limits.lower[1])], axis=-1), axis=-1)


def _at_linkage_angle(boom: Boom, F: Array, G: Array, delta: float, root: float) -> Array:
    """Return theta2 at which theta3 - theta2 = delta; NaN if there is no such value."""
    g = boom.geometry
    c, s = np.cos(delta), np.sin(delta)
    room = (g.L9 * c) ** 2 - (g.L9**2 + g.L6**2 + 2.0 * g.L9 * g.L6 * s - F**2 - G**2)
    rho = g.L9 * c + root * np.sqrt(np.where(room >= 0.0, room, np.nan))
    theta2: Array = np.arctan2(G, F) - np.arctan2(-rho * s - g.L6 * c, g.L9 - rho * c + g.L6 * s)
    return theta2


def _least(boom: Boom, constraint: ChoosingConstraint, q: Array, theta2: Array) -> tuple[Array, Array]:
    """Return theta2 and cost (n,) of the cheapest of members (n, k, 5) within the limits.

    The cost is infinite where no member is within the limits.
    """
    cost = _cost(boom, constraint, q)
    at = np.argmin(cost, axis=-1)[:, None]
    return np.take_along_axis(theta2, at, axis=-1)[:, 0], np.take_along_axis(cost, at, axis=-1)[:, 0]


def _cost(boom: Boom, constraint: ChoosingConstraint, q: Array) -> Array:
    allowed = np.asarray(boom.limits.contain(q))  # NaN is outside every limit
    cost = np.full(q.shape[:-1], np.inf)
    cost[allowed] = constraint.cost(boom, q[allowed])
    return cost


def _inside(
    boom: Boom, targets: Targets, constraint: ChoosingConstraint, ends: Array, best: Array, cost: Array
) -> tuple[Array, Array]:
    """Return theta2 and cost (n,) of the best member, inside a feasible interval or at its end."""
    middles = (ends[:, 1:] + ends[:, :-1]) / 2.0
    feasible = np.isfinite(_cost(boom, constraint, member(boom, targets, middles))) & (np.diff(ends, axis=-1) > 1e-9)
    row, interval = np.nonzero(feasible)
    if row.size == 0:
        return best, cost
    theirs = Targets(*(x[row] for x in targets))
    low, high = ends[row, interval], ends[row, interval + 1]
    scan = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, _SCAN + 1)
    costs = _cost(boom, constraint, member(boom, theirs, scan))
    at = np.clip(np.argmin(costs, axis=-1), 1, _SCAN - 1)
    pick = np.arange(row.size)

    def costs_at(theta2: Array) -> Array:
        return _cost(boom, constraint, member(boom, theirs, theta2))

    found = golden_section(costs_at, scan[pick, at - 1], scan[pick, at + 1], _REFINEMENTS)[:, None]
    values = costs_at(found)[:, 0]
    order = np.argsort(values)[::-1]  # the least cost of a row is written last
    better = order[values[order] < cost[row[order]]]
    best, cost = best.copy(), cost.copy()
    best[row[better]], cost[row[better]] = found[better, 0], values[better]
    return best, cost
