"""The first tab of a recording: the answer is the JSON's, the lanes are the motion's."""

import json
import re

import numpy as np
import pytest

from boom_model import Boom
from planner import TimeOptimal, plan
from planner.recording import write_recording
from planner.recording.joint_plots import position_plots
from planner.recording.layout import PlotTab
from planner.recording.palette import LIMIT_COLOR
from planner.recording.plots import scale_of
from planner.recording.states import AT_LIMIT, active_limits, lanes, phases
from planner.reports.answer import joint_table
from tests.recordings import recorded_rows

BOOM = Boom.load()


def static(path, entity, component):
    ((value,),) = recorded_rows(path, entity, component, static=True)
    return value


def move(profile):
    return plan(BOOM, "transport", "phenotyping", profile=profile)


def test_the_numbers_of_the_first_tab_are_those_of_the_json(boom):
    code, out, _ = boom("plan", "transport", "phenotyping", "--out", "move.rrd", "--json")
    assert code == 0
    answer = json.loads(out)
    text = static("move.rrd", "/answer", "TextDocument:text")
    assert text.startswith(f"# {answer['verdict']}\n")
    assert f"{answer['duration_s']:.3f} s" in text
    rows = {(row["joint"], row["check"]): row for row in answer["checks"]}
    table = re.findall(r"^\| (\w+) \| ([\d.]+) (?:Nm|N|mm) \| ([\w ]+|-) \| ([\d.]+|-) \|", text, flags=re.MULTILINE)
    assert [joint for joint, *_ in table] == ["yaw", "inner", "lower", "extension", "wrist", "mount", "tip"]
    carried = {peak["joint"]: abs(peak["total"]) for peak in answer["torque_peaks"]}
    carried |= {"mount": rows["mount", "peak moment"]["demand"], "tip": 1e3 * rows["tip", "deflection in all"]["demand"]}
    for joint, load, check, used in table:
        assert float(load) == pytest.approx(carried[joint], rel=1e-3)
        if check != "-":
            row = rows[joint, check]
            share = row["demand"] * (1.0 + row["required_margin"]) / row["limit"]
            assert float(used) == pytest.approx(share, abs=0.005)


def test_the_recording_tells_what_was_asked(boom):
    boom("plan", "transport", "phenotyping", "--payload", "8", "-q")
    told = {name: static("move.rrd", "/__properties/boom", name) for name in ("payload_kg", "verdict", "command", "versions")}
    assert (told["payload_kg"], told["verdict"]) == (8.0, "INCOMPLETE")
    assert told["command"] == "boom plan transport phenotyping --payload 8 -q"
    assert "rerun-sdk 0." in told["versions"]


def test_a_time_optimal_move_is_at_a_limit_nearly_always():
    fast = move(TimeOptimal())
    met = np.array([limit != "none" for limit in active_limits(fast)])
    assert met.mean() > 0.95
    slow = plan(BOOM, "transport", "phenotyping", duration=20.0)
    assert set(active_limits(slow)) == {"none"}


@pytest.mark.parametrize("profile", ["cubic", "trapezoidal", "jerk-limited"])
def test_phases_are_those_of_the_speed(profile):
    found = move(profile)
    named = phases(found)
    order = list(dict.fromkeys(named))
    steady = [] if profile == "cubic" else ["steady"]
    assert [each for each in order if each != "at rest"] == ["accelerating", *steady, "braking"]
    speed = (np.abs(found.trajectory.qd) / BOOM.limits.velocity).max(axis=-1)
    for k in range(len(speed) - 1):
        if named[k] in ("accelerating", "braking"):
            assert (speed[k + 1] > speed[k]) == (named[k] == "accelerating")


def test_a_limit_that_is_named_is_met():
    found = move("jerk-limited")
    for k, named in enumerate(active_limits(found)):
        if named.startswith("velocity"):
            i = ["yaw", "inner", "lower", "extension", "wrist"].index(named.split()[-1])
            assert abs(found.trajectory.qd[k, i]) >= AT_LIMIT * BOOM.limits.velocity[i] - 1e-12


def test_brakes_are_engaged_at_rest():
    (brakes,) = (lane for lane in lanes(move("cubic")) if lane.entity == "states/brakes")
    assert brakes.states[0] == brakes.states[-1] == "engaged"
    assert set(brakes.states[1:-1]) == {"released"}


def test_the_table_is_the_answers(tmp_path):
    found = move("cubic")
    write_recording(tmp_path / "move.rrd", found)
    text = static(tmp_path / "move.rrd", "/answer", "TextDocument:text")
    for row in joint_table(found.report):
        assert f"| {' | '.join(row)} |" in text


@pytest.mark.parametrize(
    ("values", "ends"),
    [((5.0, 180.0), None), ((-60.0, 180.0), (-100.0, 200.0)), ((0.0, 0.22), (0.0, 0.3)), ((0.0, 600.0), None)],
)
def test_an_axis_has_several_numbers(values, ends):
    axis = scale_of([np.array(values)])
    if ends is None:
        assert axis is None
        return
    (shown,) = axis.range.as_arrow_array().to_pylist()
    beside = 0.03 * (ends[1] - ends[0])
    np.testing.assert_allclose(shown, [ends[0] - beside, ends[1] + beside], rtol=0, atol=1e-12)


@pytest.mark.parametrize("values", [(1.0, 1.0), (0.0, np.inf)])
def test_an_axis_without_a_range_is_the_viewers(values):
    assert scale_of([np.array(values)]) is None


def test_curves_have_their_names_below_and_not_upon_them():
    tab = PlotTab("Positions", position_plots(BOOM, move("cubic").trajectory))
    assert tab.legend == [("limits", LIMIT_COLOR)]
    assert all(plot.view.properties["PlotLegend"].visible.as_arrow_array().to_pylist() == [False] for plot in tab.plots)
