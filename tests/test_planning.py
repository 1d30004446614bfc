"""The main job, and its report."""

import json

import numpy as np
import pytest

from boom_model import Boom, FixedExtension, InputError, forward_kinematics
from planner import Profile, TipTarget, Verdict, check, plan

BOOM = Boom.load()


@pytest.mark.parametrize("profile", Profile)
def test_main_job_is_planned_and_checked(profile):
    move = plan(BOOM, "transport", "phenotyping", profile=profile)
    np.testing.assert_array_equal(move.trajectory.q[0], BOOM.pose("transport"))
    np.testing.assert_allclose(move.trajectory.q[-1], BOOM.pose("phenotyping"), atol=1e-14)
    assert move.report.verdict is Verdict.INCOMPLETE  # joints 1, 4 and 5 have no drive
    assert not [r for r in move.report.rows if r.verdict is Verdict.FAIL]
    assert move.loads.tau.shape == move.trajectory.q.shape


def test_profiles_take_the_thesis_5_s_and_less():
    durations = {p: plan(BOOM, "transport", "phenotyping", profile=p).report.duration for p in Profile}
    assert durations["cubic"] == pytest.approx(5.0, rel=1e-12)
    assert durations["time-optimal"] == pytest.approx(150 / 45 + 1.0, rel=1e-6)
    assert durations["jerk-limited"] == pytest.approx(150 / 45 + 1.0 + 0.5, rel=1e-9)


def test_tip_to_tip_reaches_both_tips():
    start, goal = TipTarget((1.4, 0.2, 1.0)), TipTarget((0.35, 1.7, 0.8))
    move = plan(BOOM, start, goal, hold=FixedExtension(0.4), pitch=-1.2)
    tips = forward_kinematics(BOOM, move.trajectory.q[[0, -1]])
    np.testing.assert_allclose(tips.position, [start.position, goal.position], atol=1e-14)
    np.testing.assert_allclose(tips.pitch, -1.2, atol=1e-14)


def test_start_equal_to_goal_is_an_empty_move_and_says_so():
    move = plan(BOOM, "transport", BOOM.pose("transport"))
    assert move.report.duration == 0.0
    assert move.trajectory.t.shape == (1,)
    assert "empty move" in move.report.notes[0]
    assert move.report.verdict is Verdict.INCOMPLETE


def test_report_is_made_on_a_grid_ten_times_finer_than_the_samples():
    coarse = plan(BOOM, "transport", "phenotyping", step=0.5)
    peak = {r.check: r.demand for r in coarse.report.rows if r.joint == "inner"}["gearbox repeated peak"]
    fine = {
        r.check: r.demand
        for r in check(BOOM, plan(BOOM, "transport", "phenotyping", step=0.05).trajectory).rows
        if r.joint == "inner"
    }
    assert peak == pytest.approx(fine["gearbox repeated peak"], rel=1e-12)


def test_every_assumed_figure_is_in_the_report():
    report = plan(BOOM, "transport", "phenotyping", profile="jerk-limited").report
    assert len(report.assumptions) == 5 * 3 + 2 * 3 + 1
    for expected in (
        "yaw velocity limit 30 deg/s",
        "extension jerk limit 0.6 m/s^3",
        "lower bus voltage 80 V",
        "inner wiring parallel",
    ):
        assert any(a.startswith(expected) for a in report.assumptions)
        assert expected in report.to_markdown()


def test_report_as_json_has_the_documented_form():
    report = plan(BOOM, "transport", "phenotyping").report
    answer = json.loads(json.dumps(report.to_json({"recording": "x.rrd"}), allow_nan=False))
    assert {"profile", "duration_s", "verdict", "checks", "files"} <= set(answer)
    keys = {"joint", "check", "demand", "limit", "unit", "margin", "required_margin", "at_s", "verdict", "basis", "source"}
    assert all(set(row) == keys for row in answer["checks"])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"profile": "septic"}, "profile is 'septic'"),
        ({"duration": 0.0}, "duration is 0 s"),
        ({"duration": np.nan}, "duration is nan"),
        ({"step": -1.0}, "step is -1"),
        ({"pitch": np.inf, "goal": TipTarget((1.4, 0.0, 1.0))}, "pitch is inf"),
        ({"goal": [0.0, np.nan, 1.0, 0.0, 0.0]}, r"joint position\[1\] is nan"),
        ({"goal": [0.0, 1.0]}, "joint position has shape"),
    ],
)
def test_bad_input_is_named(arguments, message):
    with pytest.raises(InputError, match=message):
        plan(BOOM, "transport", **({"goal": "phenotyping"} | arguments))
