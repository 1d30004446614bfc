"""Paths parametrised by s from 0 to 1: straight in joint space, through waypoints, or along a line or an arc of the tip."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import ArrayLike

from boom_model import Boom, ConstraintHold, Hold, InfeasibleError, InputError, forward_kinematics, solve_branches
from boom_model.arrays import Array, Mask, checked, read_only, scalar
from planner.paths.targets import unreachable

if TYPE_CHECKING:
    from scipy.interpolate import BSpline, PPoly

TIP_TOLERANCE = 1e-5
"""How far [m] a spline may leave its line; a tenth of what a sweep is asked to keep."""

_NODES = (64, 128, 256, 512, 1024, 2048)
_CHECKS_PER_NODE = 8
_BISECTIONS = 50
_LOOKS = 4001
_INSET = 1e-4 * np.array([0.0, 1.0, 1.0, 1.0, 1.0])  # [rad or m]; a target leaves no choice of yaw
_FLIP = 0.25
"""A step between neighbouring nodes of more than this, as a share of a joint's range, is a flip to another branch."""


class Path(Protocol):
    """A smooth map from s in [0, 1] to joint positions."""

    def __call__(self, s: ArrayLike, order: int = 0) -> Array:
        """The derivative of the given order (0 to 3) with respect to s, shape (..., 5) for s of shape (...)."""
        ...

    @property
    def knots(self) -> Array:
        """Where inside (0, 1) a derivative up to the third may jump."""
        ...


@dataclass(frozen=True, eq=False)
class JointLine:
    """Straight line in joint space, q(s) = start + s (goal - start).

    Every position limit, the coupled one included, is linear in q: a line between two poses within them stays within them.
    """

    start: Array
    goal: Array

    def __call__(self, s: ArrayLike, order: int = 0) -> Array:
        s = np.asarray(s, dtype=float)[..., None]
        if order == 0:
            line: Array = (1.0 - s) * self.start + s * self.goal  # exact at both ends
            return line
        slope = self.goal - self.start if order == 1 else np.zeros(5)
        return np.broadcast_to(slope, (*s.shape[:-1], 5))

    @property
    def knots(self) -> Array:
        return np.empty(0)


@dataclass(frozen=True, eq=False)
class TipLine:
    """Straight line of the tip from start to goal, (3,) each [m]."""

    start: Array
    goal: Array

    def __call__(self, s: Array) -> Array:
        """Positions (..., 3) at s (...)."""
        s = np.asarray(s, dtype=float)[..., None]
        line: Array = (1.0 - s) * self.start + s * self.goal
        return line

    @property
    def length(self) -> float:
        return float(np.linalg.norm(self.goal - self.start))


@dataclass(frozen=True, eq=False)
class TipArc:
    """Arc of a circle of the tip, at constant speed: center + radius (cos(s angle) first + sin(s angle) second)."""

    center: Array
    first: Array
    """(3,) unit vector from the center to the start"""
    second: Array
    """(3,) unit vector across it in the circle's plane, the way the arc starts"""
    radius: float
    angle: float
    """[rad]"""

    @staticmethod
    def through(start: ArrayLike, via: ArrayLike, goal: ArrayLike) -> "TipArc":
        """The arc from start by via to goal, (3,) each [m].

        Raises:
            InputError: not finite, or the three lie on a line.
        """
        a, b, c = (checked(name, p, 3) for name, p in (("start", start), ("via", via), ("goal", goal)))
        u, v = b - a, c - a
        normal = np.cross(u, v)
        square = float(normal @ normal)
        if square <= 1e-12 * float((u @ u) * (v @ v)):
            raise InputError(f"via {b.tolist()} lies on a line with start and goal; an arc needs three points of a circle")
        center = a + ((v @ v) * np.cross(normal, u) + (u @ u) * np.cross(v, normal)) / (2.0 * square)
        radius = float(np.linalg.norm(a - center))
        first = (a - center) / radius
        second = np.cross(normal / np.sqrt(square), first)
        angle = float(np.arctan2((c - center) @ second, (c - center) @ first) % (2.0 * np.pi))
        return TipArc(read_only(center), read_only(first), read_only(second), radius, angle)

    def __call__(self, s: Array) -> Array:
        """Positions (..., 3) at s (...)."""
        turn = np.asarray(s, dtype=float)[..., None] * self.angle
        arc: Array = self.center + self.radius * (np.cos(turn) * self.first + np.sin(turn) * self.second)
        return arc

    @property
    def length(self) -> float:
        return self.radius * self.angle


TipCurve = TipLine | TipArc


@dataclass(frozen=True, eq=False)
class TipPath:
    """Joint path that follows a curve of the tip at constant pitch: a quintic spline through exact inverse kinematics."""

    curve: TipCurve
    pitch: float
    spline: "BSpline"
    deviation: float
    """Largest distance [m] of the tip from the curve, on a grid eight times as fine as the spline's nodes."""

    def __call__(self, s: ArrayLike, order: int = 0) -> Array:
        return np.asarray(self.spline(np.clip(s, 0.0, 1.0), order))

    @property
    def knots(self) -> Array:
        return np.empty(0)  # of a quintic spline the fourth derivative is continuous

    @property
    def sentence(self) -> str:
        """What a report says of it."""
        kind = "line" if isinstance(self.curve, TipLine) else "arc"
        return f"the tip follows a {kind} of {self.curve.length:.4g} m to within {self.deviation * 1e3:.3g} mm"


@dataclass(frozen=True, eq=False)
class SplinePath:
    """Joint path through waypoints without a stop, twice continuously differentiable unless said otherwise."""

    spline: "PPoly"
    waypoints: Array
    """(n, 5), start and goal included"""

    def __call__(self, s: ArrayLike, order: int = 0) -> Array:
        return np.asarray(self.spline(np.clip(s, 0.0, 1.0), order))

    @property
    def knots(self) -> Array:
        return np.asarray(self.spline.x[1:-1])

    @property
    def sentence(self) -> str:
        """What a report says of it."""
        return f"through {len(self.waypoints) - 2} waypoint(s) without a stop, by a spline"


def through(boom: Boom, waypoints: Array) -> SplinePath:
    """The joint path through waypoints (n, 5) in turn, without corners.

    A natural cubic spline whose parameter between two waypoints is in proportion to the time that the joints' top speeds need
    there. Where it would overshoot a position limit, a quintic one with monotone (PCHIP) slopes and no curvature at the
    waypoints, which turns back at a joint's extremes and not beyond them: without curvature at either end, a quintic is
    monotone where both its end slopes are within 5/4 of its mean slope.

    Raises:
        InfeasibleError: both leave the position limits; names the joint, the place and the excess.
    """
    from scipy.interpolate import BPoly, CubicSpline, PchipInterpolator, PPoly

    knots = spaced(boom, waypoints)
    smooth = SplinePath(CubicSpline(knots, waypoints, bc_type="natural"), waypoints)
    if overshoot(boom, smooth) is None:
        return smooth
    means = np.abs(np.diff(waypoints, axis=0)) / np.diff(knots)[:, None]
    most = 1.25 * np.minimum(means[[0, *range(len(means))]], means[[*range(len(means)), -1]])
    slopes = np.clip(PchipInterpolator(knots, waypoints)(knots, 1), -most, most)
    given = np.stack([waypoints, slopes, np.zeros_like(slopes)], axis=1)
    tight = SplinePath(PPoly.from_bernstein_basis(BPoly.from_derivatives(knots, given)), waypoints)
    beyond = overshoot(boom, tight)
    if beyond is None:
        return tight
    raise InfeasibleError(
        f"no smooth path through the waypoints stays within the limits: {beyond}; stop at one of them instead"
    )


def spaced(boom: Boom, waypoints: Array) -> Array:
    """Knots (n,) from 0 to 1, spaced as the joints' top speeds need between waypoints (n, 5)."""
    needed = (np.abs(np.diff(waypoints, axis=0)) / boom.limits.velocity).max(axis=-1)
    knots: Array = np.append(0.0, np.cumsum(needed)) / needed.sum()
    knots[-1] = 1.0
    return knots


def overshoot(boom: Boom, path: Path) -> str | None:
    """Where a path is farthest outside the position limits, in a sentence; None where it stays within them."""
    s = np.linspace(0.0, 1.0, _LOOKS)
    q = path(s)
    excess = boom.limits.excess(q).max(axis=-1)
    at = int(np.argmax(excess))
    reasons = boom.limits.reasons(q[at])
    return f"at {s[at]:.1%}, {'; '.join(reasons)}" if reasons else None


def follow(
    boom: Boom, curve: TipCurve, pitch: float, hold: Hold, reference: ArrayLike | None = None, tolerance: float = TIP_TOLERANCE
) -> TipPath:
    """The joint path along a curve of the tip, on one branch from end to end.

    The branch is the one nearest to `reference` at the start, and from node to node the one nearest to the last. Nodes are
    doubled until the tip stays within `tolerance` of the curve between them.

    Args:
        pitch: of the end effector all along [rad].
        hold: constraint or choice, applied at every node.
        reference: (5,); None is the middle of the joint ranges.
        tolerance: [m]

    Raises:
        InputError: pitch is not finite.
        InfeasibleError: the curve leaves the reach (where), forces a flip to another branch (where), or no spline within
            2048 nodes keeps the tolerance (the hold's choice jumps or kinks).
    """
    from scipy.interpolate import make_interp_spline

    pitch = scalar("pitch", pitch)
    limits = boom.limits
    start = (limits.lower + limits.upper) / 2.0 if reference is None else checked("reference", reference, 5)
    deviation = np.inf
    planned = boom if isinstance(hold, ConstraintHold) else _inset(boom)
    for nodes in _NODES:
        s = np.linspace(0.0, 1.0, nodes + 1)
        spline = make_interp_spline(s, _one_branch(boom, planned, curve, pitch, hold, s, start), k=5)
        fine = np.linspace(0.0, 1.0, nodes * _CHECKS_PER_NODE + 1)
        q = spline(fine)
        deviation = float(np.linalg.norm(forward_kinematics(boom, q).position - curve(fine), axis=-1).max())
        if deviation <= tolerance and limits.hold(q).all():
            return TipPath(curve, pitch, spline, deviation)
    raise InfeasibleError(
        f"no smooth joint path keeps the tip within {tolerance * 1e3:g} mm of its line under hold {hold}: "
        f"{_NODES[-1]} nodes leave {deviation * 1e3:.3g} mm, as the hold's choice jumps or kinks on the way"
    )


def _inset(boom: Boom) -> Boom:
    """The boom with its position limits drawn in: where a choice leaves a limit that it kept to, its spline overshoots."""
    lower, upper = boom.limits.lower + _INSET, boom.limits.upper - _INSET
    return replace(boom, limits=replace(boom.limits, lower=lower, upper=upper, linkage=boom.limits.linkage + 2.0 * _INSET[2]))


def _one_branch(boom: Boom, planned: Boom, curve: TipCurve, pitch: float, hold: Hold, s: Array, start: Array) -> Array:
    """q (n, 5) at s (n,), each on the branch nearest to the one before: of all starts that go through, the nearest."""
    found = solve_branches(planned, curve(s), pitch, hold)
    if not found.within_limits.any(axis=-1).all():
        truly = np.asarray(solve_branches(boom, curve(s), pitch, hold).within_limits.any(axis=-1))
        if truly.all():  # beyond the limits as they are drawn in, by less than anybody could use
            boom, truly = planned, np.asarray(found.within_limits.any(axis=-1))
        raise InfeasibleError(_leaves(boom, curve, pitch, hold, s, truly))
    span = np.where(boom.limits.upper > boom.limits.lower, boom.limits.upper - boom.limits.lower, 1.0)
    starts = found.q[0][found.within_limits[0]]
    starts = starts[np.argsort(np.abs((starts - start) / span).max(axis=-1))]
    broken = 0
    for first in starts:
        path, last = np.empty((len(s), 5)), first
        for i, (q, allowed) in enumerate(zip(found.q, found.within_limits, strict=True)):
            steps = np.where(allowed, np.abs((q - last) / span).max(axis=-1), np.inf)
            best = int(np.argmin(steps))
            if steps[best] > _FLIP:
                broken = max(broken, i)
                break
            path[i] = last = q[best]
        else:
            return path
    at = ", ".join(f"{x:.4g}" for x in curve(s[broken]))
    raise InfeasibleError(f"the tip's line forces a flip to another branch under hold {hold} at {s[broken]:.1%}, ({at}) m")


def _leaves(boom: Boom, curve: TipCurve, pitch: float, hold: Hold, s: Array, reached: Mask) -> str:
    """Where a curve leaves the reach, by bisection beside its first node out of reach."""
    out = int(np.argmin(reached))
    if out == 0:
        return f"the tip's line starts out of reach: {unreachable(boom, curve(s[0]), pitch, hold)}"
    inside, outside = float(s[out - 1]), float(s[out])
    for _ in range(_BISECTIONS):
        middle = (inside + outside) / 2.0
        within = solve_branches(boom, curve(np.array(middle)), pitch, hold).within_limits.any()
        inside, outside = (middle, outside) if within else (inside, middle)
    at = ", ".join(f"{x:.6g}" for x in curve(np.array(inside)))
    return f"the tip's line leaves the reach at {inside:.2%}, ({at}) m: {unreachable(boom, curve(s[out]), pitch, hold)}"
