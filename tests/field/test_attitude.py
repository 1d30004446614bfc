"""Attitude against aviation's words, and its errors against finite differences."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boom_model import InputError, up_on_slope
from planner.field import attitude

RANDOM = np.random.default_rng(3).uniform([-0.6, -1.2, 0.0], [0.6, 1.2, 6.28], (50, 3))


@pytest.mark.parametrize(
    ("roll", "pitch", "heading", "axis", "direction"),
    [
        (0, 0, 0, 0, (0, 1, 0)),  # heading north: forward is north,
        (0, 0, 0, 1, (-1, 0, 0)),  # left is west
        (0, 0, 90, 0, (1, 0, 0)),
        (0, 0, 90, 1, (0, 1, 0)),
        (0, 90, 0, 0, (0, 0, 1)),  # the nose goes up,
        (90, 0, 0, 1, (0, 0, 1)),  # the left side goes up, the right one down
        (0, 0, 225, 2, (0, 0, 1)),
    ],
)
def test_directions(roll, pitch, heading, axis, direction):
    assert attitude.rotation(*np.radians([roll, pitch, heading]))[:, axis] == pytest.approx(direction, abs=1e-15)


def test_up_is_that_of_the_vehicle_cases():
    """`up_on_slope` has the roll the same way round, and the pitch with the nose down."""
    R = attitude.rotation(*RANDOM.T)
    assert R[:, 2, :] == pytest.approx(up_on_slope(RANDOM[:, 0], -RANDOM[:, 1]), abs=1e-14)


def test_angles_come_back():
    assert attitude.angles(attitude.rotation(*RANDOM.T)) == pytest.approx(RANDOM, abs=1e-12)


def test_error_axes_equal_finite_differences():
    half = 1e-6
    for roll_pitch_heading in RANDOM:
        R = attitude.rotation(*roll_pitch_heading)
        for i, axis in enumerate(attitude.error_axes(R).T):
            step = half * np.eye(3)[i]
            change = attitude.rotation(*(roll_pitch_heading + step)) - attitude.rotation(*(roll_pitch_heading - step))
            spin = change / (2.0 * half) @ R.T
            assert [spin[2, 1], spin[0, 2], spin[1, 0]] == pytest.approx(axis, abs=1e-9)


def test_attitude_of_directions():
    R = Rotation.random(rng=np.random.default_rng(5)).as_matrix()
    body = np.array([[1.0, 0.2, 0.0], [0.0, 1.5, 0.3], [-0.4, 0.1, 1.0]])
    assert attitude.of_directions(body, body @ R.T) == pytest.approx(R, abs=1e-12)
    with pytest.raises(InputError, match="two that are not parallel"):
        attitude.of_directions(body[:1], body[:1])
