"""`boom calibrate`: its answer, its files, its exit codes."""

import json

import numpy as np
import pytest

from boom_model import Boom, forward_kinematics
from boom_model.boom_file import BOOM_FILE
from boom_model.tip_uncertainty import printed_wind_up
from planner.experiments.measurements import READINGS

HEADER = ",".join((*READINGS, "x", "y", "z"))


@pytest.fixture
def measured(tmp_path):
    """A file of 24 poses of a boom whose L2 is 2 mm longer, and all else right."""
    rng, boom = np.random.default_rng(1), Boom.load()
    q = rng.uniform([0.0, 0.1, 0.0, 0.0, -1.5], [6.0, 1.2, 0.0, 1.0, 1.5], (24, 5))
    q[:, 2] = q[:, 1] + rng.uniform(0.5, 1.9, 24)
    tip = forward_kinematics(boom, q).position + rng.normal(size=(24, 3)) * 2e-4
    tip += 0.002 * np.stack([np.cos(q[:, 0]), np.sin(q[:, 0]), np.zeros(24)], axis=-1)
    readings = q + printed_wind_up(boom, q)
    np.savetxt(tmp_path / "measured.csv", np.column_stack([readings, tip]), delimiter=",", header=HEADER, comments="")
    return "measured.csv"


def test_calibrate_answers_in_one_screen_and_writes_a_boom(boom, measured, tmp_path):
    code, out, err = boom("calibrate", measured, "--sd", "0.0002", "--frame", "boom", "--hold", "inner wind-up",
                          "--hold", "lower wind-up", "--out", "mine.toml", "--check", measured)  # fmt: skip
    assert (code, err) == (0, "")
    assert len(out.splitlines()) <= 24
    assert max(map(len, out.splitlines())) <= 80
    assert "mm before" in out
    assert "held as they were" in out
    assert pytest.approx(0.032, abs=1e-3) == Boom.load(tmp_path / "mine.toml").geometry.L2
    shown = boom("info", "--boom", "mine.toml")[1]
    assert "measured: lengths and zeros of the joints: boom calibrate measured.csv: 24" in " ".join(shown.split())


def test_calibrate_as_json_prints_one_object(boom, measured):
    answer = json.loads(boom("calibrate", measured, "--json")[1])
    assert answer["poses"] == 24
    assert {p["name"] for p in answer["parameters"]} >= {"L2", "L4", "yaw offset"}
    assert len(answer["covariance"]) == len(answer["fitted"])
    assert min(answer["singular_values"]) >= 1.0


def test_an_error_beyond_the_tolerance_is_a_no(boom, measured):
    code, _, err = boom("calibrate", measured, "--tolerance", "0.00001")
    assert code == 1
    assert "of 0.01 mm allowed" in err


def test_suggested_poses_are_a_file_to_fill_in(boom, tmp_path):
    code, out, err = boom("calibrate", "--suggest", "12", "--out", "poses.csv")
    assert (code, err) == (0, "")
    lines = (tmp_path / "poses.csv").read_text().splitlines()
    assert lines[0] == HEADER
    assert len(lines) == 13
    assert len(out.splitlines()) <= 24
    code, _, err = boom("calibrate", "poses.csv")
    assert code == 2
    assert "pose 1 has no coordinate" in err


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ("", "nothing to calibrate from: give MEASURED.csv, or --suggest N"),
        ("nowhere.csv", "nowhere.csv: cannot be read: No such file or directory"),
        ("--suggest 30 --out poses.toml", "poses.toml: the suggested poses are written as .csv"),
        ("--suggest 0", "--suggest is 0; it must be from 1 to 500 poses"),
        ("--suggest 5 --lowest 9", "random poses are within the limits of joints, linkage and drives, the tip above 9 m"),
        ("measured.csv --out mine.csv", "mine.csv: the calibrated boom is written as .toml"),
        ("measured.csv --lowest 0.3", "--lowest bounds suggested poses; it needs --suggest N"),
        ("measured.csv --hold L17", "unknown parameter 'L17'"),
        ("measured.csv --target 1,2", "'--target' has 2 numbers; it needs 3"),
        ("measured.csv --linkage equals", "did you mean equal?"),
    ],
)
def test_a_mistake_is_named_in_one_line(boom, measured, typed, said):
    code, out, err = boom("calibrate", *typed.split())
    assert code in (1, 2)
    assert out == ""
    assert said in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("typed", "what"),
    [
        ("export-model boom.urdf", "a URDF"),
        ("export-model boom.xml", "an MJCF"),
        ("control transport phenotyping", "boom control"),
        ("link", "boom link"),
    ],
)
def test_a_job_that_needs_a_parallelogram_says_so(boom, tmp_path, typed, what):
    text = BOOM_FILE.read_text(encoding="utf-8")
    (tmp_path / "mine.toml").write_text(text.replace("L6_m =", "L9_m = 0.998\nL6_m ="), encoding="utf-8")
    code, out, err = boom(*typed.split(), "--boom", "mine.toml")
    assert (code, out) == (2, "")
    assert f"{what} needs a parallelogram" in err
