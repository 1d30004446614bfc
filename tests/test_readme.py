"""What the README shows of missions and drives is what the toolkit gives."""

import re
from pathlib import Path

import numpy as np
import pytest

from boom_model import Boom, Catalogue, gravity_torque
from planner.missions.mission import check_cycle, load_mission, plan_cycle
from planner.reports.side_by_side import compared, comparison_markdown
from planner.sizing.choice import Choice, candidates, fitted, parse_variant, size
from tests.field_day import field_day

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
BOOM = Boom.load()
EXAMPLES = re.findall(r"```toml\n(.*?)```", README, flags=re.DOTALL)


def test_the_thesis_s_design_is_judged_as_printed():
    missions = [load_mission(name) for name in ("table-2-4", "table-3-1")]
    reports = {each.name: check_cycle(BOOM, plan_cycle(BOOM, each)) for each in missions}
    assert comparison_markdown(*compared(reports, ("inner", "lower"))) in README


VARIANTS = {
    "as it is": "inner=10.90205",
    "inner link of 5.55 kg": "inner=5.55",
    "payload of 5 kg": "payload=5",
    "both": "inner=5.55,payload=5",
}


@pytest.mark.parametrize("name", VARIANTS)
@pytest.mark.parametrize("mission", ["field-day", "table-3-1"])
def test_the_lightest_motors_are_those_printed(name, mission):
    boom = parse_variant(BOOM, VARIANTS[name])
    cycle = field_day() if mission == "field-day" else plan_cycle(BOOM, load_mission(mission))
    cells, saved = [], 0.0
    for joint in ("inner", "lower"):
        judged = size(boom, cycle, joint, candidates(boom, joint, Catalogue.load()))
        choice = Choice(name, joint, fitted(boom, cycle, joint), judged)
        cells.append(f"{choice.lightest.drive.motor.name}, {choice.lightest.tightest('motor').margin * 100:.0f} %")
        saved += choice.saves
    if mission == "field-day":
        assert f"| {name} | {cells[0]} | {cells[1]} | {saved:.1f} kg |" in README
    else:
        (row,) = re.findall(rf"\| {name} \| (\w+), \d+ % \| (\w+), \d+ % \| ([\d.]+) kg \|", README)
        assert row == (cells[0].split(",")[0], cells[1].split(",")[0], f"{saved:.1f}")


def test_half_the_link_takes_a_tenth_off_joint_2():
    transport = BOOM.pose("transport")
    full, light = (gravity_torque(boom, transport) for boom in (BOOM, parse_variant(BOOM, "inner=5.55")))
    assert light[1] / full[1] == pytest.approx(0.90, abs=0.005)
    np.testing.assert_array_equal(light[2], full[2])


def test_the_mission_of_the_readme_can_be_planned(tmp_path):
    (tmp_path / "mine.toml").write_text(EXAMPLES[0])
    cycle = plan_cycle(BOOM, load_mission(str(tmp_path / "mine.toml")))
    assert cycle.counts.max() == 10
    tip = next(row for row in check_cycle(BOOM, cycle).rows if row.check == "deflection in all")
    assert tip.limit == 0.005


def test_the_actuator_of_the_readme_can_be_read(tmp_path):
    (tmp_path / "mine.toml").write_text(EXAMPLES[1])
    assert Catalogue.load().with_file(tmp_path / "mine.toml").actuators["MINE"].stroke == 1.0
