"""Injected delays, lever arms and mounting angles are found again, as well as their covariance
says."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from boom_model import Boom, InputError, forward_kinematics
from planner.field import attitude
from planner.field.estimate import ANGLES, LEVER, OFFSET, estimate
from tests.field.field_files import joint_position
from tests.field.motions import SASKATOON, Drive

ANTENNA, SENSOR = np.array([0.2, -0.1, 2.9]), np.array([0.4, 2.4, 0.9])
T = np.arange(0.0, 60.0, 0.05)
STAMPS = np.arange(3.0, 57.0, 0.2)
DRIVE = Drive(turning=0.1, sway=0.06)


def measured(true_times, seed, std=0.0143):
    """A total station's points of the sensor."""
    noise = np.random.default_rng(seed).normal(0.0, std, (len(true_times), 3))
    return DRIVE.point(true_times, SENSOR) + noise @ SASKATOON.R_ecef_enu.T


def test_a_delay_of_100_ms_and_a_lever_arm_wrong_by_5_cm_are_found():
    log = DRIVE.log(T, ANTENNA, 0.0143, np.radians(0.05), seed=1)
    wrong = SENSOR - ANTENNA + [0.05, -0.05, 0.05]
    found = estimate(log, STAMPS, measured(STAMPS - 0.1, 2), 0.0143, wrong)
    assert found["offset_s"] == pytest.approx(0.1, abs=5e-3)
    assert [found[name] for name in LEVER] == pytest.approx(SENSOR - ANTENNA, abs=5e-3)
    assert 0.8 < found.misfit < 1.3
    assert found.rms < 0.05


def test_errors_are_as_the_covariance_says():
    """The sum of normalised squares over 15 drives lies within the 99.9 % band of its
    chi-square."""
    total = 0.0
    for seed in range(15):
        log = DRIVE.log(T, ANTENNA, 0.0143, seed=100 + seed)
        found = estimate(log, STAMPS, measured(STAMPS + 0.03, 200 + seed), 0.0143, SENSOR - ANTENNA)
        error = found.values - [-0.03, *(SENSOR - ANTENNA)]
        total += error @ np.linalg.solve(found.covariance, error)
    # Between two fixes their white noise averages out, so the covariance is somewhat on the safe
    # side.
    assert chi2.ppf(0.0005, 60) * 0.7 < total < chi2.ppf(0.9995, 60)


def test_mounting_angles_of_the_boom_are_found():
    """The boom sweeps while the vehicle drives; its mount is turned by 0.5, -0.8 and 1.2 deg more
    than the rig says."""
    boom, random = Boom.load(), np.random.default_rng(5)
    mount, turned = np.array([1.2, 0.6, 0.5]), np.radians([0.5, -0.8, 1.2])

    def in_mount(t):
        swung = joint_position(3.0 * t) + np.outer(1.2 * np.sin(0.4 * t) - 0.8, [1.0, 0.0, 0.0, 0.0, 0.0])
        return forward_kinematics(boom, swung).position

    point = mount + in_mount(STAMPS) @ Rotation.from_rotvec(turned).as_matrix().T
    R = attitude.rotation(*DRIVE.angles(STAMPS).T)
    seen = SASKATOON.ecef(DRIVE.origin(STAMPS) + np.einsum("nij,nj->ni", R, point))
    seen = seen + random.normal(0.0, 0.005, seen.shape)
    log = DRIVE.log(T, ANTENNA, 0.005, seed=6)
    found = estimate(log, STAMPS, seen, 0.005, mount - ANTENNA + 0.03, (*LEVER, *ANGLES), in_mount=in_mount)
    assert [found[name] for name in ANGLES] == pytest.approx(turned, abs=4.0 * found.std[3:].max())
    assert found.std[3:].max() < np.radians(0.3)
    assert [found[name] for name in LEVER] == pytest.approx(mount - ANTENNA, abs=4.0 * found.std[:3].max())


def test_a_straight_drive_is_refused():
    """At a steady speed and attitude, a delay and a lever arm along the track are the
    same thing."""
    straight = Drive(turning=1e-9, sway=0.0, heave=0.0)
    log = straight.log(T, ANTENNA, 0.01)
    with pytest.raises(InputError, match="it must turn, and change its speed"):
        estimate(log, STAMPS, straight.point(STAMPS, SENSOR), 0.01, SENSOR - ANTENNA)
    found = estimate(log, STAMPS, straight.point(STAMPS - 0.1, SENSOR), 0.01, SENSOR - ANTENNA, OFFSET)
    assert found["offset_s"] == pytest.approx(0.1, abs=5e-3)


def test_refused():
    log = DRIVE.log(T, ANTENNA)
    with pytest.raises(InputError, match="mounting angles need a point that moves in the mount"):
        estimate(log, STAMPS, measured(STAMPS, 1), 0.01, SENSOR - ANTENNA, ANGLES)
    with pytest.raises(InputError, match="0 measured positions lie within"):
        estimate(log, STAMPS + 1e3, measured(STAMPS, 1), 0.01, SENSOR - ANTENNA)
