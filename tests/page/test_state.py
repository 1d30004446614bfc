"""The page's state: what is accepted, what is refused with the last good state kept, and the files
that repeat it."""

import shlex

import numpy as np
import pytest

from boom_model import JOINTS, Boom, forward_kinematics
from planner.checks.rows import Verdict
from planner.missions.mission import load_mission, plan_cycle
from planner.motion.vehicle import load_case
from planner.page import downloads
from planner.page.plans import make_plan, spec_of
from planner.page.state import (
    MOVE,
    TARGET,
    State,
    at_time,
    drive_field,
    edited,
    first_state,
    next_branch,
    solve,
    with_branch,
    with_branches,
    with_plan,
    with_suggestion,
)
from planner.page.vehicle import LEVEL_SLOPE, OWN, Slope
from planner.suggestions import suggestions
from tests.builders import with_running_torque

SMALL = "MST340B02 + CBG320160"


@pytest.fixture(scope="module")
def first() -> State:
    return first_state(Boom.load())


def put(state: State, **texts: str) -> State:
    for name, text in texts.items():
        state = edited(state, name, text)
    return state


def reached(state: State, **texts: str) -> State:
    """The state with a tip target, solved."""
    state = put(state, **texts)
    return with_branches(state, solve(state.boom, state.target, state.q))


def test_the_joints_are_the_fields_in_degrees_and_metres(first):
    state = put(first, yaw="30", inner="40.5", lower="100", extension="0.25", wrist="-20")
    np.testing.assert_allclose(state.q, [*np.radians([30, 40.5, 100]), 0.25, np.radians(-20)], rtol=1e-15)
    assert state.asked["pose"] == "q=30,40.5,100,0.25,-20"
    assert not state.complaints


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("yaw", "nan", "must be finite"),
        ("inner", "190", "above its limit of 120 deg"),
        ("inner", "", "is not a number"),
        ("lower", "50", "coupled limit of 5 deg"),
        ("pose", "fenotyping", "did you mean phenotyping"),
        ("pose", "q=1,2", "it needs 5"),
        ("pose", "q=0,0,200,0,0", "above its limit of 180 deg"),
        ("payload", "-1", "between 0 and 5000 kg"),
        ("payload", "inf", "must be finite"),
        ("roll", "91", "between -90 and 90 deg"),
        ("x", "far", "is not a number of metres"),
        ("pitch", "sideways", "down, level, up, free or degrees"),
        ("constraint", "horizontl", "did you mean horizontal"),
        ("start", "q=1,nan,3,4,5", "must be finite"),
        ("goal", "home", "unknown pose"),
        ("duration", "-2", "between 0.001 and 1e+07 s"),
        ("rate", "nan", "must be finite"),
        ("vehicle", "slpoe", "did you mean slope"),
        ("along", "circle", "unknown along"),
        ("jerk_bound", "yes", "is for the time-optimal profile"),
        ("drive_inner", "BIG", "unknown drive"),
    ],
)
def test_bad_input_is_said_at_its_field_and_the_last_good_state_stays(first, name, text, said):
    state = edited(first, name, text)
    assert said in state.complaints[name]
    assert set(state.complaints) == {name}
    assert state.asked[name] == text
    for kept in ("boom", "joints", "target", "move", "slope"):
        assert getattr(state, kept) is getattr(first, kept)


def test_two_joints_that_are_only_good_together_are_accepted_together(first):
    state = edited(first, "lower", "50")
    assert state.complaints
    state = edited(state, "inner", "20")
    assert not state.complaints
    assert state.joints == (90.0, 20.0, 50.0, 1.0, 0.0)


@pytest.mark.parametrize("constraint", ["horizontal", "extension=0.25", "least-torque"])
def test_a_target_moves_the_tip_there(first, constraint):
    state = reached(first, x="1.4", y="0.1", z="1.0", pitch="-80", constraint=constraint)
    tip = forward_kinematics(state.boom, state.q)
    np.testing.assert_allclose(tip.position, [1.4, 0.1, 1.0], atol=1e-9)
    assert np.degrees(tip.pitch) == pytest.approx(-80.0, abs=1e-7)
    assert not state.complaints


def test_an_unreachable_target_says_so_and_the_boom_stays(first):
    state = reached(first, x="3.4", y="0", z="1.0")
    assert "reached only outside the limits" in state.complaints["x"]
    assert state.joints == first.joints
    assert all(not each.within_limits and each.reasons for each in state.branches.found.solutions)
    state = reached(state, z="9")
    assert "out of reach" in state.complaints["x"]
    assert not reached(state, x="1.4", z="1").complaints


def test_stepping_goes_through_every_branch_within_the_limits(first):
    state = reached(first, x="-1.13", y="-0.72", z="1.11")
    within = [i for i, each in enumerate(state.branches.found.solutions) if each.within_limits]
    assert len(within) > 1
    seen = []
    for _ in within:
        seen.append(state.branches.chosen)
        np.testing.assert_allclose(forward_kinematics(state.boom, state.q).position, [-1.13, -0.72, 1.11], atol=1e-9)
        state = next_branch(state, 1)
    assert sorted(seen) == within
    assert state.branches.chosen == seen[0]
    outside = next(i for i, each in enumerate(state.branches.found.solutions) if not each.within_limits)
    refused = with_branch(state, outside)
    assert refused.joints == state.joints
    assert "limit" in refused.complaints["branch"]


def test_solutions_that_come_too_late_are_dropped(first):
    asked = put(first, x="1.4", y="0", z="1.0")
    late = solve(asked.boom, asked.target, asked.q)
    moved = edited(asked, "x", "1.5")
    assert with_branches(moved, late) is moved


def test_a_swapped_drive_is_the_one_that_its_file_gives(first, tmp_path):
    state = put(first, drive_lower=SMALL, drive_wrist=SMALL, drive_inner="none")
    assert state.boom.drives[1] is None
    file = tmp_path / "boom-page.toml"
    file.write_bytes(downloads.content(state, "boom"))
    assert Boom.load(file).drives == state.boom.drives
    back = put(state, drive_lower="MST342C02 + CBG320160", drive_wrist="none", drive_inner="MST342C02 + CBG320160")
    assert not back.swapped
    assert back.boom.drives == first.boom.drives


def test_a_change_of_the_boom_ends_its_plan(first):
    planned = with_plan(first, make_plan(first.boom, first.move, first.slope))
    assert planned.time == 0.0
    np.testing.assert_array_equal(planned.shown_q, first.boom.pose("transport"))
    for name, text in (("payload", "8"), ("roll", "5"), (drive_field("inner"), SMALL)):
        assert edited(planned, name, text).planned is None
    assert edited(planned, "yaw", "30").time is None
    assert at_time(planned, 99.0).time == planned.planned.duration


def test_the_slope_is_the_vehicle_case_that_its_file_describes(first, tmp_path):
    state = put(first, roll="7.3", nose="-4")
    file = tmp_path / "vehicle-page.toml"
    file.write_bytes(downloads.content(state, "vehicle"))
    assert load_case(str(file)) == state.slope.case


def test_a_named_case_tilts_the_page_and_typing_a_tilt_leaves_it(first):
    state = put(first, vehicle="ditch")
    assert (state.asked["roll"], state.move.vehicle, state.slope.roll) == ("5", "ditch", 5.0)
    assert spec_of(state.move, state.slope).vehicle == load_case("ditch")
    assert "vehicle" not in downloads.files_of(state)
    typed = put(state, nose="2")
    assert (typed.asked["vehicle"], typed.move.vehicle, typed.slope) == (OWN, None, Slope(5.0, 2.0))
    assert put(state, vehicle=OWN).slope == state.slope


def test_raised_limits_are_in_the_boom_that_a_command_reads(first, boom, tmp_path):
    short = put(first, duration="4.9")
    raised = [each for each in suggestions(short.boom, spec_of(short.move, short.slope)) if each.change == "limit"]
    state = with_suggestion(short, raised[0])
    assert state.raised
    assert not state.unwritten
    for kind, name in downloads.files_of(state).items():
        (tmp_path / name).write_bytes(downloads.content(state, kind))
    code, _, error = boom(*shlex.split(downloads.command(state))[1:], "--csv", "shell.csv")
    assert code == 0, error
    state = with_plan(state, make_plan(state.boom, state.move, state.slope))
    assert (tmp_path / "shell.csv").read_bytes() == downloads.content(state, "csv")


def test_the_mission_moves_as_the_plan(first, tmp_path):
    state = put(first, goal="tip=1.4,0,1.0", constraint="extension=0.25", profile="time-optimal", jerk_bound="yes")
    file = tmp_path / "mission-page.toml"
    file.write_bytes(downloads.content(state, "mission"))
    cycle = plan_cycle(state.boom, load_mission(str(file)))
    move = make_plan(state.boom, state.move, state.slope).move
    planned = cycle.legs[0].trajectory
    assert planned.duration == pytest.approx(move.trajectory.duration, rel=1e-12)
    for end in (0, -1):
        np.testing.assert_allclose(planned.q[end], move.trajectory.q[end], atol=1e-12)


@pytest.mark.parametrize(
    "texts",
    [
        {},
        {"payload": "8", "goal": "tip=1.4,0,1.0", "constraint": "extension=0.25", "profile": "time-optimal"},
        {"via": "q=40,60,120,0.3,0; q=60,60,150,0.5,0", "profile": "quintic", "duration": "12.5", "roll": "5"},
        {"via": "q=40,60,120,0.3,0", "pass_via": "yes", "rate": "250", "vehicle": "ditch", "profile": "jerk-limited"},
        {"vehicle": "slope", "roll": "3", "profile": "time-optimal"},
        {"start": "tip=1,1.7,0.9", "goal": "tip=-1,1.7,0.9", "along": "line", "pitch": "-85", "drive_lower": SMALL},
    ],
)
def test_the_command_gives_the_same_motion_to_the_last_digit(first, boom, tmp_path, texts):
    state = put(first, **texts)
    assert not state.complaints
    for kind, name in downloads.files_of(state).items():
        (tmp_path / name).write_bytes(downloads.content(state, kind))
    code, _, error = boom(*shlex.split(downloads.command(state))[1:], "--csv", "shell.csv")
    assert code in (0, 1), error  # 1: a drive fails, and the motion is written all the same
    state = with_plan(state, make_plan(state.boom, state.move, state.slope))
    assert (tmp_path / "shell.csv").read_bytes() == downloads.content(state, "csv")


def test_each_suggestion_makes_the_move_possible():
    weak = with_running_torque(Boom.load(), 4.0)
    short = put(first_state(weak), profile="time-optimal", duration="1")
    heavy = put(first_state(weak), payload="24")
    found = [(state, each) for state in (short, heavy) for each in suggestions(state.boom, spec_of(state.move, state.slope))]
    assert {"duration", "payload", "drive"} <= {each.change for _, each in found}
    for state, each in found:
        helped = with_suggestion(state, each)
        assert not helped.complaints
        move = make_plan(helped.boom, helped.move, helped.slope).move
        assert move.report.verdict is not Verdict.FAIL


def test_a_thousand_random_events_leave_a_state_within_the_limits(first):
    rng = np.random.default_rng(20261124)
    numbers = "nan inf -1e9 0 1 0.5 45 90 180 1e4"
    others = "down free level horizontal extension=0.3 transport tip=1.4,0,1 q=0,60,180,0.2,0 q=1,2 time-optimal line yes track"
    words = ["", SMALL, "none", *numbers.split(), *others.split()]
    names = [*JOINTS, "pose", "payload", "roll", "nose", "vehicle", *TARGET, *MOVE, *map(drive_field, JOINTS)]
    state, accepted = first, 0
    for _ in range(1000):
        name = names[rng.integers(len(names))]
        text = words[rng.integers(len(words))] if rng.random() < 0.6 else f"{rng.uniform(-200.0, 200.0):.3f}"
        before, state = state, edited(state, name, text)
        if name in TARGET and state.target.is_quick:
            state = with_branches(state, solve(state.boom, state.target, state.q))
        state = next_branch(state, 1 if rng.random() < 0.5 else -1)
        assert state.boom.limits.contain(state.q)
        accepted += name not in state.complaints
        if name in state.complaints and name not in ("x", "y", "z"):
            assert (state.boom, state.move, state.slope) == (before.boom, before.move, before.slope)
    assert 200 < accepted < 900
    assert state.slope != LEVEL_SLOPE
