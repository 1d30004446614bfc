"""The nearest reachable point on a target's line to the base, against closed forms and against
finer scans of the line."""

from dataclasses import replace

import numpy as np
import pytest

from boom_model.arrays import Array
from boom_model.boom import LIMIT_TOLERANCE, Boom
from boom_model.errors import InputError
from boom_model.kinematics.constraints import ActuatorAngle, ActuatorHorizontal, Constraint, FixedExtension
from boom_model.kinematics.forward import forward_kinematics
from boom_model.kinematics.inverse import solve_branches
from boom_model.kinematics.reach import nearest_reachable

BOOM = Boom.load()
DOWN, UP = -np.pi / 2, np.pi / 2


def reached(position: Array, pitch: float, constraint: Constraint, within_limits: bool) -> Array:
    """Whether any branch reaches each position (..., 3), within the limits if so asked."""
    found = solve_branches(BOOM, position, pitch, constraint)
    return (found.within_limits if within_limits else found.exists).any(axis=-1)


def stretched(extension: float) -> Array:
    """q (5,) with the inner link and the line from pin 8 to the wrist one straight line, the end
    effector down."""
    inner = np.radians(2.0)
    lower = inner + np.pi - np.arctan2(BOOM.geometry.L6, BOOM.geometry.L7 + extension)
    return np.array([0.7, inner, lower, extension, np.pi - lower])


@pytest.mark.parametrize(
    ("q", "constraint", "share"),
    [
        pytest.param(stretched(0.25), FixedExtension(0.25), 3.0, id="too far for the stretched arm"),
        pytest.param(BOOM.pose("phenotyping"), ActuatorHorizontal(), 2.0, id="too far for the extended actuator"),
        pytest.param([5.0, np.pi / 3, np.pi, 0.0, 0.0], ActuatorHorizontal(), 0.9, id="too near for the retracted one"),
        pytest.param([0.7, 1.0, np.pi, 0.4, 0.0], ActuatorHorizontal(), 1.0, id="reachable"),
        pytest.param(stretched(0.25), FixedExtension(0.25), 1.0, id="just reachable"),
    ],
)
def test_the_nearest_point_is_where_the_boom_ends(q, constraint, share):
    tip = forward_kinematics(BOOM, q)
    found = nearest_reachable(BOOM, share * tip.position, float(tip.pitch), constraint)
    assert found.within_limits
    np.testing.assert_allclose(found.position, tip.position, rtol=0, atol=LIMIT_TOLERANCE)
    assert found.distance == pytest.approx(abs(share - 1.0) * np.linalg.norm(tip.position), abs=LIMIT_TOLERANCE)


CONSTRAINTS = pytest.mark.parametrize("constraint", [ActuatorHorizontal(), ActuatorAngle(-0.5), FixedExtension(0.25)], ids=str)
PITCHES = pytest.mark.parametrize("pitch", [DOWN, 0.0, UP], ids=["down", "level", "up"])


@CONSTRAINTS
@PITCHES
def test_no_point_of_the_line_is_nearer(constraint, pitch):
    rng = np.random.default_rng(1)
    for target in rng.uniform((-4.0, -4.0, -2.0), 4.0, (8, 3)):
        found = nearest_reachable(BOOM, target, pitch, constraint)
        length = np.linalg.norm(target)
        ahead = target / length
        assert reached(found.position, pitch, constraint, found.within_limits)
        nearer = found.distance - 1e-6
        along = length + np.linspace(-nearer, nearer, 3001)
        line = along[along > 0.0, None] * ahead
        assert found.distance < 1e-6 or not reached(line, pitch, constraint, found.within_limits).any()
        if not found.within_limits:
            assert not reached(np.linspace(0.0, 4.0, 5001)[:, None] * ahead, pitch, constraint, True).any()


@pytest.mark.parametrize(("length", "sense"), [(1.2, -1.0), (1.3, -1.0), (1.45, 1.0), (1.55, 1.0)])
def test_between_two_reachable_stretches_the_nearer_one_counts(length, sense):
    """This line is reachable from 1.07 to 1.15 m, and from 1.61 m on."""
    target = length * np.array([0.911, 0.389, 0.136])
    found = nearest_reachable(BOOM, target, DOWN, ActuatorAngle(-0.5))
    assert found.within_limits
    assert np.sign(np.linalg.norm(found.position) - np.linalg.norm(target)) == sense
    assert found.distance < 0.25


@pytest.mark.parametrize("rise", [0.1176, 0.1178, 0.118])
def test_a_stretch_of_two_millimetres_is_found(rise):
    """Some of the lines that meet the retracted actuator's reach at 1.1 m, for 2 to 4 mm."""
    target = 1.2 * np.array([0.911, 0.389, rise])
    found = nearest_reachable(BOOM, target, DOWN, ActuatorAngle(-0.5))
    assert found.within_limits
    assert 0.09 < found.distance < 0.1


@CONSTRAINTS
def test_distance_and_position_agree(constraint):
    rng = np.random.default_rng(2)
    for target in rng.uniform((-4.0, -4.0, -2.0), 4.0, (8, 3)):
        found = nearest_reachable(BOOM, target, DOWN, constraint)
        assert found.distance == pytest.approx(np.linalg.norm(found.position - target), abs=4e-15)
        assert np.linalg.norm(np.cross(found.position, target)) < 8e-15
        assert found.position @ target >= 0.0


def test_a_point_within_limits_comes_before_a_nearer_one_outside():
    target = np.array([3.5, 0.0, 1.0])
    assert reached(target, DOWN, ActuatorHorizontal(), within_limits=False)
    found = nearest_reachable(BOOM, target, DOWN, ActuatorHorizontal())
    assert found.within_limits
    assert found.distance > 0.5


def test_a_target_reached_outside_the_limits_alone_is_its_own_nearest_point():
    target = np.array([1.4, 0.0, 1.0])
    found = nearest_reachable(BOOM, target, UP, ActuatorHorizontal())
    assert not found.within_limits
    np.testing.assert_allclose(found.position, target, rtol=0, atol=5e-16)
    assert found.distance < 5e-16


def test_the_base_itself_has_no_line():
    assert nearest_reachable(BOOM, (0.0, 0.0, 0.0), DOWN, ActuatorHorizontal()) is None


def test_a_line_that_no_branch_meets_has_no_point():
    tower = replace(BOOM, geometry=replace(BOOM.geometry, L1=5.0))
    assert nearest_reachable(tower, (3.0, 0.0, -3.0), DOWN, ActuatorHorizontal()) is None
    assert nearest_reachable(tower, (3.0, 0.0, 9.0), DOWN, ActuatorHorizontal()) is not None


@pytest.mark.parametrize("factor", [10.0, 100.0, 1e4, 1e5])
def test_a_farther_target_has_the_same_nearest_point(factor):
    near = np.array([1.4, 0.0, 1.0])
    expected = nearest_reachable(BOOM, 2.0 * near, DOWN, ActuatorHorizontal())
    found = nearest_reachable(BOOM, factor * near, DOWN, ActuatorHorizontal())
    assert found.within_limits
    # The boundary is found by 60 bisections of the way to the target.
    atol = 4e-15 + factor * np.linalg.norm(near) * 2.0**-60
    np.testing.assert_allclose(found.position, expected.position, rtol=0, atol=atol)


def test_a_hold_beyond_the_limits_reaches_beyond_them():
    found = nearest_reachable(BOOM, (1.0, 0.0, 1.0), DOWN, FixedExtension(10.0))
    assert found is not None
    assert not found.within_limits


@pytest.mark.parametrize(
    ("position", "pitch", "constraint", "message"),
    [
        pytest.param((1.0, np.nan, 1.0), DOWN, ActuatorHorizontal(), r"position\[1\] is nan", id="nan position"),
        pytest.param((1.0, 2.0), DOWN, ActuatorHorizontal(), r"position has shape \(2,\)", id="two coordinates"),
        pytest.param(np.ones((2, 3)), DOWN, ActuatorHorizontal(), "position has shape", id="a batch"),
        pytest.param((1.0, 0.0, 1.0), np.inf, ActuatorHorizontal(), "pitch is inf", id="infinite pitch"),
        pytest.param((1.0, 0.0, 1.0), [0.0, 1.0], ActuatorHorizontal(), "pitch", id="two pitches"),
        pytest.param((1.0, 0.0, 1.0), DOWN, ActuatorAngle(np.nan), "elevation is nan", id="nan elevation"),
    ],
)
def test_bad_input_is_named(position, pitch, constraint, message):
    with pytest.raises(InputError, match=message):
        nearest_reachable(BOOM, position, pitch, constraint)


def test_the_point_is_read_only():
    found = nearest_reachable(BOOM, (1.4, 0.0, 1.0), DOWN, ActuatorHorizontal())
    with pytest.raises(ValueError, match="read-only"):
        found.position[0] = 1.0
