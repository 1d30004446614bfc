"""Time and memory of batched inverse dynamics, against Pinocchio and MuJoCo driving the same tree
with the same loop map.

Run it alone for the numbers: `pytest tests/benchmarks -s`. Every method has one thread: BLAS is
held to one, so that nothing gains by a second core. Where NumPy does not bring its own OpenBLAS,
set OPENBLAS_NUM_THREADS=1 or its like.
"""

import ctypes
import time
import tracemalloc
from collections.abc import Callable, Iterator
from dataclasses import replace

import mujoco
import numpy as np
import pinocchio
import pytest

from boom_model.arrays import Array
from boom_model.boom import Boom
from boom_model.dynamics.newton_euler import Loads, inverse_dynamics
from tests.oracles import fixed_root, mujoco_model, pinocchio_model, random_base, random_states, tree_matrix

BOOM = Boom.load()
COUNTS = (1, 1_000, 100_000)
LOOPED = 2_000  # samples that a loop in Python gets at most: more would not change its time a sample
ROUNDS = 7  # of every method in turn, of which the best counts

Run = Callable[[], Array]
"""Computes tau (n, 5)."""


@pytest.fixture(scope="module", autouse=True)
def one_blas_thread() -> Iterator[None]:
    """NumPy has no call for this; the OpenBLAS in its wheels has."""
    blas = ctypes.CDLL(np._core._multiarray_umath.__file__)
    if not hasattr(blas, "scipy_openblas_set_num_threads64_"):
        yield
        return
    before = blas.scipy_openblas_get_num_threads64_()
    blas.scipy_openblas_set_num_threads64_(1)
    yield
    blas.scipy_openblas_set_num_threads64_(before)


def ours(*states: Array) -> Run:
    return lambda: inverse_dynamics(BOOM, *states, reactions=False).tau


def ours_with_reactions(*states: Array) -> Run:
    return lambda: inverse_dynamics(BOOM, *states, reactions=True).tau


def pinocchio_parallel(*states: Array) -> Run:
    pool, G = pinocchio.ModelPool(fixed_root(pinocchio_model(BOOM)), 1), tree_matrix(BOOM)

    def run() -> Array:
        x, xd, xdd = ((y @ G.T).T for y in states)  # a column a sample, as Pinocchio keeps them: it makes no copy
        needed = np.empty_like(x)
        pinocchio.rneaInParallel(1, pool, x, xd, xdd, needed)
        return needed.T @ G

    return run


def pinocchio_loop(*states: Array) -> Run:
    model, G = fixed_root(pinocchio_model(BOOM)), tree_matrix(BOOM)
    data = model.createData()

    def run() -> Array:
        tree_states = [y @ G.T for y in states]
        needed = np.empty_like(tree_states[0])
        for row, x, xd, xdd in zip(needed, *tree_states, strict=True):
            row[:] = pinocchio.rnea(model, data, x, xd, xdd)
        return needed @ G

    return run


def mujoco_loop(*states: Array) -> Run:
    """With the oracle's free root at rest, which costs less than a twentieth."""
    model, G = mujoco_model(BOOM), tree_matrix(BOOM)
    data = mujoco.MjData(model)
    qpos, qvel, qacc, inverse = (x[-7:] for x in (data.qpos, data.qvel, data.qacc, data.qfrc_inverse))

    def run() -> Array:
        tree_states = [y @ G.T for y in states]
        needed = np.empty_like(tree_states[0])
        for row, x, xd, xdd in zip(needed, *tree_states, strict=True):
            qpos[:], qvel[:], qacc[:] = x, xd, xdd
            mujoco.mj_inverse(model, data)
            row[:] = inverse
        return needed @ G

    return run


METHODS = (ours, ours_with_reactions, pinocchio_parallel, pinocchio_loop, mujoco_loop)
LOOPS = (pinocchio_loop, mujoco_loop)


@pytest.mark.benchmark(max_time=0.3)
@pytest.mark.parametrize(
    ("count", "method"),
    [(count, method) for count in COUNTS for method in METHODS if count <= LOOPED or method not in LOOPS],
    ids=lambda x: getattr(x, "__name__", x),
)
def test_time(benchmark, count, method):
    states = some_states(count)
    benchmark.group = f"inverse dynamics, samples: {count}"
    tau = benchmark(method(*states))
    assert_same(tau, *states)
    if benchmark.enabled:
        benchmark.extra_info["us_per_sample"] = 1e6 * benchmark.stats.stats.min / count


def test_large_batch_takes_under_a_quarter_of_pinocchios_time():
    """Torques alone take 0.16 of it, and 0.23 with the reactions."""
    count = COUNTS[-1]
    states = some_states(count)
    runs = {method: method(*(x[:LOOPED] if method in LOOPS else x for x in states)) for method in METHODS}
    for run in runs.values():
        tau = run()
        assert_same(tau, *(x[: len(tau)] for x in states))
    best = dict.fromkeys(METHODS, np.inf)
    for _ in range(ROUNDS):
        for method, run in runs.items():
            start = time.process_time()  # of all threads; other programs do not count
            tau = run()
            best[method] = min(best[method], 1e6 * (time.process_time() - start) / len(tau))
    for method, spent in best.items():
        print(f"{method.__name__:20} {spent:7.3f} us/sample {spent / best[pinocchio_parallel]:6.2f} of Pinocchio's")
    assert best[ours] < 0.25 * best[pinocchio_parallel]


def test_unequal_links_take_a_few_times_as_long():
    """Twice the time a state in batches, 1.4 times alone; the regressor some 5 times."""
    unequal = replace(BOOM, geometry=replace(BOOM.geometry, upper_less_lower=4e-3, inner_less_outer=-6e-3))
    q, qd, qdd = some_states(1_000)
    q[:, 2] = q[:, 1] + np.random.default_rng(1).uniform(0.3, 2.6, len(q))  # where these links close
    best = dict.fromkeys((BOOM, unequal), np.inf)
    for _ in range(ROUNDS):
        for boom in best:
            start = time.process_time()
            for _ in range(5):
                inverse_dynamics(boom, q, qd, qdd)
            best[boom] = min(best[boom], time.process_time() - start)
    print(f"unequal links take {best[unequal] / best[BOOM]:.1f} times as long")
    assert best[unequal] < 5.0 * best[BOOM]


def test_a_single_state_against_pinocchios_rnea():
    """7.5 of `rnea` alone on the open tree, which is 1.5 us of C++.

    2.2 of `rnea` with the loop map that closes the linkage.
    """
    q, qd, qdd = (x[0] for x in some_states(1))
    model, G = fixed_root(pinocchio_model(BOOM)), tree_matrix(BOOM)
    data, tree = model.createData(), [G @ x for x in (q, qd, qdd)]
    runs: dict[str, Callable[[], Array]] = {
        "ours": lambda: inverse_dynamics(BOOM, q, qd, qdd, reactions=False).tau,
        "rnea with loop map": lambda: G.T @ pinocchio.rnea(model, data, G @ q, G @ qd, G @ qdd),
        "rnea": lambda: pinocchio.rnea(model, data, *tree),
    }
    np.testing.assert_allclose(runs["ours"](), runs["rnea with loop map"](), rtol=1e-12, atol=1e-12)
    best = dict.fromkeys(runs, np.inf)
    for _ in range(200):
        for name, run in runs.items():
            start = time.process_time()
            for _ in range(20):
                run()
            best[name] = min(best[name], (time.process_time() - start) / 20)
    for name, spent in best.items():
        print(f"{name:20} {1e6 * spent:6.2f} us; ours takes {best['ours'] / spent:.1f} of it")
    assert best["ours"] < 2.7 * best["rnea with loop map"]
    assert best["ours"] < 9.0 * best["rnea"]


@pytest.mark.parametrize(
    "asked",
    [
        {"reactions": False},
        {"reactions": True},
        {"moving": True, "tip_force": [1.0, 2.0, 3.0]},
        {"friction": True, "drive_inertia": True},
    ],
    ids=["torques", "reactions", "moving base", "friction"],
)
def test_memory_beyond_the_outputs_does_not_grow_with_samples(asked):
    few, many = (working_memory(count, **asked) for count in (20_000, 200_000))
    assert abs(many - few) < 64 * 1024


def working_memory(count: int, *, moving: bool = False, **asked) -> int:
    """Peak bytes beyond inputs and outputs."""
    states = some_states(count)
    base = random_base(np.random.default_rng(2), count) if moving else None
    inverse_dynamics(BOOM, *(x[:1] for x in states))  # the boom's masses are regrouped once
    tracemalloc.start()
    try:
        loads = inverse_dynamics(BOOM, *states, base=base, **asked)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    return peak - size(loads)


def size(loads: Loads) -> int:
    pins = () if loads.pins is None else (loads.pins.frame_6, loads.pins.frame_7, loads.pins.frame_8)
    return sum(x.nbytes for x in (loads.tau, loads.mount, *pins) if x is not None)


def some_states(count: int) -> tuple[Array, Array, Array]:
    return random_states(BOOM, count, np.random.default_rng(1))


def assert_same(tau: Array, *states: Array) -> None:
    expected = inverse_dynamics(BOOM, *states).tau
    scale = np.abs(inverse_dynamics(BOOM, *some_states(1_000)).tau).max(axis=0)
    assert tau.shape == expected.shape
    assert (np.abs(tau - expected) < 1e-9 * scale).all()
