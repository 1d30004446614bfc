"""Planning time of the time-optimal law under the drives' limits, against toppra called directly
with Pinocchio's `rnea`.

Same path, same 500 steps, same discretisation. The peer's torques have constant limits, the motors'
at standstill: what toppra holds in one solve. It breaks the motors' torque-speed curve wherever
that counts, which the peak ratios show. Run it alone for the numbers: `pytest
tests/benchmarks/test_time_optimal.py -s`.
"""

import logging
import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pinocchio
import pytest
import toppra
from toppra.algorithm import TOPPRA
from toppra.constraint import (
    DiscretizationType,
    JointAccelerationConstraint,
    JointTorqueConstraint,
    JointVelocityConstraint,
)

from boom_model import Boom
from boom_model.arrays import Array
from planner import MoveSpec, TimeOptimal, plan, plan_motion
from planner.paths.path import JointLine
from planner.timing.profiles.time_optimal import GRID_INTERVALS, time_optimal
from planner.timing.time_law import Motion
from planner.timing.timing import Timing, timed
from tests.minimum_time import AT_STANDSTILL, DRIVEN, INERTIA, throughout, worst_ratios
from tests.oracles import fixed_root, pinocchio_model, tree_matrix

BOOM = Boom.load()
PATH = JointLine(BOOM.pose("transport"), BOOM.pose("phenotyping"))
ROUNDS = 9  # of both in turn, of which the best counts
PEER_SAMPLES = 5_001
MOST = {"time-optimal": 0.48, "jerk-limited": 0.25, "jerk bound": 2.3}
"""Share of the peer's time that a motion may take, checks not counted; 0.40, 0.20 and 1.9 were
seen."""
TIMINGS = {
    "time-optimal": Timing.of("time-optimal"),
    "jerk-limited": Timing.of("jerk-limited"),
    "jerk bound": Timing.of("time-optimal", jerk_bound=True),
}

States = tuple[Array, Array, Array]


def raised(boom: Boom) -> Boom:
    limits = boom.limits
    return replace(boom, limits=replace(limits, velocity=3.0 * limits.velocity, acceleration=10.0 * limits.acceleration))


BOOMS = {
    "10 kg": BOOM,
    "24 kg": BOOM.with_payload(24.0),
    "24 kg, joint limits raised": raised(BOOM.with_payload(24.0)),
}


@pytest.fixture(autouse=True)
def quiet() -> Iterator[None]:
    log = logging.getLogger("toppra")
    level = log.level
    log.setLevel(logging.ERROR)
    yield
    log.setLevel(level)


def ours(boom: Boom) -> Callable[[], Motion]:
    return lambda: Motion(PATH, time_optimal(boom, PATH))


def peers(boom: Boom) -> Callable[[], object]:
    """toppra on the tree without a free root, the drives' inertia added; joints without a drive get
    no limit to speak of."""
    model, G = fixed_root(pinocchio_model(boom)), tree_matrix(boom)
    data, rotors, torque = model.createData(), np.zeros(5), np.full(5, 1e6)
    rotors[DRIVEN], torque[DRIVEN] = INERTIA, AT_STANDSTILL
    back = np.ascontiguousarray(G.T)
    scheme = DiscretizationType.Interpolation

    def inverse_dynamics(q: Array, qd: Array, qdd: Array) -> Array:
        return back @ pinocchio.rnea(model, data, G @ q, G @ qd, G @ qdd) + rotors * qdd

    def both_ways(limit: Array) -> Array:
        return np.stack([-limit, limit], axis=-1)

    def run() -> object:
        constraints = [
            JointVelocityConstraint(both_ways(boom.limits.velocity)),
            JointAccelerationConstraint(both_ways(boom.limits.acceleration), discretization_scheme=scheme),
            JointTorqueConstraint(inverse_dynamics, both_ways(torque), np.zeros(5), discretization_scheme=scheme),
        ]
        path = toppra.SplineInterpolator([0.0, 1.0], np.stack([PATH.start, PATH.goal]))
        grid = np.linspace(0.0, 1.0, GRID_INTERVALS + 1)
        solver = TOPPRA(constraints, path, gridpoints=grid, parametrizer="ParametrizeConstAccel", solver_wrapper="seidel")
        return solver.compute_trajectory(0.0, 0.0)

    return run


METHODS = (ours, peers)


def peaks(boom: Boom, planned) -> dict[str, float]:
    if isinstance(planned, Motion):
        return worst_ratios(boom, *throughout(planned))
    t = np.linspace(0.0, planned.duration, PEER_SAMPLES)
    return worst_ratios(boom, *(planned(t, order) for order in range(3)))


@pytest.mark.benchmark(max_time=0.5)
@pytest.mark.parametrize("name", BOOMS)
@pytest.mark.parametrize("method", METHODS)
def test_time(benchmark, name, method):
    benchmark.group = f"time-optimal law, {name}"
    planned = benchmark(method(BOOMS[name]))
    benchmark.extra_info |= {"duration_s": planned.duration} | peaks(BOOMS[name], planned)


@pytest.mark.parametrize("name", BOOMS)
def test_planning_takes_no_longer_than_the_peers_and_keeps_what_that_breaks(name):
    """0.33 to 0.64 of the peer's time were seen."""
    boom, best, planned = BOOMS[name], dict.fromkeys(METHODS, np.inf), {}
    for _ in range(ROUNDS):
        for method in METHODS:
            run = method(boom)
            start = time.process_time()
            planned[method] = run()
            best[method] = min(best[method], time.process_time() - start)
    kept = {method: peaks(boom, planned[method]) for method in METHODS}
    for method in METHODS:
        ratios = ", ".join(f"{limit} {ratio:.4f}" for limit, ratio in kept[method].items())
        print(f"{name}: {method.__name__:5} {1e3 * best[method]:5.1f} ms, move {planned[method].duration:.4f} s, {ratios}")
    print(f"{name}: {best[ours] / best[peers]:.2f} of the peer's time")
    assert max(kept[ours].values()) <= 1.001
    assert kept[peers]["motor at standstill"] <= 1.001
    if boom is not BOOM:
        assert kept[peers]["motor on its curve"] > 1.5
    assert best[ours] < 0.8 * best[peers]


WHOLE = {
    "plan, time-optimal": (lambda: plan(BOOM, "transport", "phenotyping", profile="time-optimal"), 1.05),
    "plan, jerk-limited": (lambda: plan(BOOM, "transport", "phenotyping", profile="jerk-limited"), 0.85),
    "plan, time-optimal with jerk bound": (
        lambda: plan(BOOM, "transport", "phenotyping", profile=TimeOptimal(jerk_bound=True)),
        2.9,
    ),
    "plan_motion, time-optimal": (
        lambda: plan_motion(BOOM, MoveSpec.of("transport", "phenotyping", profile="time-optimal")),
        0.48,
    ),
}
"""What a user calls, certificate and checks included, and the most of the peer's time that it may
take."""


def test_a_whole_plan_takes_few_times_as_long_as_the_peers_law_alone():
    """0.85 to 0.95, 0.7, 2.4 and 0.4 of the peer's time were seen."""
    jobs = {"peer": (peers(BOOM), 1.0), **WHOLE}
    best = dict.fromkeys(jobs, np.inf)
    for _ in range(ROUNDS):
        for name, (run, _) in jobs.items():
            start = time.process_time()
            run()
            best[name] = min(best[name], time.process_time() - start)
    for name, (_, most) in jobs.items():
        ratio = best[name] / best["peer"]
        print(f"{name}: {1e3 * best[name]:.1f} ms, {ratio:.2f} of the peer's time")
        assert ratio <= most


def test_motions_of_the_main_move_take_their_share_of_the_peers_time_at_most():
    """Under 24 kg, where the drives decide, 4.4 was seen for both laws that keep the
    jerk limits."""
    runs = {name: lambda timing=timing: timed(BOOM, [PATH], timing, None) for name, timing in TIMINGS.items()}
    runs["peer"] = peers(BOOM)
    best = dict.fromkeys(runs, np.inf)
    for _ in range(2 * ROUNDS):
        for name, run in runs.items():
            start = time.process_time()
            run()
            best[name] = min(best[name], time.process_time() - start)
    shares = {name: best[name] / best["peer"] for name in TIMINGS}
    print(", ".join(f"{name} {share:.2f}" for name, share in shares.items()), "of the peer's time")
    for name, share in shares.items():
        assert share <= MOST[name], name
