"""Input shapers against the oscillator that they are made for."""

import numpy as np
import pytest

from boom_model import InputError
from planner.control import Shaper, impulses, residual

MODES = [(5.5, 0.02), (1.0, 0.0), (12.0, 0.3)]


@pytest.mark.parametrize(("f", "zeta"), MODES)
@pytest.mark.parametrize("shaper", [Shaper.ZV, Shaper.ZVD])
def test_a_shaper_leaves_its_mode_at_rest(shaper, f, zeta):
    shaped = impulses(shaper, f, zeta)
    np.testing.assert_allclose(shaped.amplitudes.sum(), 1.0, rtol=1e-15)
    assert (shaped.amplitudes > 0.0).all()
    damped_period = 1.0 / (f * np.sqrt(1.0 - zeta**2))
    np.testing.assert_allclose(shaped.times[-1], damped_period / 2.0 * (1 if shaper is Shaper.ZV else 2), rtol=1e-14)
    assert residual(shaped, f, zeta) < 1e-15
    # The same from the oscillator's own response, x'' + 2 zeta w x' + w^2 x = 0 after each impulse.
    w = 2.0 * np.pi * f
    A = np.array([[0.0, 1.0], [-(w**2), -2.0 * zeta * w]])
    values, vectors = np.linalg.eig(A)
    state = np.zeros(2, dtype=complex)
    for amplitude, late in zip(shaped.amplitudes, shaped.times[-1] - shaped.times, strict=True):
        start = amplitude * np.array([0.0, w])
        state += vectors @ (np.exp(values * late) * np.linalg.solve(vectors, start))
    np.testing.assert_allclose(state / [1.0, w], 0.0, atol=1e-14)


def test_zvd_bears_an_error_in_the_frequency_better():
    zv, zvd = (impulses(s, 5.0, 0.02) for s in (Shaper.ZV, Shaper.ZVD))
    for off in (0.9, 1.1):
        assert residual(zvd, off * 5.0, 0.02) < 0.3 * residual(zv, off * 5.0, 0.02)
    free, h = impulses(Shaper.ZVD, 5.0, 0.0), 1e-4
    np.testing.assert_allclose(residual(free, 5.0 + h, 0.0), (np.pi / 2.0 * h / 5.0) ** 2, rtol=1e-3)


def test_no_shaper_is_one_impulse():
    none = impulses(Shaper.NONE, 5.0, 0.1)
    assert (none.times.tolist(), none.amplitudes.tolist()) == ([0.0], [1.0])
    assert residual(none, 5.0, 0.1) == 1.0


@pytest.mark.parametrize(
    ("f", "zeta", "message"), [(0.0, 0.1, "must be above 0 Hz"), (5.0, 1.0, "below 1"), (np.nan, 0.0, "frequency is nan")]
)
def test_bad_modes_are_named(f, zeta, message):
    with pytest.raises(InputError, match=message):
        impulses(Shaper.ZV, f, zeta)
