"""Targets of a move: named pose, joint position, or tip position with pitch and constraint."""

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from boom_model import Boom, Constraint, InfeasibleError, InputError, inverse_kinematics, nearest_reachable
from boom_model.arrays import Array, checked
from boom_model.words import joint_position, number, numbers, unknown

PITCHES = {"down": -np.pi / 2.0, "level": 0.0, "up": np.pi / 2.0}


@dataclass(frozen=True)
class TipTarget:
    """Tip position in frame 1 [m]; the plan gives its pitch and constraint."""

    position: tuple[float, float, float]


Target = str | TipTarget | ArrayLike
"""Name of a pose, tip target, or joint position (5,) [rad, m for the extension]."""


def parse_target(text: str) -> Target:
    """Parse a target, such as `transport`, `q=0,90,180,0,0` or `tip=1.4,0,1.0`.

    Joint angles are in degrees; lengths are in m.

    Raises:
        InputError: the numbers are malformed, not finite, or the wrong count.
    """
    kind, equals, rest = text.partition("=")
    if not equals:
        if re.fullmatch(r"[-+\d.eE ]+(,[-+\d.eE ]+)+", text):
            form = f"tip={text}" if text.count(",") == 2 else "q=DEG,DEG,DEG,M,DEG or tip=X,Y,Z"
            raise InputError(f"{text!r} is not the name of a pose; numbers are given as {form}")
        return text
    if kind == "q":
        return joint_position(text, rest)
    if kind == "tip":
        x, y, z = numbers(text, rest, 3)
        return TipTarget((x, y, z))
    raise InputError(f"{text!r} is not a target; give a pose's name, q=DEG,DEG,DEG,M,DEG or tip=X,Y,Z")


def parse_pitch(text: str) -> float | None:
    """Parse a pitch: down, level, up, free, or degrees above the horizontal.

    The result is in rad; None stands for free.

    Raises:
        InputError: the text is none of these.
    """
    if text == "free":
        return None
    if text in PITCHES:
        return PITCHES[text]
    return float(np.radians(number("pitch", text, "down, level, up, free or degrees")))


def parse_along(text: str) -> str | Array:
    """Parse the kind of path: joint, line, or an arc through a point, arc=X,Y,Z (m).

    Raises:
        InputError: the text is none of these.
    """
    if text in ("joint", "line"):
        return text
    kind, equals, rest = text.partition("=")
    if kind != "arc" or not equals:
        raise unknown("along", text, ("joint", "line", "arc=X,Y,Z"))
    return np.array(numbers(text, rest, 3))


def parse_joint_velocity(text: str) -> Array:
    """Parse a joint velocity: five numbers with commas, in deg/s and m/s for the extension.

    The result (5,) is in SI units.

    Raises:
        InputError: the numbers are malformed, not finite, or the wrong count.
    """
    return joint_position(text, text)


def resolve(
    boom: Boom, target: Target, pitch: float | None, constraint: Constraint, reference: ArrayLike | None = None
) -> Array:
    """Return the joint position (5,) of a target within the limits.

    Args:
        boom: the boom.
        target: what to reach.
        pitch: of the end effector at a tip target [rad]; None lets the constraint choose it.
        constraint: the extra constraint of a tip target.
        reference: (5,) joint position; of a tip target's branches the nearest to it is taken. None
            is the middle of the joint ranges.

    Raises:
        InputError: the pose is unknown, or an array is not finite or has the wrong shape.
        InfeasibleError: the joint position exceeds a limit, or the tip target cannot be reached
            within the limits.
    """
    if isinstance(target, TipTarget):
        return _tip(boom, target, pitch, constraint, reference)
    name = f"pose {target!r}" if isinstance(target, str) else "joint position"
    q = boom.pose(target) if isinstance(target, str) else checked("joint position", target)
    if q.shape != (5,):
        raise InputError(f"joint position has shape {q.shape}; it must be (5,)")
    broken = boom.limits.reasons(q)
    if broken:
        raise InfeasibleError(f"{name} is outside the limits: {'; '.join(broken)}")
    return q


def _tip(boom: Boom, target: TipTarget, pitch: float | None, constraint: Constraint, reference: ArrayLike | None) -> Array:
    found = inverse_kinematics(boom, target.position, pitch, constraint, reference)
    if found.best is not None:
        return found.solutions[found.best].q
    raise InfeasibleError(unreachable(boom, target.position, pitch, constraint))


def unreachable(boom: Boom, position: ArrayLike, pitch: float | None, constraint: Constraint) -> str:
    """Explain why no branch within the limits reaches a target.

    The text says how far the target is out of reach, or which limits each branch exceeds.

    Raises:
        InputError: position is not finite or not (3,).
    """
    found = inverse_kinematics(boom, position, pitch, constraint)
    free, pitch = " (free)" if pitch is None else "", found.pitch
    head = f"tip {_point(np.asarray(position))} with pitch {np.degrees(pitch):.4g} deg{free} and constraint {constraint}"
    nearest = nearest_reachable(boom, position, pitch, constraint)
    if nearest is None:
        tail = "no point on the line from it to the base can be reached with this pitch and constraint"
    else:
        limits = "within the limits" if nearest.within_limits else "though outside the limits"
        tail = (
            f"the nearest point on the line to the base that can be reached {limits} is {_point(nearest.position)}, "
            f"{nearest.distance:.4g} m away"
        )
    if not found.solutions:
        return f"{head} is out of reach; {tail}"
    branches = "; ".join(f"branch {i + 1}: {', '.join(s.reasons)}" for i, s in enumerate(found.solutions))
    return f"{head} can be reached only outside the limits ({branches}); {tail}"


def _point(position: Array) -> str:
    return "(" + ", ".join(f"{x:.6g}" for x in position) + ") m"
