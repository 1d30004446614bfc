"""Choice of motor, wiring, voltage and gearbox for a joint, checked on a mission."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import islice

import numpy as np

from boom_model import (
    JOINTS,
    Basis,
    Boom,
    Catalogue,
    Drive,
    Gearbox,
    InfeasibleError,
    InputError,
    LinearDrive,
    Motor,
    Origin,
    Sourced,
    Wiring,
)
from boom_model.arrays import scalar
from boom_model.boom import IS_LENGTH
from boom_model.dynamics.newton_euler import PayloadAs
from boom_model.words import unknown
from planner.bisection import bisect
from planner.checks.drives.joint_view import JointView
from planner.checks.evaluation import at_samples
from planner.checks.kinds import Part, Severity
from planner.checks.motion_checks import drive_rows, joint_views
from planner.checks.rows import Row, Verdict, overall
from planner.missions.mission import Cycle, Mission, check_steady, plan_cycle
from planner.motion.vehicle import LEVEL, VehicleCase
from planner.progress import Track

LARGEST_STRETCH = 8.0
"""Largest factor by which `Adapt.RESCALE` slows the moves of a mission."""

_STRETCH_STEPS = 16
_NAMED = 3
_GIVEN = Origin(Basis.ASSUMED, "candidate supply")


class Adapt(StrEnum):
    """What may be adapted to a drive."""

    NOTHING = "nothing"
    RESCALE = "rescale"
    """Slow every move by the same factor, the smallest with which no check fails."""
    REPLAN = "replan"
    """Plan every move again within the limits of the drive."""


@dataclass(frozen=True)
class Judged:
    """A drive of one joint with the results of its checks on a mission."""

    joint: str
    drive: Drive | LinearDrive
    rows: tuple[Row, ...]
    """Checks of this drive alone, without power-off; empty if no motion was found."""
    duration: float
    """Duration of the cycle [s]."""
    moving: float
    """Total duration of the moves of the cycle [s]."""
    infeasible: str | None = None
    """Why no motion was found; None if one was found."""

    @property
    def verdict(self) -> Verdict:
        """FAIL if a check fails or no motion was found; INCOMPLETE if a check has no data."""
        return Verdict.FAIL if self.infeasible is not None else overall(self.rows)

    @property
    def fails(self) -> bool:
        """Whether the verdict is FAIL."""
        return self.verdict is Verdict.FAIL

    @property
    def first_failing(self) -> Row | None:
        """The first check that fails."""
        return next((row for row in self.rows if row.verdict is Verdict.FAIL), None)

    @property
    def unknown(self) -> tuple[str, ...]:
        """Checks without data."""
        return tuple(row.check for row in self.rows if row.verdict is Verdict.NOT_CHECKABLE)

    @property
    def limits_without_data(self) -> int:
        """Number of limit checks without data."""
        return sum(row.verdict is Verdict.NOT_CHECKABLE and row.kind.severity is Severity.LIMIT for row in self.rows)

    @property
    def warned(self) -> tuple[str, ...]:
        """Checks with a warning."""
        return tuple(row.check for row in self.rows if row.verdict is Verdict.WARN)

    @property
    def by_spare(self) -> tuple[Row, ...]:
        """The checks with a limit that can fail, sorted by `spare`, the smallest first."""
        checked = (Verdict.PASS, Verdict.WARN, Verdict.FAIL)
        ranking = (row for row in self.rows if row.kind.severity is not Severity.GUIDELINE)
        limited = (row for row in ranking if row.margin is not None and row.verdict in checked)
        return tuple(sorted(limited, key=spare))

    def tightest(self, part: Part | None = None) -> Row | None:
        """Return the first row of `by_spare`, of one part of the drive where that is given."""
        return next((row for row in self.by_spare if part is None or row.kind.part == part), None)

    @property
    def mass(self) -> float | None:
        """Mass of motor and gearbox, or of the actuator [kg]; None if a datasheet lacks one."""
        if isinstance(self.drive, LinearDrive):
            return self.drive.actuator.mass
        motor, gear = self.drive.motor.mass, self.drive.gearbox.mass
        return None if motor is None or gear is None else motor + gear

    @property
    def name(self) -> str:
        """Names of motor and gearbox, or of the actuator."""
        return self.drive.name

    @property
    def supply(self) -> str:
        """Wiring and bus voltage."""
        if isinstance(self.drive, LinearDrive):
            return "-"
        wiring, voltage = self.drive.wiring, self.drive.bus_voltage
        return f"{'-' if wiring is None else wiring.value}, {'-' if voltage is None else f'{voltage.value:g} V'}"


def candidates(boom: Boom, joint: str, catalogue: Catalogue, voltages: Sequence[float] = ()) -> tuple[Drive | LinearDrive, ...]:
    """Return the `combinations` of a catalogue for a joint whose motor torque can be checked.

    Motors and gearboxes whose datasheets do not give it are left out; see `untried`.

    Args:
        boom: see `combinations`.
        joint: see `combinations`.
        catalogue: see `combinations`.
        voltages: see `combinations`.

    Raises:
        InputError: see `combinations`.
    """
    every = combinations(boom, joint, catalogue, voltages)
    return tuple(d for d in every if isinstance(d, LinearDrive) or (_has_losses(d.gearbox) and _has_torque(d.motor)))


def combinations(
    boom: Boom, joint: str, catalogue: Catalogue, voltages: Sequence[float] = ()
) -> tuple[Drive | LinearDrive, ...]:
    """Return all combinations of motor, wiring, bus voltage and gearbox of a catalogue for a joint.

    A servo motor has neither wiring nor bus voltage. For the extension, return every actuator.

    Args:
        boom: the boom, with its fitted drives.
        joint: name of the joint.
        catalogue: the motors, gearboxes and actuators to combine.
        voltages: bus voltages to try [V]; a motor is not tried on a voltage that it does not allow.
            If empty, the joint's own voltage, or that of the first joint that has one.

    Raises:
        InputError: unknown joint, or a voltage that is not a positive number.
    """
    i = _index(joint)
    if IS_LENGTH[i]:
        brake = None if boom.actuator is None else boom.actuator.brake
        return tuple(LinearDrive(actuator, brake) for actuator in catalogue.actuators.values())
    fitted = boom.drives[i]
    supplies = _supplies(boom, fitted, voltages)
    return tuple(
        Drive(motor, gearbox, supply, wiring, None if fitted is None else fitted.brake)
        for gearbox in catalogue.gearboxes.values()
        for motor in catalogue.motors.values()
        for wiring, supply in _fed(motor, fitted, supplies)
    )


def size(
    boom: Boom,
    work: Cycle | Mission,
    joint: str,
    drives: Iterable[Drive | LinearDrive],
    *,
    adapt: Adapt = Adapt.NOTHING,
    payload_as: PayloadAs = "mass",
    vehicle: VehicleCase = LEVEL,
) -> tuple[Judged, ...]:
    """Check each drive on a joint, with the other joints' drives unchanged, and rank the results.

    Drives that do not fail come first: those with the fewest limits without data, then by mass,
    then by margin. The mass of a drive is not added to any body here. A different mass at the base
    does not change the torques of inner and lower; a mass farther out would.

    Args:
        boom: the boom.
        work: a planned cycle, on which the drives are checked. Adapt.REPLAN plans its mission again
            for each drive, and also accepts a mission that has not been planned.
        joint: name of the joint.
        drives: the drives to check.
        adapt: what may be adapted to a drive.
        payload_as: see `inverse_dynamics`.
        vehicle: the slope that the boom stands on; it must be the one that the cycle was planned
            for.

    Raises:
        InputError: unknown joint, a moving vehicle, or a mission without Adapt.REPLAN.
    """
    check_steady(vehicle)
    load = _Load(payload_as, vehicle)
    if adapt is Adapt.REPLAN:
        return tuple(sorted((_replanned(boom, _mission(work), joint, drive, load) for drive in drives), key=_rank))
    cycle = _planned(work)
    view = _view(boom, cycle, joint, load)
    found: list[Judged] = []
    for drive in drives:
        judged = _judged(boom, cycle, joint, drive, view)
        if adapt is Adapt.RESCALE and judged.fails:
            judged = _rescaled(boom, cycle, joint, drive, load)
        found.append(judged)
    return tuple(sorted(found, key=_rank))


@dataclass(frozen=True)
class Choice:
    """The ranked drives for a joint of one boom, and the drive that is fitted."""

    variant: str
    joint: str
    fitted: Judged | None
    judged: tuple[Judged, ...]
    """Ranked as `size` returns them."""

    @property
    def warned(self) -> tuple[str, ...]:
        """Warnings that every drive has."""
        if not self.judged:
            return ()
        return tuple(check for check in self.judged[0].warned if all(check in judged.warned for judged in self.judged))

    @property
    def lightest(self) -> Judged | None:
        """The first drive that does not fail."""
        return next((judged for judged in self.judged if not judged.fails), None)

    @property
    def unmet(self) -> bool:
        """Whether no drive is suitable.

        An extension for which the catalogue has no actuator does not count, because no drive was
        checked.
        """
        return self.lightest is None and (bool(self.judged) or not IS_LENGTH[JOINTS.index(self.joint)])

    @property
    def saves(self) -> float | None:
        """Mass saved by the lightest drive over the fitted one [kg].

        None if one of the drives or its mass is unknown.
        """
        old, new = self.fitted, self.lightest
        if old is None or new is None or old.mass is None or new.mass is None:
            return None
        return old.mass - new.mass


def choose(
    booms: Mapping[str, Boom],
    work: Cycle | Mission,
    joints: Sequence[str],
    catalogue: Catalogue,
    voltages: Sequence[float] = (),
    adapt: Adapt = Adapt.NOTHING,
    payload_as: PayloadAs = "mass",
    track: Track = iter,
    vehicle: VehicleCase = LEVEL,
) -> tuple[Choice, ...]:
    """Rank the drives of the catalogue for each joint of each boom.

    All are checked on one cycle or, with Adapt.REPLAN, on one mission.

    Args:
        booms: variants by name, of the same geometry.
        work: see `size`.
        joints: names of the joints.
        catalogue: see `candidates`.
        voltages: see `candidates`.
        adapt: what may be adapted to a drive.
        payload_as: see `inverse_dynamics`.
        track: iterates over the drives, and may show progress.
        vehicle: see `size`.
    """
    asked = [
        (name, boom, joint, candidates(boom, joint, catalogue, voltages)) for name, boom in booms.items() for joint in joints
    ]
    steps = iter(track([drive for *_, drives in asked for drive in drives]))
    return tuple(
        Choice(
            name,
            joint,
            fitted(boom, _mission(work) if adapt is Adapt.REPLAN else work, joint, payload_as, vehicle),
            size(boom, work, joint, islice(steps, len(drives)), adapt=adapt, payload_as=payload_as, vehicle=vehicle),
        )
        for name, boom, joint, drives in asked
    )


def fitted(
    boom: Boom, work: Cycle | Mission, joint: str, payload_as: PayloadAs = "mass", vehicle: VehicleCase = LEVEL
) -> Judged | None:
    """Check the fitted drive of a joint on a cycle, or on a mission that is planned here.

    Return None if the joint has no drive.

    Raises:
        InputError: unknown joint, or a moving vehicle.
    """
    check_steady(vehicle)
    i, load = _index(joint), _Load(payload_as, vehicle)
    drive = boom.actuator if IS_LENGTH[i] else boom.drives[i]
    if drive is None:
        return None
    if isinstance(work, Mission):
        return _replanned(boom, work, joint, drive, load)
    return _judged(boom, work, joint, drive, _view(boom, work, joint, load))


def untried(catalogue: Catalogue) -> tuple[str, ...]:
    """Return a sentence for the gearboxes, and one for the motors, that `candidates` leaves out."""
    gears = [name for name, gear in catalogue.gearboxes.items() if not _has_losses(gear)]
    motors = [name for name, motor in catalogue.motors.items() if not _has_torque(motor)]
    sentences = []
    for names, kind, missing in (
        (gears, "gearbox", "no efficiency, no-load torque or input inertia is printed"),
        (motors, "motor", "no running torque, continuous torque or rotor inertia is printed"),
    ):
        if names:
            more = f" and {len(names) - 1} more" if len(names) > 1 else ""
            sentences.append(f"{kind} {names[0]}{more}: {missing}, so the torque at the motor cannot be checked")
    return tuple(sentences)


def _has_losses(gear: Gearbox) -> bool:
    return None not in (gear.efficiency, gear.no_load_input_torque, gear.input_inertia)


def _has_torque(motor: Motor) -> bool:
    lasting = motor.rated_torque if motor.is_servo else motor.running_torque
    return None not in (lasting, motor.rotor_inertia)


def too_high(catalogue: Catalogue, voltages: Sequence[float]) -> tuple[str, ...]:
    """Return a sentence for each voltage that some stepper motor does not allow."""
    steppers = [motor for motor in catalogue.motors.values() if not motor.is_servo]
    limits = {motor.name: motor.max_voltage for motor in steppers if motor.max_voltage is not None}
    sentences = []
    for voltage in dict.fromkeys(voltages):
        weak = [name for name, limit in limits.items() if voltage > limit]
        if not weak:
            continue
        most = max(limits[name] for name in weak)
        if len(weak) == len(steppers):
            sentences.append(f"{voltage:g} V exceeds the limit of every stepper motor (at most {most:g} V)")
        else:
            more = f" and {len(weak) - _NAMED} more" if len(weak) > _NAMED else ""
            sentences.append(f"{voltage:g} V exceeds the limit of {', '.join(weak[:_NAMED])}{more}; it is not tried there")
    return tuple(sentences)


def parse_variant(boom: Boom, text: str) -> Boom:
    """Return the boom with other masses [kg].

    The text is `inner=5.55`, `payload=5` or `inner=5.55,payload=5`, for example.

    Raises:
        InputError: unknown body, or a value that is not a mass.
    """
    for part in text.split(","):
        name, equals, value = part.partition("=")
        if not equals:
            raise InputError(f"variant {text!r}: {part!r} is not a mass; give BODY=KG or payload=KG")
        try:
            mass = scalar(name, float(value))
        except ValueError:
            raise InputError(f"variant {text!r}: {value!r} is not a mass in kg") from None
        boom = boom.with_payload(mass) if name == "payload" else boom.with_body_mass(name, mass)
    return boom


def _index(joint: str) -> int:
    if joint not in JOINTS:
        raise unknown("joint", joint, JOINTS)
    return JOINTS.index(joint)


def _supplies(boom: Boom, own: Drive | None, voltages: Sequence[float]) -> tuple[Sourced[float] | None, ...]:
    for voltage in voltages:
        if not scalar("voltage", voltage) > 0.0:
            raise InputError(f"voltage is {voltage:g} V; it must be above 0 V")
    known = next((d.bus_voltage for d in (own, *boom.drives) if d is not None and d.bus_voltage is not None), None)
    if not voltages:
        return (known,)
    return tuple(known if known is not None and known.value == v else Sourced(v, _GIVEN) for v in voltages)


def _fed(
    motor: Motor, fitted: Drive | None, supplies: Sequence[Sourced[float] | None]
) -> Iterator[tuple[Sourced[Wiring] | None, Sourced[float] | None]]:
    """Yield each wiring and voltage to try; a servo motor's torque depends on neither."""
    if motor.is_servo:
        yield None, None
    for wiring in motor.windings:
        for supply in supplies:
            if supply is None or motor.max_voltage is None or supply.value <= motor.max_voltage:
                yield _wired(fitted, wiring), supply


def _wired(own: Drive | None, wiring: Wiring) -> Sourced[Wiring]:
    same = own is not None and own.wiring is not None and own.wiring.value is wiring
    return own.wiring if same and own is not None and own.wiring is not None else Sourced(wiring, _GIVEN)


@dataclass(frozen=True)
class _Load:
    """Loads on the joints besides the boom and its motion."""

    payload_as: PayloadAs
    vehicle: VehicleCase


def _mission(work: Cycle | Mission) -> Mission:
    return work if isinstance(work, Mission) else work.mission


def _planned(work: Cycle | Mission) -> Cycle:
    if isinstance(work, Mission):
        raise InputError(f"mission {work.name} has not been planned; plan it first, or use Adapt.REPLAN")
    return work


def _view(boom: Boom, cycle: Cycle, joint: str, load: _Load) -> JointView:
    evaluation = at_samples(boom, cycle.trajectory, vehicle=load.vehicle, payload_as=load.payload_as, reactions=False)
    return joint_views(evaluation, cycle.duty)[_index(joint)]


def _judged(boom: Boom, cycle: Cycle, joint: str, drive: Drive | LinearDrive, view: JointView) -> Judged:
    rows = drive_rows(view, drive, retracted=float(boom.limits.lower[view.index]))
    # A brake holds without power whatever drive it is on: no matter of this choice.
    kept = tuple(row for row in rows if row.kind.part is not Part.BRAKE)
    moving = sum(n * leg.trajectory.duration for leg, n in zip(cycle.legs, cycle.counts, strict=True) if leg.moves)
    return Judged(joint, drive, kept, cycle.duty.duration, float(moving))


def _rescaled(boom: Boom, cycle: Cycle, joint: str, drive: Drive | LinearDrive, load: _Load) -> Judged:
    """Check the drive on the cycle slowed by the smallest factor with which no check fails.

    The factor is found to 0.01. If a check fails even with LARGEST_STRETCH, return the result for
    that factor.
    """

    def slowed(factor: float) -> Judged:
        slower = cycle.stretched(factor)
        return _judged(boom, slower, joint, drive, _view(boom, slower, joint, load))

    slowest = slowed(LARGEST_STRETCH)
    if slowest.fails:
        return slowest
    tried = {LARGEST_STRETCH: slowest}

    def does(factor: float) -> bool:
        tried[factor] = slowed(factor)
        return not tried[factor].fails

    return tried[bisect(does, good=LARGEST_STRETCH, bad=1.0, steps=_STRETCH_STEPS, within=0.01)]


def _replanned(boom: Boom, mission: Mission, joint: str, drive: Drive | LinearDrive, load: _Load) -> Judged:
    other = boom.with_drive(joint, drive)
    try:
        cycle = plan_cycle(other, mission, load.vehicle)
    except InfeasibleError as error:
        return Judged(joint, drive, (), np.inf, np.inf, str(error))
    return _judged(other, cycle, joint, drive, _view(other, cycle, joint, load))


def spare(row: Row) -> float:
    """Return how far a margin exceeds the required one, relative to the smallest sufficient limit.

    It is (1 + margin) / (1 + required margin) - 1.
    """
    return (1.0 + (row.margin or 0.0)) / (1.0 + row.required_margin) - 1.0


def _rank(judged: Judged) -> tuple[bool, int, float, tuple[float, ...]]:
    """Return the sorting key: failure, number of limits without data, mass, `spare`.

    Drives with the same gearbox share its rows, so the first different row decides between them.
    """
    spares = tuple(-spare(row) for row in judged.by_spare)
    return judged.fails, judged.limits_without_data, np.inf if judged.mass is None else judged.mass, spares
