"""Loads of links from moves: equilibrium of the whole link with its joint's torque, and the motion
of its pins."""

import numpy as np
import pytest

from boom_model import Boom, InputError, body_motion, inner_link_load, inverse_dynamics
from boom_model.kinematics.forward import frame_motion
from boom_model.kinematics.frames import R_LINK_BODY, frame_transforms
from boom_model.link_design import LINKS, Beam, Material, internal_forces, load_link
from planner.links.loads import largest_components, link_cases, thesis_load
from planner.motion.trajectory import Trajectory
from planner.validation.tables import table_3_1_motion
from tests.oracles import random_states

BOOM = Boom.load()
UP = BOOM.gravity * np.array([0.0, 0.0, 1.0])
PINS = {"inner": ("inner", 5, 8), "lower": ("outer", 5, 6), "outer": ("outer", 6, 7)}
"""Loop and frames of a link's root and end."""


def motion(seed: int = 21, count: int = 40) -> Trajectory:
    q, qd, qdd = random_states(BOOM, count, np.random.default_rng(seed))
    return Trajectory.from_samples(np.arange(count) * 0.1, q, qd, qdd)


def table_3_1() -> Trajectory:
    t = np.linspace(0.0, 5.0, 501)
    q, qd, qdd, _ = table_3_1_motion(BOOM)(t)
    return Trajectory.from_samples(t, q, qd, qdd)


def axes(q, angle):
    forward = np.stack([np.cos(q[:, 0]), np.sin(q[:, 0]), np.zeros(len(q))], axis=-1)
    up = np.array([0.0, 0.0, 1.0])
    return np.cos(angle)[:, None] * forward + np.sin(angle)[:, None] * up, -np.sin(angle)[:, None] * forward + np.cos(angle)[
        :, None
    ] * up


@pytest.mark.parametrize("payload_as", ["mass", "force"])
def test_inner_load_is_that_of_the_dynamics(payload_as):
    moving = motion()
    cases, when = link_cases(BOOM, load_link(BOOM, "inner"), [moving], payload_as=payload_as)
    loads = inverse_dynamics(BOOM, moving.q, moving.qd, moving.qdd, payload_as=payload_as)
    np.testing.assert_allclose(cases.end_force, inner_link_load(moving.q, loads.pins)[:, :2], rtol=0, atol=4e-12)
    np.testing.assert_array_equal(when[:, 1], moving.t)


@pytest.mark.parametrize("name", ["inner", "lower", "outer"])
def test_end_load_and_own_inertia_are_in_balance_with_the_joint(name):
    """Euler's equation of the link about its root, with the boom's own body: the moment left is the
    joint's torque."""
    moving = motion()
    q, qd, qdd = moving.q, moving.qd, moving.qdd
    cases, _ = link_cases(BOOM, load_link(BOOM, name), [moving])
    body, held = body_motion(BOOM, q, qd, qdd)[name], BOOM.bodies[name]
    R = body.T[:, :3, :3]
    w, w1 = body.angular_velocity, body.angular_acceleration
    inertia = R @ held.inertia @ np.swapaxes(R, 1, 2)
    moment = np.einsum("nij,nj->ni", inertia, w1) + np.cross(w, np.einsum("nij,nj->ni", inertia, w))
    felt = body.acceleration + UP
    moment += np.cross(body.com - body.T[:, :3, 3], held.mass * felt)
    e, p = axes(q, q[:, 2] if name == "lower" else q[:, 1])
    n = np.cross(e, p)
    length = load_link(BOOM, name).length
    torque = (moment * n).sum(axis=-1) - length * cases.end_force[:, 1]
    tau = inverse_dynamics(BOOM, q, qd, qdd).tau
    expected = {"inner": tau[:, 1], "lower": tau[:, 2], "outer": np.zeros(len(q))}[name]
    np.testing.assert_allclose(torque, expected, rtol=0, atol=5e-12)


def test_extension_bears_the_tool_at_the_wrist():
    moving = motion()
    q = moving.q
    link = load_link(BOOM, "extension")
    cases, _ = link_cases(BOOM, link, [moving])
    loads = inverse_dynamics(BOOM, q, moving.qd, moving.qdd)
    rod, held = body_motion(BOOM, q, moving.qd, moving.qdd)["extension"], BOOM.bodies["extension"]
    along, _ = axes(q, q[:, 2])
    own = held.mass * ((rod.acceleration + UP) * -along).sum(axis=-1)
    np.testing.assert_allclose(own - cases.end_force[:, 0], loads.tau[:, 3], rtol=0, atol=5e-13)
    np.testing.assert_allclose(cases.end_moment, loads.tau[:, 4])
    np.testing.assert_allclose(cases.clamp, link.length - np.clip(q[:, 3], 0.0, None), atol=1e-8)


@pytest.mark.parametrize("name", sorted(PINS))
def test_accelerations_are_those_of_the_pins(name):
    moving = motion()
    loop, root, end = PINS[name]
    frames = frame_motion(BOOM, moving.q, moving.qd, moving.qdd, loop)
    link = load_link(BOOM, name)
    cases, _ = link_cases(BOOM, link, [moving])
    for frame, x in ((root, 0.0), (end, link.length)):
        felt = frames.acceleration[:, frame - 1] + [0.0, 0.0, BOOM.gravity]
        e, p = axes(moving.q, moving.q[:, 2] if name == "lower" else moving.q[:, 1])
        at = cases.acceleration[..., 0] + cases.acceleration[..., 1] * x
        np.testing.assert_allclose(at, np.stack([(felt * e).sum(-1), (felt * p).sum(-1)], axis=-1), rtol=0, atol=3e-14)


def test_links_stand_where_the_frames_do():
    q = motion().q
    for name, (loop, root, end) in PINS.items():
        T = frame_transforms(BOOM, q, loop)
        e, _ = axes(q, q[:, 2] if name == "lower" else q[:, 1])
        np.testing.assert_allclose(T[:, end - 1, :3, 3] - T[:, root - 1, :3, 3], load_link(BOOM, name).length * e, atol=1e-12)
    assert R_LINK_BODY["inner"][0, 0] == 1.0


@pytest.mark.parametrize("name", LINKS)
def test_largest_components_bear_more_than_every_instant(name):
    link = load_link(BOOM, name)
    cases, _ = link_cases(BOOM, link, [table_3_1()])
    beam = Beam(link.length, link.width, Material.load("steel"), slices=50, support=link.support)
    H = np.full(51, 0.04)
    every, most = (internal_forces(beam, H, c) for c in (cases, largest_components(cases)))
    if link.support == "cantilever":
        for one, all_at_once in zip(every, most, strict=True):
            assert (np.abs(one).max(axis=0) <= np.abs(all_at_once).max(axis=0) + 1e-9).all()


def test_thesis_rates_follow_from_its_move_and_its_forces_do_not():
    found = thesis_load(BOOM.with_payload(10.0), load_link(BOOM, "inner"), [table_3_1()], payload_as="force")
    np.testing.assert_allclose(found.acceleration, [8.493, 9.912, 0.165], atol=1e-3)
    np.testing.assert_allclose(found.angular_velocity, [0.293, 0.423, 0.314], atol=1e-3)
    np.testing.assert_allclose(found.angular_acceleration, [0.327, 0.377, 0.251], atol=1e-3)
    np.testing.assert_allclose(found.applied, [935.8, 176.0], atol=0.05)


def test_a_flat_linkage_and_no_motion_are_refused():
    q = np.array([[0.0, 0.0, np.pi, 0.0, 0.0]])
    still = Trajectory.from_samples([0.0], q, np.zeros((1, 5)), np.zeros((1, 5)))
    cases_of = load_link(BOOM, "inner")
    with pytest.raises(InputError, match="no motion is given"):
        link_cases(BOOM, cases_of, [])
    with pytest.raises(InputError, match="motion 1, t = 0 s: the linkage is flat"):
        link_cases(BOOM, cases_of, [still])
    with pytest.raises(InputError, match="unknown link 'wrist'; there are: inner, lower, outer, extension"):
        load_link(BOOM, "wrist")
