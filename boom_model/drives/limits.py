"""Limits and inertia of the drives of a whole boom, by joint."""

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array
from boom_model.boom import Boom
from boom_model.drives.drive import drive_inertia, motor_limit


def rotors(boom: Boom) -> Array:
    """(5,) what the drives' own inertia adds to the motors' share, eta N^2 (J_rotor + J_gear) [kg m^2]."""
    return np.array([drive_inertia(drive) if drive else 0.0 for drive in boom.drives])


def gear_limits(boom: Boom) -> Array:
    """(5,) start-stop torque of the gearboxes [Nm]; infinite where none is given."""
    limits = [None if drive is None else drive.gearbox.start_stop_torque for drive in boom.drives]
    return np.array([np.inf if limit is None else limit for limit in limits])


def motor_limits(boom: Boom, speed: ArrayLike) -> Array:
    """`motor_limit` of every joint at joint speeds (..., 5), likewise shaped; infinite where no motor limits."""
    speed = np.asarray(speed, dtype=float)
    limits = np.full_like(speed, np.inf)
    for i, drive in enumerate(boom.drives):
        limit = None if drive is None else motor_limit(drive, speed[..., i])
        if limit is not None:
            limits[..., i] = limit
    return limits


def static_limits(boom: Boom) -> Array:
    """(5,) torque that motor and gearbox allow at rest [Nm]; infinite where no drive limits."""
    return np.minimum(gear_limits(boom), motor_limits(boom, np.zeros(5)))
