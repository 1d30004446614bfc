"""Inverse kinematics in closed form: a tip position, a pitch and a hold give every branch.

A position and a pitch fix four of the five joints; the hold is the extra constraint. With phi = pitch - 90 deg, and
r = +-hypot(x, y) (the minus sign is the branch with the base turned round), the inner link must close the vector

    L9 e(theta2) = (F + rho c3 - L6 s3,  G + rho s3 + L6 c3),   F = r - L2 - L8 cos(pitch),   G = z - L1 - L8 sin(pitch)

whose length is L9 (thesis, eqs. 2.20-2.38 with their corrections; H = L9^2 - F^2 - G^2 - L6^2):

    actuator's angle held:   rho^2 + b rho + c = 0,   b = 2 (F c3 + G s3),  c = 2 L6 (G c3 - F s3) - H
    extension held:          e cos(theta3) + d sin(theta3) = H - rho^2,   d = 2 (rho G - F L6),  e = 2 (rho F + G L6)
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array, Mask, checked, read_only, scalar
from boom_model.boom import IS_LENGTH, LIMIT_TOLERANCE, Boom
from boom_model.errors import InputError

_TANGENT = 1e-13  # relative gap of a closure that is rounding: the target is on the boundary of the reach


@dataclass(frozen=True)
class ActuatorAngle:
    """The actuator is held at an elevation above the boom's forward horizontal: theta3 = pi + elevation."""

    elevation: float
    """[rad]; negative points down."""

    def __str__(self) -> str:
        return f"actuator={np.degrees(self.elevation):.6g} deg"


@dataclass(frozen=True)
class ActuatorHorizontal(ActuatorAngle):
    """The actuator is held horizontal, pointing away from the base: theta3 = pi."""

    elevation: float = 0.0

    def __str__(self) -> str:
        return "horizontal"


@dataclass(frozen=True)
class FixedExtension:
    """The actuator's extension is held: theta4 = extension."""

    extension: float
    """[m]"""

    def __str__(self) -> str:
        return f"extension={self.extension:.6g} m"


Hold = ActuatorAngle | FixedExtension


@dataclass(frozen=True, eq=False)
class Branches:
    """Every branch for a batch of targets: two of the base times two of the closure, in the last branch axis."""

    q: Array
    """(..., 4, 5); NaN where the branch does not exist. Yaw, lower and wrist are wrapped into their limits if they can be."""
    exists: Mask
    """(..., 4) bool. A double root, and the second base branch of a target on the yaw axis, count once."""
    within_limits: Mask
    """(..., 4) bool"""


@dataclass(frozen=True, eq=False)
class Solution:
    """One branch of one target."""

    q: Array
    """(5,)"""
    within_limits: bool
    reasons: tuple[str, ...]
    """Each limit that it breaks and by how much; and what was chosen where the target leaves a joint free."""


@dataclass(frozen=True, eq=False)
class Solutions:
    """Every branch of one target, and the best of them."""

    solutions: tuple[Solution, ...]
    best: int | None
    """Index of the branch within the limits that is nearest to the reference; None where there is none."""


def inverse_kinematics(
    boom: Boom,
    position: ArrayLike,
    pitch: float = -np.pi / 2.0,
    hold: Hold | None = None,
    reference: ArrayLike | None = None,
) -> Solutions:
    """Every branch that puts the tip at a position with a pitch, under a hold.

    Args:
        position: (3,) of the tip in frame 1 [m].
        pitch: elevation of the end effector above the boom's own forward horizontal [rad]; -pi/2 faces down.
        hold: the extra constraint; None holds the actuator horizontal.
        reference: (5,) joint position that the best branch is nearest to, the distance of each joint measured as a share of
            its range; None is the middle of the ranges.

    Raises:
        InputError: an input is not finite or of the wrong shape. An unreachable target is no error: no solutions.
    """
    hold = ActuatorHorizontal() if hold is None else hold
    position = checked("position", position)
    if position.shape != (3,):
        raise InputError(f"position has shape {position.shape}; it must be (3,)")
    found = solve_branches(boom, position, scalar("pitch", pitch), hold)
    free = float(np.hypot(position[0], position[1])) == 0.0
    note = ("the target is on the yaw axis: yaw is free, 0 is chosen",) if free else ()
    solutions = tuple(
        Solution(read_only(q), bool(within), (*note, *boom.limits.reasons(q)))
        for q, exists, within in zip(found.q, found.exists, found.within_limits, strict=True)
        if exists
    )
    return Solutions(solutions, _best(boom, solutions, reference))


def solve_branches(boom: Boom, position: ArrayLike, pitch: ArrayLike, hold: Hold) -> Branches:
    """Every branch for a batch of targets under one hold.

    Args:
        position: (..., 3) of the tip in frame 1 [m].
        pitch: (...) [rad].
        hold: the extra constraint.

    Raises:
        InputError: an input is not finite or of the wrong shape.
    """
    if not isinstance(hold, ActuatorAngle | FixedExtension):
        raise InputError(f"hold is {hold!r}; it must be one of the holds of boom_model")
    position, pitch = checked("position", position, 3) + 0.0, checked("pitch", pitch)  # + 0.0 takes the sign off a zero
    try:
        x, y, z, pitch = np.broadcast_arrays(*np.moveaxis(position, -1, 0), pitch)
    except ValueError:
        raise InputError(f"shapes do not match: position {position.shape}, pitch {pitch.shape}") from None
    g = boom.geometry
    side = np.array([1.0, 1.0, -1.0, -1.0])  # of the base
    root = np.array([1.0, -1.0, 1.0, -1.0])  # of the closure
    radius = np.hypot(x, y)[..., None]
    F = side * radius - g.L2 - g.L8 * np.cos(pitch)[..., None]
    G = np.broadcast_to((z - g.L1 - g.L8 * np.sin(pitch))[..., None], F.shape)

    with np.errstate(over="ignore", invalid="ignore"):  # an absurdly far target is out of reach, not an error
        theta3, rho, exists = _closure(boom, hold, F, G, root)
        exists = exists & np.isfinite(rho) & ((side > 0.0) | (radius > 0.0))
        c3, s3 = np.cos(theta3), np.sin(theta3)
        theta2 = np.arctan2(G + rho * s3 + g.L6 * c3, F + rho * c3 - g.L6 * s3)
    theta1 = np.arctan2(y, x)[..., None] + np.where(side < 0, np.pi, 0.0)
    theta5 = (pitch - np.pi / 2.0)[..., None] - theta3
    q = np.stack(np.broadcast_arrays(theta1, theta2, theta3, rho - g.L7, theta5), axis=-1)
    q[~exists] = np.nan
    q = _wrapped(boom, q)
    return Branches(q, exists, exists & boom.limits.hold(q))


def _closure(boom: Boom, hold: Hold, F: Array, G: Array, root: Array) -> tuple[Array, Array, Mask]:
    """theta3, rho, and whether the branch exists, each of F's shape."""
    g = boom.geometry
    if isinstance(hold, FixedExtension):
        H = g.L9**2 - F**2 - G**2 - g.L6**2
        rho = np.full_like(F, g.L7 + scalar("extension", hold.extension))
        d, e, f = 2.0 * (rho * G - F * g.L6), 2.0 * (rho * F + G * g.L6), H - rho**2
        amplitude = np.hypot(d, e)
        room, scale = amplitude - np.abs(f), g.L9**2 + F**2 + G**2 + g.L6**2 + rho**2
        ratio = np.divide(f, amplitude, out=np.zeros_like(f), where=amplitude > 0.0)
        theta3 = np.arctan2(d, e) + root * np.arccos(np.clip(ratio, -1.0, 1.0))
        exists = (room >= -_TANGENT * scale) & (amplitude > 0.0)
    else:
        theta3 = np.full_like(F, np.pi + scalar("elevation", hold.elevation))
        c3, s3 = np.cos(theta3), np.sin(theta3)
        half_b, scale = F * c3 + G * s3, np.full_like(F, g.L9**2)
        room = g.L9**2 - (G * c3 - F * s3 + g.L6) ** 2  # half_b^2 - c, without the squares that cancel in it
        rho = -half_b + root * np.sqrt(np.maximum(room, 0.0))
        exists = room >= -_TANGENT * scale
    double = room <= _TANGENT * scale
    return theta3, rho, exists & np.isfinite(room) & ~(double & (root < 0.0))


def _wrapped(boom: Boom, q: Array) -> Array:
    """Angles turned by whole turns into their limits, or else to the nearer side of them; above them on a tie."""
    limits, turn = boom.limits, 2.0 * np.pi
    above = np.mod(q - limits.lower, turn)
    above = limits.lower + np.where(turn - above <= LIMIT_TOLERANCE, above - turn, above)
    below = above - turn
    nearer_below = limits.lower - below < above - limits.upper - LIMIT_TOLERANCE
    return np.where(IS_LENGTH, q, np.where(nearer_below, below, above))


def _best(boom: Boom, solutions: tuple[Solution, ...], reference: ArrayLike | None) -> int | None:
    limits = boom.limits
    middle = (limits.lower + limits.upper) / 2.0
    target = middle if reference is None else checked("reference", reference, 5)
    if target.shape != (5,):
        raise InputError(f"reference has shape {target.shape}; it must be (5,)")
    span = np.where(limits.upper > limits.lower, limits.upper - limits.lower, 1.0)
    allowed = [i for i, s in enumerate(solutions) if s.within_limits]
    return min(allowed, key=lambda i: float(np.linalg.norm((solutions[i].q - target) / span)), default=None)
