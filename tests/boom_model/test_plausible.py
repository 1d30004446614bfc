"""Every quantity has bounds, the same in a file and for a boom made in code."""

from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest

from boom_model import Basis, Body, Boom, Friction, InputError, Mount, Origin, Sourced
from boom_model.boom_file import BOOM_FILE
from boom_model.drives.catalogue import CATALOGUE_FILE, Catalogue
from boom_model.plausible import LENGTH, Range

BOOM = Boom.load()
ORIGIN = Origin(Basis.ASSUMED, "made up")
BODY = BOOM.bodies["inner"]
WILD = (1e15, -1e15, 1e308, np.nan, np.inf)


def test_a_range_names_value_and_bounds():
    LENGTH.require("arm", [0.001, 30.0])
    with pytest.raises(InputError, match=r"^arm is 31 m; it must be between 0\.001 and 30 m$"):
        LENGTH.require("arm", [1.0, 31.0])
    with pytest.raises(InputError, match="arm is nan m"):
        LENGTH.require("arm", np.nan)


def test_a_change_of_unit_does_not_leave_the_range():
    edge = Range(-90.0, 90.0, "deg")
    edge.require("angle", np.degrees(np.radians([-90.0, 90.0])))
    with pytest.raises(InputError):
        edge.require("angle", 90.0001)


@pytest.mark.parametrize("name", ["L1", "L2", "L3", "L4", "L6", "L7", "L8"])
@pytest.mark.parametrize("value", WILD)
def test_a_geometry_in_code(name, value):
    with pytest.raises(InputError, match=f"^{name} is "):
        replace(BOOM.geometry, **{name: value})


@pytest.mark.parametrize("name", ["L3", "L4", "L7"])
@pytest.mark.parametrize("value", [-1.0, 0.0, 1e-300])
def test_a_link_has_a_length(name, value):
    with pytest.raises(InputError, match=rf"^{name} is .* m; it must be between 0\.001 and 30 m"):
        replace(BOOM.geometry, **{name: value})


@pytest.mark.parametrize("value", [*WILD, -1.0, 10_902.05])
def test_a_mass_in_code(value):
    for make in (
        lambda: replace(BODY, mass=value),
        lambda: BOOM.with_payload(value),
        lambda: BOOM.with_body_mass("inner", value),
    ):
        with pytest.raises(InputError, match=r"(mass|payload)"):
            make()


@pytest.mark.parametrize("value", WILD)
@pytest.mark.parametrize(("name", "shape"), [("com", (3,)), ("inertia", (3, 3))])
def test_a_body_in_code(name, shape, value):
    with pytest.raises(InputError, match="a body's"):
        replace(BODY, **{name: np.full(shape, value)})
    with pytest.raises(InputError, match="it must be"):
        replace(BODY, **{name: np.zeros(2)})


@pytest.mark.parametrize("joint", range(5))
@pytest.mark.parametrize("value", WILD)
@pytest.mark.parametrize("name", ["lower", "upper", "velocity", "acceleration", "jerk"])
def test_limits_in_code(name, joint, value):
    values = np.array(getattr(BOOM.limits, name))
    values[joint] = value
    with pytest.raises(InputError, match=name):
        replace(BOOM.limits, **{name: values})


@pytest.mark.parametrize("value", [-1.0, 0.0, 1e-300])
@pytest.mark.parametrize("name", ["velocity", "acceleration", "jerk"])
def test_a_rate_is_above_nothing(name, value):
    with pytest.raises(InputError, match=name):
        replace(BOOM.limits, **{name: np.full(5, value)})


@pytest.mark.parametrize("change", [{"linkage": np.radians(500.0)}, {"linkage": -0.1}, {"transmission": 4.0}])
def test_angles_of_the_linkage_in_code(change):
    with pytest.raises(InputError, match=r"(linkage|transmission) is "):
        replace(BOOM.limits, **change)


@pytest.mark.parametrize(
    "make",
    [
        lambda: replace(BOOM, gravity=1e15),
        lambda: replace(BOOM, gravity=-9.81),
        lambda: replace(BOOM, poses=MappingProxyType({"far": np.full(5, 1e15)})),
        lambda: Friction(np.full(5, -1.0), np.zeros(5), (None,) * 5),
        lambda: Friction(np.zeros(5), np.full(5, 1e15), (None,) * 5),
        lambda: Mount(Sourced(1e15, ORIGIN), None),
        lambda: Mount(None, Sourced(-1.0, ORIGIN)),
    ],
)
def test_the_rest_of_a_boom_in_code(make):
    with pytest.raises(InputError, match="must be between"):
        make()


def test_a_boom_of_ten_centimetres_and_one_of_thirty_metres_are_fine():
    for scale in (0.05, 10.0):
        lengths = {name: scale * getattr(BOOM.geometry, name) for name in ("L1", "L2", "L3", "L4", "L6", "L7", "L8")}
        bodies = {n: Body(b.mass * scale**1.5, b.com * scale, b.inertia * scale**3.5) for n, b in BOOM.bodies.items()}
        replace(BOOM, geometry=replace(BOOM.geometry, **lengths), bodies=bodies)


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("L4_m = 1.000", "L4_m = 1000.0", "geometry.L4_m: input should be less than or equal to 30 "),
        ("L7_m = 0.759505", "L7_m = 1e-300", "geometry.L7_m: input should be greater than or equal to 0.001 "),
        ("mass_kg = 10.90205", "mass_kg = 10902.05", "bodies.inner.mass_kg: input should be less than or equal to 5000 "),
        ("mass_kg = 10.0", "mass_kg = 1e308", "payload.mass_kg: input should be less than or equal to 5000 "),
        ("[0.00559, 0.0, 0.06939]", "[1e15, 0.0, 0.06939]", "bodies.base.com_m.0: input should be less than or equal to 30 "),
        (
            "[0.58731499458, 0.25",
            "[1e15, 0.25",
            "bodies.base.inertia_kg_m2: value error, an entry is 1e+15 kg m^2; the bound is",
        ),
        ("gravity_m_s2 = 9.81", "gravity_m_s2 = 1e15", "gravity_m_s2: input should be less than or equal to 100 "),
        ("upper = 360.0", "upper = 1e15", "joints.yaw.position_deg.upper: input should be less than or equal to 3600 "),
        ("value = 30.0", "value = 1e-300", "joints.yaw.velocity_deg_s.value: input should be greater than or equal to 0.001 "),
        ("jerk_m_s3 = { value = 0.6", "jerk_m_s3 = { value = 1e15", "joints.extension.jerk_m_s3.value: input should be less"),
        (
            "value = 80.0",
            "value = 1e-300",
            "joints.inner.drive.bus_voltage_V.value: input should be greater than or equal to 0.1 ",
        ),
        ("value = 5.0", "value = 500.0", "linkage.minimum_angle_deg.value: input should be less than or equal to 180 "),
        ("value = 15.0", "value = 500.0", "linkage.transmission_warning_deg.value: input should be less than or equal to 90 "),
        ("yaw_deg = 90.0", "yaw_deg = 1e15", "poses.phenotyping.yaw_deg: input should be less than or equal to 3600 "),
        (
            "inner_deg = 60.0",
            "inner_deg = 130.0",
            "poses.phenotyping: outside the limits: inner 130 deg is 10 deg above its limit",
        ),
    ],
)
def test_a_boom_file(tmp_path, old, new, key):
    text = BOOM_FILE.read_text(encoding="utf-8")
    assert old in text
    (tmp_path / "mine.toml").write_text(text.replace(old, new, 1))
    with pytest.raises(InputError) as refused:
        Boom.load(tmp_path / "mine.toml")
    assert str(refused.value).startswith(f"{tmp_path / 'mine.toml'}: key {key}")


def test_what_rounding_leaves_of_a_zero_in_a_file_is_zero(tmp_path):
    (tmp_path / "mine.toml").write_text(
        BOOM_FILE.read_text(encoding="utf-8").replace("extension_m = 0.0", "extension_m = 1e-300")
    )
    np.testing.assert_array_equal(Boom.load(tmp_path / "mine.toml").pose("transport"), BOOM.pose("transport"))


def test_a_motor_does_not_run_with_more_than_it_holds(tmp_path):
    text = CATALOGUE_FILE.read_text(encoding="utf-8")
    assert "running_torque_Nm = 7.2" in text
    (tmp_path / "mine.toml").write_text(text.replace("running_torque_Nm = 7.2", "running_torque_Nm = 1e6"))
    with pytest.raises(InputError, match="holding_torque_Nm is 9, less than running_torque_Nm, which is 1e\\+06"):
        Catalogue.load(tmp_path / "mine.toml")
