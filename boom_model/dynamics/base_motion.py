"""Motion of the boom's base, as the vehicle imposes it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array, checked, read_only
from boom_model.errors import InputError

_UP = (0.0, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class BaseMotion:
    """Motion of frame 1 over the ground.

    Each array is (..., 3) along the axes of frame 1, constant or a time series.
    """

    velocity: Array
    """[m/s]; affects velocities only, not loads"""
    angular_velocity: Array
    """[rad/s]"""
    acceleration: Array
    """[m/s^2], without gravity"""
    angular_acceleration: Array
    """[rad/s^2]"""
    up: Array
    """Unit vector opposite to gravity: (0, 0, 1) on level ground."""

    @staticmethod
    def of(
        velocity: ArrayLike = (0.0, 0.0, 0.0),
        angular_velocity: ArrayLike = (0.0, 0.0, 0.0),
        acceleration: ArrayLike = (0.0, 0.0, 0.0),
        angular_acceleration: ArrayLike = (0.0, 0.0, 0.0),
        up: ArrayLike = _UP,
    ) -> "BaseMotion":
        """Return a base motion from arrays, after checking them. `up` is scaled to length 1.

        Raises:
            InputError: an array is not finite or not (..., 3), or `up` is zero.
        """
        given = {
            "velocity": velocity,
            "angular_velocity": angular_velocity,
            "acceleration": acceleration,
            "angular_acceleration": angular_acceleration,
            "up": up,
        }
        ready = {name: checked(f"base {name}", values, 3) for name, values in given.items()}
        length = np.linalg.norm(ready["up"], axis=-1, keepdims=True)
        if (length == 0.0).any():
            raise InputError("base up is zero; it must point against gravity")
        ready["up"] = ready["up"] / length
        return BaseMotion(**{name: read_only(values) for name, values in ready.items()})

    @property
    def moves(self) -> bool:
        """Whether the base turns or accelerates anywhere, besides being tilted."""
        return any(x.any() for x in (self.angular_velocity, self.angular_acceleration, self.acceleration))


def up_on_slope(roll: ArrayLike, pitch: ArrayLike) -> Array:
    """Return `up` (..., 3) of a base on a slope, given its roll and pitch [rad].

    Roll is about the base's forward axis. Pitch is about its left axis, positive with the nose
    down. With R_ground_base = R_y(pitch) R_x(roll),

        up = (-sin(pitch), cos(pitch) sin(roll), cos(pitch) cos(roll)).

    Raises:
        InputError: roll or pitch is not finite.
    """
    roll, pitch = np.broadcast_arrays(checked("roll", roll), checked("pitch", pitch))
    return np.stack([-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)], axis=-1)
