"""Internal forces, stress and deflection of a link against closed forms of beams."""

import numpy as np
import pytest

from boom_model.errors import InputError
from boom_model.link_design import Beam, LoadCases, Material, deflection, internal_forces, mass, stress_height, von_mises
from boom_model.link_design.beam import Forces, added_by_height

STEEL = Material.load("steel")
E, G, RHO = STEEL.elastic_modulus, STEEL.shear_modulus, STEEL.density
LENGTH, WIDTH, HEIGHT = 1.2, 0.008, 0.05
AREA, INERTIA = WIDTH * HEIGHT, WIDTH * HEIGHT**3 / 12.0


def beam(slices: int = 200, **options) -> Beam:
    return Beam(LENGTH, WIDTH, STEEL, slices=slices, **options)


def cases(force=(0.0, 0.0), moment=0.0, a=((0.0, 0.0), (0.0, 0.0)), clamp=0.0) -> LoadCases:
    return LoadCases.of([force], [a], [moment], [clamp])


def uniform(b: Beam):
    return np.full(b.slices + 1, HEIGHT)


def test_end_load_and_own_body_force_of_a_prism():
    b, ax, bx, ay, by = beam(), 9.0, -0.4, 7.0, 1.5
    forces = internal_forces(b, uniform(b), cases((-700.0, -300.0), 20.0, ((ax, bx), (ay, by))))
    x, q = b.stations, RHO * AREA
    far, s = LENGTH - x, LENGTH**2 - x**2
    np.testing.assert_allclose(forces.N[0], -700.0 - q * (ax * far + bx * s / 2.0), rtol=2e-15)
    np.testing.assert_allclose(forces.V[0], -300.0 - q * (ay * far + by * s / 2.0), rtol=2e-15)
    bending = ay * far**2 / 2.0 + by * ((LENGTH**3 - x**3) / 3.0 - x * s / 2.0)
    np.testing.assert_allclose(forces.M[0], 20.0 - 300.0 * far - q * bending, atol=2e-4)
    assert mass(b, uniform(b)) == pytest.approx(RHO * AREA * LENGTH, rel=1e-14)


def test_a_strut_between_pins_bends_under_its_own_weight_alone():
    b = beam(support="pinned")
    load = cases((500.0, -80.0), a=((0.0, 0.0), (9.81, 0.0)))
    forces = internal_forces(b, uniform(b), load)
    q = RHO * AREA * 9.81
    np.testing.assert_allclose(forces.M[0, [0, -1]], 0.0, atol=1e-12)
    assert abs(forces.M[0, b.slices // 2]) == pytest.approx(q * LENGTH**2 / 8.0, rel=6e-15)
    assert deflection(b, uniform(b), forces)[0] == pytest.approx(5.0 * q * LENGTH**4 / (384.0 * E * INERTIA), rel=1e-4)
    assert deflection(b, uniform(b), forces, shear=True)[0] == pytest.approx(
        5.0 * q * LENGTH**4 / (384.0 * E * INERTIA) + 1.2 * q * LENGTH**2 / (8.0 * G * AREA), rel=1e-4
    )


def test_deflection_of_a_prism_converges_to_the_closed_form():
    exact = 300.0 * LENGTH**3 / (3.0 * E * INERTIA)
    errors = []
    for slices in (50, 100, 200):
        b = beam(slices)
        forces = internal_forces(b, uniform(b), cases((0.0, -300.0)))
        errors.append(deflection(b, uniform(b), forces)[0] / exact - 1.0)
        by_shear = deflection(b, uniform(b), forces, shear=True)[0] - deflection(b, uniform(b), forces)[0]
        assert by_shear == pytest.approx(1.2 * 300.0 * LENGTH / (G * AREA), rel=1e-12)
    assert errors[2] == pytest.approx(0.5 / 200**2, rel=2e-11)
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=2e-11)


def test_stress_is_that_of_the_section_and_its_height_the_inverse():
    rng = np.random.default_rng(5)
    b = beam(60)
    forces = Forces(*(rng.normal(size=(4, 61)) * size for size in (2e3, 1e3, 500.0)))
    H = rng.uniform(0.01, 0.1, 61)
    stress = von_mises(b, H, forces)
    i = (2, 17)
    normal = abs(forces.N[i]) / (WIDTH * H[17]) + abs(forces.M[i]) * H[17] / 2.0 / (WIDTH * H[17] ** 3 / 12.0)
    assert stress[i] == pytest.approx(np.sqrt(normal**2 + 3.0 * (forces.V[i] / (WIDTH * H[17])) ** 2), rel=1e-14)
    needed = stress_height(b, forces, 1.2e8)
    for k in range(4):
        np.testing.assert_allclose(von_mises(b, needed[k], Forces(*(f[k : k + 1] for f in forces)))[0], 1.2e8, rtol=1e-12)


@pytest.mark.parametrize("support", ["cantilever", "pinned"])
def test_what_a_height_adds_is_the_gradient_of_the_forces(support):
    rng = np.random.default_rng(6)
    b = beam(12, support=support)
    load = LoadCases.of(rng.normal(size=(3, 2)), rng.normal(size=(3, 2, 2)), rng.normal(size=3), [0.0, 0.35, 0.0])
    H = rng.uniform(0.02, 0.06, 13)
    weights = Forces(*rng.normal(size=(3, 3, 13)))

    def value(heights):
        return sum(float((w * f).sum()) for w, f in zip(weights, internal_forces(b, heights, load), strict=True))

    steps = 1e-3 * np.eye(13)
    numeric = [(value(H + step) - value(H - step)) / 2e-3 for step in steps]
    np.testing.assert_allclose(added_by_height(b, load, weights), numeric, rtol=0, atol=9e-11)


def test_nothing_is_borne_inboard_of_a_telescope_mouth():
    b = beam(100)
    forces = internal_forces(b, uniform(b), cases((-10.0, -300.0), clamp=0.4))
    held = b.stations < 0.4 - 1e-9
    assert all((f[0, held] == 0.0).all() and (f[0, ~held] != 0.0)[:-1].all() for f in forces)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"slices": 1}, "slices is 1; it must be a whole number of at least 2"),
        ({"slices": 10**6}, "slices is 1000000; it must be at most 100000"),
        ({"plates": 0}, "plates is 0"),
        ({"width": 0.0}, "width is 0 m; it must be above 0 m"),
        ({"length": float("nan")}, "length is nan; it must be a finite number"),
    ],
)
def test_impossible_beams_are_refused(change, message):
    with pytest.raises(InputError, match=message):
        Beam(**({"length": 1.0, "width": 0.01, "material": STEEL} | change))


def test_loads_that_are_not_finite_or_do_not_fit_are_refused():
    with pytest.raises(InputError, match=r"end force\[0, 1\] is nan"):
        LoadCases.of([[0.0, float("nan")]], np.zeros((1, 2, 2)))
    with pytest.raises(InputError, match=r"acceleration has shape \(2, 2, 2\); with 1 load cases it must be"):
        LoadCases.of([[0.0, 1.0]], np.zeros((2, 2, 2)))
    with pytest.raises(InputError, match="heights have shape"):
        internal_forces(beam(10), np.ones(10), cases())
    with pytest.raises(InputError, match="unknown material 'wood'; there are: aluminium, cfrp, steel"):
        Material.load("wood")
