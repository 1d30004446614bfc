"""The least mass of a link under limits of stress, deflection, buckling, height and taper.

With frozen forces, as Appendix D freezes those of its stage 1, a link has least mass where

    minimise   rho w int H dx
    subject to H >= H_stress,  |dH/dx| <= taper,  P_cr(H) >= P,
               sum_i c_ki / H_i^3 + d_ki / H_i <= deflection for every load case k

which is convex (see `problem`). With the own mass of the beam the forces follow the heights. Then
each height costs its mass, and what its inertia adds to the moments, shears and normal forces
inboard, priced at the multipliers. Heights, forces and prices are repeated until they agree. There
the optimality conditions of the whole problem hold. Where the own load adds to the end load, they
make the link the lightest one, and `bound` proves it.
"""

from dataclasses import dataclass, replace

import numpy as np

from boom_model.arrays import Array, read_only
from boom_model.errors import InfeasibleError
from boom_model.link_design.beam import Beam, Forces, LoadCases, deflection, internal_forces, mass, von_mises
from boom_model.link_design.bound import lower_bound
from boom_model.link_design.buckling import critical_load
from boom_model.link_design.conic import Optimum
from boom_model.link_design.limits import Limits
from boom_model.link_design.search import Search, pressed, pressing, stress_only

_AGREED = 1e-8
"""Relative change of the mass at which heights and forces agree; a hundredth of it is left then"""

_MOST_REPEATS = 60


@dataclass(frozen=True, eq=False)
class Design:
    """A link's heights and what they keep."""

    beam: Beam
    cases: LoadCases
    limits: Limits
    heights: Array
    """(n + 1,) [m]"""
    stress_heights: Array
    """(n + 1,) of the stress, and of the least height, alone [m]"""
    mass: float
    """[kg]"""
    stress_mass: float
    deflection: float
    """[m], the largest of the load cases, with the forces and the theory that the design was made
    for"""
    stress_deflection: float
    shear: bool
    """Whether the deflections count the sections' shear"""
    max_stress: float
    """[Pa]"""
    buckling_load: float
    """Critical end load of the tapered column, the lesser of both planes [N]"""
    lower_bound: float | None
    """[kg] No link under these limits is lighter. None where none is proven, or none within a
    tenth.

    The gap is below 1e-6 where every load case that matters is made worse by the own load, and
    tapers or buckling do not act together with it; also with frozen forces. Else the bound is
    looser."""
    governing: tuple[int, ...]
    """The load cases whose deflection is at its limit"""

    @property
    def gap(self) -> float | None:
        """(mass - lower bound) / mass."""
        return None if self.lower_bound is None else (self.mass - self.lower_bound) / self.mass


def least_mass(beam: Beam, cases: LoadCases, limits: Limits, *, own_mass: bool = True, shear: bool = True) -> Design:
    """Find the link of least mass.

    Args:
        beam: the beam.
        cases: the load cases.
        limits: the limits on stress, deflection, heights and buckling.
        own_mass: whether the mass of the final beam bends it. False freezes the forces of the
            stress-only beam, as Appendix D does.
        shear: whether shear counts in the deflection. It never does with frozen forces.

    Raises:
        InfeasibleError: no heights keep the limits; says which limit stops them.
    """
    some = _first_guess(beam, cases, limits)
    while True:
        design = _upright(_least_mass(beam, cases.at(some), limits, own_mass, shear and own_mass), own_mass)
        more = np.setdiff1d(_broken(design, cases), some)
        if not more.size:
            governing = tuple(int(some[k]) for k in design.governing)
            return replace(design, cases=cases, limits=limits, governing=governing)
        some = np.union1d(some, more)


def _upright(design: Design, own_mass: bool) -> Design:
    """Raise the minimum height of a design until it does not buckle in the arm's plane.

    There the critical load is not concave in the heights, so the result is safe but not the least.
    The bound stays that of the first design, and the gap shows the difference.
    """
    beam, limits = design.beam, design.limits
    needed = (limits.buckling_factor or 0.0) * pressed(design.cases)
    bound, first = design.lower_bound, limits

    def load(H: Array) -> float:
        return critical_load(beam, H, pressing(beam, design.cases), "in-plane")

    while needed > 0.0 and load(design.heights) < needed * (1.0 - 1e-6):
        low, high = limits.min_height, limits.max_height or 10.0 * float(design.heights.max())
        if load(np.maximum(design.heights, high)) < needed:
            raise InfeasibleError(
                f"at the maximum height of {high:.4g} m the link buckles in the arm's plane below {needed:.0f} N"
            )
        for _ in range(20):
            middle = (low + high) / 2.0
            low, high = (low, middle) if load(np.maximum(design.heights, middle)) >= needed else (middle, high)
        limits = replace(limits, min_height=min(1.01 * high, limits.max_height or np.inf))
        design = replace(_least_mass(beam, design.cases, limits, own_mass, design.shear), lower_bound=bound)
    return replace(design, limits=first)


def _first_guess(beam: Beam, cases: LoadCases, limits: Limits) -> Array:
    """Select load cases that are likely to matter, and those that press the link hardest."""
    if cases.count == 1:
        return np.zeros(1, dtype=int)
    H = np.full(beam.slices + 1, max(limits.min_height, 0.05 * beam.length))
    forces = internal_forces(beam, H, cases)
    a = cases.acceleration[:, 0]
    pressing = [cases.end_force[:, 0].argmin(), a[:, 0].argmax(), (a[:, 0] + a[:, 1] * beam.length).argmax()]
    return np.unique([*von_mises(beam, H, forces).argmax(axis=0), deflection(beam, H, forces).argmax(), *pressing]).astype(int)


def _broken(design: Design, cases: LoadCases) -> Array:
    """Select the load cases that break the stress at some station, or the deflection, the most."""
    if cases.count == design.cases.count or cases.count == 1:
        return np.empty(0, dtype=int)
    beam, limits, H = design.beam, design.limits, design.heights
    forces = internal_forces(beam, H, cases)
    stress, bent = von_mises(beam, H, forces), deflection(beam, H, forces, shear=design.shear)
    over = stress.max(axis=0) > limits.stress * (1.0 + 1e-6)
    worst = [] if bent.max() <= limits.deflection * (1.0 + 1e-6) else [int(bent.argmax())]
    return np.unique([*stress.argmax(axis=0)[over], *worst]).astype(int)


def _least_mass(beam: Beam, cases: LoadCases, limits: Limits, own_mass: bool, shear: bool) -> Design:
    before = stress_only(beam, cases, limits)
    forces = internal_forces(beam, before, cases)
    start = float(deflection(beam, before, forces, shear=shear).max())
    search = Search(beam, cases, limits, shear=shear)
    found = search.solve(forces, search.mass_per_height, None)
    H = found.heights
    bound: float | None = found.lower_bound
    if own_mass:
        H, found = _with_own_mass(search, found)
        bound = lower_bound(search, H, found)
        H, forces = _held(search, H)
    if bound is not None:
        bound = min(bound, mass(beam, H)) if bound >= 0.9 * mass(beam, H) else None
    return Design(
        beam=beam,
        cases=cases,
        limits=limits,
        heights=read_only(H),
        stress_heights=read_only(before),
        mass=mass(beam, H),
        stress_mass=mass(beam, before),
        deflection=float(deflection(beam, H, forces, shear=shear).max()),
        stress_deflection=start,
        shear=shear,
        max_stress=float(von_mises(beam, H, forces).max()),
        buckling_load=buckling_load(beam, H, cases),
        lower_bound=bound,
        governing=tuple(sorted(search.deflecting)),
    )


def _with_own_mass(search: Search, found: Optimum) -> tuple[Array, Optimum]:
    """Repeat forces, prices and heights until they agree.

    Raises:
        InfeasibleError: they do not agree. That happens only where the own load strongly eases the
            end load.
    """
    H = found.heights
    for _ in range(_MOST_REPEATS):
        forces = internal_forces(search.beam, H, search.cases)
        found = search.solve(forces, search.price(H, forces, found), H)
        before, H = H, found.heights
        change = abs(mass(search.beam, H) / mass(search.beam, before) - 1.0)
        if change <= max(_AGREED, (found.value - found.lower_bound) / found.value):
            return H, found
    raise InfeasibleError(f"after {_MOST_REPEATS} repeats the link's mass and its own load still change each other")


def _held(search: Search, H: Array) -> tuple[Array, Forces]:
    """Scale heights up by what the last repeat left them short of stress and deflection."""
    beam, cases, limits = search.beam, search.cases, search.limits
    forces = internal_forces(beam, H, cases)
    for _ in range(3):
        bent, stress = deflection(beam, H, forces, shear=search.shear).max(), von_mises(beam, H, forces).max()
        short = max(float(bent) / limits.deflection, float(stress) / limits.stress) - 1.0
        if short <= 0.0:
            break
        H = np.minimum(H * (1.0 + 1.1 * short), np.inf if limits.max_height is None else limits.max_height)
        forces = internal_forces(beam, H, cases)
    return H, forces


def buckling_load(beam: Beam, H: Array, cases: LoadCases) -> float:
    """Return the critical end load [N], the lesser of both planes, under the strongest own load."""
    along = pressing(beam, cases)
    return min(critical_load(beam, H, along, plane) for plane in ("across", "in-plane"))
