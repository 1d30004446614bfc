"""The reach map: its boundary against closed forms, its cells against kinematics and dynamics, its
picture and recording."""

import itertools
import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import binary_dilation, binary_erosion

from boom_model import (
    ActuatorAngle,
    ActuatorHorizontal,
    Boom,
    FixedExtension,
    InputError,
    LeastExtension,
    LeastTorque,
    forward_kinematics,
    inverse_dynamics,
)
from boom_model.drives.drive import drive_torque_limit
from boom_model.kinematics.reach import reach_map
from planner import cli
from planner.recording import write_reach_recording
from planner.reports.reach_picture import write_reach_picture
from tests.builders import without_drives

BOOM = Boom.load()
G = BOOM.geometry
DOWN = -np.pi / 2.0
R, Z = np.arange(-3.0, 3.0, 0.05), np.arange(-2.0, 1.5, 0.05)


@pytest.mark.parametrize("extension", [0.0, 0.5])
@pytest.mark.parametrize("pitch", [DOWN, 0.0])
def test_geometry_reaches_a_ring_about_the_shoulder_under_a_fixed_extension(extension, pitch):
    """The wrist's distance from the shoulder is between |L9 - a| and L9 + a, a = hypot(L7 + theta4,
    L6), on either side."""
    found = reach_map(BOOM, FixedExtension(extension), pitch, R, Z)
    arm = np.hypot(G.L7 + extension, G.L6)
    r, z = np.meshgrid(R, Z)
    expected = np.zeros(r.shape, dtype=bool)
    for side in (1.0, -1.0):
        wrist = np.hypot(side * np.abs(r) - G.L2 - G.L8 * np.cos(pitch), z - G.L1 - G.L8 * np.sin(pitch))
        expected |= (wrist >= abs(G.L9 - arm)) & (wrist <= G.L9 + arm)
    np.testing.assert_array_equal(found.exists, expected)
    assert 0 < expected.sum() < expected.size


def test_geometry_reaches_a_band_as_high_as_the_inner_link_under_a_horizontal_actuator():
    found = reach_map(BOOM, ActuatorHorizontal(), DOWN, R, Z)
    expected = np.abs(Z - G.L1 + G.L8 - G.L6) <= G.L9
    np.testing.assert_array_equal(found.exists, np.broadcast_to(expected[:, None], found.exists.shape))


@pytest.mark.parametrize("constraint", [ActuatorHorizontal(), ActuatorAngle(-0.6), FixedExtension(0.4), LeastTorque()], ids=str)
def test_every_cell_is_reached_within_the_limits_with_its_margin(constraint):
    found = reach_map(BOOM, constraint, DOWN, R, Z)
    q = found.q[found.within_limits]
    assert len(q) > 100
    assert BOOM.limits.contain(q).all()
    r, z = (grid[found.within_limits] for grid in np.meshgrid(R, Z))
    tip = forward_kinematics(BOOM, q)
    np.testing.assert_allclose(tip.position, np.stack([r, np.zeros_like(r), z], axis=-1), rtol=0, atol=1e-13)
    still = np.zeros(5)
    tau = np.abs(inverse_dynamics(BOOM, q, still, still).tau)
    allowed = [float(drive_torque_limit(BOOM.drives[i], 0.0)) for i in (1, 2)]
    expected = 1.0 - (tau[:, 1:3] / allowed).max(axis=-1)
    np.testing.assert_allclose(found.torque_margin[found.within_limits], expected, rtol=0, atol=1e-13)
    for values in (found.q, found.torque_margin):
        assert np.isnan(values[~found.within_limits]).all()


@pytest.mark.parametrize("constraint", [ActuatorHorizontal(), FixedExtension(0.4), LeastExtension()], ids=str)
@pytest.mark.parametrize("pitch", [DOWN, -1.2])
def test_boundary_within_the_limits_is_where_joint_positions_within_them_end(constraint, pitch):
    """Forward kinematics of all joint positions within the limits that meet constraint and pitch,
    against the map, to a cell.

    A sliver between the cells' middles is no cell of the map.
    """
    found = reach_map(BOOM, constraint, pitch, R, Z)
    low, high = BOOM.limits.lower, BOOM.limits.upper
    inner, lower, extension = (np.linspace(low[i], high[i], 81 if constraint == LeastExtension() else 401) for i in (1, 2, 3))
    lower = np.array([np.pi]) if isinstance(constraint, ActuatorHorizontal) else lower
    extension = np.array([constraint.extension]) if isinstance(constraint, FixedExtension) else extension
    q = np.stack(np.broadcast_arrays(0.0, *np.meshgrid(inner, lower, extension), 0.0), axis=-1).reshape(-1, 5)
    q[:, 4] = np.mod(pitch - np.pi / 2.0 - q[:, 2] + np.pi, 2.0 * np.pi) - np.pi
    tips = forward_kinematics(BOOM, q[BOOM.limits.contain(q)]).position[:, [0, 2]]
    tips = np.concatenate([tips, tips * (-1.0, 1.0)])  # the base turned round
    seen = np.histogram2d(tips[:, 1], tips[:, 0], bins=[np.append(g, g[-1] + 0.05) - 0.025 for g in (Z, R)])[0] > 0
    nearby = np.ones((3, 3))
    surely = binary_erosion(seen, nearby)
    assert 0 < surely.sum() < surely.size
    assert found.within_limits[surely].all()
    assert binary_dilation(seen, nearby)[found.within_limits].all()


def test_map_keeps_to_the_yaw_limits():
    limits = replace(BOOM.limits, upper=BOOM.limits.upper * (0.25, 1, 1, 1, 1))  # 0 to 90 deg: never turned round
    found = reach_map(replace(BOOM, limits=limits), ActuatorHorizontal(), DOWN, R, Z)
    everywhere = reach_map(BOOM, ActuatorHorizontal(), DOWN, R, Z)
    assert not found.within_limits[:, R < -0.5].any()
    assert everywhere.within_limits[:, R < -0.5].any()
    assert (found.q[found.within_limits][:, 0] == 0.0).all()


def test_default_grid_covers_the_reach_of_every_hold():
    found = reach_map(BOOM, LeastExtension())
    for edge in (found.within_limits[0], found.within_limits[-1], found.within_limits[:, 0], found.within_limits[:, -1]):
        assert not edge.any()
    np.testing.assert_allclose([np.diff(found.r).max(), np.diff(found.z).max()], 0.02)
    assert not any(a.flags.writeable for a in (found.r, found.z, found.exists, found.within_limits, found.q))


@pytest.mark.parametrize("constraint", [ActuatorHorizontal(), FixedExtension(0.4), LeastTorque()], ids=str)
def test_more_payload_leaves_less_margin(constraint):
    margins = [reach_map(BOOM.with_payload(kg), constraint, DOWN, R[60:], Z).torque_margin for kg in (2.0, 10.0, 18.0)]
    for lighter, heavier in itertools.pairwise(margins):
        seen = np.isfinite(lighter)
        np.testing.assert_array_equal(np.isfinite(heavier), seen)
        assert (heavier[seen] < lighter[seen]).all()


@pytest.mark.parametrize("constraint", [ActuatorHorizontal(), FixedExtension(0.4)], ids=str)
def test_least_torque_leaves_the_most_margin(constraint):
    held, least = (reach_map(BOOM, h, DOWN, R, Z) for h in (constraint, LeastTorque()))
    assert least.within_limits[held.within_limits].all()
    both = held.within_limits
    assert (least.torque_margin[both] >= held.torque_margin[both] - 1e-9).all()


def test_without_a_drive_no_margin_is_known():
    bare = without_drives(BOOM)
    found = reach_map(bare, ActuatorHorizontal(), DOWN, R, Z)
    assert found.within_limits.any()
    assert np.isnan(found.torque_margin).all()


@pytest.mark.parametrize("bad", [{"r": [1.0, 0.0]}, {"z": [np.nan]}, {"pitch": np.inf}, {"r": []}])
def test_bad_input_is_named(bad):
    with pytest.raises(InputError, match=next(iter(bad))):
        reach_map(BOOM, ActuatorHorizontal(), **bad)


def picture(path, boom, found):
    write_reach_picture(path, boom, found, "a title")


@pytest.fixture(scope="module")
def coarse():
    return reach_map(BOOM, LeastTorque(), DOWN, np.arange(-3.0, 3.0, 0.2), np.arange(-2.0, 1.5, 0.2))


def test_picture_and_recording_are_written(coarse, tmp_path):
    picture(tmp_path / "reach.png", BOOM, coarse)
    assert (tmp_path / "reach.png").read_bytes().startswith(b"\x89PNG")
    write_reach_recording(tmp_path / "reach.rrd", BOOM, coarse)
    verify = [sys.executable, "-m", "rerun", "rrd", "verify", str(tmp_path / "reach.rrd")]
    done = subprocess.run(verify, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("boom", [without_drives(BOOM), BOOM.with_payload(60.0)], ids=["no drives", "overloaded"])
@pytest.mark.parametrize("r", [[1.2], [0.9, 1.2, 2.0]])
def test_odd_maps_are_drawn(boom, r, tmp_path):
    found = reach_map(boom, FixedExtension(0.4), DOWN, r, [0.3, 0.8])
    assert found.within_limits.any()
    picture(tmp_path / "reach.png", boom, found)
    write_reach_recording(tmp_path / "reach.rrd", boom, found)
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize("write", [picture, write_reach_recording])
def test_unwritable_path_is_bad_input(coarse, write, tmp_path):
    with pytest.raises(InputError, match="cannot be written"):
        write(tmp_path / "missing" / "reach.out", BOOM, coarse)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--constraint", "horizontal", "--json"], 0, ""),
        (["--pitch", "free"], 2, "drawn for one pitch"),
        (["--out", "reach.txt"], 2, "written as .png or .rrd"),
        (["--constraint", "extension=9"], 1, "within the limits"),
    ],
)
def test_command(arguments, code, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["boom", "reach", *arguments])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    captured = capsys.readouterr()
    assert (stop.value.code or 0) == code
    assert message in captured.err
    if code == 0:
        answer = json.loads(captured.out)
        assert answer["within_limits"] > 1000
        assert (tmp_path / "reach.png").exists()
    else:
        assert list(tmp_path.iterdir()) == []
