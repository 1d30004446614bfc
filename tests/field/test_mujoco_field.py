"""A simulated field: the exported MJCF in MuJoCo on a driving vehicle, against geotags."""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boom_model import JOINTS, Boom, inverse_dynamics
from boom_model.arrays import Array
from planner.exports.robot_models import mjcf
from planner.field import attitude
from planner.field.earth import geodetic_of
from planner.field.geotag import Latencies
from planner.field.log_files import JointLog, Triggers
from planner.field.rig import read_rig
from planner.field.sensor_tags import tag_sensor
from planner.field.vehicle_log import VehicleLog
from tests.builders import without_drives
from tests.field.field_files import ANTENNA, FRAME, MOUNT, RIG, SENSOR, joint_position
from tests.field.motions import Drive

SECONDS, STEP = 24.0, 1e-3
FIX, SAMPLE, BEGIN = 50, 10, 2000  # steps between fixes (20 Hz) and joint samples (100 Hz); until the boom has settled
STD, TURN_STD, JOINT_STD = 0.0143, np.radians(0.1), np.radians(0.02)
P, D = np.array([8e3, 8e3, 8e3, 2e4, 40.0]), np.array([8e2, 8e2, 4e2, 1e3, 1.0])
TURN = Rotation.from_euler("z", 2.0, degrees=True).as_matrix()
"""R_body_mount of the rig: a heading of -2 deg is anticlockwise."""


class Simulated(NamedTuple):
    t: Array
    q: Array
    antenna: Array
    sensor: Array
    R_body: Array


@pytest.fixture(scope="module")
def field() -> Simulated:
    """Every millisecond of joints and points, from MuJoCo; feed-forward servos move the boom."""
    boom, drive = without_drives(Boom.load()), Drive()
    model, data = _model(boom)
    steps = int(SECONDS / STEP)
    t = np.arange(steps) * STEP
    wanted = joint_position(t)
    hold = inverse_dynamics(boom, wanted, np.zeros_like(wanted), np.zeros_like(wanted), reactions=False).tau
    R_body, origin = attitude.rotation(*drive.angles(t).T), drive.origin(t)
    R_mount = R_body @ TURN
    turn = np.roll(Rotation.from_matrix(R_mount).as_quat(), 1, axis=-1)
    start = dict(zip(JOINTS, wanted[0], strict=True))
    start |= {"upper": start["lower"] - start["inner"], "outer": start["inner"] - start["lower"]}
    for name, value in start.items():
        data.joint(name).qpos[0] = value
    at, speed = ([getattr(model.joint(name), key)[0] for name in JOINTS] for key in ("qposadr", "dofadr"))
    q, antenna, sensor = np.empty((steps, 5)), np.empty((steps, 3)), np.empty((steps, 3))
    for k in range(steps):
        data.mocap_pos[0], data.mocap_quat[0] = origin[k] + R_body[k] @ MOUNT, turn[k]
        data.ctrl[:] = hold[k] + P * (wanted[k] - data.qpos[at]) - D * data.qvel[speed]
        mujoco.mj_kinematics(model, data)
        q[k], antenna[k], sensor[k] = data.qpos[at], data.site("antenna").xpos, data.site("sensor").xpos
        mujoco.mj_step(model, data)
    return Simulated(t, q, antenna, sensor, R_body)


def _model(boom):
    """The exported model, its mount moved from outside, with the antenna and the sensor on it."""
    top = ElementTree.fromstring(mjcf(boom))
    mount = top.find(".//body[@name='mount']")
    mount.set("mocap", "true")
    _site(mount, "antenna", TURN.T @ (ANTENNA - MOUNT))
    _site(top.find(".//body[@name='tip']"), "sensor", SENSOR)
    model = mujoco.MjModel.from_xml_string(ElementTree.tostring(top, encoding="unicode"))
    return model, mujoco.MjData(model)


def _site(body, name, place):
    ElementTree.SubElement(body, "site", name=name, pos=" ".join(f"{x:.12g}" for x in place))


def _tags(field: Simulated, noisy: bool, late: float = 0.0):
    """Geotags from the logs of the simulated instruments, and how far they are from the truth."""
    random = np.random.default_rng(5)
    scale = 1.0 if noisy else 0.0
    fixes, joints = np.arange(0, len(field.t), FIX), np.arange(0, len(field.t), SAMPLE)
    place = field.antenna[fixes] + random.normal(0.0, scale * STD, (len(fixes), 3))
    angles = attitude.angles(field.R_body[fixes]) + random.normal(0.0, scale * TURN_STD, (len(fixes), 3))
    q = field.q[joints] + random.normal(0.0, scale * JOINT_STD, (len(joints), 5)) * [1.0, 1.0, 1.0, 0.0, 1.0]
    log = VehicleLog.of(
        field.t[fixes] + late, *geodetic_of(FRAME.ecef(place)), *angles.T,
        position_covariance=(scale * STD) ** 2, attitude_covariance=(scale * TURN_STD) ** 2,
    )  # fmt: skip
    shots = np.arange(BEGIN, len(field.t) - BEGIN, 2 * FIX) if noisy else np.arange(BEGIN, len(field.t) - BEGIN, 137)
    encoders = JointLog(field.t[joints], q, "own", "joints", np.arange(len(joints)))
    triggers = Triggers(field.t[shots], tuple(str(k) for k in shots), "own", "triggers")
    found = tag_sensor(without_drives(Boom.load()), _rig(), log, encoders, triggers)
    assert found.known.all()
    return found, FRAME.enu(found.sensor.ecef) - field.sensor[shots]


def _rig():
    """The rig of the tests without latencies, a turn of the inertial sensor, errors of its own."""
    with TemporaryDirectory() as folder:
        place = Path(folder) / "rig.toml"
        place.write_text(RIG)
        rig = read_rig(place)
    std = JOINT_STD * np.array([1.0, 1.0, 1.0, 0.0, 1.0])
    exact = {"antenna_std": 0.0, "imu_std": 0.0, "mount_std": 0.0, "mount_turn_std": 0.0, "sensor_std": 0.0}
    return replace(rig, R_body_imu=np.eye(3), latencies=Latencies(), joint_std=std, **exact)


def test_the_simulated_boom_moves(field):
    """It sweeps and lags its servos: the encoders alone say where the tip is."""
    assert np.ptp(field.q[BEGIN:], axis=0)[:4].min() > 0.05
    lag = np.abs(field.q - joint_position(field.t))[BEGIN:]
    assert 1e-4 < lag.max() < 0.05
    speed = np.linalg.norm(np.diff(field.antenna, axis=0), axis=1) / STEP
    assert speed.mean() == pytest.approx(1.4, rel=0.05)


def test_tags_of_exact_logs_are_where_mujoco_has_the_sensor(field):
    """Between fixes at 20 Hz, linear interpolation errs by some tenths of a millimetre."""
    _, off = _tags(field, noisy=False)
    assert np.linalg.norm(off, axis=1).max() < 6e-4


def test_tip_error_is_as_predicted(field):
    found, off = _tags(field, noisy=True)
    rms = np.sqrt((off**2).mean(axis=0))
    predicted = np.sqrt(np.diagonal(found.sensor.covariance, axis1=1, axis2=2).mean(axis=0))
    assert rms == pytest.approx(predicted, rel=0.12)  # 200 samples: 5 % is one standard deviation
    assert np.linalg.norm(rms) == pytest.approx(np.linalg.norm(predicted), rel=0.06)
    normal = np.einsum("ni,nij,nj->n", off, np.linalg.inv(found.sensor.covariance), off)
    assert normal.mean() == pytest.approx(3.0, rel=0.12)


def test_an_ignored_delay_costs_speed_times_delay(field):
    _, off = _tags(field, noisy=False, late=0.1)
    assert np.linalg.norm(off, axis=1).mean() == pytest.approx(0.14, rel=0.08)
