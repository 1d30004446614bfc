"""Extra constraints that make the inverse kinematics determinate.

A position and a pitch of the tip are four conditions on five joints. A fixing constraint adds the
fifth. A choosing constraint selects the joint position of least cost among all those that reach the
target within the limits.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array, checked, read_only
from boom_model.boom import Boom
from boom_model.drives.limits import static_limits
from boom_model.dynamics.equations_of_motion import gravity_torque
from boom_model.errors import InputError
from boom_model.kinematics.linkage import directions
from boom_model.words import joint_position, number, unknown


@dataclass(frozen=True)
class ActuatorAngle:
    """Actuator at a fixed elevation above the forward horizontal: theta3 = pi + elevation."""

    elevation: float
    """[rad]; negative points down."""

    def __str__(self) -> str:
        return f"actuator={np.degrees(self.elevation):.6g} deg"


@dataclass(frozen=True)
class ActuatorHorizontal(ActuatorAngle):
    """Horizontal actuator that points away from the base: theta3 = pi."""

    elevation: float = 0.0

    def __str__(self) -> str:
        return "horizontal"


@dataclass(frozen=True)
class FixedExtension:
    """Fixed extension of the actuator: theta4 = extension."""

    extension: float
    """[m]"""

    def __str__(self) -> str:
        return f"extension={self.extension:.6g} m"


@dataclass(frozen=True)
class LeastExtension:
    """Smallest extension of the actuator. Cost: theta4 [m]."""

    unit: ClassVar[str] = "m of extension"

    def __str__(self) -> str:
        return "least-extension"

    def cost(self, boom: Boom, q: Array) -> Array:
        """Return the cost (...) of joint positions q (..., 5)."""
        return q[..., 3]


@dataclass(frozen=True)
class NearestHorizontal:
    """Actuator as close to horizontal as possible.

    Cost: |theta3 - pi| [rad], of the actuator's own direction where the links are unequal. Between
    equal costs, the smaller extension wins.
    """

    unit: ClassVar[str] = "rad of elevation"

    def __str__(self) -> str:
        return "nearest-horizontal"

    def cost(self, boom: Boom, q: Array) -> Array:
        """Return the cost (...) of joint positions q (..., 5)."""
        return np.abs(directions(boom, q[..., 1], q[..., 2]).upper - np.pi) + _TIE * q[..., 3]


@dataclass(frozen=True)
class LeastTorque:
    """Smallest static load of the most heavily loaded drive, payload included.

    Cost: the largest |static torque| / (torque limit of the drive at rest) over the joints whose
    drive has a torque limit. Other joints do not count, because their limit is unknown.
    """

    unit: ClassVar[str] = "of a drive's allowed torque"

    def __str__(self) -> str:
        return "least-torque"

    def cost(self, boom: Boom, q: Array) -> Array:
        """Return the cost (...) of joint positions q (..., 5).

        Raises:
            InputError: no joint has a drive with a torque limit.
        """
        limits = static_limits(boom)
        driven = np.isfinite(limits)
        if not driven.any():
            raise InputError(f"constraint {self}: no joint of {boom.name} has a drive with a torque limit")
        ratio: Array = np.max(np.abs(gravity_torque(boom, q)[..., driven]) / limits[driven], axis=-1)
        return ratio


@dataclass(frozen=True, eq=False)
class NearestPose:
    """Joint position nearest to a given one.

    Cost: the sum of the squared distances of the joints, each as a share of the joint's range.
    """

    pose: Array
    """(5,)"""

    @staticmethod
    def to(q: ArrayLike) -> "NearestPose":
        """Return the constraint for a joint position q (5,).

        Raises:
            InputError: q is not finite or not (5,).
        """
        pose = checked("reference", q, 5)
        if pose.shape != (5,):
            raise InputError(f"reference has shape {pose.shape}; it must be (5,)")
        return NearestPose(read_only(pose))

    unit: ClassVar[str] = "of the squared distance"

    def __str__(self) -> str:
        return f"nearest={','.join(f'{x:.6g}' for x in self.pose)} (rad, m)"

    def cost(self, boom: Boom, q: Array) -> Array:
        """Return the cost (...) of joint positions q (..., 5)."""
        distance: Array = np.sum(((q - self.pose) / _spans(boom)) ** 2, axis=-1)
        return distance


@dataclass(frozen=True)
class LargestMargin:
    """Largest distance to the nearest joint limit.

    Cost: minus the smallest distance to a limit, each as a share of its joint's range. The coupled
    limit counts with the range of theta3. Joints that the target and the pitch determine count as
    well, because they bound the margin that is possible.
    """

    unit: ClassVar[str] = "of a joint's range"

    def __str__(self) -> str:
        return "largest-margin"

    def cost(self, boom: Boom, q: Array) -> Array:
        """Return the cost (...) of joint positions q (..., 5)."""
        spans = _spans(boom)
        excess: Array = np.max(boom.limits.excess(q) / np.array([*spans, spans[2]]), axis=-1)
        return excess


@dataclass(frozen=True)
class LeastTime:
    """Shortest travel time along a line or an arc of the tip.

    Cost: the travel time within the joint limits and the drives' torque limits at standstill. The
    choice is made for the whole curve; a single target has no travel time.
    """

    unit: ClassVar[str] = "s"

    def __str__(self) -> str:
        return "least-time"

    def cost(self, boom: Boom, q: Array) -> Array:
        """Raise InputError, because a joint position alone has no travel time.

        Raises:
            InputError: always.
        """
        raise InputError(f"constraint {self} needs a line or an arc of the tip; a single target has no travel time")


_TIE = 1e-9  # [rad/m] above rounding error and below any measurable effect

FixingConstraint = ActuatorAngle | FixedExtension
ChoosingConstraint = LeastExtension | NearestHorizontal | LeastTorque | NearestPose | LargestMargin | LeastTime
Constraint = FixingConstraint | ChoosingConstraint


def measure(boom: Boom, constraint: Constraint, reference: ArrayLike | None = None) -> ChoosingConstraint:
    """Return the constraint whose cost is least at the best branch.

    That is a choosing constraint itself. For a fixing constraint it is the distance to `reference`,
    (5,), or to the middle of the joint ranges where that is None.

    Raises:
        InputError: reference is not finite or not (5,).
    """
    if isinstance(constraint, FixingConstraint):
        return NearestPose.to((boom.limits.lower + boom.limits.upper) / 2.0 if reference is None else reference)
    return constraint


def _spans(boom: Boom) -> Array:
    span = boom.limits.upper - boom.limits.lower
    return np.where(span > 0.0, span, 1.0)


WORDS = {
    str(constraint): constraint
    for constraint in (
        ActuatorHorizontal(),
        LeastExtension(),
        NearestHorizontal(),
        LeastTorque(),
        LargestMargin(),
        LeastTime(),
    )
}
_VALUED = ("actuator=DEG", "extension=M", "nearest=DEG,DEG,DEG,M,DEG")
CONSTRAINTS = ", ".join((*WORDS, *_VALUED))


def parse_constraint(text: str) -> Constraint:
    """Return the constraint that a word stands for.

    In `actuator=DEG`, DEG is the actuator's elevation above the horizontal.

    Raises:
        InputError: the constraint is unknown, or its value is not a finite number.
    """
    kind, equals, rest = text.partition("=")
    if text in WORDS:
        return WORDS[text]
    if kind == "nearest" and equals:
        return NearestPose.to(joint_position(text, rest))
    if kind == "actuator" and equals:
        return ActuatorAngle(float(np.radians(number("constraint actuator", rest, "degrees"))))
    if kind == "extension" and equals:
        return FixedExtension(number("constraint extension", rest, "metres"))
    raise unknown("constraint", text, (*WORDS, *_VALUED))
