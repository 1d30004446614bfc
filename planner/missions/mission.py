"""Duty cycle of moves, holds and pauses: from a TOML file to the samples that are checked.

In a **hold** the arm is at rest with the motors on. In a **pause** the brakes hold, and the motors
of the joints that have a brake are off. A move may occur many times in a cycle. It is planned and
sampled once, with the number of its occurrences.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.resources import files
from itertools import islice
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from boom_model import Basis, Boom, InfeasibleError, InputError, Origin, Sourced, forward_kinematics
from boom_model.arrays import Array, checked, read_only
from boom_model.dynamics.newton_euler import PayloadAs
from boom_model.kinematics.constraints import parse_constraint
from boom_model.plausible import DURATION, LIFE, TIP_TOLERANCE
from boom_model.provenance import BasisName
from boom_model.toml_file import Table, parse_toml, validated
from planner.checks.drives.duty import Duty
from planner.checks.energy import ASSUMED_SUPPLY, Energy, Supply, energy_of
from planner.checks.evaluation import Evaluation
from planner.files import named_file
from planner.motion.trajectory import STEP, Trajectory, through_rest
from planner.motion.vehicle import LEVEL, VehicleCase
from planner.move_spec import MoveWords
from planner.paths.targets import Target, TipTarget, parse_pitch, parse_target, resolve
from planner.planning import Move, check_motion, plan_motion
from planner.progress import Track
from planner.reports.report import Report
from planner.timing.profile import JerkLimited
from planner.timing.travel_mean import trapezoid_weights

_FOLDER = Path(str(files("planner.missions") / "named_missions"))
_MOST_STEPS = 100_000
_SAME_POSITION = 1e-6
_DECIMALS = 9
_DOWN, _HORIZONTAL = "down", "horizontal"
_KINDS = ("to", "hold_s", "pause_s", "motion", "repeat")
_SHARED = ("profile", "pass_via", "jerk_bound", "average_torque", "along")
"""Keys of a step that have the name and meaning of fields of MoveWords."""
_Duration = Annotated[float, DURATION]
_Sample = Annotated[list[float], Field(min_length=6, max_length=6)]


class _Step(Table):
    to: str | None = None
    via: list[str] = Field(default_factory=list)
    pass_via: bool = False
    via_velocity: list[str] = Field(default_factory=list)
    along: str = "joint"
    profile: str = "cubic"
    jerk_bound: bool = False
    average_torque: bool = False
    duration_s: _Duration | None = None
    pitch: str | None = None
    """None takes that of the mission."""
    constraint: str | None = None
    """None takes that of the mission."""
    hold_s: _Duration | None = None
    pause_s: _Duration | None = None
    motion: Annotated[list[_Sample], Field(min_length=4)] | None = None
    """Samples t [s], q1..q5 [rad, m] of a motion that was planned elsewhere."""
    repeat: Annotated[int, Field(gt=0)] | None = None
    steps: "list[_Step]" = Field(default_factory=list)

    @model_validator(mode="after")
    def _one_of(self) -> "_Step":
        given = [name for name in _KINDS if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(
                f"a step must have one of {', '.join(_KINDS[:-1])} and {_KINDS[-1]}; this one has {', '.join(given) or 'none'}"
            )
        allowed = {
            "to": set(_Step.model_fields) - {"hold_s", "pause_s", "motion", "repeat", "steps"},
            "repeat": {"repeat", "steps"},
        }.get(given[0], {given[0]})
        stray = sorted(self.model_fields_set - allowed)
        if stray:
            raise ValueError(f"a step with {given[0]} takes no {', '.join(stray)}")
        if given[0] == "repeat" and not self.steps:
            raise ValueError("a step with repeat needs steps of its own")
        return self


class _MissionTable(Table):
    name: str
    basis: BasisName
    source: str
    start: str
    pitch: str = _DOWN
    """Of the start, and of every step that gives none."""
    constraint: str = _HORIZONTAL
    """Of the start, and of every step that gives none."""
    required_life_h: Annotated[float, LIFE] | None = None
    tip_tolerance_mm: Annotated[float, TIP_TOLERANCE] | None = None
    plots: Annotated[int, Field(gt=0)] | None = None
    steps: Annotated[list[_Step], Field(min_length=1)]


@dataclass(frozen=True)
class Mission:
    """Duty cycle as its file gives it."""

    name: str
    origin: Origin
    table: _MissionTable

    @property
    def required_life(self) -> Sourced[float] | None:
        """Required life of the gearboxes, pauses included [s]."""
        hours = self.table.required_life_h
        return None if hours is None else Sourced(hours * 3600.0, self.origin)

    @property
    def tip_tolerance(self) -> Sourced[float] | None:
        """Tolerance of the tip's position [m]."""
        tolerance = self.table.tip_tolerance_mm
        return None if tolerance is None else Sourced(tolerance * 1e-3, self.origin)

    @property
    def plots(self) -> int | None:
        """Number of plots that a cycle covers; None if not given."""
        return self.table.plots

    @property
    def jerk_limited(self) -> bool:
        """Whether any step is planned within the jerk limits."""
        return _jerk_limited(self.table.steps)

    @property
    def assumptions(self) -> tuple[str, ...]:
        """Assumptions for the report: the mission itself, if it is assumed."""
        return (f"the mission: {self.origin.source}",) if self.origin.basis is Basis.ASSUMED else ()


def named_missions() -> tuple[str, ...]:
    """Return the names of the missions that come with the toolkit."""
    return tuple(sorted(path.stem for path in _FOLDER.glob("*.toml")))


def load_mission(name: str) -> Mission:
    """Load a named mission, or one from a TOML file of the same form (a name that ends in .toml).

    Raises:
        InputError: the mission is unknown, or the file cannot be read or is malformed; the message
            names the key.
    """
    file = mission_file(name)
    return mission_of(parse_toml(file), str(file))


def mission_file(name: str) -> Path:
    """Return the file of a named mission, or the file that is named.

    Raises:
        InputError: the mission is unknown.
    """
    return named_file(_FOLDER, name, "mission")


def mission_of(data: dict[str, Any], name: str) -> Mission:
    """Return the mission of a file that is read already; `name` is of the file in messages.

    Raises:
        InputError: as `load_mission`.
    """
    table = validated(name, data, _MissionTable)
    return Mission(table.name, Origin(Basis(table.basis), table.source), table)


@dataclass(frozen=True, eq=False)
class Leg:
    """Move, hold or pause, with time starting at 0."""

    label: str
    trajectory: Trajectory
    moves: bool
    powered: bool

    def stretched(self, factor: float) -> "Leg":
        """Return the leg with its motion slower by `factor`; a hold or a pause is unchanged."""
        if not self.moves or factor == 1.0:
            return self
        old = self.trajectory
        slower = replace(
            old,
            planned=None,
            t=read_only(old.t * factor),
            qd=read_only(old.qd / factor),
            qdd=read_only(old.qdd / factor**2),
            qddd=None if old.qddd is None else read_only(old.qddd / factor**3),
        )
        return replace(self, trajectory=slower)


@dataclass(frozen=True, eq=False)
class Cycle:
    """Distinct legs of a mission, and their order."""

    mission: Mission
    legs: tuple[Leg, ...]
    order: tuple[int, ...]
    """Index of the leg at each place of the cycle, from first to last."""
    notes: tuple[str, ...]

    @cached_property
    def counts(self) -> Array:
        """Number of occurrences of each leg."""
        return np.bincount(self.order, minlength=len(self.legs)).astype(float)

    @cached_property
    def trajectory(self) -> Trajectory:
        """Samples of every distinct leg, at the time of its first occurrence.

        The times never decrease, but they may jump or repeat from leg to leg.
        """
        durations = np.array([self.legs[i].trajectory.duration for i in self.order])
        begins = np.concatenate([[0.0], np.cumsum(durations)])
        first = [begins[self.order.index(i)] for i in range(len(self.legs))]
        parts = [leg.trajectory for leg in self.legs]
        jerks = [part.qddd for part in parts if part.qddd is not None]
        q, qd, qdd = (read_only(np.concatenate([getattr(part, name) for part in parts])) for name in ("q", "qd", "qdd"))
        return Trajectory(
            t=read_only(np.concatenate([part.t + begin for part, begin in zip(parts, first, strict=True)])),
            q=q,
            qd=qd,
            qdd=qdd,
            qddd=read_only(np.concatenate(jerks)) if len(jerks) == len(parts) else None,
            notes=self.notes,
        )

    @cached_property
    def duty(self) -> Duty:
        """Total duration of each sample of `trajectory` over the cycle."""
        weights = [trapezoid_weights(leg.trajectory.t) * n for leg, n in zip(self.legs, self.counts, strict=True)]
        powered = [np.full(len(leg.trajectory.t), leg.powered) for leg in self.legs]
        return Duty(
            weight=read_only(np.concatenate(weights)),
            powered=np.concatenate(powered),
            required_life=self.mission.required_life,
            tip_tolerance=self.mission.tip_tolerance,
        )

    def stretched(self, factor: float) -> "Cycle":
        """Return the cycle with every move slower by `factor`; holds and pauses are unchanged."""
        return Cycle(self.mission, tuple(leg.stretched(factor) for leg in self.legs), self.order, self.notes)

    @property
    def moves(self) -> list[slice]:
        """Samples of each move in `trajectory`."""
        return [samples for leg, samples in self.slices() if leg.moves]

    def slices(self) -> Iterator[tuple[Leg, slice]]:
        """Yield each leg and its samples in `trajectory`."""
        begin = 0
        for leg in self.legs:
            end = begin + len(leg.trajectory.t)
            yield leg, slice(begin, end)
            begin = end


def plan_cycle(boom: Boom, mission: Mission, vehicle: VehicleCase = LEVEL, step: float = STEP, track: Track = iter) -> Cycle:
    """Plan the legs of a mission in order, sampled as finely as the checks of a single move.

    Args:
        boom: the boom.
        mission: the duty cycle.
        vehicle: vehicle case; it may be a slope only.
        step: longest sampling step [s] of a planned move.
        track: iterates over the steps, and may show the progress.

    Raises:
        InputError: a step is malformed (the message names it), or the vehicle moves.
        InfeasibleError: a step cannot be planned; the message names it.
    """
    check_steady(vehicle)
    table = mission.table
    q = resolve(boom, parse_target(table.start), parse_pitch(table.pitch), parse_constraint(table.constraint))
    start, legs, known, order, notes = q, [], {}, [], []
    steps = list(islice(_expanded(table.steps, "steps"), _MOST_STEPS + 1))
    if len(steps) > _MOST_STEPS:
        raise InputError(f"mission {mission.name}: more than {_MOST_STEPS:,} steps")
    for where, part in track(steps):
        key = (id(part), tuple(np.round(q, _DECIMALS) + 0.0))  # positions return up to rounding
        if key not in known:
            try:
                leg, after, said = _leg(boom, table, part, q, vehicle, step)
            except (InputError, InfeasibleError) as error:
                kind = InputError if isinstance(error, InputError) else InfeasibleError
                raise kind(f"mission {mission.name}, {where}: {error}") from None
            if leg is not None:
                legs.append(leg)
            notes += [f"{leg.label if leg else where}: {sentence}" for sentence in said]
            known[key] = (None if leg is None else len(legs) - 1, after)
        index, q = known[key]
        if index is not None:
            order.append(index)
    if not legs:
        raise InputError(f"mission {mission.name}: it has no move, no hold and no pause")
    if np.abs(q - start).max() > _SAME_POSITION:
        notes.append("the cycle does not end where it starts; the way back is not counted")
    return Cycle(mission, tuple(legs), tuple(order), tuple(dict.fromkeys(notes)))


def check_steady(vehicle: VehicleCase) -> None:
    """Check that a vehicle case is level ground or a slope only.

    Raises:
        InputError: the vehicle moves.
    """
    if not vehicle.is_steady:
        raise InputError(f"vehicle case {vehicle.name}: a mission can be on a slope only; check track and shock move by move")


def check_cycle(boom: Boom, cycle: Cycle, *, payload_as: PayloadAs = "mass", vehicle: VehicleCase = LEVEL) -> Report:
    """Check a whole cycle: peaks over its legs, means over its time.

    Raises:
        InputError: the vehicle moves.
    """
    return cycle_move(boom, cycle, payload_as=payload_as, vehicle=vehicle).report


def cycle_move(boom: Boom, cycle: Cycle, *, payload_as: PayloadAs = "mass", vehicle: VehicleCase = LEVEL) -> Move:
    """Return a cycle as one move, for a recording: each distinct leg at its first occurrence.

    Its report is that of `check_cycle`.

    Raises:
        InputError: the vehicle moves.
    """
    check_steady(vehicle)
    name, duty = f"mission {cycle.mission.name}", cycle.duty
    move = check_motion(boom, cycle.trajectory, payload_as=payload_as, vehicle=vehicle, profile=name, duty=duty)
    report = replace(
        move.report,
        notes=(*leg_sentences(cycle), *move.report.notes),
        assumptions=(*cycle.mission.assumptions, *move.report.assumptions),
        energy=cycle_energy(cycle, move.evaluation),
    )
    return replace(move, report=report)


def cycle_energy(cycle: Cycle, evaluation: Evaluation, supply: Supply = ASSUMED_SUPPLY) -> Energy:
    """Return power and energy of a cycle, from the evaluation of its samples; see `energy_of`."""
    return energy_of(evaluation, cycle.duty, [samples for _, samples in cycle.slices()], list(cycle.counts), supply)


def leg_sentences(cycle: Cycle) -> tuple[str, ...]:
    """Describe the number of occurrences and the duration of each leg."""
    pairs = zip(cycle.legs, cycle.counts, strict=True)
    return tuple(f"{count:.0f} x {leg.label}, {leg.trajectory.duration:.3f} s" for leg, count in pairs)


def _expanded(steps: list[_Step], where: str) -> Iterator[tuple[str, _Step]]:
    """Yield every step, with repeats written out, and its place in the file."""
    for number, part in enumerate(steps, start=1):
        name = f"{where} {number}"
        for _ in range(part.repeat or 0):
            yield from _expanded(part.steps, f"{name}, steps")
        if part.repeat is None:
            yield name, part


def _jerk_limited(steps: list[_Step]) -> bool:
    return any(step.jerk_bound or step.profile == JerkLimited.name or _jerk_limited(step.steps) for step in steps)


def _leg(
    boom: Boom, table: _MissionTable, part: _Step, q: Array, vehicle: VehicleCase, step: float
) -> tuple[Leg | None, Array, tuple[str, ...]]:
    """Return a step's leg (None if nothing moves), the joint position at its end, and its notes."""
    if part.to is not None:
        return _move(boom, table, part, q, vehicle, step)
    if part.motion is not None:
        return _recorded(part.motion, q)
    seconds, powered = (part.hold_s, True) if part.hold_s is not None else (part.pause_s, False)
    zero = np.zeros((2, 5))
    still = Trajectory.from_samples([0.0, seconds or 0.0], np.tile(q, (2, 1)), zero, zero, zero)
    return Leg("hold" if powered else "pause", still, moves=False, powered=powered), q, ()


def _recorded(samples: list[list[float]], q: Array) -> tuple[Leg, Array, tuple[str, ...]]:
    """Return the leg of samples, by a cubic spline at rest at both ends."""
    table = checked("motion", samples)
    apart = float(np.abs(table[0, 1:] - q).max())
    if apart > _SAME_POSITION:
        raise InfeasibleError(f"the motion does not start where the previous step ends ({apart:.3g} rad or m off)")
    return Leg("a motion of the file", through_rest(table[:, 0] - table[0, 0], table[:, 1:]), True, True), table[-1, 1:], ()


def _move(
    boom: Boom, table: _MissionTable, part: _Step, q: Array, vehicle: VehicleCase, step: float
) -> tuple[Leg | None, Array, tuple[str, ...]]:
    by_joints = part.along == "joint"
    x, y, z = (float(v) for v in forward_kinematics(boom, q).position)
    words = MoveWords(
        start=str(part.to),
        goal=str(part.to),
        via=tuple(part.via),
        via_velocity=tuple(part.via_velocity),
        duration=part.duration_s,
        pitch=table.pitch if part.pitch is None else part.pitch,
        constraint=table.constraint if part.constraint is None else part.constraint,
        **{name: getattr(part, name) for name in _SHARED},
    )
    start: Target = q if by_joints else TipTarget((x, y, z))
    spec = replace(words.spec(), start=start, vehicle=vehicle, step=step)
    planned = plan_motion(boom, spec, reference=q)
    if not planned.motions:
        return None, q, ()
    fine = planned.fine()
    apart = float(np.abs(fine.q[0] - q).max())
    if apart > _SAME_POSITION:
        raise InfeasibleError(
            f"the line does not start at the joint position where the previous step ends ({apart:.3g} rad or m off); "
            "give both steps the same pitch and constraint"
        )
    way = part.to if by_joints else f"{part.to} along {part.along}"
    label = " ".join([f"to {way}", *(f"via {text}" for text in part.via)])
    return Leg(label, fine, moves=True, powered=True), fine.q[-1], planned.notes
