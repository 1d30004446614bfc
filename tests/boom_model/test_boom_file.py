"""The shipped boom and catalogue against the thesis's Appendices C and E, and what a user's own
files may hold."""

from collections.abc import Callable
from dataclasses import FrozenInstanceError, fields
from pathlib import Path

import numpy as np
import pytest

from boom_model.boom import JOINTS, Boom
from boom_model.boom_file import BOOM_FILE
from boom_model.drives.catalogue import CATALOGUE_FILE, Catalogue
from boom_model.drives.drive import Wiring
from boom_model.errors import InputError
from boom_model.provenance import Basis

BOOM = Boom.load()
UNIT = np.array([np.pi / 180, np.pi / 180, np.pi / 180, 1.0, np.pi / 180])  # of degrees, and metres for the extension
ROUNDING = 4e-16  # relative, of a change of unit


@pytest.mark.parametrize(
    ("name", "millimetres"),
    [
        ("L1", 110),
        ("L2", 30),
        ("L3", 300),
        ("L4", 1000),
        ("L5", 300),
        ("L6", 42.08),
        ("L7", 759.505),
        ("L8", 40),
        ("L9", 1000),
    ],
)
def test_lengths_are_those_of_appendix_c(name, millimetres):
    assert getattr(BOOM.geometry, name) == pytest.approx(millimetres / 1000, rel=ROUNDING, abs=0)


@pytest.mark.parametrize(
    ("name", "grams", "com", "inertia"),
    [
        # com in mm, inertia in g mm^2
        ("base", 28404.94, (5.59, 0, 69.39), (587314994.58, 251205614.05, 592757975.96)),
        ("lower", 2494.21, (115.69, 37.67, 0), (7943614.13, 31319008.31, 28858113.96)),
        ("inner", 10902.05, (407.29, -10.26, 0), (33996691.35, 964478373.4, 953807977.46)),
        ("outer", 3880.04, (500.04, 0, 0), (523671.74, 333902698, 334322068)),
        ("upper", 2978.79, (33.05, -137.25, 0), (467859710.93, 3443704.9, 465385244.26)),
        ("extension", 2125.98, (-15.146, 0, -590.44), (257782355.42, 255434189.92, 3059584.79)),
        ("end_effector", 783.66, (8.18, 0, 75.13), (13997366.02, 14221111.08, 376344.81)),
    ],
)
def test_bodies_are_those_of_appendix_c(name, grams, com, inertia):
    body = BOOM.bodies[name]
    assert body.mass == pytest.approx(grams / 1000, rel=ROUNDING, abs=0)
    np.testing.assert_allclose(body.com, np.array(com) / 1000, rtol=ROUNDING, atol=0)
    np.testing.assert_allclose(body.inertia, np.diag(inertia) / 1e9, rtol=ROUNDING, atol=0)


def test_a_measured_figure_is_the_most_reliable_and_a_file_may_have_one(tmp_path):
    assert list(Basis) == [Basis.MEASURED, Basis.PRINTED, Basis.ESTIMATED, Basis.ASSUMED]
    assert Basis.weakest([Basis.MEASURED, Basis.PRINTED]) is Basis.PRINTED
    file = tmp_path / "boom.toml"
    text = BOOM_FILE.read_text(encoding="utf-8")
    file.write_text(text.replace('basis = "printed"\nsource = "thesis, section 1.2.1', 'basis = "measured"\nsource = "scale'))
    assert Boom.load(file).payload.mass == 10.0
    file.write_text(text.replace('value = 30.0, basis = "assumed"', 'value = 30.0, basis = "measured"', 1))
    assert Boom.load(file).limits.origins["velocity"][0].basis is Basis.MEASURED


def test_there_are_no_other_bodies():
    assert set(BOOM.bodies) == {"base", "lower", "inner", "outer", "upper", "extension", "end_effector"}
    # 28404.94 + 2494.21 + 10902.05 + 3880.04 + 2978.79 + 2125.98 + 783.66 g
    assert BOOM.mass == pytest.approx(51.56967, rel=ROUNDING, abs=0)


def test_payload_and_gravity():
    assert BOOM.payload.mass == 10.0
    assert BOOM.gravity == 9.81


def test_position_limits_are_those_of_table_2_3():
    np.testing.assert_allclose(BOOM.limits.lower, [0, 0, 5, 0, -90] * UNIT, rtol=ROUNDING, atol=0)
    np.testing.assert_allclose(BOOM.limits.upper, [360, 120, 180, 1, 90] * UNIT, rtol=ROUNDING, atol=0)
    assert BOOM.limits.linkage == pytest.approx(5 * np.pi / 180, rel=ROUNDING, abs=0)
    assert {origin.basis for key in ("position", "linkage") for origin in BOOM.limits.origins[key]} == {Basis.PRINTED}


@pytest.mark.parametrize(
    ("inner", "lower", "inside"),
    [(30.0, 35.0, True), (30.0, 34.99, False), (0.0, 5.0, True), (120.0, 125.0, True), (120.0, 120.0, False)],
)
def test_the_lower_link_stays_5_degrees_above_the_inner_one(inner, lower, inside):
    q = [0.0, np.radians(inner), np.radians(lower), 0.0, 0.0]
    assert BOOM.limits.contain(q) == inside
    assert len(BOOM.limits.reasons(q)) == (not inside)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("velocity", (30, 45, 45, 0.3, 60)),
        ("acceleration", (30, 45, 45, 0.3, 120)),
        ("jerk", (60, 90, 90, 0.6, 240)),
    ],
)
def test_rates_are_assumed_and_say_why(name, values):
    np.testing.assert_allclose(getattr(BOOM.limits, name), values * UNIT, rtol=ROUNDING, atol=0)
    origins = BOOM.limits.origins[name]
    assert [origin.basis for origin in origins] == [Basis.ASSUMED] * 5
    assert all(origin.source.strip() for origin in origins)


def test_inner_and_lower_have_the_drives_of_the_thesis():
    assert [drive and (drive.motor.name, drive.gearbox.name) for drive in BOOM.drives] == [
        None,
        ("MST342C02", "CBG320160"),
        ("MST342C02", "CBG320160"),
        None,
        None,
    ]


@pytest.mark.parametrize("joint", ["inner", "lower"])
def test_voltage_and_wiring_are_assumed_and_say_so(joint):
    drive = BOOM.drives[JOINTS.index(joint)]
    assert drive.bus_voltage.value == 80.0
    assert drive.wiring.value is Wiring.PARALLEL
    assert [origin.basis for origin in drive.supply_origins] == [Basis.ASSUMED] * 2
    assert all(origin.source.strip() for origin in drive.supply_origins)


@pytest.mark.parametrize(
    ("name", "pose"),
    [("transport", (0, 0, 30, 0, -45)), ("phenotyping", (90, 60, 180, 1, 0))],
)
def test_poses_are_those_of_table_3_1(name, pose):
    np.testing.assert_allclose(BOOM.pose(name), pose * UNIT, rtol=ROUNDING, atol=0)
    assert BOOM.limits.contain(BOOM.pose(name))


def test_an_unknown_pose_is_bad_input():
    with pytest.raises(InputError, match=r"'home'.*phenotyping, transport"):
        BOOM.pose("home")


@pytest.mark.parametrize("payload", [0.0, 3.5])
def test_another_payload_changes_nothing_else(payload):
    other = BOOM.with_payload(payload)
    assert other.payload.mass == payload
    assert all(getattr(other, f.name) is getattr(BOOM, f.name) for f in fields(BOOM) if f.name != "payload")


@pytest.mark.parametrize("payload", [-1e-9, np.nan, np.inf, "heavy", pytest.param([1.0, 2.0])], ids=str)
def test_a_bad_payload_is_bad_input(payload):
    with pytest.raises(InputError, match="payload"):
        BOOM.with_payload(payload)


@pytest.mark.parametrize(
    "array",
    [
        *(
            pytest.param(getattr(body, part), id=f"{name} {part}")
            for name, body in BOOM.bodies.items()
            for part in ("com", "inertia")
        ),
        *(pytest.param(getattr(BOOM.limits, name), id=name) for name in ("lower", "upper", "velocity", "acceleration", "jerk")),
        *(pytest.param(pose, id=name) for name, pose in BOOM.poses.items()),
    ],
)
def test_arrays_are_read_only(array):
    with pytest.raises(ValueError, match="read-only"):
        array[0] = 0.0


@pytest.mark.parametrize("mapping", [BOOM.bodies, BOOM.poses, BOOM.limits.origins], ids=["bodies", "poses", "origins"])
def test_mappings_are_read_only(mapping):
    with pytest.raises(TypeError, match="does not support item assignment"):
        mapping["other"] = None


def test_a_boom_is_frozen():
    with pytest.raises(FrozenInstanceError):
        BOOM.payload = 0.0


Edit = Callable[..., Path]


@pytest.fixture
def edited(tmp_path: Path) -> Edit:
    """Writes the shipped file with each (old, new) of its text replaced once."""

    def edit(*replacements: tuple[str, str], shipped: Path = BOOM_FILE) -> Path:
        text = shipped.read_text(encoding="utf-8")
        for old, new in replacements:
            assert old in text
            text = text.replace(old, new, 1)
        file = tmp_path / f"my_{shipped.name}"
        file.write_text(text, encoding="utf-8")
        return file

    return edit


def refusal(load: Callable[[], object]) -> str:
    """The one readable sentence of the InputError that loading ends in."""
    with pytest.raises(InputError) as refused:
        load()
    assert refused.value.__cause__ is None
    assert refused.value.__suppress_context__ or refused.value.__context__ is None
    assert "\n" not in str(refused.value)
    return str(refused.value)


BASE_INERTIA = "[0.58731499458, 0.25120561405, 0.59275797596]"


def test_a_users_boom_is_read(edited):
    boom = Boom.load(
        edited(
            ('name = "third-generation boom"', 'name = "mine"'),
            ("gravity_m_s2 = 9.81\n", ""),
            ("L1_m = 0.110", "L1_m = 1"),
            ("mass_kg = 10.0", "mass_kg = 2.5"),
            ("lower = -90.0", "lower = -45.0"),
            (BASE_INERTIA, "[[2.0, 0.1, 0.2], [0.1, 3.0, 0.3], [0.2, 0.3, 4.0]]"),
        )
    )
    assert (boom.name, boom.gravity, boom.geometry.L1, boom.payload.mass) == ("mine", 9.81, 1.0, 2.5)
    assert boom.limits.lower[4] == -np.pi / 4
    np.testing.assert_array_equal(boom.bodies["base"].inertia, [[2.0, 0.1, 0.2], [0.1, 3.0, 0.3], [0.2, 0.3, 4.0]])
    assert not boom.bodies["base"].inertia.flags.writeable


@pytest.mark.parametrize("key", ["bus_voltage_V", "wiring"])
def test_voltage_and_wiring_may_be_left_out(edited, key):
    (line,) = {line for line in BOOM_FILE.read_text(encoding="utf-8").splitlines() if line.startswith(key)}
    _, inner, lower, _, _ = Boom.load(edited((line, ""))).drives
    assert (inner.bus_voltage is None) == (key == "bus_voltage_V")
    assert (inner.wiring is None) == (key == "wiring")
    assert len(inner.supply_origins) == 1
    assert len(lower.supply_origins) == 2


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        pytest.param("L1_m = 0.110", "", "geometry.L1_m", id="missing"),
        pytest.param('name = "third-generation boom"', "", "name", id="missing name"),
        pytest.param("L8_m = 0.040", "L8_m = 0.040\nL10_m = 1.0", "geometry.L10_m", id="unknown"),
        pytest.param("[joints.wrist]", "[joints.wrist]\ncolour = 1", "joints.wrist.colour", id="unknown in a joint"),
        pytest.param("L1_m = 0.110", 'L1_m = "0.110"', "geometry.L1_m", id="text for a number"),
        pytest.param("L1_m = 0.110", "L1_m = true", "geometry.L1_m", id="truth for a number"),
        pytest.param('name = "third-generation boom"', "name = 3", "name", id="number for text"),
        pytest.param("mass_kg = 2.49421", "mass_kg = nan", "bodies.lower.mass_kg", id="nan mass"),
        pytest.param("mass_kg = 2.49421", "mass_kg = inf", "bodies.lower.mass_kg", id="infinite mass"),
        pytest.param("L7_m = 0.759505", "L7_m = inf", "geometry.L7_m", id="infinite length"),
        pytest.param("[0.00559, 0.0, 0.06939]", "[0.00559, nan, 0.06939]", "bodies.base.com_m.1", id="nan com"),
        pytest.param("[0.00559, 0.0, 0.06939]", "[0.00559, 0.06939]", "bodies.base.com_m", id="two coordinates"),
        pytest.param("value = 30.0", "value = nan", "joints.yaw.velocity_deg_s.value", id="nan velocity"),
        pytest.param("value = 30.0", "value = 0.0", "joints.yaw.velocity_deg_s.value", id="no velocity"),
        pytest.param("upper = 120.0", "upper = inf", "joints.inner.position_deg.upper", id="infinite limit"),
        pytest.param("yaw_deg = 0.0", "yaw_deg = nan", "poses.transport.yaw_deg", id="nan pose"),
        pytest.param("gravity_m_s2 = 9.81", "gravity_m_s2 = nan", "gravity_m_s2", id="nan gravity"),
        pytest.param("mass_kg = 2.49421", "mass_kg = -2.49421", "bodies.lower.mass_kg", id="negative mass"),
        pytest.param("mass_kg = 10.0", "mass_kg = -10.0", "payload.mass_kg", id="negative payload"),
        pytest.param("L3_m = 0.300", "L3_m = 0.0", "geometry.L3_m", id="no lower link"),
        pytest.param(BASE_INERTIA, "[1.0, 1.0, nan]", "bodies.base.inertia_kg_m2", id="nan inertia"),
        pytest.param(BASE_INERTIA, "[1.0, 1.0]", "bodies.base.inertia_kg_m2", id="two inertias"),
        pytest.param(BASE_INERTIA, "[1.0, -1.0, 1.0]", "bodies.base.inertia_kg_m2", id="negative inertia"),
        pytest.param(BASE_INERTIA, "[1.0, 1.0, 2.1]", "bodies.base.inertia_kg_m2", id="triangle inequality"),
        pytest.param(
            BASE_INERTIA,
            "[[1.0, 0.9, 0.0], [0.9, 1.0, 0.0], [0.0, 0.0, 1.0]]",
            "bodies.base.inertia_kg_m2",
            id="triangle inequality about turned axes",
        ),
        pytest.param(
            BASE_INERTIA,
            "[[1.0, 0.1, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]",
            "bodies.base.inertia_kg_m2",
            id="not symmetric",
        ),
        pytest.param("lower = 0.0, upper = 360.0", "lower = 361.0, upper = 360.0", "joints.yaw.position_deg", id="crossed"),
        pytest.param("value = 5.0", "value = -5.0", "linkage.minimum_angle_deg.value", id="negative linkage angle"),
        pytest.param('"MST342C02"', '"MST999"', "joints.inner.drive.motor", id="unknown motor"),
        pytest.param('"CBG320160"', '"CBG999"', "joints.inner.drive.gearbox", id="unknown gearbox"),
        pytest.param("value = 80.0", "value = 165.1", "joints.inner.drive.bus_voltage_V", id="above the motor's voltage"),
        pytest.param("value = 80.0", "value = -80.0", "joints.inner.drive.bus_voltage_V.value", id="negative voltage"),
        pytest.param('"parallel"', '"delta"', "joints.inner.drive.wiring.value", id="unknown wiring"),
        pytest.param('basis = "assumed"', 'basis = "guessed"', "joints.yaw.velocity_deg_s.basis", id="unknown basis"),
        pytest.param(', source = "thesis, table 2-3" }', " }", "joints.yaw.position_deg.source", id="no source"),
    ],
)
def test_a_bad_value_is_one_error_that_names_file_and_key(edited, old, new, key):
    file = edited((old, new))
    message = refusal(lambda: Boom.load(file))
    assert message.startswith(f"{file}: key {key}")
    assert message.count("key ") == 1


def test_every_bad_key_is_named_in_one_error(edited):
    file = edited(("L1_m = 0.110", ""), ("mass_kg = 2.49421", "mass_kg = -1.0"), ("[linkage]  #", "[linkage]\nx = 1  #"))
    message = refusal(lambda: Boom.load(file))
    assert all(key in message for key in ("geometry.L1_m", "bodies.lower.mass_kg", "linkage.x"))


def test_the_motors_own_voltage_is_allowed(edited):
    assert Boom.load(edited(("value = 80.0", "value = 165.0"))).drives[1].bus_voltage.value == 165.0


@pytest.mark.parametrize("load", [Boom.load, Catalogue.load, lambda file: Boom.load(catalogue=file)])
@pytest.mark.parametrize(
    "content",
    [
        pytest.param(b"[geometry\n", id="malformed"),
        pytest.param(b"name = 1\nname = 2\n", id="a key twice"),
        pytest.param("name = 'b\u00f6m'\n".encode("latin-1"), id="latin-1"),
        pytest.param("name = 'boom'\n".encode("utf-16"), id="utf-16"),
    ],
)
def test_a_file_that_is_not_toml_is_named(tmp_path, load, content):
    file = tmp_path / "bad.toml"
    file.write_bytes(content)
    assert refusal(lambda: load(file)).startswith(f"{file}: not valid TOML")


@pytest.mark.parametrize("load", [Boom.load, Catalogue.load, lambda file: Boom.load(catalogue=file)])
@pytest.mark.parametrize("kind", ["missing", "folder"])
def test_a_file_that_cannot_be_read_is_named(tmp_path, load, kind):
    file = tmp_path if kind == "folder" else tmp_path / "missing.toml"
    assert refusal(lambda: load(str(file))).startswith(f"{file}: cannot be read")


@pytest.mark.parametrize(
    ("name", "holding", "running", "mass", "rotor", "parallel", "series"),
    [
        ("MST340B02", 3.0, 2.5, 1.8, 1.4, (6.6, 0.2, 0.9), (3.3, 0.8, 3.4)),
        ("MST341B02", 6.1, 5.1, 2.8, 2.7, (6.5, 0.2, 1.3), (3.3, 0.9, 5.2)),
        ("MST342B02", 9.0, 7.2, 3.8, 4.0, (6.8, 0.4, 2.2), (3.4, 1.9, 8.6)),
        ("MST342C02", 9.0, 7.2, 3.8, 4.0, (9.5, 0.2, 1.4), (4.7, 0.9, 5.4)),
    ],
)
def test_motors_are_those_of_the_datasheet_in_si(name, holding, running, mass, rotor, parallel, series):
    motor = Catalogue.load().motors[name]
    assert (motor.name, motor.max_voltage, motor.holding_torque, motor.running_torque, motor.mass) == (
        name,
        165.0,
        holding,
        running,
        mass,
    )
    assert motor.step == pytest.approx(2 * np.pi / 200, rel=ROUNDING, abs=0)
    assert motor.rotor_inertia == pytest.approx(rotor / 1e4, rel=ROUNDING, abs=0)
    for winding, (amperes, ohms, millihenries) in ((motor.parallel, parallel), (motor.series, series)):
        assert (winding.current, winding.resistance) == (amperes, ohms)
        assert winding.inductance == pytest.approx(millihenries / 1e3, rel=ROUNDING, abs=0)
    assert motor.source.strip()
    assert motor.tolerance == pytest.approx(0.1, rel=ROUNDING, abs=0)
    assert motor.microstep_accuracy == pytest.approx(np.radians(0.09), rel=ROUNDING, abs=0)


def test_the_gearbox_is_that_of_the_datasheet_in_si():
    gearbox = Catalogue.load().gearboxes["CBG320160"]
    printed = {
        "ratio": 160,
        "continuous_torque": 172,
        "start_stop_torque": 460,
        "max_average_torque": 275,
        "peak_torque": 751,
        "efficiency": 0.65,
        "no_load_input_torque": 0.42,
        "starting_torque": 0.15,
        "backdrive_torque": 29,
        "mass": 3.3,
        "input_inertia": 1.76e-4,
        "torsion_torques": (29, 108),
        "torsion_stiffness": (67e3, 110e3, 120e3),
        "backlash": 24e-6,
        "hysteresis": 290e-6,
    }
    for name, value in printed.items():
        assert getattr(gearbox, name) == pytest.approx(value, rel=ROUNDING, abs=0), name
    absent = {"max_input_speed", "max_average_input_speed", "rated_life", "rated_L10", "rated_input_speed", "peak_events"}
    assert {getattr(gearbox, name) for name in absent} == {None}
    assert gearbox.source.strip()
    assert {f.name for f in fields(gearbox)} == {*printed, *absent, "name", "source"}


def test_figures_that_a_catalogue_leaves_out_are_none(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text('[motors.M]\nsource = "mine"\nstep_deg = 0.9\n[gearboxes.G]\nsource = "mine"\nratio = 100\n')
    catalogue = Catalogue.load(file)
    for entry, given in ((catalogue.motors["M"], {"step": np.radians(0.9)}), (catalogue.gearboxes["G"], {"ratio": 100})):
        given |= {"name": entry.name, "source": "mine"}
        assert {f.name: getattr(entry, f.name) for f in fields(entry)} == dict.fromkeys(f.name for f in fields(entry)) | given


@pytest.mark.parametrize(
    ("line", "name"),
    [
        ("torsion_T2_Nm = 108\n", "torsion_torques"),
        ("torsion_K1_Nm_per_mrad = 67\n", "torsion_stiffness"),
    ],
)
def test_part_of_a_torsion_curve_is_none_of_it(edited, line, name):
    gearbox = Catalogue.load(edited((line, ""), shipped=CATALOGUE_FILE)).gearboxes["CBG320160"]
    assert getattr(gearbox, name) is None


def test_a_users_speeds_are_in_rpm_and_life_in_hours(edited):
    lines = "ratio = 160\nmax_input_speed_rpm = 3000\nmax_average_input_speed_rpm = 1500\nrated_life_h = 2\n"
    file = edited(("ratio = 160\n", lines + "rated_input_speed_rpm = 750\n"), shipped=CATALOGUE_FILE)
    gear = Catalogue.load(file).gearboxes["CBG320160"]
    speeds = (gear.max_input_speed, gear.max_average_input_speed, gear.rated_input_speed)
    assert speeds == pytest.approx((100 * np.pi, 50 * np.pi, 25 * np.pi), rel=ROUNDING, abs=0)
    assert gear.rated_life == 7200.0


MINE = """
[motors.MINE]
source = "my own sheet"
step_deg = 1.8

[actuators.SCREW]
source = "my own sheet"
rated_force_N = 500
peak_force_N = 800
static_force_N = 900
max_speed_m_s = 0.35
stroke_m = 1.0
lead_mm = 10
efficiency_percent = 80
backdrive_force_N = 100
duty_percent = 25
mass_kg = 4
"""


@pytest.fixture
def own_catalogue(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(MINE)
    return file


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ("", "step_deg is missing; a servo motor has rated_torque_Nm in its place"),
        ("mass_kg = 2", "step_deg is missing"),
        ("holding_torque_Nm = 3\nrated_torque_Nm = 2", "step_deg is missing"),
        ("step_deg = 1.8\npeak_torque_Nm = 2", "peak_torque_Nm is for a servo motor, which has no step_deg"),
        ("rated_torque_Nm = 3\npeak_torque_Nm = 2", "peak_torque_Nm is 2, less than rated_torque_Nm, which is 3"),
        ("rated_torque_Nm = 3\nrated_speed_rpm = 3000\nmax_speed_rpm = 300", "max_speed_rpm is 300, less than rated_speed_rpm"),
    ],
)
def test_a_motor_is_a_stepper_or_a_servo(tmp_path, lines, said):
    file = tmp_path / "mine.toml"
    file.write_text(f'[motors.M]\nsource = "mine"\n{lines}\n')
    message = refusal(lambda: Catalogue.load(file))
    assert message.startswith(f"{file}: key motors.M: ")
    assert said in message


def test_a_servo_and_a_single_winding_and_a_printed_L10_are_read(tmp_path, edited):
    file = tmp_path / "mine.toml"
    file.write_text(
        '[motors.S]\nsource = "mine"\nrated_torque_Nm = 1\npeak_torque_Nm = 3\nrated_speed_rpm = 3000\nmax_speed_rpm = 6000\n'
        '[motors.W]\nsource = "mine"\nstep_deg = 1.8\nsingle = { current_A = 5, resistance_ohm = 0.4, inductance_mH = 3 }\n'
        '[gearboxes.G]\nsource = "mine"\nratio = 100\nrated_L10_h = 7000\n'
    )
    catalogue = Catalogue.load(file)
    servo, stepper = catalogue.motors["S"], catalogue.motors["W"]
    assert (servo.step, servo.rated_torque, servo.peak_torque) == (None, 1.0, 3.0)
    assert (servo.rated_speed, servo.max_speed) == pytest.approx((100 * np.pi, 200 * np.pi), rel=ROUNDING, abs=0)
    assert [w.value for w in stepper.windings] == ["single"]
    assert stepper.single.inductance == pytest.approx(0.003, rel=ROUNDING, abs=0)
    assert catalogue.gearboxes["G"].rated_L10 == 7000 * 3600.0
    boom = Boom.load(edited(('motor = "MST342C02"', 'motor = "W"'), ('"parallel"', '"single"')), catalogue=file)
    assert boom.drives[1].winding is boom.drives[1].motor.single


def test_a_users_catalogue_adds_to_the_shipped_one(edited, own_catalogue):
    shipped = Catalogue.load()
    both = shipped.with_file(own_catalogue)
    assert both.motors.keys() == {*shipped.motors, "MINE"}
    assert both.gearboxes == shipped.gearboxes
    assert shipped.with_file(None) is shipped
    boom = Boom.load(edited(('motor = "MST342C02"', 'motor = "MINE"')), catalogue=own_catalogue)
    assert [drive and drive.motor.name for drive in boom.drives] == [None, "MINE", "MST342C02", None, None]
    message = refusal(lambda: Boom.load(edited(('"MST342C02"', '"NONE"')), catalogue=own_catalogue))
    assert "key joints.inner.drive.motor: 'NONE' is not in catalogue.toml or" in message
    assert str(own_catalogue) in message


def test_a_name_that_is_taken_is_refused(own_catalogue):
    own_catalogue.write_text(MINE.replace("motors.MINE", "motors.MST340B02"))
    message = refusal(lambda: Boom.load(catalogue=own_catalogue))
    assert message == f"{own_catalogue}: key motors.MST340B02: the catalogue already has an entry of this name"


def test_a_users_actuator_drives_the_extension(edited, own_catalogue):
    assert Boom.load().actuator is None
    fitted = '[joints.extension.actuator]\nmodel = "SCREW"\nbrake = { value = true, basis = "printed", source = "sheet" }\n'
    file = edited(("[joints.wrist]", fitted + "\n[joints.wrist]"))
    drive = Boom.load(file, own_catalogue).actuator
    expected = {
        "rated_force": 500, "peak_force": 800, "static_force": 900, "max_speed": 0.35, "stroke": 1.0, "lead": 0.01,
        "efficiency": 0.8, "backdrive_force": 100, "duty": 0.25, "mass": 4,
    }  # fmt: skip
    for name, value in expected.items():
        assert getattr(drive.actuator, name) == pytest.approx(value, rel=ROUNDING, abs=0), name
    assert {f.name for f in fields(drive.actuator)} == {*expected, "name", "source"}
    assert drive.brake.value is True
    message = refusal(lambda: Boom.load(file))
    assert "key joints.extension.actuator.model: 'SCREW' is not in catalogue.toml (SA0PD-BS1, " in message


@pytest.mark.parametrize("step", ["0.09", "91", "inf", "nan"])
def test_a_motors_step_is_within_bounds(tmp_path, step):
    file = tmp_path / "mine.toml"
    file.write_text(f'[motors.M]\nsource = "mine"\nstep_deg = {step}\n')
    message = refusal(lambda: Catalogue.load(file))
    assert message.startswith(f"{file}: key motors.M.step_deg: input should be ")
    assert ("a finite number" in message) is (step in ("inf", "nan"))


@pytest.mark.parametrize("line", ["efficiency_percent = nan", "peak_torque_Nm = inf", "mass_kg = nan", "ratio = inf"])
def test_a_figure_that_is_not_finite_is_called_so(tmp_path, line):
    file = tmp_path / "mine.toml"
    ratio = "" if line.startswith("ratio") else "ratio = 100\n"
    file.write_text(f'[gearboxes.G]\nsource = "mine"\n{ratio}{line}\n')
    name, value = line.split(" = ")
    assert (
        refusal(lambda: Catalogue.load(file))
        == f"{file}: key gearboxes.G.{name}: input should be a finite number (it is {value})"
    )


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ("torsion_T1_Nm = 108\ntorsion_T2_Nm = 29", "torsion_T1_Nm is 108; it must be below torsion_T2_Nm, which is 29"),
        ("torsion_T1_Nm = 29\ntorsion_T2_Nm = 29", "torsion_T1_Nm is 29; it must be below torsion_T2_Nm, which is 29"),
        (
            "start_stop_torque_Nm = 460\npeak_torque_Nm = 75.1",
            "peak_torque_Nm is 75.1, less than start_stop_torque_Nm, which is 460",
        ),
        (
            "max_average_torque_Nm = 275\nstart_stop_torque_Nm = 46",
            "start_stop_torque_Nm is 46, less than max_average_torque_Nm, which is 275",
        ),
        (
            "max_average_torque_Nm = 275\npeak_torque_Nm = 46",
            "peak_torque_Nm is 46, less than max_average_torque_Nm, which is 275",
        ),
    ],
)
def test_a_gearbox_whose_figures_contradict_each_other_is_refused(tmp_path, lines, said):
    file = tmp_path / "mine.toml"
    file.write_text(f'[gearboxes.G]\nsource = "mine"\nratio = 100\n{lines}\n')
    message = refusal(lambda: Catalogue.load(file))
    assert message.startswith(f"{file}: key gearboxes.G: ")
    assert said in message


@pytest.mark.parametrize("line", ["lead_mm = 0", "duty_percent = 101", "stroke_m = nan", "colour = 3", 'mass_kg = "4"'])
def test_a_bad_actuator_names_file_entry_and_key(tmp_path, line):
    file = tmp_path / "mine.toml"
    file.write_text(f'[actuators.SCREW]\nsource = "mine"\n{line}\n')
    assert refusal(lambda: Boom.load(catalogue=file)).startswith(f"{file}: key actuators.SCREW.{line.split(' ')[0]}")


def test_a_body_of_another_mass_keeps_its_shape():
    boom = Boom.load()
    lighter = boom.with_body_mass("inner", 5.55)
    old, new = boom.bodies["inner"], lighter.bodies["inner"]
    assert new.mass == 5.55
    np.testing.assert_array_equal(new.com, old.com)
    np.testing.assert_allclose(new.inertia, old.inertia * 5.55 / 10.90205, rtol=ROUNDING)
    assert {n for n in boom.bodies if lighter.bodies[n] is not boom.bodies[n]} == {"inner"}
    for name, mass, said in (
        ("leg", 1.0, "unknown body 'leg'"),
        ("inner", -1.0, "-1 kg"),
        ("inner", np.nan, "mass of inner is nan"),
    ):
        with pytest.raises(InputError, match=said):
            boom.with_body_mass(name, mass)


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        pytest.param("ratio = 160\n", "", "gearboxes.CBG320160.ratio", id="missing"),
        pytest.param("ratio = 160", "ratio = 160\nteeth = 3", "gearboxes.CBG320160.teeth", id="unknown"),
        pytest.param("ratio = 160", "ratio = 0", "gearboxes.CBG320160.ratio", id="zero"),
        pytest.param("percent = 65", "percent = 101", "gearboxes.CBG320160.efficiency_percent", id="above 100 %"),
        pytest.param("percent = 65", "percent = nan", "gearboxes.CBG320160.efficiency_percent", id="nan"),
        pytest.param("step_deg = 1.8", 'step_deg = "1.8"', "motors.MST340B02.step_deg", id="text"),
        pytest.param("torque_Nm = 3.0", "torque_Nm = inf", "motors.MST340B02.holding_torque_Nm", id="infinite"),
        pytest.param("kg_cm2 = 1.4", "kg_cm2 = -1.4", "motors.MST340B02.rotor_inertia_kg_cm2", id="negative"),
        pytest.param("current_A = 6.6, ", "", "motors.MST340B02.parallel.current_A", id="missing in a winding"),
        pytest.param("current_A = 6.6", "current_A = 1e200", "motors.MST340B02.parallel.current_A", id="absurd current"),
        pytest.param("kg_cm2 = 1.4", "kg_cm2 = 1e300", "motors.MST340B02.rotor_inertia_kg_cm2", id="absurd inertia"),
        pytest.param("kg_m2 = 176e-6", "kg_m2 = 1e9", "gearboxes.CBG320160.input_inertia_kg_m2", id="absurd input inertia"),
        pytest.param(
            "K1_Nm_per_mrad = 67", "K1_Nm_per_mrad = 67000", "gearboxes.CBG320160.torsion_K1_Nm_per_mrad", id="Nm/rad"
        ),
        pytest.param("percent = 65", "percent = 0.65", "gearboxes.CBG320160.efficiency_percent", id="a share"),
        pytest.param("ratio = 160", "ratio = 0.00625", "gearboxes.CBG320160.ratio", id="the other way round"),
        pytest.param('source = "Cone', 'source = ""  # "Cone', "gearboxes.CBG320160.source", id="no source"),
    ],
)
def test_a_bad_catalogue_is_one_error_that_names_file_and_key(edited, old, new, key):
    file = edited((old, new), shipped=CATALOGUE_FILE)
    for load in (lambda: Catalogue.load(file), lambda: Boom.load(catalogue=file)):
        message = refusal(load)
        assert message.startswith(f"{file}: key {key}")
        assert message.count("key ") == 1
