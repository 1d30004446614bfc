"""Piecewise polynomials, against SciPy."""

import numpy as np
from scipy.interpolate import PPoly

from planner.timing.polynomials import Polynomials

RNG = np.random.default_rng(1)
BREAKS = np.concatenate([[0.0], np.cumsum(RNG.uniform(0.1, 1.0, 40))])
OURS = Polynomials(RNG.normal(size=(4, 40)), BREAKS)
THEIRS = PPoly(OURS.c, OURS.x)
T = np.concatenate([np.linspace(-0.5, BREAKS[-1] + 0.5, 1_001), BREAKS])


def test_values_and_derivatives_are_scipys_to_the_last_bit():
    for order, found in enumerate(OURS.derivatives(T, 4)):
        np.testing.assert_array_equal(found, THEIRS(T, order))
        np.testing.assert_array_equal(OURS(T, order), THEIRS(T, order))
    assert float(OURS(BREAKS[3], 1)) == float(THEIRS(BREAKS[3], 1))


def test_antiderivative_and_roots():
    np.testing.assert_array_equal(OURS.antiderivative()(T), THEIRS.antiderivative()(T))
    roots = THEIRS.solve(0.3, extrapolate=False)
    assert len(roots) > 5
    np.testing.assert_array_equal(OURS.solve(0.3), roots)
