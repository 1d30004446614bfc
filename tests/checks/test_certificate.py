"""The certificate of a planned motion against a recomputation that shares nothing with it but the
motion."""

from dataclasses import replace

import numpy as np
import pytest

from boom_model import JOINTS, BaseMotion, Boom, Friction, up_on_slope
from planner import TimeOptimal, Verdict, plan
from planner.checks.certificate import certify
from planner.paths.path import JointLine
from planner.timing.profile import SHORTEST, Profile
from planner.timing.time_law import Motion
from planner.timing.timing import Timing, timed
from tests.limits import DRIVEN, EFFICIENCY, INERTIA, START_STOP, held, motor_allows, times
from tests.oracles import pinocchio_inverse_dynamics

LIGHT = Boom.load()
BOOM = LIGHT.with_payload(20.0)
START, GOAL = BOOM.pose("transport"), BOOM.pose("phenotyping")


def recomputed(boom, motion):
    """Ratios (n, 5) at times (n,): positions and limits by hand, torques by Pinocchio."""
    t = times(motion, motion.duration / 1500)
    q, qd, qdd, qddd = motion(t)
    limits = boom.limits
    tau = pinocchio_inverse_dynamics(boom, q, qd, qdd).tau
    gear, motor = np.zeros_like(tau), np.zeros_like(tau)
    for i in DRIVEN:
        gear[:, i] = np.abs(tau[:, i]) / START_STOP
        motor[:, i] = np.abs(tau[:, i] + EFFICIENCY * INERTIA * qdd[:, i]) / motor_allows(qd[:, i])
    linkage = np.zeros_like(q)
    linkage[:, 2] = np.radians(5.0) / (q[:, 2] - q[:, 1])
    found = {
        "position": np.abs(2.0 * q - limits.upper - limits.lower) / (limits.upper - limits.lower),
        "lower - inner": linkage,
        "velocity": np.abs(qd) / limits.velocity,
        "acceleration": np.abs(qdd) / limits.acceleration,
        "gearbox torque": gear,
        "motor torque": motor,
    }
    return t, found | ({"jerk": np.abs(qddd) / limits.jerk} if motion.law.jerk_limited else {})


@pytest.mark.parametrize("profile", SHORTEST)
def test_ratios_are_those_of_an_independent_recomputation(profile):
    (motion,) = timed(BOOM, [JointLine(START, GOAL)], Timing.of(profile), None)
    found = certify(BOOM, [motion])
    t, expected = recomputed(BOOM, motion)
    assert {each.limit for each in found.worst} == set(expected)
    for each in found.worst:
        ratios = expected[each.limit]
        assert each.ratio == pytest.approx(ratios.max(), rel=2e-4)
        at = int(np.argmin(np.abs(t - each.at_s)))
        assert ratios[at, JOINTS.index(each.joint)] == pytest.approx(each.ratio, rel=2e-3)
    assert found.samples >= 5_000
    assert found.broken == ()


def test_times_and_joints_of_a_move_in_parts_are_counted_from_its_start():
    via = np.array([0.7, 0.5, 2.0, 0.4, -0.2])
    motions = timed(BOOM, [JointLine(START, via), JointLine(via, GOAL)], Timing.of("time-optimal"), None)
    whole = {each.limit: each for each in certify(BOOM, motions).worst}
    begun = 0.0
    best = {}
    for motion in motions:
        t, expected = recomputed(BOOM, motion)
        for limit, ratios in expected.items():
            if ratios.max() > best.get(limit, (0.0,))[0]:
                best[limit] = ratios.max(), begun + t[int(np.argmax(ratios.max(axis=1)))]
        begun += motion.duration
    for limit, (ratio, _) in best.items():
        assert whole[limit].ratio == pytest.approx(ratio, rel=2e-4)
    assert whole["motor torque"].at_s == pytest.approx(best["motor torque"][1], abs=0.05)
    assert certify(BOOM, motions).iterations == sum(certify(BOOM, [motion]).iterations for motion in motions)


@pytest.mark.parametrize("profile", SHORTEST)
def test_a_motion_hastened_by_two_hundredths_is_reported_broken_and_fails(profile):
    move = plan(LIGHT, START, GOAL, profile=profile)
    (motion,) = move.motions
    assert not certify(LIGHT, [motion]).broken
    hasty = certify(LIGHT, [Motion(motion.path, motion.law.stretched(0.98))])
    assert hasty.broken
    assert max(each.ratio for each in hasty.broken) > 1.009
    assert move.report.verdict is not Verdict.FAIL
    report = replace(move.report, certificate=hasty)
    assert report.verdict is Verdict.FAIL
    worst = max(hasty.broken, key=lambda each: each.ratio)
    assert f"{worst.joint} {worst.limit} (certificate)" in report.summary
    assert report.to_json({})["verdict"] == "FAIL"


def test_a_motion_that_leaves_the_limits_of_position_or_linkage_is_broken():
    for goal, limit, joint in (
        (np.array([1.0, 0.5, 1.5, 1.02, 0.0]), "position", "extension"),
        (np.array([1.0, 1.45, 1.5, 0.5, 0.0]), "lower - inner", "lower"),
    ):
        start = np.array([1.0, 0.5, 1.5, 0.5, 0.0])
        (motion,) = timed(BOOM, [JointLine(start, goal)], Timing.of("cubic"), None)
        broken = certify(BOOM, [motion]).broken
        assert [(each.limit, each.joint) for each in broken] == [(limit, joint)]
        assert broken[0].at_s == pytest.approx(motion.duration)


def test_a_load_that_no_drive_holds_is_broken_on_every_profile_that_plans_it():
    heavy = BOOM.with_payload(40.0)
    for profile in (Profile.CUBIC, Profile.QUINTIC, Profile.TRAPEZOIDAL, Profile.JERK_LIMITED):
        motions = timed(heavy, [JointLine(START, GOAL)], Timing.of(profile), None)
        broken = {each.limit: each for each in certify(heavy, motions).broken}
        assert broken["motor torque"].joint == "lower"
        assert broken["motor torque"].ratio >= held(heavy, GOAL[None]) * (1.0 - 1e-12) > 1.1


def test_the_jump_of_the_jerk_at_a_waypoint_is_seen():
    """The third derivative of the path jumps there; a grid in time alone looks past it."""
    via = [np.array([0.7, 1.05, 2.1, 0.3, 0.0]), START]
    move = plan(LIGHT, START, GOAL, via=via, stop_at_via=False, profile=TimeOptimal(jerk_bound=True))
    (motion,) = move.motions
    dense = np.abs(motion(np.linspace(0.0, motion.duration, 400_001))[3] / LIGHT.limits.jerk).max()
    certified = {each.limit: each.ratio for each in move.report.certificate.worst}["jerk"]
    assert dense <= 1.0 + 1e-4
    assert certified >= dense - 1e-6


def test_friction_and_tilt_are_counted():
    rubbing = replace(LIGHT, friction=Friction(np.full(5, 30.0), np.full(5, 15.0), (None,) * 5))
    tilt = BaseMotion.of(up=up_on_slope(np.radians(10.0), np.radians(5.0)))
    (motion,) = timed(LIGHT, [JointLine(START, GOAL)], Timing.of("quintic"), None)
    t = times(motion, motion.duration / 1500)
    q, qd, qdd, _ = motion(t)
    still = pinocchio_inverse_dynamics(LIGHT, q, qd, qdd).tau
    for boom, base, tau in (
        (rubbing, None, still + 30.0 * qd + 15.0 * np.sign(qd)),
        (LIGHT, tilt, pinocchio_inverse_dynamics(LIGHT, q, qd, qdd, base=tilt).tau),
    ):
        found = {each.limit: each.ratio for each in certify(boom, [motion], base).worst}
        expected = np.abs(tau[:, list(DRIVEN)]).max() / START_STOP
        assert found["gearbox torque"] == pytest.approx(expected, rel=2e-4)
        assert abs(expected - np.abs(still[:, list(DRIVEN)]).max() / START_STOP) > 1e-3


def test_average_torque_stands_in_the_certificate_where_it_is_asked_for():
    (motion,) = timed(LIGHT, [JointLine(START, GOAL)], Timing.of("cubic"), None)
    t = np.linspace(0.0, motion.duration, 20_001)
    q, qd, qdd, _ = motion(t)
    tau, speed = pinocchio_inverse_dynamics(LIGHT, q, qd, qdd).tau, np.abs(qd)
    means = [np.cbrt(np.trapezoid(speed[:, i] * np.abs(tau[:, i]) ** 3, t) / np.trapezoid(speed[:, i], t)) for i in DRIVEN]
    (found,) = (each for each in certify(LIGHT, [motion], average_torque=True).worst if each.limit == "average torque")
    assert (found.joint, found.at_s) == (JOINTS[DRIVEN[int(np.argmax(means))]], None)
    assert found.ratio == pytest.approx(max(means) / 275.0, rel=1e-6)
    assert "average torque" not in {each.limit for each in certify(LIGHT, [motion]).worst}


def test_a_motor_without_supply_is_held_against_its_standstill_and_the_limit_says_so():
    bare = replace(LIGHT, drives=tuple(drive and replace(drive, bus_voltage=None) for drive in LIGHT.drives))
    (motion,) = timed(LIGHT, [JointLine(START, GOAL)], Timing.of("cubic"), None)
    limits = {each.limit for each in certify(bare, [motion]).worst}
    assert "motor torque at standstill" in limits
    assert "motor torque" not in limits
