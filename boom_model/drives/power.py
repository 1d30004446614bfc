"""Power of a stepper drive: loss in its windings, and the way of the power from motor to joint."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array
from boom_model.drives.drive import Drive, Winding, motor_torque, reflected_inertia

PHASES = 2
"""Phases of a hybrid stepper motor."""


def copper_power(winding: Winding, current: ArrayLike | None = None) -> Array:
    """Return the loss in the windings [W] at an RMS phase current [A], in its shape.

        P = 2 I^2 R

    With microsteps the phases carry sqrt(2) I sin and sqrt(2) I cos of the electrical angle, so the
    loss does not depend on the position. None is the rated current: the power to hold at full
    current. R is the datasheet's value at 25 degC; a warm winding has more.
    """
    current = np.asarray(winding.current if current is None else current, dtype=float)
    power: Array = PHASES * current**2 * winding.resistance
    return power


def load_current(drive: Drive, torque: ArrayLike) -> Array | None:
    """Return the RMS phase current [A] that follows the motor torque [Nm], in its shape.

        I = I_rated |T| / T_run

    It is the current of a closed-loop stepper driver; I_rated gives the running torque (own
    derivation). Return None without wiring, winding data or running torque.
    """
    winding, running = drive.winding, drive.motor.running_torque
    if winding is None or running is None:
        return None
    current: Array = winding.current * np.abs(np.asarray(torque, dtype=float)) / running
    return current


def copper_per_torque(drive: Drive) -> float | None:
    """Return r [W/Nm^2] of the copper loss r T^2 at a motor torque T; None as in `load_current`."""
    current = load_current(drive, 1.0)
    if current is None or drive.winding is None:
        return None
    return float(copper_power(drive.winding, current))


@dataclass(frozen=True, eq=False)
class ShaftPower:
    """Where the power of a motor's shaft goes, arrays of one shape [W].

    `shaft` is the sum of the others.
    """

    output: Array
    """To the joint, tau qd."""
    rotor: Array
    """Into the kinetic energy of rotor and gear input, N^2 (J_rotor + J_gear) qdd qd."""
    gear_loss: Array
    """Lost in the gearbox while driving; braking has no credit for friction, as in `motor_torque`.
    """
    shaft: Array
    """From the motor, T N qd."""


def shaft_power(drive: Drive, tau: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> ShaftPower | None:
    """Return the power at the motor's shaft for joint torque [Nm], velocity and acceleration.

    The arrays broadcast. Return None if `motor_torque` has no figure.
    """
    torque, inertia = motor_torque(drive, tau, qd, qdd), reflected_inertia(drive)
    if torque is None or inertia is None:
        return None
    tau, qd, qdd = (np.asarray(x, dtype=float) for x in (tau, qd, qdd))
    shaft = torque * drive.gearbox.ratio * qd
    output, rotor = tau * qd, inertia * qdd * qd
    return ShaftPower(output, rotor, shaft - output - rotor, shaft)
