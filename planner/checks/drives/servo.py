"""Checks of a servo motor and its gearbox against the motor's datasheet.

A servo motor may give its peak torque for a short time; what it gives for long is its continuous
torque, which the RMS torque of the duty cycle must not exceed. Datasheets print torque against
speed as a picture only: both torques are taken to last up to the rated speed, and a motion above
that speed is NOT CHECKABLE.
"""

from collections.abc import Iterator

import numpy as np

from boom_model import Basis, Drive, Motor, Origin
from boom_model.arrays import Array
from boom_model.drives.drive import motor_torque
from boom_model.drives.power import shaft_power
from planner.checks.drives.joint_view import JointView
from planner.checks.kinds import CheckKind
from planner.checks.rows import SAMPLING_SLACK, Row

INERTIA_RATIO = 10.0
"""Guideline for the reflected load inertia divided by the rotor's inertia."""


def servo_rows(view: JointView, drive: Drive) -> Iterator[Row]:
    """Return every row of a servo motor: torque, speed, power, inertia ratio, and the gearbox."""
    motor, gear = drive.motor, drive.gearbox
    hold, at = view.peak(view.static)
    held = Origin(Basis.PRINTED, f"{motor.source}, continuous torque; without help from friction [own derivation]")
    yield view.compared(CheckKind.SERVO_HOLD, demand=hold / gear.ratio, limit=motor.rated_torque, at=at, origin=held)
    yield from _torque_rows(view, drive)
    yield _speed_row(view, drive)
    yield _power_row(view, drive)
    yield inertia_row(view, drive)
    yield _overload_row(view, drive)


def inertia_row(view: JointView, drive: Drive) -> Row:
    """Return the row of the load's inertia at the motor against that of its rotor."""
    rotor, load = drive.motor.rotor_inertia, float(view.inertia.max())
    ratio = 0.0 if rotor is None else load / drive.gearbox.ratio**2 / rotor
    guide = f"guideline; load {load:.4g} kg m^2 / N^2 divided by the rotor's inertia; {sheet(drive.motor)}"
    limit = None if rotor is None else INERTIA_RATIO
    return view.compared(CheckKind.MOTOR_INERTIA_RATIO, demand=ratio, limit=limit, origin=Origin(Basis.PRINTED, guide))


def sheet(motor: Motor) -> str:
    """Return the motor's source, with the tolerance of the sheet's values."""
    return motor.source if motor.tolerance is None else f"{motor.source} (sheet values +-{motor.tolerance:.0%})"


def unknown_torque(drive: Drive) -> str:
    """Return why the torque of a motor cannot be computed."""
    return f"{sheet(drive.motor)}; {drive.gearbox.source}; efficiency, no-load torque or an inertia is not printed"


def _torque_rows(view: JointView, drive: Drive) -> Iterator[Row]:
    directions = [(CheckKind.SERVO_TORQUE, view.tau, view.qd)]
    if view.steady:  # in the reversed motion only friction changes its sign
        directions.append((CheckKind.SERVO_TORQUE_REVERSED, view.tau - 2.0 * view.friction, -view.qd))
    torques = [motor_torque(drive, tau, qd, view.qdd) for _, tau, qd in directions]
    if any(torque is None for torque in torques):
        for kind in (*(kind for kind, *_ in directions), CheckKind.SERVO_RMS_TORQUE):
            yield view.unknown(kind, why=unknown_torque(drive))
        return
    found = [np.abs(torque) for torque in torques if torque is not None]
    for (kind, *_), torque in zip(directions, found, strict=True):
        yield _peak_row(view, drive, kind, torque)
    yield _rms_row(view, drive, np.max(found, axis=0))


def _peak_row(view: JointView, drive: Drive, kind: CheckKind, torque: Array) -> Row:
    motor = drive.motor
    most, at = view.peak(torque)
    fastest, _ = view.peak(view.qd)
    if motor.peak_torque is not None and not _within(drive, fastest) and most <= motor.peak_torque * (1.0 + SAMPLING_SLACK):
        rated = "not printed" if motor.rated_speed is None else f"{motor.rated_speed * 30.0 / np.pi:.0f} rpm"
        why = f"{sheet(motor)}; above the rated speed ({rated}) the torque is printed as a picture at most"
        return view.unknown(kind, why=why, demand=most)
    origin = Origin(Basis.PRINTED, f"{sheet(motor)}, peak torque, taken to last up to the rated speed")
    return view.compared(kind, demand=most, limit=motor.peak_torque, at=at, origin=origin)


def _within(drive: Drive, fastest: float) -> bool:
    rated = drive.motor.rated_speed
    return rated is not None and drive.gearbox.ratio * fastest <= rated * (1.0 + SAMPLING_SLACK)


def _rms_row(view: JointView, drive: Drive, torque: Array) -> Row:
    """Return the row of the RMS torque; the larger torque of both directions counts."""
    motor = drive.motor
    braked = drive.brake is not None and drive.brake.value  # a motor without a brake stays on in a pause
    driven = np.where(view.duty.powered, torque, 0.0) if braked else torque
    figure = view.duty.mean(driven**2) ** 0.5
    if not _within(drive, float(np.abs(view.qd).max())):
        why = f"{sheet(motor)}; above the rated speed the continuous torque is printed as a picture at most"
        return view.unknown(CheckKind.SERVO_RMS_TORQUE, why=why, demand=figure)
    origin = Origin(Basis.PRINTED, f"{sheet(motor)}, continuous torque")
    return view.compared(CheckKind.SERVO_RMS_TORQUE, demand=figure, limit=motor.rated_torque, origin=origin)


def _speed_row(view: JointView, drive: Drive) -> Row:
    """Return the row of the speed; up to the rated speed a sheet need not print a larger one."""
    motor = drive.motor
    fastest, at = view.peak(view.qd)
    limit = motor.rated_speed if motor.max_speed is None and _within(drive, fastest) else motor.max_speed
    missing = "" if limit is not None else "; the largest speed is not printed"
    origin = Origin(Basis.PRINTED, sheet(motor) + missing)
    return view.compared(CheckKind.SERVO_SPEED, demand=drive.gearbox.ratio * fastest, limit=limit, at=at, origin=origin)


def _power_row(view: JointView, drive: Drive) -> Row:
    flow = shaft_power(drive, view.tau, view.qd, view.qdd)
    if flow is None:
        return view.informative(CheckKind.MOTOR_PEAK_POWER, figure=None, origin=Origin(Basis.PRINTED, unknown_torque(drive)))
    peak, at = view.peak(flow.shaft)
    origin = Origin(Basis.PRINTED, f"{sheet(drive.motor)}; T N qd")
    return view.informative(CheckKind.MOTOR_PEAK_POWER, figure=peak, at=at, origin=origin)


def _overload_row(view: JointView, drive: Drive) -> Row:
    """Return the row of the motor's peak torque against the gearbox's start-stop torque."""
    motor, gear, kind = drive.motor, drive.gearbox, CheckKind.MOTOR_AGAINST_GEARBOX
    both = f"{sheet(motor)}; {gear.source}"
    if motor.peak_torque is None or gear.efficiency is None or gear.start_stop_torque is None:
        return view.unknown(kind, why=f"{both}; peak torque, efficiency or start-stop torque is not printed")
    at_joint = motor.peak_torque * gear.ratio * gear.efficiency
    enough = gear.start_stop_torque / (gear.ratio * gear.efficiency)
    said = f"limit the drive's torque to {enough:.2f} Nm at the motor; {both}" if enough < motor.peak_torque else both
    return view.compared(kind, demand=at_joint, limit=gear.start_stop_torque, origin=Origin(Basis.PRINTED, said))
