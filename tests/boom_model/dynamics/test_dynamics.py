"""Loads of a motion against MuJoCo, Pinocchio, the textbook recursion, closed forms and the
thesis's table 2-8."""

import re
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from boom_model.arrays import Array, read_only
from boom_model.boom import IS_LENGTH, Boom, Friction
from boom_model.drives.drive import reflected_inertia
from boom_model.dynamics.base_motion import BaseMotion
from boom_model.dynamics.newton_euler import _CHUNK, Loads, PinForces, inner_link_load, inverse_dynamics
from boom_model.errors import InputError
from boom_model.kinematics.forward import body_motion, forward_kinematics, jacobian
from boom_model.kinematics.frames import frame_transforms
from tests.oracles import (
    BOOMS,
    Need,
    derivative,
    errors,
    instants,
    mujoco_inverse_dynamics,
    pinocchio_energies,
    pinocchio_inverse_dynamics,
    random_base,
    random_states,
    textbook_needs,
    virtual_work,
)

# Rounding, joint by joint; the wrist's small torque comes of a short arm between points far from
# frame 1.
MUJOCO = [5e-15, 5e-15, 5e-15, 5e-15, 4e-14]
PINOCCHIO = [5e-15, 5e-15, 5e-15, 5e-15, 1e-14]
EMPTY = [2e-15, 2e-15, 5e-15, 4e-15, 1e-13]
VIRTUAL_WORK = [3e-13, 3e-13, 5e-13, 1e-13, 1e-12]
MOUNT = 1e-14

ORACLES = pytest.mark.parametrize(
    ("oracle", "tolerance"),
    [(mujoco_inverse_dynamics, MUJOCO), (pinocchio_inverse_dynamics, PINOCCHIO)],
    ids=["mujoco", "pinocchio"],
)
PAYLOADS = pytest.mark.parametrize("payload_as", ["mass", "force"])
SURROUNDINGS = pytest.mark.parametrize("surroundings", ["still", "constant", "varying"])
PINS = ("frame_6", "frame_7", "frame_8")
STILL = np.zeros(5)


def around(surroundings: str, count: int, rng: np.random.Generator) -> dict[str, Any]:
    """What moves the base and acts on the tip: nothing, the same for all samples, or other for
    each."""
    if surroundings == "still":
        return {}
    shape = () if surroundings == "constant" else (count,)
    return {
        "base": random_base(rng, *shape),
        "tip_force": rng.uniform(-100.0, 100.0, (*shape, 3)),
        "tip_moment": rng.uniform(-20.0, 20.0, (*shape, 3)),
    }


def one_by_one(given: dict[str, Any], count: int) -> list[dict[str, Any]]:
    """What `around` gives, sample by sample."""
    if not given:
        return [{} for _ in range(count)]
    forces, moments = (np.broadcast_to(given[name], (count, 3)) for name in ("tip_force", "tip_moment"))
    return [
        {"base": base, "tip_force": force, "tip_moment": moment}
        for base, force, moment in zip(instants(given["base"], count), forces, moments, strict=True)
    ]


@SURROUNDINGS
@PAYLOADS
@ORACLES
def test_torques_and_mount_wrench_equal_the_oracles(boom, oracle, tolerance, payload_as, surroundings):
    rng = np.random.default_rng(2)
    states = random_states(boom, 1000, rng)
    given = around(surroundings, 1000, rng)
    loads = inverse_dynamics(boom, *states, payload_as=payload_as, **given)
    expected = oracle(boom, *states, payload_as=payload_as, **given)
    assert (errors(loads.tau, expected.tau) < tolerance).all()
    assert (errors(loads.mount, expected.mount) < MOUNT).all()


@PAYLOADS
def test_loads_without_payload_equal_pinocchio(boom, payload_as):
    empty, rng = boom.with_payload(0.0), np.random.default_rng(3)
    states, base = random_states(empty, 50, rng), random_base(rng, 50)
    loads = inverse_dynamics(empty, *states, payload_as=payload_as, base=base)
    expected = pinocchio_inverse_dynamics(empty, *states, base=base)
    assert (errors(loads.tau, expected.tau) < EMPTY).all()
    assert (errors(loads.mount, expected.mount) < MOUNT).all()


def test_mount_carries_the_weight_at_rest(boom):
    force = inverse_dynamics(boom, boom.pose("transport"), STILL, STILL).mount[:3]
    weight = (boom.mass + boom.payload.mass) * boom.gravity
    np.testing.assert_allclose(force, [0.0, 0.0, -weight], rtol=1e-15, atol=0.0)


@PAYLOADS
def test_mount_carries_the_weight_on_a_slope(boom, payload_as):
    q, base = boom.pose("phenotyping"), BaseMotion.of(up=(0.3, -0.2, 0.9))
    mount = inverse_dynamics(boom, q, STILL, STILL, base=base, payload_as=payload_as).mount
    masses = {**boom.bodies, "payload": boom.payload}
    weights = {name: -body.mass * boom.gravity * base.up for name, body in masses.items()}
    moments = [np.cross(body.com, weights[name]) for name, body in body_motion(boom, q, STILL, STILL).items()]
    expected = np.concatenate([sum(weights.values()), np.sum(moments, axis=0)])
    np.testing.assert_allclose(mount, expected, rtol=0, atol=3e-15 * np.abs(expected).max())


def test_in_free_fall_nothing_weighs(boom):
    q = random_states(boom, 20, np.random.default_rng(15))[0]
    up = np.array([0.6, 0.0, 0.8])
    loads = inverse_dynamics(boom, q, STILL, STILL, base=BaseMotion.of(up=up, acceleration=-boom.gravity * up))
    assert np.abs(loads.tau).max() < 2e-13
    assert np.abs(loads.mount).max() < 5e-13


def test_a_payload_that_is_a_force_only_weighs():
    """m g against gravity is what it takes, however base and joints move."""
    boom, rng = Boom.load(), np.random.default_rng(16)
    states, base = random_states(boom, 50, rng), random_base(rng, 50)
    hung = inverse_dynamics(boom, *states, base=base, payload_as="force")
    bare = inverse_dynamics(boom.with_payload(0.0), *states, base=base)
    weight = -boom.payload.mass * boom.gravity * base.up
    assert_tip_load(boom, states[0], bare, hung, weight, np.zeros_like(weight))


def test_tip_force_and_moment_do_their_work_on_the_joints(boom):
    rng = np.random.default_rng(17)
    states, force, moment = random_states(boom, 50, rng), rng.normal(size=(50, 3)), rng.normal(size=3)
    free = inverse_dynamics(boom, *states)
    loaded = inverse_dynamics(boom, *states, tip_force=1e3 * force, tip_moment=1e3 * moment)
    assert_tip_load(boom, states[0], free, loaded, 1e3 * force, np.broadcast_to(1e3 * moment, (50, 3)))


def assert_tip_load(boom: Boom, q: Array, before: Loads, after: Loads, force: Array, moment: Array) -> None:
    """tau falls by J^T [force; moment], and the mount carries both."""
    work = np.einsum("nij,ni->nj", jacobian(boom, q), np.concatenate([force, moment], axis=-1))
    np.testing.assert_allclose(before.tau - after.tau, work, rtol=0, atol=2e-15 * np.abs(work).max())
    on_mount = np.concatenate([force, moment + np.cross(forward_kinematics(boom, q).position, force)], axis=-1)
    np.testing.assert_allclose(after.mount - before.mount, on_mount, rtol=0, atol=3e-15 * np.abs(on_mount).max())


@PAYLOADS
def test_a_base_at_rest_is_no_base(boom, payload_as):
    states = random_states(boom, 10, np.random.default_rng(18))
    still = inverse_dynamics(boom, *states, payload_as=payload_as)
    moved = inverse_dynamics(boom, *states, payload_as=payload_as, base=BaseMotion.of(velocity=(3.0, -1.0, 0.5)))
    np.testing.assert_allclose(moved.tau, still.tau, rtol=0, atol=1e-15 * np.abs(still.tau).max())
    np.testing.assert_allclose(moved.mount, still.mount, rtol=0, atol=1e-15 * np.abs(still.mount).max())


@SURROUNDINGS
@PAYLOADS
def test_torques_do_the_virtual_work_of_the_textbook_recursion(boom, payload_as, surroundings):
    rng = np.random.default_rng(5)
    states = random_states(boom, 10, rng)
    given = around(surroundings, 10, rng)
    expected = np.array(
        [
            virtual_work(boom, state[0], textbook_needs(boom, *state, payload_as=payload_as, **now))
            for *state, now in zip(*states, one_by_one(given, 10), strict=True)
        ]
    )
    tau = inverse_dynamics(boom, *states, payload_as=payload_as, **given).tau
    assert (errors(tau, expected) < VIRTUAL_WORK).all()


@PAYLOADS
def test_power_is_the_rate_of_energy(boom, payload_as):
    rng = np.random.default_rng(6)
    centre, swing = (boom.limits.lower + boom.limits.upper) / 2, (boom.limits.upper - boom.limits.lower) / 4
    frequency, phase = rng.uniform(0.5, 1.5, 5), rng.uniform(0, 2 * np.pi, 5)
    t = np.linspace(0.0, 10.0, 21)

    def motion(s: float) -> tuple[Array, Array, Array]:
        angle = frequency * (t[:, None] + s) + phase
        sine, cosine = np.sin(angle), np.cos(angle)
        return centre + swing * sine, swing * frequency * cosine, -swing * frequency**2 * sine

    def energy(s: float) -> Array:
        q, qd, _ = motion(s)
        return np.sum(pinocchio_energies(boom, q, qd, payload_as=payload_as), axis=0)

    power = np.sum(inverse_dynamics(boom, *motion(0.0), payload_as=payload_as).tau * motion(0.0)[1], axis=-1)
    assert errors(power, derivative(energy, h=6e-3)) < 1e-12


@SURROUNDINGS
@PAYLOADS
def test_pins_and_torques_hold_every_body_in_equilibrium(boom, payload_as, surroundings):
    rng = np.random.default_rng(8)
    states = random_states(boom, 25, rng)
    for *state, now in zip(*states, one_by_one(around(surroundings, 25, rng), 25), strict=True):
        loads = inverse_dynamics(boom, *state, payload_as=payload_as, **now)
        needs = textbook_needs(boom, *state, payload_as=payload_as, **now)
        residuals, scale = equilibrium(boom, state[0], loads, needs)
        assert np.abs(residuals).max() < 1e-14 * scale


def equilibrium(boom: Boom, q: Array, loads: Loads, needs: dict[str, Need]) -> tuple[Array, float]:
    """What is missing in the equations of the arm's plane, two forces and a moment a body, and the
    largest pin force.

    The reactions at the shoulder follow from the forces on lower and inner link; the base is left
    to prove them.
    """
    forward, up = np.array([np.cos(q[0]), np.sin(q[0]), 0.0]), np.array([0.0, 0.0, 1.0])
    plane, normal = np.array([forward, up]), np.cross(forward, up)
    shoulder, pin6, pin7, pin8 = frame_transforms(boom, q, "outer")[4:8, :3, 3] @ plane.T
    f6, f7, f8 = (getattr(loads.pins, pin)[[0, 2]] for pin in PINS)
    force = {name: plane @ need.force for name, need in needs.items()}

    def moment_of(arm: Array, f: Array) -> float:
        return arm[0] * f[1] - arm[1] * f[0]

    def moment(name: str, pivot: Array) -> float:
        need = needs[name]
        return need.moment @ normal + moment_of(plane @ need.point - pivot, force[name])

    top = ["upper", "extension", "end_effector", "payload", "tip"]
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


def test_inner_link_load_is_the_reaction_to_pin_8_in_the_inner_link(boom):
    rng = np.random.default_rng(19)
    states = random_states(boom, 50, rng)
    pins = inverse_dynamics(boom, *states, **around("varying", 50, rng)).pins
    R_1_4, R_1_5 = (frame_transforms(boom, states[0], "inner")[:, frame - 1, :3, :3] for frame in (4, 5))
    expected = -(np.swapaxes(R_1_5, -1, -2) @ R_1_4 @ pins.frame_8[..., None])[..., 0]
    load = inner_link_load(states[0], pins)
    np.testing.assert_allclose(load, expected, rtol=0, atol=2e-15 * np.abs(expected).max())
    of_one = inner_link_load(states[0][7], PinForces(*(getattr(pins, pin)[7] for pin in PINS)))
    np.testing.assert_allclose(of_one, load[7], rtol=1e-15)


def test_inner_link_load_names_bad_positions():
    with pytest.raises(InputError, match=r"q has shape \(4,\)"):
        inner_link_load(np.zeros(4), PinForces(*np.zeros((3, 3))))


def cubic(start: Array, end: Array, duration: float, s: Array) -> tuple[Array, Array, Array]:
    """States of the cubic from rest to rest at s = t / duration."""
    s, change = s[:, None], end - start
    rate, accel = change * 6 * (s - s**2) / duration, change * 6 * (1 - 2 * s) / duration**2
    return start + change * (3 * s**2 - 2 * s**3), rate, accel


def test_inner_link_load_on_the_move_of_table_3_1():
    """The extremes that the errata give for the force of the inner link on the upper link, in N."""
    boom = Boom.load()
    states = cubic(boom.pose("transport"), boom.pose("phenotyping"), 5.0, np.linspace(0.0, 1.0, 2001))
    on_upper = -inner_link_load(states[0], inverse_dynamics(boom, *states, payload_as="force").pins)
    np.testing.assert_allclose(on_upper.min(axis=0), [-440.9, 85.0, 0.0], rtol=0, atol=0.05)
    np.testing.assert_allclose(on_upper.max(axis=0), [935.8, 176.0, 0.0], rtol=0, atol=0.05)


FRICTION_RATES = np.array([[0.5, -0.4, 0.0, 0.2, -1.5], [-0.5, 0.0, 0.3, -0.2, 1.5]])


def test_friction_adds_what_opposes_the_motion():
    """viscous qd + coulomb sign(qd), and at rest nothing."""
    boom = replace_friction(Boom.load(), viscous=(1.0, 2.0, 3.0, 4.0, 5.0), coulomb=(10.0, 20.0, 30.0, 40.0, 50.0))
    q = np.tile(boom.pose("transport"), (2, 1))
    without = inverse_dynamics(boom, q, FRICTION_RATES, STILL)
    rubbing = inverse_dynamics(boom, q, FRICTION_RATES, STILL, friction=True)
    expected = [[10.5, -20.8, 0.0, 40.8, -57.5], [-10.5, 0.0, 30.9, -40.8, 57.5]]
    np.testing.assert_allclose(rubbing.tau - without.tau, expected, rtol=0, atol=1e-13)
    assert_same_reactions(rubbing, without)


def replace_friction(boom: Boom, viscous: tuple[float, ...], coulomb: tuple[float, ...]) -> Boom:
    return replace(boom, friction=Friction(read_only(viscous), read_only(coulomb), (None,) * 5))


def test_drive_inertia_adds_the_reflected_inertia_of_the_drives():
    """160^2 x 5.76e-4 kg m^2 on joints 2 and 3 (errata, reflected inertia); the others have no
    drive."""
    boom = Boom.load()
    states = random_states(boom, 5, np.random.default_rng(20))
    without, driven = inverse_dynamics(boom, *states), inverse_dynamics(boom, *states, drive_inertia=True)
    expected = states[2] * [0.0, 160**2 * 5.76e-4, 160**2 * 5.76e-4, 0.0, 0.0]
    np.testing.assert_allclose(driven.tau - without.tau, expected, rtol=0, atol=1e-13)
    assert_same_reactions(driven, without)


def test_drive_inertia_is_each_joints_own():
    boom = BOOMS["generic"]
    inertias = [reflected_inertia(drive) for drive in boom.drives]
    states = random_states(boom, 5, np.random.default_rng(21))
    added = inverse_dynamics(boom, *states, drive_inertia=True).tau - inverse_dynamics(boom, *states).tau
    np.testing.assert_allclose(added, states[2] * inertias, rtol=0, atol=8e-14)


def test_a_drive_without_inertia_data_adds_nothing():
    boom = Boom.load()
    unknown = [drive and replace(drive, motor=replace(drive.motor, rotor_inertia=None)) for drive in boom.drives]
    states = random_states(boom, 5, np.random.default_rng(22))
    driven = inverse_dynamics(replace(boom, drives=tuple(unknown)), *states, drive_inertia=True)
    np.testing.assert_array_equal(driven.tau, inverse_dynamics(boom, *states).tau)


def assert_same_reactions(one: Loads, other: Loads) -> None:
    np.testing.assert_array_equal(one.mount, other.mount)
    for pin in PINS:
        np.testing.assert_array_equal(getattr(one.pins, pin), getattr(other.pins, pin))


def test_pin_forces_lie_in_the_plane_of_the_arm(boom):
    rng = np.random.default_rng(9)
    pins = inverse_dynamics(boom, *random_states(boom, 5, rng), **around("varying", 5, rng)).pins
    for pin in PINS:
        assert (getattr(pins, pin)[:, 1] == 0).all()


# Thesis, table 2-8, the MATLAB columns of joints 2 to 5; joint 1 as virtual work and MuJoCo have
# it, because the thesis has a wrong base moment there.
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
    return cubic(start * to_SI, end * to_SI, 10.0, np.linspace(0.0, 1.0, 11))


def test_table_2_8():
    boom = Boom.load()
    tau = inverse_dynamics(boom, *move_of_table_2_5(), payload_as="force").tau
    half_a_digit = [0.5e-4, 0.5e-3, 0.5e-3, 0.5e-3, 0.5e-3]
    assert (np.abs(tau - TABLE_2_8) <= half_a_digit).all()


def test_a_payload_with_inertia_costs_yaw_torque():
    boom = Boom.load()
    end = [x[-1] for x in move_of_table_2_5()]
    assert inverse_dynamics(boom, *end).tau[0] == pytest.approx(-4.47, abs=0.005)


@SURROUNDINGS
@pytest.mark.parametrize("shape", [(), (5,), (3, 5), (2, 3, 5), (0,), (3, 0)])
def test_batches_are_their_states_one_by_one(boom, shape, surroundings):
    rng = np.random.default_rng(10)
    assert_one_by_one(boom, shape, rng, around(surroundings, int(np.prod(shape)), rng))


def test_chunks_are_their_states_one_by_one():
    rng = np.random.default_rng(11)
    assert_one_by_one(Boom.load(), (_CHUNK + 1,), rng, around("varying", _CHUNK + 1, rng))


def assert_one_by_one(boom: Boom, shape: tuple[int, ...], rng: np.random.Generator, given: dict[str, Any]) -> None:
    count = int(np.prod(shape))
    states = random_states(boom, count, rng)
    batch = inverse_dynamics(boom, *(x.reshape(*shape, 5) for x in states), **shaped(given, shape))
    alone = [inverse_dynamics(boom, *state, **now) for *state, now in zip(*states, one_by_one(given, count), strict=True)]
    for part in (
        lambda loads: loads.tau,
        lambda loads: loads.mount,
        *(lambda loads, pin=pin: getattr(loads.pins, pin) for pin in PINS),
    ):
        expected = np.reshape([part(loads) for loads in alone], (*shape, part(batch).shape[-1]))
        assert part(batch).shape == expected.shape
        scale = np.abs(expected).max(initial=1.0)  # a matrix product adds in another order in another batch
        np.testing.assert_allclose(part(batch), expected, rtol=0, atol=1e-15 * scale)


def shaped(given: dict[str, Any], shape: tuple[int, ...]) -> dict[str, Any]:
    """What `around` gives, with its samples in `shape`."""

    def reshaped(values: Array) -> Array:
        return values if values.shape == (3,) else values.reshape(*shape, 3)

    return {
        name: BaseMotion(*(reshaped(getattr(values, field.name)) for field in fields(values)))
        if isinstance(values, BaseMotion)
        else reshaped(values)
        for name, values in given.items()
    }


def test_states_broadcast(boom):
    q, qd, qdd = random_states(boom, 4, np.random.default_rng(12))
    loads = inverse_dynamics(boom, q[0], qd[:3, None], qdd)
    assert loads.tau.shape == (3, 4, 5)
    assert loads.mount.shape == (3, 4, 6)
    assert loads.pins.frame_7.shape == (3, 4, 3)
    np.testing.assert_allclose(loads.tau[2, 3], inverse_dynamics(boom, q[0], qd[2], qdd[3]).tau, rtol=0, atol=1e-13)


def test_reactions_are_left_out_on_demand(boom):
    states = random_states(boom, 4, np.random.default_rng(13))
    loads = inverse_dynamics(boom, *states, reactions=False)
    assert loads.pins is None
    assert loads.mount is None
    np.testing.assert_allclose(loads.tau, inverse_dynamics(boom, *states).tau, rtol=0, atol=1e-13)


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


@pytest.mark.parametrize("given", ["tip_force", "tip_moment"])
@pytest.mark.parametrize("shape", [(2, 3), (1, 3, 3), (5, 3, 3)])
def test_a_tip_load_that_does_not_match_the_states_is_named(given, shape):
    with pytest.raises(InputError, match=rf"{given} has shape {re.escape(str(shape))}.* states of shape \(3, 5\)"):
        inverse_dynamics(Boom.load(), np.zeros((3, 5)), STILL, STILL, **{given: np.zeros(shape)})


@pytest.mark.parametrize("given", ["tip_force", "tip_moment"])
def test_a_tip_load_that_is_not_finite_is_named(given):
    with pytest.raises(InputError, match=rf"{given}\[2\] is nan"):
        inverse_dynamics(Boom.load(), STILL, STILL, STILL, **{given: (0.0, 0.0, np.nan)})


@pytest.mark.parametrize("given", ["angular_velocity", "acceleration", "angular_acceleration", "up"])
def test_a_base_that_does_not_match_the_states_is_named(given):
    base = BaseMotion.of(**{given: np.ones((2, 3))})
    with pytest.raises(InputError, match=r"base .* has shape \(2, 3\); it does not match states of shape \(3, 5\)"):
        inverse_dynamics(Boom.load(), np.zeros((3, 5)), STILL, STILL, base=base)


@pytest.mark.parametrize(("inner", "lower"), [(0.7, 0.7), (0.0, np.pi)])
def test_torques_stay_finite_where_the_linkage_is_flat(boom, inner, lower):
    q, qd, qdd = random_states(boom, 20, np.random.default_rng(14))
    q[:, 1], q[:, 2] = inner, lower
    given = around("varying", 20, np.random.default_rng(23))
    loads = inverse_dynamics(boom, q, qd, qdd, **given)
    expected = pinocchio_inverse_dynamics(boom, q, qd, qdd, **given)
    assert (errors(loads.tau, expected.tau) < PINOCCHIO).all()
    assert (errors(loads.mount, expected.mount) < MOUNT).all()
    for pin in PINS:
        force = getattr(loads.pins, pin)
        assert not (np.linalg.norm(force, axis=-1) < 1e12).any()
