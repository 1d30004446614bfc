"""The law of least copper loss against an independent convex program, the limits, and every other
profile."""

from dataclasses import replace

import cvxpy as cp
import numpy as np
import pytest

from boom_model import Boom, InfeasibleError, InputError, inverse_dynamics
from boom_model.drives.drive import reflected_inertia
from planner import LeastEnergy, MoveSpec, TimeOptimal, plan
from planner.missions.mission import load_mission, plan_cycle
from planner.paths.path import JointLine
from planner.suggestions import suggestions
from planner.timing.path_limits import load_ratio
from planner.timing.profile import SHORTEST
from planner.timing.profiles.least_energy import least_energy
from planner.timing.profiles.time_optimal import time_optimal
from planner.timing.time_law import Motion
from planner.timing.timing import Timing, timed
from tests.builders import motion_along, without_drives
from tests.limits import random_pairs

BOOM = Boom.load()
START, GOAL = BOOM.pose("transport"), BOOM.pose("phenotyping")
DRIVE = BOOM.drives[1]
YAW = without_drives(BOOM).with_drive("yaw", DRIVE)
"""The yaw alone has a motor: it holds no load."""
WEIGHTLESS = replace(BOOM, gravity=0.0)
ALL_THREE = BOOM.with_drive("yaw", DRIVE)
LOSS = 36.1 / 7.2**2 / 160**2
"""2 I^2 R / (T_run N)^2 of the fitted drive [W/Nm^2]."""


def torques(boom, q, qd, qdd):
    """Torque of each motor times N, without the gearbox's losses (n, m)."""
    tau = inverse_dynamics(boom, q, qd, qdd, reactions=False).tau
    known = [i for i, drive in enumerate(boom.drives) if drive]
    return tau[:, known] + reflected_inertia(DRIVE) * qdd[:, known]


def loss(boom, motion):
    """The copper loss of a motion [J], in time."""
    t = motion.times(6000)
    return np.trapezoid(LOSS * (torques(boom, *motion(t)[:3]) ** 2).sum(axis=1), t)


def independent(boom, path, duration, intervals=320):
    """Return the least loss [J] by CVXPY on midpoints, with the limits of the joints; those of the
    drives do not bind.

    Torques are inverse dynamics at the midpoint of each interval, where x is the mean of its ends.
    Time is in units of the duration, and torque in a unit near its mean.
    """
    s = (np.arange(intervals) + 0.5) / intervals
    p, p1, zero = path(s), path(s, 1), np.zeros((intervals, 5))
    held = torques(boom, p, zero, zero)
    pushed = (torques(boom, p, zero, p1) - held) / duration**2
    carried = (torques(boom, p, p1, path(s, 2)) - held) / duration**2
    unit = np.abs(pushed).mean() * 3.0
    x, e = cp.Variable(intervals + 1), cp.Variable(intervals)
    mean, u = (x[1:] + x[:-1]) / 2.0, (x[1:] - x[:-1]) * intervals / 2.0
    root = (cp.sqrt(x[1:]) + cp.sqrt(x[:-1])) / 2.0
    w = cp.Variable(intervals)
    fastest = (boom.limits.velocity / np.abs(p1).max(axis=0)).min() * duration
    hardest = (boom.limits.acceleration / np.abs(p1).max(axis=0)).min() * duration**2
    conditions = [x[0] == 0.0, x[-1] == 0.0, x <= fastest**2, cp.abs(u) <= hardest, w <= root]
    conditions.append(cp.sum(cp.inv_pos(w)) / intervals <= 1.0)
    rows = [cp.multiply(pushed[:, j], u) + cp.multiply(carried[:, j], mean) + held[:, j] for j in range(held.shape[1])]
    conditions.append(cp.SOC(e + w, cp.vstack([*(2.0 / unit * q for q in rows), e - w])))
    problem = cp.Problem(cp.Minimize(cp.sum(e) / intervals), conditions)
    problem.solve(solver=cp.CLARABEL, tol_gap_rel=1e-5, tol_gap_abs=1e-5, tol_feas=1e-5)
    assert problem.status == "optimal"
    largest = max(np.abs(q.value).max() for q in rows)
    assert largest < 400.0  # the drives allow more
    return float(problem.value) * unit**2 * LOSS * duration


@pytest.mark.parametrize("duration", [5.0, 6.0, 12.0])
@pytest.mark.parametrize("boom", [YAW, WEIGHTLESS], ids=["yaw", "weightless"])
def test_the_loss_is_that_of_an_independent_program(boom, duration):
    path = JointLine(START, GOAL)
    found = loss(boom, Motion(path, least_energy(boom, path, duration)))
    assert found == pytest.approx(independent(boom, path, duration), rel=1e-3)


def test_without_load_and_limits_the_law_is_a_parabola_of_speed():
    """One joint, constant inertia: int qdd^2 dt is least for a cubic, 12 J^2 q^2 / T^3; limits do
    not bind in 20 s."""
    boom = YAW
    start, goal = np.array([0.0, 0.6, 2.4, 0.3, 0.0]), np.array([1.0, 0.6, 2.4, 0.3, 0.0])
    path = JointLine(start, goal)
    inertia = inverse_dynamics(boom, start, np.zeros(5), np.eye(5)[0], reactions=False).tau[0]
    inertia -= inverse_dynamics(boom, start, np.zeros(5), np.zeros(5), reactions=False).tau[0]
    exact = LOSS * 12.0 * (inertia + reflected_inertia(DRIVE)) ** 2 / 20.0**3
    motion = Motion(path, least_energy(boom, path, 20.0))
    assert motion.duration == pytest.approx(20.0, rel=1e-9)
    assert loss(boom, motion) == pytest.approx(exact, rel=5e-4)
    t = np.linspace(0.0, 20.0, 50)
    np.testing.assert_allclose(motion(t)[0][:, 0], 3.0 * (t / 20.0) ** 2 - 2.0 * (t / 20.0) ** 3, atol=2e-3)


@pytest.mark.parametrize("boom", [BOOM, YAW, WEIGHTLESS, ALL_THREE], ids=["fitted", "yaw", "weightless", "three"])
def test_no_other_profile_of_that_duration_loses_less(boom):
    rng = np.random.default_rng(7)
    checked = 0
    for start, goal in random_pairs(boom, 6, seed=3):
        path = JointLine(start, goal)
        duration = float(rng.choice([1.02, 1.5, 3.0])) * time_optimal(boom, path).duration
        least = motion_along(boom, path, Timing.of("least-energy", duration=duration))
        assert least.duration <= duration * (1 + 1e-9)
        q, qd, qdd, _ = least(least.times(4000))
        tau = inverse_dynamics(boom, q, qd, qdd, friction=True, reactions=False).tau
        assert load_ratio(boom, tau, qd, qdd).max() <= 1.001
        assert (np.abs(qd) / boom.limits.velocity).max() <= 1.001
        assert (np.abs(qdd) / boom.limits.acceleration).max() <= 1.001
        for word in SHORTEST:
            try:
                other = motion_along(boom, path, Timing.of(word, duration=duration))
            except InfeasibleError:
                continue
            assert loss(boom, least) <= loss(boom, other) * (1 + 2e-4), word
            checked += 1
    assert checked >= 20


def test_a_load_that_is_held_makes_haste_and_the_plan_says_so():
    move = plan(BOOM, "transport", "phenotyping", profile="least-energy", duration=8.0)
    assert move.report.duration == pytest.approx(
        plan(BOOM, "transport", "phenotyping", profile=TimeOptimal()).report.duration, rel=1e-3
    )
    assert any("the copper loss is least in 4.33" in note for note in move.report.notes)
    unhurried = plan(YAW, "transport", "phenotyping", profile="least-energy", duration=8.0)
    assert unhurried.report.duration == pytest.approx(8.0, rel=1e-9)
    assert not any("copper loss" in note for note in unhurried.report.notes)
    assert not unhurried.report.certificate.broken


def test_a_move_of_several_legs_shares_the_duration():
    move = plan(YAW, "transport", "phenotyping", via=["q=40,60,120,0.3,0"], profile="least-energy", duration=14.0, rate=50.0)
    assert len(move.motions) == 2
    assert move.report.duration == pytest.approx(14.0, abs=0.05)
    assert all(abs(motion.duration * 50.0 - round(motion.duration * 50.0)) < 1e-6 for motion in move.motions)


def test_along_a_spline_the_limits_are_kept():
    via = np.array([0.7, 1.05, 2.1, 0.3, 0.0])
    move = plan(YAW, "transport", "phenotyping", via=[via], stop_at_via=False, profile="least-energy", duration=9.0)
    assert move.report.duration == pytest.approx(9.0, rel=2e-3)
    assert max(worst.ratio for worst in move.report.certificate.worst) <= 1.001


def test_a_mission_takes_the_profile(tmp_path):
    file = tmp_path / "least.toml"
    file.write_text(
        'name = "least"\nbasis = "assumed"\nsource = "a test"\nstart = "transport"\n'
        '[[steps]]\nto = "phenotyping"\nprofile = "least-energy"\nduration_s = 9\n'
    )
    assert plan_cycle(YAW, load_mission(str(file))).duty.duration == pytest.approx(9.0)


def test_a_duration_that_is_too_short_has_a_longer_one_as_its_fix():
    spec = MoveSpec.of("transport", "phenotyping", profile="least-energy", duration=3.0)
    fixes = {fix.change: fix.sentence for fix in suggestions(BOOM, spec)}
    assert fixes["duration"].startswith("a duration of 4.3")


def test_bad_requests_are_refused():
    with pytest.raises(InputError, match="the least-energy profile needs a duration"):
        plan(BOOM, "transport", "phenotyping", profile="least-energy")
    with pytest.raises(InputError, match="needs a duration"):
        LeastEnergy().law(BOOM, JointLine(START, GOAL))
    with pytest.raises(InfeasibleError, match="duration 3 s is too short"):
        plan(BOOM, "transport", "phenotyping", profile="least-energy", duration=3.0)
    with pytest.raises(InfeasibleError, match=r"too short: the path takes at least 4\.333"):
        least_energy(BOOM, JointLine(START, GOAL), 4.0)
    with pytest.raises(InputError, match="no joint has a motor with wiring"):
        timed(without_drives(BOOM), [JointLine(START, GOAL)], Timing.of("least-energy", duration=9.0), None)
