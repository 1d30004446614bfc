"""Kinds of check: compared quantity, displayed unit, severity, and required margin."""

from dataclasses import dataclass
from enum import Enum, StrEnum

import numpy as np

from boom_model.boom import IS_LENGTH, JOINTS
from boom_model.drives.drive import STEPPER_MARGIN


class Part(StrEnum):
    """Part of the boom that a check concerns."""

    JOINT = "joint"
    GEARBOX = "gearbox"
    MOTOR = "motor"
    ACTUATOR = "actuator"
    BRAKE = "brake"
    UNKNOWN_DRIVE = "unknown drive"
    """Drive of a joint without drive data. The rows show what it must provide."""
    MOUNT = "mount"
    ARM = "arm"
    TIP = "tip"


DRIVE_PARTS = frozenset({Part.GEARBOX, Part.MOTOR, Part.ACTUATOR, Part.BRAKE, Part.UNKNOWN_DRIVE})
"""Parts that belong to a drive."""


class Severity(StrEnum):
    """Consequence of a demand that exceeds its limit."""

    LIMIT = "limit"
    """Limit check: the row FAILs."""
    GUIDELINE = "guideline"
    """Rule of thumb: the row WARNs."""
    INFORMATION = "information"
    """No consequence. The row is INFO: it has no limit, or one that does not decide."""


class Margin(StrEnum):
    """Definition of a row's margin."""

    RATIO = "ratio"
    """(limit - demand) / demand"""
    DISTANCE = "distance"
    """Distance to the bound, in the row's unit."""


@dataclass(frozen=True)
class Unit:
    """Displayed unit: its name, and its number per SI unit."""

    name: str
    per_si: float = 1.0


_DEGREE = 180.0 / np.pi
_RPM = 60.0 / (2.0 * np.pi)


class Quantity(Enum):
    """Compared quantity: SI units at a revolute and at a prismatic joint, displayed unit."""

    POSITION = ("rad", "m", Unit("deg", _DEGREE))
    VELOCITY = ("rad/s", "m/s", Unit("deg/s", _DEGREE))
    ACCELERATION = ("rad/s^2", "m/s^2", Unit("deg/s^2", _DEGREE))
    JERK = ("rad/s^3", "m/s^3", Unit("deg/s^3", _DEGREE))
    SHAFT_SPEED = ("rad/s", "rad/s", Unit("rpm", _RPM))
    """Speed of a motor, a gearbox's input or a screw."""
    LOST_MOTION = ("rad", "rad", Unit("mrad", 1e3))
    """Lost motion of a gearbox, at its output."""
    TORQUE = ("Nm", "N", None)
    """Torque at a revolute joint, force at a prismatic joint."""
    MOMENT = ("Nm", "Nm", None)
    """Moment on a shaft or on the mount."""
    FORCE = ("N", "N", None)
    POWER = ("W", "W", None)
    LENGTH = ("m", "m", None)
    DEFLECTION = ("m", "m", Unit("mm", 1e3))
    TIME = ("s", "s", None)
    LIFE = ("s", "s", Unit("h", 1.0 / 3600.0))
    FREQUENCY = ("Hz", "Hz", None)
    COUNT = ("times", "times", None)
    SHARE = ("", "", None)

    @property
    def _units(self) -> tuple[str, str, Unit | None]:
        revolute, prismatic, shown = self.value
        return revolute, prismatic, shown

    def unit(self, joint: str) -> str:
        """Return the SI unit of a joint's row. Rows without a joint use the revolute unit."""
        revolute, prismatic, _ = self._units
        return prismatic if _is_prismatic(joint) else revolute

    def for_people(self, joint: str) -> Unit:
        """Return the displayed unit of a joint's row."""
        revolute, prismatic, shown = self._units
        si = prismatic if _is_prismatic(joint) else revolute
        return Unit(si) if shown is None or si != revolute else shown


def _is_prismatic(joint: str) -> bool:
    return joint in JOINTS and bool(IS_LENGTH[JOINTS.index(joint)])


class CheckKind(StrEnum):
    """Kind of check. Its value is the text in reports and JSON.

    The row of a clearance adds which link is close to which shape.
    """

    part: Part
    quantity: Quantity
    severity: Severity
    margin: Margin
    required_margin: float
    """Smallest margin that passes."""

    def __new__(
        cls,
        text: str,
        part: Part,
        quantity: Quantity,
        severity: Severity = Severity.LIMIT,
        margin: Margin = Margin.RATIO,
        required_margin: float = 0.0,
    ) -> "CheckKind":
        """Return the member; its value is the text alone."""
        kind = str.__new__(cls, text)
        kind._value_ = text
        kind.part, kind.quantity, kind.severity = part, quantity, severity
        kind.margin, kind.required_margin = margin, required_margin
        return kind

    POSITION = "position", Part.JOINT, Quantity.POSITION, Severity.LIMIT, Margin.DISTANCE
    LINKAGE = "lower - inner", Part.JOINT, Quantity.POSITION, Severity.LIMIT, Margin.DISTANCE
    TRANSMISSION_ANGLE = "transmission angle", Part.JOINT, Quantity.POSITION, Severity.GUIDELINE, Margin.DISTANCE
    VELOCITY = "velocity", Part.JOINT, Quantity.VELOCITY
    ACCELERATION = "acceleration", Part.JOINT, Quantity.ACCELERATION
    JERK = "jerk", Part.JOINT, Quantity.JERK

    GEARBOX_MOMENTARY_PEAK = "gearbox momentary peak", Part.GEARBOX, Quantity.MOMENT
    GEARBOX_MOMENTARY_PEAKS = "gearbox momentary peaks", Part.GEARBOX, Quantity.COUNT
    GEARBOX_REPEATED_PEAK = "gearbox repeated peak", Part.GEARBOX, Quantity.MOMENT
    GEARBOX_AVERAGE = "gearbox average", Part.GEARBOX, Quantity.MOMENT
    GEARBOX_CONTINUOUS = "gearbox continuous", Part.GEARBOX, Quantity.MOMENT, Severity.INFORMATION
    GEARBOX_HOLD = "gearbox hold", Part.GEARBOX, Quantity.MOMENT
    GEARBOX_INPUT_SPEED = "gearbox input speed", Part.GEARBOX, Quantity.SHAFT_SPEED
    GEARBOX_AVERAGE_INPUT_SPEED = "gearbox average input speed", Part.GEARBOX, Quantity.SHAFT_SPEED
    GEARBOX_LIFE = "gearbox life", Part.GEARBOX, Quantity.LIFE
    GEARBOX_WIND_UP = "gearbox wind-up", Part.GEARBOX, Quantity.LOST_MOTION, Severity.INFORMATION
    GEARBOX_BACKLASH = "gearbox backlash", Part.GEARBOX, Quantity.LOST_MOTION, Severity.INFORMATION
    GEARBOX_HYSTERESIS = "gearbox hysteresis", Part.GEARBOX, Quantity.LOST_MOTION, Severity.INFORMATION
    GEARBOX_RESONANCE = "gearbox resonance", Part.GEARBOX, Quantity.FREQUENCY, Severity.GUIDELINE

    MOTOR_HOLD = "motor hold", Part.MOTOR, Quantity.MOMENT, Severity.LIMIT, Margin.RATIO, STEPPER_MARGIN
    MOTOR_TORQUE = "motor torque", Part.MOTOR, Quantity.MOMENT, Severity.LIMIT, Margin.RATIO, STEPPER_MARGIN
    MOTOR_TORQUE_REVERSED = (
        "motor torque, reversed", Part.MOTOR, Quantity.MOMENT, Severity.LIMIT, Margin.RATIO, STEPPER_MARGIN
    )  # fmt: skip
    MOTOR_TORQUE_QUASI_STATIC = (
        "motor torque, quasi-static", Part.MOTOR, Quantity.MOMENT, Severity.LIMIT, Margin.RATIO, STEPPER_MARGIN
    )  # fmt: skip
    MOTOR_TORQUE_OTHER_READING = "motor torque, other reading", Part.MOTOR, Quantity.MOMENT, Severity.INFORMATION
    MOTOR_SPEED = "motor speed", Part.MOTOR, Quantity.SHAFT_SPEED
    MOTOR_RMS_TORQUE = "motor RMS torque", Part.MOTOR, Quantity.MOMENT, Severity.INFORMATION
    MOTOR_HOLDING_POWER = "motor holding power", Part.MOTOR, Quantity.POWER, Severity.INFORMATION
    """Loss in the windings at rated current."""
    MOTOR_PEAK_POWER = "motor peak power", Part.MOTOR, Quantity.POWER, Severity.INFORMATION
    """At the motor's shaft."""
    MOTOR_INERTIA_RATIO = "motor inertia ratio", Part.MOTOR, Quantity.SHARE, Severity.GUIDELINE
    MOTOR_RESONANCE_DWELL = "motor resonance dwell", Part.MOTOR, Quantity.TIME, Severity.GUIDELINE
    MOTOR_AGAINST_GEARBOX = "motor against gearbox", Part.MOTOR, Quantity.MOMENT, Severity.GUIDELINE

    SERVO_HOLD = "servo hold", Part.MOTOR, Quantity.MOMENT
    SERVO_TORQUE = "servo torque", Part.MOTOR, Quantity.MOMENT
    SERVO_TORQUE_REVERSED = "servo torque, reversed", Part.MOTOR, Quantity.MOMENT
    SERVO_RMS_TORQUE = "servo RMS torque", Part.MOTOR, Quantity.MOMENT
    SERVO_SPEED = "servo speed", Part.MOTOR, Quantity.SHAFT_SPEED

    ACTUATOR_PEAK_FORCE = "actuator peak force", Part.ACTUATOR, Quantity.FORCE
    ACTUATOR_MEAN_FORCE = "actuator mean force", Part.ACTUATOR, Quantity.FORCE
    ACTUATOR_HOLD = "actuator hold", Part.ACTUATOR, Quantity.FORCE
    ACTUATOR_SPEED = "actuator speed", Part.ACTUATOR, Quantity.VELOCITY
    ACTUATOR_STROKE = "actuator stroke", Part.ACTUATOR, Quantity.LENGTH
    ACTUATOR_DUTY = "actuator duty", Part.ACTUATOR, Quantity.SHARE
    ACTUATOR_SCREW_TORQUE = "actuator screw torque", Part.ACTUATOR, Quantity.MOMENT, Severity.INFORMATION
    ACTUATOR_SCREW_SPEED = "actuator screw speed", Part.ACTUATOR, Quantity.SHAFT_SPEED, Severity.INFORMATION

    POWER_OFF_HOLD = "power-off hold", Part.BRAKE, Quantity.TORQUE

    DRIVE_PEAK_TORQUE = "drive peak torque", Part.UNKNOWN_DRIVE, Quantity.TORQUE
    DRIVE_PEAK_FORCE = "drive peak force", Part.UNKNOWN_DRIVE, Quantity.TORQUE
    DRIVE_TOP_SPEED = "drive top speed", Part.UNKNOWN_DRIVE, Quantity.VELOCITY
    DRIVE_PEAK_POWER = "drive peak power", Part.UNKNOWN_DRIVE, Quantity.POWER
    DRIVE_WORST_HOLD = "drive worst hold", Part.UNKNOWN_DRIVE, Quantity.TORQUE
    DRIVE_RMS_TORQUE = "drive RMS torque", Part.UNKNOWN_DRIVE, Quantity.TORQUE
    DRIVE_RMS_FORCE = "drive RMS force", Part.UNKNOWN_DRIVE, Quantity.TORQUE

    MOUNT_PEAK_FORCE = "peak force", Part.MOUNT, Quantity.FORCE
    MOUNT_PEAK_MOMENT = "peak moment", Part.MOUNT, Quantity.MOMENT
    CLEARANCE = "clearance", Part.ARM, Quantity.LENGTH, Severity.LIMIT, Margin.DISTANCE

    TIP_WIND_UP = "wind-up", Part.TIP, Quantity.DEFLECTION, Severity.INFORMATION
    TIP_SAG = "sag by wind-up", Part.TIP, Quantity.DEFLECTION, Severity.INFORMATION
    TIP_BACKLASH = "backlash", Part.TIP, Quantity.DEFLECTION, Severity.INFORMATION
    TIP_HYSTERESIS = "hysteresis", Part.TIP, Quantity.DEFLECTION, Severity.INFORMATION
    TIP_STEP_ERROR = "step error", Part.TIP, Quantity.DEFLECTION, Severity.INFORMATION
    TIP_GEOMETRY = "geometry, 1 sd", Part.TIP, Quantity.DEFLECTION, Severity.INFORMATION
    """Standard deviation by the calibration's covariance."""
    TIP_DEFLECTION = "deflection in all", Part.TIP, Quantity.DEFLECTION
    """INFO if no tolerance is given."""
    TIP_FREQUENCY = "first frequency", Part.TIP, Quantity.FREQUENCY, Severity.INFORMATION
