"""A linkage of unequal links: the loop solved by a root finder, derivatives by differences, loads
by energy."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import fsolve

from boom_model import (
    BaseMotion,
    Boom,
    FixedExtension,
    InfeasibleError,
    InputError,
    LeastExtension,
    LeastTorque,
    NearestHorizontal,
    body_transforms,
    forward_dynamics,
    forward_kinematics,
    inverse_dynamics,
    inverse_kinematics,
    jacobian,
    jacobian_rate,
    kinetic_energy,
    mass_matrix,
    potential_energy,
    solve_branches,
    transmission_angle,
)
from boom_model.boom_file import BOOM_FILE
from boom_model.dynamics.regressor import regressor
from boom_model.kinematics.frames import frame_transforms
from boom_model.kinematics.linkage import directions, length_derivatives, lower_angle
from tests.oracles import generic, mujoco_closed_loop, random_base

BOOM = Boom.load()


def with_links(L3=0.3, L4=1.0, L5=0.3, L9=1.0):
    return replace(BOOM, geometry=replace(BOOM.geometry, L3=L3, L4=L4, upper_less_lower=L5 - L3, inner_less_outer=L9 - L4))


UNEQUAL = with_links(L5=0.304, L9=0.994)


def states(count, seed=18):
    rng = np.random.default_rng(seed)
    q = rng.uniform([0.0, 0.0, 0.0, 0.0, -1.5], [6.2, 1.4, 0.0, 1.0, 1.5], (count, 5))
    q[:, 2] = q[:, 1] + rng.uniform(0.3, 2.6, count)
    return q, rng.normal(size=(count, 5)), rng.normal(size=(count, 5))


def test_the_loop_is_the_one_that_a_root_finder_closes():
    q, _, _ = states(50)
    psi, chi = directions(UNEQUAL, q[:, 1], q[:, 2])
    g = UNEQUAL.geometry

    def e(angle):
        return np.array([np.cos(angle), np.sin(angle)])

    def gap(x, theta2, theta3):
        return g.L3 * e(theta3) + g.L4 * e(x[1]) - g.L9 * e(theta2) - g.L5 * e(x[0])

    for (_, theta2, theta3, *_), upper, outer in zip(q, psi, chi, strict=True):
        found = fsolve(gap, [theta3, theta2], args=(theta2, theta3), xtol=1e-13)
        np.testing.assert_allclose([upper, outer], found, rtol=0, atol=1e-11)
    np.testing.assert_allclose(lower_angle(UNEQUAL, q[:, 1], psi), q[:, 2], rtol=0, atol=3e-14)


def test_both_loops_and_the_closed_form_have_the_same_tip():
    q, _, _ = states(200)
    inner, outer = (frame_transforms(UNEQUAL, q, loop)[:, 10] for loop in ("inner", "outer"))
    tip = forward_kinematics(UNEQUAL, q)
    np.testing.assert_allclose(inner, outer, rtol=0, atol=3e-14)
    np.testing.assert_allclose(inner[:, :3, 3], tip.position, rtol=0, atol=1e-14)
    np.testing.assert_allclose(inner[:, :3, :3], tip.rotation, rtol=0, atol=1e-14)
    poses = body_transforms(UNEQUAL, q)
    pin_7 = poses["outer"][:, :3, 3] + UNEQUAL.geometry.L4 * poses["outer"][:, :3, 0]
    pin_8 = frame_transforms(UNEQUAL, q, "inner")[:, 5, :3, 3]
    np.testing.assert_allclose(np.linalg.norm(pin_7 - pin_8, axis=-1), UNEQUAL.geometry.L5, rtol=1e-13)


def test_the_transmission_angle_is_that_at_pin_7():
    q, _, _ = states(50)
    poses = body_transforms(UNEQUAL, q)
    pin_6, pin_8 = poses["outer"][:, :3, 3], frame_transforms(UNEQUAL, q, "inner")[:, 5, :3, 3]
    pin_7 = pin_6 + UNEQUAL.geometry.L4 * poses["outer"][:, :3, 0]
    area = np.linalg.norm(np.cross(pin_7 - pin_6, pin_7 - pin_8), axis=-1)
    sine = area / (UNEQUAL.geometry.L4 * UNEQUAL.geometry.L5)
    np.testing.assert_allclose(np.sin(transmission_angle(UNEQUAL, q)), sine, rtol=0, atol=3e-14)
    assert np.abs(transmission_angle(UNEQUAL, q) - transmission_angle(BOOM, q)).max() > 0.01


def test_jacobian_and_its_rate_are_derivatives():
    q, qd, _ = states(50)
    h = 1e-5
    by_difference = np.stack(
        [
            (forward_kinematics(UNEQUAL, q + h * e).position - forward_kinematics(UNEQUAL, q - h * e).position) / (2 * h)
            for e in np.eye(5)
        ],
        axis=-1,
    )
    np.testing.assert_allclose(jacobian(UNEQUAL, q)[:, :3], by_difference, rtol=0, atol=2e-9)
    rate = (jacobian(UNEQUAL, q + h * qd) - jacobian(UNEQUAL, q - h * qd)) / (2 * h)
    np.testing.assert_allclose(jacobian_rate(UNEQUAL, q, qd), rate, rtol=0, atol=1e-7)


@pytest.mark.parametrize(("column", "name"), [(0, "L3"), (1, "L4"), (2, "L5"), (3, "L9")])
def test_derivatives_by_the_lengths_are_differences(column, name):
    q, _, _ = states(50)
    lengths = {"L3": 0.3, "L4": 1.0, "L5": 0.304, "L9": 0.994}
    more, less = (with_links(**{**lengths, name: lengths[name] + h}) for h in (1e-6, -1e-6))
    slope = (directions(more, q[:, 1], q[:, 2]).upper - directions(less, q[:, 1], q[:, 2]).upper) / 2e-6
    np.testing.assert_allclose(length_derivatives(UNEQUAL, q)[:, column], slope, rtol=0, atol=5e-8)


def test_loads_are_those_of_mujocos_closed_loop():
    q, qd, qdd = states(40)
    boom = replace(generic(UNEQUAL), drives=UNEQUAL.drives)
    for base in (None, random_base(np.random.default_rng(1), 40)):
        known, found = mujoco_closed_loop(boom, q, qd, qdd, base), inverse_dynamics(boom, q, qd, qdd, base=base)
        np.testing.assert_allclose(found.tau, known.tau, rtol=0, atol=1e-11)
        np.testing.assert_allclose(found.pins.frame_7, known.pin_7, rtol=0, atol=8e-11)
        np.testing.assert_allclose(found.mount, known.mount, rtol=0, atol=8e-12)


def test_a_force_on_the_tip_works_by_the_jacobian():
    q, qd, qdd = states(100)
    push = np.random.default_rng(3).normal(size=(2, 100, 3))
    pushed = inverse_dynamics(UNEQUAL, q, qd, qdd, tip_force=push[0], tip_moment=push[1]).tau
    by_jacobian = (np.concatenate([*push], axis=-1)[:, None] @ jacobian(UNEQUAL, q))[:, 0]
    np.testing.assert_allclose(inverse_dynamics(UNEQUAL, q, qd, qdd).tau - pushed, by_jacobian, rtol=0, atol=9e-13)


def test_equal_links_are_the_limit():
    """Links that differ by less than rounding take the way of unequal ones."""
    q, qd, qdd = states(200)
    boom = generic(BOOM)
    equal = replace(boom, geometry=replace(boom.geometry, upper_less_lower=1e-300))
    assert not equal.geometry.is_parallelogram
    base = random_base(np.random.default_rng(1), 200)
    force, moment = 30.0 * np.random.default_rng(2).normal(size=(2, 200, 3))
    for payload_as in ("mass", "force"):
        given = {"base": base, "payload_as": payload_as, "tip_force": force, "tip_moment": moment}
        known, found = (inverse_dynamics(each, q, qd, qdd, **given) for each in (boom, equal))
        np.testing.assert_allclose(found.tau, known.tau, rtol=0, atol=2e-11)
        np.testing.assert_allclose(found.mount, known.mount, rtol=0, atol=2e-11)
        for pin in ("frame_6", "frame_7", "frame_8"):
            np.testing.assert_allclose(getattr(found.pins, pin), getattr(known.pins, pin), rtol=0, atol=2e-10)
    np.testing.assert_allclose(mass_matrix(equal, q), mass_matrix(boom, q), rtol=0, atol=2e-12)
    np.testing.assert_allclose(regressor(equal, q, qd, qdd), regressor(boom, q, qd, qdd), rtol=0, atol=2e-12)


def test_a_state_alone_has_the_loads_that_it_has_in_a_batch():
    q, qd, qdd = states(20)
    batch = inverse_dynamics(UNEQUAL, q, qd, qdd)
    for i in range(20):
        alone = inverse_dynamics(UNEQUAL, q[i], qd[i], qdd[i])
        np.testing.assert_allclose(alone.tau, batch.tau[i], rtol=0, atol=1e-13)
        np.testing.assert_allclose(alone.mount, batch.mount[i], rtol=0, atol=1e-13)


def test_the_mass_matrix_is_the_torque_of_unit_accelerations():
    q, _, _ = states(50)
    falling = BaseMotion.of(acceleration=(0.0, 0.0, -UNEQUAL.gravity))
    columns = inverse_dynamics(UNEQUAL, q[:, None], np.zeros(5), np.eye(5), base=falling).tau
    np.testing.assert_allclose(mass_matrix(UNEQUAL, q), columns, rtol=0, atol=1.4e-13)


def test_power_is_the_rate_of_energy_and_forward_dynamics_is_the_inverse():
    q, qd, qdd = states(100)
    h = 1e-5

    def energy(t):
        at, rate = q + qd * t + 0.5 * qdd * t**2, qd + qdd * t
        return kinetic_energy(UNEQUAL, at, rate) + potential_energy(UNEQUAL, at)

    loads = inverse_dynamics(UNEQUAL, q, qd, qdd)
    np.testing.assert_allclose((loads.tau * qd).sum(axis=-1), (energy(h) - energy(-h)) / (2 * h), rtol=0, atol=4e-5)
    np.testing.assert_allclose(forward_dynamics(UNEQUAL, q, qd, loads.tau), qdd, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    "constraint", ["actuator=-10", FixedExtension(0.3), LeastExtension(), NearestHorizontal(), LeastTorque()]
)
def test_inverse_kinematics_reaches_its_targets(constraint):
    rng, reached = np.random.default_rng(2), 0
    for _ in range(1 if isinstance(constraint, LeastTorque) else 6):
        target = rng.uniform([0.9, 0.0, 0.3], [2.0, 0.5, 1.2])
        for solution in inverse_kinematics(UNEQUAL, target, -np.pi / 2.0, constraint).solutions:
            tip = forward_kinematics(UNEQUAL, solution.q)
            np.testing.assert_allclose(tip.position, target, rtol=0, atol=1e-12)
            assert np.cos(tip.pitch + np.pi / 2.0) == pytest.approx(1.0, abs=1e-12)
            reached += 1
    assert reached > 0


def test_the_best_member_is_the_best_of_a_dense_grid():
    """Of all ways to reach a target within the limits of the unequal linkage, none has a shorter
    extension."""
    target = np.array([1.6, 0.2, 0.9])
    found = inverse_kinematics(UNEQUAL, target, -np.pi / 2.0, "least-extension")
    best = found.solutions[found.best].q
    others = [solve_branches(UNEQUAL, target, -np.pi / 2.0, FixedExtension(x)) for x in np.linspace(0.0, 1.0, 401)]
    shortest = min(float(each.q[each.within_limits][:, 3].min(initial=np.inf)) for each in others)
    assert best[3] - 1e-9 <= shortest <= best[3] + 1.0 / 400.0


def test_links_that_do_not_reach_each_other_are_named():
    short = with_links(L5=0.297, L9=1.0, L4=0.998)  # L4 + L5 < L3 + L9
    q = np.array([0.0, 0.0, np.pi, 0.0, 0.0])
    with pytest.raises(InfeasibleError, match=r"cannot close at lower - inner = 180 deg: .*L5 0\.297"):
        forward_kinematics(short, q)


@pytest.mark.parametrize("state", [np.array([0.0, 0.0, np.pi, 0.0, 0.0]), np.array([[0.1, 0.2, np.pi + 0.2, 0.0, 0.0]] * 2)])
def test_loads_of_links_that_do_not_reach_each_other_are_refused(state):
    short = with_links(L5=0.297, L9=1.0, L4=0.998)
    with pytest.raises(InfeasibleError, match=r"cannot close at lower - inner = 180 deg: .* do not reach each other"):
        inverse_dynamics(short, state, np.zeros(5), np.zeros(5))
    in_line = with_links(L5=0.25, L9=1.0, L4=1.05)  # L3 + L9 = L4 + L5
    with pytest.raises(InfeasibleError, match=r"at lower - inner = 180 deg: .* in line with the upper one|do not reach"):
        inverse_dynamics(in_line, state, np.zeros(5), np.zeros(5))


def test_a_boom_file_may_have_unequal_links(tmp_path):
    file = tmp_path / "boom.toml"
    text = BOOM_FILE.read_text(encoding="utf-8")
    file.write_text(text.replace("L6_m =", "L5_m = 0.304\nL9_m = 0.994\nL6_m ="), encoding="utf-8")
    g = Boom.load(file).geometry
    assert pytest.approx((0.3, 1.0, 0.304, 0.994), rel=1e-15) == (g.L3, g.L4, g.L5, g.L9)
    with pytest.raises(InputError, match=r"a thing needs a parallelogram; this boom has L5 - L3 = 4 mm and L9 - L4 = -6 mm"):
        g.require_parallelogram("a thing")
    assert BOOM.geometry.is_parallelogram
