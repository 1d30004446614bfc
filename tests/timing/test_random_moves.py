"""Every profile on random and on degenerate moves: planned or refused with a reason, and no limit
broken."""

from dataclasses import replace

import numpy as np
import pytest

from boom_model import Boom, InfeasibleError
from planner.paths.path import JointLine
from planner.timing.profile import SHORTEST, Profile
from planner.timing.timing import Timing
from tests.builders import motion_along
from tests.limits import held, random_pairs, worst

BOOM = Boom.load()
LIMITS = BOOM.limits
KINDS = [*((profile, {}) for profile in SHORTEST), (Profile.TIME_OPTIMAL, {"jerk_bound": True})]
NAMES = [*SHORTEST, "jerk bound"]
PAIRS = {Profile.CUBIC: 1000, Profile.QUINTIC: 1000, Profile.TRAPEZOIDAL: 1000, Profile.JERK_LIMITED: 200,
         Profile.TIME_OPTIMAL: 150, "jerk bound": 30}  # fmt: skip
SLACK = 1e-3
LIMITED = (Profile.JERK_LIMITED, "jerk bound")


def motion_of(boom, start, goal, profile, options):
    return motion_along(boom, JointLine(start, goal), Timing.of(profile, **options))


def assert_keeps_limits(boom, start, goal, motion, jerk, step):
    found = worst(boom, motion, step, jerk)
    assert found.pop("outside") <= 1e-12
    assert max(found.values()) <= 1.0 + SLACK, found
    q, qd, qdd, _ = motion(np.array([0.0, motion.duration]))
    scale = np.abs(goal - start).max() / motion.duration
    np.testing.assert_allclose(q, [start, goal], rtol=0, atol=1e-13)
    np.testing.assert_allclose(qd, 0.0, atol=1e-6 * scale)
    if jerk:
        np.testing.assert_allclose(qdd, 0.0, atol=1e-6 * scale / motion.duration)
    return max(found.values())


@pytest.mark.parametrize(("kind", "name"), list(zip(KINDS, NAMES, strict=True)), ids=NAMES)
def test_random_pairs_under_random_payloads(kind, name):
    """Payloads reach beyond what the drives can hold: there, and only there, a move may be refused
    or be known to fail."""
    payloads = np.random.default_rng(7).uniform(0.0, 45.0, PAIRS[name])
    refused, limited = 0, 0
    for (start, goal), payload in zip(random_pairs(BOOM, PAIRS[name], 11), payloads, strict=True):
        boom = BOOM.with_payload(payload)
        load = held(boom, JointLine(start, goal)(np.linspace(0.0, 1.0, 501)))
        if load > 1.0 - 1e-6:
            refused += 1
            if kind[0] is Profile.TIME_OPTIMAL:
                with pytest.raises(InfeasibleError, match=r"joint (inner|lower) needs \d+\.\d Nm only to hold its load"):
                    motion_of(boom, start, goal, *kind)
            continue
        motion = motion_of(boom, start, goal, *kind)
        reached = assert_keeps_limits(boom, start, goal, motion, name in LIMITED, motion.duration / 1500)
        limited += reached >= 1.0 - 1e-3
    assert 0 < refused < 0.25 * PAIRS[name]
    assert limited == PAIRS[name] - refused  # each is as fast as some limit allows


def degenerate():
    """Names and (boom, start, goal) of what planners trip over."""
    middle = np.array([1.0, 0.5, 1.5, 0.3, 0.1])
    flat = 5.0 * np.pi / 180.0
    for size in (1e-9, 1e-6):
        yield f"{size:g} of every joint", BOOM, middle, middle + size * np.array([1.0, -1.0, 1.0, 0.5, -0.3])
        yield f"{size:g} beside a large move", BOOM, middle, middle + np.array([1.0, size, 0.0, 0.0, -size])
    for joint in range(5):
        goal = middle.copy()
        goal[joint] += 0.4
        yield f"joint {joint} alone", BOOM, middle, goal
    yield "from lower limits to upper", BOOM, LIMITS.lower, LIMITS.upper
    yield (
        "along the coupled limit",
        BOOM,
        np.array([0.5, 0.2, 0.2 + flat, 0.1, 0.0]),
        np.array([1.5, 1.9, 1.9 + flat, 0.9, 1.0]),
    )
    yield (
        "away from the flat linkage",
        BOOM,
        np.array([0.5, 1.0, 1.0 + flat, 0.5, 0.0]),
        np.array([0.5, 1.0, 1.2 + flat, 0.5, 0.0]),
    )
    yield "onto the linkage flat at 180 deg", BOOM, np.array([0.5, 0.2, 3.0, 0.5, 0.0]), np.array([0.7, 0.0, np.pi, 0.5, 0.0])
    yield (
        "beside the linkage flat at 180 deg",
        BOOM,
        np.array([0.5, 0.0, np.pi - 1e-6, 0, 0]),
        np.array([2.5, 0.0, np.pi, 1, 0]),
    )
    yield "no payload", BOOM.with_payload(0.0), BOOM.pose("transport"), BOOM.pose("phenotyping")
    wild = replace(LIMITS, velocity=LIMITS.velocity * 1e3, acceleration=LIMITS.acceleration * 1e5, jerk=LIMITS.jerk * 1e7)
    yield "huge limits", replace(BOOM, limits=wild), BOOM.pose("transport"), BOOM.pose("phenotyping")
    yield "huge limits, tiny move", replace(BOOM, limits=wild), middle, middle + 1e-9


CASES = {name: case for name, *case in degenerate()}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize(("kind", "name"), list(zip(KINDS, NAMES, strict=True)), ids=NAMES)
def test_degenerate_moves(kind, name, case):
    boom, start, goal = CASES[case]
    motion = motion_of(boom, start, goal, *kind)
    reached = assert_keeps_limits(boom, start, goal, motion, name in LIMITED, motion.duration / 1500)
    assert reached >= 1.0 - 1e-3


def test_straight_moves_between_allowed_poses_never_break_a_position_limit():
    """The limits are convex, the coupled one included, so that no such move needs a detour."""
    s = np.linspace(0.0, 1.0, 101)
    gaps = []
    for start, goal in random_pairs(BOOM, 1000, 5):
        q = start + s[:, None] * (goal - start)
        gaps.append((q[:, 2] - q[:, 1]).min())
        assert (q >= LIMITS.lower - 1e-12).all()
        assert (q <= LIMITS.upper + 1e-12).all()
        np.testing.assert_allclose(JointLine(start, goal)(s), q, rtol=0, atol=1e-14)
    assert min(gaps) >= np.radians(5.0)
    assert min(gaps) < np.radians(6.0)  # some come near
