"""Redundancy resolution along a whole curve of the tip.

At constant pitch, every point of the curve leaves a self-motion of one parameter, theta2
(`boom_model.kinematics.families`). A choosing constraint has a best member at each point, but the
curve of these members has kinks and jumps. Here the choice is made for the whole curve, in four
steps for each side of the base:

1. Dynamic programming on a grid (s, theta2) finds the connected curve of least cost within the
   limits. The cost is that of the constraint plus a cost of joint travel.
2. A corridor surrounds this curve: the interval of theta2 within the limits at each s.
3. Projected Newton steps smooth theta2(s) inside the corridor. They minimise

       sum of (q' / (v T))^2 + (q'' / (a T^2))^2 + (q''' / (j T^3))^2  +  weight (theta2 - wish)^2

   where v, a, j are the joints' limits and `wish` is the constraint's best member. The weight is
   the largest of a fixed list for which the curve is fast enough.
4. A curve is fast enough if its duration is at most SLOWER times the shortest duration of the
   curves with fixed elevation or fixed extension along the same line.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from boom_model import Boom, inverse_dynamics
from boom_model.arrays import Array, Mask
from boom_model.drives.limits import rotors, static_limits
from boom_model.golden_section import golden_section
from boom_model.kinematics.closure import closed_by_angle, closed_by_extension
from boom_model.kinematics.constraints import ChoosingConstraint, LeastTime
from boom_model.kinematics.families import Targets, best_member, member, targets_at

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

NODES = 97
"""Number of values of s at which theta2 is chosen."""

SLOWER = 1.15
"""Largest duration of a resolved curve, as a multiple of that of the fastest simple curve."""

_GRID = 161
_STEPS = 8
"""Largest number of cells of theta2 between neighbouring s in dynamic programming."""

_TRAVEL = 0.05
_WEIGHTS = (300.0, 30.0, 3.0, 0.3, 0.03, 0.0)
_NEWTON_STEPS = 25
_FIXED = 41
_BISECTIONS = 30
_SIMPLE = 3
"""Number of simple curves of a side, the fastest ones, with which the search starts."""

_SAME = 1e-6
_FLAT = 1e-9
_HOPELESS = 1e6
_HATS = ((5, 0.3), (9, 0.15))
_FIRST_TRY = 0.2  # [rad]
_TRIES = 40
_KEPT = 5e-4
"""Distance [rad] of a smoothed curve from the corridor's ends, because splines overshoot."""


@dataclass(frozen=True, eq=False)
class Side:
    """Self-motion along the curve on one side of the base."""

    boom: Boom
    points: Array
    """(NODES, 3) tip positions at equal steps of s."""
    pitch: float
    front: bool
    """Whether the yaw points towards the tip; else the arm reaches back over the base."""
    pinned: float | None
    """theta2 at the start; None leaves it free."""

    @cached_property
    def targets(self) -> Targets:
        """Targets (NODES,) of the self-motion at the tip positions."""
        return self.targets_at(self.points)

    def targets_at(self, points: Array) -> Targets:
        """Return the self-motion's targets (n,) at tip positions (n, 3)."""
        return targets_at(self.boom, points, self.pitch, 1.0 if self.front else -1.0)

    @cached_property
    def grid(self) -> Array:
        """Values of theta2 (_GRID,) in dynamic programming."""
        return np.linspace(self.boom.limits.lower[1], self.boom.limits.upper[1], _GRID)

    @cached_property
    def members(self) -> Array:
        """Joint positions (NODES, _GRID, 5) on the grid (s, theta2)."""
        return self.at(np.broadcast_to(self.grid, (NODES, _GRID)))

    @cached_property
    def allowed(self) -> Mask:
        """Whether each grid point is within the limits, (NODES, _GRID).

        Points beyond a jump of the yaw from one end of its range to the other are not allowed.
        """
        allowed = np.array(self.boom.limits.contain(self.members))
        yaw = self.members[:, 0, 0] if not np.isnan(self.members[:, 0, 0]).any() else np.nanmin(self.members[..., 0], axis=-1)
        jumps = np.flatnonzero(np.abs(np.diff(yaw)) > np.pi)
        if jumps.size:
            allowed[jumps[0] + 1 :] = False
        if self.pinned is not None:
            allowed[0] = np.abs(self.grid - self.pinned) <= (self.grid[1] - self.grid[0])
        return allowed

    def at(self, theta2: Array) -> Array:
        """Return joint positions (NODES, k, 5) at theta2 (NODES, k)."""
        return member(self.boom, self.targets, theta2)

    def curve(self, theta2: Array) -> Array:
        """Return joint positions (NODES, 5) at theta2 (NODES,)."""
        return self.at(theta2[:, None])[:, 0]

    def connected(self, constraint: ChoosingConstraint | None) -> Array | None:
        """Return the connected curve theta2 (NODES,) of least cost, by dynamic programming.

        Return None if no connected curve exists. Without a constraint, joint travel is the only
        cost.
        """
        allowed, q = self.allowed, self.members
        if not allowed.any(axis=-1).all():
            return None
        wish = np.zeros(allowed.shape)
        if constraint is not None:
            wish[allowed] = constraint.cost(self.boom, q[allowed])
            least = np.where(allowed, wish, np.inf).min(axis=-1, keepdims=True)
            wish = np.where(allowed, wish - least, 0.0)
            wish /= max(float(wish.max()), 1e-12)
        speed = self.boom.limits.velocity
        total = np.where(allowed[0], wish[0], np.inf)
        came = np.zeros(allowed.shape, dtype=int)
        shifts = np.arange(-_STEPS, _STEPS + 1)
        sources = np.arange(_GRID)[:, None] + shifts
        inside = (sources >= 0) & (sources < _GRID)
        sources = np.clip(sources, 0, _GRID - 1)
        for i in range(1, NODES):
            step = (q[i][:, None] - q[i - 1][sources]) / speed
            travel = NODES * _TRAVEL * np.einsum("kmj,kmj->km", step, step)
            through = np.where(inside & np.isfinite(travel), total[sources] + travel, np.inf)
            came[i] = sources[np.arange(_GRID), np.argmin(through, axis=-1)]
            total = np.where(allowed[i], through.min(axis=-1) + wish[i], np.inf)
            if not np.isfinite(total).any():
                return None
        at = np.empty(NODES, dtype=int)
        at[-1] = int(np.argmin(total))
        for i in range(NODES - 1, 0, -1):
            at[i - 1] = came[i, at[i]]
        found: Array = self.grid[at]
        return found

    @property
    def furthest(self) -> int:
        """Index of the first node that no curve within the limits reaches, or of the last."""
        reached = self.allowed[0]
        for i in range(1, NODES):
            near = np.convolve(reached, np.ones(2 * _STEPS + 1), mode="same") > 0.5
            reached = near & self.allowed[i]
            if not reached.any():
                return i
        return NODES - 1

    def corridor(self, theta2: Array) -> tuple[Array, Array]:
        """Return lower and upper end (NODES,) of the interval of theta2 within the limits.

        The interval is the one around theta2 (NODES,), a curve within the limits.
        """
        ends = []
        for sign in (-1.0, 1.0):
            reach = np.where(sign < 0.0, self.grid <= theta2[:, None], self.grid >= theta2[:, None])
            barred = reach & ~self.allowed
            beyond = np.where(barred, sign * self.grid, np.inf).min(axis=-1)  # the nearest barred grid point
            last = sign * (self.grid[0] if sign < 0.0 else self.grid[-1])
            outside = np.where(np.isfinite(beyond), beyond, last)
            steps = np.where(reach & (sign * self.grid < outside[:, None]), sign * self.grid, sign * theta2[:, None])
            inside = np.maximum(steps.max(axis=-1), sign * theta2)
            open_end = ~np.isfinite(beyond)
            for _ in range(_BISECTIONS):
                middle = (inside + outside) / 2.0
                good = np.asarray(self.boom.limits.contain(self.curve(sign * middle)))
                inside, outside = np.where(good, middle, inside), np.where(good, outside, middle)
            ends.append(sign * np.where(open_end, last, inside))
        lower, upper = ends
        room = np.minimum(_KEPT, (upper - lower) / 4.0)
        lower, upper = lower + room, upper - room
        if self.pinned is not None:
            lower[0] = upper[0] = self.pinned
        return lower, upper

    def wished(self, constraint: ChoosingConstraint, theta2: Array, lower: Array, upper: Array) -> Array:
        """Return the constraint's best member theta2 (NODES,) near a curve, by golden section.

        It is at most one grid cell from the curve and inside the corridor.
        """
        cell = self.grid[1] - self.grid[0]

        def cost(theta2: Array) -> Array:
            return constraint.cost(self.boom, self.at(theta2))

        low, high = np.clip(theta2 - cell, lower, upper), np.clip(theta2 + cell, lower, upper)
        return golden_section(cost, low, high, _BISECTIONS)

    def fixed(self) -> Array:
        """Return curves theta2 (k, NODES) of fixed elevation or extension within the limits."""
        limits, g = self.boom.limits, self.boom.geometry
        _, F, G, _ = self.targets
        found = []
        angles = np.linspace(limits.lower[2], limits.upper[2], _FIXED)[:, None]
        lengths = g.L7 + np.linspace(limits.lower[3], limits.upper[3], _FIXED)[:, None]
        for root in (1.0, -1.0):
            with np.errstate(invalid="ignore"):
                found.append(closed_by_angle(self.boom, angles, F, G, root).theta2)
                found.append(closed_by_extension(self.boom, lengths, F, G, root).theta2)
        theta2 = np.concatenate([np.atleast_2d(each) for each in found])
        theta2 = limits.lower[1] + np.mod(theta2 - limits.lower[1] + 1e-12, 2.0 * np.pi) - 1e-12
        q = np.moveaxis(self.at(theta2.T), 0, 1)
        within = np.asarray(limits.contain(q)).all(axis=-1)
        smooth = np.abs(np.diff(theta2, axis=-1)).max(axis=-1, initial=0.0) < _STEPS * (self.grid[1] - self.grid[0])
        if self.pinned is not None:
            within &= np.abs(theta2[:, 0] - self.pinned) < 1e-6
        kept: Array = theta2[within & smooth]
        return kept

    def smoothed(self, theta2: Array, wish: Array, weight: float, lower: Array, upper: Array) -> Array:
        """Return the curve theta2 (NODES,) in the corridor of least objective (see the module)."""
        from scipy.linalg import solveh_banded

        scale = 0.1  # [rad] a departure that counts as much as reaching a limit
        x = np.clip(theta2, lower, upper)
        T = float(durations(self.boom, self.curve(x)).max())
        rows = _rows(self.boom, T)

        def value(x: Array) -> tuple[float, list[Array]]:
            q = self.curve(x)
            residuals = [np.diff(q, len(stencil) - 1, axis=0) * stencil[-1] / limit for stencil, limit in rows]
            squares = sum(float((residual**2).sum()) for residual in residuals)
            return squares / NODES + weight * float((((x - wish) / scale) ** 2).mean()), residuals

        now, residuals = value(x)
        for _ in range(_NEWTON_STEPS):
            h = 1e-6
            slope = (self.curve(x + h) - self.curve(x - h)) / (2.0 * h)
            H, gradient = _normal_equations(rows, slope, residuals)
            gradient += 2.0 * weight * (x - wish) / scale**2 / NODES
            H[-1] += 2.0 * weight / scale**2 / NODES + 1e-12 * H[-1].sum()
            barred = ((x <= lower) & (gradient > 0.0)) | ((x >= upper) & (gradient < 0.0))
            if barred.all():
                break
            for d in range(1, len(H)):
                H[-1 - d, d:][barred[d:] | barred[:-d]] = 0.0
            H[-1][barred] = 1.0
            step = -solveh_banded(H, np.where(barred, 0.0, gradient))
            before, length = now, 1.0
            while length > 1e-4:
                tried = np.clip(x + length * step, lower, upper)
                new, fresh = value(tried)
                if np.isfinite(new) and new < now:
                    x, now, residuals = tried, new, fresh
                    break
                length /= 2.0
            if before - now <= 1e-6 * before:
                break
        return x


def _rows(boom: Boom, T: float) -> list[tuple[Array, Array]]:
    """Return the stencils of three derivatives, each with its limits (5,) at duration T."""
    limits = boom.limits
    stencils = [np.diff(np.eye(order + 1), order, axis=0)[0] * (NODES - 1.0) ** order for order in (1, 2, 3)]
    return list(zip(stencils, (limits.velocity * T, limits.acceleration * T**2, limits.jerk * T**3), strict=True))


def _normal_equations(rows: list[tuple[Array, Array]], slope: Array, residuals: list[Array]) -> tuple[Array, Array]:
    """Return H = 2 J'J / NODES and the gradient 2 J'r / NODES of the sum of squared residuals.

    Args:
        rows: stencils and limits, of `_rows`.
        slope: (NODES, 5) derivative of the joint positions in theta2.
        residuals: (NODES - order, 5) of each stencil.

    Returns:
        H in the upper form of `scipy.linalg.solveh_banded`, (4, NODES), and the gradient (NODES,).
    """
    H, gradient = np.zeros((len(rows) + 1, NODES)), np.zeros(NODES)
    for (stencil, limit), residual in zip(rows, residuals, strict=True):
        scaled, count = slope / limit, len(residual)
        for m, c in enumerate(stencil):
            here = scaled[m : m + count]
            gradient[m : m + count] += c * (here * residual).sum(axis=-1)
            for d, other in enumerate(stencil[m:]):
                H[-1 - d, m + d : m + d + count] += c * other * (here * scaled[m + d : m + d + count]).sum(axis=-1)
    return 2.0 / NODES * H, 2.0 / NODES * gradient


def durations(boom: Boom, q: Array) -> Array:
    """Return durations (..., 3) of curves (..., NODES, 5): cubic, quintic, jerk-limited quintic."""
    limits = boom.limits
    d1, d2, d3 = _derivatives(q)
    s = np.linspace(0.0, 1.0, NODES)
    tau = np.linspace(0.0, 1.0, 2001)
    found = []
    for law in (
        (3 * tau**2 - 2 * tau**3, 6 * tau * (1 - tau), 6 - 12 * tau, np.full_like(tau, -12.0)),
        (
            10 * tau**3 - 15 * tau**4 + 6 * tau**5,
            30 * tau**2 * (1 - tau) ** 2,
            60 * tau * (1 - 3 * tau + 2 * tau**2),
            60 * (1 - 6 * tau + 6 * tau**2),
        ),
    ):
        at = np.interp(s, law[0], tau)
        v, a, j = (np.interp(at, tau, each)[:, None] for each in law[1:])
        qd, qdd = d1 * v, d1 * a + d2 * v**2
        speed = (np.abs(qd) / limits.velocity).max(axis=(-2, -1))
        push = np.sqrt((np.abs(qdd) / limits.acceleration).max(axis=(-2, -1)))
        found.append(np.maximum(speed, push))
    qddd = d3 * v**3 + 3.0 * d2 * v * a + d1 * j
    found.append(np.maximum(found[-1], np.cbrt((np.abs(qddd) / limits.jerk).max(axis=(-2, -1)))))
    return np.stack(found, axis=-1)


def _derivatives(q: Array) -> tuple[Array, Array, Array]:
    h = 1.0 / (NODES - 1)
    d1 = np.gradient(q, h, axis=-2, edge_order=2)
    d2 = np.gradient(d1, h, axis=-2, edge_order=2)
    d2[..., 1:-1, :] = (q[..., 2:, :] - 2.0 * q[..., 1:-1, :] + q[..., :-2, :]) / h**2
    d2[..., 0, :], d2[..., -1, :] = d2[..., 1, :], d2[..., -2, :]
    d3 = np.gradient(d2, h, axis=-2)
    return d1, d2, d3


def travel_time(boom: Boom, q: Array) -> Array:
    """Return the least travel time (...) of curves (..., NODES, 5).

    The limits are joint velocity, joint acceleration and the drives' torque at standstill. With
    x = s'^2 and u = s'', each limit has the form |A u + B x + C| <= L
    (`planner.timing.path_limits`). A backward and a forward pass over s give the largest x. The
    time is infinite if a drive cannot hold the static load.
    """
    d1, d2, _ = _derivatives(q)
    zero = np.zeros_like(q)
    still, pushed, carried = (
        inverse_dynamics(boom, q, qd, qdd, reactions=False).tau for qd, qdd in ((zero, zero), (zero, d1), (d1, d2))
    )
    inertia, drives = rotors(boom), static_limits(boom)
    driven = np.isfinite(drives)
    A = np.concatenate([d1, (pushed - still + inertia * d1)[..., driven]], axis=-1)
    B = np.concatenate([d2, (carried - still + inertia * d2)[..., driven]], axis=-1)
    C = np.concatenate([zero, still[..., driven]], axis=-1)
    L = np.concatenate([boom.limits.acceleration, drives[driven]])
    possible = (np.abs(C) < L).all(axis=(-2, -1))
    A = np.where(np.abs(A) < _FLAT, np.where(A < 0.0, -_FLAT, _FLAT), A)
    lower, upper = (np.where(A > 0.0, way * L - C, -way * L - C) / A for way in (-1.0, 1.0))  # of u at x = 0
    slope = -B / A
    step = 1.0 / (NODES - 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        most = ((boom.limits.velocity / np.abs(d1)) ** 2).min(axis=-1)
        gap = upper[..., None, :] - lower[..., :, None]
        steepness = slope[..., :, None] - slope[..., None, :]
        meet = np.where(steepness > 0.0, gap / steepness, np.inf).min(axis=(-2, -1))
    most = np.minimum(np.minimum(most, np.where(possible[..., None], meet, 0.0)), 1e9)
    x = most.copy()
    x[..., 0] = x[..., -1] = 0.0
    for i in range(NODES - 2, -1, -1):  # slow enough to brake in time
        rate = 1.0 + 2.0 * step * slope[..., i, :]
        room = x[..., i + 1, None] - 2.0 * step * lower[..., i, :]
        bound = np.where(rate > 0.0, room / np.where(rate > 0.0, rate, 1.0), np.inf).min(axis=-1)
        x[..., i] = np.clip(np.minimum(x[..., i], bound), 0.0, None)
    for i in range(NODES - 1):  # as fast as the limits on u allow
        push = (upper[..., i, :] + slope[..., i, :] * x[..., i, None]).min(axis=-1)
        x[..., i + 1] = np.clip(np.minimum(x[..., i + 1], x[..., i] + 2.0 * step * push), 0.0, None)
    root = np.sqrt(x)
    with np.errstate(divide="ignore"):
        time: Array = (2.0 * step / (root[..., 1:] + root[..., :-1])).sum(axis=-1)
    return np.where(possible, time, np.inf)


def sides_of(boom: Boom, points: Array, pitch: float, pinned: Array | None = None) -> list[Side]:
    """Return the self-motion along a curve of the tip, in front of the base and over it.

    Args:
        boom: the boom.
        points: (NODES, 3) tip positions.
        pitch: [rad]
        pinned: (5,) joint position at the first point; only the side that it is on is returned.
            None leaves the start free.
    """
    sides = [Side(boom, points, pitch, front, None) for front in (True, False)]
    if pinned is None:
        return sides
    theta2 = np.full((NODES, 1), pinned[1])
    return [replace(side, pinned=float(pinned[1])) for side in sides if np.abs(side.at(theta2)[0, 0] - pinned).max() < _SAME]


@dataclass(frozen=True)
class Departure:
    """Difference between a resolved curve and the constraint's best member at each point."""

    constraint: str
    most: float
    """Largest difference of the constraint's cost, in `unit`."""
    s: float
    """Parameter of the curve at the largest difference."""
    unit: str

    @property
    def sentence(self) -> str:
        """Description for a report."""
        return f"smoothing costs {self.constraint} up to {self.most:.3g} {self.unit}, at {self.s:.0%} of the path"


@dataclass(frozen=True, eq=False)
class SelfMotion:
    """Smooth curve through the self-motion: theta2(s) and the resulting joint positions."""

    side: Side
    theta2: Array
    """(NODES,) at equal steps of s"""

    def __call__(self, points: Array, s: Array) -> Array:
        """Return joint positions (n, 5) at s (n,), where the tip is at points (n, 3)."""
        theta2 = self._spline(s)
        targets = self.side.targets_at(points)
        return member(self.side.boom, targets, theta2[:, None])[:, 0]

    @cached_property
    def _spline(self) -> "BSpline":
        from scipy.interpolate import make_interp_spline

        return make_interp_spline(np.linspace(0.0, 1.0, NODES), self.theta2, k=5)

    def departure(self, boom: Boom, constraint: ChoosingConstraint) -> Departure:
        """Return the largest difference from the constraint's best member at the nodes.

        The best member is that on the same side of the base.
        """
        chosen, exists = best_member(boom, self.side.targets, constraint)
        q = self.side.curve(self.theta2)
        excess = constraint.cost(boom, q) - np.where(exists, constraint.cost(boom, np.where(exists[:, None], chosen, q)), 0.0)
        at = int(np.argmax(excess))
        return Departure(str(constraint), max(float(excess[at]), 0.0), at / (NODES - 1), constraint.unit)


def resolve(sides: list[Side], constraint: ChoosingConstraint | LeastTime, reference: Array) -> SelfMotion | None:
    """Return the smooth curve nearest to a constraint's choice among those that are fast enough.

    If none is fast enough, return the fastest. Return None if no connected curve exists.

    Args:
        sides: of the base, from `sides_of`.
        constraint: the choosing constraint. With LeastTime the fastest curve is returned.
        reference: (5,) joint position; the side whose curve starts nearest to it is tried first.
    """
    seeds = _seeds(sides, None if isinstance(constraint, LeastTime) else constraint, reference)
    if isinstance(constraint, LeastTime):
        return _quickest(seeds)
    quickest = np.min([np.full(3, np.inf), *(each.durations for each in seeds)], axis=0)
    if not np.isfinite(quickest).all():  # no simple curve exists: compare with the smoothest
        quickest = np.min([np.full(3, np.inf), *(_smoothest(each) for each in seeds)], axis=0)
    best, least = None, np.inf
    for seed in seeds:
        for motion, lasts in _ladder(seed, constraint):
            ratio = float((lasts / quickest).max())
            if ratio <= SLOWER:
                return motion
            if ratio < least:
                best, least = motion, ratio
    return best


@dataclass(frozen=True, eq=False)
class _Seed:
    """Starting curves of the search on one side of the base."""

    side: Side
    curves: list[Array]
    """Connected curves theta2 (NODES,) within the limits: first the constraint's own, then the
    fastest simple ones."""
    durations: Array
    """(3,) shortest durations of the simple curves; infinite without one."""


def _seeds(sides: list[Side], constraint: ChoosingConstraint | None, reference: Array) -> list[_Seed]:
    seeds = []
    for side in sides:
        found = side.connected(constraint)
        if found is None:
            continue
        simple = side.fixed()
        lasts = durations(side.boom, np.moveaxis(side.at(simple.T), 0, 1)) if len(simple) else np.full((0, 3), np.inf)
        order = np.argsort(lasts.sum(axis=-1), kind="stable")[:_SIMPLE]
        seeds.append(_Seed(side, [found, *simple[order]], lasts.min(axis=0, initial=np.inf)))
    if not seeds:
        return []
    limits = seeds[0].side.boom.limits
    span = np.where(limits.upper > limits.lower, limits.upper - limits.lower, 1.0)

    def distance(seed: _Seed) -> float:
        return float((np.abs(seed.side.curve(seed.curves[0])[0] - reference) / span).max())

    return sorted(seeds, key=distance)


def _smoothest(seed: _Seed) -> Array:
    """Return the durations (3,) of the smoothest curve around a side's connected one."""
    side, curve = seed.side, seed.curves[0]
    return durations(side.boom, side.curve(side.smoothed(curve, curve, 0.0, *side.corridor(curve))))


def _ladder(seed: _Seed, constraint: ChoosingConstraint) -> Iterator[tuple[SelfMotion, Array]]:
    """Yield curves of a side with their durations (3,), from nearest to the wish to smoothest."""
    side = seed.side
    for number, curve in enumerate(seed.curves[:2]):
        lower, upper = side.corridor(curve)
        wish = side.wished(constraint, np.clip(curve, lower, upper), lower, upper)
        x = curve
        for weight in _WEIGHTS:
            x = side.smoothed(x, wish, weight, lower, upper)
            yield SelfMotion(side, x), durations(side.boom, side.curve(x))
        if number:
            yield SelfMotion(side, curve), durations(side.boom, side.curve(curve))


def _quickest(seeds: list[_Seed]) -> SelfMotion | None:
    """Return the curve of least `travel_time`; None without a starting curve.

    A pattern search improves the best of the smoothed and simple curves.
    """
    found = []
    for seed in seeds:
        for curve in seed.curves:
            lower, upper = seed.side.corridor(curve)
            found.append((seed.side, np.clip(curve, lower, upper), lower, upper))
            found.append((seed.side, seed.side.smoothed(curve, curve, 0.0, lower, upper), lower, upper))
    if not found:
        return None
    times = [float(_time(side, x)) for side, x, _, _ in found]
    side, x, lower, upper = found[int(np.argmin(times))]
    least = float(min(times))
    s = np.linspace(0.0, 1.0, NODES)
    hats = np.array(
        [np.exp(-(((s - center) / width) ** 2)) for count, width in _HATS for center in np.linspace(0.0, 1.0, count)]
    )
    size = _FIRST_TRY
    for _ in range(_TRIES):
        tried = np.clip(np.concatenate([x + size * hats, x - size * hats]), lower, upper)
        lasts = _time(side, tried)
        at = int(np.argmin(lasts))
        if lasts[at] < least * (1.0 - 1e-5):
            x, least = tried[at], float(lasts[at])
        else:
            size /= 2.0
    return SelfMotion(side, x)


def _time(side: Side, theta2: Array) -> Array:
    """Return a time (...) by which curves theta2 (..., NODES) are compared.

    It is `travel_time`. Where a drive cannot hold the load, it is a much longer time that depends
    on the joint limits.
    """
    q = side.curve(theta2) if theta2.ndim == 1 else np.moveaxis(side.at(theta2.T), 0, 1)
    time = travel_time(side.boom, q)
    return np.where(np.isfinite(time), time, _HOPELESS + durations(side.boom, q).max(axis=-1))
