"""Frames of both loops and the closed forms against each other, MuJoCo's tree, differences and the thesis."""

import numpy as np
import pytest

from boom_model.arrays import Array
from boom_model.boom import Boom
from boom_model.errors import InputError
from boom_model.frames import BODY_FRAMES, R_LINK_BODY, body_transforms, dh_rows, frame_transforms
from boom_model.kinematics import forward_kinematics, jacobian
from tests.oracles import derivative, mujoco_kinematics, random_states, textbook_recursion, turning

BOOM = Boom.load()
ROUNDING = 4e-15  # of positions of some 3 m, and of rotations


def positions(count: int, seed: int) -> Array:
    return random_states(BOOM, count, np.random.default_rng(seed))[0]


def assert_equal(actual: Array, expected: Array, tolerance: float = ROUNDING) -> None:
    np.testing.assert_allclose(actual, expected, rtol=0, atol=tolerance)


def test_both_loops_agree_outboard_of_the_linkage():
    q = positions(1000, 1)
    assert_equal(frame_transforms(BOOM, q, "inner")[:, 7:], frame_transforms(BOOM, q, "outer")[:, 7:], tolerance=1e-14)


def test_loops_agree_with_the_closed_form():
    q = positions(1000, 2)
    tip, T = forward_kinematics(BOOM, q), frame_transforms(BOOM, q, "outer")[:, 10]
    assert_equal(tip.position, T[:, :3, 3], tolerance=1e-14)
    assert_equal(tip.rotation, T[:, :3, :3], tolerance=1e-14)


def test_body_frames_are_those_of_the_tree():
    for q in positions(50, 3):
        data, poses = mujoco_kinematics(BOOM, q), body_transforms(BOOM, q)
        assert set(poses) == {*BOOM.bodies, "tip"}
        for name in BODY_FRAMES:
            assert_equal(data.body(name).xpos, poses[name][:3, 3])
            assert_equal(data.body(name).xmat.reshape(3, 3), poses[name][:3, :3])
        assert_equal(data.site("tip").xpos, poses["tip"][:3, 3])
        assert_equal(data.site("tip").xmat.reshape(3, 3), poses["tip"][:3, :3])


def test_the_tree_closes_at_pin_7():
    for q in positions(200, 4):
        data = mujoco_kinematics(BOOM, q)
        pin7 = frame_transforms(BOOM, q, "outer")[6, :3, 3]
        assert_equal(data.site("pin 7 of outer").xpos, data.site("pin 7 of upper").xpos)
        assert_equal(data.site("pin 7 of outer").xpos, pin7)


def test_links_keep_their_lengths():
    q = positions(1000, 5)
    shoulder, pin6, pin7, pin8, wrist = np.moveaxis(frame_transforms(BOOM, q, "outer")[:, 4:9, :3, 3], 1, 0)
    inner_pin = frame_transforms(BOOM, q, "inner")[:, 5, :3, 3]
    g = BOOM.geometry
    for a, b, length in (
        (shoulder, pin6, g.L3),
        (pin6, pin7, g.L4),
        (pin7, pin8, g.L5),
        (shoulder, inner_pin, g.L9),
        (inner_pin, pin8, 0.0),
        (pin8, wrist, np.hypot(g.L6, g.L7 + q[:, 3])),
    ):
        assert_equal(np.linalg.norm(b - a, axis=-1), np.broadcast_to(length, len(q)))


def test_link_axes_point_along_the_links():
    q = positions(200, 6)
    zero = np.zeros(len(q))
    angles = {"base": zero, "inner": q[:, 1], "outer": q[:, 1], "end_effector": q[:, 2] + q[:, 4]}
    angles["payload"] = angles["end_effector"]
    forward = np.stack([np.cos(q[:, 0]), np.sin(q[:, 0]), zero], axis=-1)
    right = np.stack([np.sin(q[:, 0]), -np.cos(q[:, 0]), zero], axis=-1)
    up = np.array([0.0, 0.0, 1.0])
    poses = body_transforms(BOOM, q)
    poses["payload"] = poses.pop("tip")
    for name, R in R_LINK_BODY.items():
        angle = angles.get(name, q[:, 2])[:, None]
        axes = (np.cos(angle) * forward + np.sin(angle) * up, np.cos(angle) * up - np.sin(angle) * forward, right)
        assert_equal(poses[name][:, :3, :3] @ R.T, np.stack(axes, axis=-1))


@pytest.mark.parametrize(
    ("q", "tip"),
    [
        ((0, np.pi / 2, np.pi, 0, 0), (0.790, 0.0, 1.112)),
        ((np.pi / 4, np.radians(67.5), np.radians(165), 0.25, np.pi / 4), (1.003, 1.003, 0.779)),
        ((np.pi / 2, np.pi / 4, np.radians(150), 0.5, np.pi / 2), (0.0, 1.884, 0.204)),
    ],
    ids=["start", "middle", "end"],
)
def test_tip_positions_of_table_2_6(q, tip):
    assert_equal(forward_kinematics(BOOM, q).position, tip, tolerance=0.0005)


@pytest.mark.parametrize(
    ("phi", "pitch", "direction"),
    [
        (np.pi, -np.pi / 2, (0.0, 0.0, -1.0)),
        (0.0, np.pi / 2, (0.0, 0.0, 1.0)),
        (-np.pi / 2, 0.0, (1.0, 0.0, 0.0)),
        (1.5 * np.pi, 0.0, (1.0, 0.0, 0.0)),
        (np.pi / 2, np.pi, (-1.0, 0.0, 0.0)),
        (np.radians(-60.0), np.radians(30.0), (np.sqrt(0.75), 0.0, 0.5)),
    ],
    ids=["down", "up", "level", "level again", "backward", "30 deg above level"],
)
@pytest.mark.parametrize("lower", [0.5, 2.5])
def test_pitch_is_the_elevation_of_the_end_effector(phi, pitch, direction, lower):
    q = np.array([0.0, 0.3, lower, 0.2, phi - lower])
    wrist, tip = frame_transforms(BOOM, q, "outer")[9:11, :3, 3]
    assert_equal((tip - wrist) / BOOM.geometry.L8, direction, tolerance=1e-14)
    assert_equal(forward_kinematics(BOOM, q).pitch, pitch)


def test_pitch_goes_with_the_direction_of_the_end_effector():
    q = positions(200, 7)
    wrist, tip = np.moveaxis(frame_transforms(BOOM, q, "outer")[:, 9:11, :3, 3], 1, 0)
    forward = np.cos(q[:, 0]) * (tip - wrist)[:, 0] + np.sin(q[:, 0]) * (tip - wrist)[:, 1]
    assert_equal(forward_kinematics(BOOM, q).pitch, np.arctan2((tip - wrist)[:, 2], forward), tolerance=4e-14)


def test_jacobian_is_the_derivative_of_the_pose():
    q = positions(100, 8)
    J, R = jacobian(BOOM, q), forward_kinematics(BOOM, q).rotation
    for i, direction in enumerate(np.eye(5)):
        velocity = derivative(lambda s, d=direction: forward_kinematics(BOOM, q + s * d).position)
        dR = derivative(lambda s, d=direction: forward_kinematics(BOOM, q + s * d).rotation)
        assert_equal(J[:, :3, i], velocity, tolerance=4e-13)
        assert_equal(J[:, 3:, i], turning(R, dR), tolerance=4e-13)


@pytest.mark.parametrize("loop", ["inner", "outer"])
def test_jacobian_carries_the_motion_of_the_recursion(loop):
    for q, qd, qdd in zip(*random_states(BOOM, 50, np.random.default_rng(9)), strict=True):
        tip, R = textbook_recursion(BOOM, q, qd, qdd, loop)[10], forward_kinematics(BOOM, q).rotation
        J = jacobian(BOOM, q)
        Jd = derivative(lambda s, q=q, qd=qd: jacobian(BOOM, q + s * qd), h=4e-3)
        assert_equal(J @ qd, np.concatenate([R @ tip.v, R @ tip.w]), tolerance=1e-14)
        gravity = np.array([0.0, 0.0, BOOM.gravity, 0.0, 0.0, 0.0])
        assert_equal(J @ qdd + Jd @ qd + gravity, np.concatenate([R @ tip.vd, R @ tip.wd]), tolerance=1e-12)


@pytest.mark.parametrize("shape", [(), (5,), (3, 5), (2, 3, 5), (0,)])
def test_batches_are_their_states_one_by_one(shape):
    q = positions(int(np.prod(shape)), 10)
    for last, function in (
        ((10, 4), lambda q: dh_rows(BOOM, q, "inner")),
        ((11, 4, 4), lambda q: frame_transforms(BOOM, q, "outer")),
        ((6, 5), lambda q: jacobian(BOOM, q)),
        ((3,), lambda q: forward_kinematics(BOOM, q).position),
        ((3, 3), lambda q: forward_kinematics(BOOM, q).rotation),
        ((), lambda q: forward_kinematics(BOOM, q).pitch),
    ):
        expected = np.reshape([function(one) for one in q], (*shape, *last))
        np.testing.assert_array_equal(function(q.reshape(*shape, 5)), expected, strict=True)


@pytest.mark.parametrize(
    "function",
    [forward_kinematics, jacobian, body_transforms, lambda boom, q: frame_transforms(boom, q, "inner")],
    ids=["forward_kinematics", "jacobian", "body_transforms", "frame_transforms"],
)
def test_bad_positions_are_named(function):
    q = np.zeros((2, 5))
    q[1, 3] = np.nan
    with pytest.raises(InputError, match=r"q\[1, 3\] is nan"):
        function(BOOM, q)
    with pytest.raises(InputError, match=r"q has shape \(4,\); its last axis must have length 5"):
        function(BOOM, np.zeros(4))
