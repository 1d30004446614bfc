"""Linear actuator as the drive of the extension: its datasheet values and its screw torque."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array
from boom_model.provenance import Sourced


@dataclass(frozen=True)
class LinearActuator:
    """A screw with its nut and its motor.

    None stands for a value that the datasheet does not print.
    """

    name: str
    source: str
    rated_force: float | None
    """Mean force over the travel of its rated life [N]."""
    peak_force: float | None
    """Largest force while it moves [N]."""
    static_force: float | None
    """Largest force at rest [N]."""
    max_speed: float | None
    """[m/s]"""
    stroke: float | None
    """[m]"""
    lead: float | None
    """Travel per turn of the screw [m]."""
    efficiency: float | None
    """Output power (force times speed) over screw power, 0 to 1."""
    backdrive_force: float | None
    """Force at which it moves back without power [N]."""
    duty: float | None
    """Fraction of the time in which it may move, 0 to 1."""
    mass: float | None


@dataclass(frozen=True)
class LinearDrive:
    """A linear actuator as fitted to the boom."""

    actuator: LinearActuator
    brake: Sourced[bool] | None = None
    """Whether a brake holds it without power; None if unknown."""

    @property
    def name(self) -> str:
        """Name of the actuator."""
        return self.actuator.name


def screw_torque(actuator: LinearActuator, force: ArrayLike, speed: ArrayLike) -> Array | None:
    """Return the torque at the screw [Nm] for a force [N] and a speed [m/s], which broadcast.

        driving (F v > 0):   F l / (2 pi eta)
        braking or holding:  F l / (2 pi),  without credit for friction

    The torque has the sign of the force. Return None without lead or efficiency.
    """
    if actuator.lead is None or actuator.efficiency is None:
        return None
    force, speed = np.asarray(force, dtype=float), np.asarray(speed, dtype=float)
    torque: Array = force * actuator.lead / (2.0 * np.pi) / np.where(force * speed > 0.0, actuator.efficiency, 1.0)
    return torque
