"""Paths, time laws and the motions they give."""

import numpy as np
import pytest

from planner import JointLine, Motion, TimeLaw

START, GOAL = np.array([0.0, 0.1, 1.0, 0.2, -0.3]), np.array([1.0, 0.6, 2.5, 0.9, 0.4])


class Curve:
    """A path with every derivative alive: q_i(s) = sin((i + 1) s)."""

    def __call__(self, s, order=0):
        k = np.arange(1.0, 6.0)
        return k**order * np.sin(k * np.asarray(s)[..., None] + order * np.pi / 2.0)


def cubic_law(duration: float) -> TimeLaw:
    return TimeLaw.from_pieces([1.0], [[-2.0], [3.0], [0.0], [0.0]]).stretched(duration)


def test_joint_line_runs_straight_from_start_to_goal():
    line, s = JointLine(START, GOAL), np.array([0.0, 0.25, 1.0])
    np.testing.assert_array_equal(line(s)[[0, 2]], [START, GOAL])
    np.testing.assert_allclose(line(0.25), 0.75 * START + 0.25 * GOAL, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(line(s, 1), np.tile(GOAL - START, (3, 1)))
    assert not line(s, 2).any()


@pytest.mark.parametrize("path", [JointLine(START, GOAL), Curve()], ids=["line", "curve"])
def test_motion_derivatives_are_those_of_its_positions(path):
    motion = Motion(path, cubic_law(2.0))
    t, h = np.linspace(0.1, 1.9, 37), 1e-5
    before, now, after = motion(t - h), motion(t), motion(t + h)
    for order in range(3):
        slope = (after[order] - before[order]) / (2.0 * h)
        np.testing.assert_allclose(now[order + 1], slope, rtol=0, atol=2e-7 * max(1.0, np.abs(slope).max()))


def test_stretching_divides_each_derivative_by_a_power_of_the_factor():
    law = cubic_law(1.0)
    slow, t = law.stretched(3.0), np.linspace(0.0, 1.0, 11)
    assert slow.duration == pytest.approx(3.0, abs=1e-15)
    for order in range(4):
        np.testing.assert_allclose(slow.s(3.0 * t, order), law.s(t, order) / 3.0**order, rtol=1e-13, atol=1e-15)


def test_pieces_without_duration_are_left_out():
    law = TimeLaw.from_pieces([0.5, 0.0, 0.5], [[1.0, 9.0, 1.0], [0.0, 9.0, 0.5]])
    assert law.duration == 1.0
    assert law.s(0.75) == 0.75


def test_motion_is_clipped_to_its_ends():
    motion = Motion(JointLine(START, GOAL), cubic_law(2.0))
    np.testing.assert_array_equal(motion([-1.0, 3.0])[0], [START, GOAL])
