"""The convex problem of a link at given internal forces and prices of its heights.

`Search` builds the problem, adds the load cases and the buckling constraint that turn out to
matter, and prices the own mass: what the inertia of a height adds to each force that a multiplier
prices.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from boom_model.arrays import Array, Mask
from boom_model.errors import InfeasibleError
from boom_model.link_design.beam import (
    Beam,
    Forces,
    LoadCases,
    added_by_height,
    deflection_coefficients,
    internal_forces,
    shear_coefficients,
    stress_height,
)
from boom_model.link_design.buckling import column_forms, critical_load
from boom_model.link_design.conic import Optimum, solve
from boom_model.link_design.limits import Limits
from boom_model.link_design.problem import Column, Problem, lower_multipliers, separable_least

_SMOOTHING = 5e-4
"""Cost of a wave of the heights, as long as a column's element and as high as their mean, relative
to the cost of the link. The elements hardly see such waves. Without this cost, heights that
buckling decides swing by a third of their size within an element, for less than a millionth of the
mass."""

_LEAST_PRICE = 0.01
"""Least price of a height, relative to its mass"""

_MOST_REPEATS = 60


def stress_only(beam: Beam, cases: LoadCases, limits: Limits) -> Array:
    """Find the least heights (n + 1,) that hold the stress with their own mass.

    The result is exact (thesis, section 3.3). The load of a station depends only on the stations
    beyond it, so the iteration settles from the end inwards.

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
    """Return the largest compressive end load of the cases [N]; below 0 where all pull."""
    return float(-cases.end_force[:, 0].min())


def pressing(beam: Beam, cases: LoadCases) -> Array:
    """Return an axial acceleration (2,) that is at least that of each case at every station."""
    a = cases.acceleration[:, 0]
    root, end = a[:, 0].max(), (a[:, 0] + a[:, 1] * beam.length).max()
    return np.array([root, (end - root) / beam.length])


class StressTerm(NamedTuple):
    """The term of the Lagrangian that the stress adds: sum_i z_i ((stress_i / limit)^2 - 1).

    Where a height is a stress height, the term falls with it as fast as the multiplier of
    H >= H_stress says.
    """

    governing: NDArray[np.intp]
    """(n + 1,) the load case of each station"""
    slope: Array
    """(n + 1,) d term / dH at given forces, below 0 where there is a multiplier"""
    value: float
    forces: Forces
    """(n + 1,) each: d term / d force"""


class Search:
    """Convex problem at given forces and prices, with the constraints that matter so far."""

    def __init__(self, beam: Beam, cases: LoadCases, limits: Limits, *, shear: bool) -> None:
        self.beam, self.cases, self.limits, self.shear = beam, cases, limits, shear
        self.mass_per_height = beam.material.density * beam.width * beam.weights
        self.deflecting: list[int] = []
        """Load cases whose deflection is a constraint"""
        self.buckles = False
        """Whether buckling is a constraint"""
        self.load = (limits.buckling_factor or 0.0) * max(pressed(cases), 0.0)
        self.pressing = pressing(beam, cases)

    def problem(self, forces: Forces, price: Array) -> Problem:
        """Return the problem with the deflection of every case and without buckling."""
        beam, limits = self.beam, self.limits
        low = np.maximum(stress_height(beam, forces, limits.stress).max(axis=0), limits.min_height)
        taper = None if limits.max_taper is None else np.full(beam.slices, limits.max_taper * beam.step)
        upper = np.full(beam.slices + 1, np.inf if limits.max_height is None else limits.max_height)
        return Problem(price, np.maximum(low, 1e-9 * low.max()), upper, taper, *self._deflections(forces))

    def deflecting_only(self, problem: Problem) -> Problem:
        """Return the problem with the deflections of the load cases found to matter."""
        some = self.deflecting
        return replace(problem, bending=problem.bending[some], shear=problem.shear[some])

    def solve(self, forces: Forces, price: Array, near: Array | None) -> Optimum:
        """Solve the problem, and add what its answer breaks until it breaks nothing.

        The multipliers of the lower heights are those of the stress; where the minimum height is
        higher they are 0.

        Raises:
            InfeasibleError: see `conic.solve`.
        """
        every = self.problem(forces, price)
        found, H = None, every.lower if near is None else np.maximum(near, every.lower)
        while True:
            deflections = every.deflections(H)
            worst = int(np.argmax(deflections))
            if deflections[worst] > 1.0 + 1e-8 and worst not in self.deflecting:
                self.deflecting.append(worst)
            elif self.load > 0.0 and not self.buckles and self._capacity(H) < 1.0:
                self.buckles = True
            elif found is not None:
                return replace(found, lower=np.where(every.lower > self.limits.min_height, found.lower, 0.0))
            column = self._column() if self.buckles else None
            found = solve(replace(self.deflecting_only(every), column=column), near)
            H = near = found.heights

    def price(self, H: Array, forces: Forces, found: Optimum) -> Array:
        """Return the price (n + 1,) of each height: its mass, and what its inertia adds.

        Where the inertia saves more than the mass costs, heights would grow without end. They keep
        a small price there.
        """
        stress = self.stress(H, forces, found)
        used = np.unique([*self.deflecting, *stress.governing[stress.slope < 0.0]]).astype(int)
        chosen = used[:, None] == stress.governing
        wN, wV, wM = (np.where(chosen, w, 0.0) for w in stress.forces)
        ones = np.ones((1, H.size))
        per_moment, per_force = (c[0] for c in self._deflections(Forces(ones, ones, ones)))
        for case, z in zip(self.deflecting, found.multipliers.deflections, strict=True):
            at = int(np.searchsorted(used, case))
            wM[at] += z * per_moment / H**3 * np.sign(forces.M[case])
            wV[at] += z * per_force / H * np.sign(forces.V[case])
        price = self.mass_per_height + added_by_height(self.beam, self.cases.at(used), Forces(wN, wV, wM))
        return np.maximum(price, _LEAST_PRICE * self.mass_per_height)

    def governing(self, forces: Forces) -> NDArray[np.intp]:
        """Return the load case (n + 1,) whose stress needs the largest height at each station."""
        worst: NDArray[np.intp] = stress_height(self.beam, forces, self.limits.stress).argmax(axis=0)
        return worst

    def stress(self, H: Array, forces: Forces, found: Optimum) -> StressTerm:
        """Return the stress as a term of the Lagrangian."""
        governing = self.governing(forces)
        N, V, M = (f[governing, np.arange(H.size)] for f in forces)
        s, bent = self.limits.stress * self.beam.width, np.abs(N) * H + 6.0 * np.abs(M)
        falls = 4.0 * s**2 * H**3 - 2.0 * bent * np.abs(N) - 6.0 * V**2 * H
        rate = np.divide(found.lower, falls, out=np.zeros_like(H), where=falls > 0.0)
        squared = bent**2 + 3.0 * V**2 * H**2
        slope = rate * (2.0 * bent * np.abs(N) + 6.0 * V**2 * H - 4.0 * squared / H)
        weights = Forces(rate * 2.0 * bent * H * np.sign(N), rate * 6.0 * V * H**2, rate * 12.0 * bent * np.sign(M))
        return StressTerm(governing, slope, float(rate @ (squared - s**2 * H**4)), weights)

    def step(self, H: Array, found: Optimum, counts: Mask) -> tuple[Array, Optimum]:
        """Move heights and stress multipliers towards a stationary point of the Lagrangian.

        The deflections keep their multipliers. The new heights minimise the Lagrangian at the
        forces and prices of the old ones. Where tapers or buckling decide there is no such minimum,
        and nothing changes.

        Args:
            H: (n + 1,) heights [m].
            found: the optimum that the heights come from.
            counts: (k,) the load cases whose stress may have a multiplier.
        """
        m = found.multipliers
        if m.slope.any():
            return H, found
        forces = internal_forces(self.beam, H, self.cases)
        p = self.deflecting_only(self.problem(forces, self.price(H, forces, found)))
        lower = np.where(counts[self.governing(forces)], lower_multipliers(p, m), 0.0)
        z = m.deflections
        H = separable_least(p.cost, z @ p.bending, z @ p.shear, p.lower, p.upper)
        return H, replace(found, lower=np.where(p.lower > self.limits.min_height, lower, 0.0))

    def _deflections(self, forces: Forces) -> tuple[Array, Array]:
        """C and D (k, n + 1) of sum_i C_i / H_i^3 + D_i / H_i <= 1 for each load case."""
        bending = deflection_coefficients(self.beam, forces.M) / self.limits.deflection
        shear = shear_coefficients(self.beam, forces.V) / self.limits.deflection
        return bending, shear if self.shear else np.zeros_like(shear)

    def _capacity(self, H: Array) -> float:
        return critical_load(self.beam, H, self.pressing) / self.load

    def _column(self) -> Column:
        forms = column_forms(self.beam, self.pressing, self.load)
        waves = (self.beam.slices + 1) / (2.0 * np.pi * len(forms.free))
        return Column(self._capacity, forms, _SMOOTHING * waves**4)
