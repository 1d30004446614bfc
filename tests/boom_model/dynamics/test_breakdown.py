"""The parts of the joint torques: their sum, and each against Pinocchio."""

from dataclasses import fields

import numpy as np
import pytest

from boom_model import Breakdown, breakdown
from boom_model.arrays import Array
from boom_model.boom import Boom
from boom_model.dynamics.base_motion import BaseMotion
from boom_model.dynamics.newton_euler import inverse_dynamics
from boom_model.errors import InputError
from tests.oracles import BOOMS, errors, pinocchio_inverse_dynamics, pinocchio_mass_matrix, random_base, random_states

PARTS = [field.name for field in fields(Breakdown)]
STILL = np.zeros(5)
PINOCCHIO = np.array([5e-15, 5e-15, 5e-15, 5e-15, 3e-14])
PAYLOADS = pytest.mark.parametrize("payload_as", ["mass", "force"])
SURROUNDINGS = pytest.mark.parametrize("surroundings", ["still", "constant", "varying"])


def motion(boom: Boom, count: int, seed: int, surroundings: str) -> tuple[tuple[Array, Array, Array], BaseMotion | None]:
    rng = np.random.default_rng(seed)
    states = random_states(boom, count, rng)
    if surroundings == "still":
        return states, None
    return states, random_base(rng, *(() if surroundings == "constant" else (count,)))


def assert_parts_equal(one: Breakdown, other: Breakdown, *names: str) -> None:
    for name in names:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


@pytest.mark.parametrize("friction", [False, True])
@PAYLOADS
@SURROUNDINGS
def test_the_parts_add_up_to_the_torque(boom, surroundings, payload_as, friction):
    states, base = motion(boom, 1000, 1, surroundings)
    options = {"base": base, "payload_as": payload_as, "friction": friction}
    parts = breakdown(boom, *states, **options)
    tau = inverse_dynamics(boom, *states, **options).tau
    assert (errors(parts.total, tau) < 3e-15).all()
    np.testing.assert_array_equal(parts.total, np.sum([getattr(parts, name) for name in PARTS], axis=0))


@PAYLOADS
@SURROUNDINGS
def test_each_part_is_what_pinocchio_has(boom, surroundings, payload_as):
    (q, qd, qdd), base = motion(boom, 60, 2, surroundings)
    empty, rest = boom.with_payload(0.0), np.zeros_like(q)

    def tau(of: Boom, *state: Array, on: BaseMotion | None = None) -> Array:
        return pinocchio_inverse_dynamics(of, *state, payload_as=payload_as, base=on).tau

    expected = {
        "gravity": tau(empty, q, rest, rest),
        "inertia": np.einsum("nij,nj->ni", pinocchio_mass_matrix(empty, q), qdd),
        "velocity": tau(empty, q, qd, rest) - tau(empty, q, rest, rest),
        "payload": tau(boom, q, qd, qdd) - tau(empty, q, qd, qdd),
        "vehicle": tau(boom, q, qd, qdd, on=base) - tau(boom, q, qd, qdd),
        "friction": rest,
    }
    parts, scale = (
        breakdown(boom, q, qd, qdd, base=base, payload_as=payload_as),
        np.abs(tau(boom, q, qd, qdd, on=base)).max(axis=0),
    )
    assert set(expected) == set(PARTS)
    for name, values in expected.items():
        assert (np.abs(getattr(parts, name) - values).max(axis=0) < PINOCCHIO * scale).all(), name


def test_at_rest_only_weight_is_left(boom):
    q = random_states(boom, 50, np.random.default_rng(3))[0]
    parts = breakdown(boom, q, STILL, STILL, friction=True)
    for name in ("inertia", "velocity", "friction", "vehicle"):
        assert np.abs(getattr(parts, name)).max() == 0.0


def test_without_payload_there_is_no_payload_part(boom):
    states, base = motion(boom, 50, 4, "varying")
    assert np.abs(breakdown(boom.with_payload(0.0), *states, base=base).payload).max() == 0.0


@PAYLOADS
def test_the_payload_part_grows_with_the_mass(boom, payload_as):
    states, _ = motion(boom, 50, 5, "still")
    one, three = (breakdown(boom.with_payload(m), *states, payload_as=payload_as) for m in (4.0, 12.0))
    expected = 3.0 * one.payload
    np.testing.assert_allclose(three.payload, expected, rtol=0, atol=1e-14 * np.abs(expected).max())
    assert_parts_equal(one, three, "gravity", "inertia", "velocity", "friction", "vehicle")


def test_a_payload_that_is_a_force_costs_no_more_in_motion(boom):
    (q, qd, qdd), _ = motion(boom, 50, 6, "still")
    moving, resting = (breakdown(boom, q, *rates, payload_as="force").payload for rates in ((qd, qdd), (STILL, STILL)))
    np.testing.assert_allclose(moving, resting, rtol=0, atol=5e-15 * np.abs(resting).max())


def test_the_vehicle_adds_to_its_own_part_alone(boom):
    states, base = motion(boom, 50, 7, "varying")
    still, moving = breakdown(boom, *states, friction=True), breakdown(boom, *states, base=base, friction=True)
    assert_parts_equal(still, moving, "gravity", "inertia", "velocity", "payload", "friction")
    assert np.abs(still.vehicle).max() == 0.0
    assert (np.abs(moving.vehicle).max(axis=0) > 0.0).all()


def test_friction_adds_to_its_own_part_alone():
    boom = BOOMS["generic"]
    states, base = motion(boom, 50, 8, "varying")
    smooth, rubbing = (breakdown(boom, *states, base=base, friction=friction) for friction in (False, True))
    assert_parts_equal(smooth, rubbing, "gravity", "inertia", "velocity", "payload", "vehicle")
    assert np.abs(smooth.friction).max() == 0.0
    expected = boom.friction.viscous * states[1] + boom.friction.coulomb * np.sign(states[1])
    np.testing.assert_array_equal(rubbing.friction, expected)


@pytest.mark.parametrize("shape", [(), (4,), (2, 4), (0,)])
def test_parts_have_the_shape_of_the_states(boom, shape):
    states = random_states(boom, int(np.prod(shape)), np.random.default_rng(9))
    parts = breakdown(boom, *(x.reshape(*shape, 5) for x in states), base=random_base(np.random.default_rng(10)), friction=True)
    for name in (*PARTS, "total"):
        assert getattr(parts, name).shape == (*shape, 5)


def test_rates_broadcast_to_the_positions(boom):
    q, qd, qdd = random_states(boom, 4, np.random.default_rng(11))
    parts = breakdown(boom, q, qd[0], qdd[0], friction=True)
    each = breakdown(boom, q, np.tile(qd[0], (4, 1)), np.tile(qdd[0], (4, 1)), friction=True)
    assert_parts_equal(parts, each, *PARTS)


def test_bad_states_are_named(boom):
    with pytest.raises(InputError, match=r"q \(2, 5\), qd \(3, 5\), qdd \(5,\)"):
        breakdown(boom, np.zeros((2, 5)), np.zeros((3, 5)), STILL)
    with pytest.raises(InputError, match="payload_as is 'weight'"):
        breakdown(boom, STILL, STILL, STILL, payload_as="weight")
