"""Paths, time laws and the motions they give."""

import numpy as np
import pytest

from planner.paths.path import JointLine
from planner.timing.time_law import Motion, TimeLaw

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


RAMP = 2.0 / 3.0  # of the trapezoid's acceleration, over 0.5 s, 1 s of cruise between
LAWS = {
    "trapezoid": TimeLaw.from_pieces([0.5, 1.0, 0.5], [[RAMP, 0.0, -RAMP], [0.0, RAMP, RAMP], [0.0, 1.0 / 6.0, 5.0 / 6.0]]),
    "cubic": cubic_law(1.7),
    "triangle": TimeLaw.from_pieces([1.0, 1.0], [[0.5, -0.5], [0.0, 1.0], [0.0, 0.5]]),
}


def held_at_ends(law: TimeLaw, t):
    """s at any time: 0 before the law begins and 1 after it has ended."""
    return np.where(t < 0.0, 0.0, np.where(t > law.duration, 1.0, law.s(np.clip(t, 0.0, law.duration))))


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("width", [0.03, 0.5, 1.0, 3.0])
def test_averaged_law_is_the_convolution_with_a_window(name, width):
    law = LAWS[name]
    found = law.averaged(width)
    assert found.duration == pytest.approx(law.duration + width, rel=1e-12)
    nodes, weights = np.polynomial.legendre.leggauss(4)  # exact for a piece of up to seventh order
    for t in np.linspace(0.0, found.duration, 41):
        breaks = np.unique(np.clip([*law.s.x, t - width, t], t - width, t))
        half, middle = np.diff(breaks)[:, None] / 2.0, (breaks[:-1] + breaks[1:])[:, None] / 2.0
        expected = float((half * weights * held_at_ends(law, middle + half * nodes)).sum()) / width
        assert float(found.s(t)) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("width", [0.03, 0.5, 3.0])
def test_averaged_law_runs_from_0_to_1_with_a_continuous_acceleration_that_is_0_at_both_ends(name, width):
    law = LAWS[name]
    found = law.averaged(width)
    end = found.duration
    np.testing.assert_allclose(found.s([0.0, end]), [0.0, 1.0], rtol=0, atol=1e-12)
    for order in (1, 2):
        np.testing.assert_allclose(found.s([0.0, end], order), 0.0, rtol=0, atol=1e-10)
    inner = found.s.x[1:-1]
    for order in range(3):  # just before and just after each break
        before, after = found.s(inner - 1e-9, order), found.s(inner + 1e-9, order)
        np.testing.assert_allclose(before, after, rtol=0, atol=1e-6)
    t = np.linspace(0.0, end, 4001)
    old = np.linspace(0.0, law.duration, 4001)
    assert (np.diff(found.s(t)) >= -1e-15).all()
    assert found.s(t, 1).max() <= law.s(old, 1).max() + 1e-12
    accelerations = np.append(law.s(old, 2), 0.0)
    assert np.abs(found.s(t, 3)).max() <= np.ptp(accelerations) / width * (1.0 + 1e-9)


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("share", [0.0, 0.1, 0.25, 0.6, 0.99])
def test_what_is_left_of_a_law_is_the_law(name, share):
    law = LAWS[name]
    at = share * law.duration
    rest = law.after(at)
    t = np.linspace(0.0, law.duration - at, 57)
    assert rest.duration == pytest.approx(law.duration - at, rel=1e-13)
    for order in range(4):
        inside = t[1:-1] + 1e-7  # off the breaks, where a jump belongs to the piece that follows
        inside = inside[inside < rest.duration]
        np.testing.assert_allclose(rest.s(inside, order), law.s(at + inside, order), rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", LAWS)
def test_law_on_other_breaks_is_the_same_and_rests_after_its_end(name):
    from scipy.interpolate import PPoly

    law = LAWS[name]
    breaks = np.union1d(law.s.x, np.array([0.123, 0.77, law.duration + 0.5, law.duration + 2.0]))
    found = PPoly(law.on(breaks), breaks)
    t = np.linspace(0.0, law.duration, 101)[1:-1] + 1e-7
    for order in range(4):
        np.testing.assert_allclose(found(t, order), law.s(t, order), rtol=0, atol=1e-12)
    late = law.duration + np.array([0.1, 0.6, 1.9])
    np.testing.assert_allclose(found(late), 1.0, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(found(late, 1), 0.0)


def test_times_see_both_sides_of_a_jump():
    law = LAWS["trapezoid"]
    a = 2.0 * RAMP
    at = law.times(3)
    assert len(at) == 3 * 3 + 1
    np.testing.assert_allclose(at, [0, 0.25, 0.5, 0.5, 1.0, 1.5, 1.5, 1.75, 2.0, 2.0], rtol=0, atol=1e-11)
    np.testing.assert_allclose(law.s(at, 2), [a, a, a, 0, 0, 0, -a, -a, -a, -a], rtol=0, atol=1e-12)
    assert (np.diff(at) > 0.0).sum() == len(at) - 1
