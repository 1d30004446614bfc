"""Slope of the vehicle as the page sets it, or as a named vehicle case has it."""

from dataclasses import dataclass

import numpy as np

from boom_model import BaseMotion, Basis, Origin
from planner.motion.vehicle import LEVEL, VehicleCase, load_case

_SOURCE = "set on the page"
_DIGITS = 9  # of an angle in degrees, far below what a slope is known to
OWN = "as tilted"
"""Choice of no named vehicle case: the vehicle rests on the slope of roll and nose."""


@dataclass(frozen=True)
class Slope:
    """Tilt of the vehicle [deg]."""

    roll: float = 0.0
    """About the forward axis, left side up."""
    nose: float = 0.0
    """About the left axis, nose down: the pitch of a vehicle case."""

    @property
    def case(self) -> VehicleCase:
        """Vehicle case of this slope, which equals the one that `slope_file` describes."""
        if self == LEVEL_SLOPE:
            return LEVEL
        roll, pitch = (float(np.radians(angle)) for angle in (self.roll, self.nose))
        return VehicleCase("page", Origin(Basis.ASSUMED, _SOURCE), roll=roll, pitch=pitch)

    @property
    def base(self) -> BaseMotion | None:
        """Motion of the base at rest on this slope; None on level ground."""
        return self.case.tilt


LEVEL_SLOPE = Slope()


def slope_of(name: str) -> Slope:
    """Return the slope of a named vehicle case, without its track and shock.

    Raises:
        InputError: the case is unknown.
    """
    case = load_case(name)
    roll, nose = (round(float(np.degrees(angle)), _DIGITS) for angle in (case.roll, case.pitch))
    return Slope(roll, nose)


def slope_file(slope: Slope) -> str:
    """Return the slope as a file that `--vehicle` takes."""
    return (
        f'name = "page"\nbasis = "assumed"\nsource = "{_SOURCE}"\n\n[slope]\n'
        f"roll_deg = {slope.roll!r}\npitch_deg = {slope.nose!r}\n"
    )
