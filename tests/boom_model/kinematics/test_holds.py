"""Choice holds against dense scans of the whole family and closed forms; a pitch left free; targets
given as transforms."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from boom_model.arrays import Array
from boom_model.boom import Boom
from boom_model.drives.drive import drive_torque_limit
from boom_model.dynamics.newton_euler import inverse_dynamics
from boom_model.errors import InfeasibleError, InputError
from boom_model.kinematics import families
from boom_model.kinematics.constraints import (
    ActuatorAngle,
    ActuatorHorizontal,
    ChoosingConstraint,
    Constraint,
    FixedExtension,
    LargestMargin,
    LeastExtension,
    LeastTorque,
    NearestHorizontal,
    NearestPose,
)
from boom_model.kinematics.forward import forward_kinematics
from boom_model.kinematics.frames import frame_transforms
from boom_model.kinematics.inverse import inverse_kinematics, inverse_kinematics_of_pose, solve_branches
from tests.oracles import random_states

BOOM = Boom.load()
GEOMETRY, LIMITS = BOOM.geometry, BOOM.limits
DOWN, TURN = -np.pi / 2, 2 * np.pi
CHOICES = (
    LeastExtension(),
    NearestHorizontal(),
    LeastTorque(),
    NearestPose.to((1.0, 0.4, 2.0, 0.3, -0.2)),
    LargestMargin(),
)
CONSTRAINTS = (ActuatorHorizontal(), ActuatorAngle(-0.4), FixedExtension(0.25))
EVERY_CHOICE = pytest.mark.parametrize("constraint", CHOICES, ids=lambda constraint: type(constraint).__name__)
SCAN = np.linspace(LIMITS.lower[1], LIMITS.upper[1], 2001)


def cost(constraint: ChoosingConstraint, q: Array) -> Array:
    """What a constraint says it makes least, (...) of q (..., 5), written down a second time;
    infinite outside the limits."""
    span = LIMITS.upper - LIMITS.lower
    if isinstance(constraint, LeastExtension):
        value = q[..., 3]
    elif isinstance(constraint, NearestHorizontal):
        value = np.abs(q[..., 2] - np.pi)
    elif isinstance(constraint, LeastTorque):
        value = static_ratio(np.nan_to_num(q))
    elif isinstance(constraint, NearestPose):
        value = (((q - constraint.pose) / span) ** 2).sum(axis=-1)
    else:
        room = np.minimum(q - LIMITS.lower, LIMITS.upper - q) / span
        value = -np.minimum(room.min(axis=-1), (q[..., 2] - q[..., 1] - LIMITS.linkage) / span[2])
    return np.where(LIMITS.contain(q), value, np.inf)


def static_ratio(q: Array) -> Array:
    """The largest share (...) of what a drive allows at rest that q (..., 5) needs."""
    still = np.zeros_like(q)
    tau = inverse_dynamics(BOOM, q, still, still).tau
    return np.max([np.abs(tau[..., i]) / drive_torque_limit(BOOM.drives[i], 0.0) for i in (1, 2)], axis=0)


def both_sides(position: Array, pitch: Array) -> families.Targets:
    """Targets (2 n,) of positions (n, 3): the base forward, then turned round."""
    radius = np.hypot(position[:, 0], position[:, 1])
    yaw = np.arctan2(position[:, 1], position[:, 0])
    ahead = np.concatenate([radius, -radius])
    return families.Targets(
        theta1=np.concatenate([yaw, yaw + np.pi]),
        F=ahead - GEOMETRY.L2 - GEOMETRY.L8 * np.tile(np.cos(pitch), 2),
        G=np.tile(position[:, 2] - GEOMETRY.L1 - GEOMETRY.L8 * np.sin(pitch), 2),
        phi=np.tile(pitch - np.pi / 2, 2),
    )


def random_targets(count: int, seed: int) -> tuple[Array, Array]:
    """Positions (n, 3) and pitches (n,) that can be reached within the limits."""
    tip = forward_kinematics(BOOM, random_states(BOOM, count, np.random.default_rng(seed))[0])
    return tip.position, tip.pitch


def misses(q: Array, position: Array, pitch: Array | float) -> Array:
    """How far each q (..., 5) is from its target: the larger of metres, and radians of pitch."""
    tip = forward_kinematics(BOOM, q)
    turn = np.remainder(tip.pitch - pitch + np.pi, TURN) - np.pi
    return np.maximum(np.linalg.norm(tip.position - position, axis=-1), np.abs(turn))


@EVERY_CHOICE
def test_a_choice_reaches_200_targets_and_no_member_of_a_dense_scan_is_cheaper(constraint):
    position, pitch = random_targets(200, seed=11)
    found = solve_branches(BOOM, position, pitch, constraint)
    np.testing.assert_array_equal(found.exists, found.within_limits)
    assert found.exists.any(axis=-1).all()
    target, side = np.nonzero(found.exists)
    q = found.q[target, side]
    assert LIMITS.contain(q).all()
    assert misses(q, position[target], pitch[target]).max() < 1.5e-14
    scan = cost(constraint, families.member(BOOM, both_sides(position, pitch), SCAN)).min(axis=-1).reshape(2, -1).T
    mine = np.full_like(scan, np.inf)
    mine[found.exists] = cost(constraint, q)
    assert (mine <= scan + 1e-12).all()


@EVERY_CHOICE
def test_the_best_is_the_cheaper_side_of_the_base(constraint):
    for position, pitch in zip(*random_targets(15, seed=12), strict=True):
        found = inverse_kinematics(BOOM, position, float(pitch), constraint)
        costs = [float(cost(constraint, solution.q)) for solution in found.solutions]
        assert costs[found.best] == min(costs)


def stretched(theta2: float, extension: float, yaw: float, wrist: float) -> Array:
    """q (5,) whose inner link points at the wrist: inner link and the line from its tip to the
    wrist are one."""
    return np.array([yaw, theta2, theta2 + np.pi - np.arctan2(GEOMETRY.L6, GEOMETRY.L7 + extension), extension, wrist])


@pytest.mark.parametrize("extension", [0.05, 0.3, 0.7, 0.99])
@pytest.mark.parametrize("theta2", [0.0, 0.01, 0.02])
def test_least_extension_points_the_inner_link_at_the_wrist_where_it_can(theta2, extension):
    q = stretched(theta2, extension, 1.0, 0.2)
    tip = forward_kinematics(BOOM, q)
    found = inverse_kinematics(BOOM, tip.position, float(tip.pitch), LeastExtension())
    best = found.solutions[found.best]
    assert best.q[3] == pytest.approx(extension, abs=5e-15)
    np.testing.assert_allclose(best.q, q, rtol=0, atol=1e-14)


def test_nearest_horizontal_is_horizontal_where_it_can_be():
    position, pitch = random_targets(2000, seed=13)
    exactly = solve_branches(BOOM, position, pitch, ActuatorHorizontal())
    nearest = solve_branches(BOOM, position, pitch, NearestHorizontal())
    target, branch = np.nonzero(exactly.within_limits)
    assert len(target) > 200
    side = branch // 2
    assert nearest.exists[target, side].all()
    assert np.abs(nearest.q[target, side, 2] - np.pi).max() < 4e-15
    apart = np.where(exactly.within_limits[..., None], np.abs(exactly.q - np.repeat(nearest.q, 2, axis=1)), np.inf)
    of_side = apart.max(axis=-1).reshape(-1, 2, 2).min(axis=-1)
    assert of_side[target, side].max() < 8e-15


def test_least_torque_is_the_largest_share_of_a_drives_torque_at_rest():
    q = random_states(BOOM, 100, np.random.default_rng(14))[0]
    np.testing.assert_allclose(LeastTorque().cost(BOOM, q), static_ratio(q), rtol=1e-12)


def test_least_torque_counts_the_payload():
    position, pitch = random_targets(20, seed=15)
    q = solve_branches(BOOM, position, pitch, LeastTorque()).q[:, 0]
    q = q[np.isfinite(q).all(axis=-1)]
    assert (LeastTorque().cost(BOOM.with_payload(20.0), q) > LeastTorque().cost(BOOM, q)).any()


def test_least_torque_needs_a_drive():
    bare = replace(BOOM, drives=(None,) * 5)
    with pytest.raises(InputError, match=r"constraint least-torque: no joint of .* has a drive with a torque limit"):
        solve_branches(bare, (1.4, 0.0, 1.0), DOWN, LeastTorque())


@EVERY_CHOICE
def test_out_of_reach_there_is_no_choice_and_no_warning(constraint):
    position = np.array([(0.0, 0.0, 4.0), (30.0, -40.0, 10.0), (1e6, 0.0, -1e6), (1.4, 0.0, 1.0)])
    with warnings.catch_warnings(action="error"):
        found = solve_branches(BOOM, position, DOWN, constraint)
    np.testing.assert_array_equal(found.exists.any(axis=-1), [False, False, False, True])
    np.testing.assert_array_equal(np.isnan(found.q).any(axis=-1), ~found.exists)
    assert np.isnan(found.q[~found.exists]).all()
    assert inverse_kinematics(BOOM, position[0], DOWN, constraint).solutions == ()


@EVERY_CHOICE
@pytest.mark.parametrize("position", [(1e200, 0.0, 1.0), (0.0, -1e308, 1e308)])
def test_a_target_whose_squares_overflow_is_out_of_reach_of_a_choice(constraint, position):
    found = solve_branches(BOOM, position, DOWN, constraint)
    assert not found.exists.any()
    assert np.isnan(found.q).all()


@EVERY_CHOICE
def test_a_batch_of_choices_is_its_targets_one_by_one(constraint):
    position, pitch = random_targets(12, seed=16)
    batch = solve_branches(BOOM, position.reshape(3, 4, 3), pitch.reshape(3, 4), constraint)
    assert batch.q.shape == (3, 4, 2, 5)
    alone = [solve_branches(BOOM, p, a, constraint) for p, a in zip(position, pitch, strict=True)]
    np.testing.assert_array_equal(batch.exists.reshape(-1, 2), [b.exists for b in alone])
    np.testing.assert_array_equal(batch.q.reshape(-1, 2, 5), [b.q for b in alone])


@EVERY_CHOICE
def test_every_limit_that_a_dense_scan_crosses_is_an_end_of_an_interval(constraint):
    position, pitch = random_targets(200, seed=17)
    targets = both_sides(position, pitch)
    allowed = LIMITS.contain(families.member(BOOM, targets, SCAN))
    ends = families._ends(BOOM, targets, constraint)
    row, step = np.nonzero(allowed[:, 1:] != allowed[:, :-1])
    assert len(row) > 200
    inside = (ends[row] >= SCAN[step, None] - 1e-9) & (ends[row] <= SCAN[step + 1, None] + 1e-9)
    assert inside.any(axis=-1).all()


FREE = {
    LeastExtension(): 6,
    NearestHorizontal(): 6,
    LeastTorque(): 1,
    CHOICES[3]: 2,
    LargestMargin(): 2,
    ActuatorHorizontal(): 6,
    ActuatorAngle(-0.4): 6,
    FixedExtension(0.25): 6,
}


@pytest.mark.parametrize(("constraint", "count"), FREE.items(), ids=lambda constraint: type(constraint).__name__)
def test_a_free_pitch_is_as_good_as_any_of_a_dense_scan(constraint, count):
    measure = LargestMargin() if constraint in CONSTRAINTS else constraint
    for position in reachable_by(constraint, count):
        found = inverse_kinematics(BOOM, position, None, constraint)
        best = found.solutions[found.best]
        scan = solve_branches(BOOM, position, np.linspace(-np.pi, np.pi, 721), constraint)
        least = cost(measure, scan.q).min()
        assert best.within_limits
        assert cost(measure, best.q) <= least + 1e-12
        assert (misses(np.array([s.q for s in found.solutions]), position, found.pitch) < 1e-13).all()


def reachable_by(constraint: Constraint, count: int) -> Array:
    q = random_states(BOOM, 400, np.random.default_rng(18))[0]
    if isinstance(constraint, FixedExtension):
        q[:, 3] = constraint.extension
    elif isinstance(constraint, ActuatorAngle):
        q[:, 2] = np.pi + constraint.elevation
    return forward_kinematics(BOOM, q[LIMITS.contain(q)][:count]).position


@pytest.mark.parametrize("constraint", [*CHOICES, *CONSTRAINTS], ids=lambda constraint: type(constraint).__name__)
def test_no_pitch_reaches_a_far_position(constraint):
    found = inverse_kinematics(BOOM, (4.0, 1.0, 1.0), None, constraint)
    assert found.best is None
    assert not any(solution.within_limits for solution in found.solutions)
    assert constraint in CONSTRAINTS or found.solutions == ()


def test_a_given_pitch_is_the_one_that_solutions_tell():
    assert inverse_kinematics(BOOM, (1.4, 0.0, 1.0), -1.2).pitch == -1.2


def test_a_pose_and_its_held_extension_give_back_the_joints():
    for q in random_states(BOOM, 300, np.random.default_rng(19))[0]:
        T = frame_transforms(BOOM, q, "inner")[10]
        found = inverse_kinematics_of_pose(BOOM, T, FixedExtension(float(q[3])))
        apart = [float(np.abs(s.q - q).max()) for s in found.solutions if s.within_limits]
        assert min(apart) < 1e-9
        for solution in found.solutions:
            np.testing.assert_allclose(frame_transforms(BOOM, solution.q, "inner")[10], T, rtol=0, atol=1e-13)


POSE = np.array([0.7, 1.0, 2.6, 0.3, 0.2])


def pose_matrix() -> Array:
    return frame_transforms(BOOM, POSE, "inner")[10].copy()


def about(axis: Array, angle: float) -> Array:
    """Rotation matrix (Rodrigues)."""
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


@pytest.mark.parametrize("degrees", [-30.0, -0.01, 0.01, 5.0, 90.0])
def test_a_tilted_tip_is_refused_with_its_tilt(degrees):
    T = pose_matrix()
    forward = np.array([np.cos(POSE[0]), np.sin(POSE[0]), 0.0])
    T[:3, :3] = about(forward, np.radians(degrees)) @ T[:3, :3]
    with pytest.raises(
        InfeasibleError, match=rf"axis of its tip is always horizontal, here it tilts by {abs(degrees):.4g} deg$"
    ):
        inverse_kinematics_of_pose(BOOM, T)


@pytest.mark.parametrize("beside", [-0.25, -1e-5, 1e-5, 0.125])
def test_a_plane_that_misses_the_tip_is_refused_with_the_distance(beside):
    T = pose_matrix()
    T[:3, 3] += beside * T[:3, 2]
    sentence = rf"its plane at yaw {np.degrees(POSE[0]):.4g} deg misses the tip by {abs(beside):.4g} m$"
    with pytest.raises(InfeasibleError, match=sentence):
        inverse_kinematics_of_pose(BOOM, T)


def test_a_tilt_or_miss_within_the_tolerance_is_let_pass():
    T = pose_matrix()
    T[:3, 3] += 1e-3 * T[:3, 2]
    found = inverse_kinematics_of_pose(BOOM, T, FixedExtension(0.3), tolerance=2e-3)
    assert min(np.abs(s.q - POSE).max() for s in found.solutions) < 3e-3


@pytest.mark.parametrize("yaw", [1.0, 3.0])
@pytest.mark.parametrize("away", [0.0, 5e-7], ids=["on it", "beside it"])
def test_a_pose_on_the_yaw_axis_has_the_yaw_of_its_orientation(yaw, away):
    """Beside the axis the tip misses the arm's plane by less than the tolerance, and its own place
    tells a wrong yaw."""
    q = np.array([yaw, np.radians(120.0), np.radians(125.0), 0.0, 0.0])
    forward = forward_kinematics(BOOM, [0.0, *q[1:4], np.pi - q[2]]).position[0]  # with the end effector down
    q[4] = np.pi - np.arcsin(forward / GEOMETRY.L8) - q[2]
    T = frame_transforms(BOOM, q, "inner")[10].copy()
    T[:2, 3] = away * T[:2, 2]
    found = inverse_kinematics_of_pose(BOOM, T, FixedExtension(0.0))
    assert len(found.solutions) == 2
    for solution in found.solutions:
        np.testing.assert_allclose(frame_transforms(BOOM, solution.q, "inner")[10], T, rtol=0, atol=2e-6)


def stretched_matrix(T: Array) -> None:
    T[:3, 0] *= 1.01


def mirrored(T: Array) -> None:
    T[:3, 2] *= -1.0


def with_a_bad_last_row(T: Array) -> None:
    T[3, 0] = 0.1


@pytest.mark.parametrize("spoil", [stretched_matrix, mirrored, with_a_bad_last_row])
def test_a_matrix_that_is_no_rigid_transform_is_refused(spoil):
    T = pose_matrix()
    spoil(T)
    with pytest.raises(InputError, match="T is not a rigid transform"):
        inverse_kinematics_of_pose(BOOM, T)


@pytest.mark.parametrize(("T", "message"), [(np.eye(3), "T has shape"), (np.full((4, 4), np.nan), r"T\[0, 0\] is nan")])
def test_a_matrix_of_the_wrong_shape_or_not_finite_is_refused(T, message):
    with pytest.raises(InputError, match=message):
        inverse_kinematics_of_pose(BOOM, T)
