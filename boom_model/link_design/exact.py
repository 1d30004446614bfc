"""The least mass of a link under stress, deflection, buckling, heights and taper, by its optimality conditions.

With moments frozen, as Appendix D freezes those of its stage 1, a link has least mass where

    minimise   rho w int H dx
    subject to H >= H_stress,  sum_i c_ki / H_i^3 <= deflection (every load case k),  P_cr(H) >= P,  |dH/dx| <= taper

which is convex. `interior_point` solves it, bound and all.

With the beam's own mass the moments follow the heights. Then each height costs, beside its own mass, what its inertia adds to
the moments, shears and normal forces inboard, priced at the multipliers; heights, forces and prices are repeated until they
agree, which is where the optimality conditions of the whole problem hold; the deflection by shear, sum_i d_i / H_i, is treated
alike. Where the own load adds to the end's at every station,
stress and deflection are posynomials of the heights, convex in log H (Boyd and others, A tutorial on geometric programming,
2007): what solves the conditions is then the least, and the Lagrangian bounds it from below.
"""

from dataclasses import dataclass, replace

import numpy as np

from boom_model.arrays import Array, Mask, read_only, scalar
from boom_model.errors import InfeasibleError, InputError
from boom_model.link_design.beam import (
    Beam,
    Forces,
    LoadCases,
    added_by_height,
    deflection,
    deflection_coefficients,
    internal_forces,
    mass,
    shear_coefficients,
    stress_height,
    von_mises,
)
from boom_model.link_design.buckling import critical_load
from boom_model.link_design.interior_point import Capacity, Optimum, Problem, solve

_AGREED = 1e-9
"""Relative change of the mass at which heights and forces agree."""

_NEARLY_AGREED = 1e-5
"""What is enough after half of the repeats: where the prices of an own mass are steep, rounding is all that is left."""

_MOST_REPEATS = 60


@dataclass(frozen=True)
class Limits:
    """What a link must keep."""

    stress: float
    """Largest von Mises stress [Pa]"""
    deflection: float
    """Largest deflection of a cantilever's end or a strut's middle [m]"""
    min_height: float = 0.0
    """[m]"""
    max_height: float | None = None
    """[m]; None leaves it free"""
    max_taper: float | None = None
    """Largest |dH/dx|; None leaves it free"""
    buckling_factor: float | None = None
    """Critical end load over the largest one; None does not ask for it"""

    def __post_init__(self) -> None:
        named = {"stress limit": self.stress, "deflection limit": self.deflection, "maximum height": self.max_height,
                 "maximum taper": self.max_taper, "buckling factor": self.buckling_factor}  # fmt: skip
        for name, value in named.items():
            if value is not None and not scalar(name, value) > 0.0:
                raise InputError(f"{name} is {value:g}; it must be above 0: nothing else holds it")
        if scalar("minimum height", self.min_height) < 0.0:
            raise InputError(f"minimum height is {self.min_height:g} m; it must be at least 0 m")
        if self.max_height is not None and self.min_height >= self.max_height:
            raise InputError(
                f"minimum height {self.min_height:g} m is not below the maximum of {self.max_height:g} m: no height is left"
            )


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
    """[m], the largest of the load cases, with the forces and the theory that the design was made for"""
    stress_deflection: float
    shear: bool
    """Whether the deflections count the sections' shear"""
    max_stress: float
    """[Pa]"""
    buckling_load: float
    """Critical end load of the tapered column, the lesser of both planes [N]"""
    lower_bound: float | None
    """[kg] that no link under these limits can go below; None where none is proven, or none within a tenth"""
    governing: tuple[int, ...]
    """The load cases whose deflection is at its limit"""

    @property
    def gap(self) -> float | None:
        """(mass - lower bound) / mass."""
        return None if self.lower_bound is None else (self.mass - self.lower_bound) / self.mass


def least_mass(beam: Beam, cases: LoadCases, limits: Limits, *, own_mass: bool = True, shear: bool = True) -> Design:
    """The link of least mass.

    Args:
        own_mass: whether the final beam's own mass bends it; False freezes the forces of the stress-only beam, as Appendix D.
        shear: whether the sections' shear counts in the deflection; not where the forces are frozen.

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
    """The design, with a least height that keeps it from buckling in the arm's plane where its taper ends would.

    In the plane the critical load is not concave in the heights: what holds it here is safe, not least. The bound stays that of
    the design without, and so does the gap tell.
    """
    beam, limits = design.beam, design.limits
    needed = (limits.buckling_factor or 0.0) * pressed(design.cases)
    bound, first = design.lower_bound, limits

    def load(H: Array) -> float:
        return critical_load(beam, H, _pressing(beam, design.cases), "in-plane").load

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
    """Load cases that are likely to matter, and those that press the link together hardest."""
    if cases.count == 1:
        return np.zeros(1, dtype=int)
    H = np.full(beam.slices + 1, max(limits.min_height, 0.05 * beam.length))
    forces = internal_forces(beam, H, cases)
    a = cases.acceleration[:, 0]
    pressing = [cases.end_force[:, 0].argmin(), a[:, 0].argmax(), (a[:, 0] + a[:, 1] * beam.length).argmax()]
    return np.unique([*von_mises(beam, H, forces).argmax(axis=0), deflection(beam, H, forces).argmax(), *pressing]).astype(int)


def _broken(design: Design, cases: LoadCases) -> Array:
    """The load cases that break the stress limit worst at some station, and the deflection limit worst."""
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
    price = beam.material.density * beam.width * beam.weights
    search = _Search(beam, cases, limits, price, shear)
    H, found = before, None
    for repeat in range(1, _MOST_REPEATS + 1):
        found = search.solve(H, forces, price)
        change = abs(mass(beam, found.heights) - mass(beam, H)) / mass(beam, H)
        H = found.heights
        if not own_mass:
            break
        forces = internal_forces(beam, H, cases)
        price = search.price(H, forces, found)
        agreed = _AGREED if repeat < _MOST_REPEATS // 2 else _NEARLY_AGREED
        if repeat > 1 and change <= max(agreed, (found.value - found.lower_bound) / found.value):
            break
    else:
        raise InfeasibleError(f"after {_MOST_REPEATS} repeats the link's mass and its own load still change each other")
    if found is None:
        raise RuntimeError("the search ran at least once")
    bound = _lower_bound(search, H, forces, found) if own_mass else found.lower_bound
    if bound is not None and not bound >= 0.9 * mass(beam, H):
        bound = None
    stressed = von_mises(beam, H, forces)
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
        max_stress=float(stressed.max()),
        buckling_load=buckling_load(beam, H, cases),
        lower_bound=bound,
        governing=tuple(sorted(search.deflecting)) if found.multipliers.deflections.size else (),
    )


def stress_only(beam: Beam, cases: LoadCases, limits: Limits) -> Array:
    """Least heights (n + 1,) that hold the stress with their own mass, station by station: exact (thesis, section 3.3).

    The load of a station depends on those beyond it alone, so what is repeated settles from the end inwards.

    Raises:
        InfeasibleError: the heights grow without end, or beyond the maximum.
    """
    top = np.inf if limits.max_height is None else limits.max_height
    H = np.full(beam.slices + 1, limits.min_height)
    for _ in range(_MOST_REPEATS):
        needed = np.maximum(stress_height(beam, internal_forces(beam, H, cases), limits.stress).max(axis=0), limits.min_height)
        if not np.isfinite(needed).all() or needed.max() > 1e3 * beam.length:
            raise InfeasibleError("the link cannot carry its own load within the stress limit")
        if (needed > top).any():
            i = int(np.argmax(needed))
            raise InfeasibleError(
                f"at x = {beam.stations[i]:.4g} m the stress needs {needed[i]:.4g} m of height, above the maximum of {top:g} m"
            )
        if np.abs(needed - H).max() <= 1e-13 * max(float(needed.max()), 1e-300):
            break
        H = needed
    else:
        raise InfeasibleError("the link cannot carry its own load within the stress limit")
    if not needed.max() > 0.0:
        raise InfeasibleError("nothing loads the link and there is no minimum height: its least mass is 0")
    found: Array = np.maximum(needed, 1e-9 * float(needed.max()))  # an end without load has no height, but must have stiffness
    return found


def pressed(cases: LoadCases) -> float:
    """The largest compressive end load of the cases [N]; below 0 where all pull."""
    return float(-cases.end_force[:, 0].min())


def buckling_load(beam: Beam, H: Array, cases: LoadCases) -> float:
    """Critical end load [N], the lesser of both planes, under the strongest own load of the cases."""
    return min(critical_load(beam, H, _pressing(beam, cases), plane).load for plane in ("across", "in-plane"))


def _pressing(beam: Beam, cases: LoadCases) -> Array:
    """An axial acceleration (2,) that at every station is at least each case's."""
    a = cases.acceleration[:, 0]
    root, end = a[:, 0].max(), (a[:, 0] + a[:, 1] * beam.length).max()
    return np.array([root, (end - root) / beam.length])


class _Search:
    """The convex problem at given forces and prices, with the deflections, and the buckling, found to matter so far."""

    def __init__(self, beam: Beam, cases: LoadCases, limits: Limits, mass_per_height: Array, shear: bool) -> None:
        self.beam, self.cases, self.limits, self.mass_per_height, self.shear = beam, cases, limits, mass_per_height, shear
        self.deflecting: list[int] = []
        self.low = np.zeros(beam.slices + 1)
        load = pressed(cases)
        asked = limits.buckling_factor is not None and load > 0.0
        self.buckles = False
        self.buckling = float(limits.buckling_factor or 0.0) * load if asked else 0.0

    def deflections(self, H: Array, forces: Forces) -> tuple[Array, Array]:
        """C (k, n + 1) of C / H^3 <= 1, one a case, and the deflection (k,) [m] that 1 stands for.

        Shear's d / H is taken as (d H0^2 / 3) / H^3 + 2 d / (3 H0), which has its value and its slope at the heights H0 given.
        """
        C = deflection_coefficients(self.beam, forces.M)
        left = np.full(self.cases.count, self.limits.deflection)
        if self.shear:
            d = shear_coefficients(self.beam, forces.V)
            C, left = C + d * H**2 / 3.0, left - (2.0 / 3.0 * d / H).sum(axis=1)
            left = np.maximum(left, 0.1 * self.limits.deflection)  # a stress-only beam may be over the limit by shear alone
        return C / left[:, None], left

    def solve(self, H: Array, forces: Forces, price: Array) -> Optimum:
        beam, limits = self.beam, self.limits
        needed = stress_height(beam, forces, limits.stress)
        self.low = np.maximum(needed.max(axis=0), limits.min_height)
        self.low = np.maximum(self.low, 1e-9 * self.low.max())
        C, _ = self.deflections(H, forces)
        taper = None if limits.max_taper is None else np.full(beam.slices, limits.max_taper * beam.step)
        while True:
            capacity = self._capacity if self.buckles else None
            found = solve(Problem(price, self.low, self._upper(C), taper, C[self.deflecting], capacity))
            deflections = (C / found.heights**3).sum(axis=1)
            worst = int(np.argmax(deflections))
            if deflections[worst] > 1.0 + 1e-8 and worst not in self.deflecting:
                self.deflecting.append(worst)
            elif self.buckling > 0.0 and not self.buckles and self._capacity(found.heights).value < 1.0:
                self.buckles = True
            else:
                return found

    def _capacity(self, H: Array) -> Capacity:
        critical = critical_load(self.beam, H, _pressing(self.beam, self.cases))
        P = self.buckling
        return Capacity(critical.load / P, critical.gradient / P, critical.curvature / np.sqrt(P))

    def _upper(self, C: Array) -> Array:
        """The maximum height, or one that no best link reaches: four times what one height for all stations asks for."""
        top = self.limits.max_height
        if top is None:
            level = max(float(self.low.max()), float(C.sum(axis=1).max(initial=0.0)) ** (1.0 / 3.0))
            if self.buckling > 0.0:
                level = max(level, level / self._capacity(np.full(self.low.size, level)).value)
            top = 4.0 * level
        return np.full(self.beam.slices + 1, top)

    def price(self, H: Array, forces: Forces, found: Optimum) -> Array:
        """What each height costs: its mass, and what its inertia adds to every force that a multiplier prices, (n + 1,)."""
        used, weights = self.weights(H, forces, found)
        return self.mass_per_height + added_by_height(self.beam, self.cases.at(used), weights)

    def weights(self, H: Array, forces: Forces, found: Optimum) -> tuple[Array, Forces]:
        """The priced cases, and the price of each force at each station."""
        beam, limits = self.beam, self.limits
        governing = stress_height(beam, forces, limits.stress).argmax(axis=0)
        multiplier = np.where(self.low > limits.min_height, found.multipliers.lower, 0.0)
        multiplier = np.where(multiplier > 1e-7 * multiplier.max(initial=0.0), multiplier, 0.0)
        used = np.unique([*self.deflecting, *governing[multiplier > 0.0]]).astype(int)
        N, V, M = (f[used] for f in forces)
        k = np.searchsorted(used, governing)
        chosen = (np.arange(used.size)[:, None] == k) * multiplier
        s = limits.stress * beam.width
        bent = np.abs(N) * H + 6.0 * np.abs(M)
        falls = 4.0 * s**2 * H**3 - 2.0 * bent * np.abs(N) - 6.0 * V**2 * H
        rate = np.divide(chosen, falls, out=np.zeros_like(N), where=falls > 0.0)
        wN, wV, wM = rate * 2.0 * bent * H * np.sign(N), rate * 6.0 * V * H**2, rate * 12.0 * bent * np.sign(M)
        (_, left), ones = self.deflections(H, forces), np.ones_like(H)
        per_moment, per_force = deflection_coefficients(beam, ones) / H**3, shear_coefficients(beam, ones) / H
        for case, z in zip(self.deflecting, found.multipliers.deflections, strict=True):
            at = int(np.searchsorted(used, case))
            wM[at] += z / left[case] * per_moment * np.sign(M[at])
            if self.shear:
                wV[at] += z / left[case] * per_force * np.sign(V[at])
        return used, Forces(wN, wV, wM)


def _lower_bound(search: _Search, H: Array, forces: Forces, found: Optimum) -> float | None:
    """A mass that no link goes below, its own mass and all; None where none is proven.

    Looks at those load cases alone whose own load adds to the end's, without what pulls or presses where that does not add: no
    more than easing constraints. Their forces at least are those of the stress-only beam: the frozen problem bounds the mass.
    The Lagrangian in log H at the multipliers found does so too, and closely, where neither buckling nor taper decides; its
    gradient, which is nearly 0, is followed to the ends of the range of heights.
    """
    beam, cases, limits = search.beam, search.cases, search.limits
    along, across = _adding(beam, cases)
    if not across.any():
        return None
    some = cases.at(np.flatnonzero(across))
    only = along[across, None]
    some = LoadCases.of(
        some.end_force * np.where([True, False], only, True),
        some.acceleration * np.where([True, False], only, True)[..., None],
        some.end_moment,
        some.clamp,
    )
    least = stress_only(beam, some, limits)
    frozen = _Search(beam, some, limits, search.mass_per_height, shear=False)
    bound = frozen.solve(least, internal_forces(beam, least, some), search.mass_per_height).lower_bound
    if limits.max_taper is not None:
        return bound
    # A multiplier that is left out, as those of the other cases are, bounds the mass all the same.
    counts = (along & across)[stress_height(beam, forces, limits.stress).argmax(axis=0)]
    kept = found.multipliers._replace(
        lower=np.where(counts, found.multipliers.lower, 0.0),
        deflections=np.where(across[search.deflecting], found.multipliers.deflections, 0.0),
    )
    found = replace(found, multipliers=kept)
    price = search.price(H, forces, found)
    stress_price = np.where(search.low > limits.min_height, kept.lower, 0.0)
    C = search.deflections(H, forces)[0][search.deflecting]
    z = kept.deflections
    gradient = H * (price - 3.0 * (z @ C) / H**4 - stress_price)
    top = np.full_like(H, 4.0 * H.max() if limits.max_height is None else limits.max_height)
    down, up = np.log(np.minimum(least, H) / H), np.log(top / H)
    slack = float(z @ ((C / H**3).sum(axis=1) - 1.0))
    stress = von_mises(beam, H, forces).max(axis=0)
    # p - 1 <= 0 with p = (stress / limit)^2 has the multiplier of H >= H_stress over -dp/dH, at most H / 2 of it.
    slack -= float(np.abs(stress_price * H * ((stress / limits.stress) ** 2 - 1.0)).sum())
    return max(bound, mass(beam, H) + slack + float(np.minimum(gradient * down, gradient * up).sum()))


def _adding(beam: Beam, cases: LoadCases) -> tuple[Mask, Mask]:
    """Whether each case's (k,) forces along the link, and across it, grow in size with every height.

    None does across a strut, whose shear changes sign.
    """
    end, a = cases.end_force, cases.acceleration
    far = a[..., 0] + a[..., 1] * beam.length
    rounding = 1e-12 * float(np.abs(end).max()) * float(np.abs(a).max())
    along, across = (
        (end[:, i] * a[:, i, 0] <= rounding) & (end[:, i] * far[:, i] <= rounding) & (a[:, i, 0] * far[:, i] >= -rounding)
        for i in (0, 1)
    )
    across &= (cases.end_moment * end[:, 1] >= 0.0) & (beam.support == "cantilever")
    return along, across
