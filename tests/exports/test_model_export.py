"""The boom as URDF and MJCF, loaded by Pinocchio and MuJoCo: the same tip, torques and pin force as
the model's."""

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import mujoco
import numpy as np
import pinocchio
import pytest
import yourdfpy

from boom_model import JOINTS, Boom, InputError, forward_kinematics, gravity_torque, inverse_dynamics, mass_matrix
from boom_model.arrays import Array, read_only
from boom_model.boom import Body, Friction
from boom_model.drives.drive import drive_torque_limit, reflected_inertia
from planner import plan
from planner.exports.robot_models import UNLIMITED_EFFORT, left_out, mjcf, urdf, write_model
from tests.oracles import BOOMS, errors, random_states

BOOM = Boom.load()
STATES = 300


class Loaded(NamedTuple):
    model: pinocchio.Model
    G: Array
    """(nv, 5): the tree's coordinates are G q."""


def multipliers(text: str) -> dict[str, Array]:
    """Each moving joint's row of G, by its <mimic> element alone."""
    rows = {}
    for joint in ElementTree.fromstring(text).iter("joint"):
        if joint.get("type") != "fixed":
            mimic = joint.find("mimic")
            followed, times = (
                (joint.get("name"), 1.0) if mimic is None else (mimic.get("joint"), float(mimic.get("multiplier")))
            )
            rows[joint.get("name")] = times * np.eye(5)[JOINTS.index(followed)]
    return rows


def in_pinocchio(boom: Boom, folder: Path, mimic: bool) -> Loaded:
    write_model(boom, folder / "boom.urdf")
    model = pinocchio.buildModelFromUrdf(str(folder / "boom.urdf"), mimic)
    model.gravity.linear = np.array([0.0, 0.0, -boom.gravity])  # a URDF has none of its own
    rows = multipliers((folder / "boom.urdf").read_text())
    G = np.zeros((model.nv, 5))
    for name in JOINTS if mimic else rows:
        G[model.joints[model.getJointId(name)].idx_v] = rows[name]
    return Loaded(model, G)


@pytest.mark.parametrize("mimic", [False, True], ids=["mapped back", "mimic joints"])
@pytest.mark.parametrize("name", BOOMS)
def test_urdf_has_the_same_tip_and_torques_in_pinocchio(name: str, mimic: bool, tmp_path: Path):
    boom = BOOMS[name]
    model, G = in_pinocchio(boom, tmp_path, mimic)
    assert model.nv == (5 if mimic else 9)
    data, tip = model.createData(), model.getFrameId("tip")
    q, qd, qdd = random_states(boom, STATES, np.random.default_rng(11))
    tau, position, rotation = np.empty((STATES, 5)), np.empty((STATES, 3)), np.empty((STATES, 3, 3))
    for i, (x, xd, xdd) in enumerate(zip(q @ G.T, qd @ G.T, qdd @ G.T, strict=True)):
        tau[i] = pinocchio.rnea(model, data, x, xd, xdd) @ G
        pinocchio.framesForwardKinematics(model, data, x)
        position[i], rotation[i] = data.oMf[tip].translation, data.oMf[tip].rotation
    expected = forward_kinematics(boom, q)
    np.testing.assert_allclose(position, expected.position, rtol=0, atol=1e-14)
    np.testing.assert_allclose(rotation, expected.rotation, rtol=0, atol=1e-14)
    assert errors(tau, inverse_dynamics(boom, q, qd, qdd).tau).max() < 1e-14


def test_urdf_has_the_limits(tmp_path: Path):
    model, _ = in_pinocchio(BOOM, tmp_path, mimic=True)
    for i, joint in enumerate(JOINTS):
        at = model.joints[model.getJointId(joint)].idx_v
        assert model.lowerPositionLimit[at] == pytest.approx(BOOM.limits.lower[i], abs=1e-15)
        assert model.upperPositionLimit[at] == pytest.approx(BOOM.limits.upper[i], abs=1e-15)
        assert model.velocityLimit[at] == pytest.approx(BOOM.limits.velocity[i], rel=1e-15)
        drive = BOOM.drives[i]
        effort = UNLIMITED_EFFORT if drive is None else float(drive_torque_limit(drive, 0.0))
        assert model.effortLimit[at] == pytest.approx(effort, rel=1e-15)


def test_urdf_mimic_joints_may_go_where_their_joint_goes():
    text = urdf(BOOM)
    rows = multipliers(text)
    for joint in ElementTree.fromstring(text).iter("joint"):
        if joint.find("mimic") is not None:
            ends = np.sort([rows[joint.get("name")] @ bound for bound in (BOOM.limits.lower, BOOM.limits.upper)])
            limit = joint.find("limit")
            np.testing.assert_allclose([float(limit.get("lower")), float(limit.get("upper"))], ends, atol=1e-15)


@pytest.fixture(scope="module")
def in_yourdfpy(tmp_path_factory: pytest.TempPathFactory) -> yourdfpy.URDF:
    file = tmp_path_factory.mktemp("urdf") / "boom.urdf"
    write_model(BOOM, file)
    return yourdfpy.URDF.load(file)


def test_urdf_has_the_same_joints_limits_and_masses_in_yourdfpy(in_yourdfpy: yourdfpy.URDF):
    assert set(in_yourdfpy.actuated_joint_names) == set(JOINTS)  # the mimic joints are none
    for i, name in enumerate(JOINTS):
        limit, drive = in_yourdfpy.joint_map[name].limit, BOOM.drives[i]
        effort = UNLIMITED_EFFORT if drive is None else float(drive_torque_limit(drive, 0.0))
        expected = BOOM.limits.lower[i], BOOM.limits.upper[i], BOOM.limits.velocity[i], effort
        assert (limit.lower, limit.upper, limit.velocity, limit.effort) == pytest.approx(expected, rel=1e-15)
    masses = {name: link.inertial.mass for name, link in in_yourdfpy.link_map.items() if link.inertial}
    assert masses == {**{name: body.mass for name, body in BOOM.bodies.items()}, "tip": BOOM.payload.mass}


def test_every_joint_of_the_urdf_has_a_transmission_of_ratio_1():
    found = ElementTree.fromstring(urdf(BOOM)).findall("transmission")
    assert [(each.find("joint").get("name"), each.find("actuator").get("name")) for each in found] == [(j, j) for j in JOINTS]
    assert {each.findtext("actuator/mechanicalReduction") for each in found} == {"1"}
    assert {each.findtext("joint/hardwareInterface") for each in found} == {"hardware_interface/EffortJointInterface"}


def test_urdf_has_the_models_tip_and_gravity_torques_in_yourdfpy(in_yourdfpy: yourdfpy.URDF):
    """yourdfpy has no dynamics: gravity torques are the differences of the height of its masses."""
    robot, h = in_yourdfpy, 1e-4

    def placed(q: Array) -> dict[str, Array]:
        robot.update_cfg(dict(zip(JOINTS, q, strict=True)))
        return {name: robot.get_transform(name) for name in robot.link_map}

    def energy(q: Array) -> float:
        frames = placed(q)
        masses = [(robot.link_map[name].inertial, frame) for name, frame in frames.items()]
        return sum(BOOM.gravity * own.mass * (frame @ own.origin @ [0, 0, 0, 1])[2] for own, frame in masses if own)

    for q in random_states(BOOM, 5, np.random.default_rng(13))[0]:
        np.testing.assert_allclose(placed(q)["tip"][:3, 3], forward_kinematics(BOOM, q).position, rtol=0, atol=1e-14)
        found = [(energy(q + step) - energy(q - step)) / (2.0 * h) for step in h * np.eye(5)]
        np.testing.assert_allclose(found, gravity_torque(BOOM, q), rtol=0, atol=1e-6)


def test_urdf_says_what_it_cannot_hold():
    text = urdf(BOOM)
    for sentence in ("cannot close a loop", "belongs to the joint it mimics", "at least 0.0872665 rad", "not measured"):
        assert sentence in text
    for form in (text, mjcf(BOOM)):
        assert "Assumed: yaw velocity limit 30 deg/s" in form


class Simulated(NamedTuple):
    """The main move, followed by computed torque in MuJoCo, sample by sample."""

    tracking: Array
    correction: Array
    """what the controller adds to the model's torque"""
    gap: float
    """of the pin's two halves"""
    pin: Array
    """(n, 3) force of the outer on the upper link, over the ground"""


def in_mujoco(boom: Boom, payload: float | None = None) -> tuple[mujoco.MjModel, mujoco.MjData, list[int]]:
    model = mujoco.MjModel.from_xml_string(mjcf(boom if payload is None else boom.with_payload(payload)))
    return model, mujoco.MjData(model), [model.joint(name).dofadr[0] for name in JOINTS]


def set_pose(model: mujoco.MjModel, data: mujoco.MjData, q: Array, qd: Array) -> None:
    """The linkage's two passive joints are the differences of its two directions."""
    for target, values in ((data.qpos, q), (data.qvel, qd)):
        for name, value in zip(
            (*JOINTS, "outer", "upper"), (*values, values[1] - values[2], values[2] - values[1]), strict=True
        ):
            target[model.joint(name).qposadr[0]] = value


@pytest.fixture(scope="module")
def followed() -> tuple[Simulated, Array]:
    """And the pin force by the model."""
    move = plan(BOOM, "transport", "phenotyping", duration=8.0, step=1e-3).trajectory
    model, data, ids = in_mujoco(BOOM)
    ahead = inverse_dynamics(BOOM, move.q, move.qd, move.qdd, friction=True, drive_inertia=True)
    M = mass_matrix(BOOM, move.q, drive_inertia=True)
    set_pose(model, data, move.q[0], move.qd[0])
    halves = [
        (model.body(link).id, anchor)
        for link, anchor in zip(("outer", "upper"), model.eq_data[0, :6].reshape(2, 3), strict=True)
    ]
    tracking, correction, gap, pin = [], [], [], []
    for k in range(len(move.t) - 1):
        error, rate = move.q[k] - data.qpos[ids], move.qd[k] - data.qvel[ids]
        correction.append(M[k] @ (2500.0 * error + 100.0 * rate))
        data.ctrl[:] = ahead.tau[k] + correction[-1]
        mujoco.mj_step(model, data)
        tracking.append(error)
        outer, upper = (data.xpos[body] + data.xmat[body].reshape(3, 3) @ anchor for body, anchor in halves)
        gap.append(np.abs(outer - upper).max())
        pin.append(-data.efc_force[:3])  # the constraint pushes the first body, the outer link
    c, s = np.cos(move.q[:-1, 0]), np.sin(move.q[:-1, 0])
    x, _, z = ahead.pins.frame_7[:-1].T
    return Simulated(np.array(tracking), np.array(correction), max(gap), np.array(pin)), np.stack([c * x, s * x, z], axis=-1)


def test_mjcf_follows_the_main_move_through_its_closed_loop_on_the_models_torques(followed: tuple[Simulated, Array]):
    """MuJoCo's own integration and its constraint's softness are the difference: 2e-4 of the
    largest torque."""
    simulated, _ = followed
    assert simulated.gap < 3e-7
    assert np.abs(simulated.tracking).max() < 4e-5
    assert (np.abs(simulated.correction).max(axis=0) < [0.1, 0.1, 0.2, 0.02, 4e-3]).all()


def test_mjcf_bears_the_models_pin_force(followed: tuple[Simulated, Array]):
    simulated, expected = followed
    assert np.abs(simulated.pin - expected).max() < 3e-3 * np.abs(expected).max()


@pytest.mark.parametrize("name", BOOMS)
def test_mjcf_has_the_models_mass_matrix_and_tip(name: str):
    boom = BOOMS[name]
    model, data, ids = in_mujoco(boom)
    q, *_ = random_states(boom, STATES, np.random.default_rng(12))
    G = np.zeros((model.nv, 5))
    G[ids] = np.eye(5)
    G[model.joint("outer").dofadr[0], 1:3] = 1.0, -1.0
    G[model.joint("upper").dofadr[0], 1:3] = -1.0, 1.0
    tip, M, product = np.empty((STATES, 3)), np.empty((STATES, 5, 5)), np.empty(model.nv)
    for i, pose in enumerate(q):
        set_pose(model, data, pose, np.zeros(5))
        mujoco.mj_fwdPosition(model, data)
        tip[i] = data.site("tip").xpos
        for column, direction in enumerate(G.T):
            mujoco.mj_mulM(model, data, product, np.ascontiguousarray(direction))
            M[i, :, column] = G.T @ product
    np.testing.assert_allclose(tip, forward_kinematics(boom, q).position, rtol=0, atol=1e-14)
    expected = mass_matrix(boom, q, drive_inertia=True)
    assert np.abs(M - expected).max() < 1e-14 * np.abs(expected).max()


def test_mjcf_stands_still_at_its_keyframes():
    """Whole seconds on the motors' torques alone: a boom whose friction holds the little that is
    left."""
    boom = BOOMS["generic"]
    model, data, _ = in_mujoco(boom)
    assert model.nkey == len(boom.poses)
    for name, q in boom.poses.items():
        mujoco.mj_resetDataKeyframe(model, data, model.key(name).id)
        for _ in range(1000):
            mujoco.mj_step(model, data)
        np.testing.assert_allclose(data.site("tip").xpos, forward_kinematics(boom, q).position, rtol=0, atol=1e-6)


def test_mjcf_has_limits_drives_and_friction():
    boom = BOOMS["generic"]
    model, _, ids = in_mujoco(boom)
    for i, (joint, drive) in enumerate(zip(JOINTS, boom.drives, strict=True)):
        np.testing.assert_allclose(model.joint(joint).range, [boom.limits.lower[i], boom.limits.upper[i]], atol=1e-15)
        assert model.dof_armature[ids[i]] == pytest.approx(reflected_inertia(drive), rel=1e-15)
        limit = float(drive_torque_limit(drive, 0.0))
        np.testing.assert_allclose(model.actuator(joint).ctrlrange, [-limit, limit], rtol=1e-15)
    np.testing.assert_allclose(model.dof_damping[ids], boom.friction.viscous, rtol=1e-15)
    np.testing.assert_allclose(model.dof_frictionloss[ids], boom.friction.coulomb, rtol=1e-15)
    assert model.joint("upper").range[0] == pytest.approx(boom.limits.linkage, rel=1e-15)
    assert model.joint("outer").range[1] == pytest.approx(-boom.limits.linkage, rel=1e-15)


def test_without_payload_both_are_lighter(tmp_path: Path):
    bare = BOOM.with_payload(0.0)
    model, _ = in_pinocchio(bare, tmp_path, mimic=False)
    assert pinocchio.computeTotalMass(model) == pytest.approx(BOOM.mass, rel=1e-14)
    assert in_mujoco(BOOM, 0.0)[0].body("mount").subtreemass[0] == pytest.approx(BOOM.mass, rel=1e-14)


def test_mujoco_is_not_given_a_body_without_mass():
    bodies = {**BOOM.bodies, "outer": Body(0.0, np.zeros(3), np.zeros((3, 3)))}
    with pytest.raises(InputError, match="outer has no mass"):
        mjcf(replace(BOOM, bodies=bodies))


def test_another_ending_is_refused(tmp_path: Path):
    with pytest.raises(InputError, match=r"must end in \.urdf"):
        write_model(BOOM, tmp_path / "boom.sdf")
    assert list(tmp_path.iterdir()) == []


def test_what_a_model_cannot_carry_of_a_measured_boom_is_said():
    friction = Friction(read_only([1, 2, 3, 4, 5]), read_only([1, 2, 3, 4, 5]), (None,) * 5, read_only([0, 0.5, 0, -1, 0]))
    boom = replace(Boom.load(), friction=friction)
    (said,) = left_out(boom)
    assert "inner 0.5 Nm, extension -1 N" in said
    assert left_out(Boom.load()) == ()
    for text in (urdf(boom), mjcf(boom)):
        assert "the asymmetric part is left out" in text
