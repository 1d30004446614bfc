"""Critical loads of columns against closed forms, and of a tapered one against its differential
equation."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import null_space
from scipy.optimize import brentq

from boom_model.link_design import Beam, Material, critical_load, euler_load
from boom_model.link_design.buckling import column_forms

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
    assert found == pytest.approx(factor * E * inertia / LENGTH**2, rel=1e-7)


def test_the_thesis_formula():
    assert euler_load(200e9, 0.02 * 0.01**3 / 12.0, 1.0) == pytest.approx(6714.0, abs=0.05)


def test_a_tapered_column_against_its_differential_equation():
    b = beam(plates=1)
    H = 0.05 - 0.04 * b.stations / LENGTH

    def end(P):
        """Deflection at the pinned end of a column held at its root, under a unit lateral reaction
        there."""

        def rates(x, y):
            height = 0.05 - 0.04 * x / LENGTH
            return [y[1], ((LENGTH - x) - P * y[0]) / (E * height * WIDTH**3 / 12.0)]

        return solve_ivp(rates, (0.0, LENGTH), [0.0, 0.0], rtol=1e-10, atol=1e-16).y[0, -1]

    prism = CLAMPED_PINNED * E * 0.03 * WIDTH**3 / 12.0 / LENGTH**2
    assert critical_load(b, H, REST) == pytest.approx(brentq(end, 0.6 * prism, 1.2 * prism), rel=1e-6)


def test_a_column_under_its_own_weight_alone():
    """Greenhill: a cantilever stands while q L^3 < 7.8373 E I."""
    H = np.full(401, 0.02)
    inertia = WIDTH * 0.02**3 / 12.0
    per_metre = 7.837347 * E * inertia / LENGTH**3
    pressing = np.array([per_metre / (STEEL.density * WIDTH * 0.02), 0.0])
    euler = np.pi**2 / 4.0 * E * inertia / LENGTH**2
    assert critical_load(beam(), H, pressing, "in-plane") == pytest.approx(0.0, abs=6e-7 * euler)


@pytest.mark.parametrize("support", ["cantilever", "pinned"])
@pytest.mark.parametrize("slices", [7, 90])
def test_element_matrices_lose_their_definiteness_at_the_critical_load(support, slices):
    b, a = beam(slices=slices, support=support), np.array([600.0, -150.0])
    H = np.random.default_rng(7).uniform(0.02, 0.05, slices + 1)
    load = critical_load(b, H, a)
    assert load < 0.9 * critical_load(b, H, REST)  # its own body force counts
    for end_load, sign in ((load * (1.0 - 1e-6), 1.0), (load * (1.0 + 1e-6), -1.0)):
        least = np.linalg.eigvalsh(assembled(column_forms(b, a, end_load), H)).min()
        assert sign * least > 0.0


def assembled(forms, H):
    """The column's matrix over the slopes of its joints and its elements' mean slopes, which add up
    to no deflection."""
    elements = len(forms.free)
    beyond = np.append(np.cumsum((forms.pressing * H)[::-1])[::-1][1:], 0.0)
    axial = 1.0 + beyond + forms.outboard * forms.pressing * H
    packed = (forms.bending @ H - forms.axial @ axial).reshape(elements, 10)
    column, row = np.tril_indices(4)
    whole = np.zeros((2 * elements + 1,) * 2)
    for e, values in enumerate(packed):
        own = np.zeros((4, 4))
        own[row, column] = own[column, row] = values
        assert not own[0].any()  # a deflection alone stores nothing
        whole[2 * e : 2 * e + 3, 2 * e : 2 * e + 3] += own[1:, 1:]
    free = np.ones(2 * elements + 1, dtype=bool)
    free[0] = forms.free[0, 1]
    lengths = np.zeros(2 * elements + 1)
    lengths[1::2] = forms.far[:, 0, 2]
    flat = null_space(lengths[None, free])
    return flat.T @ whole[np.ix_(free, free)] @ flat


def test_the_critical_load_is_concave_and_of_the_first_degree():
    rng = np.random.default_rng(8)
    b, a = beam(slices=60), np.array([9.0, 0.0])
    for _ in range(20):
        one, other = rng.uniform(0.002, 0.08, (2, 61))
        loads = critical_load(b, one, a), critical_load(b, other, a)
        assert critical_load(b, one + other, a) >= sum(loads) * (1.0 - 1e-9)
        assert critical_load(b, 3.0 * one, a) == pytest.approx(3.0 * loads[0], rel=1e-9)
