"""The nonlinear simulation: against MuJoCo, exact tracking, convergence, and what drives and
disturbances do to it."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from boom_model import (
    BaseMotion,
    Boom,
    Catalogue,
    Friction,
    InputError,
    forward_kinematics,
    gravity_torque,
    inverse_dynamics,
    jacobian,
    up_on_slope,
)
from boom_model.drives.drive import reflected_inertia
from planner import plan
from planner.control import Case, Command, Controller, Figures, Goals, Gust, Plant, Shaper, impulses, parse_gust, simulate
from planner.control.closed_loop import LONGEST_STEP
from planner.control.simulation import simulate as simulate_freely
from planner.motion.vehicle import load_case
from planner.timing.profile import SHORTEST
from planner.timing.timing import Profile
from tests.builders import main_move, plant_energy, with_drives, with_running_torque
from tests.oracles import mujoco_model, tree_matrix

BOOM = Boom.load()
GOAL = BOOM.pose("phenotyping")
EXACT = Figures.of({"encoder_counts": 0.0, "joint_counts": 0.0, "extension_count_mm": 0.0})
STRAIGHT = impulses(Shaper.NONE, 5.0, 0.02)


@pytest.fixture(scope="module")
def moves():
    return {profile: main_move(profile) for profile in SHORTEST}


def case(plant, controller, move, goals=None):
    return Case.of(plant, controller, Goals() if goals is None else goals, Command.of(move, STRAIGHT))


class Tree:
    """The boom in MuJoCo, held at its mount, with the drives' inertia and viscous friction put to
    its joints."""

    def __init__(self, boom, viscous=0.0):
        self.model, self.G = mujoco_model(boom), tree_matrix(boom)
        self.data, self.product = mujoco.MjData(self.model), np.zeros(self.model.nv)
        self.directions = np.concatenate([np.zeros((6, 5)), self.G]).T
        self.rotor = np.diag([0.0 if d is None else reflected_inertia(d) for d in boom.drives])
        self.viscous = viscous

    def accelerations(self, q, qd, tau):
        self.data.qpos[7:], self.data.qvel[6:] = self.G @ q, self.G @ qd
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_fwdVelocity(self.model, self.data)
        M = self.rotor.copy()
        for column, direction in zip(M.T, self.directions, strict=True):
            mujoco.mj_mulM(self.model, self.data, self.product, direction)
            column += self.directions @ self.product
        return np.linalg.solve(M, tau - self.viscous * qd - self.G.T @ self.data.qfrc_bias[6:])


def test_the_rigid_boom_under_given_torques_moves_as_in_mujoco_for_5_s():
    """Open loop: the boom hangs and is swung, with friction, so that an error does not grow of
    itself."""
    viscous = np.array([20.0, 30.0, 20.0, 30.0, 0.3])
    boom = replace(BOOM, friction=Friction(viscous, np.zeros(5), (None,) * 5))
    tree, t = Tree(boom, viscous), np.linspace(0.0, 5.0, 51)
    start = np.concatenate([[0.2, -1.2, 1.4, 0.3, 0.3], np.zeros(5)])
    size, speed = np.array([10.0, 40.0, 30.0, 15.0, 1.0]), np.array([2.0, 3.1, 2.3, 4.0, 5.0])
    hold = np.array([0.0, 0.0, 0.0, gravity_torque(boom, start[:5])[3], 0.0])

    def torque(t, q, qd):
        return hold + size * np.sin(speed * t)

    ours = simulate_freely(boom, start[:5], start[5:], torque, t, friction=True, drive_inertia=True, rtol=1e-9, atol=1e-10)

    def rate(t, x):
        return np.concatenate([x[5:], tree.accelerations(x[:5], x[5:], torque(t, x[:5], x[5:]))])

    theirs = solve_ivp(rate, (0.0, 5.0), start, method="DOP853", t_eval=t, rtol=1e-11, atol=1e-12).y.T
    assert np.ptp(ours.q, axis=0).min() > 0.1
    np.testing.assert_allclose(ours.q, theirs[:, :5], rtol=0, atol=2e-9)
    np.testing.assert_allclose(ours.qd, theirs[:, 5:], rtol=0, atol=6e-8)


def test_the_sampled_loop_of_the_rigid_boom_runs_as_in_mujoco_for_5_s(moves):
    plant = Plant.of(BOOM, EXACT, elastic=False)
    loop = case(plant, Controller.PID, moves[Profile.CUBIC])
    run = simulate(plant, [loop], 5.0)
    tree, gains, T, h = Tree(BOOM), loop.gains[0], 1e-3, 5e-4
    q_r, qd_r, _ = loop.command(run.t)
    gravity = gravity_torque(BOOM, q_r)
    keep = np.exp(-2.0 * np.pi * 100.0 * T)
    x, v, total, before = np.concatenate([q_r[0], np.zeros(5)]), np.zeros(5), np.zeros(5), q_r[0]
    path, torques = np.empty((len(run.t), 10)), np.empty((len(run.t), 5))

    def rate(x, u):
        return np.concatenate([x[5:], tree.accelerations(x[:5], x[5:], u)])

    for k in range(len(run.t)):
        v = keep * v + (1.0 - keep) * (x[:5] - before) / T
        before = x[:5]
        u = gravity[k] + gains.Kp @ (q_r[k] - before) + gains.Kd @ (qd_r[k] - v) + total
        total = total + T * gains.Ki @ (q_r[k] - before)
        path[k], torques[k] = x, u
        for _ in range(2):
            k1 = rate(x, u)
            k2 = rate(x + 0.5 * h * k1, u)
            k3 = rate(x + 0.5 * h * k2, u)
            x = x + h / 6.0 * (k1 + 2.0 * (k2 + k3) + rate(x + h * k3, u))
    assert (np.abs(run.torque) < run.limit).all()
    np.testing.assert_allclose(run.q[:, 0], path[:, :5], rtol=0, atol=4e-12)
    np.testing.assert_allclose(run.qd[:, 0], path[:, 5:], rtol=0, atol=1e-8)
    np.testing.assert_allclose(run.torque[:, 0], torques, rtol=0, atol=2e-8)


def test_computed_torque_with_a_perfect_model_tracks_every_profile_exactly(moves):
    plant = Plant.of(BOOM, Figures.of({"rate_Hz": 500.0}), elastic=False)
    cases = [case(plant, Controller.COMPUTED_TORQUE, move) for move in moves.values()]
    run = simulate(plant, cases, 2.5, continuous=True, substeps=1)
    for b, move in enumerate(moves.values()):
        error = np.abs(run.q[:, b] - run.command[:, b]).max()
        smooth = move.profile in (Profile.QUINTIC, Profile.JERK_LIMITED)
        assert error < (2e-9 if smooth else 1e-5), move.profile  # a jump of the acceleration falls within a step


def test_sampling_costs_tracking_in_proportion(moves):
    errors = []
    for rate in (250.0, 500.0, 1000.0):
        figures = Figures.of({**{n: getattr(EXACT, n) for n in EXACT.given}, "rate_Hz": rate, "velocity_filter_Hz": 0.2 * rate})
        plant = Plant.of(BOOM, figures, elastic=False)
        run = simulate(plant, [case(plant, Controller.COMPUTED_TORQUE, moves[Profile.JERK_LIMITED])], 1.0)
        errors.append(np.abs(run.q - run.command).max())
    assert 1.7 < errors[0] / errors[1] < 2.3
    assert 1.7 < errors[1] / errors[2] < 2.3


def test_the_longest_step_is_short_enough(moves):
    plant = Plant.of(BOOM, reference=GOAL)
    cases = [case(plant, c, moves[Profile.TIME_OPTIMAL]) for c in (Controller.PID, Controller.STEPPER)]
    tips = [forward_kinematics(BOOM, simulate(plant, cases, 0.4, substeps=n).q).position for n in (1, 4)]
    assert plant.figures.sampling_period == LONGEST_STEP
    assert np.abs(tips[0] - tips[1]).max() < 2e-5


def test_cases_do_not_touch_each_other(moves):
    plant = Plant.of(BOOM, reference=GOAL)
    cases = [case(plant, c, moves[Profile.CUBIC]) for c in Controller]
    together = simulate(plant, cases, 0.1)
    for b, one in enumerate(cases):
        alone = simulate(plant, [one], 0.1)
        np.testing.assert_allclose(together.q[:, b], alone.q[:, 0], rtol=0, atol=6e-18)
        np.testing.assert_allclose(together.torque[:, b], alone.torque[:, 0], rtol=0, atol=1e-13)


def test_pd_is_passive(moves):
    """At a standing command, kinetic and elastic energy, weight and the controller's spring
    together only fall."""
    plant = Plant.of(BOOM, EXACT, reference=GOAL)
    still = plan(BOOM, "phenotyping", "phenotyping")
    loop = case(plant, Controller.PD, still)
    run = simulate(plant, [loop], 1.5, gust=Gust((0.0, 60.0, -60.0), 0.0, 0.5), continuous=True)
    after = run.t > 0.5
    E = [1, 2]
    motor_d = np.gradient(run.motor[:, 0], run.t, axis=0)
    x = np.concatenate([run.q[:, 0], run.qd[:, 0], run.motor[:, 0][:, E], motor_d[:, E]], axis=1)
    off = run.command[:, 0] - run.motor[:, 0]
    given = np.sum(gravity_torque(BOOM, GOAL) * run.motor[:, 0], axis=-1)  # the constant feedforward's potential
    total = (plant_energy(plant, x) - given + 0.5 * np.einsum("ki,ij,kj->k", off, loop.gains[0].Kp, off))[after]
    assert total[0] - total[-1] > 0.01
    assert (np.diff(total) < 2e-5).all()


def test_a_slow_push_bends_the_boom_by_its_stiffness():
    """At the gust's slow top the tip gives way by J K^-1 J^T F: the controllers' springs and the
    gearboxes' in series."""
    light = Figures.of({**{n: getattr(EXACT, n) for n in EXACT.given}, "friction_share": 0.0})
    plant = Plant.of(BOOM, light, reference=GOAL)
    loop = case(plant, Controller.PD, plan(BOOM, "phenotyping", "phenotyping"), Goals.of(bandwidth_Hz=10.0))
    force = np.array([4.0, 8.0, -3.0])
    run = simulate(plant, [loop], 1.3, gust=Gust(tuple(force), 0.3, 2.0))
    moved = run.q[-1, 0] - run.q[300, 0]
    from planner.control.plant import gravity_stiffness, tangent_at_rest

    soft = np.linalg.inv(loop.gains[0].Kp) + np.diag([0.0, *(1.0 / tangent_at_rest(plant, GOAL)), 0.0, 0.0])
    stiffness = np.linalg.inv(soft) + gravity_stiffness(BOOM, GOAL)
    expected = np.linalg.solve(stiffness, jacobian(BOOM, GOAL)[:3].T @ force)
    np.testing.assert_allclose(moved, expected, rtol=0.0, atol=4e-3 * np.abs(expected).max())


def test_on_a_slope_the_controllers_know_their_weight():
    plant = Plant.of(BOOM, EXACT, reference=GOAL)
    still = plan(BOOM, "phenotyping", "phenotyping")
    loop = case(plant, Controller.PD, still)
    run = simulate(plant, [loop], 0.5, vehicle=load_case("slope"))
    slope = load_case("slope")
    weight = gravity_torque(BOOM, GOAL, base=BaseMotion.of(up=up_on_slope(slope.roll, slope.pitch)))
    assert abs(weight[0]) > 5.0  # the yaw holds weight there
    np.testing.assert_allclose(run.torque[:, 0, 0], weight[0], rtol=0, atol=3e-3 * abs(weight[0]))
    assert np.abs(run.motor - run.command).max() < 1e-3  # the boom sags, and the wrist's weight with it


def test_a_bump_shakes_the_boom_and_passes():
    plant = Plant.of(BOOM, reference=GOAL)
    loop = case(plant, Controller.PID, plan(BOOM, "phenotyping", "phenotyping"))
    run = simulate(plant, [loop], 1.5, vehicle=replace(load_case("shock"), shock_start=0.05))
    tip = forward_kinematics(BOOM, run.q[:, 0]).position
    off = np.linalg.norm(tip - tip[0], axis=-1)
    assert off.max() > 2e-3
    assert off[-1] < 0.1 * off.max()


def test_encoders_tell_no_more_than_their_counts(moves):
    plant = Plant.of(BOOM, Figures.of({"encoder_counts": 50.0}), reference=GOAL)
    coarse = simulate(plant, [case(plant, Controller.PID, moves[Profile.CUBIC])], 0.4)
    fine_plant = Plant.of(BOOM, EXACT, reference=GOAL)
    fine = simulate(fine_plant, [case(fine_plant, Controller.PID, moves[Profile.CUBIC])], 0.4)
    ripple = [np.abs(np.diff(run.torque[:, 0, 1])).max() for run in (coarse, fine)]
    assert ripple[0] > 20.0 * ripple[1]
    assert np.abs(coarse.q - fine.q).max() < 5.0 * 2.0 * np.pi / (50.0 * 160.0)


def test_what_a_motor_has_not_it_does_not_give(moves):
    weak = with_running_torque(BOOM, 1.7)
    plant = Plant.of(BOOM, EXACT, reference=GOAL).with_boom(weak)
    loop = case(plant, Controller.PID, moves[Profile.CUBIC])
    run = simulate(plant, [loop], 0.6)
    over = np.abs(run.torque[:, 0, 1]) > run.limit[:, 0, 1]
    assert over.any()
    error = np.abs(run.q[:, 0, 1] - run.command[:, 0, 1]).max()
    free = simulate(Plant.of(BOOM, EXACT, reference=GOAL), [loop], 0.6)
    assert error > 2.0 * np.abs(free.q[:, 0, 1] - free.command[:, 0, 1]).max()


def test_a_stepper_loses_steps_where_its_pull_is_beaten(moves):
    plant = Plant.of(BOOM, reference=GOAL)
    held = case(plant, Controller.STEPPER, plan(BOOM, "phenotyping", "phenotyping"))
    for running, loses in ((2.0, False), (1.0, True)):  # 200 Nm at joint 3 are 1.25 Nm at its motor
        run = simulate(plant.with_boom(with_running_torque(BOOM, running)), [held], 0.5)
        assert np.isfinite(run.lost[0, 2]) == loses
        assert np.isnan(run.lost[0, [0, 3, 4]]).all()


def test_a_stepper_at_rest_lags_by_its_load():
    plant = Plant.of(BOOM, Figures.of({"friction_share": 0.0, "microsteps": 1e6}), reference=GOAL)
    run = simulate(plant, [case(plant, Controller.STEPPER, plan(BOOM, "phenotyping", "phenotyping"))], 0.2)
    load = run.spring[-1, 0]
    lag = (run.command - run.motor)[-1, 0, [1, 2]]
    np.testing.assert_allclose(lag, np.arcsin(load / (160.0 * 7.2)) / (50.0 * 160.0), rtol=1e-3)


def test_gains_that_are_too_high_end_the_case_and_no_other(moves):
    plant = Plant.of(BOOM, reference=GOAL)
    move = moves[Profile.CUBIC]
    wild = case(plant, Controller.COMPUTED_TORQUE, move, Goals.of(bandwidth_Hz=60.0))
    run = simulate(plant, [wild, case(plant, Controller.PID, move)], 1.0)
    assert np.isfinite(run.ended[0])
    assert np.isnan(run.ended[1])
    assert np.isfinite(run.q).all()
    assert np.abs(run.q[:, 1] - run.command[:, 1]).max() < 0.02


def test_sag_is_taken_back_by_the_motors():
    plant = Plant.of(BOOM, reference=GOAL)
    still = [case(plant, Controller.PID, plan(BOOM, "phenotyping", "phenotyping"))]
    off = [
        np.linalg.norm(forward_kinematics(BOOM, run.q[-1, 0]).position - forward_kinematics(BOOM, GOAL).position)
        for run in (simulate(plant, still, 0.3, compensate_sag=c) for c in (False, True))
    ]
    assert off[0] > 8e-3
    assert off[1] < 0.02 * off[0]


def test_the_shaped_command_is_the_move_and_its_echo(moves):
    move = moves[Profile.CUBIC]
    shaped = Command.of(move, impulses(Shaper.ZV, 5.0, 0.02))
    t = np.linspace(-0.1, shaped.duration + 0.1, 400)
    plain = Command.of(move, STRAIGHT)
    late = shaped.impulses.times[1]
    for whole, now, then in zip(shaped(t), plain(t), plain(t - late), strict=True):
        a = shaped.impulses.amplitudes
        np.testing.assert_allclose(whole, a[0] * now + a[1] * then, rtol=0, atol=1e-13)
    np.testing.assert_allclose(shaped.duration - plain.duration, 0.1 / np.sqrt(1.0 - 0.02**2), rtol=2e-14)
    q, qd, qdd = shaped(np.array([-1.0, shaped.duration, 100.0]))
    np.testing.assert_array_equal(q[1:], [GOAL, GOAL])
    assert not qd.any()
    assert not qdd.any()


def test_a_command_with_stops_goes_through_them():
    move = plan(BOOM, "transport", "phenotyping", via=[np.array([0.3, 0.5, 1.5, 0.2, 0.1])])
    command = Command.of(move, STRAIGHT)
    trajectory = move.trajectory
    q, qd, _ = command(trajectory.t)
    np.testing.assert_allclose(q, trajectory.q, rtol=0, atol=5e-15)
    np.testing.assert_allclose(qd, trajectory.qd, rtol=0, atol=5e-15)


def test_the_feedforward_of_a_move_is_its_inverse_dynamics(moves):
    """lqr on the rigid boom hardly needs its gains."""
    plant = Plant.of(BOOM, EXACT, elastic=False)
    run = simulate(plant, [case(plant, Controller.LQR, moves[Profile.JERK_LIMITED])], 1.5)
    assert np.abs(run.q - run.command).max() < 2e-3
    q, qd, qdd = Command.of(moves[Profile.JERK_LIMITED], STRAIGHT)(run.t)
    expected = inverse_dynamics(BOOM, q, qd, qdd, reactions=False, drive_inertia=True).tau
    np.testing.assert_allclose(run.torque[:, 0], expected, rtol=0, atol=2e-3 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("text", "message"),
    [("1,2,3", "is not FX,FY,FZ,START,DURATION"), ("a,0,0,0,1", "is not FX"), ("1,0,0,0,0", "must be above 0 s")],
)
def test_bad_gusts_are_named(text, message):
    with pytest.raises(InputError, match=message):
        parse_gust(text)


def test_nothing_to_simulate_is_said_so():
    plant = Plant.of(BOOM, elastic=False)
    with pytest.raises(InputError, match="nothing to simulate"):
        simulate(plant, [], 1.0)
    with pytest.raises(InputError, match="no joint is elastic"):
        simulate(plant, [case(plant, Controller.STEPPER, plan(BOOM, "phenotyping", "phenotyping"))], 1.0)


def test_a_servo_motor_is_not_simulated_as_a_stepper():
    servo = Catalogue.load().motors["SGM7J-04A"]
    boom = with_drives(BOOM, motor=servo, wiring=None, bus_voltage=None)
    plant, rest = Plant.of(boom), plan(BOOM, "phenotyping", "phenotyping")
    with pytest.raises(InputError, match="inner: SGM7J-04A is a servo motor; it cannot be simulated as a stepper"):
        simulate(plant, [case(plant, Controller.STEPPER, rest)], 1.0)
    run = simulate(plant, [case(plant, Controller.PID, rest)], 0.1)
    assert np.isfinite(run.q).all()
