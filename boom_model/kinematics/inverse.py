"""Closed-form inverse kinematics: every branch for a tip position, a pitch and a constraint."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array, Mask, checked, read_only, scalar
from boom_model.boom import JOINTS, Boom
from boom_model.drives.limits import static_limits
from boom_model.dynamics.equations_of_motion import gravity_torque
from boom_model.errors import InfeasibleError, InputError
from boom_model.golden_section import golden_section
from boom_model.kinematics.closure import closed_by_angle, closed_by_extension, turned_into_limits
from boom_model.kinematics.constraints import (
    ChoosingConstraint,
    Constraint,
    FixedExtension,
    FixingConstraint,
    LargestMargin,
    measure,
    parse_constraint,
)
from boom_model.kinematics.families import Targets, best_member, targets_at
from boom_model.kinematics.linkage import lower_angle

_PITCHES = 360
_REFINEMENTS = 40
_CHUNK = 20_000  # targets at once under a choosing constraint; its scan needs some 10 kB per target


@dataclass(frozen=True, eq=False)
class Branches:
    """Every branch for a batch of targets.

    A fixing constraint has four branches: two of the base times two of the closure. A choosing
    constraint has two branches, one on either side of the base, each the best joint position within
    the limits there.
    """

    q: Array
    """(..., 4 or 2, 5); NaN where the branch does not exist. Yaw, lower and wrist are turned into
    their limits by whole turns where that is possible."""
    exists: Mask
    """(..., 4 or 2). A double root counts once. So does a target on the yaw axis, where both base
    branches coincide."""
    within_limits: Mask
    """(..., 4 or 2)"""


@dataclass(frozen=True, eq=False)
class Solution:
    """One branch of one target."""

    q: Array
    """(5,)"""
    within_limits: bool
    reasons: tuple[str, ...]
    """Position limits that are exceeded, with the excess; drives that cannot hold the static load,
    payload included; and the value chosen for a joint that the target leaves free. Overloaded
    drives do not affect `within_limits`."""


@dataclass(frozen=True, eq=False)
class Solutions:
    """Every branch of one target, and the best branch."""

    solutions: tuple[Solution, ...]
    best: int | None
    """Index of the best branch within the limits: the nearest to the reference or, with a choosing
    constraint, the one of least cost. None if no branch is within the limits."""
    pitch: float
    """[rad]; the chosen one where it was left free. Whole turns are removed from a given pitch."""


def inverse_kinematics(
    boom: Boom,
    position: ArrayLike,
    pitch: float | None = -np.pi / 2.0,
    constraint: Constraint | str = "horizontal",
    reference: ArrayLike | None = None,
) -> Solutions:
    """Return every branch that puts the tip at a position with a pitch, under a constraint.

    An unreachable target is not an error; it has no solutions.

    Args:
        boom: the boom.
        position: (3,) position of the tip in frame 1 [m].
        pitch: elevation of the end effector above the boom's forward horizontal [rad]; -pi/2 points
            down. None leaves it free: a choosing constraint takes the pitch of least cost, a fixing
            constraint the pitch with the largest margin to the limits.
        constraint: the extra constraint, or its word ("horizontal", "extension=0.25",
            "least-torque", ...).
        reference: (5,) joint position; the best branch is the one nearest to it, with the distance
            of each joint as a share of its range. None is the middle of the ranges. A choosing
            constraint ignores it and compares costs.

    Raises:
        InputError: an input is not finite or has the wrong shape.

    >>> found = inverse_kinematics(Boom.load(), (1.4, 0.0, 1.0))
    >>> len(found.solutions), [round(float(x), 3) for x in found.solutions[found.best].q]
    (4, [0.0, 1.093, 3.142, 0.15, 0.0])
    """
    constraint = parse_constraint(constraint) if isinstance(constraint, str) else constraint
    position = checked("position", position)
    if position.shape != (3,):
        raise InputError(f"position has shape {position.shape}; it must be (3,)")
    # Whole turns are removed first, because they would cost digits of the joint angles.
    pitch = _free_pitch(boom, position, constraint) if pitch is None else float(np.fmod(scalar("pitch", pitch), 2.0 * np.pi))
    found = solve_branches(boom, position, pitch, constraint)
    free = not position[:2].any()
    note = ("the target is on the yaw axis: yaw is free, 0 is chosen",) if free else ()
    solutions = tuple(_solution(boom, q, note) for q in found.q[found.exists])
    return Solutions(solutions, _best(boom, solutions, constraint, reference), pitch)


def inverse_kinematics_of_pose(
    boom: Boom,
    T: ArrayLike,
    constraint: Constraint | str = "horizontal",
    reference: ArrayLike | None = None,
    tolerance: float = 1e-6,
) -> Solutions:
    """Return every branch that puts frame 11 at a pose (thesis, eq. 2.17), under a constraint.

    Five joints cannot reach every orientation: the z axis of the wrist is always horizontal, and
    the tip lies in the arm's plane perpendicular to it.

    Args:
        boom: the boom.
        T: homogeneous transform T_1_11 (4, 4).
        constraint: the extra constraint, or its word.
        reference: as in `inverse_kinematics`.
        tolerance: largest deviation [rad, m] of T from what the arm can reach.

    Raises:
        InputError: T is not finite, not (4, 4), or not a rigid transform.
        InfeasibleError: the arm cannot reach this orientation, or not at this position; the message
            gives the deviation.
    """
    T = checked("T", T, 4)
    if T.shape != (4, 4):
        raise InputError(f"T has shape {T.shape}; it must be (4, 4)")
    R, position = T[:3, :3], T[:3, 3]
    if not np.allclose(R @ R.T, np.eye(3), atol=1e-6) or np.linalg.det(R) < 0.0 or not np.allclose(T[3], [0, 0, 0, 1]):
        raise InputError("T is not a rigid transform; it must have a rotation matrix and a last row of 0 0 0 1")
    if abs(R[2, 2]) > tolerance:
        tilt = np.degrees(np.arcsin(np.clip(abs(R[2, 2]), 0.0, 1.0)))
        raise InfeasibleError(
            "the boom cannot reach this orientation: the z axis of its tip is always horizontal, "
            f"here it tilts by {tilt:.4g} deg"
        )
    yaw = np.arctan2(R[0, 2], -R[1, 2])
    beside = float(position[0] * np.sin(yaw) - position[1] * np.cos(yaw))
    if abs(beside) > tolerance:
        raise InfeasibleError(
            f"the boom cannot reach this orientation at this position: its plane at yaw {np.degrees(yaw):.4g} deg "
            f"misses the tip by {abs(beside):.4g} m"
        )
    pitch = float(np.arctan2(R[2, 0], R[0, 0] * np.cos(yaw) + R[1, 0] * np.sin(yaw)))
    constraint = parse_constraint(constraint) if isinstance(constraint, str) else constraint
    ahead = float(position[0] * np.cos(yaw) + position[1] * np.sin(yaw))  # in the arm's plane; negative behind the base
    found = solve_branches(boom, (abs(ahead), 0.0, position[2]), pitch, constraint)
    side = slice(0, len(found.q) // 2) if ahead >= 0.0 else slice(len(found.q) // 2, None)
    q = found.q[side][found.exists[side]]
    q[:, 0] = yaw
    solutions = tuple(_solution(boom, branch) for branch in turned_into_limits(boom, q))
    return Solutions(solutions, _best(boom, solutions, constraint, reference), pitch)


def _solution(boom: Boom, q: Array, note: tuple[str, ...] = ()) -> Solution:
    return Solution(read_only(q), bool(boom.limits.contain(q)), (*note, *boom.limits.reasons(q), *_overloads(boom, q)))


def _overloads(boom: Boom, q: Array) -> list[str]:
    held = np.abs(gravity_torque(boom, q))
    return [
        f"{joint} must hold {torque:.4g} Nm, and its drive allows {limit:.4g} Nm"
        for joint, torque, limit in zip(JOINTS, held, static_limits(boom), strict=True)
        if torque > limit
    ]


def _free_pitch(boom: Boom, position: Array, constraint: Constraint) -> float:
    """Return the pitch of least cost, by a scan of the whole turn and golden section.

    It is straight down if the position cannot be reached at any pitch.
    """
    chooses = LargestMargin() if isinstance(constraint, FixingConstraint) else constraint

    def cost(pitch: Array) -> Array:
        found = solve_branches(boom, position, pitch, constraint)
        values = np.full(found.within_limits.shape, np.inf)
        values[found.within_limits] = chooses.cost(boom, found.q[found.within_limits])
        least: Array = values.min(axis=-1)
        return least

    turn = np.linspace(-np.pi, np.pi, _PITCHES + 1)
    costs = cost(turn)
    best = int(np.argmin(costs))
    if not np.isfinite(costs[best]):
        return -np.pi / 2.0
    step, middle = turn[1] - turn[0], float(turn[best])
    refined = float(golden_section(cost, np.array(middle - step), np.array(middle + step), _REFINEMENTS))
    return refined if cost(np.array([refined]))[0] <= costs[best] else middle


def solve_branches(boom: Boom, position: ArrayLike, pitch: ArrayLike, constraint: Constraint) -> Branches:
    """Return every branch for a batch of targets under one constraint.

    Args:
        boom: the boom.
        position: (..., 3) positions of the tip in frame 1 [m].
        pitch: (...) [rad].
        constraint: the extra constraint.

    Raises:
        InputError: an input is not finite or has the wrong shape.
    """
    if not isinstance(constraint, Constraint):
        raise InputError(f"constraint is {constraint!r}; it must be one of the constraints of boom_model")
    # Adding 0.0 turns -0.0 into 0.0.
    position, pitch = checked("position", position, 3) + 0.0, checked("pitch", pitch)
    try:
        x, y, z, pitch = np.broadcast_arrays(*np.moveaxis(position, -1, 0), pitch)
    except ValueError:
        raise InputError(f"shapes do not match: position {position.shape}, pitch {pitch.shape}") from None
    # A target so far that floats overflow is out of reach, not an error.
    with np.errstate(over="ignore", invalid="ignore"):
        return _branches(boom, x, y, z, pitch, constraint)


def _branches(boom: Boom, x: Array, y: Array, z: Array, pitch: Array, constraint: Constraint) -> Branches:
    side = np.array([1.0, -1.0])
    position = np.stack([x, y, z], axis=-1)[..., None, :]
    targets = targets_at(boom, position, pitch[..., None], side)
    distinct = (side > 0.0) | (np.hypot(x, y)[..., None] > 0.0)
    if isinstance(constraint, FixingConstraint):
        q, exists = _constrained(boom, targets, constraint, distinct)
    else:
        q, exists = _chosen(boom, targets, constraint, distinct)
    return Branches(q, exists, exists & boom.limits.contain(q))


def _constrained(boom: Boom, targets: Targets, constraint: FixingConstraint, distinct: Mask) -> tuple[Array, Mask]:
    """Return joint positions (..., 4, 5) and their existence (..., 4) for targets (..., 2).

    Each side of the base has two roots of the closure.
    """
    theta1, F, G, phi = (np.repeat(x, 2, axis=-1) for x in targets)
    root = np.array([1.0, -1.0, 1.0, -1.0])
    if isinstance(constraint, FixedExtension):
        rho = np.full_like(F, boom.geometry.L7 + scalar("extension", constraint.extension))
        closure = closed_by_extension(boom, rho, F, G, root)
    else:
        closure = closed_by_angle(boom, np.full_like(F, np.pi + scalar("elevation", constraint.elevation)), F, G, root)
    exists = closure.exists & np.repeat(distinct, 2, axis=-1)
    extension = closure.rho - boom.geometry.L7
    theta3 = lower_angle(boom, closure.theta2, closure.theta3)  # the closure gives the actuator's direction
    exists = exists & np.isfinite(theta3)
    q = np.stack([theta1, closure.theta2, theta3, extension, phi - closure.theta3], axis=-1)
    q[~exists] = np.nan
    return turned_into_limits(boom, q), exists


def _chosen(boom: Boom, targets: Targets, constraint: ChoosingConstraint, distinct: Mask) -> tuple[Array, Mask]:
    """Return joint positions (..., 2, 5) and their existence (..., 2) for targets (..., 2)."""
    shape = targets.F.shape
    flat = Targets(*(np.reshape(x, -1) for x in targets))
    q, exists = np.empty((flat.F.size, 5)), np.empty(flat.F.size, dtype=bool)
    for start in range(0, flat.F.size, _CHUNK):
        part = slice(start, start + _CHUNK)
        q[part], exists[part] = best_member(boom, Targets(*(x[part] for x in flat)), constraint)
    exists &= np.broadcast_to(distinct, shape).reshape(-1)
    q[~exists] = np.nan
    return q.reshape(*shape, 5), exists.reshape(shape)


def _best(boom: Boom, solutions: tuple[Solution, ...], constraint: Constraint, reference: ArrayLike | None) -> int | None:
    allowed = [i for i, s in enumerate(solutions) if s.within_limits]
    least_of = measure(boom, constraint, reference)
    return min(allowed, key=lambda i: float(least_of.cost(boom, solutions[i].q)), default=None)
