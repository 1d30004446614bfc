"""Link design for loads from moves, its verification, and the boom with the new link."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TypeVar

import numpy as np

from boom_model import JOINTS, Body, Boom, InputError, inverse_dynamics, transmission_angle
from boom_model.arrays import Array, read_only
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
from boom_model.words import unknown
from planner.checks.kinds import CheckKind, Part
from planner.checks.rows import Verdict
from planner.links.loads import largest_components, link_cases, thesis_load
from planner.links.task import LinkTask, LoadFrom, Method
from planner.motion.trajectory import Trajectory
from planner.move_spec import MoveSpec
from planner.planning import check, plan_each_profile, plan_motion
from planner.progress import Track

E = TypeVar("E", bound=StrEnum)

DRIVEN_BY = {"inner": 1, "lower": 2, "outer": 1, "extension": 2}
"""Joint whose torque depends most on the mass of a link."""


@dataclass(frozen=True)
class Check:
    """Deflection and stress of the design by an independent model."""

    model: str
    elements: int
    deflection: float
    """[m]"""
    stress: float
    """Largest von Mises stress in the range INSIDE [Pa]."""


INSIDE = (0.1, 0.9)
"""Range of the length, relative to it, for the comparison of plate and beam. Outside of it, the
clamped edge determines the stress of a plate."""


@dataclass(frozen=True)
class StressCheck:
    """Check of the largest stress of all cases and stations by Euler-Bernoulli elements."""

    x: float
    """Nearest point of the elements [m]."""
    elements: int
    by_elements: float
    """Stress of the elements [Pa]."""
    own: float
    """Stress of the design at x [Pa]; forces and height are linear between stations."""


@dataclass(frozen=True)
class MotorChoice:
    """Checks of a catalogue motor at the joint of a link, with the old and the new link."""

    motor: str
    mass: float | None
    before: Verdict
    after: Verdict
    margin_before: float | None
    """Smallest margin of the motor checks with the old link."""
    margin_after: float | None
    """The same with the new link."""


@dataclass(frozen=True, eq=False)
class LinkDesign:
    """Designed link and its effect on the boom."""

    task: LinkTask
    link: Link
    beam: Beam
    limits: Limits
    cases: LoadCases
    thesis_load: ThesisLoad | None
    """Load case of the thesis's method; None if the load cases are single instants."""
    equal_constraints: tuple[float, float] | None
    """Masses of the plates by the thesis's and the exact method, for its constraints [kg]."""
    instants: Array | None
    """(k, 2) motion and time [s] of each case; None if the cases are not instants."""
    found: Design | ThesisDesign
    """Heights, masses and deflections of the plates from pin to pin, by the method of the task."""
    tapered_load: float
    """Critical end load of the tapered column, from an eigenvalue problem [N]."""
    pressed: float
    """Largest compressive end load along the link [N]."""
    own_deflection: float
    """Deflection [m] with the final beam's mass and shear, also if the method leaves them out."""
    stress: Array
    """(n + 1,) largest von Mises stress along the link, with its own mass [Pa]."""
    worst: int
    """Index of the load case with the largest deflection."""
    checks: tuple[Check, ...]
    stress_check: StressCheck | None
    """None for a telescoping link."""
    body: Body
    """The whole link: designed plates, cross plates and fittings."""
    before: Boom
    after: Boom
    trajectories: tuple[Trajectory, ...]
    torques: tuple[Array, Array]
    """Joint torque along all motions with the old and the new link, each (samples,) [Nm]."""
    motors: tuple[MotorChoice, ...]
    warnings: tuple[str, ...]
    """Limits to the validity of this design."""
    notes: tuple[str, ...]

    @property
    def exact(self) -> Design | None:
        """Result of the exact method; None if the thesis's method was used."""
        return self.found if isinstance(self.found, Design) else None

    @property
    def thesis(self) -> ThesisDesign | None:
        """Result of the thesis's method; None if the exact method was used."""
        return self.found if isinstance(self.found, ThesisDesign) else None

    @property
    def heights(self) -> Array:
        """Height of the plates at the stations, (n + 1,) [m]."""
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
        """Critical end load [N], by the thesis's formula if its method was used."""
        return self.tapered_load if self.thesis is None else thesis_buckling(self.link, self.beam, self.heights)

    @property
    def joint(self) -> int:
        """Index of the joint in DRIVEN_BY."""
        return DRIVEN_BY[self.link.name]

    @property
    def saved(self) -> tuple[float, float]:
        """Smallest and largest relative torque saving, over samples above a tenth of its peak."""
        before, after = self.torques
        counts = np.abs(before) >= 0.1 * np.abs(before).max()
        share = 1.0 - after[counts] / before[counts]
        return float(share.min()), float(share.max())


def design_link(
    boom: Boom, task: LinkTask, trajectories: Sequence[Trajectory], catalogue: Catalogue | None = None
) -> LinkDesign:
    """Design a link, check it by finite elements, and put it into the boom.

    Args:
        boom: the boom with the old link.
        task: the requirements on the link.
        trajectories: motions that load the link; joint torque is compared along them.
        catalogue: motors to check at the joint of the link; None is the shipped catalogue.

    Raises:
        InputError: an input is malformed, not finite or out of its range.
        InfeasibleError: no heights respect the limits.
    """
    load, method = _one_of("load", task.load, LoadFrom), _one_of("method", task.method, Method)
    if not (np.isfinite(task.safety_factor) and task.safety_factor > 0.0):
        raise InputError(f"safety factor is {task.safety_factor:g}; it must be finite and above 0")
    link = load_link(boom, task.link, task.links)
    link = task.sized(link)
    material = Material.load(task.material)
    beam = link.beam(material, task.slices)
    first, last = (round(share * beam.slices) for share in link.designed)
    if first == last:
        raise InputError(f"slices is {task.slices}: the designed part of the {link.name} link has none of them; use more")
    if task.min_height >= beam.length:
        raise InputError(f"minimum height is {task.min_height:g} m; it must be below the link's length, {beam.length:g} m")
    limits = task.limits(material)
    instants, old_load = None, None
    if load is LoadFrom.THESIS:
        if link.name != "inner":
            raise InputError(f"the thesis's load is for the inner link, not for the {link.name} link; use the loads of moves")
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
    """Plan the default motions, from transport to phenotyping.

    They are one per profile in its shortest time, or for the load of the thesis its cubic of 5 s.

    Args:
        boom: the boom.
        task: the requirements on the link.
        track: iterates over the profiles, and may show progress.

    Raises:
        InputError: as `plan`.
        InfeasibleError: as `plan`.
    """
    if task.load == LoadFrom.THESIS:
        thesis_move = plan_motion(boom, MoveSpec.of("transport", "phenotyping", duration=5.0))
        return [replace(thesis_move.trajectory, planned=None)]
    return plan_each_profile(boom, "transport", "phenotyping", track)


def thesis_buckling(link: Link, beam: Beam, heights: Array) -> float:
    """Return the Euler load [N] of the thesis, eq. 3.38.

    It is that of the smallest section of the designed part, as one solid rounded down to whole
    centimetres.
    """
    first, last = (round(share * beam.slices) for share in link.designed)
    smallest = float(heights[first : last + 1].min())
    rounded = np.floor(smallest * 100.0 + 1e-9) / 100.0 or smallest
    narrow, wide = sorted((rounded, beam.width))
    return euler_load(beam.material.elastic_modulus, wide * narrow**3 / 12.0, beam.length)


def by_thesis(beam: Beam, load: ThesisLoad, limits: Limits, task: LinkTask) -> ThesisDesign:
    """Design a link by the thesis's method.

    Raises:
        InputError: the method does not support a given limit.
    """
    asked = {"minimum height": limits.min_height > 0.0, "maximum height": limits.max_height, "maximum taper": limits.max_taper}
    for name, given in asked.items():
        if given:
            raise InputError(f"the thesis's method has no {name}; use the exact method")
    return thesis_design(beam, load, stress_limit=limits.stress, deflection_limit=limits.deflection, step=task.step)


def with_shear(task: LinkTask) -> bool:
    """Return whether the deflection of the exact design includes shear."""
    return task.load == LoadFrom.MOVES if task.shear is None else task.shear


def _equals(
    beam: Beam,
    cases: LoadCases,
    limits: Limits,
    task: LinkTask,
    old_load: ThesisLoad | None,
    found: Design | ThesisDesign,
) -> tuple[float, float] | None:
    """Return the masses [kg] by the thesis's and the exact method under the thesis's constraints.

    Both limit the stress, and the deflection with the moments of the stress-only beam. The exact
    heights have no step. Return None without a load case for the thesis's method.
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
    """Solve the worst load case by finite elements. A telescoping link is not modelled."""
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
    # Height changes fast near a thin end: 1,000 elements have an error of 12 %, these of 0.1 %.
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
    """Check the steppers of the catalogue on the gearbox and supply of the joint, on all motions.

    Motors without a running torque are left out, because their torque cannot be checked.
    """
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
    known = Catalogue.load() if catalogue is None else catalogue
    for motor in (each for each in known.motors.values() if each.running_torque is not None):
        old, new = (judged(boom, replace(drive, motor=motor)) for boom in (before, after))
        choices.append(MotorChoice(motor.name, motor.mass, old[0], new[0], old[1], new[1]))
    return choices


def _warnings(
    task: LinkTask, beam: Beam, cases: LoadCases, tapered: float, bent: float, found: Design | ThesisDesign
) -> list[str]:
    """Return the limits to the validity of this design."""
    warnings = []
    if found.heights.max() > beam.length / 5.0:
        warnings.append(
            f"the plates are up to {found.heights.max():.3g} m high, more than a fifth of their {beam.length:g} m: "
            "beam theory is not valid"
        )
    if isinstance(found, Design) and found.gap is None:
        warnings.append("no lower bound within 10 % of the mass is proven: a lighter link may exist within these limits")
    if bent > task.deflection * (1.0 + 1e-4):
        warnings.append(
            f"with its own mass and shear the link deflects {1e3 * bent:.3f} mm, above its limit; "
            "the exact method with --shear includes both"
        )
    required = task.safety_factor * pressed(cases)
    if required > 0.0 and tapered < required * (1.0 - 1e-5):
        warnings.append(
            f"buckling: the tapered column carries {tapered:.0f} N, less than {task.safety_factor:g} times the end load of "
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
            "the thesis's load, 758.1 and 859.9 N, does not follow from its move of table 3-1: the dynamics that reproduce its "
            "table 2-8 give -440.9 to 935.8 N along the link and 85.0 to 176.0 N across it; --load moves uses those of moves"
        )
    else:
        notes.append(
            "the loads are those of the given moves only; other moves, and holding in other positions, are not included"
        )
        least = min(float(transmission_angle(boom, t.q).min()) for t in trajectories)
        if link.name != "extension" and least < boom.limits.transmission:
            notes.append(
                f"the linkage comes within {np.degrees(least):.2g} deg of flat, where its geometry determines the loads"
            )
    if link.fittings is None:
        notes.append("the fittings of this link are unknown: its new body is that of the plates only, without pins and bosses")
    elif link.fittings_origin is not None:
        notes.append(f"fittings {link.fittings.mass:.3g} kg ({link.fittings_origin.basis}): {link.fittings_origin.source}")
    if link.origin.basis != "printed":
        notes.append(f"plates ({link.origin.basis}): {link.origin.source}")
    if beam.material.origin.basis != "printed":
        notes.append(f"material {beam.material.name} ({beam.material.origin.basis}): {beam.material.origin.source}")
    if link.fittings is not None or link.cross_plates:
        notes.append(
            "the design includes the weight of the plates, but not that of fittings and cross plates: 0.5 kg near the end of "
            "the thesis's inner link adds 2 % to its deflection"
        )
    notes.append("lateral bending and torsion, fatigue, welds, pin holes and local buckling of a plate's edge are not checked")
    if isinstance(found, ThesisDesign):
        notes.append("the thesis's method keeps the moments of its first stage and leaves out shear")
    return notes
