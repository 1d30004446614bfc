"""A rig measured from a manoeuvre, through the command and from Python: what was injected is found,
and geotag reads it."""

import json
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boom_model import BaseMotion, Boom, forward_kinematics, inverse_dynamics, tip_deflection
from planner.field import attitude
from planner.field.log_files import JointLog, Points, read_vehicle_log
from planner.field.manoeuvre import measure_rig
from planner.field.rig import read_rig
from tests.builders import without_drives
from tests.field.field_files import ANTENNA, MOUNT, SENSOR, joint_position, write_field, write_points
from tests.field.motions import SASKATOON, Drive

DRIVE = Drive(turning=0.1, sway=0.06, surge=2.0)
STAMPS = np.arange(3.0, 57.0, 0.2)
ASK = ("rig", "vehicle.csv", "points.csv", "--rig", "rig.toml")


@pytest.fixture
def manoeuvre(boom, tmp_path):
    """Stamps of the vehicle 100 ms late, and a mount 5 cm from where the rig says."""
    write_field(tmp_path, DRIVE, 60.0, seed=3, late=0.1)
    write_points(tmp_path / "points.csv", DRIVE, STAMPS, MOUNT)
    text = (tmp_path / "rig.toml").read_text()
    assert "[1.2, 0.6, 0.5]" in text
    (tmp_path / "rig.toml").write_text(text.replace("[1.2, 0.6, 0.5]", "[1.25, 0.55, 0.55]  # by tape\n"))
    return boom


def test_delay_and_lever_arm_are_found_and_written(manoeuvre, tmp_path):
    code, out, error = manoeuvre(*ASK, "--out", "measured.toml")
    assert (code, error) == (0, "")
    assert len(out.splitlines()) <= 24
    assert max(map(len, out.splitlines())) <= 80
    assert "latency of the vehicle's log" in out
    assert "boom geotag vehicle.csv" in out
    rig = read_rig(tmp_path / "measured.toml")
    assert rig.latencies.position == pytest.approx(0.1, abs=5e-3)
    assert rig.latencies.attitude == pytest.approx(0.1, abs=5e-3)
    assert rig.mount == pytest.approx(MOUNT, abs=5e-3)
    assert rig.mount_std < 3e-3
    text = (tmp_path / "measured.toml").read_text()
    assert "# by tape" in text
    table = tomllib.loads(text)
    assert table["mount"]["basis"] == "measured"
    assert table["antenna"]["basis"] == "printed"
    assert table["antenna"]["source"].startswith("a test; latency measured: boom rig vehicle.csv points.csv: 270 points")
    assert table["joints"] == tomllib.loads((tmp_path / "rig.toml").read_text())["joints"]


def test_answers_fit_every_width(manoeuvre, monkeypatch):
    for width in (60, 80, 140):
        monkeypatch.setenv("COLUMNS", str(width))
        for asked in (ASK, ("geotag", "vehicle.csv", "joints.csv", "triggers.csv", "--rig", "rig.toml")):
            lines = manoeuvre(*asked)[1].splitlines()
            assert max(map(len, lines)) <= width
            assert "…" not in "".join(lines)


def test_geotag_reads_the_measured_rig(manoeuvre, tmp_path):
    """The same triggers, tagged with the rig as given and as measured, against where the sensor
    was."""
    manoeuvre(*ASK, "--out", "measured.toml")
    off = {}
    for name in ("rig.toml", "measured.toml"):
        code, out, _ = manoeuvre("geotag", "vehicle.csv", "joints.csv", "triggers.csv", "--rig", name, "--json")
        assert code == 0
        tags = [tag for tag in json.loads(out)["tags"] if tag["reason"] is None]
        stamps = np.array([tag["utc"] for tag in tags]) - 1.7830e9 - 0.02
        found = np.array([[tag["sensor_x_epsg_32613"], tag["sensor_y_epsg_32613"]] for tag in tags])
        true = _utm(DRIVE.point(stamps, _sensor_on_vehicle(joint_position(stamps))))
        off[name] = np.sqrt((np.linalg.norm(found - true, axis=-1) ** 2).mean())
    assert off["rig.toml"] > 0.12  # 1.4 m/s times 0.1 s, and 7 cm
    assert off["measured.toml"] < 0.03  # noise of the log, 0.014 m in two directions


def _utm(ecef):
    from planner.field.earth import coordinates_in

    return coordinates_in(32613, ecef)[:, :2]


def _sensor_on_vehicle(q):
    tip = forward_kinematics(Boom.load(), q)
    turn = Rotation.from_rotvec([0.0, 0.0, np.radians(2.0)]).as_matrix()
    return MOUNT + (tip.position + tip.rotation @ SENSOR) @ turn.T


def test_json_holds_the_covariance(manoeuvre):
    code, out, _ = manoeuvre(*ASK, "--json")
    answer = json.loads(out)
    assert code == 0
    assert answer["parameters"] == ["vehicle_latency_s", "lever_x_m", "lever_y_m", "lever_z_m"]
    assert np.linalg.eigvalsh(answer["covariance"]).min() > 0.0
    assert answer["points_used"] == 270
    assert 0.5 < answer["misfit"] < 1.5
    off = np.array(answer["values"]) - [0.1, *(MOUNT - ANTENNA)]
    assert off @ np.linalg.solve(answer["covariance"], off) < 18.5  # 99.9 % of a chi-square of 4
    assert any("standard deviations off" in warning for warning in answer["warnings"])


def test_antenna_from_a_point_at_a_known_place(manoeuvre, tmp_path):
    """A prism on the roof: the antenna's place is found from it, and the points' clock may be the
    one that is late."""
    prism = np.array([-0.8, 0.4, 2.2])
    write_points(tmp_path / "points.csv", DRIVE, STAMPS, prism)
    text = (tmp_path / "rig.toml").read_text()
    (tmp_path / "rig.toml").write_text(text.replace("[0.2, -0.1, 2.9]", "[0.25, -0.15, 2.85]"))
    asked = (*ASK, "--point", "-0.8,0.4,2.2", "--estimate", "lever-arm,points-delay")
    code, out, _ = manoeuvre(*asked, "--out", "measured.toml")
    assert code == 0
    assert "latency of the points" in out
    rig = read_rig(tmp_path / "measured.toml")
    assert rig.antenna == pytest.approx(ANTENNA, abs=5e-3)
    assert rig.latencies.position == 0.0
    figures = {figure["name"]: figure for figure in json.loads(manoeuvre(*asked, "--json")[1])["figures"]}
    assert figures["latency of the points"]["found"] == pytest.approx(-0.1, abs=5e-3)


def test_angles_lever_arm_and_both_latencies_from_a_sweep(tmp_path):
    """The boom sweeps while the vehicle turns; mount, its angles and the joints' clock are all
    wrong in the rig."""
    boom = without_drives(Boom.load())
    names = write_field(tmp_path, DRIVE, 60.0, seed=5, late=0.1)
    rig, log = read_rig(names["rig"]), read_vehicle_log(names["vehicle"])
    turn, joints_late = np.radians([0.5, -0.8, 1.2]), 0.06
    t, quiet = np.arange(0.0, 60.0, 0.01), np.zeros((6000, 5))
    joints = JointLog(t + 1.7830e9 + joints_late, _swept(t) + quiet, "utc", "joints", np.arange(6000))
    tip = forward_kinematics(boom, _swept(STAMPS))
    R = Rotation.from_rotvec(turn).as_matrix() @ rig.R_body_mount
    r = MOUNT + (tip.position + tip.rotation @ SENSOR) @ R.T
    body = attitude.rotation(*DRIVE.angles(STAMPS).T)
    seen = DRIVE.origin(STAMPS) + np.einsum("nij,nj->ni", body, r)
    seen += np.random.default_rng(9).normal(0.0, 0.003, seen.shape)
    points = Points(STAMPS + 1.7830e9, SASKATOON.ecef(seen), np.full(len(STAMPS), 0.003), "utc", "points")
    guess = replace(rig, mount=rig.mount + 0.05)
    found = measure_rig(boom, guess, log, points, ("delay", "joints-delay", "lever-arm", "angles"), "sensor", joints)
    values = {figure.name: figure for figure in found.figures}
    assert values["latency of the vehicle's log"].found == pytest.approx(0.1, abs=5e-3)
    assert values["latency of the joints' log"].found == pytest.approx(joints_late, abs=5e-3)
    for i, axis in enumerate("xyz"):
        assert values[f"mount {axis}"].found == pytest.approx(MOUNT[i], abs=5e-3)
        angle = values[f"mount turned about {axis}"]
        assert angle.found == pytest.approx(turn[i], abs=4.0 * angle.std)
        assert angle.std < np.radians(0.15)
    keys = found.changes["mount"]
    new = attitude.rotation(0.0, 0.0, 0.0).T @ attitude.rotation(
        *np.radians([keys[f"{name}_deg"] for name in ("roll", "pitch", "heading")])
    )
    assert new == pytest.approx(
        Rotation.from_rotvec([f.found for f in found.figures[-3:]]).as_matrix() @ rig.R_body_mount, abs=1e-6
    )


def test_sweep_of_the_shipped_boom_through_the_command(manoeuvre, tmp_path):
    """The boom sags as `tip_deflection` says; with that in the points, mount and angles are found
    from the sensor."""
    boom, q = Boom.load(), _swept(STAMPS)
    lines = [f"{1.7830e9 + t + 0.01:.3f},{','.join(f'{x:.8f}' for x in row)}" for t, row in _samples()]
    (tmp_path / "joints.csv").write_text("\n".join(["utc,q1,q2,q3,q4,q5", *lines]) + "\n")
    tip = forward_kinematics(boom, q)
    up = np.swapaxes(attitude.rotation(*DRIVE.angles(STAMPS).T), -1, -2)[..., 2]
    R = Rotation.from_rotvec([0.0, 0.0, np.radians(2.0)]).as_matrix()
    tau = inverse_dynamics(boom, q, np.zeros(5), np.zeros(5), base=BaseMotion.of(up=up @ R)).tau
    sag = tip_deflection(boom, q, tau).wind_up
    assert np.linalg.norm(sag, axis=-1).max() > 2e-3
    write_points(tmp_path / "points.csv", DRIVE, STAMPS, MOUNT + (tip.position + sag + tip.rotation @ SENSOR) @ R.T)
    code, _, error = manoeuvre(
        *ASK, "--joints", "joints.csv", "--estimate", "delay,joints-delay,lever-arm,angles", "--out", "m.toml"
    )
    assert (code, error) == (0, "")
    rig = read_rig(tmp_path / "m.toml")
    assert np.abs(rig.mount - MOUNT).max() < 3.0 * rig.mount_std < 0.01
    assert rig.latencies.position == pytest.approx(0.1, abs=5e-3)
    assert rig.latencies.joints == pytest.approx(0.01, abs=5e-3)
    off = Rotation.from_matrix(rig.R_body_mount @ R.T).as_rotvec()
    assert np.abs(off).max() < 3.0 * rig.mount_turn_std < np.radians(0.3)


def _samples():
    t = np.arange(0.0, 60.0, 0.01)
    return zip(t, _swept(t), strict=True)


def _swept(t):
    """A boom that sweeps some 70 deg to and fro, up and down."""
    return joint_position(3.0 * t) + np.outer(1.2 * np.sin(0.4 * t) - 0.8, [1.0, 0.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--estimate", "dely"), "unknown estimate 'dely'; did you mean delay?"),
        (
            ("--estimate", "delay,points-delay"),
            "does not tell the latency of the vehicle's log from that of the measured points",
        ),
        (("--estimate", "angles"), "angles and joints-delay need the sensor"),
        (("--point", "sensor"), "the joints' log is needed"),
        (("--point", "mont"), "unknown point 'mont'; did you mean mount?"),
        (("--point", "1,2"), "has 2 numbers; it needs 3"),
        (("--out", "rig.toml"), "the same command reads it"),
    ],
)
def test_refused(options, message, manoeuvre):
    code, out, error = manoeuvre(*ASK, *options)
    assert (code, out, error.count("\n")) == (2, "", 1)
    assert message in error


def test_clocks_that_are_seconds_apart_are_refused(manoeuvre, tmp_path):
    write_points(tmp_path / "points.csv", DRIVE, STAMPS, MOUNT, utc=1.7830e9 + 3.0)
    code, _, error = manoeuvre(*ASK)
    assert code == 2
    assert "beyond 2 s; set the clocks nearer" in error


def test_points_of_another_drive_are_refused(manoeuvre, tmp_path):
    write_points(tmp_path / "points.csv", replace(DRIVE, begin=2.0), STAMPS, MOUNT)
    code, _, error = manoeuvre(*ASK)
    assert code == 2
    assert "times worse than their standard deviations say" in error


def test_a_straight_drive_is_refused(boom, tmp_path):
    straight = Drive(turning=1e-9, sway=0.0, heave=0.0)
    write_field(tmp_path, straight, 60.0, seed=4)
    write_points(tmp_path / "points.csv", straight, STAMPS, MOUNT)
    code, _, error = boom(*ASK, "--out", "measured.toml")
    assert code == 2
    assert "it must turn, and change its speed" in error
    assert not (tmp_path / "measured.toml").exists()
