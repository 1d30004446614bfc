"""Frames of both loops, the closed forms and the motion of every body against each other, MuJoCo's
tree, the textbook recursion, differences and the thesis."""

from dataclasses import fields

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boom_model.arrays import Array
from boom_model.boom import Boom
from boom_model.dynamics.base_motion import BaseMotion
from boom_model.errors import InputError
from boom_model.kinematics.forward import (
    FrameMotion,
    body_motion,
    forward_kinematics,
    frame_motion,
    jacobian,
    jacobian_rate,
    manipulability,
    transmission_angle,
)
from boom_model.kinematics.frames import BODY_FRAMES, R_LINK_BODY, body_transforms, dh_rows, frame_transforms
from tests.oracles import (
    BOOMS,
    UP,
    derivative,
    instants,
    mujoco_kinematics,
    mujoco_motion,
    random_base,
    random_states,
    textbook_recursion,
    turning,
)

BOOM = Boom.load()
LOOPS = pytest.mark.parametrize("loop", ["inner", "outer"])
MOTIONS = ("velocity", "angular_velocity", "acceleration", "angular_acceleration")
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


def test_jacobian_rate_is_the_derivative_of_the_jacobian():
    q, qd, _ = random_states(BOOM, 100, np.random.default_rng(9))
    assert_equal(jacobian_rate(BOOM, q, qd), derivative(lambda s: jacobian(BOOM, q + s * qd), h=4e-3), tolerance=1e-12)


@LOOPS
def test_jacobian_and_its_rate_carry_the_motion_of_the_tip(loop):
    q, qd, qdd = random_states(BOOM, 200, np.random.default_rng(11))
    J, Jd, motion = jacobian(BOOM, q), jacobian_rate(BOOM, q, qd), frame_motion(BOOM, q, qd, qdd, loop)
    velocity = np.einsum("nij,nj->ni", J, qd)
    acceleration = np.einsum("nij,nj->ni", J, qdd) + np.einsum("nij,nj->ni", Jd, qd)
    assert_equal(velocity, tip_twist(motion.velocity, motion.angular_velocity), tolerance=1e-14)
    assert_equal(acceleration, tip_twist(motion.acceleration, motion.angular_acceleration), tolerance=3e-14)


def tip_twist(linear: Array, angular: Array) -> Array:
    return np.concatenate([linear[:, 10], angular[:, 10]], axis=-1)


def test_manipulability_is_the_product_of_the_singular_values():
    q = positions(200, 12)
    expected = np.prod(np.linalg.svd(jacobian(BOOM, q)[:, :3], compute_uv=False), axis=-1)
    assert_equal(manipulability(BOOM, q), expected, tolerance=1e-14)


def on_the_yaw_axis() -> Array:
    """Actuator and end effector upright, and the inner link leaning back over the base."""
    g = BOOM.geometry
    return np.array([0.0, np.arccos(-(g.L2 + g.L6 - g.L8) / g.L9), np.pi / 2, 0.3, 0.0])


def drawn_in_beyond_its_pin() -> Array:
    """rho = 0, end effector along the actuator and inner link across it: all of the plane's columns
    are parallel."""
    return np.array([0.0, 0.4, 0.4 + np.pi / 2, -BOOM.geometry.L7, 0.0])


@pytest.mark.parametrize("pose", [on_the_yaw_axis, drawn_in_beyond_its_pin])
def test_manipulability_vanishes_in_singular_poses(pose):
    """To the root of rounding, whatever the yaw; a determinant that rounds below 0 is 0."""
    q = np.tile(pose(), (200, 1))
    q[:, 0] = np.linspace(0.0, 2 * np.pi, 200)
    measure = manipulability(BOOM, q)
    assert measure[0] < 1e-15
    assert (measure < 1e-7).all()
    q[:, [1, 3]] += 0.1
    assert (manipulability(BOOM, q) > 0.01).all()


@pytest.mark.parametrize(("gap", "angle"), [(0, 0), (5, 5), (90, 90), (120, 60), (175, 5), (180, 0), (-30, 30), (-150, 30)])
@pytest.mark.parametrize("inner", [0.0, 60.0, 100.0])
def test_transmission_angle_is_the_acute_angle_between_the_links(inner, gap, angle):
    q = np.radians([30.0, inner, inner + gap, 0.0, 40.0])
    assert_equal(transmission_angle(BOOM, q), np.radians(angle), tolerance=1e-15)


@LOOPS
def test_frame_motion_is_the_textbook_recursion(loop):
    rng = np.random.default_rng(13)
    states, base = random_states(BOOM, 50, rng), random_base(rng, 50)
    motion = frame_motion(BOOM, *states, loop, base)
    R = motion.T[..., :3, :3]
    expected = [textbook_recursion(BOOM, *state, loop, now) for *state, now in zip(*states, instants(base, 50), strict=True)]
    w, w1, v, a = np.einsum("nfij,nfpj->pnfi", R, expected)
    assert_equal(motion.velocity, v, tolerance=3e-14)
    assert_equal(motion.angular_velocity, w, tolerance=1e-14)
    assert_equal(motion.acceleration + BOOM.gravity * base.up[:, None], a, tolerance=1e-13)
    assert_equal(motion.angular_acceleration, w1, tolerance=3e-14)


def test_both_loops_move_alike_outboard_of_the_linkage():
    rng = np.random.default_rng(14)
    states, base = random_states(BOOM, 200, rng), random_base(rng)
    inner, outer = (frame_motion(BOOM, *states, loop, base) for loop in ("inner", "outer"))
    for part in MOTIONS:
        assert_equal(getattr(inner, part)[:, 7:], getattr(outer, part)[:, 7:], tolerance=4e-14)


def joint_motion(t: Array) -> tuple[Array, Array, Array]:
    """Every joint swings about the middle of its range; t (n,)."""
    limits, frequency = BOOM.limits, np.array([0.7, 1.1, 0.9, 1.3, 1.7])
    centre, swing = (limits.upper + limits.lower) / 2, (limits.upper - limits.lower) / 4
    angle = t[:, None] * frequency + [0.1, 0.5, 1.2, 2.0, 2.8]
    return centre + swing * np.sin(angle), swing * frequency * np.cos(angle), -swing * frequency**2 * np.sin(angle)


def vehicle_motion(t: Array) -> tuple[Array, Array, BaseMotion]:
    """Pose of frame 1 in the ground, R (n, 3, 3) and p (n, 3), and its motion: rocking about an
    axis that rocks itself."""
    first, second = np.array([2.0, -1.0, 2.0]) / 3.0, np.array([0.6, 0.8, 0.0])
    f, f1, f2 = 0.8 * np.sin(1.3 * t), 1.04 * np.cos(1.3 * t), -1.352 * np.sin(1.3 * t)
    g, g1, g2 = (x[:, None] * second for x in (0.5 * np.cos(0.9 * t), -0.45 * np.sin(0.9 * t), -0.405 * np.cos(0.9 * t)))
    outer = Rotation.from_rotvec(f[:, None] * first)
    R = outer * Rotation.from_rotvec(g)
    turned, spin = outer.apply(g1), f1[:, None] * first
    omega = spin + turned
    omega_rate = f2[:, None] * first + np.cross(spin, turned) + outer.apply(g2)
    wave = np.array([1.0, 0.7, 0.4]) * t[:, None] + [0.0, 0.9, 2.1]
    into = R.inv()
    base = BaseMotion.of(
        velocity=into.apply(np.array([1.0, 0.7, 0.4]) * np.cos(wave)),
        angular_velocity=into.apply(omega),
        acceleration=into.apply(-np.array([1.0, 0.49, 0.16]) * np.sin(wave)),
        angular_acceleration=into.apply(omega_rate),
        up=into.apply(UP),
    )
    return R.as_matrix(), np.sin(wave), base


@LOOPS
def test_frame_motion_is_the_derivative_of_the_poses_on_the_ground(loop):
    times = np.linspace(0.0, 6.0, 25)

    def on_ground(s: float) -> tuple[Array, Array, FrameMotion]:
        """Position and rotation (n, 11, ...) of every frame, and its motion along frame 1."""
        q, qd, qdd = joint_motion(times + s)
        R, p, base = vehicle_motion(times + s)
        motion = frame_motion(BOOM, q, qd, qdd, loop, base)
        R = R[:, None]
        return p[:, None] + (R @ motion.T[..., :3, 3:])[..., 0], R @ motion.T[..., :3, :3], motion

    def along_ground(part: str, s: float = 0.0) -> Array:
        return np.einsum("nij,nfj->nfi", vehicle_motion(times + s)[0], getattr(on_ground(s)[2], part))

    R, dR = on_ground(0.0)[1], derivative(lambda s: on_ground(s)[1], h=3e-3)
    for part, rate in (
        ("velocity", derivative(lambda s: on_ground(s)[0], h=3e-3)),
        ("angular_velocity", turning(R, dR)),
        ("acceleration", derivative(lambda s: along_ground("velocity", s), h=3e-3)),
        ("angular_acceleration", derivative(lambda s: along_ground("angular_velocity", s), h=3e-3)),
    ):
        assert_equal(along_ground(part), rate, tolerance=3e-12)


def test_bodies_move_as_in_mujoco():
    boom, rng = BOOMS["generic"], np.random.default_rng(15)
    states, base = random_states(boom, 50, rng), random_base(rng, 50)
    motions, expected = body_motion(boom, *states, base), mujoco_motion(boom, *states, base)
    assert set(motions) == {*boom.bodies, "payload"}
    for name, body in expected.items():
        assert_equal(motions[name].com, body.com, tolerance=1e-14)
        for part in MOTIONS:
            assert_equal(getattr(motions[name], part), getattr(body, part), tolerance=1e-13)


def test_bodies_are_placed_where_their_transforms_are():
    q = positions(20, 16)
    poses, motions = body_transforms(BOOM, q), body_motion(BOOM, q, np.zeros(5), np.zeros(5))
    poses["payload"] = poses.pop("tip")
    for name, T in poses.items():
        np.testing.assert_array_equal(motions[name].T, T)


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
        ((), lambda q: transmission_angle(BOOM, q)),
    ):
        expected = np.reshape([function(one) for one in q], (*shape, *last))
        np.testing.assert_array_equal(function(q.reshape(*shape, 5)), expected, strict=True)


@pytest.mark.parametrize("shape", [(), (5,), (3, 5), (2, 3, 5), (0,)])
@pytest.mark.parametrize("moving", ["still", "constant", "varying"])
def test_batches_of_motions_are_their_states_one_by_one(shape, moving):
    rng = np.random.default_rng(17)
    count = int(np.prod(shape))
    states = random_states(BOOM, count, rng)
    base = None if moving == "still" else random_base(rng, *(() if moving == "constant" else shape))
    at = [None] * count if base is None else instants(flat(base), count)
    batch = [x.reshape(*shape, 5) for x in states]
    for last, function in (
        ((11, 3), lambda *state: frame_motion(BOOM, *state).acceleration),
        ((3,), lambda q, qd, qdd, _, base: body_motion(BOOM, q, qd, qdd, base)["upper"].acceleration),
        ((6, 5), lambda q, qd, *_: jacobian_rate(BOOM, q, qd)),
        ((), lambda q, *_: manipulability(BOOM, q)),
    ):
        alone = [function(*state, "outer", now) for *state, now in zip(*states, at, strict=True)]
        actual, expected = function(*batch, "outer", base), np.reshape(alone, (*shape, *last))
        assert actual.shape == expected.shape
        assert_equal(actual, expected, tolerance=1e-15)


def flat(base: BaseMotion) -> BaseMotion:
    """The samples of a base motion in one row."""
    return BaseMotion(*(np.reshape(getattr(base, field.name), (-1, 3)) for field in fields(base)))


@pytest.mark.parametrize("given", [field.name for field in fields(BaseMotion) if field.name != "up"])
@pytest.mark.parametrize("shape", [(2, 3), (1, 3, 3)])
def test_a_base_that_does_not_match_the_states_is_named(given, shape):
    base = BaseMotion.of(**{given: np.ones(shape)})
    with pytest.raises(InputError, match=r"base .*does not match states of shape \(3, 5\)"):
        frame_motion(BOOM, np.zeros((3, 5)), np.zeros(5), np.zeros(5), "inner", base)


@pytest.mark.parametrize(
    "function",
    [
        forward_kinematics,
        jacobian,
        manipulability,
        body_transforms,
        transmission_angle,
        lambda boom, q: frame_transforms(boom, q, "inner"),
        lambda boom, q: jacobian_rate(boom, q, np.zeros(5)),
        lambda boom, q: frame_motion(boom, q, np.zeros(5), np.zeros(5), "inner"),
        lambda boom, q: body_motion(boom, q, np.zeros(5), np.zeros(5)),
    ],
    ids=[
        *("forward_kinematics", "jacobian", "manipulability", "body_transforms", "transmission_angle"),
        *("frame_transforms", "jacobian_rate", "frame_motion", "body_motion"),
    ],
)
def test_bad_positions_are_named(function):
    q = np.zeros((2, 5))
    q[1, 3] = np.nan
    with pytest.raises(InputError, match=r"q\[1, 3\] is nan"):
        function(BOOM, q)
    with pytest.raises(InputError, match=r"q has shape \(4,\); its last axis must have length 5"):
        function(BOOM, np.zeros(4))


@pytest.mark.parametrize("loop", ["inner", "outer"])
def test_many_states_at_once_are_each_as_alone(loop):
    q = np.random.default_rng(4).uniform(-3.0, 3.0, (3, 1000, 5))
    T = frame_transforms(BOOM, q, loop)
    assert T.shape == (3, 1000, 11, 4, 4)
    for index in ((0, 0), (1, 23), (1, 24), (2, 999)):
        np.testing.assert_array_equal(T[index], frame_transforms(BOOM, q[index], loop))
    assert frame_transforms(BOOM, q[:0], loop).shape == (0, 1000, 11, 4, 4)
