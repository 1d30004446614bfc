"""Joint paths that follow a curve of the tip at constant pitch."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from boom_model import (
    Boom,
    ChoosingConstraint,
    Constraint,
    InfeasibleError,
    LeastExtension,
    LeastTime,
    forward_kinematics,
    solve_branches,
)
from boom_model.arrays import Array, Mask, checked, scalar
from planner.bisection import bisect
from planner.paths.redundancy import NODES, Departure, resolve, sides_of
from planner.paths.targets import unreachable
from planner.paths.tip_curves import TipArc, TipCurve, TipLine

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

TIP_TOLERANCE = 1e-5
"""Largest allowed distance [m] of a spline from its curve, a tenth of the tolerance of a sweep."""

_NODES = (64, 128, 256, 512, 1024, 2048)
_FEWEST = 6
"""Number of steps of the shortest curves. Nodes closer than the tolerance add nothing to a spline
but rounding, which a third derivative enlarges with the cube of their number."""

_CHECKS_PER_NODE = 8
_BISECTIONS = 50
_SAME = 1e-6  # [m, rad]
_INSET = 1e-4 * np.array([0.0, 1.0, 1.0, 1.0, 1.0])  # [rad or m]; the target determines the yaw
_FLIP = 0.25
"""Step between nodes, as a share of a joint's range, above which the branch has changed."""


@dataclass(frozen=True, eq=False)
class TipPath:
    """Joint path along which the tip follows a curve at constant pitch.

    It is a quintic spline through exact solutions of the inverse kinematics.
    """

    curve: TipCurve
    pitch: float
    spline: "BSpline"
    deviation: float
    """Largest distance [m] of the tip from the curve, on a grid 8 times finer than the nodes."""
    departure: Departure | None = None
    """Distance of the joints from the constraint's own choice; None for a fixing constraint."""

    def __call__(self, s: ArrayLike, order: int = 0) -> Array:
        """Return the derivative of the given order in s, shape (..., 5) for s (...)."""
        return np.asarray(self.spline(np.clip(s, 0.0, 1.0), order))

    @property
    def knots(self) -> Array:
        """Values of s at which a derivative up to the third may jump: none."""
        return np.empty(0)  # the fourth derivative of a quintic spline is continuous

    @property
    def sentence(self) -> str:
        """Description of the path for a report."""
        kind = {TipLine: "line", TipArc: "arc"}.get(type(self.curve), "curve")
        followed = f"the tip follows a {kind} of {self.curve.length:.4g} m to within {self.deviation * 1e3:.3g} mm"
        return followed if self.departure is None else f"{followed}; {self.departure.sentence}"


def follow(
    boom: Boom,
    curve: TipCurve,
    pitch: float,
    constraint: Constraint,
    reference: ArrayLike | None = None,
    tolerance: float = TIP_TOLERANCE,
) -> TipPath:
    """Return the joint path along a curve of the tip, on one branch from end to end.

    The branch at the start is the nearest to `reference` from which the whole curve can be
    followed. From node to node, the nearest branch is taken. The number of nodes is doubled until
    the tip stays within `tolerance` of the curve between them.

    Args:
        boom: the boom.
        curve: of the tip.
        pitch: constant pitch of the end effector [rad].
        constraint: a fixing constraint applies at every node. A choosing constraint is resolved for
            the whole curve (`redundancy`).
        reference: (5,) joint position; None is the middle of the joint ranges.
        tolerance: largest distance of the tip from the curve [m].

    Raises:
        InputError: pitch or reference is not finite.
        InfeasibleError: the curve leaves the workspace, the branch must change on the way (the
            message says where), or no spline of up to 2048 nodes keeps the tolerance, because the
            constraint's choice jumps or has a kink.
    """
    pitch = scalar("pitch", pitch)
    limits = boom.limits
    start = (limits.lower + limits.upper) / 2.0 if reference is None else checked("reference", reference, 5)
    if isinstance(constraint, ChoosingConstraint):
        return _through_family(boom, curve, pitch, constraint, start, tolerance)

    def nodes(s: Array) -> Array:
        return _one_branch(boom, curve, pitch, constraint, s, start)

    return _fitted(boom, curve, pitch, constraint, nodes, tolerance)


def _fitted(
    boom: Boom, curve: TipCurve, pitch: float, constraint: Constraint, nodes: Callable[[Array], Array], tolerance: float
) -> TipPath:
    """Return a spline through exact joint positions `nodes(s)`.

    The number of nodes is doubled until the tip stays on its curve between them.
    """
    from scipy.interpolate import make_interp_spline

    fewest = int(np.clip(curve.length / tolerance, _FEWEST, _NODES[0]))
    for count in (fewest, *_NODES[fewest == _NODES[0] :]):
        s = np.linspace(0.0, 1.0, count + 1)
        spline = make_interp_spline(s, nodes(s), k=5)
        fine = np.linspace(0.0, 1.0, count * _CHECKS_PER_NODE + 1)
        q = spline(fine)
        deviation = float(np.linalg.norm(forward_kinematics(boom, q).position - curve(fine), axis=-1).max())
        if deviation <= tolerance and boom.limits.contain(q).all():
            return TipPath(curve, pitch, spline, deviation)
    raise InfeasibleError(
        f"no smooth joint path keeps the tip within {tolerance * 1e3:g} mm of its curve under constraint {constraint}: "
        f"with {_NODES[-1]} nodes it deviates by {deviation * 1e3:.3g} mm"
    )


def _through_family(
    boom: Boom, curve: TipCurve, pitch: float, constraint: ChoosingConstraint, start: Array, tolerance: float
) -> TipPath:
    """Return the path of a choosing constraint, resolved for the whole curve (`redundancy`)."""
    planned = _inset(boom)
    points = curve(np.linspace(0.0, 1.0, NODES))
    begins = forward_kinematics(boom, start)
    there = np.abs(begins.position - points[0]).max() < _SAME and abs(float(begins.pitch) - pitch) < _SAME
    motion = resolve(sides_of(planned, points, pitch, start if there else None), constraint, start)
    if motion is None:
        raise InfeasibleError(_no_curve(boom, planned, curve, pitch, constraint))
    path = _fitted(boom, curve, pitch, constraint, lambda s: motion(curve(s), s), tolerance)
    return path if isinstance(constraint, LeastTime) else replace(path, departure=motion.departure(boom, constraint))


def _no_curve(boom: Boom, planned: Boom, curve: TipCurve, pitch: float, constraint: ChoosingConstraint) -> str:
    """Explain why no joint path within the limits follows a curve.

    The curve leaves the workspace, or no single branch leads from end to end.
    """
    s = np.linspace(0.0, 1.0, NODES)
    any_member = LeastExtension()
    for within in (boom, planned):
        reached = np.asarray(solve_branches(within, curve(s), pitch, any_member).within_limits.any(axis=-1))
        if not reached.all():
            return _leaves(within, curve, pitch, any_member, s, reached)
    furthest = max(side.furthest for side in sides_of(planned, curve(s), pitch))
    at = ", ".join(f"{x:.4g}" for x in curve(s[furthest]))
    return _flip(constraint, s[furthest], at)


def _flip(constraint: Constraint, s: float, at: str) -> str:
    return f"the tip's path forces a change of branch under constraint {constraint} at {s:.1%}, ({at}) m"


def _inset(boom: Boom) -> Boom:
    """Return the boom with slightly narrower position limits.

    A spline overshoots a little where the constraint's choice leaves a limit that it followed.
    """
    lower, upper = boom.limits.lower + _INSET, boom.limits.upper - _INSET
    return replace(boom, limits=replace(boom.limits, lower=lower, upper=upper, linkage=boom.limits.linkage + 2.0 * _INSET[2]))


def _one_branch(boom: Boom, curve: TipCurve, pitch: float, constraint: Constraint, s: Array, start: Array) -> Array:
    """Return joint positions (n, 5) at s (n,), each on the branch nearest to the previous one.

    Of all starting branches that reach the end, the one nearest to `start` is taken.
    """
    found = solve_branches(boom, curve(s), pitch, constraint)
    reached = np.asarray(found.within_limits.any(axis=-1))
    if not reached.all():
        raise InfeasibleError(_leaves(boom, curve, pitch, constraint, s, reached))
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
    raise InfeasibleError(_flip(constraint, s[broken], at))


def _leaves(boom: Boom, curve: TipCurve, pitch: float, constraint: Constraint, s: Array, reached: Mask) -> str:
    """Say where a curve leaves the workspace, by bisection next to its first node out of reach."""
    out = int(np.argmin(reached))
    if out == 0:
        return f"the tip's path starts out of reach: {unreachable(boom, curve(s[0]), pitch, constraint)}"

    def within(place: float) -> bool:
        return bool(solve_branches(boom, curve(np.array(place)), pitch, constraint).within_limits.any())

    inside = bisect(within, float(s[out - 1]), float(s[out]), steps=_BISECTIONS)
    at = ", ".join(f"{x:.6g}" for x in curve(np.array(inside)))
    why = unreachable(boom, curve(s[out]), pitch, constraint)
    return f"the tip's path leaves the workspace at {inside:.2%}, ({at}) m: {why}"
