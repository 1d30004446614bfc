"""The regressor against inverse dynamics and Pinocchio's regressor carried through the loop;
parameters and bodies."""

from dataclasses import replace

import numpy as np
import pinocchio
import pytest

from boom_model import BaseMotion, Boom, InputError, inverse_dynamics
from boom_model.arrays import Array
from boom_model.dynamics.regressor import (
    REGRESSOR_BODIES,
    body_of_pseudo_inertia,
    body_parameters,
    inertial_parameters,
    parameters_of_pseudo_inertia,
    pseudo_inertia,
    pseudo_inertia_of_parameters,
    regressor,
)
from tests.oracles import (
    fixed_root,
    instants,
    pinocchio_model,
    random_base,
    random_states,
    tree,
    tree_matrix,
)

COUNT = 1000


def rank(Y: Array) -> int:
    """Rank of stacked regressors (n, 5, p), by singular values of its scaled columns."""
    stacked = Y.reshape(-1, Y.shape[-1])
    norms = np.linalg.norm(stacked, axis=0)
    told = norms > 1e-12 * norms.max()
    values = np.linalg.svd(stacked[:, told] / norms[told], compute_uv=False) / np.sqrt(told.sum())
    assert not ((values > 1e-12) & (values < 1e-6)).any()  # nothing in doubt
    return int((values > 1e-9).sum())


def through_the_loop(boom: Boom, states: tuple[Array, Array, Array], base: BaseMotion | None) -> Array:
    """G^T Y_tree of Pinocchio's joint torque regressor, (n, 5, 70): the payload is part of the end
    effector."""
    free = pinocchio_model(boom)
    model = free if base is not None else fixed_root(free)
    data, G = model.createData(), tree_matrix(boom)
    order = [link.body for link in tree(boom)]
    columns = [order.index(name) for name in REGRESSOR_BODIES[:-1]]
    first = 6 if base is not None else 0
    found = []
    for q, qd, qdd, now in zip(*states, instants(base, len(states[0])), strict=True):
        x, xd, xdd = G @ q, G @ qd, G @ qdd
        if base is not None:
            # Any rotation with this `up`; a free-flyer's linear rate is the spatial acceleration a
            # - w x v.
            R = pinocchio.Quaternion.FromTwoVectors(now.up, np.array([0.0, 0.0, 1.0])).toRotationMatrix()
            x = np.concatenate([pinocchio.SE3ToXYZQUAT(pinocchio.SE3(R, np.zeros(3))), x])
            root = now.acceleration - np.cross(now.angular_velocity, now.velocity)
            xd = np.concatenate([now.velocity, now.angular_velocity, xd])
            xdd = np.concatenate([root, now.angular_acceleration, xdd])
        Y = pinocchio.computeJointTorqueRegressor(model, data, x, xd, xdd)[first:]
        Y = Y.reshape(7, -1, 10)[:, -7:][:, columns]
        found.append((G.T @ Y.reshape(7, -1)).copy())
    return np.array(found)


@pytest.mark.parametrize("moving", [False, True])
def test_it_gives_the_torques_of_inverse_dynamics(boom: Boom, moving: bool) -> None:
    rng = np.random.default_rng(1)
    states = random_states(boom, COUNT, rng)
    base = random_base(rng, COUNT) if moving else None
    expected = inverse_dynamics(boom, *states, base=base, reactions=False).tau
    actual = regressor(boom, *states, base=base) @ inertial_parameters(boom)
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("moving", [False, True])
def test_it_is_pinocchios_regressor_carried_through_the_loop(boom: Boom, moving: bool) -> None:
    rng = np.random.default_rng(2)
    states = random_states(boom, 100, rng)
    base = random_base(rng, 100) if moving else None
    expected = through_the_loop(boom, states, base)
    actual = regressor(boom, *states, base=base)[..., :70]
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())
    assert rank(actual) == rank(expected)


@pytest.mark.parametrize(("moving", "combinations"), [(False, 29), (True, 35)])
def test_the_number_of_base_parameters(boom: Boom, moving: bool, combinations: int) -> None:
    rng = np.random.default_rng(3)
    base = random_base(rng, 200) if moving else None
    assert rank(regressor(boom, *random_states(boom, 200, rng), base=base)) == combinations


def test_a_body_and_its_parameters_are_the_same(boom: Boom) -> None:
    parameters = inertial_parameters(boom).reshape(-1, 10)
    for name, row in zip(REGRESSOR_BODIES, parameters, strict=True):
        body = {**boom.bodies, "payload": boom.payload}[name]
        P = pseudo_inertia_of_parameters(row)
        np.testing.assert_allclose(P, pseudo_inertia(body), atol=1e-14)
        np.testing.assert_allclose(parameters_of_pseudo_inertia(P), row, atol=1e-14)
        back = body_of_pseudo_inertia(P)
        assert back.mass == pytest.approx(body.mass)
        np.testing.assert_allclose(back.com, body.com, atol=1e-14)
        np.testing.assert_allclose(back.inertia, body.inertia, atol=1e-13)
        about_origin = pinocchio.Inertia(body.mass, body.com, body.inertia).toDynamicParameters()
        np.testing.assert_allclose(body_parameters(body), about_origin, atol=1e-13)


def test_it_depends_on_no_mass(boom: Boom) -> None:
    states = random_states(boom, 5, np.random.default_rng(4))
    heavier = replace(boom.with_payload(3.0), bodies={**boom.bodies, "inner": boom.bodies["outer"]})
    np.testing.assert_array_equal(regressor(heavier, *states), regressor(boom, *states))


def test_shapes_broadcast_and_bad_ones_are_named(boom: Boom) -> None:
    q = boom.pose("phenotyping")
    assert regressor(boom, q, np.zeros(5), np.zeros((3, 2, 5))).shape == (3, 2, 5, 80)
    with pytest.raises(InputError, match=r"qd has shape \(4,\)"):
        regressor(boom, q, np.zeros(4), np.zeros(5))


@pytest.mark.parametrize(("moving", "combinations"), [(False, 37), (True, 43)])
def test_unequal_links_show_eight_combinations_more(boom: Boom, moving: bool, combinations: int) -> None:
    unequal = replace(boom, geometry=replace(boom.geometry, upper_less_lower=2e-3, inner_less_outer=-3e-3))
    rng = np.random.default_rng(3)
    q, qd, qdd = random_states(boom, 400, rng)
    q[:, 2] = q[:, 1] + rng.uniform(0.3, 2.6, 400)
    base = random_base(rng, 400) if moving else None
    assert rank(regressor(unequal, q, qd, qdd, base=base)) == combinations


@pytest.mark.parametrize("moving", [False, True])
def test_unequal_links_have_a_regressor_too(boom: Boom, moving: bool) -> None:
    unequal = replace(boom, geometry=replace(boom.geometry, upper_less_lower=4e-3, inner_less_outer=-6e-3))
    rng = np.random.default_rng(5)
    q, qd, qdd = random_states(boom, COUNT, rng)
    q[:, 2] = q[:, 1] + rng.uniform(0.3, 2.6, COUNT)  # where these links close
    base = random_base(rng, COUNT) if moving else None
    expected = inverse_dynamics(unequal, q, qd, qdd, base=base, reactions=False).tau
    actual = regressor(unequal, q, qd, qdd, base=base) @ inertial_parameters(unequal)
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())
