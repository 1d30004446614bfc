"""Convergence of a link design and its finite elements (thesis, figures 3-14, 3-15, 3-18, 3-20)."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from boom_model.arrays import Array
from boom_model.link_design import Limits, least_mass
from boom_model.link_design.finite_elements import Solution, Theory, solve_beam, solve_plate
from planner.links.design import LinkDesign, by_thesis, with_shear

SLICES = (20, 50, 100, 200, 400, 600, 1000)
STEPS = (1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4)
"""delta-H [m]."""
ELEMENTS = (4, 8, 16, 32, 64, 128, 256)
PLACES = (0.1, 0.3, 0.5, 0.7, 0.9)
"""Places of the stress results, relative to the length."""

PRISMATIC = "Euler-Bernoulli beam, one height an element"


@dataclass(frozen=True, eq=False)
class Convergence:
    """Results of the convergence studies: rows with the varied number first."""

    slices: Array
    """(m, 2) slices and mass [kg], by the method of the design (figure 3-14)"""
    steps: Array | None
    """(m, 2) delta-H [m] and mass [kg] of the thesis's method (figure 3-15); None if the design has
    no load case for that method"""
    stepless: float | None
    """Mass of the exact method under the same constraints [kg]."""
    deflections: Mapping[str, Array]
    """(m, 2) elements and deflection [m] per model (figure 3-20); empty if the link telescopes"""
    stresses: Array | None
    """(m, 1 + places) elements and von Mises stress [Pa] at PLACES, for beam elements of constant
    height (figure 3-18); None if the link telescopes"""


@lru_cache(maxsize=1)  # shared by picture, report and JSON of one design
def study(design: LinkDesign) -> Convergence:
    """Run the convergence studies of a design, with at most its number of slices."""
    slices = [n for n in SLICES if n < design.beam.slices] + [design.beam.slices]
    case = design.cases.at([design.worst])
    solved: dict[str, list[Solution]] = {}
    if not case.clamp[0] > 0.0:
        names = [PRISMATIC, "Euler-Bernoulli beam", "Timoshenko beam"]
        names += ["plane stress"] if design.beam.support == "cantilever" else []
        solved = {name: [_solved(design, name, n) for n in ELEMENTS] for name in names}
    places = design.beam.length * np.array(PLACES)
    return Convergence(
        slices=np.array([(n, _mass(design, n)) for n in slices]),
        steps=_by_steps(design),
        stepless=None if design.equal_constraints is None else design.equal_constraints[1],
        deflections={name: np.array([(s.elements, s.deflection) for s in each]) for name, each in solved.items()},
        stresses=np.array([(s.elements, *np.interp(places, s.x, s.stress)) for s in solved[PRISMATIC]]) if solved else None,
    )


def _mass(design: LinkDesign, slices: int) -> float:
    beam, task = replace(design.beam, slices=slices), design.task
    if design.thesis is not None and design.thesis_load is not None:
        return by_thesis(beam, design.thesis_load, design.limits, task).mass
    return least_mass(beam, design.cases, design.limits, own_mass=task.own_mass, shear=with_shear(task)).mass


def _by_steps(design: LinkDesign) -> Array | None:
    load = design.thesis_load
    if load is None:
        return None
    plain = Limits(stress=design.limits.stress, deflection=design.limits.deflection)
    return np.array([(step, by_thesis(design.beam, load, plain, replace(design.task, step=step)).mass) for step in STEPS])


def _solved(design: LinkDesign, name: str, elements: int) -> Solution:
    beam, H, case = design.beam, design.heights, design.cases.at([design.worst])
    if name == "plane stress":  # two elements over the height
        return solve_plate(beam, H, case, max(elements // 2, 1), 2)
    theory: Theory = "timoshenko" if name.startswith("Timoshenko") else "euler-bernoulli"
    return solve_beam(beam, H, case, elements, theory, prismatic=name == PRISMATIC)
