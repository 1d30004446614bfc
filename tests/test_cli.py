"""The command: what it prints where, its exit codes, and the files it leaves."""

import json
import os
import sys

import numpy as np
import pytest

from boom_model import Boom, inverse_dynamics
from boom_model.boom_file import BOOM_FILE
from planner import cli, plan, read_csv


@pytest.fixture
def boom(tmp_path, monkeypatch, capsys):
    """Runs the command in an empty folder; returns exit code, standard output and standard error."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["boom", *arguments])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        captured = capsys.readouterr()
        return stop.value.code or 0, captured.out, captured.err

    return run


def test_plan_does_the_main_job(boom, tmp_path):
    code, out, err = boom("plan", "transport", "phenotyping", "--csv", "move.csv")
    assert (code, err) == (0, "")
    assert sorted(os.listdir(tmp_path)) == ["move.csv", "move.rrd"]
    assert "not checkable for want of data: yaw, inner, lower, extension, wrist, mount" in out
    assert "Assumed: lower bus voltage 80 V" in out
    expected = plan(Boom.load(), "transport", "phenotyping")
    np.testing.assert_array_equal(read_csv("move.csv").q, expected.trajectory.q)


@pytest.mark.parametrize("profile", ["cubic", "time-optimal", "jerk-limited"])
def test_plan_as_json_prints_one_object(boom, profile):
    code, out, _ = boom("plan", "transport", "tip=1.4,0,1.0", "--hold", "extension=0.25", "--profile", profile, "--json")
    answer = json.loads(out)
    assert code == 0
    assert answer["profile"] == profile
    assert answer["verdict"] == "INCOMPLETE"
    assert answer["files"] == {"recording": "move.rrd"}
    assert 1.0 < answer["duration_s"] < 10.0


def test_plan_takes_payload_duration_and_boom(boom, tmp_path):
    text = BOOM_FILE.read_text().replace("phenotyping =", "working =")
    (tmp_path / "mine.toml").write_text(text)
    options = ("--boom", "mine.toml", "--payload", "5", "--duration", "7", "--out", "x.rrd", "--json")
    code, out, _ = boom("plan", "transport", "working", *options)
    assert code == 0
    light = plan(Boom.load().with_payload(5.0), "transport", "phenotyping", duration=7.0).report
    assert json.loads(out)["checks"] == json.loads(json.dumps(light.to_json({})))["checks"]


def test_vehicle_is_taken_by_plan_and_check(boom):
    code, out, _ = boom("plan", "transport", "phenotyping", "--vehicle", "slope", "--csv", "move.csv", "--json")
    planned = json.loads(out)
    assert code == 0
    assert "slope: roll 8.5 deg" in planned["notes"][0]
    code, out, _ = boom("check", "move.csv", "--vehicle", "slope", "--json")
    holds = [
        next(row["demand"] for row in answer["checks"] if (row["joint"], row["check"]) == ("yaw", "drive worst hold"))
        for answer in (planned, json.loads(out))
    ]
    assert holds[0] == pytest.approx(holds[1], rel=1e-3)
    assert holds[0] > 5.0
    code, _, err = boom("check", "move.csv", "--vehicle", "swamp")
    assert (code, "unknown vehicle case 'swamp'" in err) == (2, True)


def test_empty_move_is_said_so(boom):
    code, out, _ = boom("plan", "transport", "transport")
    assert code == 0
    assert "empty move" in out


def test_ik_lists_every_branch(boom):
    code, out, _ = boom("ik", "1.4", "0", "1.0", "--hold", "extension=0.25", "--json")
    answer = json.loads(out)
    assert code == 0
    assert set(answer) == {"target", "solutions", "best"}
    np.testing.assert_allclose(answer["solutions"][answer["best"]]["q"], [0, 1.203, 3.097, 0.25, 0.045], atol=5e-4)
    code, out, _ = boom("ik", "1.4", "0", "1.0", "--hold", "extension=0.25")
    assert code == 0
    assert "68.9229" in out


def test_ik_says_which_drive_cannot_hold_the_payload(boom):
    _, light, _ = boom("ik", "2.6", "0", "0.5", "--json")
    _, heavy, _ = boom("ik", "2.6", "0", "0.5", "--payload", "40", "--json")
    told = [solution["reasons"] for solution in json.loads(heavy)["solutions"] if solution["within_limits"]]
    held = inverse_dynamics(
        Boom.load().with_payload(40.0), json.loads(heavy)["solutions"][1]["q"], np.zeros(5), np.zeros(5)
    ).tau
    assert f"lower must hold {held[2]:.4g} Nm, and its drive allows 455.5 Nm" in told[0]
    assert [s["reasons"] for s in json.loads(light)["solutions"] if s["within_limits"]] == [[]]


def test_ik_takes_negative_numbers(boom):
    code, out, _ = boom("ik", "-1.4", "-1e-3", "1.0", "--pitch", "-90", "--json")
    assert code == 0
    assert json.loads(out)["target"]["position_m"] == [-1.4, -0.001, 1.0]


def test_ik_out_of_reach_is_a_reasoned_no(boom):
    code, out, err = boom("ik", "2", "0", "3", "--hold", "extension=0", "--json")
    answer = json.loads(out)
    assert code == 1
    assert (answer["solutions"], answer["best"]) == ([], None)
    assert "out of reach" in answer["reason"]
    assert err == f"boom: {answer['reason']}\n"


def test_torque_appends_the_torques(boom, tmp_path):
    boom("plan", "transport", "phenotyping", "--csv", "move.csv")
    code, out, _ = boom("torque", "move.csv", "--out", "tau.csv", "--payload-as", "force")
    assert code == 0
    assert "csv: tau.csv" in out
    header, first = (tmp_path / "tau.csv").read_text().splitlines()[:2]
    tau = dict(zip(header.split(","), map(float, first.split(",")), strict=True))
    assert tau["tau2"] == pytest.approx(220.3, abs=0.05)


def test_check_of_a_motion_outside_the_limits_reports_and_fails(boom):
    boom("plan", "transport", "phenotyping", "--csv", "move.csv")
    code, out, _ = boom("check", "move.csv", "--payload", "60")
    assert code == 1
    assert "FAIL: failed: inner gearbox" in out
    code, out, _ = boom("check", "move.csv", "--json")
    assert code == 0
    assert json.loads(out)["profile"] == "recorded"


def test_validate_holds(boom):
    code, out, _ = boom("validate", "--json")
    answer = json.loads(out)
    assert code == 0
    assert answer["ok"] is True
    assert set(answer["rows"][0]) == {"table", "row", "quantity", "expected", "actual", "tolerance", "ok", "note"}
    code, out, _ = boom("validate")
    assert "182 of 182 rows hold" in out


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("plan", "transport", "parking"), 2, "unknown pose 'parking'"),
        (("plan", "transport"), 2, "Missing argument 'GOAL'"),
        (("plan", "transport", "phenotyping", "--profile", "fast"), 2, "'fast' is not one of"),
        (("plan", "transport", "phenotyping", "--duration", "nan"), 2, "duration is nan"),
        (("plan", "transport", "phenotyping", "--duration", "1"), 1, "needs at least 5 s"),
        (("plan", "transport", "phenotyping", "--payload", "-1"), 2, "payload is -1"),
        (("plan", "transport", "phenotyping", "--payload", "60", "--profile", "time-optimal"), 1, "only to hold its load"),
        (("plan", "transport", "phenotyping", "--out", "none/x.rrd"), 2, "none/x.rrd: cannot be written"),
        (("plan", "transport", "phenotyping", "--csv", "none/x.csv"), 2, "none/x.csv: cannot be written"),
        (("plan", "transport", "phenotyping", "--boom", "none.toml"), 2, "none.toml: cannot be read"),
        (("plan", "transport", "phenotyping", "--boom", "bad.toml"), 2, "bad.toml: key name is missing"),
        (("plan", "transport", "q=0,1,2"), 2, "has 3 numbers"),
        (("plan", "transport", "q=0,130,180,0,0"), 1, "inner 130 deg is 10 deg above"),
        (("plan", "transport", "tip=2,0,3", "--hold", "extension=0"), 1, "out of reach"),
        (("plan", "transport", "tip=0,2.5,0.8", "--pitch", "up"), 1, "wrist 180 deg is 90 deg above its limit"),
        (("plan", "transport", "tip=1,0,1", "--hold", "sideways"), 2, "hold 'sideways' is not known"),
        (("ik", "1", "nan", "1"), 2, "position[1] is nan"),
        (("ik", "1", "x", "1"), 2, "'x' is not a valid float"),
        (("ik", "1", "0", "1", "--hodl", "horizontal"), 2, "--hodl"),
        (("torque", "none.csv", "--out", "x.csv"), 2, "none.csv: cannot be read"),
        (("check", "bad.toml"), 2, "bad.toml: lacks the column"),
        (("view", "none.rrd"), 2, "none.rrd"),
        (("plan", "transport", "phenotyping", "--csv", "move.rrd"), 2, "it is to hold two things"),
        (("plan", "transport", "phenotyping", "--out", "."), 2, "cannot be written"),
        (("plan", "transport", "phenotyping", "--duration", "1e9"), 2, "make more than 10,000,000 samples"),
        (("plan", "transport", "phenotyping", "--along", "line"), 2, "is no tip target"),
        (("check", "twice.csv"), 2, "has twice the column q1"),
        (("dance",), 2, "No such command 'dance'"),
    ],
)
def test_bad_input_gets_one_line_and_its_code_and_leaves_no_file(boom, tmp_path, arguments, code, message):
    (tmp_path / "bad.toml").write_text("x = 1\n")
    (tmp_path / "twice.csv").write_text("t,q1,q1,q2,q3,q4,q5\n0,0,0,0,0,0,0\n")
    answer, out, err = boom(*arguments)
    assert answer == code
    assert message in err
    assert err.startswith("boom: ")
    assert err.count("\n") == 1
    assert out == ""
    assert set(os.listdir(tmp_path)) <= {"bad.toml", "twice.csv"}


def test_infeasible_plan_as_json_is_still_one_object(boom):
    code, out, err = boom("plan", "transport", "phenotyping", "--payload", "60", "--profile", "time-optimal", "--json")
    answer = json.loads(out)
    assert code == 1
    assert answer["verdict"] == "FAIL"
    assert answer["reason"] in err


def test_every_command_has_a_help_text(boom):
    for name in cli.cli.commands:
        code, out, _ = boom(name, "--help")
        assert code == 0
        assert out.startswith(f"Usage: boom {name}")


def test_ik_does_not_import_what_is_slow():
    import subprocess

    code = "import sys, planner.cli; print([m for m in ('scipy', 'toppra', 'ruckig', 'rerun', 'control') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
