"""What a study measures, what it calls a failure, and how the command reports it."""

import json
from dataclasses import replace

import numpy as np
import pytest

from boom_model import JOINTS, Boom, InputError
from planner import plan
from planner.control import Controller, Figures, Goals, Outcome, Setup, Shaper, study
from planner.control.study import _outcome, _overshoot, _residual
from planner.recording import write_control_recording
from tests.builders import main_move, with_running_torque
from tests.recordings import recorded_entities, recorded_rows

BOOM = Boom.load()


@pytest.fixture(scope="module")
def moves():
    return [main_move(profile) for profile in ("cubic", "jerk-limited")]


@pytest.fixture(scope="module")
def found(moves):
    return study(BOOM, moves, [Controller.PID, Controller.STEPPER], [Shaper.NONE, Shaper.ZV], Setup(hold=1.0))


def test_residual_vibration_is_the_amplitude_of_a_swing_on_a_slow_creep():
    t = np.arange(0.0, 2.0, 1e-3)
    swing = 3e-3 * np.sin(2.0 * np.pi * 5.0 * t)
    off = np.stack([swing, 0.01 * t, np.full_like(t, 0.02)], axis=-1)
    np.testing.assert_allclose(_residual(off, 200), 3e-3, rtol=1.3e-5)
    assert _residual(off[:, [1, 1, 2]], 200) < 1e-5
    assert _residual(off[:100], 200) == 0.0


def test_overshoot_is_the_largest_joints_share_of_its_way():
    command = np.linspace([0.0, 0.0, 0.0, 0.0, 0.0], [1.0, -2.0, 0.0, 0.5, 0.0], 100)
    q = np.concatenate([command, np.repeat(command[-1:], 100, axis=0)])
    q[110, 1] -= 0.1
    np.testing.assert_allclose(_overshoot(q, np.concatenate([command, q[100:]]), 20), 0.05, rtol=1e-12)


def test_every_case_has_a_row_with_its_figures(found, moves):
    assert [(r.profile, r.shaper, r.controller) for r in found.rows] == [
        (profile, shaper, controller)
        for profile in ("cubic", "jerk-limited")
        for shaper in ("none", "zv")
        for controller in ("pid", "stepper")
    ]
    assert not found.failed
    for b, row in enumerate(found.rows):
        assert row.outcome is Outcome.FOLLOWS
        np.testing.assert_allclose(row.tip_error_peak_m, found.tip_error[:, b].max(), rtol=1e-12)
        error = found.run.q[:, b] - found.run.command[:, b]
        np.testing.assert_allclose(row.joint_error_peak, np.abs(error).max(axis=0), rtol=1e-12)
        assert 0.3 < row.peak_torque_ratio < 0.7
        assert 8e-3 < row.tip_error_end_m < 9.5e-3  # the sag
    np.testing.assert_allclose(found.modes_Hz, [5.478, 13.151], atol=2e-3)
    np.testing.assert_allclose(found.gearbox_Hz, [6.303, 10.712], atol=2e-3)


def test_a_shaper_costs_half_a_period_and_takes_the_vibration_away(found):
    rows = {(r.profile, r.shaper, r.controller): r for r in found.rows}
    plain, shaped = (rows["cubic", shaper, "stepper"] for shaper in ("none", "zv"))
    np.testing.assert_allclose(shaped.duration_s - plain.duration_s, 0.5 / found.modes_Hz[0], rtol=1e-3)
    assert plain.residual_vibration_m > 8e-4
    assert shaped.residual_vibration_m < 0.15 * plain.residual_vibration_m
    assert rows["jerk-limited", "none", "stepper"].residual_vibration_m < 0.2 * plain.residual_vibration_m


def test_the_report_names_what_is_assumed_and_what_is_not_known(found):
    text = found.to_markdown()
    assert "structural_damping 0.02: damping ratio" in text
    assert "yaw, extension, wrist: no drive is given" in text
    assert "NOT CHECKABLE" in text
    answer = json.loads(json.dumps(found.to_json({}), allow_nan=False))
    assert len(answer["cases"]) == 8
    assert answer["designs"][0]["stable"] is True
    assert answer["designs"][0]["margins"][1]["joint"] == "inner"


def short(controller, arm=BOOM, **setup):
    move = plan(BOOM, "phenotyping", [np.pi / 2.0, 1.0, 3.0, 0.9, 0.0])
    return study(arm, [move], [controller], [Shaper.NONE], Setup(hold=0.3, compensate_sag=True, **setup)).rows[0]


def test_gains_that_are_too_high_are_unstable():
    row = short(Controller.PID, goals=Goals.of(bandwidth_Hz=60.0))
    assert row.outcome is Outcome.UNSTABLE
    assert row.tip_error_peak_m is None


def test_a_loop_that_its_poles_alone_betray_is_unstable(found):
    assert _outcome(found.run, 0, found.designs[0], 0.0)[0] is Outcome.FOLLOWS
    slow = replace(found.designs[0], largest_pole=1.00001)  # grows by 1 % a second: not yet seen in the simulation
    outcome, reason = _outcome(found.run, 0, slow, 0.0)
    assert outcome is Outcome.UNSTABLE
    assert reason == "discrete-time pole of magnitude 1.000010 along the move"


def test_a_move_that_asks_more_than_a_motor_has_saturates_it():
    row = short(Controller.PID, with_running_torque(BOOM, 1.27))
    assert row.outcome is Outcome.SATURATES
    assert row.peak_torque_ratio > 1.0
    assert 0.0 < row.saturated_share < 1.0
    assert row.reason.startswith("lower: the motor is saturated for")


def test_a_load_that_beats_a_steppers_pull_loses_steps():
    row = short(Controller.STEPPER, payload_error=60.0)
    assert row.outcome is Outcome.LOST_STEP
    assert row.reason.startswith(("lower: the motor loses its first step", "inner: the motor loses its first step"))


def test_a_rigid_boom_has_no_modes_and_no_shaper(moves):
    rigid = Setup(elastic=False, hold=0.1)
    with pytest.raises(InputError, match="an input shaper has no mode to suppress"):
        study(BOOM, moves[:1], [Controller.PID], [Shaper.ZV], rigid)
    with pytest.raises(InputError, match="at least one move"):
        study(BOOM, [], [Controller.PID], [Shaper.NONE])
    found = study(BOOM, [plan(BOOM, "phenotyping", "phenotyping")], [Controller.PD], [Shaper.NONE], rigid)
    assert found.modes_Hz == ()
    assert found.rows[0].residual_vibration_m is None
    assert "no natural frequencies" in found.to_markdown()


def test_friction_and_a_wrong_payload_are_the_controllers_to_bear():
    smooth = Figures.of({"friction_share": 0.0})
    rows = [short(Controller.PD, figures=f, payload_error=e) for f, e in ((smooth, 0.0), (Figures.of(), 0.0), (smooth, 3.0))]
    for worse in rows[1:]:
        assert worse.tip_error_rms_m > 3.0 * rows[0].tip_error_rms_m


# The command

QUICK = ("control", "phenotyping", "q=90,57,175,0.95,0", "--set", "rate_Hz=500")


def test_the_command_reports_and_leaves_its_files(boom, tmp_path):
    files = ("--out", "c.rrd", "--loops", "l.png", "--errors", "e.png")
    code, out, err = boom(*QUICK, "--controller", "pid,computed-torque", "--shaper", "none,zv", "--all", *files)
    assert (code, err) == (0, "")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["c.rrd", "e.png", "l.png"]
    assert "4 of 4 cases: follows" in out
    assert "assumed: structural_damping 0.02" in out
    assert "note: given: rate_Hz 500" in out
    assert (tmp_path / "l.png").read_bytes().startswith(b"\x89PNG")


def test_all_controllers_of_a_rigid_boom_are_those_that_it_can_have(boom):
    code, out, err = boom(*QUICK, "--rigid-joints", "--all")
    assert (code, err) == (0, "")
    assert "4 of 4 cases: follows" in out
    assert "note: stepper: left out" in out


def test_a_boom_that_topples_on_its_springs_is_no_answer(boom):
    code, out, err = boom(*QUICK, "--controller", "pid", "--set", "inner_height_mm=0.5")
    assert (code, out) == (1, "")
    assert "the boom is unstable under its weight with the motors fixed" in err
    assert err.count("\n") == 1


def test_a_move_through_a_target_is_followed(boom):
    options = ("--controller", "pid", "--via", "q=90,58.5,177,0.975,0", "--json")
    stops, passes = (json.loads(boom(*QUICK, *options, *more)[1])["cases"][0] for more in ((), ("--pass-via",)))
    assert stops["outcome"] == passes["outcome"] == "follows"
    assert passes["duration_s"] < stops["duration_s"]


def test_a_gust_that_was_given_is_not_called_assumed(boom):
    _, out, _ = boom(*QUICK, "--controller", "pid", "--gust", "0,0,-30,0.1,0.2", "--all")
    assert "gust on the tip: at most (0.0, 0.0, -30.0) N, from 0.1 s for 0.2 s (given)" in " ".join(out.split())


def test_the_command_fails_where_the_boom_does(boom, tmp_path):
    code, out, _ = boom(*QUICK, "--controller", "stepper", "--payload-error", "60", "--json")
    answer = json.loads(out)
    assert (code, answer["ok"]) == (1, False)
    assert answer["cases"][0]["outcome"] == "LOST STEP"
    code, out, _ = boom(*QUICK, "--controller", "pid", "--bandwidth", "60")
    assert code == 1
    assert "UNSTABLE" in out
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ("--controller", "pdd"),
            "unknown controller 'pdd'; did you mean pd? There are: pd, pid, computed-torque, lqr, stepper, or all",
        ),
        (("--profile", "cubic,slow"), "unknown profile 'slow'"),
        (("--set", "rate=5"), "unknown figure 'rate'"),
        (("--bandwidth", "-1"), "bandwidth is -1 Hz; it must be between 0.001 and 100000 Hz"),
        (("--gust", "1,2"), "is not FX,FY,FZ,START,DURATION"),
        (("--settle-mm", "nan"), "settle-mm is nan"),
        (("--payload-error", "-20"), "payload is -10"),
        (("--controller", "stepper", "--loops", "x.png"), "no Bode diagram"),
        (("--errors", "x.jpg"), "a picture is written as .png"),
        (("--payload-error", "nan"), "payload-error is nan kg"),
        (("--rigid-joints", "--controller", "stepper"), "no joint is elastic"),
        (("--controller", "pid", "--gust", "0,0,-30,50,1"), "gust from 50 s to 51 s; it must lie within the simulated 0 to "),
        (("--controller", "pid", "--gust", "0,0,-30,-1,0.5"), "gust from -1 s to -0.5 s; it must lie within"),
    ],
)
def test_bad_input_is_named(boom, tmp_path, options, message):
    code, out, err = boom(*QUICK, *options)
    assert (code, out) == (2, "")
    assert message in err
    assert len(err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_the_recording_holds_every_case(found, tmp_path):
    path = tmp_path / "c.rrd"
    write_control_recording(path, found)
    entities = recorded_entities(path)
    for row in found.rows:
        place = f"{row.profile}/{row.shaper}"
        assert {f"/{kind}/{place}/{joint}" for kind in ("error", "torque") for joint in JOINTS} <= entities
    assert {"/report", "/pictures/loops", "/pictures/errors", "/world/boom/tip"} <= entities
    torque = np.array(recorded_rows(path, "/torque/cubic/none/inner", "Scalars:scalars"))
    np.testing.assert_array_equal(torque[:, :2], found.run.torque[::5, :2, 1])
    np.testing.assert_array_equal(torque[:, 2], found.run.limit[::5, :2, 1].min(axis=1))
    error = recorded_rows(path, "/error/cubic/none/inner", "Scalars:scalars")
    np.testing.assert_array_equal(error, np.degrees(found.run.q - found.run.command)[::5, :2, 1])
    values = recorded_rows(path, "/tip_error/cubic/none", "Scalars:scalars")
    np.testing.assert_array_equal(values, 1e3 * found.tip_error[::5, :2])
