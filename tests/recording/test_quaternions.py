"""Quaternions of rotation matrices, against SciPy."""

import numpy as np
from scipy.spatial.transform import Rotation

from planner.recording.quaternions import quaternions


def test_random_rotations_and_half_turns_about_every_axis():
    """2e-16 was seen."""
    turns = Rotation.random(1_000, rng=np.random.default_rng(1))
    half = Rotation.from_rotvec(np.pi * np.vstack([np.eye(3), -np.eye(3), np.full((1, 3), 3.0**-0.5)]))
    R = np.concatenate([turns.as_matrix(), half.as_matrix(), np.eye(3)[None]])
    found = quaternions(R)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0, rtol=0, atol=2e-15)
    np.testing.assert_allclose(Rotation.from_quat(found).as_matrix(), R, rtol=0, atol=2e-15)
