"""The linear actuator as a kind of drive: what the sheet of the extension's would say, and what a force asks of its screw."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array
from boom_model.provenance import Sourced


@dataclass(frozen=True)
class LinearActuator:
    """A screw and its nut, with whatever turns it. None stands for what the datasheet does not print."""

    name: str
    source: str
    rated_force: float | None
    """Mean force over the travel that its life is given for [N]."""
    peak_force: float | None
    """Largest force while it moves [N]."""
    static_force: float | None
    """Largest force while it stands [N]."""
    max_speed: float | None
    """[m/s]"""
    stroke: float | None
    """[m]"""
    lead: float | None
    """Travel in a turn of the screw [m]."""
    efficiency: float | None
    """Share of the screw's power that becomes force times speed, 0 to 1."""
    backdrive_force: float | None
    """Force that starts to drive it back without power [N]."""
    duty: float | None
    """Share of the time that it may move, 0 to 1."""
    mass: float | None


@dataclass(frozen=True)
class LinearDrive:
    """A linear actuator as it is fitted."""

    actuator: LinearActuator
    brake: Sourced[bool] | None = None
    """Whether a brake holds it without power; None where nobody says."""


def screw_torque(actuator: LinearActuator, force: ArrayLike, speed: ArrayLike) -> Array | None:
    """Torque at the screw [Nm], signed like the force; shape of force [N] and speed [m/s], which broadcast.

        driving (F v > 0):   F l / (2 pi eta)
        braking or holding:  F l / (2 pi),  no credit for friction

    None without lead or efficiency.
    """
    if actuator.lead is None or actuator.efficiency is None:
        return None
    force, speed = np.asarray(force, dtype=float), np.asarray(speed, dtype=float)
    torque: Array = force * actuator.lead / (2.0 * np.pi) / np.where(force * speed > 0.0, actuator.efficiency, 1.0)
    return torque
