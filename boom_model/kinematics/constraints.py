"""The extra constraint that makes the inverse kinematics determinate.

A position and a pitch fix four of the five joints. A fixing constraint fixes the fifth. A choosing constraint takes, among all
joint positions within the limits that reach the target, the one with the least cost.
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
from boom_model.words import joint_position, number


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


@dataclass(frozen=True)
class LeastExtension:
    """The actuator is extended as little as possible. Cost: theta4 [m]."""

    unit: ClassVar[str] = "m of extension"

    def __str__(self) -> str:
        return "least-extension"

    def cost(self, boom: Boom, q: Array) -> Array:
        """(...) of q (..., 5)."""
        return q[..., 3]


@dataclass(frozen=True)
class NearestHorizontal:
    """The actuator is as parallel to the ground as possible. Cost: |theta3 - pi| [rad]; less extension breaks a tie."""

    unit: ClassVar[str] = "rad of elevation"

    def __str__(self) -> str:
        return "nearest-horizontal"

    def cost(self, boom: Boom, q: Array) -> Array:
        """(...) of q (..., 5)."""
        return np.abs(q[..., 2] - np.pi) + _TIE * q[..., 3]


@dataclass(frozen=True)
class LeastTorque:
    """The hardest-worked drive holds as little as possible, payload included.

    Cost: the largest |static torque| / (what the drive allows at rest) over the joints that have a drive. Joints without one
    do not count, because nobody knows what they bear.
    """

    unit: ClassVar[str] = "of a drive's allowed torque"

    def __str__(self) -> str:
        return "least-torque"

    def cost(self, boom: Boom, q: Array) -> Array:
        """(...) of q (..., 5).

        Raises:
            InputError: no joint has a drive with a torque limit.
        """
        limits = static_limits(boom)
        driven = np.isfinite(limits)
        if not driven.any():
            raise InputError(f"constraint {self}: no joint of {boom.name} has a drive to measure torques by")
        ratio: Array = np.max(np.abs(gravity_torque(boom, q)[..., driven]) / limits[driven], axis=-1)
        return ratio


@dataclass(frozen=True, eq=False)
class NearestPose:
    """Nearest to a joint position. Cost: sum of squares of the joints' distances, each as a share of its range."""

    pose: Array
    """(5,)"""

    @staticmethod
    def to(q: ArrayLike) -> "NearestPose":
        """The constraint of a joint position q (5,).

        Raises:
            InputError: not finite, or not (5,).
        """
        pose = checked("reference", q, 5)
        if pose.shape != (5,):
            raise InputError(f"reference has shape {pose.shape}; it must be (5,)")
        return NearestPose(read_only(pose))

    unit: ClassVar[str] = "of the squared distance"

    def __str__(self) -> str:
        return f"nearest={','.join(f'{x:.6g}' for x in self.pose)} (rad, m)"

    def cost(self, boom: Boom, q: Array) -> Array:
        """(...) of q (..., 5)."""
        distance: Array = np.sum(((q - self.pose) / _spans(boom)) ** 2, axis=-1)
        return distance


@dataclass(frozen=True)
class LargestMargin:
    """Farthest from the nearest joint limit. Cost: minus the least distance to a limit, each as a share of its joint's range.

    The coupled limit counts with the range of theta3. Joints that target and pitch fix count too: they bound what can be had.
    """

    unit: ClassVar[str] = "of a joint's range"

    def __str__(self) -> str:
        return "largest-margin"

    def cost(self, boom: Boom, q: Array) -> Array:
        """(...) of q (..., 5)."""
        spans = _spans(boom)
        excess: Array = np.max(boom.limits.excess(q) / np.array([*spans, spans[2]]), axis=-1)
        return excess


@dataclass(frozen=True)
class LeastTime:
    """Travel a line or an arc of the tip in the least time. Cost: the time under joint limits and drive torque at standstill.

    The choice is made for the whole curve; a single target has no time.
    """

    unit: ClassVar[str] = "s"

    def __str__(self) -> str:
        return "least-time"

    def cost(self, boom: Boom, q: Array) -> Array:
        """Raise InputError: a joint position alone has no time.

        Raises:
            InputError: always.
        """
        raise InputError(f"constraint {self} chooses along a line or an arc of the tip; a single target has no time")


_TIE = 1e-9  # [rad/m] above rounding, and below what anybody can measure

FixingConstraint = ActuatorAngle | FixedExtension
ChoosingConstraint = LeastExtension | NearestHorizontal | LeastTorque | NearestPose | LargestMargin | LeastTime
Constraint = FixingConstraint | ChoosingConstraint


def measure(boom: Boom, constraint: Constraint, reference: ArrayLike | None = None) -> ChoosingConstraint:
    """Return what the best branch has least of: a choosing constraint's own cost, else the distance to a reference pose.

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
CONSTRAINTS = f"{', '.join(WORDS)}, actuator=DEG, extension=M, nearest=DEG,DEG,DEG,M,DEG"


def parse_constraint(text: str) -> Constraint:
    """Return a constraint from its word; `actuator=DEG` is the actuator's elevation above the horizontal.

    Raises:
        InputError: no such constraint, or its value is not a finite number.
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
    raise InputError(f"constraint {text!r} is not known; there are: {CONSTRAINTS}")
