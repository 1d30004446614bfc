"""Moves through waypoints without a stop, on every profile."""

import numpy as np
import pytest

from boom_model import Boom, InfeasibleError, InputError
from planner import Cubic, TipTarget, plan
from planner.paths.path import JointLine, SplinePath, spaced, through
from planner.timing.profile import SHORTEST, Profile, parse_profile
from planner.timing.timing import Timing, timed
from tests.builders import without_drives
from tests.limits import ratios, worst

BOOM = Boom.load()
LIMITS = BOOM.limits
START, GOAL = BOOM.pose("transport"), BOOM.pose("phenotyping")
VIA = np.array([[0.4, 0.3, 1.4, 0.2, -0.5], [0.9, 0.5, 1.9, 0.7, 0.1]])
KINDS = [*((profile, {}) for profile in SHORTEST), (Profile.TIME_OPTIMAL, {"jerk_bound": True})]
NAMES = [*SHORTEST, "jerk bound"]
VELOCITIES = np.array([[0.25, 0.15, 0.5, 0.1, 0.3], [0.2, 0.1, 0.3, -0.05, 0.0]])


def passages(motion, waypoints):
    """Times at which a motion passes waypoints (n, 5): where its nearest joint positions to them
    are, bisected on speed."""
    from scipy.optimize import minimize_scalar

    t = np.linspace(0.0, motion.duration, 20_001)
    q = motion(t)[0]
    found = []
    for waypoint in waypoints:
        at = int(np.argmin(np.abs(q - waypoint).max(axis=-1)))
        near = (t[max(at - 1, 0)], t[min(at + 1, len(t) - 1)])

        def away(x, waypoint=waypoint):
            return float(((motion(x)[0] - waypoint) ** 2).sum())

        found.append(float(minimize_scalar(away, bounds=near, method="bounded", options={"xatol": 1e-15}).x))
    return np.array(found)


def assert_continuous(motion, orders):
    """No jump of the derivatives of these orders anywhere: between dense samples they change by
    their own slope."""
    t = np.linspace(0.0, motion.duration, 40_001)
    states = motion(t)
    for order in orders:
        steps = np.abs(np.diff(states[order], axis=0)).max(axis=0)
        slope = np.abs(states[order + 1]).max(axis=0)
        assert (steps <= 1.01 * slope * t[1] + 1e-12).all(), (order, steps, slope * t[1])


@pytest.mark.parametrize(("kind", "name"), list(zip(KINDS, NAMES, strict=True)), ids=NAMES)
def test_every_profile_goes_through_the_waypoints_within_the_limits_and_without_a_stop(kind, name):
    boom = BOOM.with_payload(18.0)
    move = plan(boom, START, GOAL, profile=parse_profile(kind[0], **kind[1]), via=list(VIA), stop_at_via=False)
    (motion,) = move.motions
    waypoints = np.array([START, *VIA, GOAL])
    knots = motion.path.spline.x
    assert len(knots) == len(waypoints)
    np.testing.assert_allclose(motion.path(knots), waypoints, rtol=0, atol=1e-12)
    at = passages(motion, VIA)
    np.testing.assert_allclose(motion(at)[0], VIA, rtol=0, atol=1e-7)
    assert (np.diff([0.0, *at, motion.duration]) > 0.1).all()
    assert (np.abs(motion(at)[1]) / LIMITS.velocity).max(axis=-1).min() > 0.05  # it does not stop there
    jerk = name in (Profile.JERK_LIMITED, "jerk bound")
    found = worst(boom, motion, 5e-4, jerk=jerk)
    assert found.pop("outside") <= 1e-9
    assert 0.999 <= max(found.values()) <= 1.001
    assert not move.report.certificate.broken
    assert_continuous(motion, (0, 1, 2) if jerk or kind[0] in (Profile.CUBIC, Profile.QUINTIC) else (0, 1))
    assert any("2 waypoint(s) without a stop" in note for note in move.report.notes)


def test_the_fast_profiles_are_faster_through_waypoints_than_stopping_at_them():
    def duration(profile, stop):
        return plan(BOOM, START, GOAL, profile=profile, via=list(VIA), stop_at_via=stop).report.duration

    for profile in (Profile.CUBIC, Profile.TIME_OPTIMAL):
        assert duration(profile, False) < 0.8 * duration(profile, True)


@pytest.mark.parametrize("seed", range(4))
def test_cubic_through_waypoints_is_no_slower_than_with_knots_in_proportion_to_the_chords(seed):
    """Against the two customary spacings of a spline's knots, on random waypoints inside the
    limits."""
    from scipy.interpolate import CubicSpline

    rng = np.random.default_rng(seed)
    middle, half = (LIMITS.lower + LIMITS.upper) / 2.0, (LIMITS.upper - LIMITS.lower) / 2.0
    waypoints = middle + 0.5 * half * rng.uniform(-1.0, 1.0, (4, 5))
    waypoints[:, 2] = np.maximum(waypoints[:, 2], waypoints[:, 1] + 0.6)
    bare = without_drives(BOOM)
    (motion,) = timed(bare, [SplinePath(None, waypoints)], Timing.of("cubic"), None)
    chords = np.linalg.norm(np.diff(waypoints, axis=0), axis=1)
    s = np.linspace(0.0, 1.0, 20_001)
    for knots in (np.append(0.0, np.cumsum(chords)) / chords.sum(), spaced(BOOM, waypoints), np.linspace(0.0, 1.0, 4)):
        knots[-1] = 1.0
        spline = CubicSpline(knots, waypoints, bc_type="clamped")
        speed, rate = np.abs(spline(s, 1)) / LIMITS.velocity, np.abs(spline(s, 2)) / LIMITS.acceleration
        assert motion.duration <= max(speed.max(), np.sqrt(rate.max())) * (1.0 + 1e-6)
    assert_continuous(motion, (0, 1, 2))
    for end in (0.0, motion.duration):
        np.testing.assert_allclose(motion(end)[1], 0.0, atol=1e-9)


@pytest.mark.parametrize("payload", [10.0, 20.0])
def test_chosen_velocities_are_met_exactly(payload):
    boom = BOOM.with_payload(payload)
    move = plan(boom, START, GOAL, via=list(VIA), profile=Cubic.with_velocities(VELOCITIES))
    (motion,) = move.motions
    at = motion.path.spline.x[1:-1] * motion.duration
    for side in (-1e-10, 1e-10):
        q, qd, *_ = motion(at + side)
        np.testing.assert_allclose(q, VIA, rtol=0, atol=1e-9)
        np.testing.assert_allclose(qd, VELOCITIES, rtol=0, atol=1e-8)
    np.testing.assert_allclose(motion.path(motion.path.spline.x[1:-1]), VIA, rtol=0, atol=1e-12)
    np.testing.assert_allclose(motion.path(motion.path.spline.x[1:-1], 1) / motion.duration, VELOCITIES, rtol=1e-12)
    found = worst(boom, motion, 5e-4)
    assert found.pop("outside") <= 1e-9
    assert max(found.values()) <= 1.001
    assert_continuous(motion, (0, 1))
    for k, (a, b) in enumerate(zip([0.0, *at], [*at, motion.duration], strict=True)):  # each segment is at some limit
        t = np.linspace(a, b, 2001)[1:-1]
        q, qd, qdd, _ = motion(t)
        assert max(float(each.max()) for each in ratios(boom, q, qd, qdd).values()) > 0.995, k


def test_chosen_velocities_hold_in_a_given_duration_and_on_a_controllers_clock():
    least = plan(BOOM, START, GOAL, via=list(VIA), profile=Cubic.with_velocities(VELOCITIES)).report.duration
    longer = plan(BOOM, START, GOAL, via=list(VIA), profile=Cubic.with_velocities(VELOCITIES), duration=least * 1.1)
    clocked = plan(BOOM, START, GOAL, via=list(VIA), profile=Cubic.with_velocities(VELOCITIES), rate=10.0)
    assert longer.report.duration == pytest.approx(least * 1.1, rel=1e-12)
    assert clocked.report.duration == pytest.approx(np.ceil(least * 10.0) / 10.0, rel=1e-12)
    for move in (longer, clocked):
        (motion,) = move.motions
        np.testing.assert_allclose(motion.path(motion.path.spline.x[1:-1], 1) / motion.duration, VELOCITIES, rtol=1e-12)
    with pytest.raises(InfeasibleError, match=r"duration 1 s is too short: with these velocities the cubics need at least"):
        plan(BOOM, START, GOAL, via=list(VIA), profile=Cubic.with_velocities(VELOCITIES), duration=1.0)


@pytest.mark.parametrize("profile", SHORTEST)
@pytest.mark.parametrize("below", [0.05, 2.4])
def test_a_path_that_would_overshoot_a_limit_turns_back_at_it(profile, below):
    """The wrist touches its limit at the waypoint, and a plain spline would swing beyond it."""
    top = LIMITS.upper[4]
    start, via, goal = (np.array([0.2 + x, 0.3, 1.6, 0.4, top - y]) for x, y in ((0.0, below), (0.1, 0.0), (1.5, below)))
    (motion,) = timed(BOOM, [through(BOOM, np.array([start, via, goal]))], Timing.of(profile), None)
    found = worst(BOOM, motion, 5e-4)
    assert found.pop("outside") <= 1e-9
    assert max(found.values()) <= 1.001


def test_smooth_path_never_turns_back_beyond_its_extremes_where_a_plain_spline_would():
    """Waypoints on the limits themselves, all four corners of what the boom can do."""
    rng = np.random.default_rng(2)
    for _ in range(60):
        waypoints = np.where(rng.random((4, 5)) < 0.5, LIMITS.lower, LIMITS.upper)
        waypoints[:, 1] = rng.uniform(0.0, 0.5, 4)
        waypoints[:, 2] = np.where(rng.random(4) < 0.5, 0.6, np.pi)
        waypoints[:, 0] = np.sort(rng.uniform(0.0, 6.0, 4))
        path = through(BOOM, waypoints)
        q = path(np.linspace(0.0, 1.0, 5001))
        knots = path.spline.x
        np.testing.assert_allclose(path(knots), waypoints, rtol=0, atol=1e-12)
        assert LIMITS.contain(q).all()
        for order in (0, 1, 2):
            inner = knots[1:-1]
            np.testing.assert_allclose(path(inner - 1e-12, order), path(inner + 1e-12, order), rtol=0, atol=1e-6)


def test_velocities_that_run_through_a_limit_are_refused_with_the_joint():
    via = VIA[:1].copy()
    via[0, 4] = LIMITS.upper[4]
    with pytest.raises(InfeasibleError, match=r"with these velocities the cubics leave the limits at \d.*wrist .* above"):
        plan(BOOM, START, GOAL, via=list(via), profile=Cubic.with_velocities([[0.1, 0.1, 0.2, 0.1, 0.5]]))


def test_velocities_beyond_a_joints_limit_are_refused_with_segment_and_joint():
    fast = VELOCITIES.copy()
    fast[1, 3] = 1.5 * LIMITS.velocity[3]
    with pytest.raises(InfeasibleError, match=r"between waypoints 1 and 2 .* joint extension comes nearest with 1\.5 times"):
        plan(BOOM, START, GOAL, via=list(VIA), profile=Cubic.with_velocities(fast))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"velocities": VELOCITIES[:1]}, r"velocities have shape \(1, 5\); with 2 waypoints, .* \(2, 5\)"),
        ({"velocities": VELOCITIES[:, :4]}, r"via_velocities has shape \(2, 4\)"),
        ({"velocities": VELOCITIES * np.nan}, r"via_velocities\[0, 0\] is nan"),
        ({"velocities": VELOCITIES, "profile": "quintic"}, "for the cubic profile, not for quintic"),
        ({"velocities": VELOCITIES, "via": []}, r"with 0 waypoints, .* \(0, 5\)"),
        ({"stop_at_via": False, "along": "line"}, "on a joint path only, not on a line"),
        ({"jerk_bound": True}, "jerk_bound is for the time-optimal profile, not for cubic"),
        ({"average_torque": True, "profile": "jerk-limited"}, "average_torque is for the time-optimal profile"),
        ({"rate": 0.0}, "rate is 0 Hz"),
        ({"rate": np.inf}, "rate is inf"),
    ],
)
def test_what_does_not_fit_is_named(options, message):
    start, goal = (TipTarget((1.4, 0.0, 1.0)), TipTarget((1.2, 0.3, 1.0))) if "along" in options else (START, GOAL)
    with pytest.raises(InputError, match=message):
        planned(start, goal, **({"via": list(VIA)} | options))


def planned(start, goal, profile="cubic", jerk_bound=False, average_torque=False, velocities=None, **options):
    """A move of a profile's word and the options that the command gives beside it."""
    timing = parse_profile(profile, jerk_bound=jerk_bound, average_torque=average_torque, velocities=velocities)
    return plan(BOOM, start, goal, profile=timing, **options)


def test_one_waypoint_on_the_straight_line_changes_nothing_but_the_timing():
    line = JointLine(START, GOAL)
    (motion,) = plan(BOOM, START, GOAL, profile="time-optimal", via=[line(0.4)], stop_at_via=False).motions
    t = np.linspace(0.0, motion.duration, 501)
    q = motion(t)[0]
    along = (q - START) @ (GOAL - START) / ((GOAL - START) @ (GOAL - START))
    np.testing.assert_allclose(q, line(along), rtol=0, atol=1e-12)
