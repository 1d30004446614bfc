"""Power and energy of a motion: at joints, in windings, at drivers and from the supply."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from boom_model import JOINTS, Drive, kinetic_energy, potential_energy
from boom_model.arrays import Array, Mask
from boom_model.drives.drive import motor_torque
from boom_model.drives.power import copper_power, load_current, shaft_power
from planner.checks.drives.duty import Duty
from planner.checks.evaluation import Evaluation

_RESTS = 1e-6
"""Travel [rad or m] that is rounding."""


class Current(StrEnum):
    """Policy for the phase current of the stepper motors."""

    FULL = "full"
    """Rated current all the time, in pauses as well."""
    REDUCED = "reduced"
    """Rated current in motion, a share of it at standstill."""
    BRAKE = "brake"
    """As `REDUCED`, and none in a pause where a brake holds the joint."""
    LOAD = "load"
    """Current in proportion to the motor torque, and none in a pause where a brake holds the joint.
    """


class Surplus(StrEnum):
    """Where power goes that the drives give back together."""

    BATTERY = "battery"
    RESISTOR = "resistor"
    """Brake resistor."""


@dataclass(frozen=True)
class Supply:
    """How the motors are fed. All of it is assumed unless the user says so."""

    current: Current = Current.BRAKE
    standstill: float = 0.5
    """Share of the rated current at standstill, the usual setting of stepper drivers."""
    efficiency: float = 0.9
    """Efficiency of the drivers in either direction."""
    surplus: Surplus = Surplus.RESISTOR

    @property
    def sentence(self) -> str:
        """What is assumed, in a sentence."""
        policy = {
            Current.FULL: "rated current all the time",
            Current.REDUCED: f"rated current in motion and {self.standstill:.0%} of it at standstill",
            Current.BRAKE: f"rated current in motion, {self.standstill:.0%} of it at standstill, none in a pause with a brake",
            Current.LOAD: "current in proportion to the motor torque, none in a pause with a brake",
        }[self.current]
        sink = "charges the battery" if self.surplus is Surplus.BATTERY else "goes to a brake resistor"
        return f"supply: {policy}; drivers of {self.efficiency:.0%} efficiency; power given back {sink}; nobody gives these"


ASSUMED_SUPPLY = Supply()
"""How the motors are fed where nobody says."""


@dataclass(frozen=True, eq=False)
class JointPower:
    """Power of one joint over the samples, arrays (n,) [W]; None where the drive has no data."""

    joint: str
    output: Array
    """At the joint, tau qd; negative where the load drives the joint."""
    friction: Array
    """Part of it that is lost in the joint's friction."""
    rotor: Array | None
    gear_loss: Array | None
    copper: Array | None
    """Lost in the windings."""
    electrical: Array | None
    """At the driver's input; negative where the drive gives power back."""


def joint_powers(
    evaluation: Evaluation,
    supply: Supply = ASSUMED_SUPPLY,
    parts: Sequence[slice] = (slice(None),),
    powered: Mask | None = None,
) -> tuple[JointPower, ...]:
    """Return the power of every joint at the samples of a motion.

        shaft = tau qd + N^2 (J_rotor + J_gear) qdd qd + gear loss
        electrical = (shaft + copper) / eta  if the sum is positive, else (shaft + copper) eta

    Args:
        evaluation: states and loads of the motion.
        supply: current policy and efficiency of the drivers.
        parts: samples of each leg. A joint that rests in a whole leg is at standstill there.
        powered: (n,) whether the motors are on although a brake could hold; None is always.
    """
    on = np.ones(len(evaluation.tau), dtype=bool) if powered is None else powered
    return tuple(_joint(evaluation, i, supply, parts, on) for i in range(5))


def _joint(evaluation: Evaluation, i: int, supply: Supply, parts: Sequence[slice], on: Mask) -> JointPower:
    motion, drive = evaluation.trajectory, evaluation.boom.drives[i]
    tau, qd, qdd = evaluation.tau[:, i], motion.qd[:, i], motion.qdd[:, i]
    output, friction = tau * qd, evaluation.friction[:, i] * qd
    flow = None if drive is None else shaft_power(drive, tau, qd, qdd)
    copper = None
    if drive is not None:
        still = np.zeros(qd.shape, dtype=bool)
        for part in parts:
            still[part] = np.ptp(motion.q[part, i]) <= _RESTS
        copper = _copper(drive, tau, qd, qdd, still, on, supply)
    electrical = None
    if flow is not None and copper is not None:
        sum_ = flow.shaft + copper
        electrical = np.where(sum_ > 0.0, sum_ / supply.efficiency, sum_ * supply.efficiency)
    rotor, loss = (None, None) if flow is None else (flow.rotor, flow.gear_loss)
    return JointPower(JOINTS[i], output, friction, rotor, loss, copper, electrical)


def _copper(drive: Drive, tau: Array, qd: Array, qdd: Array, still: Mask, on: Mask, supply: Supply) -> Array | None:
    winding = drive.winding
    if winding is None:
        return None
    braked = ~on & (drive.brake is not None and drive.brake.value)
    if supply.current is Current.LOAD:
        torque = motor_torque(drive, tau, qd, qdd)
        following = None if torque is None else load_current(drive, torque)
        return None if following is None else copper_power(winding, np.where(braked, 0.0, following))
    share = np.ones(tau.shape)
    if supply.current is not Current.FULL:
        share = np.where(still, supply.standstill, share)
    if supply.current is Current.BRAKE:
        share = np.where(braked, 0.0, share)
    return copper_power(winding, share * winding.current)


@dataclass(frozen=True)
class JointEnergy:
    """Energies of one joint in a cycle [J]; None where the drive has no data."""

    joint: str
    driving: float
    """Work of the drive on the joint."""
    braking: float
    """Work that the load gives back."""
    friction: float
    peak_W: float
    """Largest power at the joint."""
    gear_loss: float | None
    copper: float | None
    electrical: float | None
    peak_electrical_W: float | None


@dataclass(frozen=True)
class Balance:
    """Work of the joint torques [J]: work = kinetic + potential + friction + residual."""

    work: float
    kinetic: float
    potential: float
    friction: float
    turnover: float
    """Work done and given back, without sign."""

    @property
    def residual(self) -> float:
        """What sampling leaves unexplained."""
        return self.work - self.kinetic - self.potential - self.friction


@dataclass(frozen=True)
class Energy:
    """Power and energy of a motion, or of a mission's cycle.

    Electrical figures are those of the known drives.
    """

    supply: Supply
    duration: float
    joints: tuple[JointEnergy, ...]
    balance: Balance | None
    """None on a moving vehicle, which does work itself, and with the payload as a force."""
    drawn: float | None
    """Energy from the supply, less what charges it [J]; None if no drive is known."""
    peak_W: float | None
    """Largest power from the supply."""
    peak_A: float | None
    """Largest current from the supply; None without a common bus voltage."""
    returned: float | None
    """Energy that the drives give back together [J]."""
    peak_returned_W: float | None
    """Largest power that they give back together: what a brake resistor must take."""
    unknown: tuple[str, ...]
    """Joints of which no electrical power is known."""

    @property
    def sentence(self) -> str:
        """The answer in a sentence."""
        left = f"; not counted, without drive data: {', '.join(self.unknown)}" if self.unknown else ""
        if self.drawn is None or self.peak_W is None:
            return f"supply: not known{left}"
        amperes = "" if self.peak_A is None else f", {self.peak_A:.3g} A"
        return f"supply: {watt_hours(self.drawn)} in {self.duration:.0f} s, at most {self.peak_W:.0f} W{amperes}{left}"

    @property
    def sentences(self) -> tuple[str, ...]:
        """The answer, what is given back, the balance, and what is assumed."""
        found = [self.sentence]
        if self.returned and self.peak_returned_W is not None:
            found.append(f"the drives give back {watt_hours(self.returned)}, at most {self.peak_returned_W:.0f} W")
        if self.balance is not None:
            b = self.balance
            found.append(
                f"work at the joints {b.work:.4g} J = kinetic {b.kinetic + 0.0:.4g} J + potential {b.potential + 0.0:.4g} J + "
                f"friction {b.friction:.4g} J, to {abs(b.residual) / max(b.turnover, 1e-12):.0e} of the work either way"
            )
        return (*found, self.supply.sentence)

    def to_json(self) -> dict[str, Any]:
        """Return the energies as an object, in SI."""
        joints = [
            {
                "joint": each.joint,
                "driving_J": each.driving,
                "braking_J": each.braking,
                "friction_J": each.friction,
                "peak_W": each.peak_W,
                "gear_loss_J": each.gear_loss,
                "copper_J": each.copper,
                "electrical_J": each.electrical,
                "peak_electrical_W": each.peak_electrical_W,
            }
            for each in self.joints
        ]
        return {
            "duration_s": self.duration,
            "current": self.supply.current,
            "standstill_share": self.supply.standstill,
            "driver_efficiency": self.supply.efficiency,
            "surplus": self.supply.surplus,
            "drawn_J": self.drawn,
            "peak_W": self.peak_W,
            "peak_A": self.peak_A,
            "returned_J": self.returned,
            "peak_returned_W": self.peak_returned_W,
            "unknown": list(self.unknown),
            "joints": joints,
            "balance": None
            if self.balance is None
            else {f"{name}_J": value for name, value in asdict(self.balance).items()} | {"residual_J": self.balance.residual},
        }


ENERGY_HEADER = ("joint", "driving", "braking", "friction", "largest", "gear loss", "copper", "electrical")


def energy_cells(energy: JointEnergy) -> tuple[str, ...]:
    """Return a joint's energies as text, in the columns of ENERGY_HEADER."""
    known = (energy.driving, energy.braking, energy.friction)
    rest = (energy.gear_loss, energy.copper, energy.electrical)
    return (
        energy.joint,
        *(watt_hours(value) for value in known),
        f"{energy.peak_W:.3g} W",
        *("-" if value is None else watt_hours(value) for value in rest),
    )


def watt_hours(joules: float) -> str:
    """Return an energy as text."""
    return f"{joules / 3600.0 + 0.0:.3g} Wh"


def energy_of(
    evaluation: Evaluation,
    duty: Duty | None = None,
    parts: Sequence[slice] = (slice(None),),
    counts: Sequence[float] = (1.0,),
    supply: Supply = ASSUMED_SUPPLY,
) -> Energy:
    """Return power and energy of a motion, or of a mission's cycle.

    Integrals are trapezoidal over the samples.

    Args:
        evaluation: states and loads at the samples.
        duty: time of each sample in the cycle; None is the motion once.
        parts: samples of each leg.
        counts: number of occurrences of each leg.
        supply: how the motors are fed.
    """
    duty = Duty.alone(evaluation.t) if duty is None else duty
    powers = joint_powers(evaluation, supply, parts, duty.powered)
    known = [power.electrical for power in powers if power.electrical is not None]
    drawn = returned = peak_W = peak_A = peak_returned = None
    if known:
        bus = np.sum(known, axis=0)
        back = np.maximum(-bus, 0.0)
        taken = bus if supply.surplus is Surplus.BATTERY else np.maximum(bus, 0.0)
        drawn, returned = float(duty.weight @ taken), float(duty.weight @ back)
        peak_W, peak_returned = max(float(bus.max()), 0.0), float(back.max())
        peak_A = _current(evaluation, powers, peak_W)
    return Energy(
        supply=supply,
        duration=duty.duration,
        joints=tuple(_joint_energy(power, duty) for power in powers),
        balance=_balance(evaluation, parts, counts, duty),
        drawn=drawn,
        peak_W=peak_W,
        peak_A=peak_A,
        returned=returned,
        peak_returned_W=peak_returned,
        unknown=tuple(power.joint for power in powers if power.electrical is None),
    )


def _current(evaluation: Evaluation, powers: Sequence[JointPower], peak_W: float) -> float | None:
    fed = [drive for drive, power in zip(evaluation.boom.drives, powers, strict=True) if power.electrical is not None]
    voltages = {None if drive is None or drive.bus_voltage is None else drive.bus_voltage.value for drive in fed}
    (voltage,) = voltages if len(voltages) == 1 else (None,)
    return None if voltage is None else peak_W / voltage


def _joint_energy(power: JointPower, duty: Duty) -> JointEnergy:
    def total(values: Array | None) -> float | None:
        return None if values is None else float(duty.weight @ values)

    return JointEnergy(
        joint=power.joint,
        driving=float(duty.weight @ np.maximum(power.output, 0.0)),
        braking=float(duty.weight @ np.maximum(-power.output, 0.0)),
        friction=float(duty.weight @ power.friction),
        peak_W=float(np.abs(power.output).max()),
        gear_loss=total(power.gear_loss),
        copper=total(power.copper),
        electrical=total(power.electrical),
        peak_electrical_W=None if power.electrical is None else float(power.electrical.max()),
    )


def _balance(evaluation: Evaluation, parts: Sequence[slice], counts: Sequence[float], duty: Duty) -> Balance | None:
    base, motion, boom = evaluation.base, evaluation.trajectory, evaluation.boom
    if evaluation.payload_as != "mass" or not evaluation.vehicle.is_steady:
        return None
    up = (0.0, 0.0, 1.0) if base is None else base.up.reshape(-1, 3)[0]
    kinetic = potential = 0.0
    for part, count in zip(parts, counts, strict=True):
        q, qd = motion.q[part][[0, -1]], motion.qd[part][[0, -1]]
        kinetic += count * float(np.diff(kinetic_energy(boom, q, qd))[0])
        potential += count * float(np.diff(potential_energy(boom, q, up=up))[0])
    power = (evaluation.tau * motion.qd).sum(axis=1)
    friction = float(duty.weight @ (evaluation.friction * motion.qd).sum(axis=1))
    return Balance(float(duty.weight @ power), kinetic, potential, friction, float(duty.weight @ np.abs(power)))
