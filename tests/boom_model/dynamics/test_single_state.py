"""Torques of one state, which have a way of their own, against those of a batch."""

import numpy as np
import pytest

from boom_model import Boom, InputError, gravity_torque, inverse_dynamics
from tests.oracles import random_states

BOOM = Boom.load()
STATES = random_states(BOOM, 200, np.random.default_rng(4))
SCALE = np.abs(inverse_dynamics(BOOM, *STATES).tau).max(axis=0)


def test_one_state_has_the_torques_that_it_has_among_many():
    """1e-16 of the largest was seen."""
    among = inverse_dynamics(BOOM, *STATES, reactions=False).tau
    alone = np.stack([inverse_dynamics(BOOM, *state, reactions=False).tau for state in zip(*STATES, strict=True)])
    assert (np.abs(alone - among) < 1e-15 * SCALE).all()
    with_reactions = inverse_dynamics(BOOM, *(x[0] for x in STATES)).tau
    assert (np.abs(alone[0] - with_reactions) < 1e-15 * SCALE).all()


def test_static_torques_are_those_of_rest():
    q, still = STATES[0], np.zeros(5)
    expected = inverse_dynamics(BOOM, q, still, still, reactions=False).tau
    np.testing.assert_allclose(gravity_torque(BOOM, q), expected, rtol=0, atol=1e-12)
    np.testing.assert_allclose(gravity_torque(BOOM, q.reshape(4, 50, 5)).reshape(-1, 5), expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("entry", [np.nan, np.inf])
def test_one_state_that_is_not_finite_is_refused(entry):
    q = STATES[0][0].copy()
    q[2] = entry
    with pytest.raises(InputError, match=r"q\[2\] is (nan|inf)"):
        inverse_dynamics(BOOM, q, np.zeros(5), np.zeros(5), reactions=False)
