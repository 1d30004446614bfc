"""Drives that the catalogue offers for a joint, and the boom with one of them."""

from collections.abc import Mapping
from dataclasses import replace

from boom_model import JOINTS, Basis, Boom, Catalogue, Drive, InputError, LinearDrive, Motor, Origin, Sourced, Wiring
from boom_model.boom import IS_LENGTH
from boom_model.words import unknown

NONE = "none"
_BETWEEN = " + "


def offered(catalogue: Catalogue, joint: str) -> tuple[str, ...]:
    """Return the drives that a joint may have: none, a motor with a gearbox, or an actuator."""
    if IS_LENGTH[JOINTS.index(joint)]:
        return NONE, *catalogue.actuators
    return NONE, *(f"{motor}{_BETWEEN}{gearbox}" for motor in catalogue.motors for gearbox in catalogue.gearboxes)


def fitted(boom: Boom, joint: str) -> str:
    """Return the name of a joint's drive."""
    drive = boom.drive_of(joint)
    return NONE if drive is None else drive.name


def with_drive(boom: Boom, catalogue: Catalogue, joint: str, name: str, supplies: Mapping[str, Drive]) -> Boom:
    """Return the boom with a drive of the catalogue on a joint.

    Voltage, wiring and brake are those that the joint has in the boom's file, or those of the first
    drive there.

    Raises:
        InputError: there is no such drive, or the motor does not stand the voltage.
    """
    if name not in offered(catalogue, joint):
        raise unknown("drive", name, offered(catalogue, joint))
    if IS_LENGTH[JOINTS.index(joint)]:
        if name == NONE:
            return replace(boom, actuator=None)
        brake = None if boom.actuator is None else boom.actuator.brake
        return boom.with_drive(joint, LinearDrive(catalogue.actuators[name], brake))
    if name == NONE:
        return boom.with_drive(joint, None)
    motor, gearbox = name.split(_BETWEEN)
    supply = supplies.get(joint) or next(iter(supplies.values()), None)
    voltage = None if supply is None else supply.bus_voltage
    most = catalogue.motors[motor].max_voltage
    if voltage is not None and most is not None and voltage.value > most:
        raise InputError(f"drive {name}: the bus voltage is {voltage.value:g} V; the motor allows {most:g} V")
    drive = Drive(
        motor=catalogue.motors[motor],
        gearbox=catalogue.gearboxes[gearbox],
        bus_voltage=voltage,
        wiring=_wiring(catalogue.motors[motor], supply),
        brake=None if supply is None else supply.brake,
    )
    return boom.with_drive(joint, drive)


def _wiring(motor: Motor, supply: Drive | None) -> Sourced[Wiring] | None:
    """Return the wiring of the supply, or the motor's only one."""
    if Wiring.SINGLE in motor.windings:
        return Sourced(Wiring.SINGLE, Origin(Basis.PRINTED, motor.source))
    return None if supply is None or motor.is_servo else supply.wiring


def supplies_of(boom: Boom) -> dict[str, Drive]:
    """Return the drives that give voltage, wiring and brake, by joint."""
    return {joint: drive for joint, drive in zip(JOINTS, boom.drives, strict=True) if drive is not None}
