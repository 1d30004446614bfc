"""The kinds of check: what each one compares, in which unit people read it, and what follows when the limit is exceeded."""

from dataclasses import dataclass
from enum import Enum, StrEnum

import numpy as np

from boom_model.boom import IS_LENGTH, JOINTS
from boom_model.drives.drive import STEPPER_MARGIN


class Part(StrEnum):
    """Part of the boom that a check is about."""

    JOINT = "joint"
    GEARBOX = "gearbox"
    MOTOR = "motor"
    ACTUATOR = "actuator"
    BRAKE = "brake"
    UNKNOWN_DRIVE = "unknown drive"
    """A joint without drive data: what it needs of a drive."""
    MOUNT = "mount"
    ARM = "arm"
    TIP = "tip"


DRIVE_PARTS = frozenset({Part.GEARBOX, Part.MOTOR, Part.ACTUATOR, Part.BRAKE, Part.UNKNOWN_DRIVE})
"""Parts whose checks are about a drive."""


class Severity(StrEnum):
    """What follows when a demand exceeds its limit."""

    LIMIT = "limit"
    """The row FAILs."""
    GUIDELINE = "guideline"
    """The row WARNs: a rule of thumb."""
    INFORMATION = "information"
    """Nothing: the figure has no limit of its own, or none that decides."""


class Margin(StrEnum):
    """What a row's margin is."""

    RATIO = "ratio"
    """(limit - demand) / demand"""
    DISTANCE = "distance"
    """The distance to the bound, in the row's unit."""


@dataclass(frozen=True)
class Unit:
    """A unit in which people read a figure: its name, and how many of it one SI unit makes."""

    name: str
    per_si: float = 1.0


_DEGREE = 180.0 / np.pi
_RPM = 60.0 / (2.0 * np.pi)


class Quantity(Enum):
    """What a check compares: its SI unit where the joint turns and where it slides, and the same for people."""

    POSITION = ("rad", "m", Unit("deg", _DEGREE))
    VELOCITY = ("rad/s", "m/s", Unit("deg/s", _DEGREE))
    ACCELERATION = ("rad/s^2", "m/s^2", Unit("deg/s^2", _DEGREE))
    JERK = ("rad/s^3", "m/s^3", Unit("deg/s^3", _DEGREE))
    SHAFT_SPEED = ("rad/s", "rad/s", Unit("rpm", _RPM))
    """Of a motor, a gearbox's input or a screw."""
    LOST_MOTION = ("rad", "rad", Unit("mrad", 1e3))
    """Of a gearbox, at its output."""
    TORQUE = ("Nm", "N", None)
    """Of a joint: a force where it slides."""
    MOMENT = ("Nm", "Nm", None)
    """Of a shaft, or on the mount."""
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
        turning, sliding, shown = self.value
        return turning, sliding, shown

    def unit(self, joint: str) -> str:
        """The SI unit of a row of that joint; what is no joint turns."""
        turning, sliding, _ = self._units
        return sliding if _slides(joint) else turning

    def for_people(self, joint: str) -> Unit:
        """The unit in which people read a row of that joint."""
        turning, sliding, shown = self._units
        si = sliding if _slides(joint) else turning
        return Unit(si) if shown is None or si != turning else shown


def _slides(joint: str) -> bool:
    return joint in JOINTS and bool(IS_LENGTH[JOINTS.index(joint)])


class CheckKind(StrEnum):
    """A kind of check. Its value is the text in reports and JSON; a clearance's row adds what is close to what."""

    part: Part
    quantity: Quantity
    severity: Severity
    margin: Margin
    required_margin: float
    """The margin that a demand must keep."""

    def __new__(
        cls,
        text: str,
        part: Part,
        quantity: Quantity,
        severity: Severity = Severity.LIMIT,
        margin: Margin = Margin.RATIO,
        required_margin: float = 0.0,
    ) -> "CheckKind":
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
    MOTOR_INERTIA_RATIO = "motor inertia ratio", Part.MOTOR, Quantity.SHARE, Severity.GUIDELINE
    MOTOR_RESONANCE_DWELL = "motor resonance dwell", Part.MOTOR, Quantity.TIME, Severity.GUIDELINE
    MOTOR_AGAINST_GEARBOX = "motor against gearbox", Part.MOTOR, Quantity.MOMENT, Severity.GUIDELINE

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
    TIP_DEFLECTION = "deflection in all", Part.TIP, Quantity.DEFLECTION
    """For information where no tolerance is asked for."""
    TIP_FREQUENCY = "first frequency", Part.TIP, Quantity.FREQUENCY, Severity.INFORMATION
