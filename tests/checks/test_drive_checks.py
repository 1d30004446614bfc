"""Gearbox and motor rows by hand arithmetic, each on a motion made for it."""

from dataclasses import replace

import numpy as np
import pytest

from boom_model import Basis, Boom, Catalogue, Origin, Sourced, mesh_efficiency
from boom_model.drives.drive import motor_torque
from planner import Trajectory, Verdict, check
from planner.checks.drives.duty import Duty
from planner.checks.drives.gearbox import gearbox_rows
from planner.checks.drives.joint_view import Shock
from planner.checks.drives.motor import full_step_resonance, longest_dwell, motor_rows
from planner.checks.motion_checks import drive_rows
from tests.builders import joint_view, row

BOOM = Boom.load()
DRIVE = BOOM.drives[1]  # MST342C02 on CBG320160, at 80 V in parallel
GEAR, MOTOR = DRIVE.gearbox, DRIVE.motor
RPM = 2 * np.pi / 60
MINE = Origin(Basis.PRINTED, "this test")
RATED = replace(DRIVE, gearbox=replace(GEAR, rated_life=35_000 * 3600.0, rated_input_speed=2000 * RPM))
RANKS = (Verdict.PASS, Verdict.WARN, Verdict.FAIL)


# The gearbox


@pytest.mark.parametrize(
    ("tau", "rpm", "hours"),
    [
        (172.0, 2000.0, 7000.0),  # rated torque and speed: L10 = 35,000 h / 5
        (86.0, 2000.0, 56000.0),  # half the torque: 8 times as long
        (-172.0, -1000.0, 14000.0),  # half the speed: twice as long, whichever way
    ],
)
def test_life_by_hand(tau, rpm, hours):
    motion = joint_view(tau=tau, qd=rpm * RPM / 160)
    known = row(gearbox_rows(motion, RATED, None), "gearbox life")
    assert known.limit == pytest.approx(hours * 3600, rel=1e-12)
    assert known.verdict is Verdict.INFO  # nobody asks for a life
    guessed = row(gearbox_rows(motion, DRIVE, None), "gearbox life")
    assert guessed.limit == pytest.approx(hours * 3600, rel=1e-12)
    assert guessed.verdict is Verdict.NOT_CHECKABLE
    assert f"indicative L10 {hours:,.0f} h" in guessed.source


@pytest.mark.parametrize(("hours", "verdict"), [(6900.0, Verdict.PASS), (7100.0, Verdict.FAIL)])
def test_life_against_what_is_asked(hours, verdict):
    motion = joint_view(tau=172.0, qd=2000 * RPM / 160)
    asked = replace(motion, duty=replace(motion.duty, required_life=Sourced(hours * 3600.0, MINE)))
    found = row(gearbox_rows(asked, RATED, None), "gearbox life")
    assert (found.demand, found.verdict) == (hours * 3600.0, verdict)
    assert row(gearbox_rows(asked, DRIVE, None), "gearbox life").verdict is Verdict.NOT_CHECKABLE


def test_a_joint_that_rests_has_no_life_to_use_up():
    assert "gearbox life" not in [r.check for r in gearbox_rows(joint_view(tau=100.0), RATED, None)]


def test_average_speed_life_and_rms_count_pauses_and_average_torque_does_not():
    """1 s at 1 rad/s under 80 Nm, then 3 s of pause: a quarter of the speed, four times the life,
    half the RMS torque."""
    t = np.array([0.0, 1.0, 1.0 + 1e-9, 4.0])
    tau, qd = np.array([80.0, 80.0, 80.0, 80.0]), np.array([1.0, 1.0, 0.0, 0.0])
    paused = replace(Duty.alone(t), powered=np.array([True, True, False, False]))
    moving, whole = joint_view(tau=-80.0, qd=1.0), joint_view(tau=-tau, qd=qd, t=t, duty=paused)
    one, all_of_it = ([*gearbox_rows(v, RATED, None), *motor_rows(v, RATED)] for v in (moving, whole))
    ratios = {
        name: row(all_of_it, name).demand / row(one, name).demand
        for name in ("gearbox average", "gearbox average input speed", "motor RMS torque")
    }
    assert ratios == pytest.approx(
        {"gearbox average": 1.0, "gearbox average input speed": 0.25, "motor RMS torque": 0.5}, rel=1e-8
    )
    assert row(all_of_it, "gearbox life").limit == pytest.approx(4.0 * row(one, "gearbox life").limit, rel=1e-8)


def test_without_a_brake_a_pause_is_a_hold():
    t = np.array([0.0, 1.0])
    paused = Duty(Duty.alone(t).weight, np.array([False, False]))
    for brake, rms in ((DRIVE.brake, 0.0), (None, 0.5), (Sourced(False, MINE), 0.5)):
        rows = motor_rows(joint_view(tau=-80.0, duty=paused), replace(DRIVE, brake=brake))
        assert row(rows, "motor RMS torque").demand == pytest.approx(rms, rel=1e-12)


def test_rms_of_a_held_torque_is_its_share():
    """-80 Nm at 1 rad/s is braked: 80 / 160 = 0.5 Nm."""
    assert row(motor_rows(joint_view(tau=-80.0, qd=1.0), DRIVE), "motor RMS torque").demand == pytest.approx(0.5, rel=1e-12)


@pytest.mark.parametrize(("events", "verdict"), [(6200.0, Verdict.PASS), (6300.0, Verdict.FAIL), (None, Verdict.NOT_CHECKABLE)])
def test_number_of_shocks_by_hand(events, verdict):
    """10 rpm at the joint, 1600 rpm at the input, for 30 ms: 0.8 turns, 1e4 / 1.6 = 6250 times."""
    motion = joint_view(tau=500.0, qd=[10 * RPM, 99.0], t=[0.0, 1.0])
    shock = Shock(np.zeros((2, 5)), True, np.array([True, False]), 0.03, events)
    found = row(gearbox_rows(motion, DRIVE, shock), "gearbox momentary peaks")
    assert found.verdict is verdict
    assert found.limit == (None if events is None else pytest.approx(6250.0, rel=1e-12))
    assert events is not None or "allowed: 6250" in found.source


def test_a_shock_at_rest_counts_once():
    shock = Shock(np.zeros((2, 5)), True, np.array([True, True]), 0.03, 1.0)
    assert row(gearbox_rows(joint_view(tau=500.0), DRIVE, shock), "gearbox momentary peaks").limit == 1e4


@pytest.mark.parametrize(("inertia", "verdict"), [(26.4, Verdict.PASS), (26.6, Verdict.WARN)])
def test_resonance_by_hand(inertia, verdict):
    """8 Hz on 67 kNm/rad is 67e3 / (2 pi 8)^2 = 26.52 kg m^2; a guide, so that it warns and does
    not fail."""
    found = row(gearbox_rows(joint_view(inertia=inertia), DRIVE, None), "gearbox resonance")
    assert found.limit == pytest.approx(8.0 * np.sqrt(26.517 / inertia), rel=1e-4)
    assert (found.demand, found.verdict) == (8.0, verdict)


def test_wind_up_and_lost_motion_are_told():
    rows = list(gearbox_rows(joint_view(tau=-60.0), DRIVE, None))
    told = {name: row(rows, f"gearbox {name}").demand for name in ("wind-up", "backlash", "hysteresis")}
    assert told == pytest.approx({"wind-up": 29 / 67e3 + 31 / 110e3, "backlash": 24e-6, "hysteresis": 290e-6}, rel=1e-12)
    assert {r.verdict for r in rows if r.check in [f"gearbox {name}" for name in told]} == {Verdict.INFO}


@pytest.mark.parametrize(
    ("figure", "check_name"),
    [
        ("torsion_stiffness", "gearbox wind-up"),
        ("torsion_stiffness", "gearbox resonance"),
        ("backlash", "gearbox backlash"),
        ("hysteresis", "gearbox hysteresis"),
        ("max_average_input_speed", "gearbox average input speed"),
    ],
)
def test_a_missing_figure_is_not_checkable(figure, check_name):
    bare = replace(DRIVE, gearbox=replace(GEAR, **{figure: None}))
    assert row(gearbox_rows(joint_view(tau=60.0, qd=0.1), bare, None), check_name).verdict is Verdict.NOT_CHECKABLE


# The motor


def test_lifting_155_8_newton_metres_at_no_speed():
    """155.8 / (160 x 0.65) = 1.498 Nm, and 0.42 Nm without load: 1.918 Nm.

    Coulomb friction is lifted with it.
    """
    found = row(motor_rows(joint_view(static=-155.8), DRIVE), "motor torque, quasi-static")
    assert found.demand == pytest.approx(1.498 + 0.42, abs=5e-4)
    rough = row(motor_rows(joint_view(static=-145.8, coulomb=10.0), DRIVE), "motor torque, quasi-static")
    assert rough.demand == pytest.approx(found.demand, rel=1e-12)
    assert found.limit == 7.2


def test_the_other_reading_of_the_efficiency():
    """At 172 Nm both ask 172 / (160 x 0.65) = 1.654 Nm; so eta = 1.075 / (1.654 - 0.42) = 0.871.

    At 155.8 Nm: 1.538 Nm.
    """
    eta = mesh_efficiency(GEAR)
    assert eta == pytest.approx(0.871, abs=5e-4)
    assert 172 / (160 * eta) + 0.42 == pytest.approx(172 / (160 * 0.65), rel=1e-12)
    assert motor_torque(DRIVE, 155.8, 0.3, 0.0, no_load_in_efficiency=True) == pytest.approx(1.538, abs=5e-4)
    assert motor_torque(DRIVE, 155.8, -0.3, 0.0, no_load_in_efficiency=True) == pytest.approx(155.8 / 160, rel=1e-12)
    told = row(motor_rows(joint_view(tau=155.8, qd=0.3), DRIVE), "motor torque, other reading")
    assert told.demand == pytest.approx(155.8 / (160 * eta) + 0.42, rel=1e-12)
    assert told.verdict is Verdict.INFO


@pytest.mark.parametrize("change", [{"continuous_torque": None}, {"no_load_input_torque": 2.0}, {"no_load_input_torque": 0.7}])
def test_a_reading_that_no_mesh_allows_is_left_out(change):
    bare = replace(DRIVE, gearbox=replace(GEAR, **change))
    assert mesh_efficiency(bare.gearbox) is None
    assert "motor torque, other reading" not in [r.check for r in motor_rows(joint_view(tau=100.0, qd=0.1), bare)]


@pytest.mark.parametrize(
    ("part", "figure"),
    [("gearbox", "efficiency"), ("gearbox", "no_load_input_torque"), ("gearbox", "input_inertia"), ("motor", "rotor_inertia")],
)
def test_without_the_motors_torque_each_row_that_needs_it_is_not_checkable(part, figure):
    bare = replace(DRIVE, **{part: replace(getattr(DRIVE, part), **{figure: None})})
    motion = joint_view(tau=60.0, qd=[0.1, 0.2])
    known, unknown = ([r.check for r in motor_rows(motion, drive)] for drive in (DRIVE, bare))
    assert unknown == known
    for name in (
        "motor torque",
        "motor torque, reversed",
        "motor torque, quasi-static",
        "motor torque, other reading",
        "motor speed",
        "motor RMS torque",
    ):
        found = row(motor_rows(motion, bare), name)
        assert (found.verdict, found.limit) == (Verdict.NOT_CHECKABLE, None)
        assert found.demand == (pytest.approx(32.0) if name == "motor speed" else None)
        assert "efficiency, no-load torque or an inertia is not printed" in found.source


def test_a_motors_tolerance_stands_with_each_of_its_torques():
    plain = replace(DRIVE, motor=replace(MOTOR, tolerance=None))
    names = [
        "motor hold",
        "motor torque",
        "motor torque, reversed",
        "motor torque, quasi-static",
        "motor torque, other reading",
    ]
    for speed in (0.1, 2.0):  # by the running torque, and on the curve
        motion = joint_view(tau=10.0, qd=speed)
        for name in (*names, "motor speed", "motor RMS torque", "motor against gearbox"):
            assert "(sheet values +-10%)" in row(motor_rows(motion, DRIVE), name).source, name
            assert "sheet values" not in row(motor_rows(motion, plain), name).source


@pytest.mark.parametrize(("inertia", "verdict"), [(102.0, Verdict.PASS), (103.0, Verdict.WARN)])
def test_inertia_ratio_by_hand(inertia, verdict):
    """Ten times the rotor's 4e-4 kg m^2 is 10 x 4e-4 x 160^2 = 102.4 kg m^2 at the joint."""
    found = row(motor_rows(joint_view(inertia=inertia), DRIVE), "motor inertia ratio")
    assert found.demand == pytest.approx(10.0 * inertia / 102.4, rel=1e-12)
    assert found.verdict is verdict


def test_full_step_resonance_by_hand():
    """50 x 9.0 Nm on 5.76e-4 kg m^2: sqrt(781250) = 883.9 rad/s, 140.7 Hz; that many steps of 1.8
    deg are 42.2 rpm."""
    assert full_step_resonance(DRIVE) == pytest.approx(140.67, abs=5e-3)
    assert full_step_resonance(DRIVE) * MOTOR.step / RPM == pytest.approx(42.2, abs=0.05)
    assert full_step_resonance(replace(DRIVE, motor=replace(MOTOR, holding_torque=None))) is None


@pytest.mark.parametrize(("seconds", "verdict"), [(0.070, Verdict.PASS), (0.072, Verdict.WARN)])
def test_a_motor_that_dwells_in_resonance_is_warned_of(seconds, verdict):
    """Ten periods are 71.1 ms."""
    speed = 42.2 * RPM / 160
    t = np.array([0.0, 1.0, 1.0 + 1e-9, 1.0 + seconds, 1.0 + seconds + 1e-9, 3.0])
    motion = joint_view(qd=[0.0, 0.0, speed, speed, 0.0, 0.0], t=t)
    found = row(motor_rows(motion, DRIVE), "motor resonance dwell")
    assert found.demand == pytest.approx(seconds, abs=1e-6)
    assert found.at_s == pytest.approx(1.0, abs=1e-6)
    assert found.verdict is verdict


def test_dwell_of_ramps_is_exact_between_samples():
    """0 to 10 rad/s in 10 s, and back in 5: 2 to 5 rad/s takes 3 s on the way up."""
    t, speed = np.array([0.0, 10.0, 15.0]), np.array([0.0, 10.0, 0.0])
    assert longest_dwell(t, speed, 2.0, 5.0) == pytest.approx((3.0, 0.0), rel=1e-12)
    assert longest_dwell(t, speed, 8.0, 12.0)[0] == pytest.approx(3.0, rel=1e-12)  # over the top without a break
    assert longest_dwell(t, speed, 11.0, 12.0) == (0.0, None)
    assert longest_dwell(t[:1], speed[:1], 0.0, 1.0) == (0.0, None)


def test_the_motor_can_break_the_gearbox():
    """7.2 x 160 x 0.65 = 749 Nm; 460 Nm is passed at 4.42 Nm, with the better mesh at
    460 / (160 x 0.8713) + 0.42 = 3.72."""
    found = row(motor_rows(joint_view(), DRIVE), "motor against gearbox")
    assert (found.demand, found.limit, found.verdict) == (pytest.approx(748.8), 460.0, Verdict.WARN)
    assert "limit its current to 52% (4.9 A), 3.72 Nm at the motor" in found.source
    plain = replace(DRIVE, gearbox=replace(GEAR, continuous_torque=None))
    assert "4.42 Nm at the motor" in row(motor_rows(joint_view(), plain), "motor against gearbox").source
    weak = replace(DRIVE, motor=Catalogue.load().motors["MST340B02"])
    assert row(motor_rows(joint_view(), weak), "motor against gearbox").verdict is Verdict.PASS


@pytest.mark.parametrize(("part", "figure"), [("motor", "running_torque"), ("gearbox", "start_stop_torque")])
def test_overload_without_a_figure_is_not_checkable(part, figure):
    bare = replace(DRIVE, **{part: replace(getattr(DRIVE, part), **{figure: None})})
    assert row(motor_rows(joint_view(), bare), "motor against gearbox").verdict is Verdict.NOT_CHECKABLE


def test_a_warning_on_the_curve_is_not_hidden_by_a_sample_off_it():
    """On the curve 60 % to spare, an estimate's warning; off it, at 60 rpm, 55 %, a pass: the row
    warns."""
    fast, slow = 1500 * RPM / 160, 60 * RPM / 160
    curve = row(motor_rows(joint_view(tau=10.0, qd=fast), DRIVE), "motor torque").limit
    joint = [(available / (1.0 + spare) - 0.42) * 160 * 0.65 for available, spare in ((7.2, 0.55), (curve, 0.60))]
    found = row(motor_rows(joint_view(tau=joint, qd=[slow, fast]), DRIVE), "motor torque")
    assert found.verdict is Verdict.WARN
    assert found.margin == pytest.approx(0.60, abs=1e-9)


def test_90_degrees_in_2_seconds():
    """45 deg/s on average are 160 x 45 / 6 = 1200 rpm, a cubic's peak is half as much again; 1000
    rpm are 37.5 deg/s."""
    t = np.linspace(0.0, 2.0, 2001)
    rows = list(gearbox_rows(joint_view(tau=50.0, qd=np.radians(90.0) * (6 * t / 4 - 6 * t**2 / 8), t=t), DRIVE, None))
    assert row(rows, "gearbox average input speed").demand / RPM == pytest.approx(1200.0, rel=1e-6)
    assert row(rows, "gearbox input speed").demand / RPM == pytest.approx(1800.0, rel=1e-12)
    assert np.radians(37.5) * 160 / RPM == pytest.approx(1000.0, rel=1e-12)


# What holds of all of them


def test_more_torque_never_improves_a_verdict():
    """At no acceleration: against it, a drive's own inertia can be what its motor works at."""
    rng = np.random.default_rng(11)
    seen = set()
    for _ in range(40):
        t = np.sort(rng.uniform(0.0, 5.0, 60))
        tau, qd = rng.normal(0.0, 40.0, t.size), rng.normal(0.0, 0.4, t.size)
        worst: dict[str, int] = {}
        for factor in np.geomspace(0.3, 12.0, 12):
            for r in drive_rows(joint_view(tau=factor * tau, qd=qd, t=t), RATED):
                if r.verdict in RANKS:
                    rank = RANKS.index(r.verdict)
                    assert rank >= worst.get(r.check, 0), (r.check, factor)
                    worst[r.check] = rank
                    seen.add((r.check, r.verdict))
    for name in ("gearbox average", "gearbox hold", "motor hold", "motor torque", "motor torque, quasi-static", "motor speed"):
        assert {(name, Verdict.PASS), (name, Verdict.FAIL)} <= seen, name


@pytest.mark.parametrize("k", [0.5, 2.0, 3.0])
def test_scaling_time_scales_speeds_and_leaves_static_rows(k):
    rng = np.random.default_rng(12)
    t = np.linspace(0.0, 4.0, 200)
    q = np.radians([0.0, 60.0, 120.0, 0.0, 0.0]) + 0.2 * np.sin(t)[:, None] * rng.uniform(0.2, 1.0, 5)
    rates = np.gradient(q, t, axis=0), np.gradient(np.gradient(q, t, axis=0), t, axis=0)
    one = check(BOOM, Trajectory.from_samples(t, q, *rates))
    other = check(BOOM, Trajectory.from_samples(k * t, q, rates[0] / k, rates[1] / k**2))
    for mine, scaled in zip(one.rows, other.rows, strict=True):
        assert (mine.joint, mine.check) == (scaled.joint, scaled.check)
        if mine.check in ("velocity", "gearbox input speed", "gearbox average input speed", "drive top speed"):
            assert scaled.demand == pytest.approx(mine.demand / k, rel=1e-12)
        if mine.check in ("acceleration",):
            assert scaled.demand == pytest.approx(mine.demand / k**2, rel=1e-12)
        if mine.check in ("gearbox hold", "motor hold", "motor torque, quasi-static", "motor inertia ratio", "power-off hold"):
            assert scaled.demand == pytest.approx(mine.demand, rel=1e-12)


def test_the_motion_run_backwards_has_the_same_torque_and_the_opposite_power():
    t = np.linspace(0.0, 3.0, 400)
    q = np.radians([0.0, 60.0, 120.0, 0.0, 0.0]) + 0.3 * np.sin(t)[:, None] * np.array([1.0, 0.5, 0.7, 0.5, 0.2])
    qd, qdd = (0.3 * f[:, None] * np.array([1.0, 0.5, 0.7, 0.5, 0.2]) for f in (np.cos(t), -np.sin(t)))
    there = check(BOOM, Trajectory.from_samples(t, q, qd, qdd))
    back = check(BOOM, Trajectory.from_samples(t, q[::-1], -qd[::-1], qdd[::-1]))
    for joint in ("inner", "lower"):
        rows = [{r.check: r for r in report.rows if r.joint == joint} for report in (there, back)]
        for mine, theirs in (("motor torque", "motor torque, reversed"), ("motor torque, reversed", "motor torque")):
            assert rows[0][mine].demand == pytest.approx(rows[1][theirs].demand, rel=1e-9)
        for name in ("gearbox repeated peak", "gearbox average", "motor hold"):
            assert rows[0][name].demand == pytest.approx(rows[1][name].demand, rel=1e-9)
