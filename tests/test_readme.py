"""What README and guide show of missions and drives is what the toolkit gives; both stay short."""

import re
from pathlib import Path

import numpy as np
import pytest

from boom_model import Boom, Catalogue, gravity_torque
from planner.missions.mission import check_cycle, load_mission, plan_cycle
from planner.reports.side_by_side import compared, comparison_markdown
from planner.sizing.choice import Choice, candidates, fitted, parse_variant, size
from tests.builders import planned_mission, row

ROOT = Path(__file__).parents[1]
PAGES = {page.stem: page.read_text(encoding="utf-8") for page in sorted((ROOT / "demos" / "guide").glob("*.md"))}
README = (ROOT / "README.md").read_text(encoding="utf-8")
BOOM = Boom.load()
MISSION, *_ = re.findall(r"```toml\n(.*?)```", PAGES["drives"], flags=re.DOTALL)
ACTUATOR, SERVO, _KEEP_OUT = re.findall(r"```toml\n(.*?)```", PAGES["your-boom"], flags=re.DOTALL)


def test_the_thesis_s_design_is_judged_as_printed():
    missions = [load_mission(name) for name in ("table-2-4", "table-3-1")]
    reports = {each.name: check_cycle(BOOM, plan_cycle(BOOM, each)) for each in missions}
    assert comparison_markdown(*compared(reports, ("inner", "lower"))) in PAGES["sizing"]


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
    cycle = planned_mission(mission)
    cells, saved = [], 0.0
    for joint in ("inner", "lower"):
        judged = size(boom, cycle, joint, candidates(boom, joint, Catalogue.load()))
        choice = Choice(name, joint, fitted(boom, cycle, joint), judged)
        cells.append(f"{choice.lightest.drive.motor.name}, {choice.lightest.tightest('motor').margin * 100:.0f} %")
        saved += choice.saves
    if mission == "field-day":
        assert f"| {name} | {cells[0]} | {cells[1]} | {saved:.1f} kg |" in PAGES["sizing"]
    else:
        (printed,) = re.findall(rf"\| {name} \| (\w+), \d+ % \| (\w+), \d+ % \| ([\d.]+) kg \|", PAGES["sizing"])
        assert printed == (cells[0].split(",")[0], cells[1].split(",")[0], f"{saved:.1f}")


def test_half_the_link_takes_a_tenth_off_joint_2():
    transport = BOOM.pose("transport")
    full, light = (gravity_torque(boom, transport) for boom in (BOOM, parse_variant(BOOM, "inner=5.55")))
    assert light[1] / full[1] == pytest.approx(0.90, abs=0.005)
    np.testing.assert_array_equal(light[2], full[2])


def test_the_mission_of_the_readme_can_be_planned(tmp_path):
    (tmp_path / "mine.toml").write_text(MISSION)
    cycle = plan_cycle(BOOM, load_mission(str(tmp_path / "mine.toml")))
    assert cycle.counts.max() == 10
    assert row(check_cycle(BOOM, cycle).rows, "deflection in all").limit == 0.005


def test_the_actuator_of_the_readme_can_be_read(tmp_path):
    (tmp_path / "mine.toml").write_text(ACTUATOR)
    assert Catalogue.load().with_file(tmp_path / "mine.toml").actuators["MINE"].stroke == 1.0


def test_the_servo_of_the_readme_can_be_read(tmp_path):
    (tmp_path / "mine.toml").write_text(SERVO)
    assert Catalogue.load().with_file(tmp_path / "mine.toml").motors["SERVO"].is_servo


def test_readme_and_guide_are_short():
    assert len(README.splitlines()) <= 200
    assert len(README.split()) <= 2500
    for name, page in PAGES.items():
        assert len(page.splitlines()) <= 200, name


def test_the_contents_list_every_page_and_every_link_leads_somewhere():
    contents = (ROOT / "demos" / "README.md").read_text(encoding="utf-8")
    assert {f"guide/{name}.md" for name in PAGES} == set(re.findall(r"guide/[a-z-]+\.md", contents))
    for folder, text in (
        (ROOT, README),
        (ROOT / "demos", contents),
        *((ROOT / "demos" / "guide", page) for page in PAGES.values()),
    ):
        for target in re.findall(r"\]\((?!http)([^)#]+)\)", text):
            assert (folder / target).exists(), target
