"""Paths over s from 0 to 1: a straight line in joint space, or a spline through waypoints."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import ArrayLike

from boom_model import Boom, InfeasibleError
from boom_model.arrays import Array

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

_LOOKS = 4001


class Path(Protocol):
    """Smooth map from s in [0, 1] to joint positions."""

    def __call__(self, s: ArrayLike, order: int = 0) -> Array:
        """Return the derivative of the given order (0 to 3) in s, shape (..., 5) for s (...)."""
        ...

    @property
    def knots(self) -> Array:
        """Values of s inside (0, 1) at which a derivative up to the third may jump."""
        ...


@dataclass(frozen=True, eq=False)
class JointLine:
    """Straight line in joint space, q(s) = start + s (goal - start).

    Every position limit, the coupled one included, is linear in q, so a line between two poses
    within the limits stays within them.
    """

    start: Array
    goal: Array

    def __call__(self, s: ArrayLike, order: int = 0) -> Array:
        """Return the derivative of the given order in s, shape (..., 5) for s (...)."""
        s = np.asarray(s, dtype=float)
        if order == 0:  # exact at both ends
            line = np.multiply.outer(self.start, 1.0 - s) + np.multiply.outer(self.goal, s)
            return np.moveaxis(line, 0, -1)
        slope = self.goal - self.start if order == 1 else np.zeros(5)
        return np.broadcast_to(slope, (*s.shape, 5))

    @property
    def knots(self) -> Array:
        """Values of s at which a derivative may jump: none."""
        return np.empty(0)


@dataclass(frozen=True, eq=False)
class SplinePath:
    """Joint path through waypoints without a stop.

    It is twice continuously differentiable unless its maker says otherwise.
    """

    spline: "PPoly"
    waypoints: Array
    """(n, 5), start and goal included."""

    def __call__(self, s: ArrayLike, order: int = 0) -> Array:
        """Return the derivative of the given order in s, shape (..., 5) for s (...)."""
        return np.asarray(self.spline(np.clip(s, 0.0, 1.0), order))

    @property
    def knots(self) -> Array:
        """Values of s at the pieces' ends, where a derivative may jump."""
        return np.asarray(self.spline.x[1:-1])

    @property
    def sentence(self) -> str:
        """Description of the path for a report."""
        return f"spline through {len(self.waypoints) - 2} waypoint(s) without a stop"


def through(boom: Boom, waypoints: Array) -> SplinePath:
    """Return a smooth joint path through waypoints (n, 5) in the given order.

    It is a natural cubic spline. Its parameter advances between two waypoints in proportion to the
    time that the joints need there at top speed. If it overshoots a position limit, it is replaced
    by a quintic spline with monotone (PCHIP) slopes and zero curvature at the waypoints, whose
    joints do not go beyond the extreme waypoints: a quintic with zero curvature at both ends is
    monotone if both end slopes are at most 5/4 of its mean slope.

    Raises:
        InfeasibleError: both splines leave the position limits; the message names the joint, the
            place and the excess.
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
    """Return knots (n,) from 0 to 1 for waypoints (n, 5).

    Their spacing is proportional to the time that the joints need from waypoint to waypoint at top
    speed.
    """
    needed = (np.abs(np.diff(waypoints, axis=0)) / boom.limits.velocity).max(axis=-1)
    knots: Array = np.append(0.0, np.cumsum(needed)) / needed.sum()
    knots[-1] = 1.0
    return knots


def overshoot(boom: Boom, path: Path) -> str | None:
    """Describe where a path is farthest outside the position limits; None if it is within them."""
    s = np.linspace(0.0, 1.0, _LOOKS)
    q = path(s)
    excess = boom.limits.excess(q).max(axis=-1)
    at = int(np.argmax(excess))
    reasons = boom.limits.reasons(q[at])
    return f"at {s[at]:.1%}, {'; '.join(reasons)}" if reasons else None
