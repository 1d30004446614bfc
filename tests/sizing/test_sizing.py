"""The choice of drives against the checks behind it, and the thesis's question."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from boom_model import Boom, Catalogue, Drive, InfeasibleError, InputError, LinearDrive, Wiring
from planner import Verdict
from planner.checks.kinds import Severity
from planner.missions.mission import check_cycle, load_mission, plan_cycle
from planner.motion.vehicle import LEVEL, load_case
from planner.sizing.choice import (
    Adapt,
    Choice,
    candidates,
    choose,
    fitted,
    parse_variant,
    size,
    spare,
    too_high,
    untried,
)
from planner.sizing.pictures import sizing_pictures
from planner.sizing.tables import conclusion, motors, outcome, ranking, saving, sizing_json, sizing_markdown, sizing_notes
from tests.builders import SCREW, STRONG_CATALOGUE, UNDERSIZED_MISSION, planned_mission, thesis_catalogue, with_drives

BOOM = Boom.load()
CATALOGUE = thesis_catalogue()


@pytest.fixture
def cycle():
    return planned_mission("field-day")


@pytest.fixture
def main():
    return planned_mission("table-3-1")


def sized(boom=BOOM, joint="inner", adapt=Adapt.NOTHING):
    return size(boom, planned_mission("field-day"), joint, candidates(boom, joint, CATALOGUE), adapt=adapt)


def test_candidates_are_every_motor_wiring_voltage_and_gearbox():
    second = replace(CATALOGUE.gearboxes["CBG320160"], name="SLOWER", ratio=200.0)
    catalogue = replace(CATALOGUE, gearboxes={**CATALOGUE.gearboxes, "SLOWER": second})
    found = candidates(BOOM, "inner", catalogue, (48.0, 80.0, 200.0))
    assert len(found) == 4 * 2 * 2 * 2  # no motor allows 200 V
    assert len({(d.motor.name, d.gearbox.name, d.wiring.value, d.bus_voltage.value) for d in found}) == len(found)
    assert {d.bus_voltage.origin.source for d in found if d.bus_voltage.value == 80.0} == {
        BOOM.drives[1].bus_voltage.origin.source
    }
    assert {d.bus_voltage.origin.source for d in found if d.bus_voltage.value == 48.0} == {"candidate supply"}
    assert {d.brake for d in found} == {BOOM.drives[1].brake}


def test_without_a_voltage_anywhere_there_is_none_to_try(main):
    bare = with_drives(BOOM, bus_voltage=None)
    found = candidates(bare, "lower", CATALOGUE)
    assert {d.bus_voltage for d in found} == {None}
    judged = size(bare, main, "lower", found)
    assert all("motor torque" in j.unknown for j in judged if not j.fails)


def test_every_row_is_the_checks_own(cycle):
    """A drive put on the boom and checked with the whole mission gives the rows that it was judged
    by."""
    for judged in sized(joint="lower"):
        report = check_cycle(BOOM.with_drive("lower", judged.drive), cycle)
        rows = tuple(
            r
            for r in report.rows
            if r.joint == "lower" and r.check.startswith(("gearbox", "motor")) and r.check != "power-off hold"
        )
        assert judged.rows == rows


def test_the_ranking_is_by_verdict_then_what_lacks_data_then_mass_then_spare():
    for joint in ("inner", "lower", "wrist"):
        found = sized(joint=joint)
        keys = [(j.fails, j.limits_without_data, j.mass) for j in found]
        assert keys == sorted(keys)
        for one, other in pairwise(found):
            if (one.fails, one.limits_without_data, one.mass) == (other.fails, other.limits_without_data, other.mass):
                spares = [[spare(r) for r in j.by_spare] for j in (one, other)]
                assert spares[0] >= spares[1]


def test_what_does_not_pass_says_why_and_nothing_passes_without_rows():
    found = sized()
    failing = [j for j in found if j.fails]
    assert {j.drive.motor.name for j in failing} == {"MST340B02"}
    for judged in failing:
        assert judged.first_failing.check == "motor torque"
        assert judged.first_failing is next(r for r in judged.rows if r.verdict is Verdict.FAIL)
        assert outcome(judged).startswith("FAIL: motor torque, 2.525 Nm of 2.5 Nm")
    for judged in found:
        assert len(judged.rows) > 15
        assert judged.unknown  # the gearbox's input speed is not printed
        assert judged.fails is (judged.first_failing is not None)
        if not judged.fails:
            assert outcome(judged) == "INCOMPLETE: 3 without data"
        assert judged.tightest() is None or judged.tightest().kind.severity is Severity.LIMIT


@pytest.mark.parametrize(
    ("variant", "inner", "lower"),
    [
        ("inner=10.90205", "MST341B02", "MST341B02"),
        ("inner=5.55", "MST341B02", "MST341B02"),
        ("payload=5", "MST341B02", "MST340B02"),
        ("inner=5.55,payload=5", "MST341B02", "MST340B02"),
        ("payload=14", "MST341B02", "MST341B02"),
        ("payload=20", None, None),
    ],
)
def test_the_thesis_s_question(variant, inner, lower, cycle):
    """Which motor is the lightest that does not fail; 3.8, 2.8 and 1.8 kg are their masses."""
    boom = parse_variant(BOOM, variant)
    for joint, name in (("inner", inner), ("lower", lower)):
        choice = Choice(variant, joint, fitted(boom, cycle, joint), sized(boom, joint))
        if name is None:
            assert choice.lightest is None
            continue
        assert choice.lightest.drive.motor.name == name
        saved = 3.8 - {"MST340B02": 1.8, "MST341B02": 2.8, "MST342C02": 3.8}[name]
        assert choice.saves == pytest.approx(saved, abs=1e-12)
        assert choice.lightest.mass == pytest.approx(3.3 + 3.8 - saved, rel=1e-12)


def test_rescaling_finds_the_least_factor_with_which_nothing_fails(cycle):
    """A series winding falls short at speed: slowed it does, and a hundredth faster it does not."""
    series = [d for d in candidates(BOOM, "lower", CATALOGUE) if d.wiring.value is Wiring.SERIES]
    plain = {j.name: j for j in size(BOOM, cycle, "lower", series)}
    slowed = {j.name: j for j in size(BOOM, cycle, "lower", series, adapt=Adapt.RESCALE)}
    name = "MST341B02 + CBG320160"
    assert plain[name].fails
    assert not slowed[name].fails
    factor = slowed[name].moving / plain[name].moving
    assert 1.0 < factor < 3.0
    for share, passes in ((1.0, True), (0.985, False)):
        slower = cycle.stretched(share * factor)
        assert fitted(BOOM.with_drive("lower", slowed[name].drive), slower, "lower").fails is not passes
    assert slowed[name].duration == pytest.approx(cycle.duty.duration + slowed[name].moving - plain[name].moving, rel=1e-9)


def test_what_static_torque_forbids_no_slowness_mends():
    found = sized(adapt=Adapt.RESCALE)
    weak = [j for j in found if j.drive.motor.name == "MST340B02"]
    assert all(j.fails for j in weak)
    assert all(j.first_failing.check in ("motor torque", "motor torque, quasi-static") for j in weak)


def test_replanning_suits_the_moves_to_the_drive():
    """Time-optimal moves of a weaker motor take longer, and keep its margin; a motor too weak finds
    none."""
    drives = [d for d in candidates(BOOM, "lower", CATALOGUE) if d.wiring.value is Wiring.SERIES]
    mission = load_mission("field-day")
    steps = [replace_profile(step) for step in mission.table.steps if step.repeat is None]
    quick = replace(mission, table=mission.table.model_copy(update={"steps": steps}))
    cycle = plan_cycle(BOOM, quick)
    plain = {j.name: j for j in size(BOOM, cycle, "lower", drives)}
    replanned = {j.name: j for j in size(BOOM, cycle, "lower", drives, adapt=Adapt.REPLAN)}
    name = "MST341B02 + CBG320160"
    assert plain[name].fails
    assert not replanned[name].fails
    assert replanned[name].moving > plain[name].moving
    heavy = size(BOOM.with_payload(60.0), cycle, "lower", drives[:1], adapt=Adapt.REPLAN)[0]
    assert heavy.infeasible is not None
    assert heavy.fails
    assert outcome(heavy).startswith("FAIL: mission field day, steps 2")


@pytest.fixture
def undersized(tmp_path):
    """A mission that the fitted drive of lower cannot do with 30 kg, and a catalogue with one that
    can."""
    mission, catalogue = tmp_path / "quick.toml", tmp_path / "strong.toml"
    mission.write_text(UNDERSIZED_MISSION)
    catalogue.write_text(STRONG_CATALOGUE)
    return load_mission(str(mission)), CATALOGUE.with_file(catalogue)


def test_replanning_sizes_for_a_mission_that_the_fitted_drive_cannot_do(undersized):
    mission, catalogue = undersized
    boom = BOOM.with_payload(30.0)
    with pytest.raises(InfeasibleError, match="joint lower needs 545"):
        plan_cycle(boom, mission)
    (choice,) = choose({"as it is": boom}, mission, ("lower",), catalogue, adapt=Adapt.REPLAN)
    assert choice.fitted.infeasible is not None
    assert (choice.fitted.verdict, choice.fitted.rows) == (Verdict.FAIL, ())
    assert choice.lightest.name == "BIG + HUGE"
    assert not choice.unmet
    assert [j.name for j in choice.judged if not j.fails] == ["BIG + HUGE"]
    assert choice.lightest.rows == fitted(
        boom.with_drive("lower", choice.lightest.drive),
        plan_cycle(boom.with_drive("lower", choice.lightest.drive), mission),
        "lower",
    ).rows  # fmt: skip
    notes = sizing_notes((choice,), Adapt.REPLAN)
    assert any(note.startswith("lower, as it is: the fitted drives cannot do the mission: mission quick") for note in notes)
    text = sizing_markdown("Drives", (choice,), notes)
    assert "- no motion with MST340B02 + CBG320160 (parallel, 80 V)" in text
    assert "7.1 kg, no motion found" in text
    assert {"FAIL: no motion"} == {line[-1] for line in ranking(choice)[1][1:]}
    assert sizing_json("quick", (choice,), notes)["choices"][0]["fitted"]["infeasible"] == choice.fitted.infeasible


def test_another_joint_that_cannot_is_named_as_what_stands_in_the_way(undersized):
    mission, catalogue = undersized
    (choice,) = choose({"as it is": BOOM.with_payload(30.0)}, mission, ("inner",), catalogue, adapt=Adapt.REPLAN)
    assert choice.unmet
    assert all("joint lower needs" in judged.infeasible for judged in choice.judged if judged.name == "BIG + HUGE")
    assert all(judged.infeasible for judged in choice.judged)
    assert any(note.startswith("inner: no motion was found with any drive") for note in sizing_notes((choice,), Adapt.REPLAN))


def test_replanning_plans_on_the_slope_and_with_the_variant(undersized):
    """Uphill with 22 kg a time-optimal move takes longer; and another payload's motion says nothing
    of the fitted drive."""
    mission, slope, boom = undersized[0], load_case("slope"), BOOM.with_payload(22.0)
    drive = boom.drives[2]
    (level,), (tilted,) = (
        size(boom, mission, "lower", [drive], adapt=Adapt.REPLAN, vehicle=vehicle) for vehicle in (LEVEL, slope)
    )
    assert tilted.moving == pytest.approx(plan_cycle(boom, mission, slope).duty.duration, rel=1e-12)
    assert tilted.moving > 1.0005 * level.moving
    light = replace(CATALOGUE, motors={"MST340B02": CATALOGUE.motors["MST340B02"]})
    cycle, heavy = plan_cycle(BOOM, mission), {"payload=30": BOOM.with_payload(30.0)}
    (choice,) = choose(heavy, cycle, ("lower",), light, adapt=Adapt.REPLAN)
    assert choice.fitted.infeasible is not None


@pytest.mark.parametrize("adapt", [Adapt.NOTHING, Adapt.RESCALE])
def test_a_mission_without_a_motion_is_for_replanning_alone(undersized, adapt):
    with pytest.raises(InputError, match="mission quick has not been planned"):
        choose({"as it is": BOOM}, undersized[0], ("lower",), CATALOGUE, adapt=adapt)


def test_notes_say_whose_motion_the_drives_are_judged_on_and_on_what_ground():
    said = {adapt: sizing_notes((), adapt) for adapt in Adapt}
    for adapt in (Adapt.NOTHING, Adapt.RESCALE):
        assert any("the motion planned for the boom with its fitted drives" in n for n in said[adapt])
    assert any("a motion planned for it" in note for note in said[Adapt.REPLAN])
    assert any(note.startswith("the ground is level") for note in said[Adapt.NOTHING])
    on_slope = sizing_notes((), vehicle=load_case("slope"))
    assert any("slope: roll 8.5 deg" in note for note in on_slope)
    assert not any(note.startswith("the ground is level") for note in on_slope)


@pytest.mark.parametrize("adapt", [Adapt.NOTHING, Adapt.REPLAN])
def test_on_a_slope_the_rows_are_those_of_the_mission_on_the_slope(adapt):
    slope = load_case("slope")
    cycle = plan_cycle(BOOM, load_mission("table-3-1"), slope)
    drives = candidates(BOOM, "inner", CATALOGUE)[:2]
    level = {j.supply: j.rows for j in size(BOOM, cycle, "inner", drives)}
    for judged in size(BOOM, cycle, "inner", drives, adapt=adapt, vehicle=slope):
        report = check_cycle(BOOM.with_drive("inner", judged.drive), cycle, vehicle=slope)
        expected = tuple(
            r
            for r in report.rows
            if r.joint == "inner" and r.check.startswith(("gearbox", "motor")) and r.check != "power-off hold"
        )
        assert judged.rows == expected
        assert judged.rows != level[judged.supply]
    with pytest.raises(InputError, match="vehicle case shock: a mission can be on a slope only"):
        size(BOOM, cycle, "inner", drives, vehicle=load_case("shock"))


def test_a_voltage_that_motors_do_not_allow_is_said(main):
    assert too_high(CATALOGUE, (80.0, 165.0)) == ()
    assert too_high(CATALOGUE, (80.0, 200.0, 200.0)) == ("200 V exceeds the limit of every stepper motor (at most 165 V)",)
    weak = replace(CATALOGUE.motors["MST340B02"], name="WEAK", max_voltage=60.0)
    mixed = replace(CATALOGUE, motors={**CATALOGUE.motors, "WEAK": weak})
    assert too_high(mixed, (80.0,)) == ("80 V exceeds the limit of WEAK; it is not tried there",)
    open_ended = replace(CATALOGUE, motors={"ANY": replace(weak, max_voltage=None)})
    assert too_high(open_ended, (1000.0,)) == ()
    (none,) = choose({"x": BOOM}, main, ("inner",), CATALOGUE, (200.0,))
    assert none.unmet
    assert any("inner: NOT CHECKED, no drive of the catalogue is left" in note for note in sizing_notes((none,)))
    (extension,) = choose({"x": BOOM}, main, ("extension",), CATALOGUE, (200.0,))
    assert not extension.unmet


def test_many_motors_that_do_not_allow_a_voltage_are_counted():
    assert too_high(Catalogue.load(), (120.0,)) == (
        "120 V exceeds the limit of QSH8618-65-59-340, AS1060; it is not tried there",
    )
    assert too_high(Catalogue.load(), (150.0,)) == (
        "150 V exceeds the limit of QSH8618-65-59-340, QSH8618-80-55-460, QSH8618-96-55-700 and 2 more; it is not tried there",
    )


def test_what_cannot_be_checked_is_not_tried_and_said():
    shipped = Catalogue.load()
    assert untried(CATALOGUE) == ()
    gears, motors = untried(shipped)
    assert gears.startswith("gearbox CSF-20-50-2UH and 24 more: no efficiency")
    assert motors.startswith("motor QSH8618-65-59-340 and 5 more: no running torque")
    found = candidates(BOOM, "inner", shipped)
    assert {d.gearbox.name for d in found} == {name for name in shipped.gearboxes if name.startswith(("CBG", "TP0"))}
    fed = {d.motor.name: (d.wiring, d.bus_voltage) for d in found}
    assert {name for name, supply in fed.items() if supply == (None, None)} == {
        name for name, motor in shipped.motors.items() if motor.is_servo
    }
    steppers = {name for name, motor in shipped.motors.items() if not motor.is_servo and motor.running_torque}
    assert {name for name, supply in fed.items() if None not in supply} == steppers
    single = replace(shipped.motors["AS1060"], running_torque=4.0, max_voltage=None)
    (drive,) = candidates(BOOM, "inner", replace(CATALOGUE, motors={"AS1060": single}))
    assert (drive.wiring.value, drive.winding) == (Wiring.SINGLE, single.single)


def test_a_servo_is_judged_by_its_own_rows(cycle):
    servo = Catalogue.load().motors["SGM7J-08A"]
    found = candidates(BOOM, "inner", replace(CATALOGUE, motors={servo.name: servo}))
    (judged,) = size(BOOM, cycle, "inner", found)
    assert {r.check for r in judged.rows} >= {"servo hold", "servo torque", "servo RMS torque", "servo speed"}
    assert judged.mass is None  # no sheet with the mass was found
    assert [judged.verdict, judged.first_failing] == [Verdict.INCOMPLETE, None]


def test_what_lacks_fewer_limits_comes_before_what_is_lighter(cycle):
    """A motor of half the mass, of which no holding torque is printed."""
    known = CATALOGUE.motors["MST341B02"]
    lacking = replace(known, name="LACKING", mass=1.4, holding_torque=None)
    catalogue = replace(CATALOGUE, motors={"LACKING": lacking, known.name: known})
    first, *_ = size(BOOM, cycle, "inner", candidates(BOOM, "inner", catalogue))
    assert first.drive.motor is known


def test_the_picture_of_a_large_catalogue_names_the_best_drives(cycle):
    choices = choose({"as it is": BOOM}, cycle, ("inner", "wrist"), Catalogue.load())
    (figure,) = sizing_pictures(choices).values()
    (legend,) = figure.legends
    named = [text.get_text() for text in legend.get_texts()]
    assert len(named) == 7 + len(["another drive", "as it is", "hollow"])
    assert {choice.lightest.name for choice in choices} <= set(named)
    figure.canvas.draw()  # a layout that does not fit is a warning, and a warning an error


def test_a_choice_of_unknown_mass_is_not_called_heavier(main):
    servo = Catalogue.load().motors["SGM7J-08A"]
    choices = choose({"x": BOOM}, main, ("inner",), replace(CATALOGUE, motors={servo.name: servo}))
    assert conclusion(choices) == ("x: no drive of a known mass that does is lighter",)


def replace_profile(step):
    return step if step.to is None else step.model_copy(update={"profile": "time-optimal"})


def test_lighter_loads_never_lose_a_drive():
    passing = []
    for payload in (0.0, 5.0, 10.0, 15.0, 20.0, 30.0):
        boom = BOOM.with_payload(payload)
        passing.append({(j.name, j.supply) for j in sized(boom, "inner") if not j.fails})
    for lighter, heavier in pairwise(passing):
        assert heavier <= lighter
    assert passing[0]
    assert not passing[-1]


def test_the_extension_takes_actuators_alone(main):
    assert candidates(BOOM, "extension", CATALOGUE) == ()
    catalogue = replace(CATALOGUE, actuators={"SCREW": SCREW})
    found = candidates(BOOM, "extension", catalogue)
    assert found == (LinearDrive(SCREW),)
    (judged,) = size(BOOM, main, "extension", found)
    assert (judged.name, judged.mass, judged.supply) == ("SCREW", 4.0, "-")
    assert not any(row.check == "power-off hold" for row in judged.rows)
    assert judged.first_failing.check == "actuator duty"  # a lone move, without a pause
    assert BOOM.with_drive("extension", found[0]).actuator is found[0]


def test_tables_say_what_was_chosen(cycle):
    booms = {"as it is": BOOM, "payload=5": parse_variant(BOOM, "payload=5")}
    choices = choose(booms, cycle, ("inner", "extension"), CATALOGUE)
    rows = saving(choices)
    assert rows[0] == (
        "as it is", "inner", "MST342C02 + CBG320160 (parallel, 80 V), 7.1 kg",
        "MST341B02 + CBG320160 (parallel, 80 V), 6.1 kg", "1.0 kg",
    )  # fmt: skip
    assert rows[1] == ("as it is", "extension", "none", "none", "-")
    header, each = ranking(choices[0])
    assert len(each) == 8
    assert "moving" not in header
    assert each[0][:4] == ("1", "MST341B02 + CBG320160", "parallel, 80 V", "6.1 kg")
    _, best = motors(choices)
    assert best[0][2] == "no FAIL; motor torque 102%"
    notes = sizing_notes(choices)
    assert any("gearbox input speed, gearbox average input speed, gearbox life" in note for note in notes)
    assert any("a motor may differ by up to 10% from its datasheet" in note for note in notes)
    assert "extension: NOT CHECKED, the catalogue has no drive for it" in notes
    text = sizing_markdown("Drives", choices, notes)
    assert "| as it is | inner | MST342C02" in text
    answer = sizing_json("field day", choices, notes)["choices"][0]
    assert answer["saves_kg"] == pytest.approx(1.0)
    assert answer["ranked"][0]["verdict"] == "INCOMPLETE"
    assert {r["verdict"] for r in answer["ranked"][0]["checks"]} >= {"PASS", "NOT CHECKABLE"}


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: candidates(BOOM, "elbow", CATALOGUE), "unknown joint 'elbow'"),
        (lambda: candidates(BOOM, "inner", CATALOGUE, (0.0,)), "voltage is 0 V"),
        (lambda: candidates(BOOM, "inner", CATALOGUE, (np.nan,)), "voltage is nan"),
        (lambda: parse_variant(BOOM, "leg=3"), "unknown body 'leg'"),
        (lambda: parse_variant(BOOM, "inner"), "'inner' is not a mass"),
        (lambda: parse_variant(BOOM, "inner=x"), "'x' is not a mass in kg"),
        (lambda: parse_variant(BOOM, "payload=-1"), "payload is -1"),
    ],
)
def test_bad_input_is_named(call, said):
    with pytest.raises(InputError, match=said):
        call()


def test_a_drive_without_a_mass_ranks_behind(cycle):
    heavy = CATALOGUE.motors["MST342C02"]
    unknown = replace(heavy, name="UNKNOWN", mass=None)
    drive = BOOM.drives[1]
    judged = size(BOOM, cycle, "inner", [replace(drive, motor=unknown), drive])
    assert [j.drive.motor.name for j in judged] == ["MST342C02", "UNKNOWN"]
    assert judged[1].mass is None
    assert isinstance(judged[0].drive, Drive)
    assert Choice("x", "inner", judged[0], judged[1:]).saves is None
