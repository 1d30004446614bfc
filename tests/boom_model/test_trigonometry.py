"""Cosine and sine by the tangent of half the angle, against NumPy's."""

import math

import numpy as np

from boom_model.trigonometry import cosine_and_sine


def test_of_many_angles_and_of_one():
    """3.4e-16 was seen."""
    angles = np.concatenate([np.linspace(-7.0, 7.0, 20_001), np.pi * np.arange(-2.0, 2.5, 0.5)])
    cosine, sine = cosine_and_sine(angles)
    np.testing.assert_allclose(cosine, np.cos(angles), rtol=0, atol=5e-16)
    np.testing.assert_allclose(sine, np.sin(angles), rtol=0, atol=5e-16)
    for angle in (0.0, 1.0, math.pi, -math.pi / 2.0):
        one = cosine_and_sine(angle)
        assert all(type(each) is float for each in one)
        np.testing.assert_allclose(one, (math.cos(angle), math.sin(angle)), rtol=0, atol=5e-16)
