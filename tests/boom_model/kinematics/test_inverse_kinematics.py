"""Every branch of the inverse kinematics: the thesis's table 2-7, there and back, and a solver that
knows no branches."""

import cmath
import re

import numpy as np
import pytest
from scipy.optimize import fsolve

from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH, Boom
from boom_model.errors import InputError
from boom_model.kinematics.constraints import ActuatorAngle, ActuatorHorizontal, Constraint, FixedExtension
from boom_model.kinematics.forward import forward_kinematics
from boom_model.kinematics.inverse import Branches, Solution, Solutions, inverse_kinematics, solve_branches
from tests.oracles import random_states

BOOM = Boom.load()
GEOMETRY = BOOM.geometry
DOWN, UP, TURN = -np.pi / 2, np.pi / 2, 2 * np.pi
CONSTRAINTS = pytest.mark.parametrize("kind", [ActuatorAngle, FixedExtension])


def holding(kind: type[Constraint], q: Array) -> Constraint:
    """The constraint that q (5,) meets."""
    return FixedExtension(float(q[3])) if kind is FixedExtension else ActuatorAngle(float(q[2]) - np.pi)


def turned(angle: Array | float) -> Array:
    """To within whole turns, in [-pi, pi)."""
    return np.remainder(np.asarray(angle) + np.pi, TURN) - np.pi


def separation(q: Array, other: Array) -> Array:
    """The largest difference (...) of q and other (..., 5), the angles to within whole turns."""
    difference = np.asarray(q) - other
    return np.abs(np.where(IS_LENGTH, difference, turned(difference))).max(axis=-1)


def misses(q: Array, position: Array, pitch: Array | float) -> Array:
    """How far each branch (..., 5) is from its target: the larger of metres, and
    radians of pitch."""
    tip = forward_kinematics(BOOM, q)
    return np.maximum(np.linalg.norm(tip.position - position, axis=-1), np.abs(turned(tip.pitch - pitch)))


def solved_at(kind: type[Constraint], q: Array) -> Solutions:
    """The branches of q's own target, under the constraint that q meets."""
    tip = forward_kinematics(BOOM, q)
    return inverse_kinematics(BOOM, tip.position, float(tip.pitch), holding(kind, q))


def nearest(found: Solutions, q: Array) -> Solution:
    return min(found.solutions, key=lambda solution: float(separation(solution.q, q)))


@pytest.mark.parametrize(
    ("position", "pitch", "constraint", "printed", "reason"),
    [
        pytest.param(
            (1.4, 0.0, 1.0),
            DOWN,
            FixedExtension(0.0),
            "0.000 0.897 3.283 0.000 -0.141",
            r"lower 188\.09\d* deg is 8\.09\d* deg above its limit of 180 deg",
            id="test 1",
        ),
        pytest.param((1.4, 0.0, 1.0), DOWN, ActuatorHorizontal(), "0.000 1.093 3.141 0.151 0.000", None, id="test 2"),
        pytest.param((1.4, 0.0, 1.0), DOWN, FixedExtension(0.25), "0.000 1.203 3.097 0.250 0.045", None, id="test 3"),
        pytest.param((2.0, 1.0, 1.0), DOWN, ActuatorHorizontal(), "0.464 1.093 3.141 0.987 0.000", None, id="test 4"),
        pytest.param(
            (0.0, 2.5, 0.8),
            UP,
            ActuatorHorizontal(),
            "1.5708 0.653 3.141 0.916 3.141",
            r"wrist 180 deg is 90 deg above its limit of 90 deg",
            id="test 5, yaw as corrected",
        ),
    ],
)
def test_rows_of_table_2_7_are_among_the_branches(position, pitch, constraint, printed, reason):
    q = np.array(printed.split(), dtype=float)
    unit_of_last_digit = 10.0 ** -np.array([len(number.split(".")[1]) for number in printed.split()])
    found = inverse_kinematics(BOOM, position, pitch, constraint)
    row = nearest(found, q)
    assert (np.abs(row.q - q) < unit_of_last_digit).all()
    assert row.within_limits == (reason is None)
    assert len(row.reasons) == (reason is not None)
    assert all(re.fullmatch(reason, sentence) for sentence in row.reasons)
    assert found.best == (None if reason else found.solutions.index(row))


def test_down_and_horizontal_unless_told_otherwise():
    plain = inverse_kinematics(BOOM, (1.4, 0.3, 1.0))
    told = inverse_kinematics(BOOM, (1.4, 0.3, 1.0), DOWN, ActuatorAngle(0.0))
    np.testing.assert_array_equal([s.q for s in plain.solutions], [s.q for s in told.solutions])
    assert all(turned(s.q[2] + s.q[4]) == pytest.approx(-np.pi, abs=5e-16) for s in plain.solutions)
    assert all(s.q[2] == pytest.approx(np.pi, abs=5e-16) for s in plain.solutions)


def reachable(kind: type[Constraint], groups: int, size: int, seed: int) -> list[tuple[Array, Constraint]]:
    """Groups of q (size, 5) within the limits, each group with one constraint that
    all of it meets."""
    rng = np.random.default_rng(seed)
    drawn = []
    for _ in range(groups):
        q, _, _ = random_states(BOOM, size, rng)
        if kind is FixedExtension:
            q[:, 3] = q[0, 3]
        else:
            q[:, 2] = q[0, 2]
            q[:, 1] = rng.uniform(0.0, np.minimum(BOOM.limits.upper[1], q[0, 2] - BOOM.limits.linkage), size)
        drawn.append((q, holding(kind, q[0])))
    return drawn


@CONSTRAINTS
def test_every_branch_of_10000_targets_reaches_its_target(kind):
    for q, constraint in reachable(kind, 100, 100, seed=1):
        tip = forward_kinematics(BOOM, q)
        found = solve_branches(BOOM, tip.position, tip.pitch, constraint)
        target, branch = np.nonzero(found.exists)
        branches = found.q[target, branch]
        assert misses(branches, tip.position[target], tip.pitch[target]).max() < 2e-14
        held = branches[:, 3] - q[target, 3] if kind is FixedExtension else turned(branches[:, 2] - q[target, 2])
        assert np.abs(held).max() < 1e-15


@pytest.mark.parametrize(("kind", "tolerance"), [(ActuatorAngle, 1e-11), (FixedExtension, 6e-13)])
def test_the_joints_a_target_was_made_from_are_among_its_branches(kind, tolerance):
    for q, constraint in reachable(kind, 100, 100, seed=2):
        tip = forward_kinematics(BOOM, q)
        found = solve_branches(BOOM, tip.position, tip.pitch, constraint)
        apart = np.where(found.within_limits, np.abs(found.q - q[:, None]).max(axis=-1), np.inf)
        assert apart.min(axis=-1).max() < tolerance


@CONSTRAINTS
def test_branches_are_within_limits_just_where_the_limits_hold(kind):
    for q, constraint in reachable(kind, 20, 100, seed=3):
        tip = forward_kinematics(BOOM, q)
        found = solve_branches(BOOM, tip.position, tip.pitch, constraint)
        lower, upper = BOOM.limits.lower - 1e-9, BOOM.limits.upper + 1e-9
        inside = ((lower <= found.q) & (found.q <= upper)).all(axis=-1)
        apart = found.q[..., 2] - found.q[..., 1] >= np.radians(5.0) - 1e-9
        np.testing.assert_array_equal(found.within_limits, found.exists & inside & apart)


def numeric_branches(position: Array, pitch: float, constraint: Constraint, rng: np.random.Generator) -> list[Array]:
    """Every q that closes tip, pitch and constraint, by Newton's method from 40 random starts; to
    within whole turns."""
    g = GEOMETRY

    def residual(q: Array) -> tuple[float, ...]:
        phi = q[2] + q[4]
        pin8 = complex(g.L2, g.L1) + g.L9 * cmath.exp(1j * q[1])
        wrist = pin8 - complex(g.L7 + q[3], g.L6) * cmath.exp(1j * q[2])
        tip = wrist + 1j * g.L8 * cmath.exp(1j * phi)
        plan = tip.real * cmath.exp(1j * q[0]) - complex(position[0], position[1])
        held = q[3] - constraint.extension if isinstance(constraint, FixedExtension) else q[2] - np.pi - constraint.elevation
        return plan.real, plan.imag, tip.imag - position[2], phi + np.pi / 2 - pitch, held

    roots: list[Array] = []
    for start in rng.uniform(-np.pi, np.pi, (40, 5)):
        root = fsolve(residual, start, full_output=True, xtol=1e-12)[0]
        if np.linalg.norm(residual(root)) < 1e-9 and all(separation(root, other) > 1e-6 for other in roots):
            roots.append(root)
    return roots


@pytest.mark.parametrize(
    ("constraint", "joint", "value"), [(FixedExtension(0.4), 3, 0.4), (ActuatorAngle(-0.3), 2, np.pi - 0.3)], ids=str
)
def test_a_million_targets_at_once_come_back(constraint, joint, value):
    q = np.random.default_rng(40).uniform(BOOM.limits.lower, BOOM.limits.upper, (1_000_000, 5))
    q[:, joint] = value
    tip = forward_kinematics(BOOM, q)
    found = solve_branches(BOOM, tip.position, tip.pitch, constraint)
    assert found.exists.any(axis=-1).all()
    target = np.nonzero(found.exists)[0]
    back = forward_kinematics(BOOM, found.q[found.exists])
    assert np.linalg.norm(back.position - tip.position[target], axis=-1).max() < 2.5e-14
    assert np.abs(turned(back.pitch - tip.pitch[target])).max() < 1.5e-14


@CONSTRAINTS
def test_branches_are_those_of_a_numeric_solver(kind):
    rng = np.random.default_rng(4)
    counts = []
    for i, q in enumerate(random_states(BOOM, 500, rng)[0]):
        tip = forward_kinematics(BOOM, q)
        position, pitch, constraint = tip.position, float(tip.pitch), holding(kind, q)
        if i % 2:  # anywhere, reachable or not
            position, pitch = rng.uniform((-2.5, -2.5, -1.5), 2.5), rng.uniform(-np.pi, np.pi)
        expected = numeric_branches(position, pitch, constraint, rng)
        found = [solution.q for solution in inverse_kinematics(BOOM, position, pitch, constraint).solutions]
        assert len(found) == len(expected)
        assert all(min(separation(q, other) for other in expected) < 1e-10 for q in found)
        assert all(min(separation(q, other) for other in found) < 1e-10 for q in expected)
        counts.append(len(found))
    assert set(counts) == {0, 2, 4}


def on_this_side(found: Branches, yaw: float) -> Array:
    """Which branches exist with the base turned to `yaw`, and not away from it."""
    return found.exists & (np.abs(turned(found.q[..., 0] - yaw)) < 1.0)


TANGENT = pytest.mark.parametrize(
    ("constraint", "q", "outward"),
    [
        # The inner link stands across the actuator: it would take a longer one to reach further
        # that way.
        pytest.param(ActuatorHorizontal(), (0.7, np.pi / 2, np.pi, 0.3, 0.0), np.pi / 2, id="actuator held"),
        pytest.param(ActuatorAngle(-0.6), (0.7, np.pi / 2 - 0.6, np.pi - 0.6, 0.3, 0.6), np.pi / 2 - 0.6, id="tilted"),
        # The inner link and the line from pin 8 to the wrist are one straight line: the arm is
        # stretched.
        pytest.param(
            FixedExtension(0.25),
            (0.7, 0.02, 0.02 + np.pi - np.arctan2(GEOMETRY.L6, GEOMETRY.L7 + 0.25), 0.25, 0.0),
            0.02,
            id="stretched",
        ),
    ],
)


def towards(q: tuple[float, ...], elevation: float) -> Array:
    """Unit vector (3,) in the arm's plane."""
    return np.array([np.cos(elevation) * np.cos(q[0]), np.cos(elevation) * np.sin(q[0]), np.sin(elevation)])


@TANGENT
def test_a_target_on_the_boundary_of_the_reach_is_one_branch(constraint, q, outward):
    tip = forward_kinematics(BOOM, q)
    found = solve_branches(BOOM, tip.position, tip.pitch, constraint)
    here = on_this_side(found, q[0])
    assert here.sum() == 1
    assert found.within_limits[here]
    assert separation(found.q[here], q) < 1e-7
    assert misses(found.q[here], tip.position, tip.pitch) < 4e-15


@TANGENT
@pytest.mark.parametrize("distance", 10.0 ** np.arange(-15, -2))
def test_beside_the_boundary_two_branches_become_none(constraint, q, outward, distance):
    """Closer than the closure's rounding can tell they may stay one, and miss by as much."""
    tip = forward_kinematics(BOOM, q)
    for away, branches in ((-distance, 2), (distance, 0)):
        position = tip.position + away * towards(q, outward)
        found = solve_branches(BOOM, position, tip.pitch, constraint)
        here = on_this_side(found, q[0])
        assert here.sum() == branches or (here.sum() == 1 and distance < 5e-12)
        assert (misses(found.q[here], position, tip.pitch) < 9e-15 + 1.01 * max(away, 0.0)).all()


@pytest.mark.parametrize("constraint", [ActuatorHorizontal(), ActuatorAngle(-0.5), FixedExtension(0.25)], ids=str)
@pytest.mark.parametrize("position", [(0.0, 0.0, 4.0), (30.0, -40.0, 10.0), (1e6, 0.0, -1e6)])
def test_out_of_reach_is_no_branch_and_no_error(position, constraint):
    assert inverse_kinematics(BOOM, position, DOWN, constraint).solutions == ()
    assert inverse_kinematics(BOOM, position, DOWN, constraint).best is None
    found = solve_branches(BOOM, position, DOWN, constraint)
    assert not found.exists.any()
    assert not found.within_limits.any()
    assert np.isnan(found.q).all()


@pytest.mark.parametrize(
    ("position", "constraint"),
    [
        ((1e200, 0.0, 1.0), ActuatorHorizontal()),
        ((1e200, 0.0, 1.0), FixedExtension(0.25)),
        ((1e5, 0.0, 1.15), ActuatorHorizontal()),  # a hand's breadth above the highest wrist, 100 km away
    ],
)
def test_coordinates_whose_squares_overflow_are_out_of_reach(position, constraint):
    assert inverse_kinematics(BOOM, position, DOWN, constraint).solutions == ()


def over_the_yaw_axis() -> Array:
    """q (5,) within the limits whose tip is on the yaw axis."""
    q = np.array([0.0, np.radians(120.0), np.radians(125.0), 0.0, 0.0])
    forward = forward_kinematics(BOOM, [*q[:4], np.pi - q[2]]).position[0]  # with the end effector down
    q[4] = np.pi - np.arcsin(forward / GEOMETRY.L8) - q[2]
    return q


@CONSTRAINTS
def test_yaw_is_free_on_the_yaw_axis(kind):
    q = over_the_yaw_axis()
    tip = forward_kinematics(BOOM, q)
    position = np.array([0.0, 0.0, tip.position[2]])
    assert np.abs(tip.position - position).max() < 1e-17
    found = inverse_kinematics(BOOM, position, float(tip.pitch), holding(kind, q))
    assert len(found.solutions) == 2
    for solution in found.solutions:
        assert solution.q[0] == 0.0
        assert solution.reasons[0] == "the target is on the yaw axis: yaw is free, 0 is chosen"
        assert solution.within_limits == (len(solution.reasons) == 1)
        assert misses(solution.q + np.eye(5)[0], position, tip.pitch) < 4e-15
    assert separation(found.solutions[found.best].q, q) < 8e-15


@pytest.mark.parametrize(
    ("x", "y"),
    [(0.0, -0.0), (-0.0, 0.0), (-0.0, -0.0)],
)
def test_the_yaw_axis_has_no_sign(x, y):
    assert {solution.q[0] for solution in inverse_kinematics(BOOM, (x, y, 1.0)).solutions} == {0.0}


def test_beside_the_yaw_axis_yaw_is_not_free():
    found = inverse_kinematics(BOOM, (0.0, 1e-9, 1.0))
    assert len(found.solutions) == 4
    assert {round(np.degrees(s.q[0]), 9) for s in found.solutions} == {90.0, 270.0}
    assert all("free" not in reason for s in found.solutions for reason in s.reasons)


@pytest.mark.parametrize(
    "yaw",
    [*np.linspace(0.0, TURN, 9), 1e-8, np.pi - 1e-9, np.pi + 1e-9, *(TURN - 10.0 ** np.arange(-10, -2))],
)
def test_every_yaw_from_0_to_360_is_within_limits(yaw):
    q = np.array([yaw, 1.0, np.pi, 0.4, 0.0])
    found = solved_at(ActuatorAngle, q)
    assert separation(found.solutions[found.best].q, q) < 4e-15


@pytest.mark.parametrize("y", [-1e-16, -1e-12, -1e-9])
def test_rounding_below_a_yaw_of_0_is_not_a_whole_turn(y):
    found = inverse_kinematics(BOOM, (1.4, y, 1.0))
    assert abs(found.solutions[found.best].q[0]) < 1e-9


@CONSTRAINTS
def test_angles_are_turned_as_near_to_their_limits_as_can_be(kind):
    limits, turns = BOOM.limits, TURN * np.arange(-5, 6)[:, None] * ~IS_LENGTH
    for q, constraint in reachable(kind, 20, 100, seed=5):
        tip = forward_kinematics(BOOM, q)
        found = solve_branches(BOOM, tip.position, tip.pitch, constraint)
        branches = found.q[found.exists]
        options = branches[:, None] + turns
        least = np.maximum(np.maximum(limits.lower - options, options - limits.upper), 0.0).min(axis=1)
        excess = np.maximum(np.maximum(limits.lower - branches, branches - limits.upper), 0.0)
        np.testing.assert_array_equal(excess, least)


@pytest.mark.parametrize("away", [-1e-3, -1e-6, 0.0, 1e-6, 1e-3])
def test_a_wrist_near_180_is_turned_the_shorter_way(away):
    found = inverse_kinematics(BOOM, (0.0, 2.5, 0.8), UP + away)
    for solution in found.solutions:
        assert abs(solution.q[4]) == pytest.approx(np.pi - abs(away), abs=1e-15)
        side = "below its limit of -90" if away > 0 else "above its limit of 90"
        assert any(reason.startswith("wrist") and side in reason for reason in solution.reasons)


@pytest.mark.parametrize("away", [-1e-12, 0.0, 1e-12])
def test_a_wrist_at_180_is_turned_up_whatever_the_rounding(away):
    found = inverse_kinematics(BOOM, (0.0, 2.5, 0.8), UP + away)
    assert all(solution.q[4] > 0.0 for solution in found.solutions)


@pytest.mark.parametrize("turns", [-2, -1, 1, 2, 100])
def test_pitch_is_the_same_after_whole_turns(turns):
    position = (1.4, 0.3, 1.0)
    expected = solve_branches(BOOM, position, DOWN, ActuatorHorizontal())
    found = solve_branches(BOOM, position, DOWN + turns * TURN, ActuatorHorizontal())
    np.testing.assert_allclose(found.q, expected.q, rtol=0, atol=2 * np.spacing(abs(turns) * TURN))


@pytest.mark.parametrize("turns", [-2, -1, 1, 2, -100])
def test_the_actuators_elevation_is_the_same_after_whole_turns(turns):
    position = (1.4, 0.3, 1.0)
    expected = solve_branches(BOOM, position, DOWN, ActuatorAngle(0.02))
    assert expected.exists.all()
    found = solve_branches(BOOM, position, DOWN, ActuatorAngle(0.02 + turns * TURN))
    np.testing.assert_allclose(found.q, expected.q, rtol=0, atol=4 * np.spacing(abs(turns) * TURN))


def two_ways(extension: float) -> tuple[Array, Array]:
    """Two q (5,) within the limits, of one tip and the actuator horizontal: the inner link raised
    to 80 or 100 deg."""
    inner, longer = np.radians([80.0, 100.0]), extension + 2 * np.cos(np.radians(80.0))
    return np.array([0.7, inner[0], np.pi, extension, 0.0]), np.array([0.7, inner[1], np.pi, longer, 0.0])


SHORT, LONG = two_ways(0.3)


@pytest.mark.parametrize(
    ("reference", "best"),
    [
        pytest.param(SHORT, SHORT, id="the short one"),
        pytest.param(LONG, LONG, id="the long one"),
        # 20 deg of 120 is less of a way than 0.347 m of 1, though 0.349 rad is more than 0.347 m.
        pytest.param([0.7, np.radians(100.0), np.pi, 0.3, 0.0], SHORT, id="by shares of the ranges"),
    ],
)
def test_the_best_branch_is_nearest_to_the_reference(reference, best):
    tip = forward_kinematics(BOOM, SHORT)
    found = inverse_kinematics(BOOM, tip.position, float(tip.pitch), reference=reference)
    assert sum(solution.within_limits for solution in found.solutions) == 2
    assert separation(found.solutions[found.best].q, best) < 1e-14


# Shares of the ranges from their middle: of the shorter way 20/120 and 0.5 - extension, of the
# longer way 40/120 and 0.153 - extension.
@pytest.mark.parametrize(("extension", "best"), [(0.0, 1), (0.1, 1), (0.25, 0), (0.3, 0)])
def test_without_a_reference_the_best_branch_is_nearest_to_the_middle(extension, best):
    ways = two_ways(extension)
    tip = forward_kinematics(BOOM, ways[0])
    found = inverse_kinematics(BOOM, tip.position, float(tip.pitch))
    assert separation(found.solutions[found.best].q, ways[best]) < 1e-14


def test_the_best_branch_is_within_limits_however_near_another_is():
    position = (1.4, 0.0, 1.0)
    plain = inverse_kinematics(BOOM, position)
    (outside, *_) = (s for s in plain.solutions if not s.within_limits)
    assert inverse_kinematics(BOOM, position, reference=outside.q).best == plain.best


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        pytest.param({"position": (1.4, 0.0, np.nan)}, r"position\[2\] is nan", id="nan position"),
        pytest.param({"position": (1.4, np.inf, 1.0)}, r"position\[1\] is inf", id="infinite position"),
        pytest.param({"position": (1.4, 1.0)}, r"position has shape \(2,\)", id="two coordinates"),
        pytest.param({"position": 1.4}, r"position has shape \(\)", id="a number"),
        pytest.param({"position": [(1.4, 0.0, 1.0)]}, r"position has shape \(1, 3\)", id="a batch"),
        pytest.param({"position": ("far", 0.0, 1.0)}, "position is not an array of numbers", id="text"),
        pytest.param({"pitch": np.nan}, "pitch is nan", id="nan pitch"),
        pytest.param({"pitch": [0.0, 1.0]}, "pitch", id="two pitches"),
        pytest.param({"constraint": ActuatorAngle(np.nan)}, "elevation is nan", id="nan elevation"),
        pytest.param({"constraint": FixedExtension(-np.inf)}, "extension is -inf", id="infinite extension"),
        pytest.param({"constraint": FixedExtension([0.0, 1.0])}, "extension", id="two extensions"),
        pytest.param({"reference": (0, 1, np.nan, 0, 0)}, r"reference\[2\] is nan", id="nan reference"),
        pytest.param({"reference": (0, 1, 2, 0)}, r"reference has shape \(4,\)", id="four joints"),
        pytest.param({"reference": np.zeros((2, 5))}, "reference has shape", id="two references"),
    ],
)
def test_bad_input_is_named(arguments, message):
    with pytest.raises(InputError, match=message):
        inverse_kinematics(BOOM, **{"position": (1.4, 0.0, 1.0)} | arguments)


def test_batches_that_do_not_match_are_bad_input():
    with pytest.raises(InputError, match="position"):
        solve_branches(BOOM, np.zeros((4, 3)), np.zeros(3), ActuatorHorizontal())


@pytest.mark.parametrize("constraint", [ActuatorHorizontal(), FixedExtension(0.25)], ids=str)
@pytest.mark.parametrize(
    ("position_shape", "pitch_shape", "shape"),
    [((), (), ()), ((), (4,), (4,)), ((4,), (), (4,)), ((2, 3), (2, 3), (2, 3)), ((2, 1), (3,), (2, 3)), ((0,), (), (0,))],
)
def test_batches_are_their_targets_one_by_one(constraint, position_shape, pitch_shape, shape):
    rng = np.random.default_rng(6)
    position = rng.uniform((-2.0, -2.0, 0.0), 2.0, (*position_shape, 3))
    pitch = rng.uniform(-np.pi, np.pi, pitch_shape)
    found = solve_branches(BOOM, position, pitch, constraint)
    assert (found.q.shape, found.exists.shape, found.within_limits.shape) == ((*shape, 4, 5), (*shape, 4), (*shape, 4))
    each_position, each_pitch = np.broadcast_to(position, (*shape, 3)), np.broadcast_to(pitch, shape)
    for index in np.ndindex(shape):
        single = inverse_kinematics(BOOM, each_position[index], float(each_pitch[index]), constraint)
        exists = found.exists[index]
        np.testing.assert_array_equal([s.q for s in single.solutions] or np.empty((0, 5)), found.q[index][exists])
        assert [s.within_limits for s in single.solutions] == list(found.within_limits[index][exists])
        assert np.isnan(found.q[index][~exists]).all()
        assert not found.within_limits[index][~exists].any()


@pytest.mark.parametrize("error", [1e-7, 1e-6])
def test_no_branch_is_false_with_the_wrist_at_the_shoulder(error):
    """There rho^2 + L6^2 = L9^2 leaves theta2 free, and any other extension cannot reach at all."""
    constraint = FixedExtension(np.sqrt(GEOMETRY.L9**2 - GEOMETRY.L6**2) - GEOMETRY.L7 + error)
    position = np.array([GEOMETRY.L2, 0.0, GEOMETRY.L1 - GEOMETRY.L8])
    found = solve_branches(BOOM, position, DOWN, constraint)
    assert (misses(found.q[found.exists], position, DOWN) < 1e-15).all()


def test_solutions_are_read_only():
    with pytest.raises(ValueError, match="read-only"):
        inverse_kinematics(BOOM, (1.4, 0.0, 1.0)).solutions[0].q[0] = 1.0


@pytest.mark.parametrize(
    ("constraint", "text"),
    [
        (ActuatorHorizontal(), "horizontal"),
        (ActuatorAngle(np.radians(-30.0)), "actuator=-30 deg"),
        (FixedExtension(0.25), "extension=0.25 m"),
    ],
)
def test_holds_read_as_the_command_writes_them(constraint, text):
    assert str(constraint) == text
