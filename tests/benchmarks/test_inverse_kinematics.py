"""Targets a second of the closed-form inverse kinematics, against IKPy on the same targets.

IKPy solves one target from one start by least squares. It knows open chains alone: it gets the rows
of the inner loop's DH table, its fourth joint turning by theta3 - theta2, and the extension held.
Run it alone for the numbers: `pytest tests/benchmarks/test_inverse_kinematics.py`.
"""

import time

import numpy as np
import pytest
from ikpy.chain import Chain
from ikpy.link import DHLink, URDFLink

from boom_model.arrays import Array
from boom_model.boom import Boom
from boom_model.kinematics.constraints import FixedExtension, LeastExtension, LeastTorque
from boom_model.kinematics.forward import forward_kinematics
from boom_model.kinematics.frames import dh_rows
from boom_model.kinematics.inverse import solve_branches
from tests.oracles import random_states

BOOM = Boom.load()
EXTENSION = 0.4
COUNT, FEW = 10_000, 20
ACTIVE = {0: 0, 3: 1, 4: 2, 8: 4}  # link of the chain: joint of the boom; link 4 turns by theta3 - theta2


def targets(count: int) -> tuple[Array, Array]:
    """q (n, 5) within the limits with the extension held, and their transforms T_1_11 (n, 4, 4)."""
    q = random_states(BOOM, count, np.random.default_rng(41))[0]
    q[:, 3] = EXTENSION
    tip = forward_kinematics(BOOM, q)
    T = np.tile(np.eye(4), (count, 1, 1))
    T[:, :3, :3], T[:, :3, 3] = tip.rotation, tip.position
    return q, T


def chain() -> Chain:
    """The boom's rows with q = 0, in Craig's convention; joints without a limit of their own are
    open."""
    rows = dh_rows(BOOM, np.zeros(5), "inner")
    limits, right = BOOM.limits, np.pi / 2
    bounds = {i: (limits.lower[joint], limits.upper[joint]) for i, joint in ACTIVE.items()}
    bounds[4] = (limits.linkage, limits.upper[2])
    links = []
    for i, (alpha, a, d, theta) in enumerate(rows):
        links.append(
            DHLink(
                f"row {i + 1}", d=d, a=a, alpha=alpha, theta=theta, bounds=bounds.get(i, (None, None)), convention="modified"
            )
        )
    slide = URDFLink(
        "extension",
        origin_translation=[BOOM.geometry.L6, 0.0, 0.0],
        origin_orientation=[right, 0.0, 0.0],
        translation=[0.0, 0.0, 1.0],
        bounds=(0.0, 1.0),
        use_symbolic_matrix=False,
        joint_type="prismatic",
    )
    held = DHLink("row 8", d=BOOM.geometry.L7, theta=np.pi, convention="modified")
    links[7:8] = [slide, held]
    active = [i in ACTIVE or i - 1 == 8 for i in range(len(links))]
    active[8] = False
    return Chain(links, active_links_mask=active)


def as_links(q: Array) -> Array:
    """The chain's parameters (11,) of q (5,)."""
    links = np.zeros(11)
    links[[0, 3, 4, 7, 9]] = q[0], q[1], q[2] - q[1], q[3], q[4]
    return links


def solve_with_ikpy(robot: Chain, T: Array) -> Array:
    middle = (BOOM.limits.lower + BOOM.limits.upper) / 2
    middle[3] = EXTENSION
    start = as_links(middle)
    return np.array([robot.inverse_kinematics_frame(each, start, orientation_mode="all") for each in T])


def test_the_chain_is_the_boom():
    q, T = targets(50)
    robot = chain()
    for joints, expected in zip(q, T, strict=True):
        np.testing.assert_allclose(robot.forward_kinematics(as_links(joints)), expected, rtol=0, atol=1e-14)


@pytest.mark.benchmark(group="inverse kinematics: closed form")
@pytest.mark.parametrize(
    ("hold", "count"),
    [(FixedExtension(EXTENSION), COUNT), (LeastExtension(), COUNT), (LeastTorque(), COUNT // 10)],
    ids=lambda x: type(x).__name__ if not isinstance(x, int) else str(x),
)
def test_targets_a_second_in_closed_form(benchmark, hold, count):
    q, T = targets(count)
    pitch = forward_kinematics(BOOM, q).pitch
    run = (BOOM, T[:, :3, 3], pitch, hold)
    found = benchmark.pedantic(solve_branches, run, rounds=3)
    assert found.within_limits.any(axis=-1).all()
    if benchmark.enabled:
        rate = count / benchmark.stats.stats.min
        start = time.perf_counter()
        solve_with_ikpy(chain(), T[:FEW])
        theirs = FEW / (time.perf_counter() - start)
        benchmark.extra_info |= {"targets_per_s": rate, "of_ikpy": rate / theirs}


@pytest.mark.benchmark(group="inverse kinematics: IKPy, 20 targets")
def test_targets_a_second_of_ikpy(benchmark):
    _, T = targets(FEW)
    robot = chain()
    found = benchmark.pedantic(solve_with_ikpy, (robot, T), rounds=1)
    reached = np.array([robot.forward_kinematics(links) for links in found])
    miss = np.linalg.norm(reached[:, :3, 3] - T[:, :3, 3], axis=-1)
    benchmark.extra_info["worst_miss_m"] = float(miss.max())
    assert miss.max() < 1e-7
    if benchmark.enabled:
        benchmark.extra_info["targets_per_s"] = FEW / benchmark.stats.stats.min
