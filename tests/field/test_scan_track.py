"""Scans along a log: the tip's way from the planned joints and the true motion of the mount."""

import numpy as np
import pytest

from boom_model import Boom, InputError, forward_kinematics, inverse_dynamics
from planner.field import attitude
from planner.field.earth import geodetic_of
from planner.field.rig import read_rig
from planner.field.scan_task import ScanTask
from planner.field.scan_track import scan_along
from planner.field.vehicle_log import VehicleLog
from planner.timing.limit_ratios import Limit
from tests.field.field_files import RIG
from tests.field.weave import Weave

BOOM = Boom.load()
TASK = ScanTask((0.5, 0.5))


@pytest.fixture(scope="module")
def weave():
    return Weave()


@pytest.fixture(scope="module")
def along(weave):
    return scan_along(BOOM, weave.plots, TASK, weave.log())


def test_the_tip_is_on_its_line_while_the_vehicle_weaves(weave, along):
    assert [each.row for each in along.passes] == [1, 1, 1]
    for number, each in enumerate(along.passes):
        motion = each.trajectory
        place, R = weave.pose(each.curve.mount.begin + motion.t)
        ground = place + np.einsum("nij,nj->ni", R, forward_kinematics(BOOM, motion.q).position)
        across = (ground[:, :2] - weave.row.middle) @ weave.row.left
        beside = (ground[:, :2] - weave.row.middle) @ weave.row.ahead
        assert np.ptp(across) < 1e-3  # the vehicle weaves by 100 mm
        assert across.mean() == pytest.approx(-0.35 + 0.35 * number, abs=1e-3)
        assert beside == pytest.approx(weave.along(each.curve.mount.begin + motion.t), abs=1e-3)
        assert ground[:, 2] - place[:, 2] == pytest.approx(np.full(len(motion.t), 0.9), abs=1e-3)


def test_the_row_is_covered_and_the_others_are_not(weave, along):
    rows = np.array(along.plots.rows)
    assert along.coverage[rows == 1].min() >= 0.99
    assert along.coverage[rows > 2].max() < 0.01
    assert len(along.unreachable) == 36
    assert "the vehicle passes 0 times with row 5 on its left" in along.unreachable["5-1"]


def test_limits_count_the_motion_of_the_mount(along):
    """Torques are those with the base's motion, and others than those of a mount at rest."""
    each = along.passes[1]
    motion = each.trajectory
    still = inverse_dynamics(BOOM, motion.q, motion.qd, motion.qdd, friction=True, reactions=False).tau
    base = each.curve.mount.base(motion.t)
    tau = inverse_dynamics(BOOM, motion.q, motion.qd, motion.qdd, base=base, friction=True, reactions=False).tau
    assert np.abs(tau - still).max() > 1.0
    assert each.worst < 1.0
    assert each.ratios[Limit.VELOCITY] == pytest.approx((np.abs(motion.qd) / BOOM.limits.velocity).max(), rel=1e-9)


def test_the_motion_of_the_mount_is_that_of_the_vehicle(weave, along):
    """Velocity, turn rate and acceleration against differences of the true motion."""
    mount = along.passes[0].curve.mount
    t, h = np.linspace(2.0, mount.duration - 2.0, 50), 1e-3
    before, (place, R), after = (weave.pose(mount.begin + t + dt) for dt in (-h, 0.0, h))
    base = mount.base(t)
    velocity = np.einsum("nji,nj->ni", R, (after[0] - before[0]) / (2 * h))
    acceleration = np.einsum("nji,nj->ni", R, (after[0] - 2 * place + before[0]) / h**2)
    assert base.velocity == pytest.approx(velocity, abs=1e-3)
    assert base.acceleration == pytest.approx(acceleration, abs=3e-3)
    turned = place + np.einsum("nij,nj->ni", R, np.cross(base.angular_velocity, [1.0, 2.0, 3.0])) * h
    true = place + np.einsum("nij,j->ni", after[1] - before[1], [1.0, 2.0, 3.0]) / 2.0
    assert turned == pytest.approx(true, abs=1e-5)


def test_a_rig_takes_the_antenna_to_the_mount(weave, tmp_path):
    """A log of the antenna, with its inertial sensor turned, gives the mount's own motion."""
    (tmp_path / "rig.toml").write_text(RIG)
    rig = read_rig(tmp_path / "rig.toml")
    lever = rig.R_body_mount.T @ (rig.antenna - rig.mount)
    found = scan_along(BOOM, weave.plots, TASK, weave.log(0.0, lever, rig.R_body_mount.T @ rig.R_body_imu), rig)
    for each in found.passes:
        t = np.linspace(0.0, each.curve.mount.duration, 50)
        assert each.curve.mount.pose(t)[0] == pytest.approx(weave.pose(each.curve.mount.begin + t)[0], abs=1e-3)


def test_rtk_noise_leaves_the_tip_within_a_centimetre(weave):
    """White noise of 14 mm at 20 Hz, smoothed over a second: some 14 mm * sqrt(1 / 20)."""
    found = scan_along(BOOM, weave.plots, TASK, weave.log(0.0143))
    each = found.passes[0]
    place, R = weave.pose(each.curve.mount.begin + each.trajectory.t)
    ground = place + np.einsum("nij,nj->ni", R, forward_kinematics(BOOM, each.trajectory.q).position)
    across = (ground[:, :2] - weave.row.middle) @ weave.row.left + 0.35
    assert 1e-3 < np.sqrt((across**2).mean()) < 6e-3
    assert each.curve.mount.residual == pytest.approx(0.0143 * np.sqrt(3.0), rel=0.1)


def test_a_log_elsewhere_is_refused(weave):
    place, R = weave.pose(weave.t)
    ecef = weave.plots.frame.ecef(place + np.array([0.0, 200.0, 0.0]))
    log = VehicleLog.of(weave.t, *geodetic_of(ecef), *attitude.angles(R).T, source="far.csv")
    with pytest.raises(InputError, match=r"far\.csv: it passes no row of plots on its left, 0\.5 to 3\.5 m away"):
        scan_along(BOOM, weave.plots, TASK, log)
