"""The sensor at the end of the boom: a whole field day known exactly, its sag, its covariance
against samples."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boom_model import Boom, InputError, forward_kinematics, inverse_dynamics, jacobian, tip_deflection
from planner.field import attitude
from planner.field.arm import lever_arm, play, yielding
from planner.field.earth import geodetic_of
from planner.field.geotag import Latencies
from planner.field.log_files import JointLog, Triggers, read_joint_log, read_triggers, read_vehicle_log
from planner.field.rig import read_rig
from planner.field.sensor_tags import joints_at, tag_sensor
from planner.field.vehicle_log import VehicleLog
from tests.builders import without_drives
from tests.field.field_files import FRAME, joint_position, true_spots, write_field
from tests.field.motions import Drive


@pytest.fixture(scope="module")
def day(tmp_path_factory):
    names = write_field(tmp_path_factory.mktemp("day"), Drive())
    logs = read_vehicle_log(names["vehicle"]), read_joint_log(names["joints"]), read_triggers(names["triggers"])
    return read_rig(names["rig"]), *logs


def test_sensor_and_spot_of_a_rigid_arm(day):
    """Without drives nothing winds up: sensor and spot are where the marched rays say."""
    boom, drive = without_drives(Boom.load()), Drive()
    found = tag_sensor(boom, *day)
    assert found.known.all()
    stamps = found.triggers.t - 1.7830e9
    sensor, spot = true_spots(boom, drive, stamps, joint_position(stamps - 0.02))
    assert np.linalg.norm(FRAME.enu(found.sensor.ecef) - sensor, axis=-1).max() < 4e-4
    assert np.linalg.norm(FRAME.enu(found.seen.ecef) - spot, axis=-1).max() < 5e-4
    middle = FRAME.enu(found.footprint).mean(axis=1)
    assert np.linalg.norm(middle - spot, axis=-1).max() < 0.15  # perspective moves the middle of an oblique footprint
    assert found.bearing[0] == pytest.approx(np.arctan2(*found.view[0, :2]) % (2.0 * np.pi))


def test_footprint_straight_down(day):
    """A footprint of 0.4 by 0.6 m at 1 m, at the range of the canopy."""
    boom = without_drives(Boom.load())
    rig, log, joints, triggers = day
    q = joints.q.copy()
    q[:, 4] = np.pi - q[:, 2]
    still = replace(log, R_ecef_body=np.tile(FRAME.R_ecef_enu @ rig.R_body_imu, (len(log.t), 1, 1)))
    found = tag_sensor(boom, rig, still, replace(joints, q=q), triggers)
    corners = FRAME.enu(found.footprint)
    depth = FRAME.enu(found.sensor.ecef)[:, 2] - corners[:, 0, 2]
    sides = np.linalg.norm(np.diff(corners, axis=1), axis=-1)
    assert sides == pytest.approx(np.stack([0.4 * depth, 0.6 * depth, 0.4 * depth], axis=-1), rel=2e-4)
    assert np.linalg.norm(found.seen.ecef - found.footprint.mean(axis=1), axis=-1).max() < 1e-4


def test_sag_is_that_of_the_tip(day):
    """To first order, what `tip_deflection` says at the joint torques of gravity."""
    boom, (rig, *_) = Boom.load(), day
    q = joint_position(np.linspace(0.0, 20.0, 30))
    up = np.tile([0.0, 0.0, 1.0], (30, 1))
    bent = yielding(boom, q, up)
    tau = inverse_dynamics(boom, q, np.zeros(5), np.zeros(5)).tau
    at_tip = replace(rig, sensor=np.zeros(3))
    moved = lever_arm(boom, at_tip, bent, np.zeros((30, 5)), np.zeros(3)).r
    moved = (moved - lever_arm(boom, at_tip, q, np.zeros((30, 5)), np.zeros(3)).r) @ rig.R_body_mount
    assert np.abs(moved).max() > 1e-3
    assert moved == pytest.approx(tip_deflection(boom, q, tau).wind_up, abs=2e-5)


def test_sag_is_down_and_counts(day):
    found = tag_sensor(Boom.load(), *day)
    assert (found.sag[:, 2] < -1e-3).all()
    rigid = tag_sensor(without_drives(Boom.load()), *day)
    difference = (found.sensor.ecef - rigid.sensor.ecef) @ FRAME.R_ecef_enu
    assert difference == pytest.approx(found.sag, abs=1e-6)
    assert any("wrist has no drive" in note for note in found.notes)
    assert any("assumed: ground" in note for note in found.notes)


def test_lever_arms_covariance_equals_samples(day):
    """Every part of the rig moved at random, at ten poses; the formula is written out
    again here."""
    boom, (rig, *_) = Boom.load(), day
    random, count = np.random.default_rng(7), 40_000
    backlash = play(boom)[0]
    assert backlash[1] > 0.0
    for t in np.linspace(0.0, 20.0, 10):
        q = joint_position(np.array([t]))
        found = lever_arm(boom, rig, q, np.zeros((1, 5)), rig.sensor).covariance[0]
        joints = q + random.normal(size=(count, 5)) * np.hypot(rig.joint_std, backlash)
        tip = lever_arm(boom, rig, joints, np.zeros((count, 5)), rig.sensor + random.normal(size=(count, 3)) * rig.sensor_std)
        arm = tip.r + rig.antenna - rig.mount
        arm = arm + np.cross(random.normal(size=(count, 3)) * rig.mount_turn_std, arm)
        shift = random.normal(size=(count, 3)) * rig.mount_std - random.normal(size=(count, 3)) * rig.antenna_std
        r = rig.mount - rig.antenna + arm + shift
        r = r + np.cross(random.normal(size=(count, 3)) * rig.imu_std, r)
        theirs = np.cov(r.T)
        scale = np.sqrt(np.outer(np.diag(theirs), np.diag(theirs)))
        assert (np.abs(found - theirs) / scale).max() < 0.03


def test_rate_is_the_jacobians(day):
    boom, (rig, *_) = Boom.load(), day
    q, qd = joint_position(np.array([3.0])), np.array([[0.1, -0.2, 0.15, 0.05, 0.3]])
    half = 1e-6
    ahead, behind = (lever_arm(boom, rig, q + s * half * qd, qd, rig.sensor).r for s in (1.0, -1.0))
    assert lever_arm(boom, rig, q, qd, rig.sensor).rate == pytest.approx((ahead - behind) / (2.0 * half), abs=1e-8)
    plain = replace(rig, R_body_mount=np.eye(3))
    assert lever_arm(boom, plain, q, qd, np.zeros(3)).rate[0] == pytest.approx(jacobian(boom, q[0])[:3] @ qd[0], abs=1e-12)


def test_spots_covariance_equals_samples(day):
    """Attitude and height of the canopy moved at random under an oblique view."""
    boom = without_drives(Boom.load())
    rig, log, joints, triggers = day
    quiet = replace(rig, antenna_std=0.0, imu_std=0.0, mount_std=0.0, mount_turn_std=0.0, joint_std=np.zeros(5), sensor_std=0.0)
    n = len(log.t)
    log = replace(log, position_covariance=np.zeros((n, 3, 3)), attitude_covariance=np.tile(np.eye(3) * 0.002**2, (n, 1, 1)))
    found = tag_sensor(boom, quiet, log, joints, triggers)
    k, random, count = 20, np.random.default_rng(8), 50_000
    R0, view, sensor = found.sensor.R_enu_body[k], found.view[k], FRAME.enu(found.sensor.ecef[k])
    arm = R0.T @ (sensor - FRAME.enu(_antenna(log, found.triggers.t[k] - 0.02)))
    depth = (FRAME.enu(found.seen.ecef[k]) - sensor)[2]
    errors = random.normal(0.0, 0.002, (count, 3)) + attitude.angles(R0)
    R = attitude.rotation(*errors.T)
    rays = np.einsum("nij,j->ni", R, R0.T @ view)
    shifted = np.einsum("nij,j->ni", R, arm) - R0 @ arm
    heights = depth - shifted[:, 2] + random.normal(0.0, rig.ground_std, count)
    spots = (shifted + rays * (heights / rays[:, 2])[:, None])[:, :2]
    theirs = np.cov(spots.T)
    scale = np.sqrt(np.outer(np.diag(theirs), np.diag(theirs)))
    assert (np.abs(found.seen.covariance[k, :2, :2] - theirs) / scale).max() < 0.04


def _antenna(log, t):
    k = int(np.searchsorted(log.t, t)) - 1
    u = (t - log.t[k]) / (log.t[k + 1] - log.t[k])
    return (1.0 - u) * log.ecef[k] + u * log.ecef[k + 1]


def test_simulated_field_errs_as_predicted(tmp_path):
    """A minute at 1.4 m/s with 20 Hz RTK and 100 Hz joints as files; tagged at the fixes, the RMS
    is what the tags say."""
    boom, drive = without_drives(Boom.load()), Drive()
    names = write_field(tmp_path, drive, 60.0, seed=21)
    quiet = replace(
        read_rig(names["rig"]),
        antenna_std=0.0,
        imu_std=0.0,
        mount_std=0.0,
        mount_turn_std=0.0,
        joint_std=np.zeros(5),
        sensor_std=0.0,
    )
    t = np.arange(20, 1180) * 0.05
    triggers = Triggers(t + 0.02 + 1.7830e9, tuple(map(str, t)), "utc", "triggers")
    found = tag_sensor(boom, quiet, read_vehicle_log(names["vehicle"]), read_joint_log(names["joints"]), triggers).sensor
    true, _ = true_spots(boom, drive, t + 0.02, joint_position(t))
    rms = np.sqrt(((FRAME.enu(found.ecef) - true) ** 2).mean(axis=0))
    predicted = np.sqrt(np.diagonal(found.covariance, axis1=1, axis2=2).mean(axis=0))
    assert rms == pytest.approx(predicted, rel=0.07)  # 2 % is the noise of an RMS of 1,160
    assert predicted == pytest.approx([0.0149, 0.0149, 0.0204], rel=0.05)  # 14, 14, 20 mm, and the attitude over 3 m


@pytest.mark.parametrize("seed", range(10))
def test_whole_chains_covariance_equals_monte_carlo(seed, day):
    """A random rig, pose and motion: every error of logs, rig and clocks drawn 100,000 times, the
    chain written out again."""
    boom, random, count = without_drives(Boom.load()), np.random.default_rng(300 + seed), 100_000
    late = Latencies(position_std=0.008, attitude_std=0.02, joints_std=0.01, trigger_std=0.005)
    imu, mounting = (attitude.rotation(0.0, 0.0, 0.0).T @ attitude.rotation(*random.uniform(-0.3, 0.3, 3)) for _ in range(2))
    rig = replace(
        day[0], antenna=random.uniform(-1.5, 1.5, 3), mount=random.uniform(-1.5, 1.5, 3), sensor=random.uniform(-0.2, 0.2, 3),
        R_body_imu=imu, R_body_mount=mounting, antenna_std=0.004, mount_std=0.005, sensor_std=0.003, imu_std=0.002,
        mount_turn_std=0.003, joint_std=np.array([1e-3, 1e-3, 1e-3, 2e-3, 1e-3]), latencies=late,
    )  # fmt: skip
    q0 = joint_position(random.uniform(0.0, 20.0, 1))[0] + random.uniform(-0.3, 0.3, 5) * [1, 0.2, 0.2, 0.2, 1]
    qd, v = random.uniform(-0.3, 0.3, 5), random.uniform(-1.5, 1.5, 3) * [1, 1, 0.1]
    angles, spin = random.uniform([-0.1, -0.1, 0.0], [0.1, 0.1, 6.28]), random.uniform(-0.2, 0.2, 3)
    P, S = np.diag([0.014, 0.014, 0.02]) ** 2, np.diag([0.001, 0.001, 0.002]) ** 2
    t, at = np.arange(-0.5, 0.5, 0.002), 0.0003
    log = VehicleLog.of(
        t, *geodetic_of(FRAME.ecef(v * t[:, None])), *(angles + spin * t[:, None]).T,
        velocity=np.tile(v, (len(t), 1)), position_covariance=P, attitude_covariance=S,
    )  # fmt: skip
    joints = JointLog(t, q0 + qd * t[:, None], "own", "joints", np.arange(len(t)))
    found = tag_sensor(boom, rig, log, joints, Triggers(np.array([at]), ("one",), "own", "triggers")).sensor

    def normal(std, *shape):
        return random.normal(0.0, std, (count, *shape))

    stamp, fix, turn, joint = (
        normal(std)[:, None] for std in (late.trigger_std, late.position_std, late.attitude_std, late.joints_std)
    )
    antenna = v * (at + stamp + fix) + random.multivariate_normal(np.zeros(3), P, count)
    drawn = angles + spin * (at + stamp + turn) + random.multivariate_normal(np.zeros(3), S, count)
    body = attitude.rotation(*drawn.T) @ imu.T @ Rotation.from_rotvec(normal(rig.imu_std, 3)).as_matrix()
    tip = forward_kinematics(boom, q0 + qd * (at + stamp + joint) + normal(1.0, 5) * rig.joint_std)
    arm = tip.position + np.einsum("nij,nj->ni", tip.rotation, rig.sensor + normal(rig.sensor_std, 3))
    arm = np.einsum("nij,nj->ni", Rotation.from_rotvec(normal(rig.mount_turn_std, 3)).as_matrix() @ mounting, arm)
    arm += rig.mount + normal(rig.mount_std, 3) - rig.antenna - normal(rig.antenna_std, 3)
    samples = antenna + np.einsum("nij,nj->ni", body, arm)
    theirs = np.cov(samples.T)
    scale = np.sqrt(np.outer(np.diag(theirs), np.diag(theirs)))
    assert (np.abs(found.covariance[0] - theirs) / scale).max() < 0.03
    off = samples - FRAME.enu(found.ecef[0])
    assert off.mean(axis=0) == pytest.approx(np.zeros(3), abs=1e-3)
    squares = np.einsum("ni,ij,nj->n", off[:, :2], np.linalg.inv(found.covariance[0, :2, :2]), off[:, :2])
    assert 0.94 < np.mean(squares < 5.991464547107979) < 0.96


def test_gaps_of_the_joints_and_clocks():
    t = np.r_[np.arange(0.0, 1.0, 0.01), np.arange(1.5, 2.0, 0.01)]
    log = JointLog(t, joint_position(t), "own", "joints.csv", np.arange(len(t)) + 2)
    q, qd, reasons = joints_at(log, np.array([-1.0, 0.505, 1.2, 9.0]))
    assert [bool(reason) for reason in reasons] == [True, False, True, True]
    assert "in a gap of 0.51 s before line 102 of joints.csv" in reasons[2]
    assert q[1] == pytest.approx(joint_position(np.array([0.505]))[0], abs=1e-6)
    assert qd[1] == pytest.approx((joint_position(np.array([0.506])) - joint_position(np.array([0.504])))[0] / 0.002, abs=1e-4)


def test_views_to_the_sky_have_no_spot(day):
    rig, log, joints, triggers = day
    found = tag_sensor(Boom.load(), replace(rig, view=np.array([-1.0, 0.0, 0.0])), log, joints, triggers)
    assert found.known.all()
    assert np.isnan(found.seen.ecef).all()
    assert np.isnan(found.footprint).all()
    assert any("views do not meet the canopy" in note for note in found.notes)


def test_triggers_in_local_time_or_another_clock_are_refused(day):
    rig, log, joints, triggers = day
    with pytest.raises(InputError, match=r"no trigger has a position: .* local time"):
        tag_sensor(Boom.load(), rig, log, joints, replace(triggers, t=triggers.t - 6 * 3600.0))
    with pytest.raises(InputError, match="give all one clock"):
        tag_sensor(Boom.load(), rig, log, joints, replace(triggers, clock="own"))
