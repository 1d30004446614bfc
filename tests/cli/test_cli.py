"""The command: what it prints where, its exit codes, and the files it leaves."""

import json
import os
import re
import sys
from dataclasses import asdict

import numpy as np
import pytest

from boom_model import Boom, Catalogue, inverse_dynamics
from boom_model.boom_file import BOOM_FILE
from planner import Cubic, TimeOptimal, cli, plan
from planner.motion.trajectory import read_csv
from planner.timing.profile import SHORTEST, Profile
from tests.builders import STRONG_CATALOGUE, UNDERSIZED_MISSION, main_move


def test_plan_does_the_main_job(boom, tmp_path):
    code, out, err = boom("plan", "transport", "phenotyping", "--csv", "move.csv")
    assert (code, err) == (0, "")
    assert sorted(os.listdir(tmp_path)) == ["move.csv", "move.rrd"]
    assert "INCOMPLETE: nothing fails; yaw, extension and wrist have no drive to check;" in out
    assert len(out.splitlines()) <= 20
    assert max(map(len, out.splitlines())) <= 80
    assert "assumed: lower bus voltage 80 V" in boom("plan", "transport", "phenotyping", "--all")[1]
    np.testing.assert_array_equal(read_csv("move.csv").q, main_move().trajectory.q)


@pytest.mark.parametrize("profile", [profile.value for profile in SHORTEST])
def test_plan_as_json_prints_one_object(boom, profile):
    code, out, _ = boom("plan", "transport", "tip=1.4,0,1.0", "--constraint", "extension=0.25", "--profile", profile, "--json")
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


def test_the_profiles_to_choose_from_are_the_planners():
    (option,) = [each for each in cli.cli.commands["plan"].params if each.name == "profile"]
    assert list(option.type.words) == [profile.value for profile in Profile]


VIA = ("--via", "q=40,30,90,0.3,-10")


@pytest.mark.parametrize(
    ("options", "same"),
    [
        ((*VIA, "--pass-via", "--profile", "quintic"), {"profile": "quintic", "stop_at_via": False}),
        (
            (*VIA, "--via-velocity", "10,8,15,0.1,-5"),
            {"profile": Cubic.with_velocities([[*np.radians([10.0, 8.0, 15.0]), 0.1, np.radians(-5.0)]])},
        ),
        (
            ("--profile", "time-optimal", "--jerk-bound", "--rate", "50"),
            {"profile": TimeOptimal(jerk_bound=True), "rate": 50.0},
        ),
        (("--profile", "time-optimal", "--average-torque", "--payload", "5"), {"profile": TimeOptimal(average_torque=True)}),
    ],
    ids=["pass-via", "via-velocity", "jerk-bound", "average-torque"],
)
def test_options_of_plan_are_those_of_the_library(boom, options, same):
    code, out, err = boom("plan", "transport", "phenotyping", *options, "--csv", "move.csv", "--json")
    answer = json.loads(out)
    model = Boom.load().with_payload(5.0) if "--payload" in options else Boom.load()
    if "--via" in options:
        same = same | {"via": [np.array([*np.radians([40.0, 30.0, 90.0]), 0.3, np.radians(-10.0)])]}
    move = plan(model, "transport", "phenotyping", **{"profile": answer["profile"]} | same)
    assert err == ""
    np.testing.assert_allclose(read_csv("move.csv").q, move.trajectory.q, rtol=0, atol=1e-12)
    assert answer["duration_s"] == pytest.approx(move.report.duration, rel=1e-12)
    assert code == (1 if answer["verdict"] == "FAIL" else 0)
    certificate = answer["certificate"]
    assert set(certificate) == {"samples", "worst", "iterations", "residual"}
    assert certificate["samples"] >= 5_000
    assert {"position", "lower - inner", "velocity", "acceleration", "motor torque"} <= {
        w["limit"] for w in certificate["worst"]
    }
    for worst in certificate["worst"]:
        assert set(worst) == {"limit", "joint", "ratio", "at_s"}
        assert worst["ratio"] <= 1.001
        assert 0.0 <= (worst["at_s"] or 0.0) <= answer["duration_s"] + 1e-9
    assert answer["stop"] == json.loads(json.dumps(asdict(move.stop)))
    assert set(answer["stop"]) == {"time_s", "time_at_s", "time_way", "distance_m", "distance_at_s", "distance_way"}
    assert (answer["remedies"] == []) == (answer["verdict"] != "FAIL")


def test_certificate_and_stop_are_printed_for_people(boom):
    _, out, _ = boom("plan", "transport", "phenotyping", "--all")
    assert "Worst ratio to each limit" in out
    assert "Certificate: recomputed at 5" in out
    assert "Stopping: at worst " in out


def test_a_plan_that_fails_says_what_would_mend_it(boom):
    hasty = ("plan", "transport", "phenotyping", "--duration", "4.5")
    code, out, err = boom(*hasty)
    assert code == 1
    assert "needs at least 5 s" in err
    assert "possible fix: a duration of 5 s instead of 4.5 s" in out
    code, out, _ = boom(*hasty, "--json")
    answer = json.loads(out)
    assert code == 1
    assert "a duration of 5 s instead of 4.5 s" in answer["remedies"]
    assert answer["verdict"] == "FAIL"


def test_profiles_stand_side_by_side(boom):
    code, out, _ = boom("profiles", "transport", "phenotyping", "--json")
    rows = {row["profile"]: row for row in json.loads(out)["profiles"]}
    assert code == 0
    assert list(rows) == [*SHORTEST, "time-optimal, jerk bound"]
    for name, row in rows.items():
        profile = TimeOptimal(jerk_bound=True) if "bound" in name else name
        report = main_move(profile).full_report
        worst = {each.limit: each.ratio for each in report.certificate.worst}
        assert row["duration_s"] == pytest.approx(report.duration, rel=1e-12)
        assert (row["stop_s"], row["stop_m"]) == (report.stop.time_s, report.stop.distance_m)
        assert row["velocity"] == worst["velocity"] <= 1.001
        assert row["gearbox_torque"] == worst["gearbox torque"]
        assert row["motor_torque"] == worst["motor torque"]
        # The acceleration of a cubic and of both bang-bang laws jumps: it takes an infinite jerk.
        assert (row["jerk"] is None) == (name in ("cubic", "trapezoidal", "time-optimal"))
    # The quintic's jerk peaks at 60 d/T^3 at its ends: the lower link's 150 degrees against its
    # limit decide.
    limits, move = Boom.load().limits, Boom.load().pose("phenotyping") - Boom.load().pose("transport")
    expected = (60.0 * np.abs(move) / rows["quintic"]["duration_s"] ** 3 / limits.jerk).max()
    assert rows["quintic"]["jerk"] == pytest.approx(expected, rel=1e-6)
    code, out, _ = boom("profiles", "transport", "phenotyping")
    assert code == 0
    for name, row in rows.items():
        assert any(name.split(",")[0] in line and f"{row['duration_s']:.3f} s" in line for line in out.splitlines())
    assert all("INCOMPLETE" in line for line in out.splitlines() if " s " in line)


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
    code, out, _ = boom("ik", "1.4", "0", "1.0", "--constraint", "extension=0.25", "--json")
    answer = json.loads(out)
    assert code == 0
    assert set(answer) == {"target", "solutions", "best"}
    np.testing.assert_allclose(answer["solutions"][answer["best"]]["q"], [0, 1.203, 3.097, 0.25, 0.045], atol=5e-4)
    code, out, _ = boom("ik", "1.4", "0", "1.0", "--constraint", "extension=0.25")
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
    code, out, err = boom("ik", "2", "0", "3", "--constraint", "extension=0", "--json")
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
    assert "FAIL: inner gearbox" in out
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
        (("plan", "transport", "phenotyping", "--profile", "fast"), 2, "unknown profile 'fast'; there are: cubic"),
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
        (("plan", "transport", "tip=2,0,3", "--constraint", "extension=0"), 1, "out of reach"),
        (("plan", "transport", "tip=0,2.5,0.8", "--pitch", "up"), 1, "wrist 180 deg is 90 deg above its limit"),
        (
            ("plan", "transport", "tip=1,0,1", "--constraint", "sideways"),
            2,
            "unknown constraint 'sideways'; there are: horizontal",
        ),
        (("ik", "1", "nan", "1"), 2, "position[1] is nan"),
        (("ik", "1", "x", "1"), 2, "'x' is not a valid float"),
        (("ik", "1", "0", "1", "--hodl", "horizontal"), 2, "--hodl"),
        (("torque", "none.csv", "--out", "x.csv"), 2, "none.csv: cannot be read"),
        (("check", "bad.toml"), 2, "bad.toml: lacks the column"),
        (("view", "none.rrd"), 2, "none.rrd"),
        (("plan", "transport", "phenotyping", "--csv", "move.rrd"), 2, "move.rrd: the name must end in .csv"),
        (("plan", "transport", "phenotyping", "--out", "."), 2, "the name must end in .rrd"),
        (("plan", "transport", "phenotyping", "--duration", "2e5"), 2, "needs more than 10,000,000 samples"),
        (("plan", "transport", "phenotyping", "--along", "line"), 2, "is not a tip target"),
        (("check", "twice.csv"), 2, "repeats the column q1"),
        (("plan", "transport", "phenotyping", "--jerk-bound"), 2, "jerk_bound is for the time-optimal profile"),
        (("plan", "transport", "phenotyping", "--average-torque"), 2, "average_torque is for the time-optimal profile"),
        (("plan", "transport", "phenotyping", "--rate", "-5"), 2, "rate is -5 Hz"),
        (("plan", "transport", "phenotyping", "--via-velocity", "1,2,3,4"), 2, "has 4 numbers"),
        (("plan", "transport", "phenotyping", "--via-velocity", "1,2,3,4,5"), 2, "via velocity: 1 given for 0 via"),
        (("profiles", "transport", "parking"), 2, "unknown pose 'parking'"),
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
    assert not out or out.startswith("possible fix: ")
    assert set(os.listdir(tmp_path)) <= {"bad.toml", "twice.csv"}


def test_infeasible_plan_as_json_is_still_one_object(boom):
    code, out, err = boom("plan", "transport", "phenotyping", "--payload", "60", "--profile", "time-optimal", "--json")
    answer = json.loads(out)
    assert code == 1
    assert answer["verdict"] == "FAIL"
    assert answer["reason"] in err


@pytest.mark.parametrize("name", cli.cli.commands)
def test_every_command_has_a_help_text_with_an_example(boom, name):
    code, out, _ = boom(name, "--help")
    assert code == 0
    assert out.startswith(f"Usage: boom {name}")
    assert re.search(rf"\n\n  Examples?:\n(    boom .+\n)*?    boom (.+ )?{name}( .+)?\n", out)
    assert "-q, --quiet" in out


def test_quiet_prints_nothing_but_json_and_complaints(boom):
    move = ("transport", "phenotyping")
    assert boom("plan", *move, "--csv", "move.csv", "-q") == (0, "", "")
    assert os.path.exists("move.rrd")
    for command in (
        ("ik", "1.4", "0", "1.0"),
        ("check", "move.csv"),
        ("torque", "move.csv", "--out", "tau.csv"),
        ("validate",),
    ):
        assert boom(*command, "--quiet") == (0, "", "")
        code, out, err = boom(*command, "--quiet", "--json")
        assert (code, err) == (0, "")
        assert isinstance(json.loads(out), dict)
    assert boom("export", "tau.csv", "tau.json", "-q") == (0, "", "")
    code, out, err = boom("ik", "9", "9", "9", "-q")
    assert (code, out) == (1, "")
    assert "out of reach" in err


def test_mission_checks_a_whole_cycle(boom, tmp_path):
    code, out, err = boom("mission", "field-day", "--picture", "drives.png", "--report", "day.md")
    assert (code, err) == (0, "")
    assert sorted(os.listdir(tmp_path)) == ["day-1.png", "day-2.png", "day-3.png", "day-4.png", "day.md", "drives.png"]
    assert "mission field day" in out
    assert "20 x to tip=-1,1.7,0.9 along line" in boom("mission", "field-day", "--all")[1]
    assert (tmp_path / "drives.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "day.md").read_text().startswith("# Mission field day\n\n4615.751 s, payload 10 kg, level ground\n")
    code, out, _ = boom("mission", "field-day", "--json")
    answer = json.loads(out)
    assert answer["profile"] == "mission field day"
    assert {row["verdict"] for row in answer["checks"]} == {"PASS", "WARN", "INFO", "NOT CHECKABLE"}


def test_missions_stand_side_by_side(boom, tmp_path):
    code, out, _ = boom("mission", "table-2-4", "table-3-1", "--joint", "inner", "--report", "both.md")
    assert code == 0
    assert "table 3-1: INCOMPLETE" in out
    assert re.findall(r"^(yaw|inner|lower|extension|wrist|mount|tip) ", out, flags=re.MULTILINE) == ["inner"]
    assert len(out.splitlines()) <= 24
    listed = boom("mission", "table-2-4", "table-3-1", "--joint", "inner", "--all")[1]
    assert "gearbox" in listed
    assert len(listed.splitlines()) > len(out.splitlines())
    assert "table 2-4: demand of limit" in (tmp_path / "both.md").read_text()
    code, out, _ = boom("mission", "table-2-4", "table-3-1", "--json")
    assert sorted(json.loads(out)["missions"]) == ["table 2-4", "table 3-1"]
    code, _, err = boom("mission", "table-2-4", "table-3-1", "--picture", "x.png")
    assert (code, "it shows one mission" in err) == (2, True)
    code, _, err = boom("mission", "table-2-4", "table-2-4")
    assert (code, "two missions have the same name" in err) == (2, True)
    code, _, err = boom("mission", "table-2-4", "--joint", "elbow")
    assert (code, "unknown joint 'elbow'; there are: yaw" in err) == (2, True)
    assert boom("mission", "field-day", "--payload", "30")[0] == 1  # its gearboxes fail


def test_size_ranks_the_catalogue(boom, tmp_path):
    code, out, err = boom("size", "table-3-1", "--variant", "inner=5.55", "--voltage", "80", "--report", "drives.md")
    assert (code, err) == (0, "")
    assert "as it is: 2.0 kg can be saved on inner, lower\n" in out
    assert "SA3PD-BS3 - - 2 open" in " ".join(out.split())
    assert "not tried: motor QSH8618-65-59-340 and 5 more: no running torque" in " ".join(out.split())
    assert "| inner=5.55 | together |  |  | 2.0 kg |" in (tmp_path / "drives.md").read_text()
    code, out, _ = boom("size", "table-3-1", "--joint", "inner", "--json")
    (choice,) = json.loads(out)["choices"]
    assert choice["ranked"][0]["drive"] == "MST341B02 + CBG320160"
    assert choice["saves_kg"] == pytest.approx(1.0)
    assert boom("size", "table-3-1", "--joint", "inner", "--payload", "30")[0] == 1
    assert boom("size", "table-3-1", "--joint", "elbow")[0] == 2


def test_the_catalogue_is_by_series_and_whole_on_demand(boom):
    code, out, err = boom("catalogue")
    assert (code, err) == (0, "")
    assert len(out.splitlines()) <= 24
    assert "CSF... (20)  50 to 160  25 to 294 Nm" in out
    shipped = Catalogue.load()
    names = [*shipped.motors, *shipped.gearboxes, *shipped.actuators]
    code, whole, _ = boom("catalogue", "--all")
    told = " ".join(whole.split())
    assert (code, [name for name in names if name not in told]) == (0, [])
    assert "Trinamic QMOT QSH8618 manual V1.08, table 2.1" in told
    code, out, _ = boom("catalogue", "--json")
    listed = json.loads(out)
    assert (code, [name for entries in listed.values() for name in entries]) == (0, names)
    assert all(entry["source"] for entries in listed.values() for entry in entries.values())


def test_size_says_which_voltage_no_motor_allows(boom):
    for voltages in (("200",), ("80", "200")):
        options = [part for voltage in voltages for part in ("--voltage", voltage)]
        code, out, _ = boom("size", "table-3-1", "--joint", "inner", "--all", *options)
        assert code == 0  # a servo motor has its own amplifier
        assert "note: 200 V exceeds the limit of every stepper motor (at most 165 V)" in out


def test_size_stands_on_a_slope(boom):
    rows = {}
    for options in ((), ("--vehicle", "slope")):
        code, out, _ = boom("size", "table-3-1", "--joint", "inner", "--json", *options)
        answer = json.loads(out)
        assert (code, any("slope: roll 8.5 deg" in note for note in answer["notes"])) == (0, bool(options))
        rows[options] = {row["check"]: row["demand"] for row in answer["choices"][0]["fitted"]["checks"]}
    level, tilted = rows.values()
    assert tilted["gearbox hold"] != pytest.approx(level["gearbox hold"], rel=1e-3)
    assert boom("size", "table-3-1", "--vehicle", "shock")[0] == 2


def test_size_replans_a_mission_that_the_fitted_drive_cannot_do(boom, tmp_path):
    (tmp_path / "quick.toml").write_text(UNDERSIZED_MISSION)
    (tmp_path / "strong.toml").write_text(STRONG_CATALOGUE)
    asked = ("size", "quick.toml", "--joint", "lower", "--payload", "30", "--catalogue", "strong.toml")
    for adapt in ("nothing", "rescale"):
        code, out, err = boom(*asked, "--adapt", adapt)
        assert (code, out, err.count("\n")) == (1, "", 1)
        assert "the fitted drives cannot do this mission" in err
        assert "--adapt replan" in err
    code, out, _ = boom(*asked, "--adapt", "replan", "--report", "drives.md", "--all")
    assert code == 0
    assert "note: lower, as it is: the fitted drives cannot do the mission" in " ".join(out.split())
    assert "BIG + HUGE (parallel, 80 V), 32.0 kg" in (tmp_path / "drives.md").read_text()


def test_a_catalogue_of_ones_own_adds_to_the_choice(boom, tmp_path):
    losses = "efficiency_percent = 70\nno_load_input_torque_Nm = 0.1\ninput_inertia_kg_m2 = 1e-4\n"
    (tmp_path / "mine.toml").write_text(f'[gearboxes.MINE]\nsource = "mine"\nratio = 100\n{losses}')
    code, out, _ = boom("size", "table-3-1", "--joint", "inner", "--catalogue", "mine.toml", "--json")
    names = {judged["drive"] for judged in json.loads(out)["choices"][0]["ranked"]}
    assert (code, len(names)) == (0, 11 * 12)
    assert "MST342C02 + MINE" in names
    text = BOOM_FILE.read_text().replace('"CBG320160"', '"MINE"')
    (tmp_path / "boom.toml").write_text(text)
    for command in (("ik", "1.4", "0", "1.0"), ("mission", "table-3-1"), ("plan", "transport", "phenotyping")):
        assert boom(*command, "--boom", "boom.toml")[0] == 2
        assert boom(*command, "--boom", "boom.toml", "--catalogue", "mine.toml")[0] == 0


def test_plan_and_check_draw_the_drives(boom, tmp_path):
    boom("plan", "transport", "phenotyping", "--csv", "move.csv", "--picture", "plan.png")
    boom("check", "move.csv", "--picture", "check.png")
    code, _, err = boom("check", "move.csv", "--picture", "check.pdf")
    assert (code, "check.pdf: the page of the drives is written as .png" in err) == (2, True)
    for name in ("plan.png", "check.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")


def test_ik_does_not_import_what_is_slow():
    import subprocess

    code = "import sys, planner.cli; print([m for m in ('scipy', 'toppra', 'ruckig', 'rerun', 'control') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
