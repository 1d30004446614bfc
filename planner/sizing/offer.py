"""What a drive offers, item by item, against what a mission requires of it."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from operator import ge, le

import numpy as np

from boom_model import Drive, LinearDrive
from boom_model.drives.drive import STEPPER_MARGIN, available_torque, motor_limit, reflected_inertia
from planner.checks.drives.gearbox import rated_L10
from planner.sizing.requirement import Requirement

NEAREST = 3
"""Drives that `nearest` returns."""


@dataclass(frozen=True)
class Shortfall:
    """An item that a drive does not meet, in SI."""

    item: str
    asked: float | None
    """None if the figure only has to be printed."""
    offered: float | None
    """None if the datasheet does not print it."""

    def __str__(self) -> str:
        asked = "" if self.asked is None else f"{self.asked:.4g} asked, "
        return f"{self.item}: {asked}{'not printed' if self.offered is None else f'{self.offered:.4g} offered'}"


def shortfalls(need: Requirement, drive: Drive | LinearDrive) -> tuple[Shortfall, ...]:
    """Return the items of a requirement sheet that a drive does not meet.

    A drive without any passes every limit check of `size` on the mission, with no check left
    without data. The reverse does not hold, because the torque-speed table is coarser than the
    motion. The brake is left out, as in `size`.
    """
    items = _actuator(need, drive) if isinstance(drive, LinearDrive) else _drive(need, drive)
    return tuple(items)


@dataclass(frozen=True)
class Offer:
    """A drive of the catalogue against a requirement sheet."""

    drive: Drive | LinearDrive
    missing: tuple[Shortfall, ...]
    """What it does not meet; see `shortfalls`."""

    @property
    def name(self) -> str:
        """Names of motor and gearbox, or of the actuator."""
        return self.drive.name

    @property
    def short(self) -> tuple[Shortfall, ...]:
        """Items whose printed figure is not enough."""
        return tuple(each for each in self.missing if each.offered is not None)

    @property
    def unprinted(self) -> tuple[Shortfall, ...]:
        """Items that the datasheet does not print."""
        return tuple(each for each in self.missing if each.offered is None)


def nearest(need: Requirement, drives: Iterable[Drive | LinearDrive], count: int = NEAREST) -> tuple[Offer, ...]:
    """Return the drives that come nearest to a sheet, each motor and gearbox once.

    Those come first of which the fewest figures are not enough, then those of which the fewest are
    not printed, then the lightest.
    """
    best: dict[str, Offer] = {}
    for offer in sorted((Offer(drive, shortfalls(need, drive)) for drive in drives), key=_distance):
        best.setdefault(offer.name, offer)
    return tuple(best.values())[:count]


def _distance(offer: Offer) -> tuple[int, int, float]:
    drive = offer.drive
    parts = (drive.actuator.mass,) if isinstance(drive, LinearDrive) else (drive.motor.mass, drive.gearbox.mass)
    return len(offer.short), len(offer.unprinted), sum(np.inf if mass is None else mass for mass in parts)


_Test = Callable[[float, float], bool]


def _judged(item: str, asked: float | None, offered: float | None, holds: _Test = ge) -> Iterator[Shortfall]:
    if offered is None or (asked is not None and not holds(offered, asked)):
        yield Shortfall(item, asked, offered)


def _drive(need: Requirement, drive: Drive) -> Iterator[Shortfall]:
    motor, gear = drive.motor, drive.gearbox
    inertia = reflected_inertia(drive)
    yield from _judged("gearbox start-stop torque", need.peak.torque, gear.start_stop_torque)
    yield from _judged("gearbox average torque", max(need.mean or 0.0, need.hold.torque), gear.max_average_torque)
    yield from _judged("gearbox input speed", gear.ratio * need.top_speed, gear.max_input_speed)
    yield from _judged("gearbox average input speed", gear.ratio * need.mean_speed, gear.max_average_input_speed)
    yield from _life(need, drive)
    for item, figure in (
        ("gearbox stiffness", None if gear.torsion_stiffness is None else gear.torsion_stiffness[0]),
        ("gearbox stiffness ranges", None if gear.torsion_torques is None else gear.torsion_torques[0]),
        ("gearbox backlash", gear.backlash),
        ("gearbox hysteresis", gear.hysteresis),
    ):
        yield from _judged(item, None, figure)
    if motor.is_servo:
        yield from _servo(need, drive, inertia)
    else:
        yield from _judged("motor running torque", None, motor.running_torque)
        held = None if motor.holding_torque is None else gear.ratio * motor.holding_torque
        yield from _judged("motor holding torque at the joint", need.hold.torque * (1.0 + STEPPER_MARGIN), held)
    yield from _judged("reflected inertia", need.largest_reflected, inertia, le)
    if inertia is not None:
        yield from _curve(need, drive, inertia)


def _servo(need: Requirement, drive: Drive, inertia: float | None) -> Iterator[Shortfall]:
    """Yield what a servo motor lacks besides its peak torque.

    Its RMS torque is at most rms(tau) / (N eta) + T_noload + J max |qdd| / N, by the triangle
    inequality.
    """
    motor, gear = drive.motor, drive.gearbox
    held = None if motor.rated_torque is None else gear.ratio * motor.rated_torque
    yield from _judged("motor continuous torque at the joint", need.hold.torque, held)
    yield from _judged("motor rated speed", gear.ratio * need.top_speed, motor.rated_speed)
    if inertia is None or gear.efficiency is None or gear.no_load_input_torque is None:
        return  # the torque-speed table says so
    fastest = max(step.acceleration for step in need.steps)
    rms = need.rms / (gear.ratio * gear.efficiency) + gear.no_load_input_torque + inertia * fastest / gear.ratio
    yield from _judged("motor continuous torque", rms, motor.rated_torque)


def _curve(need: Requirement, drive: Drive, inertia: float) -> Iterator[Shortfall]:
    """Yield the first row of the torque-speed table that the motor does not reach.

    The torque falls with speed, so what it gives at the end of a row it gives within the row.
    """
    if available_torque(drive, 0.0) is None:
        missing = "motor torques and rated speed" if drive.motor.is_servo else "bus voltage and wiring, for torque at speed"
        yield Shortfall(missing, None, None)
        return
    given = motor_limit(drive, np.array([step.speed for step in need.steps]))
    if given is None:
        yield Shortfall("gearbox efficiency and no-load torque", None, None)
        return
    for step, torque in zip(need.steps, given, strict=True):
        asked = step.torque + inertia * step.acceleration
        if not torque >= asked:
            yield Shortfall(f"torque at the joint at {step.speed:.3g} rad/s, after the margin", asked, float(torque))
            return


def _life(need: Requirement, drive: Drive) -> Iterator[Shortfall]:
    gear = drive.gearbox
    if not need.mean:
        return
    rated = rated_L10(gear)
    if rated is None or gear.rated_input_speed is None or gear.continuous_torque is None:
        yield Shortfall("gearbox life", need.life_s, None)
        return
    speed = gear.ratio * need.mean_speed
    life = rated * (gear.rated_input_speed / speed) * (gear.continuous_torque / need.mean) ** 3
    yield from _judged("gearbox life", need.life_s, life)


def _actuator(need: Requirement, drive: LinearDrive) -> Iterator[Shortfall]:
    actuator = drive.actuator
    yield from _judged("peak force", need.peak.torque, actuator.peak_force)
    if need.mean is not None:
        yield from _judged("mean force", need.mean, actuator.rated_force)
    yield from _judged("holding force", need.hold.torque, actuator.static_force)
    yield from _judged("speed", need.top_speed, actuator.max_speed)
    yield from _judged("stroke", need.stroke, actuator.stroke)
    yield from _judged("share of the cycle in motion", need.moving_share, actuator.duty)
    yield from _judged("lead", None, actuator.lead)
    yield from _judged("efficiency", None, actuator.efficiency)
