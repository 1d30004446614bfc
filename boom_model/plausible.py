"""Plausible ranges of quantities. A value outside is most likely a mistake.

The ranges are wide enough for any boom of 10 cm to 30 m. TOML files, options of the command and
booms made in Python are all checked against this table. Angles are in degrees. Rates may be so
large that they are no limit.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from annotated_types import Ge, GroupedMetadata, Le
from numpy.typing import ArrayLike
from pydantic import AfterValidator
from pydantic.types import AllowInfNan

from boom_model.errors import InputError

_ROUNDING = 1e-9  # relative; rounding of a change of unit
_NOTHING = 1e-12


@dataclass(frozen=True)
class Range(GroupedMetadata):
    """Bounds of a quantity. In a schema, `Annotated[float, LENGTH]` checks a key against them."""

    low: float
    high: float
    unit: str

    def __iter__(self) -> Iterator[object]:
        """Return the constraints for pydantic. A number below 1e-12 becomes 0."""
        return iter((AllowInfNan(False), Ge(self.low), Le(self.high), AfterValidator(_without_rounding)))

    def require(self, name: str, values: ArrayLike) -> None:
        """Check that every value is within the bounds.

        Raises:
            InputError: a value is outside or NaN; the message has name, value and bounds.
        """
        array = np.asarray(values, dtype=float)
        outside = ~((array >= self.low - abs(self.low) * _ROUNDING) & (array <= self.high + abs(self.high) * _ROUNDING))
        if outside.any():
            value, unit = float(array[outside].flat[0]), f" {self.unit}" if self.unit else ""
            raise InputError(f"{name} is {value:g}{unit}; it must be between {self.low:g} and {self.high:g}{unit}")

    def require_radians(self, name: str, values: ArrayLike) -> None:
        """Check angles in radians against bounds in degrees.

        Raises:
            InputError: as `require`.
        """
        with np.errstate(over="ignore"):
            self.require(name, np.degrees(values))


def _without_rounding(value: float) -> float:
    return value if abs(value) >= _NOTHING else 0.0


# The boom
LENGTH = Range(1e-3, 30.0, "m")
"""Of a link."""
OFFSET = Range(-30.0, 30.0, "m")
"""A coordinate on the boom, and the extension's position."""
WIDTH = Range(0.0, 30.0, "m")
"""A length that may be zero."""
MASS = Range(0.0, 5e3, "kg")
INERTIA = Range(-1e6, 1e6, "kg m^2")
"""An entry of a tensor."""
GRAVITY = Range(0.0, 100.0, "m/s^2")
ANGLE = Range(-3600.0, 3600.0, "deg")
"""Of a joint: ten turns."""
LINKAGE_ANGLE = Range(0.0, 180.0, "deg")
TRANSMISSION_ANGLE = Range(0.0, 90.0, "deg")
ANGULAR_VELOCITY = Range(1e-3, 1e5, "deg/s")
ANGULAR_ACCELERATION = Range(1e-3, 1e9, "deg/s^2")
ANGULAR_JERK = Range(1e-3, 1e12, "deg/s^3")
VELOCITY = Range(1e-5, 1e3, "m/s")
ACCELERATION = Range(1e-5, 1e6, "m/s^2")
JERK = Range(1e-5, 1e10, "m/s^3")
VISCOUS_FRICTION = Range(0.0, 1e5, "Nm s/rad or N s/m")
COULOMB_FRICTION = Range(0.0, 1e5, "Nm or N")
MOUNT_LOAD = Range(1.0, 1e8, "N or Nm")

# Around it
POSITION = Range(-1e3, 1e3, "m")
"""A place in frame 1."""
NUMBER = Range(-1e4, 1e4, "")
"""Of a target, a pitch or a hold as people write it: degrees or metres."""
SIZE = Range(1e-3, 1e3, "m")
"""Of a shape to keep away from."""
CLEARANCE = Range(0.0, 10.0, "m")

# Motions and missions
DURATION = Range(1e-3, 1e7, "s")
TIME = Range(-1e9, 1e11, "s")
"""A sample's: the clock of a computer, too."""
MOTION = Range(-1e9, 1e9, "")
"""A sample's position, velocity or acceleration of a joint, and its torque."""
RATE = Range(1e-2, 1e6, "Hz")
FREQUENCY = Range(1e-2, 1e4, "Hz")
"""First natural frequency of the arm."""
WINDOW = Range(1e-6, 1e5, "s")
"""Of a filter."""
LIFE = Range(1e-3, 1e7, "h")
TIP_TOLERANCE = Range(1e-3, 1e4, "mm")

# Controllers
BANDWIDTH = Range(1e-3, 1e5, "Hz")
DAMPING = Range(1e-3, 1e3, "")
INTEGRAL = Range(0.0, 1e3, "")
PAYLOAD_ERROR = Range(-5e3, 5e3, "kg")

# The vehicle
SLOPE = Range(-90.0, 90.0, "deg")
TRACK_AMPLITUDE = Range(0.0, 10.0, "m")
WAVELENGTH = Range(1e-2, 1e5, "m")
VEHICLE_SPEED = Range(-100.0, 100.0, "m/s")
SHOCK = Range(-1e5, 1e5, "m/s^2")
SHOCK_DURATION = Range(1e-5, 100.0, "s")
SHOCK_START = Range(-1e7, 1e7, "s")
SHOCK_EVENTS = Range(1e-3, 1e12, "")
DIRECTION = Range(-1e3, 1e3, "")

# The design of a link
SAFETY_FACTOR = Range(1e-2, 1e3, "")
TIP_ERROR = Range(1e-7, 10.0, "m")
DEFLECTION = Range(1e-6, 1.0, "m")
HEIGHT = Range(0.0, 10.0, "m")
HEIGHT_STEP = Range(1e-7, 1.0, "m")
THICKNESS = Range(1e-5, 1.0, "m")
TAPER = Range(1e-6, 1e3, "")

# Drives
RATIO = Range(1.0, 1e4, "")
STEP_ANGLE = Range(0.1, 90.0, "deg")
ACCURACY = Range(1e-6, 90.0, "deg")
PERCENT = Range(1e-3, 100.0, "%")
EFFICIENCY = Range(1.0, 100.0, "%")
"""From 1 %: 0.65 is a share."""
DRIVE_MASS = Range(1e-3, 1e4, "kg")
TORQUE = Range(1e-4, 1e6, "Nm")
FORCE = Range(1e-3, 1e7, "N")
CURRENT = Range(1e-2, 1e3, "A")
RESISTANCE = Range(1e-4, 1e4, "ohm")
INDUCTANCE = Range(1e-4, 1e4, "mH")
VOLTAGE = Range(0.1, 1e3, "V")
ROTOR_INERTIA = Range(1e-4, 1e4, "kg cm^2")
INPUT_INERTIA = Range(1e-9, 1.0, "kg m^2")
DRIVE_INERTIA = Range(1e-6, 1e5, "kg m^2")
"""At the joint; the extension's is a mass in kg."""
STIFFNESS = Range(1e-3, 1e4, "Nm/mrad")
"""1e4 is several times the largest strain-wave gearbox; a figure in Nm/rad is mostly beyond."""
PLAY = Range(1e-6, 100.0, "mrad")
INPUT_SPEED = Range(0.1, 1e5, "rpm")
RATED_LIFE = Range(1.0, 1e7, "h")
TEMPERATURE = Range(-273.15, 1e3, "degC")
ACTUATOR_SPEED = Range(1e-5, 100.0, "m/s")
STROKE = Range(1e-3, 100.0, "m")
LEAD = Range(1e-2, 1e4, "mm")
