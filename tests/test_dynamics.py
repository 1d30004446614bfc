"""Inverse dynamics against MuJoCo, Pinocchio, the textbook recursion and the thesis's table 2-8."""

from dataclasses import replace

import numpy as np
import pytest

from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH, Body, Boom
from boom_model.dynamics import _CHUNK, Loads, inverse_dynamics
from boom_model.errors import InputError
from boom_model.frames import frame_transforms
from tests.oracles import (
    Need,
    derivative,
    mujoco_inverse_dynamics,
    pinocchio_energy,
    pinocchio_inverse_dynamics,
    pinocchio_mass_matrix,
    random_states,
    textbook_needs,
    virtual_work,
)

# Rounding, joint by joint; the wrist's small torque comes of a short arm between points far from frame 1.
MUJOCO = [1e-14, 1e-14, 1e-14, 1e-14, 1e-13]
PINOCCHIO = [4e-15, 4e-15, 4e-15, 4e-15, 4e-14]
VIRTUAL_WORK = [3e-13, 3e-13, 5e-13, 1e-13, 1e-12]
MOUNT = 1e-14

ORACLES = pytest.mark.parametrize(
    ("oracle", "tolerance"),
    [(mujoco_inverse_dynamics, MUJOCO), (pinocchio_inverse_dynamics, PINOCCHIO)],
    ids=["mujoco", "pinocchio"],
)
PAYLOADS = pytest.mark.parametrize("payload_as", ["mass", "force"])


@pytest.fixture(scope="module", params=["third generation", "skewed"])
def boom(request: pytest.FixtureRequest) -> Boom:
    """The shipped boom, and one whose bodies have full inertia tensors and centres of mass out of the arm's plane."""
    shipped = Boom.load()
    return shipped if request.param == "third generation" else skewed(shipped)


def skewed(boom: Boom) -> Boom:
    rng = np.random.default_rng(1)
    bodies = {}
    for name, body in boom.bodies.items():
        points = rng.normal(scale=0.2, size=(4, 3))
        inertia = body.mass / 4 * (np.sum(points**2) * np.eye(3) - points.T @ points)
        bodies[name] = Body(body.mass, body.com + rng.uniform(-0.1, 0.1, 3), inertia)
    return replace(boom, bodies=bodies)


def errors(actual: Array, expected: Array) -> Array:
    """Of each column, relative to its largest entry."""
    error: Array = np.abs(actual - expected).max(axis=0) / np.abs(expected).max(axis=0)
    return error


@PAYLOADS
@ORACLES
def test_torques_equal_the_oracles(boom, oracle, tolerance, payload_as):
    states = random_states(boom, 200, np.random.default_rng(2))
    tau = inverse_dynamics(boom, *states, payload_as=payload_as).tau
    assert (errors(tau, oracle(boom, *states, payload_as=payload_as).tau) < tolerance).all()


@PAYLOADS
def test_torques_without_payload_equal_pinocchio(boom, payload_as):
    empty = boom.with_payload(0.0)
    states = random_states(empty, 50, np.random.default_rng(3))
    tau = inverse_dynamics(empty, *states, payload_as=payload_as).tau
    expected = pinocchio_inverse_dynamics(empty, *states).tau
    assert (errors(tau, expected) < PINOCCHIO).all()


@PAYLOADS
@ORACLES
def test_mount_wrench_is_minus_what_a_free_root_needs(boom, oracle, tolerance, payload_as):
    states = random_states(boom, 200, np.random.default_rng(4))
    loads = inverse_dynamics(boom, *states, payload_as=payload_as)
    expected = oracle(boom, *states, payload_as=payload_as, free_root=True)
    assert (errors(loads.mount, expected.mount) < MOUNT).all()
    assert (errors(loads.tau, expected.tau) < tolerance).all()


def test_mount_carries_the_weight_at_rest(boom):
    rest = np.zeros(5)
    force = inverse_dynamics(boom, boom.pose("transport"), rest, rest).mount[:3]
    weight = (boom.mass + boom.payload.mass) * boom.gravity
    np.testing.assert_allclose(force, [0.0, 0.0, -weight], rtol=1e-15, atol=0.0)


@PAYLOADS
def test_torques_do_the_virtual_work_of_the_textbook_recursion(boom, payload_as):
    states = random_states(boom, 20, np.random.default_rng(5))
    expected = np.array(
        [
            virtual_work(boom, state[0], textbook_needs(boom, *state, payload_as=payload_as))
            for state in zip(*states, strict=True)
        ]
    )
    tau = inverse_dynamics(boom, *states, payload_as=payload_as).tau
    assert (errors(tau, expected) < VIRTUAL_WORK).all()


@PAYLOADS
def test_power_is_the_rate_of_energy(boom, payload_as):
    rng = np.random.default_rng(6)
    centre, swing = (boom.limits.lower + boom.limits.upper) / 2, (boom.limits.upper - boom.limits.lower) / 4
    frequency, phase = rng.uniform(0.5, 1.5, 5), rng.uniform(0, 2 * np.pi, 5)

    def motion(t: float) -> tuple[Array, Array, Array]:
        sine, cosine = np.sin(frequency * t + phase), np.cos(frequency * t + phase)
        return centre + swing * sine, swing * frequency * cosine, -swing * frequency**2 * sine

    def energy(t: float) -> float:
        q, qd, _ = motion(t)
        return pinocchio_energy(boom, q, qd, payload_as=payload_as)

    times = np.linspace(0.0, 10.0, 21)
    power = [inverse_dynamics(boom, *motion(t), payload_as=payload_as).tau @ motion(t)[1] for t in times]
    expected = [derivative(lambda s, t=t: energy(t + s), h=6e-3) for t in times]
    assert errors(np.array(power), np.array(expected)) < 1e-12


def test_unit_accelerations_need_the_columns_of_the_mass_matrix(boom):
    for q in random_states(boom, 20, np.random.default_rng(7))[0]:
        rest = inverse_dynamics(boom, q, np.zeros(5), np.zeros(5)).tau
        columns = inverse_dynamics(boom, q, np.zeros(5), np.eye(5)).tau - rest
        expected = pinocchio_mass_matrix(boom, q)
        np.testing.assert_allclose(columns, expected, rtol=0, atol=3e-15 * np.abs(rest).max())


@PAYLOADS
def test_pins_and_torques_hold_every_body_in_equilibrium(boom, payload_as):
    for state in zip(*random_states(boom, 50, np.random.default_rng(8)), strict=True):
        loads = inverse_dynamics(boom, *state, payload_as=payload_as)
        residuals, scale = equilibrium(boom, state[0], loads, textbook_needs(boom, *state, payload_as=payload_as))
        assert np.abs(residuals).max() < 1e-14 * scale


def equilibrium(boom: Boom, q: Array, loads: Loads, needs: dict[str, Need]) -> tuple[Array, float]:
    """What is missing in the equations of the arm's plane, two forces and a moment a body, and the largest pin force.

    The reactions at the shoulder follow from the forces on lower and inner link; the base is left to prove them.
    """
    forward, up = np.array([np.cos(q[0]), np.sin(q[0]), 0.0]), np.array([0.0, 0.0, 1.0])
    plane, normal = np.array([forward, up]), np.cross(forward, up)
    shoulder, pin6, pin7, pin8 = frame_transforms(boom, q, "outer")[4:8, :3, 3] @ plane.T
    f6, f7, f8 = (pin[[0, 2]] for pin in (loads.pins.frame_6, loads.pins.frame_7, loads.pins.frame_8))
    force = {name: plane @ need.force for name, need in needs.items()}

    def moment_of(arm: Array, f: Array) -> float:
        return arm[0] * f[1] - arm[1] * f[0]

    def moment(name: str, pivot: Array) -> float:
        need = needs[name]
        return need.moment @ normal + moment_of(plane @ need.point - pivot, force[name])

    top = ["upper", "extension", "end_effector", "tip"]
    on_lower, on_inner = force["lower"] + f6, force["inner"] + f8
    residuals = [
        *(f6 - f7 - force["outer"]),
        moment_of(pin6 - pin7, f6) - moment("outer", pin7),
        *(f7 + f8 - sum(force[name] for name in top)),
        moment_of(pin7 - pin8, f7) - sum(moment(name, pin8) for name in top),
        loads.tau[2] - moment_of(pin6 - shoulder, f6) - moment("lower", shoulder),
        loads.tau[1] - moment_of(pin8 - shoulder, f8) - moment("inner", shoulder),
        *(-plane @ loads.mount[:3] - on_lower - on_inner - force["base"]),
        -normal @ loads.mount[3:]
        - loads.tau[1]
        - loads.tau[2]
        - moment_of(shoulder, on_lower + on_inner)
        - moment("base", np.zeros(2)),
    ]
    return np.array(residuals), float(np.abs([f6, f7, f8]).max())


def test_pin_forces_lie_in_the_plane_of_the_arm(boom):
    pins = inverse_dynamics(boom, *random_states(boom, 5, np.random.default_rng(9))).pins
    for force in (pins.frame_6, pins.frame_7, pins.frame_8):
        assert (force[:, 1] == 0).all()


# Thesis, table 2-8, the MATLAB columns of joints 2 to 5; joint 1 as virtual work and MuJoCo have it, because the thesis
# has a wrong base moment there.
TABLE_2_8 = np.array(
    [
        [0.2288, 0.527, 73.563, 0.235, 0.001],
        [0.2059, 5.455, 75.539, -1.678, 0.117],
        [0.2303, 18.626, 80.788, -6.788, 0.434],
        [0.2984, 37.863, 88.232, -14.278, 0.894],
        [0.3695, 60.792, 96.713, -23.293, 1.436],
        [0.3712, 84.912, 105.101, -32.947, 1.993],
        [0.2388, 107.832, 112.459, -42.375, 2.502],
        [-0.0417, 127.561, 118.187, -50.782, 2.917],
        [-0.4228, 142.694, 122.093, -57.489, 3.215],
        [-0.8174, 152.347, 124.308, -61.921, 3.393],
        [-1.1236, 155.832, 125.051, -63.551, 3.453],
    ]
)


def move_of_table_2_5() -> tuple[Array, Array, Array]:
    """The cubic of 10 s that table 2-8 is about, at every second."""
    start, end = np.array([0.0, 90.0, 180.0, 0.0, 0.0]), np.array([90.0, 45.0, 150.0, 0.5, 90.0])
    to_SI = np.where(IS_LENGTH, 1.0, np.pi / 180)
    start, change = start * to_SI, (end - start) * to_SI
    s = np.linspace(0.0, 1.0, 11)[:, None]
    return start + change * (3 * s**2 - 2 * s**3), change * 6 * (s - s**2) / 10, change * 6 * (1 - 2 * s) / 100


def test_table_2_8():
    boom = Boom.load()
    tau = inverse_dynamics(boom, *move_of_table_2_5(), payload_as="force").tau
    half_a_digit = [0.5e-4, 0.5e-3, 0.5e-3, 0.5e-3, 0.5e-3]
    assert (np.abs(tau - TABLE_2_8) <= half_a_digit).all()


def test_a_payload_with_inertia_costs_yaw_torque():
    boom = Boom.load()
    end = [x[-1] for x in move_of_table_2_5()]
    assert inverse_dynamics(boom, *end).tau[0] == pytest.approx(-4.47, abs=0.005)


@pytest.mark.parametrize("shape", [(), (5,), (3, 5), (2, 3, 5), (0,), (3, 0)])
def test_batches_are_their_states_one_by_one(boom, shape):
    states = random_states(boom, int(np.prod(shape)), np.random.default_rng(10))
    batch = inverse_dynamics(boom, *(x.reshape(*shape, 5) for x in states))
    assert_one_by_one(boom, batch, states, shape)


def test_chunks_are_their_states_one_by_one():
    boom = Boom.load()
    states = random_states(boom, _CHUNK + 1, np.random.default_rng(11))
    assert_one_by_one(boom, inverse_dynamics(boom, *states), states, (_CHUNK + 1,))


def assert_one_by_one(boom: Boom, batch: Loads, states: tuple[Array, ...], shape: tuple[int, ...]) -> None:
    one_by_one = [inverse_dynamics(boom, *state) for state in zip(*states, strict=True)]
    for last, part in (
        (5, lambda loads: loads.tau),
        (6, lambda loads: loads.mount),
        (3, lambda loads: loads.pins.frame_6),
        (3, lambda loads: loads.pins.frame_7),
        (3, lambda loads: loads.pins.frame_8),
    ):
        expected = np.reshape([part(loads) for loads in one_by_one], (*shape, last))
        assert part(batch).shape == expected.shape
        scale = np.abs(expected).max(initial=1.0)  # a matrix product adds in another order in another batch
        np.testing.assert_allclose(part(batch), expected, rtol=0, atol=2e-15 * scale)


def test_states_broadcast(boom):
    q, qd, qdd = random_states(boom, 4, np.random.default_rng(12))
    loads = inverse_dynamics(boom, q[0], qd[:3, None], qdd)
    assert loads.tau.shape == (3, 4, 5)
    assert loads.mount.shape == (3, 4, 6)
    assert loads.pins.frame_7.shape == (3, 4, 3)
    np.testing.assert_allclose(loads.tau[2, 3], inverse_dynamics(boom, q[0], qd[2], qdd[3]).tau, rtol=0, atol=1e-12)


def test_reactions_are_left_out_on_demand(boom):
    states = random_states(boom, 4, np.random.default_rng(13))
    loads = inverse_dynamics(boom, *states, reactions=False)
    assert loads.pins is None
    assert loads.mount is None
    np.testing.assert_allclose(loads.tau, inverse_dynamics(boom, *states).tau, rtol=0, atol=1e-12)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_number_that_is_not_finite_is_named(bad):
    qd = np.zeros((2, 5))
    qd[1, 3] = bad
    with pytest.raises(InputError, match=rf"qd\[1, 3\] is {bad}"):
        inverse_dynamics(Boom.load(), np.zeros((2, 5)), qd, np.zeros((2, 5)))


@pytest.mark.parametrize("shape", [(), (4,), (6,), (5, 1)])
def test_a_wrong_last_axis_is_named(shape):
    with pytest.raises(InputError, match=r"qdd has shape .* last axis must have length 5"):
        inverse_dynamics(Boom.load(), np.zeros(5), np.zeros(5), np.zeros(shape))


def test_shapes_that_do_not_broadcast_are_named():
    with pytest.raises(InputError, match=r"q \(2, 5\), qd \(3, 5\), qdd \(5,\)"):
        inverse_dynamics(Boom.load(), np.zeros((2, 5)), np.zeros((3, 5)), np.zeros(5))


def test_an_unknown_payload_as_is_refused():
    with pytest.raises(InputError, match="payload_as is 'weight'"):
        inverse_dynamics(Boom.load(), np.zeros(5), np.zeros(5), np.zeros(5), payload_as="weight")


@pytest.mark.parametrize(("inner", "lower"), [(0.7, 0.7), (0.0, np.pi)])
def test_torques_stay_finite_where_the_linkage_is_flat(boom, inner, lower):
    q, qd, qdd = random_states(boom, 20, np.random.default_rng(14))
    q[:, 1], q[:, 2] = inner, lower
    loads = inverse_dynamics(boom, q, qd, qdd)
    expected = pinocchio_inverse_dynamics(boom, q, qd, qdd, free_root=True)
    assert (errors(loads.tau, expected.tau) < PINOCCHIO).all()
    assert (errors(loads.mount, expected.mount) < MOUNT).all()
    for force in (loads.pins.frame_6, loads.pins.frame_7, loads.pins.frame_8):
        assert not (np.linalg.norm(force, axis=-1) < 1e12).any()
