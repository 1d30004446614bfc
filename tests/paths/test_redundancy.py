"""Redundancy along whole lines of the tip: smooth curves, as quick as simple ones, and what they
cost is told truly."""

from functools import cache

import numpy as np
import pytest

from boom_model import (
    ActuatorAngle,
    Boom,
    Constraint,
    FixedExtension,
    InfeasibleError,
    InputError,
    LargestMargin,
    LeastExtension,
    LeastTime,
    LeastTorque,
    NearestHorizontal,
    forward_kinematics,
    inverse_kinematics,
    solve_branches,
)
from planner import MoveSpec, plan
from planner.checks.certificate import certify
from planner.paths.path import Path
from planner.paths.redundancy import NODES
from planner.paths.tip_curves import TipLine
from planner.paths.tip_path import follow
from planner.planning import plan_motion
from planner.timing.time_law import Motion
from planner.timing.timing import Timing
from tests.builders import motion_along

BOOM = Boom.load()
DOWN = -np.pi / 2.0
CHOOSING = (LeastExtension(), NearestHorizontal(), LargestMargin(), LeastTorque())
JOINT_LIMITS = ("position", "lower - inner", "velocity", "acceleration", "jerk")
PROFILES = ("cubic", "jerk-limited", "time-optimal")
LINES = 4


@cache
def lines() -> list[TipLine]:
    """Lines of up to 3 m that some fixed elevation or extension can follow, from a seed."""
    rng, found = np.random.default_rng(2026), []
    while len(found) < LINES:
        r, turn = rng.uniform(0.3, 2.4, 2), rng.uniform(0.0, 2.0 * np.pi) + np.array([0.0, rng.uniform(-1.5, 1.5)])
        start, goal = np.stack([r * np.cos(turn), r * np.sin(turn), rng.uniform(0.0, 1.8, 2)], axis=-1)
        line = TipLine(start, goal)
        if 0.3 < line.length < 3.0 and len(simple(line)) >= 2:
            found.append(line)
    return found


@cache
def resolved(number: int, constraint: Constraint) -> Path:
    """The path along a line of `lines` under a constraint."""
    return follow(BOOM, lines()[number], DOWN, constraint)


@cache
def simple(line: TipLine) -> list[Path]:
    """The paths along a line with the actuator's elevation or extension fixed."""
    paths = []
    fixed = [ActuatorAngle(angle) for angle in np.radians(np.linspace(-150.0, 0.0, 7))]
    for constraint in (*fixed, *(FixedExtension(x) for x in np.linspace(0.0, 1.0, 6))):
        try:
            paths.append(follow(BOOM, line, DOWN, constraint))
        except InfeasibleError:
            continue
    return paths


@cache
def moved(path: Path, profile: str) -> Motion:
    return motion_along(BOOM, path, Timing.of(profile))


def duration(path: Path, profile: str) -> float:
    return moved(path, profile).duration


def certified_duration(path: Path, profile: str) -> float:
    motion = moved(path, profile)
    ratios = {worst.limit: worst.ratio for worst in certify(BOOM, [motion]).worst}
    assert max(ratios.get(limit, 0.0) for limit in JOINT_LIMITS) <= 1.001
    return motion.duration


@pytest.mark.parametrize("number", range(LINES))
def test_a_choosing_constraint_is_nearly_as_quick_as_the_quickest_simple_curve(number):
    line = lines()[number]
    fixed = simple(line)
    quickest = {profile: min(duration(path, profile) for path in fixed) for profile in PROFILES}
    for constraint in CHOOSING:
        path = resolved(number, constraint)
        s = np.linspace(0.0, 1.0, 2001)
        assert np.linalg.norm(forward_kinematics(BOOM, path(s)).position - line(s), axis=-1).max() < 1e-5
        for profile in PROFILES:
            lasts = certified_duration(path, profile)
            assert lasts <= 1.5 * quickest[profile], (constraint, profile)
            assert lasts <= 30.0 or quickest[profile] >= 20.0


@pytest.mark.parametrize("number", range(2))
def test_least_time_is_the_quickest(number):
    others = [*simple(lines()[number]), *(resolved(number, constraint) for constraint in CHOOSING)]
    mine = duration(resolved(number, LeastTime()), "time-optimal")
    assert mine <= 1.02 * min(duration(path, "time-optimal") for path in others)


def test_the_line_that_took_two_minutes():
    """Chosen point by point it kinked: 125 s, and 1.025 times the extension's
    acceleration limit."""
    spec = MoveSpec.of(
        "tip=0.21512145055781914,0.4335041929437723,0.9817923251312756",
        "tip=1.3555020461096687,0.32453656057613717,0.0362866059247251",
        along="line",
        constraint="nearest-horizontal",
        profile="quintic",
    )
    planned = plan_motion(BOOM, spec)
    ratios = {worst.limit: worst.ratio for worst in certify(BOOM, planned.motions).worst}
    assert max(ratios.get(limit, 0.0) for limit in JOINT_LIMITS) <= 1.001
    assert sum(motion.duration for motion in planned.motions) < 10.0


@pytest.mark.parametrize("constraint", CHOOSING, ids=str)
def test_the_departure_that_a_path_tells_is_the_one_it_has(constraint):
    line, path = lines()[0], resolved(0, constraint)
    s = np.linspace(0.0, 1.0, NODES)
    q, chosen = path(s), solve_branches(BOOM, line(s), DOWN, constraint)
    side = int(np.argmin(np.abs(np.nan_to_num(chosen.q[0, :, 0], nan=9.0) - q[0, 0])))
    best = np.where(chosen.within_limits[:, side, None], chosen.q[:, side], q)
    excess = constraint.cost(BOOM, q) - constraint.cost(BOOM, best)
    assert path.departure.most == pytest.approx(max(excess.max(), 0.0), abs=1e-5)
    if path.departure.most > 1e-3:
        assert s[np.argmax(excess)] == pytest.approx(path.departure.s, abs=0.02)
    assert str(constraint) in path.sentence


def test_a_line_starts_where_the_move_before_it_ended():
    line = lines()[0]
    q = inverse_kinematics(BOOM, line.start, DOWN, "least-extension")
    start = q.solutions[q.best].q
    path = follow(BOOM, line, DOWN, LargestMargin(), reference=start)
    np.testing.assert_allclose(path(0.0), start, rtol=0, atol=1e-9)


def test_least_time_of_a_single_target_is_refused():
    with pytest.raises(InputError, match="constraint least-time needs a line or an arc of the tip"):
        plan(BOOM, "transport", "tip=1.4,0,1.0", constraint="least-time")
