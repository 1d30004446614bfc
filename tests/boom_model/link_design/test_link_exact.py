"""Least masses against a general solver, the closed form of the optimality conditions, bounds, and
finite elements."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq, minimize
from scipy.sparse import csr_array

from boom_model.errors import InfeasibleError, InputError
from boom_model.link_design import (
    THESIS_LOAD,
    Beam,
    Limits,
    LoadCases,
    Material,
    critical_load,
    deflection,
    internal_forces,
    least_mass,
    mass,
    stress_height,
    stress_only,
    thesis_design,
    von_mises,
)
from boom_model.link_design.buckling import ColumnForms
from boom_model.link_design.conic import solve
from boom_model.link_design.finite_elements import solve_beam, solve_plate
from boom_model.link_design.problem import Column, Problem
from tests.boom_model.link_design.nonlinear_program import least_mass_by_ipopt

STEEL = Material.load("steel")
BEAM = Beam(1.0, 0.01, STEEL)
LIMITS = Limits(stress=175e6, deflection=0.01)
LOAD = THESIS_LOAD.cases


@pytest.fixture(scope="module")
def old():
    return thesis_design(BEAM, THESIS_LOAD, stress_limit=175e6, deflection_limit=0.01)


def random_problem(seed: int) -> Problem:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 200))
    taper = None if seed % 2 else np.full(n - 1, 10.0 ** rng.uniform(-4.0, -2.0))
    C = rng.uniform(0.0, 1.0, (int(rng.integers(1, 4)), n)) * 1e-4 / n
    return Problem(rng.uniform(0.5, 2.0, n), rng.uniform(0.005, 0.02, n), np.full(n, 0.3), taper, C, np.zeros_like(C))


def by_water_filling(problem: Problem):
    """H_i = max(lower_i, (3 z C_i / a_i)^(1/4)), with z such that the one deflection is at its
    limit, by bisection."""
    C = problem.bending[0]
    low, high = 0.0, 1e12

    def heights(z):
        return np.maximum(problem.lower, (3.0 * z * C / problem.cost) ** 0.25)

    for _ in range(300):
        z = (low + high) / 2.0
        low, high = (z, high) if (C / heights(z) ** 3).sum() > 1.0 else (low, z)
    return heights(high)


@pytest.mark.parametrize("seed", range(1, 13, 2))
def test_one_deflection_is_the_closed_form_of_its_optimality_conditions(seed):
    problem = random_problem(seed)
    problem = replace(problem, bending=problem.bending[:1], shear=problem.shear[:1])
    found, expected = solve(problem), by_water_filling(problem)
    assert found.value == pytest.approx(problem.cost @ expected, rel=5e-8)
    np.testing.assert_allclose(found.heights, expected, rtol=1.3e-5)


@pytest.mark.parametrize("seed", range(24))
def test_random_problems_are_feasible_and_near_their_bound(seed):
    p = random_problem(seed)
    found = solve(p)
    assert p.deflections(found.heights).max() <= 1.0 + 1e-6
    assert (found.heights >= p.lower).all()
    if p.taper is not None:
        assert (np.abs(np.diff(found.heights)) <= p.taper * (1.0 + 1e-5)).all()
    assert -1e-12 * found.value <= found.value - found.lower_bound <= 3e-7 * found.value
    assert found.value == pytest.approx(p.cost @ found.heights, rel=1e-7)


def geometric_mean(G):
    """Return sqrt((G_1 . H) (G_2 . H)) >= 1 as a column of one element.

    Its matrix is (G_1 . H, -1; -1, G_2 . H).
    """
    n = G.shape[1]
    bending, axial = np.zeros((10, n)), np.zeros((10, n))
    bending[[2, 9]], axial[7] = G, 1.0 / n
    ends = np.tile([0.0, 0.0, 1.0, 0.0], (1, 2, 1))
    free = np.array([[False, True, False, True]])
    return ColumnForms(csr_array(bending), csr_array(axial), np.zeros(n), np.zeros(n), free, ends, ends)


def test_a_small_problem_with_everything_against_a_general_solver():
    rng = np.random.default_rng(3)
    n = 10
    # A capacity that is concave and of the first degree: a geometric mean of two weighted sums.
    G = rng.uniform(0.5, 1.5, (2, n)) * 2.8

    def capacity(H):
        return float(np.sqrt(np.prod(G @ H)))

    taper = rng.uniform(0.002, 0.01, n - 1)
    p = Problem(rng.uniform(0.5, 2.0, n), rng.uniform(0.005, 0.03, n), np.full(n, 0.2), taper,
                rng.uniform(0.0, 1.0, (2, n)) * 5e-6, np.zeros((2, n)), Column(capacity, geometric_mean(G)))  # fmt: skip
    found = solve(p)
    scale = 0.05
    asked = [
        {"type": "ineq", "fun": lambda y: 1.0 - p.deflections(scale * y)},
        {"type": "ineq", "fun": lambda y: taper / scale - np.diff(y)},
        {"type": "ineq", "fun": lambda y: taper / scale + np.diff(y)},
        {"type": "ineq", "fun": lambda y: capacity(scale * y) - 1.0},
    ]
    bounds = list(zip(p.lower / scale, p.upper / scale, strict=True))
    general = minimize(
        lambda y: p.cost @ y,
        np.full(n, 2.0),
        bounds=bounds,
        constraints=asked,
        method="SLSQP",
        options={"ftol": 1e-13, "maxiter": 500},
    )
    assert general.success
    assert found.value == pytest.approx(scale * general.fun, rel=6e-11)
    np.testing.assert_allclose(found.heights, scale * general.x, rtol=0, atol=2.5e-11)
    assert capacity(found.heights) == pytest.approx(1.0, abs=1e-6)


def test_never_heavier_than_the_thesis_at_equal_constraints(old):
    n = BEAM.slices + 1
    cost = np.full(n, STEEL.density * BEAM.width * BEAM.step)
    problem = Problem(cost, old.stress_heights, np.full(n, 0.5), None, old.coefficients[None] / 0.01, np.zeros((1, n)))
    found = solve(problem)
    assert (old.coefficients / found.heights**3).sum() <= 0.01 * (1.0 + 1e-6)
    theirs = cost @ old.heights
    assert found.value <= theirs
    assert found.value == pytest.approx(theirs, rel=1e-5)  # the greedy search loses some 2 millionths
    assert 0.0 <= found.value - found.lower_bound <= 3e-7 * found.value


@pytest.mark.parametrize("own_mass", [False, True])
def test_with_exact_stress_heights_it_is_lighter_still(old, own_mass):
    found = least_mass(BEAM, LOAD, LIMITS, own_mass=own_mass, shear=False)
    assert found.mass < old.mass
    assert found.stress_mass < old.stress_mass
    assert found.deflection <= 0.01 * (1.0 + 1e-6)


@pytest.mark.parametrize("seed", [1, 3, 5])
def test_shear_joins_the_closed_form(seed):
    """One deflection sum_i C_i / H_i^3 + D_i / H_i: each height by its own root, all at one
    multiplier."""
    rng = np.random.default_rng(seed)
    plain = random_problem(seed)
    p = replace(plain, bending=plain.bending[:1], shear=rng.uniform(0.0, 1.0, (1, plain.cost.size)) * 1e-2 / plain.cost.size)

    def heights(z):
        def slope(H, i):
            return p.cost[i] - z * (3.0 * p.bending[0, i] / H**4 + p.shear[0, i] / H**2)

        low = p.lower
        return [low[i] if slope(low[i], i) > 0.0 else brentq(slope, low[i], 1.0, (i,), xtol=1e-13) for i in range(low.size)]

    z = brentq(lambda z: p.deflections(np.array(heights(z)))[0] - 1.0, 1e-4, 10.0, rtol=1e-13)
    found = solve(p)
    np.testing.assert_allclose(found.multipliers.deflections, z, rtol=5e-7)
    np.testing.assert_allclose(found.heights, heights(z), rtol=1e-6)
    assert found.value - found.lower_bound <= 1e-8 * found.value


def test_own_mass_and_shear_against_a_general_solver():
    beam = Beam(1.0, 0.01, STEEL, slices=14)
    # Ten times the body force, so that the own mass matters: a wrong price of it shows.
    cases = LoadCases.of(LOAD.end_force, 10.0 * LOAD.acceleration)
    limits = replace(LIMITS, min_height=0.004)
    found = least_mass(beam, cases, limits)
    scale = found.heights

    def forces(y):
        return internal_forces(beam, y * scale, cases)

    asked = [
        {"type": "ineq", "fun": lambda y: 1.0 - deflection(beam, y * scale, forces(y), shear=True)[0] / 0.01},
        {"type": "ineq", "fun": lambda y: 1.0 - von_mises(beam, y * scale, forces(y))[0] / 175e6},
    ]
    general = minimize(
        lambda y: mass(beam, y * scale) / 4.0,
        np.full(15, 1.2),
        bounds=[(limits.min_height / s, 4.0) for s in scale],
        constraints=asked,
        method="SLSQP",
        options={"ftol": 1e-13, "maxiter": 500},
    )
    assert general.success
    assert found.mass == pytest.approx(4.0 * general.fun, rel=3e-8)
    assert found.gap is not None
    assert abs(found.gap) < 1e-4
    np.testing.assert_allclose(general.x, 1.0, rtol=0, atol=1.1e-5)


def test_a_whole_link_against_a_nonlinear_program():
    """IPOPT keeps its constraints to 1e-8."""
    value, heights = least_mass_by_ipopt(BEAM, LOAD, LIMITS)
    found = least_mass(BEAM, LOAD, LIMITS)
    assert found.mass == pytest.approx(value, rel=3e-8)
    np.testing.assert_allclose(found.heights, heights, rtol=0, atol=1e-6)
    assert found.gap <= 3e-9


def test_the_bound_is_below_every_feasible_link():
    rng = np.random.default_rng(9)
    beam = Beam(1.0, 0.01, STEEL, slices=80)
    found = least_mass(beam, LOAD, LIMITS)
    assert found.lower_bound is not None
    assert 0.0 <= found.gap < 1e-5
    x = beam.stations
    for _ in range(100):
        H = found.heights * (1.0 + 0.2 * rng.normal() * np.sin(rng.uniform(1.0, 9.0) * x + rng.uniform(0.0, 6.0)))
        forces = internal_forces(beam, H, LOAD)
        H = np.maximum(H, stress_height(beam, forces, 175e6)[0])
        H = H * (deflection(beam, H, internal_forces(beam, H, LOAD), shear=True)[0] / 0.01) ** (1.0 / 3.0) * 1.002
        forces = internal_forces(beam, H, LOAD)
        if deflection(beam, H, forces, shear=True)[0] <= 0.01 and von_mises(beam, H, forces).max() <= 175e6:
            assert mass(beam, H) >= found.lower_bound


@pytest.mark.parametrize("heights", ["heights", "stress_heights"])
def test_finite_elements_find_the_deflection_to_a_thousandth(heights):
    found = least_mass(BEAM, LOAD, LIMITS)
    H = getattr(found, heights)
    forces = internal_forces(BEAM, H, LOAD)
    thin, thick = (solve_beam(BEAM, H, LOAD, 1000, theory).deflection for theory in ("euler-bernoulli", "timoshenko"))
    assert thin == pytest.approx(deflection(BEAM, H, forces)[0], rel=2e-5)
    assert thick == pytest.approx(deflection(BEAM, H, forces, shear=True)[0], rel=2e-5)
    plate = solve_plate(BEAM, H, LOAD, 300, 4)
    assert plate.deflection == pytest.approx(thick, rel=2e-3)
    if heights == "heights":
        assert max(thick, plate.deflection) <= 0.01 * 1.001


def test_finite_elements_find_the_stress_limit_along_the_stress_only_link():
    H = stress_only(BEAM, LOAD, LIMITS)
    assert von_mises(BEAM, H, internal_forces(BEAM, H, LOAD))[0] == pytest.approx(175e6, rel=1e-10)
    found, plate = solve_beam(BEAM, H, LOAD, 1000), solve_plate(BEAM, H, LOAD, 400, 4)
    x = np.linspace(0.1, 0.9, 9)
    np.testing.assert_allclose(np.interp(x, found.x, found.stress), 175e6, rtol=1e-4)
    np.testing.assert_allclose(np.interp(x[:-1], plate.x, plate.stress), 175e6, rtol=0.03)


def test_elements_converge():
    found = least_mass(BEAM, LOAD, LIMITS)
    exact = solve_beam(BEAM, found.heights, LOAD, 1000).deflection
    errors = [abs(solve_beam(BEAM, found.heights, LOAD, n, prismatic=True).deflection / exact - 1.0) for n in (10, 40, 160)]
    assert errors[0] > 6.0 * errors[1] > 36.0 * errors[2]
    assert errors[2] < 5e-4
    plates = [solve_plate(BEAM, found.heights, LOAD, n, 2).deflection for n in (50, 100, 200, 400)]
    steps = np.abs(np.diff(plates))
    assert steps[0] > 1.5 * steps[1] > 2.25 * steps[2]


def test_buckling_is_a_constraint():
    beam = Beam(1.0, 0.01, STEEL, slices=200)
    free = least_mass(beam, LOAD, LIMITS)
    held = least_mass(beam, LOAD, replace(LIMITS, buckling_factor=8.0))
    assert free.buckling_load < 8.0 * 758.1
    assert held.buckling_load == pytest.approx(8.0 * 758.1, rel=8e-8)
    assert held.deflection <= 0.01 * (1.0 + 1e-6)
    assert held.lower_bound is not None
    assert free.mass < held.lower_bound <= held.mass
    assert held.gap < 2e-3
    # No lighter link of the family that scales the free one holds the load.
    scaled = free.heights * (8.0 * 758.1 / critical_load(beam, free.heights, np.array([8.5, 0.0])))
    assert held.mass < mass(beam, scaled)


def test_a_buckling_bound_is_close_and_below_every_link_that_holds_the_load():
    rng = np.random.default_rng(12)
    beam, limits = Beam(1.0, 0.01, STEEL, slices=120), replace(LIMITS, buckling_factor=8.0)
    found = least_mass(beam, LOAD, limits, own_mass=False)
    assert 0.0 <= found.gap <= 1e-6
    forces = internal_forces(beam, stress_only(beam, LOAD, limits), LOAD)
    low = stress_height(beam, forces, 175e6)[0]
    for _ in range(30):
        waves = np.sin(rng.uniform(1.0, 40.0) * beam.stations + rng.uniform(0.0, 6.0))
        H = np.maximum(found.heights * (1.0 + rng.uniform(0.0, 0.1) * waves), low)
        H *= max(1.0, 8.0 * 758.1 / critical_load(beam, H, LOAD.acceleration[0, 0]), deflection(beam, H, forces)[0] / 0.01)
        assert mass(beam, H) >= found.lower_bound


def test_heights_that_buckling_decides_are_smooth():
    """Elements of several slices do not see waves within them: without a cost these are 3 mm high
    here."""
    beam = Beam(1.0, 0.01, STEEL, slices=600)
    found = least_mass(beam, LOAD, replace(LIMITS, buckling_factor=8.0), own_mass=False)
    at = slice(10, 42)  # near the root, where buckling alone decides
    x = beam.stations[at]
    smooth = np.polynomial.Polynomial.fit(x, found.heights[at], 4)(x)
    np.testing.assert_allclose(found.heights[at], smooth, rtol=0, atol=5e-5)
    assert found.gap <= 1e-6


def test_a_strut_is_held_in_both_planes():
    beam = Beam(1.0, 0.01, STEEL, slices=100, support="pinned")
    cases = LoadCases.of([[-400.0, 0.0]], [[[0.0, 0.0], [9.81, 0.0]]])
    found = least_mass(beam, cases, replace(LIMITS, buckling_factor=2.0))
    for plane in ("across", "in-plane"):
        assert critical_load(beam, found.heights, np.zeros(2), plane) >= 800.0 * (1.0 - 1e-5)
    assert found.lower_bound is None


def test_heights_and_taper_are_kept():
    limits = Limits(175e6, 0.01, min_height=0.02, max_height=0.065, max_taper=0.06)
    found = least_mass(BEAM, LOAD, limits)
    assert found.heights.min() >= 0.02
    assert found.heights.max() <= 0.065
    assert np.abs(np.diff(found.heights)).max() <= 0.06 * BEAM.step * (1.0 + 1e-5)
    assert found.mass > least_mass(BEAM, LOAD, LIMITS).mass


def test_a_link_is_found_at_every_taper_and_weighs_less_the_steeper_it_may_be():
    beam, tapers = Beam(1.0, 0.01, STEEL, slices=200), (1e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 2e-2, 3e-2, 6e-2, 0.1)
    for own_mass in (False, True):
        found = [least_mass(beam, LOAD, replace(LIMITS, max_taper=t), own_mass=own_mass) for t in tapers]
        assert all(np.abs(np.diff(f.heights)).max() <= t * beam.step * (1.0 + 1e-5) for f, t in zip(found, tapers, strict=True))
        assert (np.diff([f.mass for f in found]) < 0.0).all()
        assert found[0].heights.max() - found[0].heights.min() < 1.1e-5  # nearly a prism
        assert found[0].deflection == pytest.approx(0.01, rel=1e-7)
        assert found[-1].mass > least_mass(beam, LOAD, LIMITS, own_mass=own_mass).mass


def test_a_poor_bound_is_no_reason_to_say_no():
    """The own load eases the heavier case, which decides; only the lighter one bounds the mass."""
    cases = LoadCases.of([[0.0, -900.0], [0.0, -300.0]], [[[0.0, 0.0], [-9.81, 0.0]], [[0.0, 0.0], [9.81, 0.0]]])
    found = least_mass(Beam(1.0, 0.01, STEEL, slices=200), cases, LIMITS)
    assert found.governing == (0,)
    assert found.deflection == pytest.approx(0.01, rel=4e-8)
    assert found.lower_bound is None
    assert found.gap is None


def test_a_link_much_stiffer_than_its_stress_asks_has_its_bound():
    found = least_mass(Beam(1.0, 0.01, STEEL, slices=200), LOAD, replace(LIMITS, deflection=1e-6), own_mass=False)
    assert found.deflection == pytest.approx(1e-6, rel=1e-11)
    assert found.gap <= 2e-12


def test_the_height_of_the_lightest_prism_leaves_a_lighter_link():
    """56 mm: a prism deflects less than 10 mm there, its own mass and all."""
    prism = np.full(BEAM.slices + 1, 0.056)
    assert deflection(BEAM, prism, internal_forces(BEAM, prism, LOAD))[0] < 0.01
    found = least_mass(BEAM, LOAD, replace(LIMITS, max_height=0.056), shear=False)
    assert found.heights.max() <= 0.056
    assert found.mass < mass(BEAM, prism)
    assert found.deflection == pytest.approx(0.01, rel=1e-5)


def test_many_load_cases_are_held_and_the_idle_ones_cost_nothing():
    rng = np.random.default_rng(11)
    force = np.stack([rng.uniform(-900.0, 400.0, 200), rng.uniform(-250.0, 250.0, 200)], axis=-1)
    cases = LoadCases.of(force, rng.uniform(-9.0, 9.0, (200, 2, 2)))
    beam = Beam(1.0, 0.01, STEEL, slices=100)
    found = least_mass(beam, cases, LIMITS)
    forces = internal_forces(beam, found.heights, cases)
    assert von_mises(beam, found.heights, forces).max() <= 175e6 * (1.0 + 1e-5)
    assert deflection(beam, found.heights, forces, shear=True).max() == pytest.approx(0.01, rel=1e-8)
    alone = least_mass(beam, cases.at(found.governing), LIMITS)
    assert alone.mass <= found.mass * (1.0 + 1e-6)
    twice = LoadCases.of(np.tile(force, (2, 1)), np.tile(cases.acceleration, (2, 1, 1)))
    assert least_mass(beam, twice, LIMITS).mass == pytest.approx(found.mass, rel=1e-6)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"deflection": 0.0}, InputError, "deflection limit is 0; it must be above 0"),
        ({"stress": -1.0}, InputError, "stress limit is -1"),
        ({"stress": float("inf")}, InputError, "stress limit is inf; it must be a finite number"),
        ({"min_height": 0.05, "max_height": 0.04}, InputError, "minimum height 0.05 m is not below the maximum of 0.04 m"),
        ({"min_height": -0.01}, InputError, "minimum height is -0.01 m"),
        ({"max_height": 0.05}, InfeasibleError, "the stress needs 0.05.* m of height, above the maximum of 0.05 m"),
        (
            {"max_height": 0.056},
            InfeasibleError,
            "at the maximum height of 0.056 m the deflection is still 1.* times",
        ),
        ({"max_height": 0.07, "buckling_factor": 20.0}, InfeasibleError, "holds 0.* of the buckling load"),
    ],
)
def test_what_no_link_can_keep_is_refused_with_the_reason(change, error, message):
    with pytest.raises(error, match=message):
        least_mass(Beam(1.0, 0.01, STEEL, slices=200), LOAD, Limits(**({"stress": 175e6, "deflection": 0.01} | change)))


def test_a_link_that_cannot_carry_itself_is_refused():
    with pytest.raises(InfeasibleError):
        least_mass(Beam(1.0, 0.01, STEEL, slices=50), LoadCases.of([[0.0, -10.0]], [[[0.0, 0.0], [9e6, 0.0]]]), LIMITS)
    with pytest.raises(InfeasibleError, match="nothing loads the link"):
        stress_only(BEAM, LoadCases.of([[0.0, 0.0]], np.zeros((1, 2, 2))), LIMITS)
