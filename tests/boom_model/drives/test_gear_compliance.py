"""Wind-up by hand, and what it does to the tip against forward kinematics, virtual work and an
eigenvalue solver."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.linalg import eigh

from boom_model import (
    Boom,
    forward_kinematics,
    gear_frequencies,
    gravity_torque,
    jacobian,
    mass_matrix,
    tip_deflection,
    wind_up,
)

BOOM = Boom.load()
GEAR = BOOM.drives[1].gearbox
ROUNDING = 1e-14


def random_states(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.uniform(BOOM.limits.lower, BOOM.limits.upper, (count, 5)), rng.normal(0.0, 150.0, (count, 5))


@pytest.mark.parametrize(
    ("torque", "by_hand"),
    [
        (29.0, 29 / 67e3),
        (60.0, 29 / 67e3 + 31 / 110e3),  # 4.328e-4 + 2.818e-4 = 7.15e-4
        (108.0, 29 / 67e3 + 79 / 110e3),
        (155.8, 29 / 67e3 + 79 / 110e3 + 47.8 / 120e3),
    ],
)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_wind_up_by_hand(torque, by_hand, sign):
    assert wind_up(GEAR, sign * torque) == pytest.approx(sign * by_hand, rel=ROUNDING, abs=0)


def test_wind_up_of_60_newton_metres_is_the_printed_one():
    assert wind_up(GEAR, 60.0) == pytest.approx(7.15e-4, abs=5e-7)


def test_wind_up_has_the_printed_slopes_and_no_jumps():
    torque = np.linspace(-300.0, 300.0, 6001)  # 0.1 Nm apart, so that T1 and T2 are on the grid
    slope = np.diff(wind_up(GEAR, torque)) / np.diff(torque)
    size = np.abs(torque[:-1] + torque[1:]) / 2.0
    expected = 1.0 / np.select([size < 29.0, size < 108.0], [67e3, 110e3], 120e3)
    np.testing.assert_allclose(slope, expected, rtol=1e-10)


@pytest.mark.parametrize("name", ["torsion_torques", "torsion_stiffness"])
def test_without_the_printed_curve_there_is_no_wind_up(name):
    assert wind_up(replace(GEAR, **{name: None}), 60.0) is None


def test_wind_up_moves_the_tip_as_forward_kinematics_says():
    """To first order: what is left goes with the square of the angles, some 2e-3 rad,
    times 2.5 m."""
    q, tau = random_states(200, seed=1)
    turned = q.copy()
    for i in (1, 2):
        turned[:, i] -= wind_up(GEAR, tau[:, i])
    moved = forward_kinematics(BOOM, turned).position - forward_kinematics(BOOM, q).position
    budget = tip_deflection(BOOM, q, tau)
    angles = np.abs(turned - q).max()
    assert np.abs(budget.wind_up - moved).max() < 2.5 * angles**2
    assert np.linalg.norm(moved, axis=-1).max() > 100 * 2.5 * angles**2


def test_gravity_pulls_the_tip_down_and_does_work():
    q, _ = random_states(200, seed=2)
    tau = gravity_torque(BOOM, q)
    yields = np.zeros_like(tau)
    for i in (1, 2):
        yields[:, i] = -wind_up(GEAR, tau[:, i])
    assert (np.einsum("ni,ni->n", tau, yields) < 0.0).all()  # the weight sinks
    stretched = np.radians([0.0, 60.0, 180.0, 0.0, 0.0])
    assert tip_deflection(BOOM, stretched, gravity_torque(BOOM, stretched)).wind_up[2] < -1e-3


def test_lost_motion_at_the_tip_is_the_worst_over_its_signs():
    q, tau = random_states(50, seed=3)
    J = jacobian(BOOM, q)[:, :3]
    for name, width in (("backlash", 24e-6), ("hysteresis", 290e-6), ("step", np.radians(0.09) / 160)):
        worst = np.max(
            [np.linalg.norm(width * (a * J[..., 1] + b * J[..., 2]), axis=-1) for a, b in product((1, -1), repeat=2)], axis=0
        )
        np.testing.assert_allclose(getattr(tip_deflection(BOOM, q, tau), name), worst, rtol=1e-12)


def test_the_worst_over_signs_bounds_every_share_of_the_widths():
    """Five joints with lost motion: no errors within the widths move the tip further, by 2,000
    random ones."""
    boom = replace(BOOM, drives=(BOOM.drives[1],) * 5)
    q, tau = random_states(1, seed=4)
    shares = np.random.default_rng(5).uniform(-1.0, 1.0, (2000, 5)) * 290e-6
    moved = np.linalg.norm(shares @ jacobian(boom, q[0])[:3].T, axis=-1)
    worst = float(tip_deflection(boom, q[0], tau[0]).hysteresis)
    assert 0.8 * worst < moved.max() <= worst


def test_total_is_the_sum_of_the_parts_and_names_what_is_left_out():
    q, tau = random_states(3, seed=6)
    budget = tip_deflection(BOOM, q, tau)
    parts = np.linalg.norm(budget.wind_up, axis=-1) + budget.backlash + budget.hysteresis + budget.step
    np.testing.assert_array_equal(budget.total, parts)
    assert budget.uncounted == ("yaw: no drive data", "extension: no drive data", "wrist: no drive data")
    bare = replace(BOOM.drives[1], gearbox=replace(GEAR, backlash=None))
    boom = replace(BOOM, drives=(None, bare, BOOM.drives[2], None, None))
    assert "inner: no backlash is printed" in tip_deflection(boom, q, tau).uncounted


def test_frequencies_are_those_of_the_generalised_eigenproblem():
    q, _ = random_states(20, seed=7)
    M = mass_matrix(BOOM, q)
    found = gear_frequencies(BOOM, M)
    for each, matrix in zip(found, M, strict=True):
        values = eigh(np.diag([67e3, 67e3]), matrix[1:3, 1:3], eigvals_only=True)
        np.testing.assert_allclose(each, np.sqrt(values) / (2 * np.pi), rtol=1e-10)
    alone = np.sqrt(67e3 / np.stack([M[:, 1, 1], M[:, 2, 2]], axis=-1)) / (2 * np.pi)
    assert (found[:, 0] <= alone.min(axis=-1) * (1 + 1e-12)).all()  # coupling lowers the lowest


def test_without_stiffness_there_is_no_frequency():
    assert gear_frequencies(replace(BOOM, drives=(None,) * 5), mass_matrix(BOOM, np.zeros(5))) is None
