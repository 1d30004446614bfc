"""States of a motion over every limit that it must keep."""

from enum import StrEnum

import numpy as np

from boom_model import Boom
from boom_model.arrays import Array
from boom_model.drives.drive import available_torque, motor_limit
from planner.timing.path_limits import gear_ratio, motor_ratio

RATIO_TOLERANCE = 1e-3
"""How far above 1 a ratio may be: what a planner may miss between the points that it looks at."""


class Limit(StrEnum):
    """A limit of the joints or of their drives."""

    POSITION = "position"
    LINKAGE = "lower - inner"
    VELOCITY = "velocity"
    ACCELERATION = "acceleration"
    JERK = "jerk"
    GEARBOX_TORQUE = "gearbox torque"
    MOTOR_TORQUE = "motor torque"
    STANDSTILL_TORQUE = "motor torque at standstill"
    """Stands for MOTOR_TORQUE where a motor's supply is not given."""
    AVERAGE_TORQUE = "average torque"


def rate_ratios(boom: Boom, qd: Array, qdd: Array, qddd: Array | None) -> dict[Limit, Array]:
    """Velocities, accelerations and, where they are given, jerks (n, 5) over the joints' limits."""
    limits = boom.limits
    ratios = {Limit.VELOCITY: np.abs(qd) / limits.velocity, Limit.ACCELERATION: np.abs(qdd) / limits.acceleration}
    return ratios if qddd is None else ratios | {Limit.JERK: np.abs(qddd) / limits.jerk}


def limit_ratios(boom: Boom, q: Array, qd: Array, qdd: Array, qddd: Array | None, tau: Array) -> dict[Limit, Array]:
    """Each limit with the ratios (n, 5) of states and torques (n, 5) to it; drive limits that no drive gives are left out.

    A position's ratio is its distance from the middle of the range over half the range; the linkage's is limit / angle.
    """
    limits = boom.limits
    half, middle = (limits.upper - limits.lower) / 2.0, (limits.upper + limits.lower) / 2.0
    away = np.abs(q - middle)
    gap, linkage = q[:, 2] - q[:, 1], np.zeros_like(q)
    linkage[:, 2] = np.divide(limits.linkage, gap, out=np.full_like(gap, np.inf), where=gap > 0.0)
    ratios = {
        Limit.POSITION: np.divide(away, half, out=np.where(away > 0.0, np.inf, 0.0), where=half > 0.0),
        Limit.LINKAGE: linkage,
        **rate_ratios(boom, qd, qdd, qddd),
    }
    supplied = all(
        available_torque(drive, 0.0) is not None for drive in boom.drives if drive and motor_limit(drive, 0.0) is not None
    )
    motor = Limit.MOTOR_TORQUE if supplied else Limit.STANDSTILL_TORQUE
    drives = {Limit.GEARBOX_TORQUE: gear_ratio(boom, tau), motor: motor_ratio(boom, tau, qd, qdd)}
    return ratios | {limit: ratio for limit, ratio in drives.items() if ratio.any()}
