"""Ratios of the states of a motion to the limits of joints and drives."""

from enum import StrEnum

import numpy as np

from boom_model import Boom
from boom_model.arrays import Array
from boom_model.drives.drive import available_torque, motor_limit
from planner.timing.path_limits import gear_ratio, motor_ratio

RATIO_TOLERANCE = 1e-3
"""Tolerance above 1 of a ratio, because a planner tests the limits at grid points only."""


class Limit(StrEnum):
    """Limit of the joints or of their drives."""

    POSITION = "position"
    LINKAGE = "lower - inner"
    VELOCITY = "velocity"
    ACCELERATION = "acceleration"
    JERK = "jerk"
    GEARBOX_TORQUE = "gearbox torque"
    MOTOR_TORQUE = "motor torque"
    STANDSTILL_TORQUE = "motor torque at standstill"
    """Replaces MOTOR_TORQUE if the supply of a motor is unknown."""
    AVERAGE_TORQUE = "average torque"


def rate_ratios(boom: Boom, qd: Array, qdd: Array, qddd: Array | None) -> dict[Limit, Array]:
    """Return the ratios of joint velocities, accelerations and jerks (n, 5) to their limits.

    Jerks are left out if they are None.
    """
    limits = boom.limits
    ratios = {Limit.VELOCITY: np.abs(qd) / limits.velocity, Limit.ACCELERATION: np.abs(qdd) / limits.acceleration}
    return ratios if qddd is None else ratios | {Limit.JERK: np.abs(qddd) / limits.jerk}


def limit_ratios(boom: Boom, q: Array, qd: Array, qdd: Array, qddd: Array | None, tau: Array) -> dict[Limit, Array]:
    """Return the ratios (n, 5) of states and torques (n, 5) to each limit.

    The ratio of a position is its distance from the middle of the range divided by half the range.
    The ratio of the linkage is limit / angle. Drive limits that no drive has are left out.
    """
    limits = boom.limits
    half, middle = (limits.upper - limits.lower) / 2.0, (limits.upper + limits.lower) / 2.0
    away = np.abs(q - middle)
    gap, linkage = q[:, 2] - q[:, 1], np.zeros_like(q)
    linkage[:, 2] = np.divide(limits.linkage, gap, out=np.full_like(gap, np.inf), where=gap > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        apart = away / half
    apart[(away == 0.0) & (half == 0.0)] = 0.0
    ratios = {
        Limit.POSITION: apart,
        Limit.LINKAGE: linkage,
        **rate_ratios(boom, qd, qdd, qddd),
    }
    supplied = all(
        available_torque(drive, 0.0) is not None for drive in boom.drives if drive and motor_limit(drive, 0.0) is not None
    )
    motor = Limit.MOTOR_TORQUE if supplied else Limit.STANDSTILL_TORQUE
    drives = {Limit.GEARBOX_TORQUE: gear_ratio(boom, tau), motor: motor_ratio(boom, tau, qd, qdd)}
    return ratios | {limit: ratio for limit, ratio in drives.items() if ratio.any()}
