"""Each profile against closed forms, against the limits on a fine grid, and in degenerate cases."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from boom_model import Boom, InfeasibleError, inverse_dynamics
from boom_model.arrays import Array
from boom_model.drives.drive import reflected_inertia
from boom_model.drives.limits import motor_limits
from planner import Cubic, Move, TimeOptimal, plan
from planner.motion.trajectory import sample
from planner.paths.path import JointLine
from planner.timing.path_limits import InfeasiblePathError
from planner.timing.profile import SHORTEST, Profile
from planner.timing.timing import Timing
from tests.builders import motion_along, without_drives
from tests.limits import random_pairs

BOOM = Boom.load()
LIMITS = BOOM.limits
BARE = without_drives(BOOM)
SLACK = 1.001
VIA = np.array([0.7, 0.5, 2.0, 0.4, -0.2])


def worst_ratios(move):
    """Largest |demand| / limit of velocity, acceleration and drive torque, recomputed at half a
    millisecond."""
    boom, fine = move.boom, sample(move.motions[0], 0.0005)
    tau = inverse_dynamics(boom, fine.q, fine.qd, fine.qdd, reactions=False).tau
    for i, drive in enumerate(boom.drives):
        if drive is not None:
            tau[:, i] += drive.gearbox.efficiency * reflected_inertia(drive) * fine.qdd[:, i]
    return {
        "velocity": np.abs(fine.qd / boom.limits.velocity).max(),
        "acceleration": np.abs(fine.qdd / boom.limits.acceleration).max(),
        "torque": np.abs(tau / motor_limits(boom, fine.qd)).max(),
    }


@cache
def random_moves(profile: Profile) -> list[tuple[Array, Move]]:
    """(2, 5) start and goal, and the move between them."""
    return [(pair, plan(BOOM, *pair, profile=profile)) for pair in random_pairs(BOOM, 40, 20)]


def straight(boom, start, goal, profile, **options):
    """The motion alone, without the checks of a whole plan."""
    return motion_along(boom, JointLine(start, goal), Timing.of(profile, **options))


def single_joint_move(joint: int, distance: float = 0.5):
    start = np.array([1.0, 0.5, 1.5, 0.3, 0.1])
    goal = start.copy()
    goal[joint] += distance
    return start, goal


@pytest.mark.parametrize("joint", range(5))
def test_cubic_duration_is_the_closed_form(joint):
    start, goal = single_joint_move(joint)
    move = plan(BARE, start, goal)
    expected = max(1.5 * 0.5 / LIMITS.velocity[joint], np.sqrt(6.0 * 0.5 / LIMITS.acceleration[joint]))
    assert move.report.duration == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("joint", range(5))
def test_time_optimal_duration_is_the_trapezoid_without_torque_limits(joint):
    start, goal = single_joint_move(joint)
    move = plan(BARE, start, goal, profile="time-optimal")
    v, a = LIMITS.velocity[joint], LIMITS.acceleration[joint]
    expected = 0.5 / v + v / a if v * v / a < 0.5 else 2.0 * np.sqrt(0.5 / a)
    assert move.report.duration == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("joint", range(5))
def test_jerk_limited_duration_is_the_closed_form(joint):
    start, goal = single_joint_move(joint)
    move = plan(BARE, start, goal, profile="jerk-limited")
    v, a, j = LIMITS.velocity[joint], LIMITS.acceleration[joint], LIMITS.jerk[joint]
    d = 0.5
    ramp = a / j + v / a if v * j > a * a else 2.0 * np.sqrt(v / j)  # time to reach full speed
    if d >= v * ramp:
        expected = d / v + ramp
    elif d >= 2.0 * a**3 / j**2:  # full acceleration, not full speed
        expected = a / j + np.sqrt((a / j) ** 2 + 4.0 * d / a)
    else:
        expected = 4.0 * np.cbrt(d / (2.0 * j))
    assert move.report.duration == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("joint", range(5))
@pytest.mark.parametrize("distance", [0.004, 0.5])
def test_quintic_duration_is_the_closed_form(joint, distance):
    """Its speed peaks at 15/8 d/T in the middle, its acceleration at 10/sqrt(3) d/T^2."""
    start, goal = single_joint_move(joint, distance)
    move = plan(BARE, start, goal, profile="quintic")
    v, a = LIMITS.velocity[joint], LIMITS.acceleration[joint]
    expected = max(15.0 / 8.0 * distance / v, np.sqrt(10.0 / np.sqrt(3.0) * distance / a))
    assert move.report.duration == pytest.approx(expected, rel=1e-6)
    np.testing.assert_allclose(move.motions[0]([0.0, expected])[2], 0.0, atol=1e-9)


@pytest.mark.parametrize("joint", range(5))
@pytest.mark.parametrize("distance", [0.004, 0.5])
def test_trapezoidal_duration_is_the_closed_form(joint, distance):
    start, goal = single_joint_move(joint, distance)
    move = plan(BARE, start, goal, profile="trapezoidal")
    v, a = LIMITS.velocity[joint], LIMITS.acceleration[joint]
    expected = distance / v + v / a if v * v / a < distance else 2.0 * np.sqrt(distance / a)
    assert move.report.duration == pytest.approx(expected, rel=1e-9)


def straight_pairs():
    for joint in range(5):
        for distance in (0.01, 0.16, 0.5):
            yield single_joint_move(joint, distance)
    yield from random_pairs(BOOM, 10, 20)


@pytest.mark.parametrize(("start", "goal"), list(straight_pairs()))
def test_jerk_bounded_time_optimal_is_ruckigs_optimum_on_a_straight_path_without_drives(start, goal):
    """Short moves and long ones: with and without a time at full speed or at full acceleration."""
    from ruckig import InputParameter, Result, Ruckig, Trajectory

    problem = InputParameter(1)
    problem.current_position, problem.target_position = [0.0], [1.0]
    step = np.abs(goal - start)
    for name in ("velocity", "acceleration", "jerk"):
        with np.errstate(divide="ignore"):
            setattr(problem, f"max_{name}", [float((getattr(LIMITS, name) / step).min())])
    solver, solution = Ruckig(1), Trajectory(1)
    assert solver.calculate(problem, solution) == Result.Working
    motion = straight(BARE, start, goal, Profile.TIME_OPTIMAL, jerk_bound=True)
    assert motion.duration == pytest.approx(solution.duration, rel=1e-3)


def test_jerk_bound_keeps_the_path_the_jerk_limits_and_the_rest():
    """The jerk by differences of the positions alone, under a payload with which the
    drives decide."""
    boom = BOOM.with_payload(20.0)
    start, goal = boom.pose("transport"), boom.pose("phenotyping")
    motion = straight(boom, start, goal, Profile.TIME_OPTIMAL, jerk_bound=True)
    t = np.linspace(0.0, motion.duration, 20_001)
    q, qd, qdd, _ = motion(t)
    h = t[1]
    jerk = np.abs(np.diff(qdd, axis=0)) / h / LIMITS.jerk
    assert 0.99 < jerk.max() <= SLACK
    np.testing.assert_allclose(np.diff(q, axis=0) / h, (qd[1:] + qd[:-1]) / 2.0, rtol=0, atol=1e-6)
    np.testing.assert_allclose(np.diff(qd, axis=0) / h, (qdd[1:] + qdd[:-1]) / 2.0, rtol=0, atol=1e-4)
    np.testing.assert_allclose(qdd[[0, -1]], 0.0, atol=1e-9)
    along = (q - start) @ (goal - start) / ((goal - start) @ (goal - start))
    np.testing.assert_allclose(q, start + along[:, None] * (goal - start), rtol=0, atol=1e-9)
    sharp, slow = (straight(boom, start, goal, profile).duration for profile in (Profile.TIME_OPTIMAL, Profile.JERK_LIMITED))
    assert sharp < motion.duration <= slow * (1.0 + 1e-6)


@pytest.mark.parametrize("profile", SHORTEST)
def test_random_moves_keep_every_limit(profile):
    for (start, goal), move in random_moves(profile):
        assert max(worst_ratios(move).values()) <= SLACK
        fine = sample(move.motions[0], 0.002)
        assert LIMITS.contain(fine.q).all()
        np.testing.assert_allclose(fine.q[[0, -1]], [start, goal], rtol=0, atol=5e-14)
        np.testing.assert_allclose(fine.qd[[0, -1]], 0.0, atol=1e-9)
        if profile is Profile.JERK_LIMITED:
            assert np.abs(fine.qddd / LIMITS.jerk).max() <= SLACK
            np.testing.assert_allclose(fine.qdd[[0, -1]], 0.0, atol=1e-9)


def test_time_optimal_is_no_slower_than_cubic():
    for (_, fast), (_, slow) in zip(random_moves(Profile.TIME_OPTIMAL), random_moves(Profile.CUBIC), strict=True):
        assert fast.report.duration <= slow.report.duration * (1.0 + 1e-9)


@pytest.mark.parametrize("payload", [16.0, 20.0, 24.0])
def test_drives_torque_decides_the_time_optimal_move_under_a_heavy_payload(payload):
    """The falling torque-speed curve is met, not passed: the worst ratio is 1, and a hundredth less
    time would break it."""
    move = plan(BOOM.with_payload(payload), "transport", "phenotyping", profile="time-optimal")
    assert move.report.duration > 4.3333 + 1e-4
    assert worst_ratios(move)["torque"] == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("profile", ["cubic", "jerk-limited"])
def test_slowed_profiles_end_on_the_drives_limit(profile):
    move = plan(BOOM.with_payload(24.0), "transport", "phenotyping", profile=profile)
    assert worst_ratios(move)["torque"] == pytest.approx(1.0, abs=1e-3)


def test_infeasible_load_names_joint_place_demand_and_limit():
    heavy = BOOM.with_payload(40.0)
    with pytest.raises(InfeasiblePathError, match=r"joint lower needs \d+\.\d Nm only to hold") as caught:
        plan(heavy, "transport", "phenotyping", profile="time-optimal")
    error = caught.value
    held = inverse_dynamics(heavy, heavy.pose("phenotyping"), np.zeros(5), np.zeros(5)).tau[2]
    assert (error.joint, error.s) == ("lower", 1.0)
    assert error.demand == pytest.approx(held, rel=1e-12)
    assert error.limit == pytest.approx((7.2 / 1.5 - 0.42) * 160 * 0.65, rel=1e-12)


@pytest.mark.parametrize("profile", SHORTEST)
@pytest.mark.parametrize("size", [1e-9, 1e-4])
def test_tiny_moves(profile, size):
    start = BOOM.pose("transport")
    goal = start + size * np.array([1.0, 0.0, 1.0, 0.0, 0.0])
    move = plan(BOOM, start, goal, profile=profile)
    assert max(worst_ratios(move).values()) <= SLACK
    np.testing.assert_allclose(move.trajectory.q[-1], goal, rtol=0, atol=1e-15)


@pytest.mark.parametrize("profile", SHORTEST)
def test_huge_limits(profile):
    """Not the limits but the drives decide."""
    wild = replace(
        LIMITS,
        **{name: getattr(LIMITS, name) * factor for name, factor in (("velocity", 1e3), ("acceleration", 1e6), ("jerk", 1e9))},
    )
    move = plan(replace(BOOM, limits=wild), "transport", "phenotyping", profile=profile)
    assert worst_ratios(move)["torque"] <= SLACK
    assert 0.1 < move.report.duration < 4.3


@pytest.mark.parametrize("profile", SHORTEST)
def test_given_duration_is_met_and_a_shorter_one_than_the_least_refused(profile):
    move = plan(BOOM, "transport", "phenotyping", profile=profile, duration=8.0)
    assert move.report.duration == pytest.approx(8.0, rel=1e-12)
    assert max(worst_ratios(move).values()) <= SLACK
    with pytest.raises(InfeasibleError, match=r"duration 1 s is too short: .* needs at least [456][.0-9]* s"):
        plan(BOOM, "transport", "phenotyping", profile=profile, duration=1.0)


@pytest.mark.parametrize(
    "options",
    [
        *({"profile": profile} for profile in SHORTEST),
        *({"profile": profile, "via": [VIA], "stop_at_via": False} for profile in SHORTEST),
        {"profile": Cubic.with_velocities([[0.1, 0.1, 0.2, 0.1, 0.1]]), "via": [VIA]},
        {"profile": TimeOptimal(jerk_bound=True), "rate": 100.0},
        {"profile": TimeOptimal(average_torque=True), "duration": 9.0},
    ],
    ids=str,
)
def test_no_profile_reaches_for_the_network(options, monkeypatch):
    import socket

    def refuse(*_, **__):
        raise AssertionError("the network was reached for")

    for name in ("socket", "create_connection", "getaddrinfo"):
        monkeypatch.setattr(socket, name, refuse)
    move = plan(BOOM, "transport", "phenotyping", **options)
    assert move.stop is not None  # stopping asks ruckig as well
