"""Stopping from any moment of a move."""

from dataclasses import replace

import numpy as np
import pytest

from boom_model import Boom, InputError, forward_kinematics
from planner import plan
from planner.checks.stopping import MOMENTS, Way, stop, worst_stop
from planner.paths.path import JointLine, through
from planner.timing.profile import SHORTEST
from planner.timing.timing import Timing, timed
from tests.builders import motion_along, without_drives
from tests.limits import worst

BOOM = Boom.load()
BARE = without_drives(BOOM)
LIMITS = BOOM.limits
START, GOAL = BOOM.pose("transport"), BOOM.pose("phenotyping")
VIA = np.array([[0.4, 0.3, 1.4, 0.2, -0.5], [0.9, 0.5, 1.9, 0.7, 0.1]])
SINGLE = np.array([1.0, 0.5, 1.5, 0.1, 0.1]), np.array([1.0, 0.5, 1.5, 0.9, 0.1])


def motion_of(boom, path, profile, **options):
    return motion_along(boom, path, Timing.of(profile, **options))


@pytest.mark.parametrize("curved", [False, True], ids=["straight", "curved"])
@pytest.mark.parametrize("profile", [*SHORTEST, "jerk bound"])
def test_stops_begin_in_the_motions_state_keep_every_limit_and_end_at_rest(profile, curved):
    boom = BOOM.with_payload(18.0)
    path = through(boom, np.array([START, *VIA, GOAL])) if curved else JointLine(START, GOAL)
    options = {"jerk_bound": True} if profile == "jerk bound" else {}
    motion = motion_of(boom, path, "time-optimal" if options else profile, **options)
    ways = set()
    for at in np.linspace(0.0, motion.duration, 10)[1:-1]:
        found = stop(boom, motion, float(at))
        ways.add(found.way)
        q, qd, qdd, _ = motion(at)
        begun, ended = found.motion(0.0), found.motion(found.duration)
        np.testing.assert_allclose(begun[0], q, rtol=0, atol=1e-9)
        np.testing.assert_allclose(begun[1], qd, rtol=0, atol=1e-8)
        np.testing.assert_allclose(ended[1], 0.0, atol=1e-8)
        limited = motion.law.jerk_limited
        if limited:
            np.testing.assert_allclose(begun[2], qdd, rtol=0, atol=1e-7)
            np.testing.assert_allclose(ended[2], 0.0, atol=1e-7)
        ratios = worst(boom, found.motion, found.duration / 1000, jerk=limited)
        assert ratios.pop("outside") <= 2e-9
        assert max(ratios.values()) <= 1.002, (at, found.way, ratios)
        assert found.duration <= (motion.duration - at) * (1.0 + 1e-9)
        if found.way is Way.ON_PATH:
            reached = found.motion.law.s(found.duration)
            assert motion.law.s(at) <= reached <= 1.0
    assert ways & {Way.ON_PATH, Way.OFF_PATH}


def test_every_stop_of_fifty_moments_of_the_main_move_keeps_the_limits():
    motion = motion_of(BOOM, JointLine(START, GOAL), "time-optimal")
    for at in np.linspace(0.0, motion.duration, 52)[1:-1]:
        found = stop(BOOM, motion, float(at))
        ratios = worst(BOOM, found.motion, found.duration / 400)
        assert ratios.pop("outside") <= 2e-9
        assert max(ratios.values()) <= 1.002
        np.testing.assert_allclose(found.motion(0.0)[1], motion(at)[1], rtol=0, atol=1e-8)


@pytest.mark.parametrize("share", [0.05, 0.2, 0.5, 0.8])
def test_stop_of_a_trapezoid_on_one_joint_takes_v_over_a(share):
    motion = motion_of(BARE, JointLine(*SINGLE), "trapezoidal")
    at = share * motion.duration
    speed = motion(at)[1][3]
    found = stop(BARE, motion, at)
    assert found.duration == pytest.approx(speed / LIMITS.acceleration[3], rel=1e-9)
    travelled = found.motion(found.duration)[0][3] - motion(at)[0][3]
    assert travelled == pytest.approx(speed**2 / (2.0 * LIMITS.acceleration[3]), rel=1e-9)


@pytest.mark.parametrize("share", [0.02, 0.1, 0.3, 0.5, 0.7])
def test_stop_of_a_jerk_limited_move_on_one_joint_is_the_closed_form(share):
    """From v and a: the deceleration rises to a peak p at the jerk limit, is held at the limit if
    it comes there, and falls again, so that v + a^2/(2j) = p^2/j without a hold, in (a + 2 p)/j."""
    motion = motion_of(BARE, JointLine(*SINGLE), "jerk-limited")
    at = share * motion.duration
    _, qd, qdd, _ = motion(at)
    v, a, most, j = qd[3], qdd[3], LIMITS.acceleration[3], LIMITS.jerk[3]
    lost = v + a**2 / (2.0 * j)
    peak = np.sqrt(lost * j)
    expected = (a + 2.0 * peak) / j if peak <= most else (a + 2.0 * most) / j + (lost - most**2 / j) / most
    found = stop(BARE, motion, at)
    assert found.duration == pytest.approx(expected, rel=1e-6)


def test_worst_stop_is_the_longest_and_the_farthest_of_all_moments():
    via = np.array([0.7, 0.5, 2.0, 0.4, -0.2])
    motions = timed(BOOM, [JointLine(START, via), JointLine(via, GOAL)], Timing.of("trapezoidal"), None)
    found = worst_stop(BOOM, motions)
    longest, farthest, begun = (0.0, 0.0), (0.0, 0.0), 0.0
    for motion in motions:
        for at in np.linspace(0.0, motion.duration, MOMENTS + 1)[1:-1]:
            each = stop(BOOM, motion, float(at))
            tip = forward_kinematics(BOOM, each.motion(np.linspace(0.0, each.duration, 65))[0]).position
            length = float(np.linalg.norm(np.diff(tip, axis=0), axis=1).sum())
            longest = max(longest, (each.duration, begun + at))
            farthest = max(farthest, (length, begun + at))
        begun += motion.duration
    assert found.time_s == pytest.approx(longest[0], rel=1e-9)
    assert found.distance_m == pytest.approx(farthest[0], rel=1e-3)
    assert found.distance_at_s == pytest.approx(farthest[1], abs=0.1)
    (after,) = timed(BOOM, [JointLine(START, GOAL)], Timing.of("trapezoidal"), None)
    move = plan(BOOM, START, GOAL, profile="trapezoidal")
    assert move.full_report.stop == move.stop == worst_stop(BOOM, (after,))


@pytest.mark.parametrize("at", [-0.1, 1e3, np.nan])
def test_a_moment_outside_the_motion_is_named(at):
    motion = motion_of(BARE, JointLine(*SINGLE), "trapezoidal")
    with pytest.raises(InputError, match="moment is"):
        stop(BARE, motion, at)


def test_the_drives_bind_a_stop_where_the_joint_limits_do_not():
    strong = replace(LIMITS, velocity=LIMITS.velocity * 2.0, acceleration=LIMITS.acceleration * 10.0)
    boom = replace(BOOM.with_payload(22.0), limits=strong)
    motion = motion_of(boom, JointLine(START, GOAL), "time-optimal")
    binding = 0
    for at in np.linspace(0.0, motion.duration, 12)[1:-1]:
        found = stop(boom, motion, float(at))
        ratios = worst(boom, found.motion, found.duration / 1000, jerk=False)
        assert ratios.pop("outside") <= 2e-9
        assert max(ratios.values()) <= 1.002
        torque = max(value for name, value in ratios.items() if "torque" in name or name in ("motor", "gearbox"))
        binding += found.way is not Way.FINISH and torque > 0.97 > max(ratios["velocity"], ratios["acceleration"])
    assert binding >= 2


def test_a_stop_on_a_curved_path_brakes_as_hard_as_the_way_ahead_allows():
    """Not as the steepest place of the whole path would: each stop meets an acceleration limit."""
    motion = motion_of(BARE, through(BOOM, np.array([START, *VIA, GOAL])), "cubic")
    reached = []
    for at in np.linspace(0.0, motion.duration, 22)[1:-1]:
        found = stop(BARE, motion, float(at))
        if found.way is Way.ON_PATH:
            ratios = worst(BARE, found.motion, found.duration / 1000, jerk=False)
            reached.append(ratios["acceleration"])
    assert len(reached) >= 8
    assert min(reached) > 0.98
