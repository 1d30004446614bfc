"""Motor, gearbox and drive: datasheet limits, and the motor torque for a joint torque."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array
from boom_model.provenance import Origin, Sourced


class Wiring(StrEnum):
    """Connection of a stepper motor's phases: of the two halves of each, or of the only winding."""

    PARALLEL = "parallel"
    SERIES = "series"
    SINGLE = "single"
    """The only winding of a motor with four leads."""


STEPPER_MARGIN = 0.5
"""Required (available - required) / required torque of a stepper motor.

It is the usual rule of thumb against pull-out.
"""


@dataclass(frozen=True)
class Winding:
    """Electrical data of a motor in one wiring."""

    current: float
    """RMS phase current [A]."""
    resistance: float
    """Phase resistance [ohm]."""
    inductance: float
    """Phase inductance [H]."""


@dataclass(frozen=True)
class Motor:
    """Hybrid stepper motor or servo motor. None is a value that the datasheet does not print."""

    name: str
    source: str
    step: float | None
    """Full step [rad]; None for a servo motor."""
    max_voltage: float | None
    holding_torque: float | None
    running_torque: float | None
    """Torque at low speed [Nm]."""
    mass: float | None
    rotor_inertia: float | None
    """[kg m^2]"""
    parallel: Winding | None
    series: Winding | None
    microstep_accuracy: float | None
    """Largest error of a microstep without load [rad]."""
    tolerance: float | None
    """Fraction by which a motor may differ from its datasheet."""
    single: Winding | None = None
    """The only winding of a stepper motor with four leads."""
    rated_torque: float | None = None
    """Continuous torque of a servo motor [Nm]."""
    peak_torque: float | None = None
    """Largest torque of a servo motor for a short time [Nm]."""
    rated_speed: float | None = None
    """Speed of a servo motor up to which its torques hold [rad/s]."""
    max_speed: float | None = None
    """Largest speed of a servo motor [rad/s]."""

    @property
    def is_servo(self) -> bool:
        """Whether it is a servo motor, which has no step."""
        return self.step is None

    @property
    def windings(self) -> dict[Wiring, Winding]:
        """Data of the windings that the datasheet prints, by wiring."""
        each = {Wiring.PARALLEL: self.parallel, Wiring.SERIES: self.series, Wiring.SINGLE: self.single}
        return {wiring: winding for wiring, winding in each.items() if winding is not None}

    @property
    def torque_margin(self) -> float:
        """Required (available - required) / required torque; STEPPER_MARGIN, or 0 for a servo.

        A servo motor does not lose steps when its torque is short for a moment.
        """
        return 0.0 if self.is_servo else STEPPER_MARGIN


@dataclass(frozen=True)
class Gearbox:
    """Strain-wave gearbox, with torques at the output unless stated otherwise.

    None stands for a value that the datasheet does not print.
    """

    name: str
    source: str
    ratio: float
    continuous_torque: float | None
    start_stop_torque: float | None
    max_average_torque: float | None
    peak_torque: float | None
    efficiency: float | None
    """Output power over input power, 0 to 1."""
    no_load_input_torque: float | None
    starting_torque: float | None
    backdrive_torque: float | None
    mass: float | None
    input_inertia: float | None
    """Inertia at the input [kg m^2]."""
    torsion_torques: tuple[float, float] | None
    """Torques T1 and T2 at which the stiffness changes [Nm]."""
    torsion_stiffness: tuple[float, float, float] | None
    """Stiffness K1, K2 and K3 of the three ranges [Nm/rad]."""
    backlash: float | None
    """[rad]"""
    hysteresis: float | None
    """[rad]"""
    max_input_speed: float | None
    """Largest speed at the input [rad/s]."""
    max_average_input_speed: float | None
    """Largest average speed at the input [rad/s]."""
    rated_life: float | None
    """Life L50 at continuous torque and rated input speed [s]: half of the gearboxes reach it."""
    rated_input_speed: float | None
    """Input speed of the rated life [rad/s]."""
    rated_L10: float | None = None
    """Life L10 at continuous torque and rated input speed [s]: nine of ten gearboxes reach it."""
    peak_events: float | None = None
    """Number of times that a planetary gearbox may bear its peak torque; None for a strain wave."""


@dataclass(frozen=True)
class Drive:
    """A motor with a gearbox, its wiring and its bus voltage.

    Without voltage or wiring, only the torque at low speed is known.
    """

    motor: Motor
    gearbox: Gearbox
    bus_voltage: Sourced[float] | None
    wiring: Sourced[Wiring] | None
    brake: Sourced[bool] | None = None
    """Whether a brake holds the joint without power; None if unknown."""
    inertia: Sourced[float] | None = None
    """Measured inertia of motor and gearbox at the joint [kg m^2]; None uses the datasheets."""

    @property
    def name(self) -> str:
        """Names of motor and gearbox."""
        return f"{self.motor.name} + {self.gearbox.name}"

    @property
    def winding(self) -> Winding | None:
        """Data of the motor in the chosen wiring; None if the wiring or its data is unknown."""
        return None if self.wiring is None else self.motor.windings.get(self.wiring.value)

    @property
    def supply_origins(self) -> tuple[Origin, ...]:
        """Origins of bus voltage and wiring, where they are given."""
        return tuple(s.origin for s in (self.bus_voltage, self.wiring) if s is not None)


def reflected_inertia(drive: Drive) -> float | None:
    """Return the drive's inertia at the joint [kg m^2], or None if it is unknown.

    It is the measured one, or else N^2 (J_rotor + J_gear) of the datasheets.
    """
    if drive.inertia is not None:
        return drive.inertia.value
    rotor, gear = drive.motor.rotor_inertia, drive.gearbox.input_inertia
    if rotor is None or gear is None:
        return None
    return drive.gearbox.ratio**2 * (rotor + gear)


def available_torque(drive: Drive, speed: ArrayLike) -> Array | None:
    """Return the torque [Nm] available at a motor speed [rad/s], in the shape of `speed`.

        T = T_run min(1, V / sqrt((R I_p + K_m w)^2 + (p w L I_p)^2)),
        I_p = sqrt(2) I,  K_m = T_run / I_p

    p = 50 for a 1.8 degree step: the number of pole pairs is a quarter of the number of steps per
    turn. The datasheet prints its torque-speed curve only as a picture, so this is an estimate of
    our own. It neglects iron losses, detent torque and resonance. A servo motor has its peak torque
    up to its rated speed, then its rated power (our own reading), and nothing above its largest
    speed. Return None without voltage, wiring or motor data; a servo motor needs no voltage.
    """
    if drive.motor.is_servo:
        return _servo_torque(drive.motor, np.abs(np.asarray(speed, dtype=float)))
    terms = _curve_terms(drive)
    if terms is None or drive.motor.running_torque is None:
        return None
    voltage, resistive, back_emf, reactive = terms
    w = np.abs(np.asarray(speed, dtype=float))
    needed = np.hypot(resistive + back_emf * w, reactive * w)
    available: Array = drive.motor.running_torque * np.minimum(1.0, voltage / needed)
    return available


def _servo_torque(motor: Motor, speed: Array) -> Array | None:
    rated, peak, corner = motor.rated_torque, motor.peak_torque, motor.rated_speed
    if rated is None or peak is None or corner is None:
        return None
    beyond = rated * corner / np.maximum(speed, corner)
    torque = np.where(speed <= corner, peak, beyond)
    return torque if motor.max_speed is None else np.where(speed <= motor.max_speed, torque, 0.0)


def speed_for_torque(drive: Drive, torque: ArrayLike) -> Array | None:
    """Return the highest motor speed [rad/s] at which `available_torque` is at least `torque` [Nm].

    It solves (R I_p + K_m w)^2 + (p w L I_p)^2 = (V T_run / T)^2, a quadratic equation in w, and
    has the shape of `torque`. For T = T_run this is the corner speed. The speed is 0 if no speed
    gives the torque, and infinite if the torque is 0. Return None without voltage, wiring or motor
    data, and for a servo motor.
    """
    terms, running = _curve_terms(drive), drive.motor.running_torque
    if terms is None or running is None:
        return None
    return _speed_on_curve(terms, running, np.asarray(torque, dtype=float))


def _speed_on_curve(terms: tuple[float, float, float, float], running: float, torque: Array) -> Array:
    voltage, resistive, back_emf, reactive = terms
    with np.errstate(divide="ignore"):
        level = np.where(torque > running, 0.0, voltage * running / np.maximum(torque, 0.0))
    a, half_b = back_emf**2 + reactive**2, resistive * back_emf
    c = np.minimum(resistive**2 - level**2, 0.0)
    speed: Array = (np.sqrt(half_b**2 - a * c) - half_b) / a
    return speed


def _curve_terms(drive: Drive) -> tuple[float, float, float, float] | None:
    winding, motor = drive.winding, drive.motor
    if winding is None or drive.bus_voltage is None or motor.running_torque is None or motor.step is None:
        return None
    peak_current = np.sqrt(2.0) * winding.current
    pole_pairs = 2.0 * np.pi / motor.step / 4.0
    return (
        drive.bus_voltage.value,
        float(winding.resistance * peak_current),
        float(motor.running_torque / peak_current),
        float(pole_pairs * winding.inductance * peak_current),
    )


def mesh_efficiency(gearbox: Gearbox) -> float | None:
    """Return the efficiency of the gear mesh alone.

        eta_mesh = (T_rated / N) / (T_rated / (N eta) - T_noload)

    This assumes that the printed efficiency already includes the no-load torque at rated torque:
    T_rated / (N eta_mesh) + T_noload = T_rated / (N eta). Return None if a value is missing, or if
    eta_mesh would exceed 1.
    """
    rated, eta, no_load = gearbox.continuous_torque, gearbox.efficiency, gearbox.no_load_input_torque
    if rated is None or eta is None or no_load is None:
        return None
    left = rated / (gearbox.ratio * eta) - no_load
    mesh = rated / gearbox.ratio / left if left > 0.0 else np.inf
    return mesh if mesh <= 1.0 else None


def motor_torque(
    drive: Drive, tau: ArrayLike, qd: ArrayLike, qdd: ArrayLike, *, no_load_in_efficiency: bool = False
) -> Array | None:
    """Return the motor torque [Nm] for joint torque `tau` [Nm], `qd` [rad/s] and `qdd` [rad/s^2].

        driving (tau qd > 0):  tau / (N eta) + sign(qd) T_noload + (J_rotor + J_gear) N qdd
        braking or holding:    tau / N                           + (J_rotor + J_gear) N qdd

    It has the sign convention of `tau`. By default the no-load torque is added to the loss of the
    efficiency, which is the conservative reading of the datasheet. With `no_load_in_efficiency`,
    eta is `mesh_efficiency`, the other reading. Friction is not credited while braking. This is our
    own derivation, similar to Harmonic Drive's selection pages. The torque jumps by T_noload at tau
    = 0. Return None if a value is missing.
    """
    gear, inertia = drive.gearbox, reflected_inertia(drive)
    efficiency = mesh_efficiency(gear) if no_load_in_efficiency else gear.efficiency
    if efficiency is None or gear.no_load_input_torque is None or inertia is None:
        return None
    tau, qd, qdd = (np.asarray(x, dtype=float) for x in (tau, qd, qdd))
    driving = tau * qd > 0.0
    loss = np.where(driving, tau * (1.0 / efficiency - 1.0) / gear.ratio, 0.0)
    drag = np.where(driving, np.sign(qd) * gear.no_load_input_torque, 0.0)
    torque: Array = tau / gear.ratio + loss + drag + inertia / gear.ratio * qdd
    return torque


def drive_inertia(drive: Drive) -> float:
    """Return the drive's own inertia at the joint while driving.

        eta N^2 (J_rotor + J_gear) [kg m^2]

    Missing inertias count as 0, a missing efficiency as 1.
    """
    return (drive.gearbox.efficiency or 1.0) * (reflected_inertia(drive) or 0.0)


def motor_limit(drive: Drive, speed: ArrayLike) -> Array | None:
    """Return the joint torque [Nm] that the motor allows at a joint speed [rad/s], of its shape.

        (T_available(N speed) / (1 + margin) - T_noload) N eta,  margin from `Motor.torque_margin`

    This bounds |tau + eta N^2 (J_rotor + J_gear) qdd|, where friction is part of tau. Without
    voltage or wiring, the running torque replaces the torque-speed curve; above low speed the limit
    is then necessary but not sufficient. Return None if a value is missing.
    """
    gear, w = drive.gearbox, drive.gearbox.ratio * np.asarray(speed, dtype=float)
    curve = available_torque(drive, w)
    motor = drive.motor.running_torque if curve is None else curve
    if motor is None or gear.efficiency is None or gear.no_load_input_torque is None:
        return None
    spare = np.maximum(np.asarray(motor) / (1.0 + drive.motor.torque_margin) - gear.no_load_input_torque, 0.0)
    limit: Array = np.broadcast_to(spare * gear.ratio * gear.efficiency, w.shape)
    return limit


def drive_torque_limit(drive: Drive, speed: ArrayLike) -> Array | None:
    """Return the joint torque [Nm] that the drive allows at a joint speed [rad/s], for qdd = 0.

    It is the smaller of `motor_limit` and the gearbox's start-stop torque. The latter bounds |tau|
    alone, because the rotor is on the input side of the gears. Return None if neither is known.
    """
    limits = [] if (motor := motor_limit(drive, speed)) is None else [motor]
    if drive.gearbox.start_stop_torque is not None:
        limits.append(np.full(np.shape(speed), drive.gearbox.start_stop_torque))
    if not limits:
        return None
    limit: Array = np.min(limits, axis=0)
    return limit


def drive_torque_tangent(drive: Drive, speed: ArrayLike) -> tuple[Array, Array] | None:
    """Return intercept [Nm] and slope [Nm s^2/rad^2] of a line in qd^2 below the torque curve.

    Beyond its corner, the motor's torque curve is a convex function of the squared speed. Its
    tangent at `speed`, or at the corner if that is faster, is therefore below it everywhere beyond
    the corner. Together with `motor_limit` at rest as a second bound, it never allows more than the
    curve. Return None if the curve is unknown.
    """
    terms, gear = _curve_terms(drive), drive.gearbox
    running = drive.motor.running_torque
    if terms is None or gear.efficiency is None or gear.no_load_input_torque is None or running is None:
        return None
    voltage, resistive, back_emf, reactive = terms
    corner = _speed_on_curve(terms, running, np.asarray(running))
    w = np.maximum(np.maximum(gear.ratio * np.abs(np.asarray(speed, dtype=float)), corner), 1e-6)
    needed = (resistive + back_emf * w) ** 2 + (reactive * w) ** 2
    torque = running * voltage / np.sqrt(needed)
    falls = -torque / (2.0 * needed) * (resistive * back_emf / w + back_emf**2 + reactive**2)
    gain = gear.ratio * gear.efficiency / (1.0 + STEPPER_MARGIN)
    slope = gain * falls * gear.ratio**2
    at_tangent = gain * torque - gear.no_load_input_torque * gear.ratio * gear.efficiency
    return at_tangent - slope * (w / gear.ratio) ** 2, slope
