"""Missions against the moves they are made of, and against one long motion without weights."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from boom_model import Boom, InfeasibleError, InputError, forward_kinematics
from planner import Cubic, Trajectory, Verdict, check, plan
from planner.missions.mission import check_cycle, load_mission, named_missions, plan_cycle
from planner.motion.trajectory import concatenate
from planner.motion.vehicle import load_case
from planner.planning import torques
from planner.timing.profile import SHORTEST
from planner.timing.travel_mean import average_torque
from tests.builders import main_move, planned_mission, row, without_drives

BOOM = Boom.load()
HEAD = 'name = "mine"\nbasis = "assumed"\nsource = "this test"\nstart = "transport"\n'
THERE_AND_BACK = """
[[steps]]
to = "phenotyping"
profile = "jerk-limited"

[[steps]]
repeat = 3

[[steps.steps]]
hold_s = 4

[[steps.steps]]
to = "transport"

[[steps.steps]]
pause_s = 6

[[steps.steps]]
to = "phenotyping"
"""


@pytest.fixture
def mission(tmp_path):
    """A mission of the given steps, head lines before them."""

    def write(steps, head=HEAD):
        file = tmp_path / "mine.toml"
        file.write_text(head + steps)
        return load_mission(str(file))

    return write


def test_samples_of_a_move_are_the_move(mission):
    """A motion as samples has the move's loads; it must start where the step before ends."""
    move = main_move("quintic")
    motion = move.trajectory
    rows = [[float(x) for x in row] for row in np.column_stack([motion.t, motion.q])[::5]]
    rows += [] if len(motion.t) % 5 == 1 else [[float(motion.t[-1]), *map(float, motion.q[-1])]]
    (leg,) = plan_cycle(BOOM, mission(f"[[steps]]\nmotion = {rows}\n")).legs
    assert leg.trajectory.duration == pytest.approx(motion.duration)
    at = np.searchsorted(motion.t, leg.trajectory.t - 1e-9)
    assert leg.trajectory.qd == pytest.approx(motion.qd[at], abs=1e-4)
    assert torques(BOOM, leg.trajectory) == pytest.approx(torques(BOOM, motion)[at], abs=0.5)
    with pytest.raises(InfeasibleError, match="the motion does not start where the previous step ends"):
        plan_cycle(BOOM, mission(f'[[steps]]\nto = "phenotyping"\n\n[[steps]]\nmotion = {rows}\n'))


@pytest.mark.parametrize("profile", list(SHORTEST))
def test_a_mission_of_one_move_is_the_move(mission, profile):
    move = main_move(profile)
    cycle = plan_cycle(BOOM, mission(f'[[steps]]\nto = "phenotyping"\nprofile = "{profile}"\n'))
    report = check_cycle(BOOM, cycle)
    assert report.rows == move.report.rows
    assert report.duration == pytest.approx(move.report.duration, rel=1e-12)


def test_a_cycle_is_one_long_motion_without_weights(mission):
    """Every leg written out end to end, in order, and integrated without a weight."""
    cycle = plan_cycle(BOOM, mission(THERE_AND_BACK))
    assert [leg.label for leg in cycle.legs] == ["to phenotyping", "hold", "to transport", "pause", "to phenotyping"]
    assert cycle.counts.tolist() == [1, 3, 3, 3, 3]
    whole = concatenate([cycle.legs[i].trajectory for i in cycle.order])
    assert cycle.duty.duration == pytest.approx(whole.duration, rel=1e-12)
    assert whole.duration == pytest.approx(4.8333 + 3 * (4 + 5 + 6 + 5), abs=1e-3)
    tau, rows = torques(BOOM, whole), check_cycle(BOOM, cycle).rows
    for i, joint in ((1, "inner"), (2, "lower")):
        found = {row.check: row.demand for row in rows if row.joint == joint}
        assert found["gearbox average"] == pytest.approx(average_torque(whole.t, tau[:, i], whole.qd[:, i]), rel=1e-9)
        speed = 160 * np.trapezoid(np.abs(whole.qd[:, i]), whole.t) / whole.duration
        assert found["gearbox average input speed"] == pytest.approx(speed, rel=1e-9)
        assert found["gearbox repeated peak"] == pytest.approx(np.abs(tau[:, i]).max(), rel=1e-12)
    squared = 0.0
    for each in (cycle.legs[i].trajectory for i in cycle.order):
        squared += np.trapezoid(torques(BOOM, each)[:, 0] ** 2, each.t)
    yaw = next(row.demand for row in rows if (row.joint, row.check) == ("yaw", "drive RMS torque"))
    assert yaw == pytest.approx(np.sqrt(squared / whole.duration), rel=1e-9)


def test_a_pause_takes_its_motors_share_of_the_rms_torque_alone(mission):
    """Standing stretched out 4 s with the motor on and 12 s with it off: half the RMS torque of
    standing with it on."""
    demands = []
    for steps in ("[[steps]]\nhold_s = 4\n", "[[steps]]\nhold_s = 4\n[[steps]]\npause_s = 12\n"):
        standing = mission(steps, HEAD.replace("transport", "phenotyping"))
        rows = check_cycle(BOOM, plan_cycle(BOOM, standing)).rows
        demands.append({row.check: row.demand for row in rows if row.joint == "lower"})
    assert demands[1]["motor RMS torque"] == pytest.approx(demands[0]["motor RMS torque"] / 2, rel=1e-12)
    for name in ("gearbox hold", "motor hold", "power-off hold"):
        assert demands[1][name] == demands[0][name]


def test_doing_it_again_changes_no_mean(mission):
    cycle = plan_cycle(BOOM, mission(THERE_AND_BACK))
    again = replace(cycle, order=cycle.order + cycle.order)
    for one, other in zip(check_cycle(BOOM, cycle).rows, check_cycle(BOOM, again).rows, strict=True):
        assert (one.joint, one.check, one.verdict) == (other.joint, other.check, other.verdict)
        if one.demand is not None:
            assert other.demand == pytest.approx(one.demand, rel=1e-12)


def test_legs_go_on_from_each_other(mission):
    for name in named_missions():
        cycle = planned_mission(name)
        ends = [(cycle.legs[i].trajectory.q[0], cycle.legs[i].trajectory.q[-1]) for i in cycle.order]
        for (_, end), (start, _) in pairwise(ends):
            np.testing.assert_allclose(start, end, rtol=0, atol=1e-8)
        for leg in cycle.legs:
            np.testing.assert_allclose(leg.trajectory.qd[[0, -1]], 0.0, atol=1e-9)


def test_the_field_day_sweeps_its_plots():
    cycle = planned_mission("field-day")
    sweeps = {leg.label: (n, leg) for leg, n in zip(cycle.legs, cycle.counts, strict=True) if "line" in leg.label}
    assert {n for n, _ in sweeps.values()} == {20}
    for _, leg in sweeps.values():
        tip = forward_kinematics(BOOM, leg.trajectory.q).position
        np.testing.assert_allclose(tip[:, 1:], [[1.7, 0.9]] * len(tip), rtol=0, atol=1e-5)
        assert np.ptp(tip[:, 0]) == pytest.approx(2.0, abs=1e-6)
    assert cycle.duty.duration > 3600.0
    assert not cycle.duty.powered.all()
    report = check_cycle(BOOM, cycle)
    assert report.verdict is Verdict.INCOMPLETE
    assert "20 x to tip=1,1.7,0.9 along line" in " ".join(report.notes)
    assert "the mission: 40 plots" in report.assumptions[0]


def test_a_step_takes_the_cubics_velocity_at_its_way_point(mission):
    velocity = "4,-3,5,0.02,1"
    steps = f'[[steps]]\nto = "phenotyping"\nvia = ["q=40,60,120,0.3,0"]\nvia_velocity = ["{velocity}"]\n'
    cycle = plan_cycle(BOOM, mission(steps))
    via = np.array([*np.radians([40.0, 60.0, 120.0]), 0.3, 0.0])
    rates = np.array([*np.radians([4.0, -3.0, 5.0]), 0.02, np.radians(1.0)])
    motion = cycle.legs[0].trajectory
    at = int(np.abs(motion.q - via).max(axis=1).argmin())
    np.testing.assert_allclose(motion.qd[at], rates, rtol=0, atol=3e-4)
    move = plan(BOOM, "transport", "phenotyping", via=[via], profile=Cubic.with_velocities([rates]))
    assert check_cycle(BOOM, cycle).rows == move.report.rows


@pytest.mark.parametrize(("name", "duration"), [("table-2-4", 10.0), ("table-3-1", 5.0)])
def test_the_thesis_moves_are_missions(name, duration):
    cycle = plan_cycle(BOOM, load_mission(name))
    assert cycle.duty.duration == pytest.approx(duration, rel=1e-12)
    assert "does not end where it starts" in " ".join(cycle.notes)


@pytest.mark.parametrize(("joint", "by_hand"), [("inner", 102.0), ("lower", 105.3)])
def test_average_torque_of_table_2_4(joint, by_hand):
    """The thesis's load: the payload as a force."""
    rows = check_cycle(BOOM, planned_mission("table-2-4"), payload_as="force").rows
    assert row(rows, "gearbox average", joint).demand == pytest.approx(by_hand, abs=0.05)


@pytest.mark.parametrize("k", [1.5, 4.0])
def test_a_stretched_cycle_moves_slower_and_stands_as_long(mission, k):
    cycle = plan_cycle(BOOM, mission(THERE_AND_BACK))
    slower = cycle.stretched(k)
    assert slower.duty.duration == pytest.approx(cycle.duty.duration + (k - 1) * (4.8333 + 3 * 10), abs=5e-3)
    np.testing.assert_allclose(slower.trajectory.qd, cycle.trajectory.qd / k, rtol=1e-12)
    np.testing.assert_allclose(slower.trajectory.qdd, cycle.trajectory.qdd / k**2, rtol=1e-12)
    own = slower.legs[0].trajectory
    np.testing.assert_allclose(np.gradient(own.q, own.t, axis=0)[1:-1], own.qd[1:-1], atol=1e-4)


def test_life_and_tolerance_are_asked_for_in_the_file(mission):
    head = HEAD + "required_life_h = 500\ntip_tolerance_mm = 4\n"
    cycle = plan_cycle(BOOM, mission('[[steps]]\nto = "phenotyping"\n', head))
    rows = check_cycle(BOOM, cycle).rows
    assert row(rows, "gearbox life", "inner").demand == 500 * 3600.0
    tip = row(rows, "deflection in all", "tip")
    assert (tip.limit, tip.verdict) == (0.004, Verdict.FAIL)  # 4.5 mm of it are known already
    wider = replace(cycle.duty, tip_tolerance=replace(cycle.duty.tip_tolerance, value=0.006))
    full = replace(BOOM, drives=(BOOM.drives[1],) * 5)
    booms = (
        (BOOM, Verdict.NOT_CHECKABLE),  # three joints have no drive, and may deflect too
        (full, Verdict.PASS),
        (without_drives(BOOM), Verdict.NOT_CHECKABLE),
    )
    for boom, verdict in booms:
        assert row(check(boom, cycle.trajectory, duty=wider).rows, "deflection in all", "tip").verdict is verdict


def test_a_step_to_where_it_stands_moves_nothing(mission):
    cycle = plan_cycle(BOOM, mission('[[steps]]\nto = "transport"\n[[steps]]\nhold_s = 1\n'))
    assert [leg.label for leg in cycle.legs] == ["hold"]
    with pytest.raises(InputError, match="it has no move, no hold and no pause"):
        plan_cycle(BOOM, mission('[[steps]]\nto = "transport"\n'))


@pytest.mark.parametrize(
    ("steps", "said"),
    [
        ("[[steps]]\n", "one of to, hold_s, pause_s, motion and repeat; this one has none"),
        ('[[steps]]\nto = "transport"\nhold_s = 1\n', "this one has to, hold_s"),
        ("[[steps]]\nhold_s = 1\nduration_s = 2\n", "a step with hold_s takes no duration_s"),
        ("[[steps]]\nrepeat = 2\n", "a step with repeat needs steps of its own"),
        ("[[steps]]\nrepeat = 0\n", "key steps.0.repeat"),
        ("[[steps]]\npause_s = -1\n", "key steps.0.pause_s"),
        ("[[steps]]\nhold_s = nan\n", "key steps.0.hold_s"),
        ("[[steps]]\nhold_s = 1\ncolour = 3\n", "key steps.0.colour is not known"),
        ("steps = []\n", "key steps"),
        ("[[steps]]\nmotion = [[0, 1, 2]]\n", "key steps.0.motion"),
    ],
)
def test_a_bad_mission_names_file_and_key(mission, steps, said):
    with pytest.raises(InputError, match=r"mine\.toml") as error:
        mission(steps)
    assert said in str(error.value)


@pytest.mark.parametrize(
    ("steps", "kind", "said"),
    [
        ('[[steps]]\nto = "nowhere"\n', InputError, "mission mine, steps 1: unknown pose 'nowhere'"),
        (
            '[[steps]]\nhold_s = 1\n[[steps]]\nto = "phenotyping"\nduration_s = 1\n',
            InfeasibleError,
            "mission mine, steps 2: duration",
        ),
        ('[[steps]]\nto = "phenotyping"\nprofile = "fast"\n', InputError, "steps 1: unknown profile 'fast'"),
        ('[[steps]]\nto = "phenotyping"\nvia_velocity = ["1,2"]\n', InputError, "steps 1: "),
        ('[[steps]]\nto = "phenotyping"\nvia_velocity = ["1,2,3,0,0"]\n', InputError, "via velocity: 1 given for 0 via"),
        ('[[steps]]\nrepeat = 1\n[[steps.steps]]\nto = "tip=9,0,0"\n', InfeasibleError, "steps 1, steps 1: tip"),
        ('[[steps]]\nto = "tip=1.4,0,1.0"\nalong = "line"\n', InfeasibleError, "steps 1: "),
        ("[[steps]]\nrepeat = 100001\n[[steps.steps]]\nhold_s = 1\n", InputError, "more than 100,000 steps"),
    ],
)
def test_a_step_that_cannot_be_done_is_named(mission, steps, kind, said):
    with pytest.raises(kind) as error:
        plan_cycle(BOOM, mission(steps))
    assert said in str(error.value)


TILTED = 'pitch = "-60"\nconstraint = "extension=0.6"\n'


@pytest.mark.parametrize("along", ["joint", "line"])
def test_pitch_and_constraint_of_a_mission_are_those_of_its_steps(tmp_path, along):
    steps = f'[[steps]]\nto = "tip=-0.5,1.6,1.0"\nalong = "{along}"\n'
    head = 'name = "tilted"\nbasis = "assumed"\nsource = "this test"\nstart = "tip=0.5,1.6,1.0"\n'
    (tmp_path / "m.toml").write_text(head + TILTED + steps)
    cycle = plan_cycle(BOOM, load_mission(str(tmp_path / "m.toml")))
    q = cycle.trajectory.q[[0, -1]]
    tip = forward_kinematics(BOOM, q)
    np.testing.assert_allclose(tip.position, [[0.5, 1.6, 1.0], [-0.5, 1.6, 1.0]], rtol=0, atol=1e-9)
    np.testing.assert_allclose(np.degrees(tip.pitch), -60.0, rtol=0, atol=1e-7)
    np.testing.assert_allclose(q[:, 3], 0.6, rtol=0, atol=1e-9)


def test_a_step_may_have_a_pitch_and_a_constraint_of_its_own(tmp_path):
    steps = '[[steps]]\nto = "tip=-0.5,1.6,1.0"\npitch = "-45"\nconstraint = "extension=0.7"\n'
    head = 'name = "tilted"\nbasis = "assumed"\nsource = "this test"\nstart = "tip=0.5,1.6,1.0"\n'
    (tmp_path / "m.toml").write_text(head + TILTED + steps)
    q = plan_cycle(BOOM, load_mission(str(tmp_path / "m.toml"))).trajectory.q
    np.testing.assert_allclose(q[[0, -1], 3], [0.6, 0.7], rtol=0, atol=1e-9)
    np.testing.assert_allclose(np.degrees(forward_kinematics(BOOM, q[[0, -1]]).pitch), [-60.0, -45.0], rtol=0, atol=1e-7)


def test_a_line_from_another_branch_is_refused(mission):
    steps = '[[steps]]\nto = "tip=1,1.7,0.9"\nconstraint = "extension=0.6"\n[[steps]]\nto = "tip=-1,1.7,0.9"\nalong = "line"\n'
    with pytest.raises(
        InfeasibleError, match=r"steps 2: the line does not start at the joint position .* same pitch and constraint"
    ):
        plan_cycle(BOOM, mission(steps))


def test_a_mission_stands_on_a_slope_at_most(mission):
    standing = mission("[[steps]]\nhold_s = 1\n")
    slope = load_case("slope")
    report = check_cycle(BOOM, plan_cycle(BOOM, standing, slope), vehicle=slope)
    assert "vehicle case slope" in " ".join(report.notes)
    assert row(report.rows, "drive worst hold").demand > 1.0
    for case in ("track", "shock"):
        with pytest.raises(InputError, match=f"vehicle case {case}: a mission can be on a slope only"):
            plan_cycle(BOOM, standing, load_case(case))


def test_an_unknown_mission_lists_those_there_are():
    with pytest.raises(InputError, match=r"unknown mission 'holiday'; there are: field-day, table-2-4, table-3-1, or a FILE"):
        load_mission("holiday")


def test_means_of_random_weights_are_those_of_repeated_samples():
    """A sample of weight 3 is the sample three times."""
    from planner.checks.drives.duty import Duty

    rng = np.random.default_rng(3)
    load, rate, times = rng.normal(size=50), rng.normal(size=50), rng.integers(1, 6, 50)
    duty = Duty(times.astype(float), np.ones(50, dtype=bool))
    load_n, rate_n = np.repeat(load, times), np.abs(np.repeat(rate, times))
    assert duty.mean(load) == pytest.approx(load_n.mean(), rel=1e-12)
    cube = (rate_n @ np.abs(load_n) ** 3 / rate_n.sum()) ** (1 / 3)
    assert duty.travel_mean(load, rate) == pytest.approx(cube, rel=1e-12)
    alone = Trajectory.from_samples([0.0], np.zeros((1, 5)), np.zeros((1, 5)), np.zeros((1, 5)))
    assert Duty.alone(alone.t).mean(np.array([7.0])) == 7.0


@pytest.mark.parametrize(
    ("steps", "limited"),
    [
        (THERE_AND_BACK, True),
        ('[[steps]]\nto = "phenotyping"\n', False),
        ('[[steps]]\nrepeat = 2\n[[steps.steps]]\nto = "phenotyping"\nprofile = "time-optimal"\njerk_bound = true\n', True),
    ],
)
def test_a_mission_knows_whether_it_is_held_to_the_jerk_limits(mission, steps, limited):
    assert mission(steps).jerk_limited is limited
