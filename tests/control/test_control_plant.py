"""Elastic joints, bending links and friction: closed forms, energy, finite elements,
differences."""

from dataclasses import replace

import numpy as np
import pinocchio
import pytest

from boom_model import (
    Boom,
    Friction,
    InputError,
    gravity_torque,
    inverse_dynamics,
    kinetic_energy,
    mass_matrix,
)
from boom_model.drives.drive import motor_torque
from planner.control import Figures, Plant, linearise, natural_frequencies, parse_figures
from planner.control.plant import (
    accelerations,
    compliance,
    equilibrium,
    friction,
    spring_energy,
    spring_torque,
    tangent_at_rest,
    tangent_stiffness,
    torque_limits,
    twist_under,
)
from tests.beam_frame import frequencies
from tests.builders import plant_energy
from tests.oracles import derivative, pinocchio_model, random_states, tree_matrix

BOOM = Boom.load()
GOAL = BOOM.pose("phenotyping")
POSES = {
    "phenotyping": GOAL,
    "transport": BOOM.pose("transport"),
    "half out": np.array([0.0, np.radians(60.0), np.pi, 0.5, 0.0]),
    "low": np.array([0.0, np.radians(30.0), np.radians(120.0), 1.0, 0.0]),
    "high": np.array([0.0, np.radians(90.0), np.radians(150.0), 0.3, np.radians(30.0)]),
}
SMOOTH = Figures.of({"friction_share": 0.0, "structural_damping": 0.0})


def test_the_gearbox_twists_as_its_sheet_says():
    stiff = Plant.of(BOOM, bending=False)
    expected = [29.0 / 67e3, 29.0 / 67e3 + 31.0 / 110e3, 29.0 / 67e3 + 79.0 / 110e3 + 50.0 / 120e3]
    for torque, twist in zip((29.0, 60.0, 158.0), expected, strict=True):
        np.testing.assert_allclose(twist_under(stiff, GOAL, np.full(2, torque)), twist, rtol=1e-13)
    np.testing.assert_allclose(expected[1], 7.15e-4, rtol=1e-3)


@pytest.mark.parametrize("backlash", [False, True])
def test_spring_twist_energy_and_tangent_belong_together(backlash):
    plant, rng = Plant.of(BOOM, backlash=backlash), np.random.default_rng(1)
    q = random_states(BOOM, 200, rng)[0]
    torque = rng.uniform(-250.0, 250.0, (200, 2))
    twist = twist_under(plant, q, torque)
    np.testing.assert_allclose(spring_torque(plant, q, twist), torque, rtol=0, atol=5e-13)
    direction = rng.normal(size=(200, 2))
    work = derivative(lambda s: spring_energy(plant, q, twist + s * direction), h=1e-9)
    np.testing.assert_allclose(work, np.sum(torque * direction, axis=-1), rtol=0, atol=2.5e-6)
    slope = derivative(lambda s: spring_torque(plant, q, twist + s), h=1e-9)
    np.testing.assert_allclose(slope, tangent_stiffness(plant, q, torque), rtol=1e-8)


def test_backlash_leaves_a_gap_without_torque():
    plant = Plant.of(BOOM, backlash=True)
    gap = 0.024e-3
    assert (spring_torque(plant, GOAL, np.array([0.49, -0.49]) * gap) == 0.0).all()
    assert (np.abs(spring_torque(plant, GOAL, np.array([0.51, -0.51]) * gap)) > 0.0).all()


def test_bending_is_that_of_a_cantilever():
    plant = Plant.of(BOOM)
    figures = plant.figures
    np.testing.assert_allclose(figures.inner_bending, 200e9 * 0.010 * 0.139**3 / 12.0, rtol=5e-15)
    np.testing.assert_allclose(figures.extension_bending, 69e9 * (0.040**4 - 0.031**4) / 12.0, rtol=5e-15)
    moment = 100.0
    rho, free = BOOM.geometry.L7 + 1.0, 1.05
    C, C_4 = compliance(plant, GOAL)
    across = moment / rho * free**3 / (3.0 * figures.extension_bending)  # a force at the wrist with that moment at pin 8
    np.testing.assert_allclose(C * moment, [moment * 1.0 / (3.0 * figures.inner_bending), across / rho], rtol=5e-15)
    step = np.array([0.0, 0.0, 0.0, 1.0, 0.0])
    np.testing.assert_allclose(derivative(lambda s: compliance(plant, GOAL + s * step)[0]), C_4, rtol=1e-12, atol=0)
    assert (compliance(Plant.of(BOOM, bending=False), GOAL)[0] == 0.0).all()


def test_equilibrium_holds_the_weight():
    plant, theta = Plant.of(BOOM), np.stack(list(POSES.values()))
    q = equilibrium(plant, theta)
    load = spring_torque(plant, q, (theta - q)[:, [1, 2]])
    np.testing.assert_allclose(load, gravity_torque(BOOM, q)[:, [1, 2]], rtol=0, atol=5e-11)
    u = gravity_torque(BOOM, q)
    u[:, 3] -= 0.5 * (load**2 * compliance(plant, q)[1]).sum(axis=-1)  # the bent extension pushes on its own slide
    qdd, thetadd = accelerations(plant, q, np.zeros((5, 5)), theta[:, [1, 2]], np.zeros((5, 2)), u)
    np.testing.assert_allclose(thetadd, 0.0, atol=5e-12)
    np.testing.assert_allclose(qdd, 0.0, atol=2e-10)


def fall(plant):
    """Half a second without torques, in steps of 1 ms by the classical Runge-Kutta method."""
    x = np.concatenate([GOAL, [0.3, -0.2, 0.1, 0.1, 0.2], GOAL[[1, 2]] + 1e-3, [0.1, -0.1]])[None]
    path, h = [x], 1e-3

    def rate(x):
        parts = accelerations(plant, x[:, :5], x[:, 5:10], x[:, 10:12], x[:, 12:], np.zeros((1, 5)))
        return np.concatenate([x[:, 5:10], parts[0], x[:, 12:], parts[1]], axis=1)

    for _ in range(500):
        k1 = rate(x)
        k2 = rate(x + 0.5 * h * k1)
        k3 = rate(x + 0.5 * h * k2)
        x = x + h / 6.0 * (k1 + 2.0 * (k2 + k3) + rate(x + h * k3))
        path.append(x)
    return np.concatenate(path)


def test_an_elastic_boom_without_friction_keeps_its_energy():
    plant = Plant.of(BOOM, SMOOTH)
    path = fall(plant)
    total = plant_energy(plant, path)
    moved = kinetic_energy(BOOM, path[:, :5], path[:, 5:10])
    assert np.ptp(moved) > 50.0
    assert np.ptp(spring_energy(plant, path[:, :5], (path[:, 10:12] - path[:, [1, 2]]))) > 0.3
    assert np.ptp(total) < 1e-5 * np.ptp(moved)  # 3e-6: the integrator's, at the springs' kinks


def test_damping_and_friction_only_take_energy():
    rough = replace(BOOM, friction=Friction(np.full(5, 3.0), np.full(5, 2.0), (None,) * 5))
    for plant in (Plant.of(BOOM), Plant.of(rough, SMOOTH)):
        total = plant_energy(plant, fall(plant))
        assert (np.diff(total) < 0.0).all()
        assert total[0] - total[-1] > 1.0


def test_friction_is_what_the_drive_checks_count_while_driving():
    plant, rng = Plant.of(BOOM), np.random.default_rng(2)
    load, speed, accel = rng.uniform(10.0, 200.0, (50, 2)), rng.uniform(0.3, 0.8, (50, 2)), rng.uniform(-1.0, 1.0, (50, 2))
    drive = BOOM.drives[1]
    motor = load + friction(plant, speed, load) + plant.rotor[1] * accel
    np.testing.assert_allclose(motor, drive.gearbox.ratio * motor_torque(drive, load, speed, accel), rtol=1e-14)
    braking = friction(plant, -speed, load)
    np.testing.assert_allclose(braking, -160.0 * 0.42, rtol=1e-14)
    assert (friction(plant, speed * 0.0, load) == 0.0).all()


def test_torque_limits_are_the_motors_curve_and_unknown_without_a_drive():
    speed = np.zeros((3, 5))
    limits = torque_limits(Plant.of(BOOM), speed)
    np.testing.assert_allclose(limits[:, [1, 2]], 160.0 * 7.2, rtol=1e-12)
    assert np.isinf(limits[:, [0, 3, 4]]).all()
    fast = torque_limits(Plant.of(BOOM), speed + np.radians(45.0))
    assert (fast[:, [1, 2]] < 0.7 * 160.0 * 7.2).all()


# Natural frequencies


def test_the_hand_estimate_at_full_reach():
    """About 6 Hz: sqrt(K1 / J) / 2 pi of joint 3 alone, and the two joints together."""
    rigid = Plant.of(BOOM, bending=False)
    alone = np.sqrt(67e3 / mass_matrix(BOOM, GOAL)[2, 2]) / (2.0 * np.pi)
    np.testing.assert_allclose(alone, 6.728, atol=1e-3)
    both = natural_frequencies(rigid, GOAL, rigid.stiffness[:, 0])
    np.testing.assert_allclose(both, [6.303, 10.712], atol=1e-3)


@pytest.mark.parametrize("pose", POSES)
def test_rigid_links_on_gearboxes_swing_as_finite_elements_do(pose):
    q, floating = POSES[pose], replace(BOOM, gravity=0.0)
    stiffness = tangent_at_rest(Plant.of(BOOM, bending=False), q)
    ours = natural_frequencies(Plant.of(floating, bending=False), q, stiffness)
    hardly = 3e7 * ((q[3] + 0.05) / 1.05) ** 3  # as stiff at every length, for the sake of the matrix's condition
    np.testing.assert_allclose(ours, frequencies(BOOM, q, stiffness, 3e7, hardly, 0.05), rtol=2e-3)


@pytest.mark.parametrize("pose", POSES)
def test_bending_links_swing_as_finite_elements_do(pose):
    """One spring a link, with the mass where the rigid link has it, against 24 beam elements:
    within 3 % and 1.5 %."""
    q, plant = POSES[pose], Plant.of(BOOM)
    gears = tangent_at_rest(replace(plant, bends=False), q)
    ours = natural_frequencies(plant.with_boom(replace(BOOM, gravity=0.0)), q, tangent_at_rest(plant, q))
    beams = frequencies(BOOM, q, gears, plant.figures.inner_bending, plant.figures.extension_bending, 0.05)
    np.testing.assert_allclose(ours[0], beams[0], rtol=0.03)
    np.testing.assert_allclose(ours[1], beams[1], rtol=0.015)
    if pose == "phenotyping":
        np.testing.assert_allclose([ours[0], beams[0]], [5.478, 5.640], atol=1e-3)


def test_gravity_hardly_changes_the_frequencies():
    plant = Plant.of(BOOM)
    K = tangent_at_rest(plant, GOAL)
    with_weight, without = (natural_frequencies(plant.with_boom(b), GOAL, K) for b in (BOOM, replace(BOOM, gravity=0.0)))
    np.testing.assert_allclose(with_weight, without, rtol=1e-3)


def test_the_lowest_mode_has_the_structural_damping_at_the_reference():
    plant = Plant.of(BOOM, Figures.of({"structural_damping": 0.03}), reference=GOAL)
    E, M = [1, 2], mass_matrix(BOOM, GOAL)
    forces = (M @ linearise(plant, GOAL).A[5:10])[np.ix_(E, [1, 2, 6, 7])]  # motors and all other joints held
    A = np.vstack([np.eye(2, 4, 2), np.linalg.solve(M[np.ix_(E, E)], forces)])
    poles = np.linalg.eigvals(A)
    lowest = poles[np.abs(poles).argmin()]
    np.testing.assert_allclose(np.abs(lowest) / (2.0 * np.pi), natural_frequencies(plant, GOAL)[0], rtol=3e-9)
    np.testing.assert_allclose(-lowest.real / np.abs(lowest), 0.03, rtol=1e-3)


# Linearisation


def along_a_move(count, seed):
    q, qd, qdd = random_states(BOOM, count, np.random.default_rng(seed))
    return q, 0.5 * qd, 0.5 * qdd


def test_the_rigid_linearisation_equals_pinocchios_analytic_derivatives():
    plant, model, G = Plant.of(BOOM, elastic=False), pinocchio_model(BOOM), tree_matrix(BOOM)
    data, place = model.createData(), pinocchio.neutral(model)
    for q, qd, qdd in zip(*along_a_move(20, 3), strict=True):
        place[7:] = G @ q
        rate, accel = (np.concatenate([np.zeros(6), G @ x]) for x in (qd, qdd))
        by_q, by_qd, _ = pinocchio.computeRNEADerivatives(model, data, place, rate, accel)
        M = mass_matrix(BOOM, q, drive_inertia=True)
        expected = -np.linalg.solve(M, np.hstack([G.T @ np.asarray(d)[6:, 6:] @ G for d in (by_q, by_qd)]))
        linear = linearise(plant, q, qd, qdd)
        np.testing.assert_allclose(linear.A[5:], expected, rtol=0, atol=1e-12 * np.abs(expected).max())
        np.testing.assert_allclose(linear.B[5:] @ M, np.eye(5), rtol=0, atol=2e-13)


def test_the_elastic_linearisation_equals_differences_of_the_nonlinear_plant():
    plant = Plant.of(replace(BOOM, friction=Friction(np.full(5, 4.0), np.zeros(5), (None,) * 5)), SMOOTH)
    plant = replace(plant, damping=np.array([120.0, 50.0]))
    for q, qd, qdd in zip(*along_a_move(10, 4), strict=True):
        u = inverse_dynamics(plant.boom, q, qd, qdd, reactions=False, friction=True).tau.copy()
        load = u[[1, 2]]
        u[3] -= 0.5 * (load**2 * compliance(plant, q)[1]).sum()
        state = np.concatenate([q, qd, q[[1, 2]] + twist_under(plant, q, load), qd[[1, 2]]])

        def rate(x, u, plant=plant):
            qdd, thetadd = accelerations(plant, x[:, :5], x[:, 5:10], x[:, 10:12], x[:, 12:], u)
            return np.concatenate([x[:, 5:10], qdd, x[:, 12:], thetadd], axis=1)

        np.testing.assert_allclose(rate(state[None], u[None])[0, 5:10], qdd, rtol=0, atol=1e-9)  # it is that state
        linear, h = linearise(plant, q, qd, qdd), 1e-6
        moved, pushed = h * np.eye(14), h * 1e3 * np.eye(5)
        held, still = np.broadcast_to(u, (14, 5)), np.broadcast_to(state, (5, 14))
        A = (rate(state + moved, held) - rate(state - moved, held)).T / (2.0 * h)
        B = (rate(still, u + pushed) - rate(still, u - pushed)).T / (2e3 * h)
        scale = np.abs(A).max(axis=1, keepdims=True)
        assert (np.abs(linear.A - A) < 2e-9 * scale).all()
        np.testing.assert_allclose(linear.B, B, rtol=0, atol=5e-12 * np.abs(B).max())


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"rate_Hz": 1e9}, "rate_Hz is 1e\\+09; it must be from 50 to 20000"),
        ({"damping": 0.1}, "unknown figure 'damping'; the figures are: rate_Hz, encoder_counts"),
        ({"rate_Hz": 0.0}, "rate_Hz is 0; it must be above 0"),
        ({"structural_damping": -0.1}, "structural_damping is -0.1; it must be at least 0"),
        ({"microsteps": np.nan}, "microsteps is nan"),
        ({"extension_wall_mm": 30.0}, "at most half of extension_side_mm"),
    ],
)
def test_bad_figures_are_named(values, message):
    with pytest.raises(InputError, match=message):
        Figures.of(values)


def test_figures_are_assumed_until_given():
    figures = parse_figures(["structural_damping=0.01", "rate_Hz=500"])
    assert (figures.structural_damping, figures.rate_Hz) == (0.01, 500.0)
    assert not any(line.startswith(("structural_damping", "rate_Hz")) for line in figures.assumptions)
    assert any(line.startswith("encoder_counts 4000: ") for line in figures.assumptions)
    with pytest.raises(InputError, match="'rate_Hz' is not NAME=VALUE"):
        parse_figures(["rate_Hz"])


def test_a_rigid_plant_says_what_it_leaves_out():
    rigid = Plant.of(BOOM, elastic=False)
    assert rigid.elastic == ()
    assert "inner, lower: the gearbox is simulated as rigid" in rigid.limits[1]
    assert "yaw, extension, wrist: no drive is given" in rigid.limits[0]
    with pytest.raises(InputError, match="no natural frequencies"):
        natural_frequencies(rigid, GOAL)
