"""Which motor, wiring, voltage and gearbox would do for a joint: the whole catalogue held against a mission."""

from collections.abc import Iterable, Mapping, Sequence
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
    InfeasibleError,
    InputError,
    LinearDrive,
    Origin,
    Sourced,
    Wiring,
)
from boom_model.arrays import scalar
from boom_model.boom import IS_LENGTH
from boom_model.dynamics.newton_euler import PayloadAs
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
"""A mission whose moves would have to be slower than this many times is not rescaled."""

_STRETCH_STEPS = 16
_GIVEN = Origin(Basis.ASSUMED, "asked about")


class Adapt(StrEnum):
    """What may change to suit a drive."""

    NOTHING = "nothing"
    RESCALE = "rescale"
    """Every move slowed evenly, by the least factor with which nothing fails."""
    REPLAN = "replan"
    """Every move planned anew within the drive's limits."""


@dataclass(frozen=True)
class Judged:
    """A drive of one joint, held against a mission."""

    joint: str
    drive: Drive | LinearDrive
    rows: tuple[Row, ...]
    """Of the drive alone, power-off left out; none where no motion was found."""
    duration: float
    """Of the cycle [s]."""
    moving: float
    """What its moves take of that [s]."""
    infeasible: str | None = None
    """Why no motion was found."""

    @property
    def verdict(self) -> Verdict:
        """FAIL also where no motion was found; INCOMPLETE where a check has no data, which is no pass."""
        return Verdict.FAIL if self.infeasible is not None else overall(self.rows)

    @property
    def fails(self) -> bool:
        return self.verdict is Verdict.FAIL

    @property
    def first_failing(self) -> Row | None:
        return next((row for row in self.rows if row.verdict is Verdict.FAIL), None)

    @property
    def unknown(self) -> tuple[str, ...]:
        """Checks without data."""
        return tuple(row.check for row in self.rows if row.verdict is Verdict.NOT_CHECKABLE)

    @property
    def warned(self) -> tuple[str, ...]:
        return tuple(row.check for row in self.rows if row.verdict is Verdict.WARN)

    @property
    def by_room(self) -> tuple[Row, ...]:
        """The rows with a limit that can FAIL, no guidelines; the least room beyond the required margin first."""
        held = (Verdict.PASS, Verdict.WARN, Verdict.FAIL)
        ranking = (row for row in self.rows if row.kind.severity is not Severity.GUIDELINE)
        limited = (row for row in ranking if row.margin is not None and row.verdict in held)
        return tuple(sorted(limited, key=room))

    def tightest(self, part: Part | None = None) -> Row | None:
        """The first of them, of one part of the drive where that is given."""
        return next((row for row in self.by_room if part is None or row.kind.part == part), None)

    @property
    def mass(self) -> float | None:
        """Of motor and gearbox, or of the actuator [kg]; None where a sheet lacks one."""
        if isinstance(self.drive, LinearDrive):
            return self.drive.actuator.mass
        motor, gear = self.drive.motor.mass, self.drive.gearbox.mass
        return None if motor is None or gear is None else motor + gear

    @property
    def name(self) -> str:
        """Motor and gearbox, or actuator."""
        if isinstance(self.drive, LinearDrive):
            return self.drive.actuator.name
        return f"{self.drive.motor.name} + {self.drive.gearbox.name}"

    @property
    def supply(self) -> str:
        """Wiring and bus voltage."""
        if isinstance(self.drive, LinearDrive):
            return "-"
        wiring, voltage = self.drive.wiring, self.drive.bus_voltage
        return f"{'-' if wiring is None else wiring.value}, {'-' if voltage is None else f'{voltage.value:g} V'}"


def candidates(boom: Boom, joint: str, catalogue: Catalogue, voltages: Sequence[float] = ()) -> tuple[Drive | LinearDrive, ...]:
    """Every motor, wiring, bus voltage and gearbox of a catalogue for a joint; every actuator for the extension.

    Args:
        voltages: bus voltages to try [V], but none on a motor that does not allow it; none given means the joint's own, or
            that of the first joint that has one.

    Raises:
        InputError: no such joint, or a voltage that is not a positive number.
    """
    i = _index(joint)
    if IS_LENGTH[i]:
        brake = None if boom.actuator is None else boom.actuator.brake
        return tuple(LinearDrive(actuator, brake) for actuator in catalogue.actuators.values())
    fitted = boom.drives[i]
    supplies = _supplies(boom, fitted, voltages)
    return tuple(
        Drive(motor, gearbox, supply, _wired(fitted, wiring), None if fitted is None else fitted.brake)
        for gearbox in catalogue.gearboxes.values()
        for motor in catalogue.motors.values()
        for wiring, winding in ((Wiring.PARALLEL, motor.parallel), (Wiring.SERIES, motor.series))
        if winding is not None
        for supply in supplies
        if supply is None or motor.max_voltage is None or supply.value <= motor.max_voltage
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
    """Each drive on a joint, the others as they are: what does not fail, by mass and then by margin; what fails behind.

    The drives' own mass is in no body here: another one on the base changes no torque of inner and lower, one farther out
    would.

    Args:
        work: a planned cycle, which the drives are judged on; Adapt.REPLAN plans its mission anew for each, or takes a
            mission that has not been planned.
        vehicle: the slope that the boom stands on; the same as the cycle was planned for.

    Raises:
        InputError: no such joint, the vehicle moves, or a mission without Adapt.REPLAN.
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
    """What there is for a joint of one boom, and what the joint has."""

    variant: str
    joint: str
    fitted: Judged | None
    judged: tuple[Judged, ...]
    """Ranked, as `size` gives them."""

    @property
    def warned(self) -> tuple[str, ...]:
        """What every drive is warned of."""
        if not self.judged:
            return ()
        return tuple(check for check in self.judged[0].warned if all(check in judged.warned for judged in self.judged))

    @property
    def lightest(self) -> Judged | None:
        """The first that does not fail."""
        return next((judged for judged in self.judged if not judged.fails), None)

    @property
    def unmet(self) -> bool:
        """Whether no drive does; an extension that the catalogue has nothing for is not counted, as none was looked at."""
        return self.lightest is None and (bool(self.judged) or not IS_LENGTH[JOINTS.index(self.joint)])

    @property
    def saves(self) -> float | None:
        """How much lighter that is than what is fitted [kg]; None where one of them or its mass is not known."""
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
    """The catalogue for each joint of each boom, on the same cycle or, with Adapt.REPLAN, on the same mission.

    Args:
        booms: variants by name, of the same geometry.
        work, vehicle: as of `size`.
        track: iterates over the drives, and may show how far it is.
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
    """The drive that a joint has, held against a cycle, or against a mission that is planned for it; None where it has none.

    Raises:
        InputError: no such joint, or the vehicle moves.
    """
    check_steady(vehicle)
    i, load = _index(joint), _Load(payload_as, vehicle)
    drive = boom.actuator if IS_LENGTH[i] else boom.drives[i]
    if drive is None:
        return None
    if isinstance(work, Mission):
        return _replanned(boom, work, joint, drive, load)
    return _judged(boom, work, joint, drive, _view(boom, work, joint, load))


def too_high(catalogue: Catalogue, voltages: Sequence[float]) -> tuple[str, ...]:
    """A sentence for each voltage that some motor does not allow, on which it is not tried."""
    limits = {name: motor.max_voltage for name, motor in catalogue.motors.items() if motor.max_voltage is not None}
    sentences = []
    for voltage in dict.fromkeys(voltages):
        weak = [name for name, limit in limits.items() if voltage > limit]
        if not weak:
            continue
        most = max(limits[name] for name in weak)
        if len(weak) == len(catalogue.motors):
            sentences.append(f"{voltage:g} V is above what every motor allows ({most:g} V at most)")
        else:
            sentences.append(f"{voltage:g} V is above what {', '.join(weak)} allows, on which it is not tried")
    return tuple(sentences)


def parse_variant(boom: Boom, text: str) -> Boom:
    """A boom with other masses [kg], as people write it: `inner=5.55`, `payload=5`, `inner=5.55,payload=5`.

    Raises:
        InputError: no such body, or not a mass.
    """
    for part in text.split(","):
        name, equals, value = part.partition("=")
        if not equals:
            raise InputError(f"variant {text!r}: {part!r} is no mass; give BODY=KG or payload=KG")
        try:
            mass = scalar(name, float(value))
        except ValueError:
            raise InputError(f"variant {text!r}: {value!r} is not a mass in kg") from None
        boom = boom.with_payload(mass) if name == "payload" else boom.with_body_mass(name, mass)
    return boom


def _index(joint: str) -> int:
    if joint not in JOINTS:
        raise InputError(f"unknown joint {joint!r}; there are: {', '.join(JOINTS)}")
    return JOINTS.index(joint)


def _supplies(boom: Boom, own: Drive | None, voltages: Sequence[float]) -> tuple[Sourced[float] | None, ...]:
    for voltage in voltages:
        if not scalar("voltage", voltage) > 0.0:
            raise InputError(f"voltage is {voltage:g} V; it must be above 0 V")
    known = next((d.bus_voltage for d in (own, *boom.drives) if d is not None and d.bus_voltage is not None), None)
    if not voltages:
        return (known,)
    return tuple(known if known is not None and known.value == v else Sourced(v, _GIVEN) for v in voltages)


def _wired(own: Drive | None, wiring: Wiring) -> Sourced[Wiring]:
    same = own is not None and own.wiring is not None and own.wiring.value is wiring
    return own.wiring if same and own is not None and own.wiring is not None else Sourced(wiring, _GIVEN)


@dataclass(frozen=True)
class _Load:
    """What loads the joints besides the boom and its motion."""

    payload_as: PayloadAs
    vehicle: VehicleCase


def _mission(work: Cycle | Mission) -> Mission:
    return work if isinstance(work, Mission) else work.mission


def _planned(work: Cycle | Mission) -> Cycle:
    if isinstance(work, Mission):
        raise InputError(f"mission {work.name} has not been planned; only Adapt.REPLAN plans it")
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
    """Slowed by the least factor with which nothing fails, to a hundredth; by the largest where something fails even so."""

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


def room(row: Row) -> float:
    """How far a margin is beyond the required one, as a share of the least limit that this one allows."""
    return (1.0 + (row.margin or 0.0)) / (1.0 + row.required_margin) - 1.0


def _rank(judged: Judged) -> tuple[bool, float, tuple[float, ...]]:
    """What does not fail, by mass, then by the least room, then by the next; the shared rows of one gearbox decide nothing."""
    rooms = tuple(-room(row) for row in judged.by_room)
    return judged.fails, np.inf if judged.mass is None else judged.mass, rooms
