"""Requirement sheets: what meets one passes the checks; stiffness and backlash against the model of
the whole arm."""

from dataclasses import fields, replace

import numpy as np
import pytest

from boom_model import (
    JOINTS,
    Boom,
    Catalogue,
    Drive,
    Gearbox,
    InputError,
    LinearActuator,
    LinearDrive,
    Motor,
    Sourced,
    Winding,
    Wiring,
    gear_frequencies,
    gravity_torque,
    mass_matrix,
    tip_deflection,
)
from planner import Verdict
from planner.checks.evaluation import at_samples
from planner.checks.motion_checks import joint_views
from planner.missions.mission import load_mission, plan_cycle
from planner.motion.vehicle import load_case
from planner.sizing.choice import candidates, combinations, size
from planner.sizing.day import Day
from planner.sizing.offer import nearest, shortfalls
from planner.sizing.requirement import STEPS, requirements
from planner.sizing.requirement_pictures import requirement_pictures
from planner.sizing.requirement_tables import requirement_json, requirement_markdown, requirement_notes
from tests.builders import ORIGIN, SCREW, main_move, thesis_catalogue

BOOM = Boom.load()
_VISCOUS, _COULOMB = np.array([8.0, 20.0, 15.0, 40.0, 1.0]), np.array([2.0, 9.0, 7.0, 20.0, 0.4])
RUBBING = replace(BOOM, friction=replace(BOOM.friction, viscous=_VISCOUS, coulomb=_COULOMB))
LIVED_MISSION = """
name = "lived"
basis = "assumed"
source = "a test"
start = "transport"
required_life_h = 4000
tip_tolerance_mm = 5

[[steps]]
to = "phenotyping"

[[steps]]
hold_s = 3

[[steps]]
to = "q=120,40,150,0.4,30"
profile = "jerk-limited"

[[steps]]
pause_s = 20

[[steps]]
to = "transport"
"""


YAW_ALONE = """
name = "yaw"
basis = "assumed"
source = "a test"
start = "q=0,90,180,0.5,0"

[[steps]]
to = "q=30,90,180,0.5,0"
"""


def day():
    return Day(main_move().report.energy, 2, 10)


@pytest.fixture(scope="module")
def lived(tmp_path_factory):
    file = tmp_path_factory.mktemp("missions") / "lived.toml"
    file.write_text(LIVED_MISSION)
    return plan_cycle(RUBBING, load_mission(str(file)))


@pytest.fixture(scope="module")
def needs(lived):
    return {need.joint: need for need in requirements(RUBBING, lived)}


def random_drive(rng, need):
    """A drive whose figures lie on both sides of what is required, with one of them missing now and
    then."""

    def about(figure, low=0.8, high=2.5):
        return float(figure * rng.uniform(low, high))

    ratio, eta = rng.choice([50.0, 100.0, 160.0]), rng.uniform(0.5, 0.9)
    running = about(max(step.torque for step in need.steps) * 1.5 / (ratio * eta), 0.9, 3.0)
    average = max(need.mean or 0.0, need.hold.torque)
    gear = Gearbox(
        name="G",
        source="a test",
        ratio=ratio,
        continuous_torque=about(average),
        start_stop_torque=about(need.peak.torque),
        max_average_torque=about(average),
        peak_torque=about(2.0 * need.peak.torque),
        efficiency=eta,
        no_load_input_torque=0.03 * running,
        starting_torque=None,
        backdrive_torque=None,
        mass=1.0,
        input_inertia=rng.uniform(0.01, 0.5) * need.largest_reflected / ratio**2,
        torsion_torques=(20.0, 80.0),
        torsion_stiffness=(4e4, 6e4, 7e4),
        backlash=1e-4,
        hysteresis=2e-4,
        max_input_speed=about(ratio * need.top_speed),
        max_average_input_speed=about(ratio * need.mean_speed),
        rated_life=about(need.life_s, 0.5, 30.0),
        rated_input_speed=200.0,
    )
    motor = Motor(
        name="M",
        source="a test",
        step=np.radians(1.8),
        max_voltage=200.0,
        holding_torque=1.2 * running,
        running_torque=running,
        mass=1.0,
        rotor_inertia=rng.uniform(0.01, 0.7) * need.largest_reflected / ratio**2,
        parallel=Winding(rng.uniform(3.0, 10.0), rng.uniform(0.1, 0.8), rng.uniform(0.5e-3, 3e-3)),
        series=None,
        microstep_accuracy=1e-3,
        tolerance=None,
    )
    if rng.random() < 0.1:
        gear = replace(gear, **{rng.choice(["efficiency", "backlash", "max_input_speed", "rated_life", "input_inertia"]): None})
    voltage = None if rng.random() < 0.03 else Sourced(float(rng.uniform(24.0, 160.0)), ORIGIN)
    return Drive(motor, gear, voltage, Sourced(Wiring.PARALLEL, ORIGIN))


def random_servo(rng, need):
    """A servo motor on a random gearbox, with its figures on both sides of what is required."""
    gear = replace(random_drive(rng, need).gearbox, max_average_input_speed=1e3, max_input_speed=1e3, rated_life=1e12)
    gear = replace(gear, input_inertia=gear.input_inertia and 0.05 * gear.input_inertia)
    eta, lasting = gear.efficiency or 0.7, max(need.rms, need.hold.torque)
    rated = float(lasting / (gear.ratio * eta) * rng.uniform(0.8, 2.5))
    motor = Motor(
        name="S",
        source="a test",
        step=None,
        max_voltage=None,
        holding_torque=None,
        running_torque=None,
        mass=1.0,
        rotor_inertia=rng.uniform(0.001, 0.1) * need.largest_reflected / gear.ratio**2,
        parallel=None,
        series=None,
        microstep_accuracy=None,
        tolerance=None,
        rated_torque=rated,
        peak_torque=rated * rng.uniform(1.0, 3.0),
        rated_speed=float(gear.ratio * need.top_speed * rng.uniform(0.9, 1.5)),
    )
    if rng.random() < 0.1:
        motor = replace(motor, **{rng.choice(["rated_torque", "peak_torque", "rated_speed", "rotor_inertia"]): None})
    return Drive(motor, gear, None, None)


def random_actuator(rng, need):
    limits = {
        "rated_force": need.mean,
        "peak_force": need.peak.torque,
        "static_force": need.hold.torque,
        "max_speed": need.top_speed,
        "stroke": need.stroke,
        "duty": need.moving_share,
    }
    found = {name: float(value * rng.uniform(0.95, 1.3)) for name, value in limits.items()}
    if rng.random() < 0.1:
        found[str(rng.choice(["lead", "efficiency", "stroke"]))] = None
    return LinearDrive(replace(SCREW, **found))


@pytest.mark.parametrize("joint", JOINTS)
def test_what_meets_the_sheet_passes_the_checks(joint, lived, needs):
    rng = np.random.default_rng(JOINTS.index(joint))
    need = needs[joint]
    drives = [random_actuator(rng, need) if need.is_length else random_drive(rng, need) for _ in range(250)]
    meeting = [drive for drive in drives if not shortfalls(need, drive)]
    judged = size(RUBBING, lived, joint, meeting)
    assert {each.verdict for each in judged} == {Verdict.PASS}
    passing = sum(each.verdict is Verdict.PASS for each in size(RUBBING, lived, joint, drives))
    assert len(meeting) >= 10
    assert passing < 250
    assert len(meeting) >= 0.4 * passing  # the sheet is not far stricter than the checks


@pytest.mark.parametrize("joint", ["inner", "extension"])
def test_the_nearest_drives_lack_least(joint, lived, needs):
    rng, need = np.random.default_rng(5), needs[joint]
    drives = [random_actuator(rng, need) if need.is_length else random_drive(rng, need) for _ in range(40)]
    parts = ("actuator",) if need.is_length else ("motor", "gearbox")
    named = [
        replace(drive, **{part: replace(getattr(drive, part), name=f"{part} {k}") for part in parts})
        for k, drive in enumerate(drives)
    ]
    found = nearest(need, [*named, *named], 40)
    assert len({offer.name for offer in found}) == 40
    lacking = [(len(offer.short), len(offer.unprinted)) for offer in found]
    assert lacking == sorted(lacking)
    assert found[0].missing == ()
    (first,) = size(RUBBING, lived, joint, [found[0].drive])
    assert first.verdict is Verdict.PASS
    for offer in found:
        assert offer.missing == shortfalls(need, offer.drive)
        assert set(offer.short) | set(offer.unprinted) == set(offer.missing)
    assert len(nearest(need, named)) == 3


def test_nearest_drives_stand_in_the_report_and_in_json(needs):
    catalogue = Catalogue.load()
    sheets = (needs["lower"], needs["extension"])
    offers = {need.joint: nearest(need, combinations(BOOM, need.joint, catalogue)) for need in sheets}
    text = requirement_markdown("sheet", sheets, day(), offers, (), ())
    assert "| joint | drive of the catalogue | not enough | not printed |" in text
    for joint, group in offers.items():
        for offer in group:
            assert f"| {joint} | {offer.name} |" in text
    told = requirement_json(sheets[1], offers["extension"])["nearest"]
    assert [each["drive"] for each in told] == [offer.name for offer in offers["extension"]]
    assert all("stroke" in each["not_printed"] and not each["not_enough"] for each in told)
    assert "force | acceleration" in text[text.index("## extension") :]


@pytest.mark.parametrize("joint", ["yaw", "inner", "lower", "wrist"])
def test_a_servo_that_meets_the_sheet_passes_the_checks(joint, lived, needs):
    rng = np.random.default_rng(40 + JOINTS.index(joint))
    drives = [random_servo(rng, needs[joint]) for _ in range(250)]
    meeting = [drive for drive in drives if not shortfalls(needs[joint], drive)]
    judged = size(RUBBING, lived, joint, meeting)
    assert {each.verdict for each in judged} == {Verdict.PASS}
    passing = sum(each.verdict is Verdict.PASS for each in size(RUBBING, lived, joint, drives))
    assert len(meeting) >= 10
    assert 0.4 * passing <= len(meeting)
    assert passing < 250


def test_the_sheet_of_the_shipped_catalogue_names_what_is_not_printed(needs):
    found = [shortfalls(needs["lower"], drive) for drive in candidates(BOOM, "lower", thesis_catalogue())]
    for missing in found:
        assert {"gearbox input speed", "gearbox average input speed"} <= {each.item for each in missing}
        assert all(each.offered is None for each in missing if each.item.endswith("input speed"))
        assert any("not printed" in str(each) for each in missing)


def test_figures_of_a_sheet_are_those_of_the_motion(lived, needs):
    view = dict(zip(JOINTS, joint_views(at_samples(RUBBING, lived.trajectory), lived.duty), strict=True))
    q = lived.trajectory.q
    static = gravity_torque(RUBBING, q)
    for i, joint in enumerate(JOINTS):
        need, tau, qd = needs[joint], view[joint].tau, lived.trajectory.qd[:, i]
        assert need.peak.torque == np.abs(tau).max()
        assert need.hold.torque == pytest.approx(np.abs(static[:, i]).max(), rel=1e-12)
        assert need.creep == pytest.approx(need.hold.torque + RUBBING.friction.coulomb[i])
        assert need.output_power >= (tau * qd).max()
        assert need.rms >= lived.duty.mean(tau**2) ** 0.5
        assert need.inertia[1] >= mass_matrix(RUBBING, q[::50])[:, i, i].max() * (1 - 1e-3)
        assert need.starts == 3
        assert need.life_starts == pytest.approx(3 * 4000 * 3600 / lived.duty.duration)
    assert needs["extension"].stroke == pytest.approx(1.0)
    assert needs["yaw"].travel == pytest.approx(np.radians(90 + 30 + 120), rel=1e-4)


def test_no_sample_is_outside_the_table_or_the_hull(needs):
    for need in needs.values():
        cloud, hull = need.cloud, need.cloud.hull
        assert len(need.steps) == STEPS
        speeds = np.array([step.speed for step in need.steps])
        k = np.searchsorted(speeds, cloud.speed)
        assert (np.abs(cloud.torque) <= np.array([step.torque for step in need.steps])[k] + 1e-12).all()
        assert (cloud.acceleration <= np.array([step.acceleration for step in need.steps])[k] + 1e-12).all()
        # Seen from the hull's edges, taken anticlockwise, every sample is on the left.
        edge = (np.roll(hull, -1, axis=0) - hull)[:: max(1, len(hull) // 100)]
        hull = hull[:: max(1, len(hull) // 100)]
        points = np.column_stack([cloud.speed, cloud.torque])
        left = edge[:, :1] * (points[:, 1] - hull[:, 1:]) - edge[:, 1:] * (points[:, 0] - hull[:, :1])
        assert left.min() >= -1e-9 * np.abs(hull).max() ** 2


def with_gears(boom, **figures):
    """The boom with a drive on every joint, of the given figures (5,)."""
    drives = []
    for i in range(5):
        values = dict.fromkeys((field.name for field in fields(Gearbox)), None)
        values |= {"name": "G", "source": "a test", "ratio": 1.0} | {name: value[i] for name, value in figures.items()}
        motor = Motor("M", "a test", 1.0, *[None] * 8, tolerance=None)
        drives.append(Drive(motor, Gearbox(**values), None, None))
    return replace(boom, drives=tuple(drives))


def test_the_stiffnesses_give_the_first_frequency(lived):
    needs = requirements(BOOM, lived, frequency=6.5)
    boom = with_gears(BOOM, torsion_stiffness=[(need.stiffness_together,) * 3 for need in needs])
    q = lived.trajectory.q
    poses = np.unique(np.linspace(0, len(q) - 1, min(len(q), 1000)).astype(int))
    lowest = gear_frequencies(boom, mass_matrix(BOOM, q[poses]))[:, 0].min()
    assert lowest == pytest.approx(6.5, rel=1e-9)
    for i, need in enumerate(needs):  # the others rigid: one spring
        alone = np.sqrt(need.stiffness / mass_matrix(BOOM, q[poses])[:, i, i].max()) / (2.0 * np.pi)
        assert alone == pytest.approx(6.5, rel=1e-12)


def test_the_backlash_of_all_joints_keeps_the_tip_error(lived):
    needs = requirements(BOOM, lived, tip_error=2e-3)
    boom = with_gears(BOOM, backlash=[need.backlash for need in needs])
    q = lived.trajectory.q
    error = tip_deflection(boom, q, np.zeros_like(q)).backlash.max()
    assert 0.5 * 2e-3 < error <= 2e-3 * (1 + 1e-9)
    assert requirements(BOOM, lived)[0].tip_error == 5e-3  # the mission's own


def test_a_joint_at_rest_has_a_sheet(tmp_path):
    file = tmp_path / "yaw.toml"
    file.write_text(YAW_ALONE)
    cycle = plan_cycle(BOOM, load_mission(str(file)))
    lower, yaw, extension = requirements(BOOM, cycle, ("lower", "yaw", "extension"))
    (step,) = lower.steps
    assert (step.speed, step.acceleration, lower.mean, lower.starts, lower.travel) == (0.0, 0.0, None, 0.0, 0.0)
    assert step.torque == lower.peak.torque > lower.hold.torque > 100.0  # the yaw swings its load
    assert lower.largest_reflected == np.inf
    assert requirement_json(lower)["largest_reflected_inertia_kg_m2"] is None
    assert yaw.starts == 1
    assert not shortfalls(extension, LinearDrive(replace(SCREW, static_force=extension.hold.torque)))
    text = requirement_markdown("sheet", (lower, extension), day(), {}, requirement_notes((lower, extension)), ())
    assert "at most any" not in text


def test_bad_requests_are_refused(lived):
    for wrong, message in (
        ({"joints": ("knee",)}, "unknown joint 'knee'"),
        ({"frequency": 0.0}, "frequency is 0; it must be above 0"),
        ({"tip_error": -1.0}, "tip error is -1; it must be above 0"),
        ({"vehicle": load_case("track")}, "a mission can be on a slope only"),
    ):
        with pytest.raises(InputError, match=message):
            requirements(BOOM, lived, **wrong)


def test_text_json_and_picture_hold_the_same_figures(needs):
    sheets = list(needs.values())
    text = requirement_markdown("sheet", sheets, day(), {}, requirement_notes(sheets), ())
    for need in sheets:
        found = requirement_json(need)
        assert found["joint"] == need.joint
        assert len(found["torque_speed"]) == STEPS
        assert f"## {need.joint}" in text
        assert f"{need.hold.torque:.4g}".rstrip("0").rstrip(".") in text
    assert "force_N" in str(requirement_json(needs["extension"]))
    (figure,) = requirement_pictures(sheets).values()
    assert [axes.get_title() for axes in figure.axes[:5]] == list(JOINTS)


def test_an_actuator_that_prints_nothing_meets_nothing(needs):
    bare = LinearActuator("BARE", "a test", *[None] * 10)
    items = [each.item for each in shortfalls(needs["extension"], LinearDrive(bare))]
    assert len(items) == 8
