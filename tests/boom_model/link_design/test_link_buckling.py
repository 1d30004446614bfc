"""Critical loads of columns against closed forms, and of a tapered one against its differential equation."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from boom_model.link_design import Beam, Material, critical_load, euler_load

STEEL = Material.load("steel")
E, WIDTH, LENGTH = STEEL.elastic_modulus, 0.01, 0.9
REST = np.zeros(2)
CLAMPED_PINNED = brentq(lambda k: np.tan(k) - k, 4.4, 4.6) ** 2


def beam(**options) -> Beam:
    return Beam(LENGTH, WIDTH, STEEL, **({"slices": 400} | options))


@pytest.mark.parametrize(
    ("support", "plane", "factor"),
    [
        ("cantilever", "across", CLAMPED_PINNED),
        ("cantilever", "in-plane", np.pi**2 / 4.0),
        ("pinned", "across", np.pi**2),
        ("pinned", "in-plane", np.pi**2),
    ],
)
@pytest.mark.parametrize("plates", [1, 2])
def test_prisms_have_eulers_load(support, plane, factor, plates):
    H = np.full(401, 0.03)
    inertia = WIDTH * 0.03**3 / 12.0 if plane == "in-plane" else 0.03 * WIDTH * (WIDTH / plates) ** 2 / 12.0
    found = critical_load(beam(support=support, plates=plates), H, REST, plane)
    assert found.load == pytest.approx(factor * E * inertia / LENGTH**2, rel=1e-7)


def test_the_thesis_formula():
    assert euler_load(200e9, 0.02 * 0.01**3 / 12.0, 1.0) == pytest.approx(6714.0, abs=0.05)


def test_a_tapered_column_against_its_differential_equation():
    b = beam(plates=1)
    H = 0.05 - 0.04 * b.stations / LENGTH

    def end(P):
        """Deflection at the pinned end of a column held at its root, under a unit lateral reaction there."""

        def rates(x, y):
            height = 0.05 - 0.04 * x / LENGTH
            return [y[1], ((LENGTH - x) - P * y[0]) / (E * height * WIDTH**3 / 12.0)]

        return solve_ivp(rates, (0.0, LENGTH), [0.0, 0.0], rtol=1e-10, atol=1e-16).y[0, -1]

    prism = CLAMPED_PINNED * E * 0.03 * WIDTH**3 / 12.0 / LENGTH**2
    assert critical_load(b, H, REST).load == pytest.approx(brentq(end, 0.6 * prism, 1.2 * prism), rel=1e-6)


def test_a_column_under_its_own_weight_alone():
    """Greenhill: a cantilever stands while q L^3 < 7.8373 E I."""
    H = np.full(401, 0.02)
    inertia = WIDTH * 0.02**3 / 12.0
    per_metre = 7.837347 * E * inertia / LENGTH**3
    pressing = np.array([per_metre / (STEEL.density * WIDTH * 0.02), 0.0])
    euler = np.pi**2 / 4.0 * E * inertia / LENGTH**2
    assert critical_load(beam(), H, pressing, "in-plane").load == pytest.approx(0.0, abs=6e-7 * euler)


def test_gradient_and_curvature_are_those_of_the_load():
    rng = np.random.default_rng(7)
    b, a = beam(slices=90), np.array([60.0, 5.0])
    H = rng.uniform(0.02, 0.05, 91)
    found = critical_load(b, H, a)
    assert found.gradient @ H == pytest.approx(found.load, rel=1e-9)
    d = rng.normal(size=91) * 2e-4
    more, less = (critical_load(b, H + s * d, a).load for s in (1.0, -1.0))
    assert found.gradient @ d == pytest.approx((more - less) / 2.0, rel=1e-4)
    assert -((found.curvature @ d) ** 2).sum() == pytest.approx(more + less - 2.0 * found.load, rel=1e-3)
    bent = critical_load(b, H, a, "in-plane")
    more, less = (critical_load(b, H + s * d, a, "in-plane").load for s in (1.0, -1.0))
    assert bent.gradient @ d == pytest.approx((more - less) / 2.0, rel=1e-3)


def test_the_gradient_bounds_the_load_of_every_other_column():
    rng = np.random.default_rng(8)
    b, a = beam(slices=60), np.array([9.0, 0.0])
    gradient = critical_load(b, np.full(61, 0.03), a).gradient
    for _ in range(50):
        H = rng.uniform(0.002, 0.08, 61)
        assert critical_load(b, H, a).load <= gradient @ H * (1.0 + 1e-9)
