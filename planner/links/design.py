"""A link's design as a job: loads from moves, the method, its verification, and the boom with the new link in it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TypeVar

import numpy as np

from boom_model import JOINTS, Body, Boom, InputError, inverse_dynamics, transmission_angle
from boom_model.arrays import Array, read_only, scalar
from boom_model.drives.catalogue import Catalogue
from boom_model.drives.drive import Drive
from boom_model.dynamics.newton_euler import PayloadAs
from boom_model.link_design import (
    THESIS_LOAD,
    Beam,
    Design,
    Limits,
    Link,
    LoadCases,
    Material,
    deflection,
    euler_load,
    internal_forces,
    least_mass,
    link_body,
    load_link,
    thesis_design,
    von_mises,
    with_body,
)
from boom_model.link_design.beam import Forces
from boom_model.link_design.exact import buckling_load
from boom_model.link_design.finite_elements import Solution, solve_beam, solve_plate
from boom_model.link_design.search import pressed
from boom_model.link_design.thesis_method import ThesisDesign, ThesisLoad
from boom_model.plausible import DEFLECTION, HEIGHT, HEIGHT_STEP, SAFETY_FACTOR, TAPER, THICKNESS
from boom_model.words import unknown
from planner.checks.kinds import CheckKind, Part
from planner.checks.rows import Verdict
from planner.links.loads import largest_components, link_cases, thesis_load
from planner.motion.trajectory import Trajectory
from planner.move_spec import MoveSpec
from planner.planning import check, plan_each_profile, plan_motion
from planner.progress import Track

E = TypeVar("E", bound=StrEnum)

DRIVEN_BY = {"inner": 1, "lower": 2, "outer": 1, "extension": 2}
"""The joint whose torque a link's mass weighs on most."""


class LoadFrom(StrEnum):
    """Where a link's loads come from."""

    THESIS = "thesis"
    MOVES = "moves"


class Method(StrEnum):
    """How its heights are found."""

    THESIS = "thesis"
    EXACT = "exact"


_PLAUSIBLE = {
    "safety_factor": SAFETY_FACTOR,
    "deflection": DEFLECTION,
    "step": HEIGHT_STEP,
    "min_height": HEIGHT,
    "max_height": HEIGHT,
    "max_taper": TAPER,
    "thickness": THICKNESS,
}


@dataclass(frozen=True)
class LinkTask:
    """What is asked of a link."""

    link: str = "inner"
    load: str = LoadFrom.MOVES
    method: str = Method.EXACT
    material: str = "steel"
    safety_factor: float = 2.0
    """Yield stress over the stress limit, and buckling load over the largest end load"""
    deflection: float = 0.01
    """[m]"""
    slices: int = 1000
    step: float = 1e-4
    """delta-H of the thesis's method [m]"""
    min_height: float = 0.0
    max_height: float | None = None
    max_taper: float | None = None
    thickness: float | None = None
    """Of one plate [m]; None is the link's own"""
    own_mass: bool = True
    """See `least_mass`"""
    shear: bool | None = None
    """Whether shear counts in the deflection of the exact method; None is for the loads of moves, not for the thesis's"""
    buckling: bool = True
    """Whether the exact method holds the safety factor against buckling"""
    largest_components: bool = False
    """Take each component's largest at once, and not every instant"""
    payload_as: PayloadAs = "mass"
    links: str | None = None
    """The TOML file of plates and fittings; None is the shipped one"""

    def __post_init__(self) -> None:
        by_thesis = self.method == Method.THESIS
        pointless = {
            "frozen moments leave out shear: ask for one of them": not self.own_mass and self.shear is True,
            "the thesis's method always freezes the moments": by_thesis and not self.own_mass,
            "the thesis's method knows no shear; the exact method does": by_thesis and self.shear is not None,
            "the thesis's method does not hold buckling: there is none to leave out": by_thesis and not self.buckling,
            "the thesis's method always takes the largest components": by_thesis and self.largest_components,
            "the thesis's load is one case: it has no largest components": self.load == LoadFrom.THESIS
            and self.largest_components,
        }
        for reason, asked in pointless.items():
            if asked:
                raise InputError(reason)
        for name, quantity in _PLAUSIBLE.items():
            value = getattr(self, name)
            if value is not None:
                quantity.require(name.replace("_", " "), scalar(name.replace("_", " "), value))


@dataclass(frozen=True)
class Check:
    """A figure of the design by an independent model."""

    model: str
    elements: int
    deflection: float
    """[m]"""
    stress: float
    """Largest von Mises stress INSIDE the length [Pa]"""


INSIDE = (0.1, 0.9)
"""Shares of the length between which plate and beam are compared; beyond, a plate's stress is that of its held edge."""


@dataclass(frozen=True)
class StressCheck:
    """Where the stress of all cases and stations is largest: Euler-Bernoulli elements of that case, at their nearest point."""

    x: float
    """[m]"""
    elements: int
    by_elements: float
    """[Pa]"""
    own: float
    """The design's own there [Pa], forces and height between stations linear"""


@dataclass(frozen=True)
class MotorChoice:
    """A catalogue motor at a link's joint, with the old link and the new."""

    motor: str
    mass: float | None
    before: Verdict
    after: Verdict
    margin_before: float | None
    """The least of the motor's rows"""
    margin_after: float | None


@dataclass(frozen=True, eq=False)
class LinkDesign:
    """A designed link and what it changes."""

    task: LinkTask
    link: Link
    beam: Beam
    limits: Limits
    cases: LoadCases
    thesis_load: ThesisLoad | None
    """The load as the thesis's method takes it; None where only single instants load the link"""
    equal_constraints: tuple[float, float] | None
    """Masses of the plates by the thesis's method and the exact one under the same constraints, the thesis's [kg]"""
    instants: Array | None
    """(k, 2) motion and time [s] of each case; None for a load that is no instant"""
    found: Design | ThesisDesign
    """Heights, masses and deflections of the plates from pin to pin, by the task's method"""
    tapered_load: float
    """Critical end load [N] by the eigenvalue of the tapered column"""
    pressed: float
    """Largest end load along the link [N]"""
    own_deflection: float
    """[m] with the final beam's own mass and shear, whatever the method left out"""
    stress: Array
    """(n + 1,) largest von Mises stress along the link with its own mass [Pa]"""
    worst: int
    """The load case of the largest deflection"""
    checks: tuple[Check, ...]
    stress_check: StressCheck | None
    """None of a link that telescopes"""
    body: Body
    """The whole link: designed plates, cross plates, fittings"""
    before: Boom
    after: Boom
    trajectories: tuple[Trajectory, ...]
    torques: tuple[Array, Array]
    """Of the link's joint along all motions, with the old link and the new (samples,) [Nm]"""
    motors: tuple[MotorChoice, ...]
    warnings: tuple[str, ...]
    """What limits the worth of this very design."""
    notes: tuple[str, ...]

    @property
    def exact(self) -> Design | None:
        return self.found if isinstance(self.found, Design) else None

    @property
    def thesis(self) -> ThesisDesign | None:
        return self.found if isinstance(self.found, ThesisDesign) else None

    @property
    def heights(self) -> Array:
        """(n + 1,) [m]"""
        return self.found.heights

    @property
    def mass(self) -> float:
        """Mass of the plates from pin to pin [kg]."""
        return self.found.mass

    @property
    def max_stress(self) -> float:
        """Largest von Mises stress [Pa]."""
        return float(self.stress.max())

    @property
    def buckling_load(self) -> float:
        """Critical end load [N]: the thesis's formula for its method, else the tapered column's."""
        return self.tapered_load if self.thesis is None else thesis_buckling(self.link, self.beam, self.heights)

    @property
    def joint(self) -> int:
        return DRIVEN_BY[self.link.name]

    @property
    def saved(self) -> tuple[float, float]:
        """Least and largest share of the joint's torque saved, where it is at least a tenth of its peak."""
        before, after = self.torques
        counts = np.abs(before) >= 0.1 * np.abs(before).max()
        share = 1.0 - after[counts] / before[counts]
        return float(share.min()), float(share.max())


def design_link(
    boom: Boom, task: LinkTask, trajectories: Sequence[Trajectory], catalogue: Catalogue | None = None
) -> LinkDesign:
    """The link that a task asks for, checked by finite elements, and back in the boom.

    Args:
        trajectories: the moves that load the link, and along which its joint's torque is compared.
        catalogue: whose motors are tried on the link's joint; None is the shipped one.

    Raises:
        InputError: an input is malformed, not finite or out of its range.
        InfeasibleError: no heights keep the limits.
    """
    load, method = _one_of("load", task.load, LoadFrom), _one_of("method", task.method, Method)
    if not (np.isfinite(task.safety_factor) and task.safety_factor > 0.0):
        raise InputError(f"safety factor is {task.safety_factor:g}; it must be finite and above 0")
    link = load_link(boom, task.link, task.links)
    if task.thickness is not None:
        link = replace(link, width=task.thickness * link.plates)
    material = Material.load(task.material)
    beam = link.beam(material, task.slices)
    first, last = (round(share * beam.slices) for share in link.designed)
    if first == last:
        raise InputError(f"slices is {task.slices}: not one lies in the {link.name} link's designed part")
    if task.min_height >= beam.length:
        raise InputError(f"minimum height is {task.min_height:g} m; it must be below the link's length, {beam.length:g} m")
    limits = Limits(
        stress=material.yield_stress / task.safety_factor,
        deflection=task.deflection,
        min_height=task.min_height,
        max_height=task.max_height,
        max_taper=task.max_taper,
        buckling_factor=task.safety_factor if task.buckling else None,
    )
    instants, old_load = None, None
    if load is LoadFrom.THESIS:
        if link.name != "inner":
            raise InputError(f"the thesis's load is of the inner link, not of the {link.name} one; take the loads of moves")
        cases, old_load = THESIS_LOAD.cases, THESIS_LOAD
    elif method is Method.THESIS:
        old_load = thesis_load(boom, link, trajectories, payload_as=task.payload_as)
        cases = old_load.cases
    else:
        cases, instants = link_cases(boom, link, trajectories, payload_as=task.payload_as)
        if task.largest_components:
            cases, instants = largest_components(cases), None
    found: Design | ThesisDesign
    if method is Method.THESIS and old_load is not None:
        found = by_thesis(beam, old_load, limits, task)
    else:
        found = least_mass(beam, cases, limits, own_mass=task.own_mass, shear=with_shear(task))
    heights = found.heights
    forces = internal_forces(beam, heights, cases)
    bent = deflection(beam, heights, forces, shear=True)
    stresses = von_mises(beam, heights, forces)
    worst, stress = int(bent.argmax()), stresses.max(axis=0)
    tapered = buckling_load(beam, heights, cases)
    body = link_body(link, beam, heights)
    after = with_body(boom, link.name, body)
    torques = tuple(_torque(b, trajectories, DRIVEN_BY[link.name], task.payload_as) for b in (boom, after))
    return LinkDesign(
        task=task,
        link=link,
        beam=beam,
        limits=limits,
        cases=cases,
        thesis_load=old_load,
        equal_constraints=_equals(beam, cases, limits, task, old_load, found),
        instants=instants,
        found=found,
        tapered_load=tapered,
        pressed=pressed(cases),
        own_deflection=float(bent[worst]),
        stress=read_only(stress),
        worst=worst,
        checks=tuple(_checks(beam, heights, cases.at([worst]))),
        stress_check=_stress_check(beam, heights, cases, stresses),
        body=body,
        before=boom,
        after=after,
        trajectories=tuple(trajectories),
        torques=(torques[0], torques[1]),
        motors=tuple(_motors(boom, after, DRIVEN_BY[link.name], trajectories, task.payload_as, catalogue)),
        warnings=tuple(_warnings(task, beam, cases, tapered, float(bent[worst]), found)),
        notes=tuple(_notes(boom, task, link, beam, trajectories, found)),
    )


def default_moves(boom: Boom, task: LinkTask, track: Track = iter) -> list[Trajectory]:
    """Transport to phenotyping: with every profile in its least time, or the thesis's cubic of 5 s where its load is taken.

    Args:
        track: iterates over the profiles, and may show how far it is.

    Raises:
        InputError, InfeasibleError: as `plan`.
    """
    if task.load == LoadFrom.THESIS:
        thesis_move = plan_motion(boom, MoveSpec.of("transport", "phenotyping", duration=5.0))
        return [replace(thesis_move.trajectory, planned=None)]
    return plan_each_profile(boom, "transport", "phenotyping", track)


def thesis_buckling(link: Link, beam: Beam, heights: Array) -> float:
    """Eq. 3.38 [N] for the designed part's smallest section, one solid rounded down to whole centimetres as in the thesis."""
    first, last = (round(share * beam.slices) for share in link.designed)
    smallest = float(heights[first : last + 1].min())
    rounded = np.floor(smallest * 100.0 + 1e-9) / 100.0 or smallest
    narrow, wide = sorted((rounded, beam.width))
    return euler_load(beam.material.elastic_modulus, wide * narrow**3 / 12.0, beam.length)


def by_thesis(beam: Beam, load: ThesisLoad, limits: Limits, task: LinkTask) -> ThesisDesign:
    """The thesis's design for a task.

    Raises:
        InputError: a limit is given that its method does not know.
    """
    asked = {"minimum height": limits.min_height > 0.0, "maximum height": limits.max_height, "maximum taper": limits.max_taper}
    for name, given in asked.items():
        if given:
            raise InputError(f"the thesis's method knows no {name}; the exact method does")
    return thesis_design(beam, load, stress_limit=limits.stress, deflection_limit=limits.deflection, step=task.step)


def with_shear(task: LinkTask) -> bool:
    """Whether shear counts in the deflection of a task's exact design."""
    return task.load == LoadFrom.MOVES if task.shear is None else task.shear


def _equals(
    beam: Beam,
    cases: LoadCases,
    limits: Limits,
    task: LinkTask,
    old_load: ThesisLoad | None,
    found: Design | ThesisDesign,
) -> tuple[float, float] | None:
    """Masses [kg] of the thesis's method and of the exact one under the thesis's own constraints; None without such a load.

    Both hold the stress, and the deflection with the moments of the stress-only beam; the exact heights are stepless.
    """
    if old_load is None:
        return None
    plain = Limits(stress=limits.stress, deflection=limits.deflection)
    theirs = found if isinstance(found, ThesisDesign) else by_thesis(beam, old_load, plain, task)
    return theirs.mass, least_mass(beam, cases, plain, own_mass=False).mass


def _one_of(name: str, value: str, known: type[E]) -> E:
    try:
        return known(value)
    except ValueError:
        raise unknown(name, value, known) from None


def _torque(boom: Boom, trajectories: Sequence[Trajectory], joint: int, payload_as: PayloadAs) -> Array:
    parts = [
        inverse_dynamics(boom, t.q, t.qd, t.qdd, payload_as=payload_as, friction=True, reactions=False).tau[:, joint]
        for t in trajectories
    ]
    return read_only(np.concatenate(parts))


def _checks(beam: Beam, H: Array, case: LoadCases) -> list[Check]:
    """The worst load case by finite elements, as far as they model it."""
    if case.clamp[0] > 0.0:
        return []
    solved: list[tuple[str, Solution]] = [
        ("Euler-Bernoulli beam", solve_beam(beam, H, case, min(beam.slices, 1000))),
        ("Timoshenko beam", solve_beam(beam, H, case, min(beam.slices, 1000), "timoshenko")),
    ]
    if beam.support == "cantilever":
        solved.append(("plane stress", solve_plate(beam, H, case, 300, 4)))
    inside = [(s.x > INSIDE[0] * beam.length) & (s.x < INSIDE[1] * beam.length) for _, s in solved]
    return [
        Check(name, s.elements, s.deflection, float(s.stress[part].max()))
        for (name, s), part in zip(solved, inside, strict=True)
    ]


def _stress_check(beam: Beam, H: Array, cases: LoadCases, stresses: Array) -> StressCheck | None:
    case, station = np.unravel_index(int(stresses.argmax()), stresses.shape)
    if cases.clamp[case] > 0.0:
        return None
    worst = cases.at([case])
    # Towards a thin end the height changes so fast that a thousand elements are 12 % off; these are 0.1 %.
    found = solve_beam(beam, H, worst, beam.slices * max(16_000 // beam.slices, 1))
    at = int(np.abs(found.x - beam.stations[station]).argmin())
    x = found.x[at]
    forces = Forces(*(np.full((1, 3), np.interp(x, beam.stations, f[0])) for f in internal_forces(beam, H, worst)))
    own = von_mises(replace(beam, slices=2), np.full(3, np.interp(x, beam.stations, H)), forces)
    return StressCheck(float(x), found.elements, float(found.stress[at]), float(own[0, 0]))


_MOTOR_TORQUES = (CheckKind.MOTOR_TORQUE, CheckKind.MOTOR_TORQUE_REVERSED, CheckKind.MOTOR_TORQUE_QUASI_STATIC)


def _motors(
    before: Boom,
    after: Boom,
    joint: int,
    trajectories: Sequence[Trajectory],
    payload_as: PayloadAs,
    catalogue: Catalogue | None,
) -> list[MotorChoice]:
    """Every motor of the catalogue on the joint's gearbox and supply, along all motions."""
    drive = before.drives[joint]
    if drive is None:
        return []

    def judged(boom: Boom, motor: Drive) -> tuple[Verdict, float | None]:
        rows = [
            row
            for t in trajectories
            for row in check(boom.with_drive(JOINTS[joint], motor), t, payload_as=payload_as).rows
            if row.joint == JOINTS[joint] and row.kind.part is Part.MOTOR
        ]
        order = [Verdict.INFO, Verdict.PASS, Verdict.WARN, Verdict.NOT_CHECKABLE, Verdict.FAIL]
        margins = [row.margin for row in rows if row.margin is not None and row.kind in _MOTOR_TORQUES]
        return max((row.verdict for row in rows), key=order.index), min(margins, default=None)

    choices = []
    for motor in (Catalogue.load() if catalogue is None else catalogue).motors.values():
        old, new = (judged(boom, replace(drive, motor=motor)) for boom in (before, after))
        choices.append(MotorChoice(motor.name, motor.mass, old[0], new[0], old[1], new[1]))
    return choices


def _warnings(
    task: LinkTask, beam: Beam, cases: LoadCases, tapered: float, bent: float, found: Design | ThesisDesign
) -> list[str]:
    """What limits the worth of this very design."""
    warnings = []
    if found.heights.max() > beam.length / 5.0:
        warnings.append(
            f"the plates are up to {found.heights.max():.3g} m high, more than a fifth of their {beam.length:g} m: "
            "beam theory does not hold"
        )
    if isinstance(found, Design) and found.gap is None:
        warnings.append("no lower bound within a tenth of the mass is proven: a lighter link may keep these limits")
    if bent > task.deflection * (1.0 + 1e-4):
        warnings.append(
            f"with its own mass and shear it deflects {1e3 * bent:.3f} mm, above its limit; "
            "the exact method with --shear holds that"
        )
    required = task.safety_factor * pressed(cases)
    if required > 0.0 and tapered < required * (1.0 - 1e-5):
        warnings.append(
            f"buckling: the tapered column holds {tapered:.0f} N, below {task.safety_factor:g} times the end load of "
            f"{pressed(cases):.0f} N"
        )
    return warnings


def _notes(
    boom: Boom,
    task: LinkTask,
    link: Link,
    beam: Beam,
    trajectories: Sequence[Trajectory],
    found: Design | ThesisDesign,
) -> list[str]:
    notes = []
    if task.load == LoadFrom.THESIS:
        notes.append(
            "the thesis's load, 758.1 and 859.9 N, does not follow from its own move of table 3-1: the dynamics that gives its "
            "table 2-8 gives -440.9 to 935.8 N along the link and 85.0 to 176.0 N across it; --load moves takes those of moves"
        )
    else:
        notes.append(
            "the loads are those of the moves given; what the boom does besides, and holding elsewhere, is not in them"
        )
        least = min(float(transmission_angle(t.q).min()) for t in trajectories)
        if link.name != "extension" and least < boom.limits.transmission:
            notes.append(
                f"the linkage comes within {np.degrees(least):.2g} deg of flat: the loads there are those of its geometry"
            )
    if link.fittings is None:
        notes.append("no fittings are known of this link: its new body is that of the plates alone, without pins and bosses")
    elif link.fittings_origin is not None:
        notes.append(f"fittings {link.fittings.mass:.3g} kg ({link.fittings_origin.basis}): {link.fittings_origin.source}")
    if link.origin.basis != "printed":
        notes.append(f"plates ({link.origin.basis}): {link.origin.source}")
    if beam.material.origin.basis != "printed":
        notes.append(f"material {beam.material.name} ({beam.material.origin.basis}): {beam.material.origin.source}")
    if link.fittings is not None or link.cross_plates:
        notes.append(
            "the plates' own mass loads the design, that of fittings and cross plates does not: 0.5 kg near the end of the "
            "thesis's inner link adds 2 % to its deflection"
        )
    notes.append("lateral bending and torsion, fatigue, welds, pin holes and local buckling of a plate's edge are not checked")
    if isinstance(found, ThesisDesign):
        notes.append("the thesis's method freezes the moments of its first stage and leaves out shear")
    return notes
