"""Any finite target, under any constraint, has solutions or a reasoned refusal: no other exception,
no NaN."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from boom_model.arrays import Array
from boom_model.boom import Boom
from boom_model.errors import InfeasibleError, InputError
from boom_model.kinematics.constraints import (
    ActuatorAngle,
    ActuatorHorizontal,
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
from boom_model.kinematics.inverse import Solutions, inverse_kinematics, inverse_kinematics_of_pose
from planner import TipTarget
from planner.paths.targets import resolve

BOOM = Boom.load()
LIMITS = BOOM.limits
TURN = 2 * np.pi
BOUNDED = settings(derandomize=True, deadline=None, max_examples=100)
FEW = settings(derandomize=True, deadline=None, max_examples=25)

ANY = st.floats(allow_nan=False, allow_infinity=False)
HUGEST = 1e150  # its square is a number
FINITE = st.floats(-HUGEST, HUGEST)
NEAR = st.floats(-2.5, 2.5)
ANGLE = st.floats(-7.0, 7.0)


def positions(numbers: st.SearchStrategy[float]) -> st.SearchStrategy[tuple[float, float, float]]:
    return st.tuples(numbers, numbers, numbers)


@st.composite
def joints(draw: st.DrawFn) -> Array:
    """q (5,) within the limits, their ends among them."""
    shares = [draw(st.sampled_from((0.0, 1.0)) | st.floats(0.0, 1.0)) for _ in range(5)]
    lower = LIMITS.lower.copy()
    q = lower + np.array(shares) * (LIMITS.upper - lower)
    lower[2] = max(lower[2], q[1] + LIMITS.linkage)
    q[2] = lower[2] + shares[2] * (LIMITS.upper[2] - lower[2])
    return q


EXTENSIONS = st.floats(-3.0, 3.0)
CONSTRAINTS = st.just(ActuatorHorizontal()) | st.builds(ActuatorAngle, ANGLE) | st.builds(FixedExtension, EXTENSIONS)
CHOICES = st.sampled_from([LeastExtension(), NearestHorizontal(), LeastTorque(), LargestMargin()]) | joints().map(
    NearestPose.to
)
CONSTRAINTS = CONSTRAINTS | CHOICES


def assert_sound(found: Solutions, position: tuple[float, float, float], constraint: Constraint) -> None:
    """Every number is one; those within the limits reach the target and meet the constraint; the
    best is one of them."""
    assert np.isfinite(found.pitch)
    for solution in found.solutions:
        assert np.isfinite(solution.q).all()
        assert solution.within_limits == bool(LIMITS.contain(solution.q))
        if not solution.within_limits:
            assert solution.reasons
            continue
        tip = forward_kinematics(BOOM, solution.q)
        assert np.linalg.norm(tip.position - position) < 1e-12
        assert abs(np.remainder(tip.pitch - found.pitch + np.pi, TURN) - np.pi) < 2e-14
        if isinstance(constraint, FixedExtension):
            assert abs(solution.q[3] - constraint.extension) < 1e-14
        if isinstance(constraint, ActuatorAngle):
            assert abs(np.remainder(solution.q[2] - constraint.elevation, TURN) - np.pi) < 2e-14
    assert (found.best is None) == (not any(s.within_limits for s in found.solutions))
    assert found.best is None or found.solutions[found.best].within_limits


@BOUNDED
@given(position=positions(NEAR), pitch=ANGLE, constraint=CONSTRAINTS)
def test_a_target_near_the_boom_has_sound_solutions_or_none(position, pitch, constraint):
    assert_sound(inverse_kinematics(BOOM, position, pitch, constraint), position, constraint)


@BOUNDED
@given(position=positions(FINITE), pitch=FINITE, constraint=CONSTRAINTS)
@example(position=(0.0, 0.0, 0.0), pitch=6463426.0, constraint=LeastExtension())
@example(position=(0.0, 0.0, 0.0), pitch=190.0, constraint=LeastExtension())
def test_a_target_anywhere_has_sound_solutions_or_none(position, pitch, constraint):
    assert_sound(inverse_kinematics(BOOM, position, pitch, constraint), position, constraint)


@BOUNDED
@given(position=st.tuples(ANY, st.just(0.0), ANY), pitch=ANY, constraint=CONSTRAINTS)
def test_a_target_anywhere_at_all_has_sound_solutions_or_none_under_a_constraint(position, pitch, constraint):
    assert_sound(inverse_kinematics(BOOM, position, pitch, constraint), position, constraint)


@pytest.mark.parametrize("constraint", [ActuatorHorizontal(), FixedExtension(0.2)], ids=str)
def test_a_target_whose_radius_overflows_is_out_of_reach(constraint):
    assert inverse_kinematics(BOOM, (1.3e308, 1.3e308, 0.0), 0.0, constraint).solutions == ()


@FEW
@given(position=positions(NEAR), constraint=CONSTRAINTS)
def test_a_position_alone_has_sound_solutions_or_none(position, constraint):
    assert_sound(inverse_kinematics(BOOM, position, None, constraint), position, constraint)


@BOUNDED
@given(q=joints(), constraint=CHOICES)
def test_a_target_made_from_joints_within_the_limits_is_reached_by_every_choice(q, constraint):
    tip = forward_kinematics(BOOM, q)
    found = inverse_kinematics(BOOM, tip.position, float(tip.pitch), constraint)
    assert found.best is not None
    assert_sound(found, tip.position, constraint)


@BOUNDED
@given(q=joints(), reference=joints())
def test_a_target_made_from_joints_within_the_limits_is_reached_by_the_hold_they_meet(q, reference):
    tip = forward_kinematics(BOOM, q)
    constraint = FixedExtension(float(q[3]))
    found = inverse_kinematics(BOOM, tip.position, float(tip.pitch), constraint, reference)
    assert found.best is not None
    assert_sound(found, tip.position, constraint)


@FEW
@given(position=positions(NEAR), pitch=ANGLE, constraint=CONSTRAINTS)
def test_a_target_of_a_plan_is_reached_or_refused_with_a_reason(position, pitch, constraint):
    if inverse_kinematics(BOOM, position, pitch, constraint).best is None:
        with pytest.raises(
            InfeasibleError, match=r"is out of reach; |can be reached only outside the limits \(branch 1: "
        ) as why:
            resolve(BOOM, TipTarget(position), pitch, constraint)
        assert "nan" not in str(why.value)
        return
    q = resolve(BOOM, TipTarget(position), pitch, constraint)
    assert LIMITS.contain(q)
    assert np.linalg.norm(forward_kinematics(BOOM, q).position - position) < 1e-12


@BOUNDED
@given(q=joints(), shift=positions(st.floats(-0.1, 0.1) | st.just(0.0)), constraint=CONSTRAINTS)
def test_a_transform_is_reached_or_refused_with_a_reason(q, shift, constraint):
    T = frame_transforms(BOOM, q, "inner")[10].copy()
    T[:3, 3] += shift
    if abs(np.dot(shift, T[:3, 2])) > 1e-6:
        with pytest.raises(InfeasibleError, match="its plane at yaw"):
            inverse_kinematics_of_pose(BOOM, T, constraint)
        return
    found = inverse_kinematics_of_pose(BOOM, T, constraint)
    for solution in found.solutions:
        assert np.isfinite(solution.q).all()
        reached = frame_transforms(BOOM, solution.q, "inner")[10]
        beside = abs(np.dot(shift, T[:3, 2]))  # within the tolerance the arm's own plane is kept
        assert np.linalg.norm(reached[:3, 3] - T[:3, 3]) <= beside + 1e-12
        np.testing.assert_allclose(reached[:3, :3], T[:3, :3], rtol=0, atol=1e-12)


@BOUNDED
@given(entries=st.lists(st.floats(-2.0, 2.0), min_size=16, max_size=16))
def test_a_matrix_that_is_no_transform_is_bad_input(entries):
    with pytest.raises(InputError, match="T is not a rigid transform"):
        inverse_kinematics_of_pose(BOOM, np.reshape(entries, (4, 4)))


@BOUNDED
@given(bad=st.sampled_from([np.nan, np.inf, -np.inf]), at=st.integers(0, 3), constraint=CONSTRAINTS)
def test_what_is_not_finite_is_bad_input(bad, at, constraint):
    target = [1.4, 0.0, 1.0, -np.pi / 2]
    target[at] = bad
    with pytest.raises(InputError, match="must be a finite number"):
        inverse_kinematics(BOOM, target[:3], target[3], constraint)
