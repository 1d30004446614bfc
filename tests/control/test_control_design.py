"""Controllers' poles and margins, against closed forms and against loops driven to their limit."""

from dataclasses import replace

import control
import numpy as np
import pytest

from boom_model import Boom, InputError, gravity_torque, inverse_dynamics, mass_matrix
from planner.control import Controller, Figures, Gains, Goals, Plant, analyse, design, linearise

BOOM = Boom.load()
GOAL = BOOM.pose("phenotyping")
PLANT = Plant.of(BOOM, reference=GOAL)
SERVOS = [c for c in Controller if c is not Controller.STEPPER]
GOALS = Goals.of(bandwidth_Hz=3.0, damping=0.8, integral=0.4)
W = 2.0 * np.pi * 3.0


def rigid_poles(boom, gains):
    """Of the rigid boom under continuous feedback, integral action included."""
    linear = linearise(Plant.of(boom, elastic=False), gains.at)
    Kp, Kd, Ki = gains.Kp, gains.Kd, gains.Ki
    if gains.controller is Controller.COMPUTED_TORQUE:
        M = mass_matrix(boom, gains.at, drive_inertia=True)
        h = 1e-5
        dg = np.stack(
            [(gravity_torque(boom, gains.at + h * e) - gravity_torque(boom, gains.at - h * e)) for e in np.eye(5)], -1
        )
        Kp, Kd = M @ Kp - dg / (2.0 * h), M @ Kd
    A = np.block(
        [
            [linear.A - linear.B @ np.hstack([Kp, Kd]), -linear.B @ Ki],
            [np.eye(5, 10), np.zeros((5, 5))],
        ]
    )
    poles = np.linalg.eigvals(A)
    return poles[np.abs(poles) > 1e-6] if not Ki.any() else poles


def by_imaginary_part(poles, expected, rtol):
    np.testing.assert_allclose(poles[np.argsort(poles.imag)], np.repeat(expected, 5), rtol=rtol)


def test_computed_torque_gives_every_joint_the_stated_poles():
    gains = design(PLANT, Controller.COMPUTED_TORQUE, GOALS, GOAL)
    by_imaginary_part(rigid_poles(BOOM, gains), W * np.array([-0.8 - 0.6j, -0.8 + 0.6j]), 3e-10)


def test_lqr_gives_coupled_joints_the_stated_poles_without_gravity():
    floating = replace(BOOM, gravity=0.0)
    gains = design(Plant.of(floating, reference=GOAL), Controller.LQR, GOALS, GOAL)
    by_imaginary_part(rigid_poles(floating, gains), W * np.array([-0.8 - 0.6j, -0.4, -0.8 + 0.6j]), 1e-12)


def test_lqr_minimises_the_stated_integral_over_torques():
    """python-control solves the problem of the docstring with torques as inputs; `design` states it
    in accelerations."""
    gains = design(PLANT, Controller.LQR, GOALS, GOAL)
    linear, M = linearise(Plant.of(BOOM, elastic=False), GOAL), mass_matrix(BOOM, GOAL, drive_inertia=True)
    a, zeta = 0.4, 0.8
    weights = (1.0 + a**2 * (4.0 * zeta**2 - 2.0)) * W**4, (a**2 + 4.0 * zeta**2 - 2.0) * W**2, a**2 * W**6
    system = control.ss(linear.A, linear.B, np.eye(10), 0.0)
    inverse = np.linalg.inv(M)
    R = inverse.T @ inverse  # (M M^T)^-1, symmetric to the last bit
    K, _, _ = control.lqr(system, np.diag(np.repeat(weights, 5)), R, integral_action=np.eye(5, 10))
    ours = np.hstack([gains.Kp, gains.Kd, gains.Ki])
    np.testing.assert_allclose(ours, K, rtol=0, atol=1e-10 * np.abs(K).max())


def test_pid_and_pd_are_the_stated_polynomials_of_each_joint_alone():
    J = np.diag(mass_matrix(BOOM, GOAL, drive_inertia=True))
    for controller, roots in ((Controller.PD, [-0.8 + 0.6j, -0.8 - 0.6j]), (Controller.PID, [-0.8 + 0.6j, -0.8 - 0.6j, -0.4])):
        gains = design(PLANT, controller, GOALS, GOAL)
        for i in range(5):
            coefficients = [1.0, gains.Kd[i, i] / J[i], gains.Kp[i, i] / J[i], gains.Ki[i, i] / J[i]][: len(roots) + 1]
            np.testing.assert_allclose(coefficients, np.poly(np.array(roots) * W).real, rtol=1e-12)
        assert all(np.array_equal(np.diag(np.diag(K)), K) for K in (gains.Kp, gains.Kd, gains.Ki))


def scaled(gains, i, factor):
    """The gains with joint i's torque multiplied."""
    D = np.eye(5)
    D[i, i] = factor
    return Gains(gains.controller, D @ gains.Kp, D @ gains.Kd, D @ gains.Ki, gains.at)


@pytest.mark.parametrize("controller", [Controller.PD, Controller.PID, Controller.LQR])
def test_a_loop_at_its_gain_margin_is_on_the_verge(controller):
    gains = design(PLANT, controller, Goals(), GOAL)
    loop = analyse(PLANT, gains, GOAL)
    assert loop.stable
    found = 0
    for margin in loop.margins:
        for decibels in (margin.gain_dB, margin.less_gain_dB):
            if decibels is None:
                continue
            verge = [
                analyse(PLANT, scaled(gains, margin.joint, 10.0 ** (share * decibels / 20.0)), GOAL, responses=False).largest
                for share in (0.98, 1.02)
            ]
            assert verge[0] < 1.0 < verge[1], (margin, verge)
            found += 1
    assert found >= 5


def in_python_control(gains):
    """The sampled plant and the law from p to -u, as the module's docstring states it."""
    T, f = PLANT.figures.sampling_period, PLANT.figures.velocity_filter_Hz
    linear = linearise(PLANT, GOAL)
    plant = control.sample_system(control.ss(linear.A, linear.B, linear.measured, 0.0), T, method="zoh")
    a, z = np.exp(-2.0 * np.pi * f * T), control.tf([1.0, 0.0], [1.0], T)
    v, total = (1.0 - a) / T * (z - 1.0) / (z - a), T / (z - 1.0)

    def law(x):
        """C(x) (5, 5) at a point x of the z-plane."""
        return gains.Kp + gains.Kd * v(x) + gains.Ki * total(x)

    return plant, law


@pytest.mark.parametrize("controller", [Controller.PD, Controller.PID, Controller.LQR])
def test_margins_and_responses_equal_python_control(controller):
    gains = design(PLANT, controller, Goals(), GOAL)
    loop = analyse(PLANT, gains, GOAL)
    plant, law = in_python_control(gains)
    x = np.exp(2j * np.pi * loop.frequencies * PLANT.figures.sampling_period)
    L = np.stack([law(at) @ plant(at) for at in x[::100]])
    for margin in loop.margins:
        i, o = margin.joint, [j for j in range(5) if j != margin.joint]
        alone = np.array([m[i, i] - m[i, o] @ np.linalg.solve(np.eye(4) + m[np.ix_(o, o)], m[o, i]) for m in L])
        np.testing.assert_allclose(loop.response[::100, i], alone, rtol=1e-9)
        theirs = control.FRD(loop.response[:, i], 2.0 * np.pi * loop.frequencies, smooth=True)
        gain, phase, _, _, crossing, _ = control.stability_margins(theirs, returnall=True)
        nearest = np.abs(phase).argmin()
        np.testing.assert_allclose(margin.phase_deg, phase[nearest], rtol=2e-8)
        np.testing.assert_allclose(margin.crossover_Hz, crossing[nearest] / (2.0 * np.pi), rtol=5e-9)
        for mine, decibels in ((margin.gain_dB, 1.0), (margin.less_gain_dB, -1.0)):
            found = 20.0 * np.log10(gain)
            found = found[found * decibels > 0.0]
            assert (mine is None) == (found.size == 0)
            if mine is not None:
                np.testing.assert_allclose(mine, found[np.abs(found).argmin()], rtol=1e-10)


def test_a_phase_margin_is_the_loops_distance_from_minus_one():
    loop = analyse(PLANT, design(PLANT, Controller.PID, Goals(), GOAL), GOAL)
    for margin in loop.margins:
        L = loop.response[:, margin.joint]
        at = np.abs(loop.frequencies - margin.crossover_Hz).argmin()
        np.testing.assert_allclose(np.abs(L[at]), 1.0, atol=0.02)
        angle = np.degrees(np.angle(-L[at]))
        np.testing.assert_allclose(angle, margin.phase_deg, atol=0.5)
        assert margin.sensitivity_peak >= 1.0 / np.abs(1.0 + L[at]) - 1e-9


def test_sampling_without_delay_gives_the_continuous_poles():
    """At 20 kHz and without a filter to speak of, the sampled loop of the rigid boom has computed
    torque's own poles."""
    quick = Figures.of({"rate_Hz": 20000.0, "velocity_filter_Hz": 5000.0})
    plant = Plant.of(BOOM, quick, elastic=False)
    poles = analyse(plant, design(plant, Controller.COMPUTED_TORQUE, GOALS, GOAL), GOAL, responses=False).poles[:10]
    np.testing.assert_allclose(np.abs(poles), W, rtol=8e-3)
    np.testing.assert_allclose(-poles.real / np.abs(poles), 0.8, rtol=0.015)


def test_gains_that_are_too_high_are_unstable():
    loop = analyse(PLANT, design(PLANT, Controller.PID, Goals.of(bandwidth_Hz=40.0), GOAL), GOAL, responses=False)
    assert not loop.stable
    assert loop.poles.real.max() > 0.0


def test_a_model_that_is_wrong_by_its_payload_moves_the_poles():
    heavy = PLANT.with_boom(BOOM.with_payload(14.0))
    gains = design(PLANT, Controller.COMPUTED_TORQUE, Goals(), GOAL)
    right, wrong = (analyse(heavy, gains, GOAL, model=m, responses=False).poles for m in (heavy, PLANT))
    assert np.abs(right - wrong).max() > 0.1


def test_linearised_forces_are_those_of_the_loop():
    """dg/dq in A: the rigid plant falls from rest, a little off its pose, as gravity says."""
    plant = Plant.of(BOOM, elastic=False)
    linear, dq = linearise(plant, GOAL), 1e-6 * np.array([1.0, -2.0, 1.5, 0.5, 3.0])
    M = mass_matrix(BOOM, GOAL, drive_inertia=True)
    push = [inverse_dynamics(BOOM, GOAL + s * dq, np.zeros(5), np.zeros(5), reactions=False).tau for s in (1.0, -1.0)]
    np.testing.assert_allclose(linear.A[5:, :5] @ dq, -np.linalg.solve(M, (push[0] - push[1]) / 2.0), rtol=1e-9)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Goals.of(bandwidth_Hz=0.0), "bandwidth_Hz is 0; it must be above 0"),
        (lambda: Goals.of(damping=np.nan), "damping is nan"),
        (lambda: design(PLANT, Controller.LQR, Goals.of(damping=0.3), GOAL), "lqr needs at least 0.691"),
        (lambda: analyse(PLANT, design(PLANT, Controller.STEPPER, GOALS, GOAL), GOAL), "no closed-loop poles and no margins"),
        (lambda: linearise(PLANT, np.zeros((2, 5))), r"has shape \(2, 5\); it must be \(5,\)"),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(InputError, match=message):
        call()
