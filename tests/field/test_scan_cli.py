"""The command `boom scan`: the day's recording and report, and a log of the vehicle."""

import json
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader

from tests.field.trials import TRIAL as FORTY
from tests.field.trials import corners
from tests.field.weave import write_weaving_log


def test_scan_records_the_day_and_reports_it(boom, tmp_path):
    (tmp_path / "trial.toml").write_text(FORTY.format(corners=np.degrees(corners()).tolist()))
    asked = ("scan", "trial.toml", "--footprint", "0.5,0.5", "--profile", "cubic", "--speed", "0.5")
    code, out, _ = boom(*asked, "--recording", "scan.rrd", "--report", "scan.html", "--out", "scan.csv")
    assert code == 0
    assert "day: 28.8 min: 18.9 past plots, 6.3 back, 3.6 in turns" in out
    assert "assumed: 4 m turns at 1 m/s" in out
    report = (tmp_path / "scan.html").read_text()
    assert "3 passes a row at 0.5 m/s" in report
    assert report.count("data:image/png") == 1
    assert (tmp_path / "scan.csv").read_text().startswith("plot,row,range,coverage,overlap,time_s,energy_J,reason,wkt")
    entities = set(RrdReader(tmp_path / "scan.rrd").store().schema().entity_paths())
    assert {"/map/plots", "/map/vehicle", "/world/plots", "/world/footprint", "/answer"} <= entities


def test_scan_along_a_log(boom, tmp_path):
    (tmp_path / "trial.toml").write_text(FORTY.format(corners=np.degrees(corners()).tolist()))
    write_weaving_log(tmp_path / "vehicle.csv")
    asked = ("scan", "trial.toml", "--footprint", "0.5,0.5", "--track", "vehicle.csv")
    code, out, error = boom(*asked, "--out", "scan.csv")
    assert code == 1  # one row of ten is driven
    assert "vehicle.csv: 3 passes along 1 rows of trial.toml" in out
    assert "4 of 40 plots seen to 99 % or more" in out
    assert "36 of 40 plots are not reached whole: the vehicle passes 0 times with row 2 on its left" in error
    answer = json.loads(boom(*asked, "--json")[1])
    assert [each["row"] for each in answer["passes"]] == [1, 1, 1]
    code, _, error = boom(*asked, "--speed", "0.5")
    assert code == 2
    assert "--speed does not go with --track: the log gives the track and the speed" in error
    files = ("--mission", "m.toml", "--recording", "log.rrd", "--report", "log.md", "--picture", "log.png", "--out", "log.csv")
    code, out, _ = boom(*asked, *files)
    assert code == 1
    report = (tmp_path / "log.md").read_text()
    assert "FAIL: 36 of 40 plots are not reached whole" in report
    assert "## Ways from line to line" in report
    assert (tmp_path / "log.csv").read_text().startswith("plot,row,range,coverage,overlap,reason,wkt")
    entities = set(RrdReader(tmp_path / "log.rrd").store().schema().entity_paths())
    assert {"/map/plots", "/map/vehicle", "/world/plots", "/world/footprint", "/answer"} <= entities
    code, out, _ = boom("mission", "m.toml")
    assert code == 0
    assert "row scan" in out
    assert "give the log by --track" in boom(*asked[:-2], "--rig", "rig.toml")[2]
    assert "passes are driven at a speed" in boom(*asked[:-2], "--passes", "2")[2]


def test_the_guides_log_is_in_reach(boom, tmp_path):
    place = Path(__file__).parents[2] / "demos" / "field"
    asked = ("scan", place / "row.toml", "--footprint", "0.7,0.5", "--track", place / "row.csv", "--rig", place / "rig.toml")
    code, out, _ = boom(*map(str, asked), "--json", "--mission", "m.toml")
    answer = json.loads(out)
    assert code == 0
    assert min(each["coverage"] for each in answer["plots"]) > 0.99
    assert [each["speed_m_s"] for each in answer["passes"]] == pytest.approx([0.6, 0.6], abs=0.01)
    assert len(answer["ways"]) == 1
    assert (tmp_path / "m.toml").exists()
    code, _, error = boom(*map(str, asked), "--payload", "20")
    assert code == 1
    assert "2 moves FAIL, the first the pass 2.15 m beside the mount: failed: lower gearbox" in error


def test_no_line_in_reach_writes_no_file(boom, tmp_path):
    place = Path(__file__).parents[2] / "demos" / "field"
    asked = (
        "scan",
        place / "trial.toml",
        "--footprint",
        "0.5,0.5",
        "--track",
        place / "vehicle.csv",
        "--rig",
        place / "rig.toml",
    )
    code, _, error = boom(*map(str, asked), "--mission", "m.toml")
    assert code == 1
    assert "no mission and no recording, since no line is reached: 40 of 40 plots are not reached whole: on the line" in error
    assert not (tmp_path / "m.toml").exists()
