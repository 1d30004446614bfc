"""How base motions are made, checked and tilted."""

import re
from dataclasses import fields

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boom_model.dynamics.base_motion import BaseMotion, up_on_slope
from boom_model.errors import InputError

FIELDS = [field.name for field in fields(BaseMotion)]
UP = np.array([0.0, 0.0, 1.0])


def test_a_base_is_at_rest_on_level_ground_unless_told_otherwise():
    base = BaseMotion.of()
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(base, name), UP if name == "up" else np.zeros(3))


def test_values_are_taken_as_given():
    rng = np.random.default_rng(1)
    given = {name: rng.normal(size=(4, 3)) for name in FIELDS[:-1]}
    base = BaseMotion.of(**given)
    for name, values in given.items():
        np.testing.assert_array_equal(getattr(base, name), values)


@pytest.mark.parametrize("shape", [(), (7,), (2, 7)])
def test_up_is_scaled_to_length_1(shape):
    up = np.random.default_rng(2).normal(size=(*shape, 3))
    actual = BaseMotion.of(up=1e3 * up).up
    assert actual.shape == up.shape
    np.testing.assert_allclose(np.linalg.norm(actual, axis=-1), np.ones(shape), rtol=0, atol=4e-16)
    np.testing.assert_allclose(np.cross(actual, up), np.zeros_like(up), rtol=0, atol=1e-15)
    assert (np.sum(actual * up, axis=-1) > 0.0).all()


@pytest.mark.parametrize("name", FIELDS)
def test_entries_cannot_be_written_to(name):
    given = np.ones((2, 3))
    values = getattr(BaseMotion.of(**{name: given}), name)
    with pytest.raises(ValueError, match="read-only"):
        values[0] = 5.0
    given[:] = 7.0
    assert np.abs(values).max() <= 1.0


@pytest.mark.parametrize("name", FIELDS)
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_number_that_is_not_finite_is_named(name, bad):
    values = np.ones((2, 3))
    values[1, 2] = bad
    with pytest.raises(InputError, match=rf"base {name}\[1, 2\] is {bad}"):
        BaseMotion.of(**{name: values})


@pytest.mark.parametrize("name", FIELDS)
@pytest.mark.parametrize("shape", [(), (2,), (4,), (3, 1)])
def test_a_wrong_last_axis_is_named(name, shape):
    with pytest.raises(InputError, match=rf"base {name} has shape {re.escape(str(shape))}; its last axis must have length 3"):
        BaseMotion.of(**{name: np.ones(shape)})


@pytest.mark.parametrize("up", [(0.0, 0.0, 0.0), [(0.0, 0.0, 1.0), (0.0, 0.0, 0.0)]])
def test_up_that_is_zero_is_refused(up):
    with pytest.raises(InputError, match="base up is zero"):
        BaseMotion.of(up=up)


def test_up_on_slope_is_the_vertical_in_the_rotated_base():
    """R_ground_base = R_y(pitch) R_x(roll)."""
    roll, pitch = np.random.default_rng(3).uniform(-np.pi, np.pi, (2, 50))
    R = Rotation.from_euler("YX", np.stack([pitch, roll], axis=-1))
    np.testing.assert_allclose(up_on_slope(roll, pitch), R.inv().apply(UP), rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("roll", "pitch", "up"),
    [
        (0.0, 0.0, (0.0, 0.0, 1.0)),
        (0.0, np.pi / 2, (-1.0, 0.0, 0.0)),
        (np.pi / 2, 0.0, (0.0, 1.0, 0.0)),
        (0.0, np.radians(30.0), (-0.5, 0.0, np.sqrt(0.75))),
        (np.radians(30.0), 0.0, (0.0, 0.5, np.sqrt(0.75))),
    ],
    ids=["level", "nose down", "right side down", "downhill", "right wheels low"],
)
def test_up_on_slope_of_plain_slopes(roll, pitch, up):
    """Nose down, gravity pulls forward and up points backward; rolled about forward, the right side
    goes down."""
    np.testing.assert_allclose(up_on_slope(roll, pitch), up, rtol=0, atol=1e-15)


def test_slopes_broadcast():
    roll, pitch = np.linspace(-0.3, 0.3, 4), np.linspace(-0.2, 0.2, 3)[:, None]
    up = up_on_slope(roll, pitch)
    assert up.shape == (3, 4, 3)
    np.testing.assert_array_equal(up[2, 1], up_on_slope(roll[1], pitch[2, 0]))
    np.testing.assert_allclose(BaseMotion.of(up=up).up, up, rtol=0, atol=3e-16)


@pytest.mark.parametrize("name", ["roll", "pitch"])
def test_an_angle_that_is_not_finite_is_named(name):
    with pytest.raises(InputError, match=f"{name} is nan"):
        up_on_slope(**{"roll": 0.0, "pitch": 0.0, name: np.nan})
