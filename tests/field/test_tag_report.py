"""The report of geotags: its tables against the tags, its map against where the points are."""

import csv
import re
from collections import Counter

import numpy as np
import pytest
from matplotlib.collections import EllipseCollection, PathCollection

from boom_model import Boom
from planner.field.log_files import read_joint_log, read_triggers, read_vehicle_log
from planner.field.on_plots import locate_spots, map_at
from planner.field.plot_files import read_plots, write_plots
from planner.field.rig import read_rig
from planner.field.sensor_tags import tag_sensor
from planner.field.tag_pictures import tag_pictures
from tests.field.field_files import write_field
from tests.field.motions import Drive
from tests.field.trials import trial

ASK = ("geotag", "vehicle.csv", "joints.csv", "triggers.csv", "--rig", "rig.toml", "--plots", "plots.geojson")


@pytest.fixture
def day(boom, tmp_path):
    names = write_field(tmp_path, Drive())
    (tmp_path / "triggers.csv").write_text((tmp_path / "triggers.csv").read_text() + "\n1783009999.0,late")
    write_plots(trial()[0], tmp_path / "plots.geojson")
    return boom, names


def test_plots_of_the_report_are_those_of_the_tags(day, tmp_path):
    """Spots counted again from the table of tags."""
    code, out, error = day[0](*ASK, "--report", "tags.md", "--out", "tags.csv")
    assert (code, error) == (0, "")
    assert len(out.splitlines()) <= 24
    assert "report: tags.md" in out
    rows = list(csv.DictReader((tmp_path / "tags.csv").read_text().splitlines()))
    on = [row for row in rows if row["plot"] and float(row["probability"]) > float(row["no_plot_probability"])]
    assert len(on) > 10
    report = (tmp_path / "tags.md").read_text()
    listed = re.findall(r"^\| (\d+-\d+) \| (\d+) \| (\d+) \| (\d+) \| (\d+) \| ([\d.]+) \|$", report, re.MULTILINE)
    assert {name: int(spots) for name, _, _, spots, _, _ in listed} == Counter(row["plot"] for row in on)
    for name, row, rank, _, sure, least in listed:
        assert name == f"{row}-{rank}"
        mine = [float(each["probability"]) for each in on if each["plot"] == name]
        assert (int(sure), float(least)) == (sum(p >= 0.95 for p in mine), pytest.approx(min(mine), abs=6e-4))
    assert f"{40 - len(listed)} plots were not seen." in report
    assert "## Triggers without a tag\n\n- late: " in report
    assert "assumed: ground: a level field of wheat" in report.partition("## Assumptions")[2].partition("## Notes")[0]
    assert "Made by `boom geotag" in report
    assert len(list(tmp_path.glob("tags-*.png"))) == 2


@pytest.mark.parametrize("form", [".html", ".pdf"])
def test_other_forms(form, day, tmp_path):
    assert day[0](*ASK, "--report", f"tags{form}", "--json")[0] == 0
    assert (tmp_path / f"tags{form}").stat().st_size > 50_000


def test_the_map_shows_every_spot_with_its_ellipse(day, tmp_path):
    names = day[1]
    log = read_vehicle_log(names["vehicle"])
    joints, triggers = read_joint_log(names["joints"]), read_triggers(names["triggers"])
    tags = tag_sensor(Boom.load(), read_rig(names["rig"]), log, joints, triggers)
    plots = map_at(read_plots(tmp_path / "plots.geojson"), tags)
    located = locate_spots(plots, tags)
    whole, close = tag_pictures(tags, log, plots, located).values()
    known = tags.known
    (spots,) = (each for each in whole.axes[0].collections if isinstance(each, PathCollection))
    assert np.asarray(spots.get_offsets()) == pytest.approx(plots.plane_of(tags.seen.ecef[known]), abs=1e-3)
    ellipses = [each for each in whole.axes[0].collections if isinstance(each, EllipseCollection)]
    assert [len(each.get_offsets()) for each in ellipses] == [known.sum()] * 2
    # Of an ellipse, the long axis is the first: its end is bearing clockwise from north.
    a, b, bearing = tags.seen.ellipses[0]
    assert (ellipses[1].get_widths()[0], ellipses[1].get_heights()[0]) == pytest.approx((2 * a, 2 * b))
    end = [np.cos(np.radians(ellipses[1].get_angles()[0])), np.sin(np.radians(ellipses[1].get_angles()[0]))]
    assert abs(np.dot(end, [np.sin(bearing), np.cos(bearing)])) == pytest.approx(1.0)
    west, east = close.axes[0].get_xlim()
    assert east - west == pytest.approx(5.0)
    bare = tag_pictures(tags, log)
    assert len(bare) == 2
