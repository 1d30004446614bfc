"""Where a move starts and ends: a named pose, a joint position, or a tip target with a pitch and a hold."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from boom_model import (
    ActuatorAngle,
    ActuatorHorizontal,
    Boom,
    FixedExtension,
    Hold,
    InfeasibleError,
    InputError,
    LargestMargin,
    LeastExtension,
    LeastTorque,
    NearestHorizontal,
    NearestPose,
    inverse_kinematics,
    nearest_reachable,
)
from boom_model.arrays import Array, checked
from boom_model.plausible import NUMBER

PITCHES = {"down": -np.pi / 2.0, "level": 0.0, "up": np.pi / 2.0}
CHOICES = {
    str(hold): hold for hold in (ActuatorHorizontal(), LeastExtension(), NearestHorizontal(), LeastTorque(), LargestMargin())
}
_NOTHING = 1e-12  # degrees or metres: a distance as small would ask for an infinite speed along the path
HOLDS = f"{', '.join(CHOICES)}, actuator=DEG, extension=M, nearest=DEG,DEG,DEG,M,DEG"


@dataclass(frozen=True)
class TipTarget:
    """A tip position in frame 1 [m]; its pitch and hold come with the plan."""

    position: tuple[float, float, float]


Target = str | TipTarget | ArrayLike
"""A pose's name, a tip target, or a joint position (5,) [rad, the extension in m]."""


def parse_target(text: str) -> Target:
    """A target as people write it: `transport`, `q=0,90,180,0,0` (degrees, the extension in m), `tip=1.4,0,1.0` (m).

    Raises:
        InputError: the numbers are malformed, not finite, or too many or too few.
    """
    kind, equals, rest = text.partition("=")
    if not equals:
        return text
    if kind == "q":
        return _joint_position(text, rest)
    if kind == "tip":
        x, y, z = _numbers(text, rest, 3)
        return TipTarget((x, y, z))
    raise InputError(f"{text!r} is no target; give a pose's name, q=DEG,DEG,DEG,M,DEG or tip=X,Y,Z")


def parse_pitch(text: str) -> float | None:
    """A pitch as people write it: down, level, up, or degrees above the horizontal, in rad; free is None.

    Raises:
        InputError: none of these.
    """
    if text == "free":
        return None
    if text in PITCHES:
        return PITCHES[text]
    return float(np.radians(_number("pitch", text, "down, level, up, free or degrees")))


def parse_along(text: str) -> str | Array:
    """What leads a move, as people write it: joint, line, or the point of an arc, arc=X,Y,Z (m).

    Raises:
        InputError: none of these.
    """
    if text in ("joint", "line"):
        return text
    kind, _, rest = text.partition("=")
    if kind != "arc":
        raise InputError(f"along {text!r} is not known; there are: joint, line, arc=X,Y,Z")
    return np.array(_numbers(text, rest, 3))


def parse_joint_velocity(text: str) -> Array:
    """A joint velocity (5,) as people write it: deg/s and the extension's m/s, five numbers with commas, in SI.

    Raises:
        InputError: the numbers are malformed, not finite, or too many or too few.
    """
    return _joint_position(text, text)


def parse_hold(text: str) -> Hold:
    """A hold as people write it; `actuator=DEG` is the actuator's elevation above the horizontal.

    Raises:
        InputError: none of the holds, or its value is not a finite number.
    """
    kind, equals, rest = text.partition("=")
    if text in CHOICES:
        return CHOICES[text]
    if kind == "nearest" and equals:
        return NearestPose.to(_joint_position(text, rest))
    if kind == "actuator" and equals:
        return ActuatorAngle(float(np.radians(_number("hold actuator", rest, "degrees"))))
    if kind == "extension" and equals:
        return FixedExtension(_number("hold extension", rest, "metres"))
    raise InputError(f"hold {text!r} is not known; there are: {HOLDS}")


def resolve(boom: Boom, target: Target, pitch: float | None, hold: Hold, reference: ArrayLike | None = None) -> Array:
    """The joint position (5,) of a target, within the limits.

    Args:
        reference: joint position that a tip target's best branch is nearest to; None is the middle of the ranges.

    Raises:
        InputError: no such pose, or not finite, or of the wrong shape.
        InfeasibleError: the joint position breaks a limit, or the tip target cannot be reached within the limits.
    """
    if isinstance(target, TipTarget):
        return _tip(boom, target, pitch, hold, reference)
    name = f"pose {target!r}" if isinstance(target, str) else "joint position"
    q = boom.pose(target) if isinstance(target, str) else checked("joint position", target)
    if q.shape != (5,):
        raise InputError(f"joint position has shape {q.shape}; it must be (5,)")
    broken = boom.limits.reasons(q)
    if broken:
        raise InfeasibleError(f"{name} is outside the limits: {'; '.join(broken)}")
    return q


def _tip(boom: Boom, target: TipTarget, pitch: float | None, hold: Hold, reference: ArrayLike | None) -> Array:
    found = inverse_kinematics(boom, target.position, pitch, hold, reference)
    if found.best is not None:
        return found.solutions[found.best].q
    raise InfeasibleError(unreachable(boom, target.position, pitch, hold))


def unreachable(boom: Boom, position: ArrayLike, pitch: float | None, hold: Hold) -> str:
    """Why no branch within the limits reaches a target: how far out of reach, or which limits each branch breaks.

    Raises:
        InputError: position is not finite or not (3,).
    """
    found = inverse_kinematics(boom, position, pitch, hold)
    free, pitch = " (free)" if pitch is None else "", found.pitch
    head = f"tip {_point(np.asarray(position))} with pitch {np.degrees(pitch):.4g} deg{free} and hold {hold}"
    nearest = nearest_reachable(boom, position, pitch, hold)
    if nearest is None:
        tail = "no point on the line from it to the base can be reached with this pitch and hold"
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


def _joint_position(text: str, rest: str) -> Array:
    q = np.array(_numbers(text, rest, 5))
    q[[0, 1, 2, 4]] = np.radians(q[[0, 1, 2, 4]])
    return q


def _numbers(text: str, rest: str, count: int) -> list[float]:
    parts = rest.split(",")
    if len(parts) != count:
        raise InputError(f"{text!r} has {len(parts)} numbers; it needs {count}")
    return [_number(text, part, "a number") for part in parts]


def _number(name: str, text: str, what: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise InputError(f"{name}: {text!r} is not {what}") from None
    if not np.isfinite(value):
        raise InputError(f"{name}: {text!r} must be finite")
    NUMBER.require(name, value)
    return value if abs(value) > _NOTHING else 0.0
