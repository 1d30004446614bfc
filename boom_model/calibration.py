"""What a calibration of the machine itself has found beside its lengths."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array, checked
from boom_model.errors import InputError
from boom_model.joints import JOINTS
from boom_model.provenance import Origin
from boom_model.words import unknown

UPPER, INNER = "L5 - L3", "L9 - L4"
LENGTHS = ("L1", "L2", "L3", "L4", "L6", "L7", "L8", UPPER, INNER)
OFFSETS = tuple(f"{joint} offset" for joint in JOINTS)
SCALE = "extension scale"
WIND_UPS = tuple(f"{joint} wind-up" for joint in JOINTS)
PARAMETERS = (*LENGTHS, *OFFSETS, SCALE, *WIND_UPS)
"""Figures that a calibration can measure: lengths [m], reading offsets [rad, m], shares of 1."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """Readings of the joints, and the uncertainty of what was measured.

    A joint position is scale * reading + offset.
    """

    origin: Origin
    """The source names the log."""
    offset: Array
    """(5,) [rad, the extension in m]"""
    scale: Array
    """(5,) 1 but for the extension."""
    wind_up: Array
    """(5,) measured wind-up of a gearbox over that of its printed curve; 1 where it was not
    measured."""
    parameters: tuple[str, ...]
    """What was measured, the rows of `covariance`."""
    covariance: Array
    """(k, k) in SI"""

    def __post_init__(self) -> None:
        for name in ("offset", "scale", "wind_up"):
            if checked(f"calibration {name}", getattr(self, name)).shape != (5,):
                raise InputError(f"calibration {name} has shape {getattr(self, name).shape}; it must be (5,)")
        count = len(self.parameters)
        for name in self.parameters:
            if name not in PARAMETERS:
                raise unknown("calibration parameter", name, PARAMETERS)
        if checked("calibration covariance", self.covariance).shape != (count, count):
            raise InputError(
                f"calibration covariance has shape {self.covariance.shape}; for {count} parameters it must be {(count, count)}"
            )

    def joint_positions(self, readings: ArrayLike) -> Array:
        """Return the joint positions (..., 5) of readings (..., 5), without wind-up.

        Raises:
            InputError: readings are not finite or not (..., 5).
        """
        return np.asarray(self.scale * checked("readings", readings, 5) + self.offset)

    def readings(self, q: ArrayLike) -> Array:
        """Return the readings (..., 5) at joint positions (..., 5), without wind-up.

        Raises:
            InputError: q is not finite or not (..., 5).
        """
        return np.asarray((checked("q", q, 5) - self.offset) / self.scale)
