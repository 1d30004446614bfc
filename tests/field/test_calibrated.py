"""The probability of the plot through the whole chain: of spots said to be on a plot with p, a
share p is there."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boom_model import Boom
from planner.field import attitude
from planner.field.earth import geodetic_of
from planner.field.log_files import JointLog, Triggers
from planner.field.on_plots import locate_spots
from planner.field.rig import read_rig
from planner.field.sensor_tags import tag_sensor
from planner.field.vehicle_log import VehicleLog
from tests.builders import without_drives
from tests.field.field_files import ANTENNA, FRAME, POSITION_STD, RIG, joint_position
from tests.field.motions import Drive
from tests.field.trials import trial

DAYS, DRIVE = 120, Drive()
T = np.arange(0.0, 14.0, 0.05)
STAMPS = T[20:-20:13]  # at fixes: between two, white noise averages out and the tags are better than they say
ANGLE_STD = np.radians([0.3, 0.3, 0.6])


@pytest.fixture(scope="module")
def spots(tmp_path_factory):
    """Plot and probability of every spot of 120 days, and the plot that was seen (-1: none)."""
    place = tmp_path_factory.mktemp("rig") / "rig.toml"
    place.write_text(RIG.replace("latency_s = 0.01", "latency_s = 0.0").replace("latency_s = 0.02", "latency_s = 0.0"))
    boom, rig, plots = without_drives(Boom.load()), read_rig(place), trial()[0]
    rig = replace(rig, mount_std=0.02, mount_turn_std=0.01, imu_std=0.005, sensor_std=0.005, antenna_std=0.02, ground_std=0.1)
    triggers = Triggers(STAMPS, tuple(map(str, STAMPS)), "own", "triggers")
    q = joint_position(T)
    found, true = [], []
    for seed in range(DAYS):
        random = np.random.default_rng(1000 + seed)
        begin = random.uniform(0.3, 0.8)
        drive = replace(DRIVE, begin=begin)
        place, angles = drive.point(T, ANTENNA), _of_imu(rig, drive.angles(T))
        noisy = FRAME.ecef(FRAME.enu(place) + random.normal(0.0, 2.0 * POSITION_STD, (len(T), 3)))
        noise = {"position_covariance": np.diag(2.0 * POSITION_STD) ** 2, "attitude_covariance": np.diag(ANGLE_STD) ** 2}
        measured = VehicleLog.of(T, *geodetic_of(noisy), *(angles + random.normal(0.0, ANGLE_STD, (len(T), 3))).T, **noise)
        exact = VehicleLog.of(T, *geodetic_of(place), *angles.T)
        joints = JointLog(T, q, "own", "joints", np.arange(len(T)))
        wrong = replace(joints, q=q + random.normal(0.0, 1.0, 5) * rig.joint_std)
        found.append(locate_spots(plots.at_height(480.0), tag_sensor(boom, rig, measured, wrong, triggers)))
        true.append(locate_spots(plots.at_height(480.0), tag_sensor(boom, _drawn(rig, random), exact, joints, triggers)))
    parts = [(each.plot, each.probability, other.plot, other.probability) for each, other in zip(found, true, strict=True)]
    plot, p, there, sure = (np.concatenate(part) for part in zip(*parts, strict=True))
    return plot, p, np.where(sure > 0.5, there, -1)


def _of_imu(rig, angles):
    return attitude.angles(attitude.rotation(*angles.T) @ rig.R_body_imu)


def _drawn(rig, random):
    """A rig as it might truly be, given what the file says of it."""

    def turn(std):
        return Rotation.from_rotvec(random.normal(0.0, std, 3)).as_matrix()

    return replace(
        rig,
        antenna=rig.antenna + random.normal(0.0, rig.antenna_std, 3),
        mount=rig.mount + random.normal(0.0, rig.mount_std, 3),
        R_body_mount=turn(rig.mount_turn_std) @ rig.R_body_mount,
        R_body_imu=rig.R_body_imu @ turn(rig.imu_std),
        sensor=rig.sensor + random.normal(0.0, rig.sensor_std, 3),
        ground=rig.ground + random.normal(0.0, rig.ground_std),
    )


def test_reliability_diagram(spots):
    plot, p, there = spots
    hit = plot == there
    for low in np.arange(0.0, 1.0, 0.2):
        band = (plot >= 0) & (p >= low) & (p < low + 0.2 + 1e-9)
        said = p[band].mean()
        assert band.sum() > 50
        assert abs(hit[band].mean() - said) < 4.0 * np.sqrt(said * (1.0 - said) / band.sum())
