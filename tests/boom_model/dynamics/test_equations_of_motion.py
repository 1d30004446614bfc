"""Mass matrix, bias, energies and forward dynamics against MuJoCo, Pinocchio, each other and
differences."""

from collections.abc import Callable
from dataclasses import fields

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from boom_model.arrays import Array
from boom_model.boom import Boom
from boom_model.drives.drive import reflected_inertia
from boom_model.dynamics.base_motion import BaseMotion, up_on_slope
from boom_model.dynamics.equations_of_motion import (
    forward_dynamics,
    gravity_torque,
    kinetic_energy,
    mass_matrix,
    mass_matrix_and_bias,
    potential_energy,
    velocity_torque,
)
from boom_model.dynamics.newton_euler import inverse_dynamics
from boom_model.errors import InputError
from boom_model.kinematics.forward import body_motion
from tests.oracles import (
    BOOMS,
    derivative,
    errors,
    mujoco_mass_matrix,
    pinocchio_energies,
    pinocchio_inverse_dynamics,
    pinocchio_mass_matrix,
    random_base,
    random_states,
)

STILL = np.zeros(5)
DRIVES = pytest.mark.parametrize("drive_inertia", [False, True], ids=["links", "links and drives"])


def states(boom: Boom, count: int, seed: int) -> tuple[Array, Array, Array]:
    return random_states(boom, count, np.random.default_rng(seed))


@pytest.mark.parametrize("oracle", [mujoco_mass_matrix, pinocchio_mass_matrix])
def test_mass_matrix_equals_the_oracles(boom, oracle):
    q = states(boom, 1000, 1)[0]
    expected = oracle(boom, q)
    np.testing.assert_allclose(mass_matrix(boom, q), expected, rtol=0, atol=7e-15 * np.abs(expected).max())


@DRIVES
def test_mass_matrix_is_symmetric_and_positive_definite(boom, drive_inertia):
    M = mass_matrix(boom, states(boom, 1000, 2)[0], drive_inertia=drive_inertia)
    np.testing.assert_array_equal(M, np.swapaxes(M, -1, -2))
    assert (np.linalg.eigvalsh(M) > 1e-3).all()


def test_drive_inertia_is_on_the_diagonal():
    boom = BOOMS["generic"]
    q = states(boom, 10, 3)[0]
    added = mass_matrix(boom, q, drive_inertia=True) - mass_matrix(boom, q)
    expected = np.diag([reflected_inertia(drive) for drive in boom.drives])
    np.testing.assert_allclose(added, np.broadcast_to(expected, added.shape), rtol=0, atol=2e-14)


def test_a_joint_without_a_drive_has_no_drive_inertia():
    boom = BOOMS["third generation"]
    added = mass_matrix(boom, STILL, drive_inertia=True) - mass_matrix(boom, STILL)
    np.testing.assert_allclose(added, np.diag([0.0, 14.7456, 14.7456, 0.0, 0.0]), rtol=0, atol=1e-14)


def test_inverse_dynamics_is_the_sum_of_the_terms(boom):
    q, qd, qdd = states(boom, 200, 4)
    inertia = np.einsum("nij,nj->ni", mass_matrix(boom, q), qdd)
    total = inertia + velocity_torque(boom, q, qd) + gravity_torque(boom, q)
    assert (errors(total, inverse_dynamics(boom, q, qd, qdd).tau) < 5e-15).all()


BASES: dict[str, Callable[[], BaseMotion | None]] = {
    "still": lambda: None,
    "constant": lambda: random_base(np.random.default_rng(5)),
    "varying": lambda: random_base(np.random.default_rng(5), 1000),
}


@DRIVES
@pytest.mark.parametrize("friction", [False, True], ids=["smooth", "rubbing"])
@pytest.mark.parametrize("surroundings", BASES)
def test_forward_dynamics_undoes_inverse_dynamics(boom, surroundings, friction, drive_inertia):
    q, qd, qdd = states(boom, 1000, 6)
    options = {"base": BASES[surroundings](), "friction": friction, "drive_inertia": drive_inertia}
    tau = inverse_dynamics(boom, q, qd, qdd, **options).tau
    assert (errors(forward_dynamics(boom, q, qd, tau, **options), qdd) < 4e-12).all()


def test_inverse_dynamics_undoes_forward_dynamics(boom):
    q, qd, tau = states(boom, 200, 7)
    options = {"base": random_base(np.random.default_rng(8), 200), "friction": True, "drive_inertia": True}
    qdd = forward_dynamics(boom, q, qd, 50.0 * tau, **options)
    assert (errors(inverse_dynamics(boom, q, qd, qdd, **options).tau, 50.0 * tau) < 4e-13).all()


@pytest.mark.parametrize("surroundings", BASES)
def test_closed_form_equals_newton_euler_and_pinocchio(boom, surroundings):
    q, qd, qdd = states(boom, 1000, 20)
    options = {"base": BASES[surroundings](), "tip_force": np.random.default_rng(21).normal(scale=50.0, size=(1000, 3))}
    M, bias = mass_matrix_and_bias(boom, q, qd, **options)
    tau = np.einsum("nij,nj->ni", M, qdd) + bias
    assert (errors(tau, inverse_dynamics(boom, q, qd, qdd, **options).tau) < 5e-15).all()
    assert (errors(tau[:200], oracle_torque(boom, 200, q, qd, qdd, **options)) < 4e-14).all()


def oracle_torque(boom: Boom, count: int, *motion: Array, base: BaseMotion | None, tip_force: Array) -> Array:
    if base is not None and base.velocity.ndim > 1:
        base = BaseMotion(*(getattr(base, field.name)[:count] for field in fields(base)))
    few = [x[:count] for x in motion]
    return pinocchio_inverse_dynamics(boom, *few, base=base, tip_force=tip_force[:count]).tau


def test_velocity_torque_equals_pinocchio(boom):
    q, qd, _ = states(boom, 200, 9)
    rest = np.zeros_like(q)
    expected = pinocchio_inverse_dynamics(boom, q, qd, rest).tau - pinocchio_inverse_dynamics(boom, q, rest, rest).tau
    assert (errors(velocity_torque(boom, q, qd), expected) < 7e-14).all()


def test_velocity_torque_is_quadratic_in_the_velocity(boom):
    q, one, other = states(boom, 100, 10)
    both, apart = velocity_torque(boom, q, one + other), velocity_torque(boom, q, one - other)
    of_one, of_other = velocity_torque(boom, q, one), velocity_torque(boom, q, other)
    assert (errors(both + apart, 2.0 * (of_one + of_other)) < 6e-15).all()
    assert (errors(velocity_torque(boom, q, -3.0 * one), 9.0 * of_one) < 1e-14).all()
    assert np.abs(velocity_torque(boom, q, STILL)).max() == 0.0


def test_velocity_torque_is_that_of_lagrange(boom):
    """It is dM/dt qd - d(qd . M qd / 2)/dq, the work of changing inertia, and no other."""
    q, qd, _ = states(boom, 50, 11)
    M_rate = derivative(lambda s: mass_matrix(boom, q + s * qd), h=3e-3)
    slopes = [derivative(lambda s, d=d: kinetic_energy(boom, q + s * d, qd), h=3e-3) for d in np.eye(5)]
    expected = np.einsum("nij,nj->ni", M_rate, qd) - np.stack(slopes, axis=-1)
    assert (errors(velocity_torque(boom, q, qd), expected) < 1e-11).all()


def test_torque_beyond_gravity_feeds_the_kinetic_energy(boom):
    """d/dt (qd . M qd / 2) = qd . (tau - g): dM/dt - 2 C does no work."""
    q, qd, qdd = states(boom, 100, 12)
    power = np.sum(qd * (inverse_dynamics(boom, q, qd, qdd).tau - gravity_torque(boom, q)), axis=-1)
    rate = derivative(lambda s: kinetic_energy(boom, q + s * qd + s**2 / 2 * qdd, qd + s * qdd), h=3e-3)
    assert errors(power, rate) < 8e-13


def test_energies_equal_pinocchio(boom):
    q, qd, _ = states(boom, 200, 13)
    kinetic, potential = pinocchio_energies(boom, q, qd)
    assert errors(kinetic_energy(boom, q, qd), kinetic) < 3e-15
    assert errors(potential_energy(boom, q), potential) < 1e-14


def test_gravity_torque_is_the_gradient_of_the_potential_energy(boom):
    q = states(boom, 100, 14)[0]
    slopes = [derivative(lambda s, d=d: potential_energy(boom, q + s * d)) for d in np.eye(5)]
    expected = np.stack(slopes, axis=-1)
    np.testing.assert_allclose(gravity_torque(boom, q), expected, rtol=0, atol=7e-13 * np.abs(expected).max())


def test_gravity_torque_on_a_slope_is_the_gradient_of_the_height_there(boom):
    q, base = states(boom, 100, 15)[0], BaseMotion.of(up=up_on_slope(0.4, -0.3))
    masses = {**boom.bodies, "payload": boom.payload}

    def energy(at: Array) -> Array:
        motions = body_motion(boom, at, STILL, STILL)
        return boom.gravity * np.sum([masses[name].mass * body.com @ base.up for name, body in motions.items()], axis=0)

    expected = np.stack([derivative(lambda s, d=d: energy(q + s * d)) for d in np.eye(5)], axis=-1)
    actual = gravity_torque(boom, q, base=base)
    np.testing.assert_allclose(actual, expected, rtol=0, atol=7e-13 * np.abs(expected).max())


def test_gravity_torque_holds_the_boom_on_a_moving_base(boom):
    q, base = states(boom, 100, 16)[0], random_base(np.random.default_rng(17), 100)
    expected = pinocchio_inverse_dynamics(boom, q, np.zeros_like(q), np.zeros_like(q), base=base).tau
    assert (errors(gravity_torque(boom, q, base=base), expected) < 3e-14).all()


def test_a_boom_that_falls_keeps_its_energy():
    boom, rng = BOOMS["third generation"], np.random.default_rng(18)
    start = np.concatenate([boom.pose("transport"), rng.uniform(-0.5, 0.5, 5)])

    def rate(_: float, x: Array) -> Array:
        return np.concatenate([x[5:], forward_dynamics(boom, x[:5], x[5:], STILL)])

    path = solve_ivp(rate, (0.0, 0.6), start, method="DOP853", rtol=1e-11, atol=1e-11).y.T
    kinetic, potential = kinetic_energy(boom, path[:, :5], path[:, 5:]), potential_energy(boom, path[:, :5])
    assert np.ptp(kinetic) > 100.0
    total = kinetic + potential
    np.testing.assert_allclose(total, np.full_like(total, total[0]), rtol=0, atol=1e-9)


@pytest.mark.parametrize("shape", [(), (4,), (2, 4), (0,)])
def test_batches_are_their_states_one_by_one(boom, shape):
    q, qd, tau = states(boom, int(np.prod(shape)), 19)
    for last, function in (
        ((5, 5), lambda q, *_: mass_matrix(boom, q)),
        ((5, 5), lambda q, qd, _: mass_matrix_and_bias(boom, q, qd)[0]),
        ((5,), lambda q, qd, _: mass_matrix_and_bias(boom, q, qd)[1]),
        ((5,), lambda q, qd, _: velocity_torque(boom, q, qd)),
        ((5,), lambda q, *_: gravity_torque(boom, q)),
        ((5,), lambda q, qd, tau: forward_dynamics(boom, q, qd, tau)),
        ((), lambda q, qd, _: kinetic_energy(boom, q, qd)),
        ((), lambda q, *_: potential_energy(boom, q)),
    ):
        expected = np.reshape([function(*state) for state in zip(q, qd, tau, strict=True)], (*shape, *last))
        actual = function(*(x.reshape(*shape, 5) for x in (q, qd, tau)))
        assert actual.shape == expected.shape
        np.testing.assert_allclose(actual, expected, rtol=0, atol=5e-15 * np.abs(expected).max(initial=1.0))


@pytest.mark.parametrize("function", [mass_matrix, gravity_torque, potential_energy])
def test_bad_positions_are_named(function):
    with pytest.raises(InputError, match=r"q has shape \(4,\); its last axis must have length 5"):
        function(BOOMS["third generation"], np.zeros(4))


@pytest.mark.parametrize(
    "function", [velocity_torque, kinetic_energy, lambda boom, q, qd: forward_dynamics(boom, q, qd, STILL)]
)
def test_states_that_do_not_match_are_named(function):
    with pytest.raises(InputError, match=r"shapes do not match: q \(2, 5\), qd \(3, 5\)"):
        function(BOOMS["third generation"], np.zeros((2, 5)), np.zeros((3, 5)))
