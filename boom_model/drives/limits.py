"""Limits and inertia of the drives of a whole boom, by joint."""

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array
from boom_model.boom import Boom
from boom_model.drives.drive import drive_inertia, motor_limit


def rotors(boom: Boom) -> Array:
    """Return the drive inertia eta N^2 (J_rotor + J_gear) at the joints, (5,) [kg m^2]."""
    return np.array([drive_inertia(drive) if drive else 0.0 for drive in boom.drives])


def gear_limits(boom: Boom) -> Array:
    """Return the start-stop torque of the gearboxes, (5,) [Nm]; infinite if unknown."""
    limits = [None if drive is None else drive.gearbox.start_stop_torque for drive in boom.drives]
    return np.array([np.inf if limit is None else limit for limit in limits])


def motor_limits(boom: Boom, speed: ArrayLike) -> Array:
    """Return `motor_limit` of each joint at joint speeds (..., 5); infinite if there is none."""
    speed = np.asarray(speed, dtype=float)
    limits = np.full_like(speed, np.inf)
    for i, drive in enumerate(boom.drives):
        limit = None if drive is None else motor_limit(drive, speed[..., i])
        if limit is not None:
            limits[..., i] = limit
    return limits


def static_limits(boom: Boom) -> Array:
    """Return the torque that motor and gearbox allow at rest, (5,) [Nm]; infinite if unlimited."""
    return np.minimum(gear_limits(boom), motor_limits(boom, np.zeros(5)))
