"""Rows of a servo motor by hand: RMS within the continuous torque, peak within the peak torque."""

from dataclasses import replace

import numpy as np
import pytest

from boom_model import Basis, Boom, Catalogue, Drive, Origin, Sourced
from boom_model.drives.drive import available_torque, motor_limit, speed_for_torque
from planner import Verdict
from planner.checks.drives.duty import Duty
from planner.checks.drives.gearbox import gearbox_rows
from planner.checks.drives.joint_view import Shock
from planner.checks.drives.motor import motor_rows
from planner.checks.motion_checks import drive_rows
from tests.builders import joint_view, row

BOOM = Boom.load()
MOTOR = Catalogue.load().motors["SGM7J-04A"]  # 1.27 and 4.46 Nm, 3000 and 6000 rpm, 0.486e-4 kg m^2
DRIVE = Drive(MOTOR, BOOM.drives[1].gearbox, None, None)  # 160, 65 %, 0.42 Nm without load
RPM = 2 * np.pi / 60
SLOW = 1000 * RPM / 160
MINE = Origin(Basis.PRINTED, "this test")


def with_motor(**changes):
    return replace(DRIVE, motor=replace(MOTOR, **changes))


def driving(torque):
    """The joint torque that the motor's torque drives at constant speed."""
    return (torque - 0.42) * 160 * 0.65


def test_the_torque_falls_above_the_rated_speed():
    speeds = np.array([0.0, -3000.0, 3000.1, 4500.0, 6000.0, 6001.0]) * RPM
    expected = [4.46, 4.46, 1.27 * 3000 / 3000.1, 1.27 * 3000 / 4500, 1.27 / 2, 0.0]
    np.testing.assert_allclose(available_torque(DRIVE, speeds), expected, rtol=1e-12)
    assert available_torque(with_motor(max_speed=None), 9000 * RPM) == pytest.approx(1.27 / 3)
    assert motor_limit(DRIVE, 0.0) == pytest.approx((4.46 - 0.42) * 160 * 0.65)  # without a stepper's margin
    assert speed_for_torque(DRIVE, 1.0) is None
    for name in ("rated_torque", "peak_torque", "rated_speed"):
        assert available_torque(with_motor(**{name: None}), 0.0) is None
        assert motor_limit(with_motor(**{name: None}), 0.0) is None


@pytest.mark.parametrize(("torque", "verdict"), [(4.45, Verdict.PASS), (4.47, Verdict.FAIL)])
def test_the_peak_is_held_against_the_peak_torque(torque, verdict):
    found = row(motor_rows(joint_view(tau=driving(torque), qd=SLOW), DRIVE), "servo torque")
    assert found.demand == pytest.approx(torque, rel=1e-12)
    assert (found.limit, found.required_margin, found.verdict) == (4.46, 0.0, verdict)


@pytest.mark.parametrize(("share", "verdict"), [(0.161, Verdict.PASS), (0.163, Verdict.FAIL)])
def test_the_rms_is_held_against_the_continuous_torque(share, verdict):
    """3.15 Nm for a share of the time, else nothing: at most 1.27^2 / 3.15^2 = 0.1625 of it."""
    t = np.array([0.0, share, share + 1e-9, 1.0])
    tau = driving(np.array([3.15, 3.15, 0.42, 0.42]))
    rested = replace(Duty.alone(t), powered=np.array([True, True, False, False]))
    view = joint_view(tau=tau, qd=[SLOW, SLOW, 0.0, 0.0], t=t, duty=rested)
    braked = replace(DRIVE, brake=Sourced(True, MINE))
    found = row(motor_rows(view, braked), "servo RMS torque")
    assert found.demand == pytest.approx(3.15 * share**0.5, rel=1e-6)
    assert (found.limit, found.verdict) == (1.27, verdict)
    assert row(motor_rows(view, braked), "servo torque").verdict is Verdict.PASS


def test_without_a_brake_a_pause_is_a_hold():
    paused = Duty(Duty.alone(np.array([0.0, 1.0])).weight, np.array([False, False]))
    for brake, rms in ((Sourced(True, MINE), 0.0), (None, 0.5)):
        rows = motor_rows(joint_view(tau=-80.0, duty=paused), replace(DRIVE, brake=brake))
        assert row(rows, "servo RMS torque").demand == pytest.approx(rms, rel=1e-12)


@pytest.mark.parametrize(("torque", "verdict"), [(203.0, Verdict.PASS), (204.0, Verdict.FAIL)])
def test_a_hold_is_held_against_the_continuous_torque(torque, verdict):
    """1.27 Nm on 160 hold 203.2 Nm, without help from friction."""
    found = row(motor_rows(joint_view(static=torque), DRIVE), "servo hold")
    assert (found.limit, found.verdict) == (1.27, verdict)


@pytest.mark.parametrize(
    ("rpm", "torque", "speed"),
    [
        (2990.0, Verdict.PASS, Verdict.PASS),
        (3010.0, Verdict.NOT_CHECKABLE, Verdict.PASS),
        (6010.0, Verdict.NOT_CHECKABLE, Verdict.FAIL),
    ],
)
def test_above_the_rated_speed_the_torque_is_not_checkable(rpm, torque, speed):
    rows = list(motor_rows(joint_view(tau=20.0, qd=rpm * RPM / 160), DRIVE))
    for name in ("servo torque", "servo torque, reversed", "servo RMS torque"):
        assert row(rows, name).verdict is torque, name
    assert row(rows, "servo speed").verdict is speed


def test_too_much_torque_fails_at_any_speed():
    found = row(motor_rows(joint_view(tau=driving(5.0), qd=4000 * RPM / 160), DRIVE), "servo torque")
    assert found.verdict is Verdict.FAIL


def test_a_largest_speed_is_not_needed_below_the_rated_one():
    for rpm, verdict in ((2990.0, Verdict.PASS), (3010.0, Verdict.NOT_CHECKABLE)):
        rows = motor_rows(joint_view(qd=rpm * RPM / 160), with_motor(max_speed=None))
        assert row(rows, "servo speed").verdict is verdict


@pytest.mark.parametrize(
    ("part", "figure", "names"),
    [
        ("motor", "rated_torque", ("servo hold", "servo RMS torque")),
        ("motor", "peak_torque", ("servo torque", "servo torque, reversed", "motor against gearbox")),
        ("motor", "rated_speed", ("servo torque", "servo torque, reversed", "servo RMS torque")),
        ("motor", "rotor_inertia", ("servo torque", "servo RMS torque", "motor inertia ratio")),
        ("gearbox", "efficiency", ("servo torque", "servo torque, reversed", "servo RMS torque", "motor against gearbox")),
        ("gearbox", "no_load_input_torque", ("servo torque", "servo RMS torque")),
        ("gearbox", "input_inertia", ("servo torque", "servo RMS torque")),
        ("gearbox", "start_stop_torque", ("motor against gearbox",)),
    ],
)
def test_a_figure_that_is_not_printed_is_never_a_pass(part, figure, names):
    bare = replace(DRIVE, **{part: replace(getattr(DRIVE, part), **{figure: None})})
    view = joint_view(tau=60.0, qd=[0.1, 0.2])
    known, lacking = ([*motor_rows(view, drive)] for drive in (DRIVE, bare))
    assert [r.check for r in lacking] == [r.check for r in known]
    for name in names:
        assert row(lacking, name).verdict is Verdict.NOT_CHECKABLE, name


def test_a_stepper_keeps_its_rows_and_a_servo_has_none_of_them():
    view = joint_view(tau=60.0, qd=0.1)
    stepper = {r.check for r in motor_rows(view, BOOM.drives[1])}
    servo = {r.check for r in motor_rows(view, DRIVE)}
    assert stepper & servo == {"motor peak power", "motor inertia ratio", "motor against gearbox"}
    assert not any(check.startswith("servo") for check in stepper)


def test_more_torque_never_improves_a_servos_verdict():
    rng = np.random.default_rng(12)
    ranks, seen = (Verdict.PASS, Verdict.WARN, Verdict.FAIL), set()
    for _ in range(20):
        t = np.sort(rng.uniform(0.0, 5.0, 40))
        tau, qd = rng.normal(0.0, 40.0, t.size), rng.normal(0.0, 0.4, t.size)
        worst: dict[str, int] = {}
        for factor in np.geomspace(0.3, 12.0, 10):
            for r in drive_rows(joint_view(tau=factor * tau, qd=qd, t=t), DRIVE):
                if r.check.startswith("servo") and r.verdict in ranks:
                    rank = ranks.index(r.verdict)
                    assert rank >= worst.get(r.check, 0)
                    worst[r.check] = rank
                    seen.add((r.check, r.verdict))
    assert {("servo torque", Verdict.PASS), ("servo torque", Verdict.FAIL), ("servo RMS torque", Verdict.FAIL)} <= seen


def test_the_motor_can_break_the_gearbox():
    """4.46 x 160 x 0.65 = 464 Nm against 460: 4.42 Nm at the motor are the most."""
    found = row(motor_rows(joint_view(), DRIVE), "motor against gearbox")
    assert (found.demand, found.limit, found.verdict) == (pytest.approx(463.84), 460.0, Verdict.WARN)
    assert "limit the drive's torque to 4.42 Nm at the motor" in found.source


@pytest.mark.parametrize(("name", "hours"), [("CSF-32-160-2UH", 7000.0), ("CSG-32-100-2UH", 10_000.0)])
def test_a_printed_L10_is_the_life_at_rated_torque_and_speed(name, hours):
    """Harmonic Drive's catalogue prints L10 itself: half the torque lives 8 times as long."""
    gear = Catalogue.load().gearboxes[name]
    drive = replace(DRIVE, gearbox=gear)
    for share in (1.0, 0.5):
        view = joint_view(tau=share * gear.continuous_torque, qd=2000 * RPM / gear.ratio)
        found = row(gearbox_rows(view, drive, None), "gearbox life")
        assert found.limit == pytest.approx(hours * 3600 / share**3, rel=1e-12)
        assert found.verdict is Verdict.INFO
        assert "L50" not in found.source
        assert "another maker" not in found.source


def test_a_planetary_gearbox_bears_its_peak_as_often_as_the_sheet_says():
    """1000 emergency stops of any duration; and no life of a strain wave is read into it."""
    drive = replace(DRIVE, gearbox=Catalogue.load().gearboxes["TP010-10"])
    motion = joint_view(tau=200.0, qd=[10 * RPM, 99.0], t=[0.0, 1.0])
    for events, verdict in ((1000.0, Verdict.PASS), (1010.0, Verdict.FAIL), (None, Verdict.NOT_CHECKABLE)):
        shock = Shock(np.zeros((2, 5)), True, np.array([True, False]), 0.03, events)
        found = row(gearbox_rows(motion, drive, shock), "gearbox momentary peaks")
        assert (found.verdict, found.limit) == (verdict, None if events is None else 1000.0)
    life = row(gearbox_rows(motion, drive, None), "gearbox life")
    assert (life.verdict, life.limit) == (Verdict.NOT_CHECKABLE, None)
    assert "indicative" not in life.source
