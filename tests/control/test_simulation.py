"""Simulated motions: energy, a known motion followed, and bad input."""

from dataclasses import replace

import numpy as np
import pytest

from boom_model import Boom, Friction, InputError, inverse_dynamics, kinetic_energy, potential_energy
from planner import plan
from planner.control.simulation import simulate

BOOM = Boom.load()
START = [0.3, 1.2, 2.2, 0.3, 0.2]


def free(t, q, qd):
    return np.zeros(5)


def energy(boom, fall):
    return kinetic_energy(boom, fall.q, fall.qd) + potential_energy(boom, fall.q)


def test_falling_boom_keeps_its_energy_to_the_integrators_tolerance():
    t = np.linspace(0.0, 1.5, 61)
    errors = []
    for rtol in (1e-6, 1e-9):
        fall = simulate(BOOM, START, [0.5, 0.0, 0.0, 0.0, 0.0], free, t, rtol=rtol, atol=0.1 * rtol)
        moved = kinetic_energy(BOOM, fall.q, fall.qd)
        errors.append(np.abs(energy(BOOM, fall) - energy(BOOM, fall)[0]).max() / moved.max())
    assert moved.max() > 50.0  # it does fall
    assert errors[1] < 2e-9
    assert errors[1] < errors[0]


def test_friction_takes_energy_away():
    rough = replace(BOOM, friction=Friction(np.full(5, 3.0), np.zeros(5), (None,) * 5))
    fall = simulate(rough, START, np.zeros(5), free, np.linspace(0.0, 1.0, 41), friction=True)
    assert (np.diff(energy(rough, fall)) < 0.0).all()


def test_planned_torques_drive_the_planned_move():
    move = plan(BOOM, "transport", "phenotyping")

    def torque(t, q, qd):
        p, v, a, _ = move.motions[0](t)
        return inverse_dynamics(BOOM, p, v, a, reactions=False).tau

    t = np.linspace(0.0, 0.2, 11)  # no feedback: later the boom falls away from its plan, as a pendulum on its head does
    driven = simulate(BOOM, move.trajectory.q[0], np.zeros(5), torque, t)
    np.testing.assert_allclose(driven.q, move.motions[0](t)[0], rtol=0, atol=1e-7)
    np.testing.assert_allclose(driven.qdd[1:], move.motions[0](t)[2][1:], rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"q": [np.nan] * 5}, r"q\[0\] is nan"),
        ({"t": [0.0]}, "n >= 2"),
        ({"t": [1.0, 0.0]}, "increasing"),
        ({"qd": [0.0]}, "qd has shape"),
    ],
)
def test_bad_input_is_named(change, message):
    good = {"q": START, "qd": np.zeros(5), "torque": free, "t": [0.0, 1.0]}
    with pytest.raises(InputError, match=message):
        simulate(BOOM, **(good | change))
