"""Rows by hand arithmetic, and what missing data does to a verdict."""

from dataclasses import replace

import numpy as np
import pytest

from boom_model import Basis, Boom, Friction, InputError, Mount, Origin, Sourced, inverse_dynamics
from planner import Trajectory, Verdict, check, plan
from planner.motion.trajectory import sample
from planner.timing.travel_mean import average_torque
from planner.validation.tables import table_2_4_motion
from tests.builders import row_of, with_drives

BOOM = Boom.load()


@pytest.fixture
def path():
    return sample(table_2_4_motion(BOOM), 0.001)


def held_still(q, samples=3) -> Trajectory:
    zero = np.zeros((samples, 5))
    return Trajectory.from_samples(np.arange(samples), np.tile(q, (samples, 1)), zero, zero)


def test_average_torque_of_a_constant_is_the_constant():
    t = np.linspace(0.0, 2.0, 50)
    assert average_torque(t, np.full(50, -80.0), np.sin(t)) == pytest.approx(80.0, rel=1e-12)


def test_average_torque_is_the_speed_weighted_cube_mean():
    """100 Nm at 1 rad/s for 1 s and 50 Nm at 3 rad/s for 1 s: ((1e6 + 3 x 1.25e5) / 4)^(1/3) =
    70.05 Nm."""
    t = np.array([0.0, 1.0, 1.0 + 1e-12, 2.0])
    torque, speed = np.array([100.0, 100.0, 50.0, 50.0]), np.array([1.0, 1.0, 3.0, 3.0])
    assert average_torque(t, torque, speed) == pytest.approx(((1e6 + 3 * 1.25e5) / 4) ** (1 / 3), rel=1e-9)


@pytest.mark.parametrize(("joint", "expected"), [("inner", 102.0), ("lower", 105.3)])
def test_average_torque_on_table_2_4(joint, expected, path):
    report = check(BOOM, path, payload_as="force")
    assert row_of(report, joint, "gearbox average").demand == pytest.approx(expected, abs=0.05)


def test_motor_rows_on_table_2_4_by_hand(path):
    """At 10 s joint 2 rests under 155.832 Nm: 155.832 / 160 = 0.974 Nm to hold.

    Its inner link falls all the way, so the load drives it forwards; the move reversed lifts it, at
    most 155.832 / (160 x 0.65) + 0.42 = 1.918 Nm and the share of the inertia.
    """
    report = check(BOOM, path, payload_as="force")
    assert row_of(report, "inner", "motor hold").demand == pytest.approx(155.832 / 160, abs=5e-3)
    lift = row_of(report, "inner", "motor torque, reversed")
    inertia = (4e-4 + 1.76e-4) * 160 * np.radians(45) * 6 / 100
    assert lift.demand == pytest.approx(155.832 / (160 * 0.65) + 0.42 + inertia, abs=2e-3)
    assert lift.limit == 7.2
    assert lift.margin == pytest.approx((7.2 - lift.demand) / lift.demand, rel=1e-12)


def test_rows_take_the_absolute_torque_and_its_time(path):
    """tau4 of table 2-4's path is negative at its largest: -63.55 N at 10 s."""
    row = row_of(check(BOOM, path, payload_as="force"), "extension", "drive peak force")
    assert row.demand == pytest.approx(63.551, abs=1e-3)
    assert row.at_s == pytest.approx(10.0)


def test_joints_without_a_drive_are_never_passed(path):
    report = check(BOOM, path)
    for joint in ("yaw", "extension", "wrist"):
        drive_rows = [r for r in report.rows if r.joint == joint and r.check.startswith("drive")]
        assert len(drive_rows) == 5
        assert {r.verdict for r in drive_rows} == {Verdict.NOT_CHECKABLE}
        assert {r.source for r in drive_rows} == {"NOT CHECKED: no drive data"}
    assert report.verdict is Verdict.INCOMPLETE


@pytest.mark.parametrize("missing", ["bus_voltage", "wiring"])
def test_without_voltage_or_wiring_only_low_speed_is_judged(missing):
    boom = with_drives(BOOM, **{missing: None})
    fast = plan(boom, "transport", "phenotyping").report
    for name in ("motor torque", "motor torque, reversed", "motor speed"):
        assert row_of(fast, "lower", name).verdict is Verdict.NOT_CHECKABLE
    slow = plan(boom, "transport", "phenotyping", duration=120.0).report
    assert row_of(slow, "lower", "motor torque").verdict is Verdict.PASS
    assert row_of(slow, "lower", "motor torque").basis is Basis.PRINTED


def test_a_motor_too_weak_fails_even_without_voltage(path):
    weak = replace(BOOM.drives[1].motor, running_torque=1.0)
    report = check(with_drives(BOOM, bus_voltage=None, motor=weak), path)
    assert row_of(report, "inner", "motor torque, reversed").verdict is Verdict.FAIL


@pytest.mark.parametrize(
    "figure", ["efficiency", "no_load_input_torque", "input_inertia", "start_stop_torque", "max_average_torque"]
)
def test_a_missing_gearbox_figure_is_not_checkable(figure, path):
    report = check(with_drives(BOOM, gearbox=replace(BOOM.drives[1].gearbox, **{figure: None})), path)
    concerned = {"start_stop_torque": "gearbox repeated peak", "max_average_torque": "gearbox hold"}.get(figure, "motor torque")
    assert row_of(report, "inner", concerned).verdict is Verdict.NOT_CHECKABLE


def test_more_torque_never_improves_a_verdict(path):
    order = [Verdict.PASS, Verdict.WARN, Verdict.FAIL]
    seen = {}
    for payload in np.linspace(0.0, 60.0, 25):
        for row in check(BOOM.with_payload(payload), path).rows:
            if row.joint in ("inner", "lower") and row.verdict in order:
                key, rank = (row.joint, row.check), order.index(row.verdict)
                assert rank >= seen.get(key, 0), key
                seen[key] = rank
    assert max(seen.values()) == 2


def test_the_curve_gives_no_clean_pass_near_it():
    """At the speed and torque where the margin is between 50 and 75 %: WARN; below: FAIL; and its
    basis is assumed."""
    verdicts = []
    for payload in (10.0, 20.0, 24.0):
        row = row_of(
            check(BOOM.with_payload(payload), plan(BOOM, "transport", "phenotyping").trajectory), "lower", "motor torque"
        )
        verdicts.append(row.verdict)
        assert row.basis is Basis.ASSUMED
    assert verdicts == [Verdict.PASS, Verdict.WARN, Verdict.FAIL]


def test_printed_voltage_and_wiring_leave_the_curve_an_estimate():
    printed = Origin(Basis.PRINTED, "name plate")
    drive = BOOM.drives[1]
    boom = with_drives(BOOM, bus_voltage=Sourced(80.0, printed), wiring=Sourced(drive.wiring.value, printed))
    assert row_of(plan(boom, "transport", "phenotyping").report, "lower", "motor torque").basis is Basis.ESTIMATED


def test_hold_row_is_the_static_torque_of_the_worst_pose():
    q = BOOM.pose("phenotyping")
    row = row_of(check(BOOM, held_still(q)), "lower", "gearbox hold")
    assert row.demand == pytest.approx(inverse_dynamics(BOOM, q, np.zeros(5), np.zeros(5)).tau[2], rel=1e-12)
    assert not any(r.check == "gearbox average" for r in check(BOOM, held_still(q)).rows)


@pytest.mark.parametrize(
    ("degrees", "joint", "name"),
    [
        ([0, 130, 180, 0, 0], "inner", "position"),
        ([0, 50, 52, 0, 0], "lower", "lower - inner"),
        ([0, 0, 90, 0, -91], "wrist", "position"),
    ],
)
def test_states_outside_the_limits_are_reported_not_refused(degrees, joint, name):
    report = check(BOOM, held_still(np.radians(degrees)))
    row = row_of(report, joint, name)
    assert row.verdict is Verdict.FAIL
    assert row.margin == pytest.approx(BOOM.limits.excess(np.radians(degrees)).max() * -1, abs=1e-15)
    assert report.verdict is Verdict.FAIL


@pytest.mark.parametrize("name", ["velocity", "acceleration"])
def test_rates_beyond_their_limit_fail(name):
    limit = getattr(BOOM.limits, name)
    for share, verdict in ((0.999, Verdict.PASS), (1.01, Verdict.FAIL)):
        rates = {"qd": np.zeros((2, 5)), "qdd": np.zeros((2, 5))}
        rates["qd" if name == "velocity" else "qdd"][1] = -share * limit
        report = check(BOOM, Trajectory.from_samples([0.0, 1.0], np.tile(BOOM.pose("transport"), (2, 1)), **rates))
        assert {row_of(report, joint, name).verdict for joint in ("yaw", "extension")} == {verdict}


def test_jerk_is_checked_where_it_was_limited():
    checks = {
        p: {r.check for r in plan(BOOM, "transport", "phenotyping", profile=p).report.rows} for p in ("cubic", "jerk-limited")
    }
    assert "jerk" in checks["jerk-limited"]
    assert "jerk" not in checks["cubic"]


def test_payload_as_is_checked(path):
    with pytest.raises(InputError, match="payload_as"):
        check(BOOM, path, payload_as="weight")


@pytest.mark.parametrize(
    ("brake", "verdict"),
    [
        (None, Verdict.FAIL),
        (Sourced(False, Origin(Basis.PRINTED, "drawing")), Verdict.FAIL),
        (Sourced(True, Origin(Basis.ASSUMED, "hoped for")), Verdict.WARN),
        (Sourced(True, Origin(Basis.PRINTED, "drawing")), Verdict.PASS),
    ],
)
def test_power_off_needs_a_brake_that_is_declared(brake, verdict, path):
    report = check(with_drives(BOOM, brake=brake), path)
    row = row_of(report, "inner", "power-off hold")
    assert row.verdict is verdict
    assert row.limit == 29.0
    assert row.demand == row_of(report, "inner", "gearbox hold").demand


def test_mount_rows_are_the_wrenchs_sizes_and_need_limits():
    trajectory = held_still(BOOM.pose("phenotyping"))
    mount = inverse_dynamics(BOOM, trajectory.q[0], np.zeros(5), np.zeros(5)).mount
    report = check(BOOM, trajectory)
    assert row_of(report, "mount", "peak force").demand == pytest.approx((BOOM.mass + 10.0) * 9.81, rel=1e-12)
    assert row_of(report, "mount", "peak moment").demand == pytest.approx(np.linalg.norm(mount[3:]), rel=1e-12)
    assert row_of(report, "mount", "peak moment").verdict is Verdict.NOT_CHECKABLE
    weak = replace(
        BOOM, mount=Mount(Sourced(1e4, Origin(Basis.PRINTED, "drawing")), Sourced(100.0, Origin(Basis.ASSUMED, "guess")))
    )
    verdicts = [row_of(check(weak, trajectory), "mount", name).verdict for name in ("peak force", "peak moment")]
    assert verdicts == [Verdict.PASS, Verdict.FAIL]


@pytest.mark.parametrize(("gap", "verdict"), [(16.0, Verdict.PASS), (14.0, Verdict.WARN), (166.0, Verdict.WARN)])
def test_a_nearly_flat_parallelogram_is_warned_of(gap, verdict):
    row = row_of(check(BOOM, held_still(np.radians([0.0, 10.0, 10.0 + gap, 0.0, 0.0]))), "lower", "transmission angle")
    assert row.verdict is verdict
    assert np.degrees(row.demand) == pytest.approx(min(gap, 180.0 - gap), abs=1e-9)


def rough_boom() -> Boom:
    friction = Friction(
        np.array([0.0, 60.0, 60.0, 0.0, 0.0]), np.array([0.0, 60.0, 60.0, 0.0, 0.0]), (None, GUESS, GUESS, None, None)
    )
    return replace(BOOM, friction=friction)


GUESS = Origin(Basis.ASSUMED, "a guess")


def test_friction_enters_the_checks_both_ways_and_is_said_to_be_assumed():
    """The reversed row is the forward row of the motion run backwards, whose friction
    turns round."""
    motion = replace(plan(BOOM, "transport", "phenotyping").trajectory, planned=None)
    back = Trajectory.from_samples(motion.t, motion.q[::-1], -motion.qd[::-1], motion.qdd[::-1])
    there, again = check(rough_boom(), motion), check(rough_boom(), back)
    for one, other in (("motor torque", "motor torque, reversed"), ("motor torque, reversed", "motor torque")):
        assert row_of(there, "lower", one).demand == pytest.approx(row_of(again, "lower", other).demand, rel=1e-12)
    smooth = check(BOOM, motion)
    assert (
        row_of(there, "lower", "gearbox repeated peak").demand > row_of(smooth, "lower", "gearbox repeated peak").demand + 30.0
    )
    assert row_of(there, "lower", "gearbox repeated peak").basis is Basis.ASSUMED
    assert row_of(smooth, "lower", "gearbox repeated peak").basis is Basis.PRINTED
    assert "lower friction: a guess" in there.assumptions


@pytest.mark.parametrize("profile", ["cubic", "time-optimal", "jerk-limited"])
def test_planned_moves_keep_the_motors_margin_with_friction(profile):
    report = plan(rough_boom().with_payload(14.0), "transport", "phenotyping", profile=profile).report
    for joint in ("inner", "lower"):
        assert row_of(report, joint, "motor torque").margin >= 0.5 - 1e-3


def test_planned_moves_keep_the_gearboxs_start_stop_torque():
    """A motor far stronger than its gearbox, and fast joints: the gearbox bears the joint's torque,
    the rotor's share not."""
    motor = replace(BOOM.drives[1].motor, running_torque=40.0, holding_torque=50.0)
    limits = replace(BOOM.limits, velocity=4.0 * BOOM.limits.velocity, acceleration=20.0 * BOOM.limits.acceleration)
    strong = replace(with_drives(BOOM, motor=motor), limits=limits).with_payload(22.0)
    ratios = []
    for start, goal in (("transport", "phenotyping"), ("phenotyping", "transport")):
        report = plan(strong, start, goal, profile="time-optimal").report
        ratios += [row.demand / row.limit for row in report.rows if row.check == "gearbox repeated peak"]
    assert 0.99 < max(ratios) <= 1.001


def test_a_low_voltage_is_seen_at_low_speed_too(path):
    """At 2 V the curve leaves less than the running torque long before 60 rpm."""
    row = row_of(check(with_drives(BOOM, bus_voltage=Sourced(2.0, GUESS)), path), "lower", "motor torque")
    assert row.limit < 7.2
    assert row.basis is Basis.ASSUMED


def test_both_readings_of_the_efficiency_are_reported(path):
    """At the mesh's 0.871 the largest of both directions asks 155.8 / (160 x 0.871) + 0.42 = 1.538
    Nm and the inertia."""
    row = row_of(check(BOOM, path, payload_as="force"), "inner", "motor torque, other reading")
    assert row.demand == pytest.approx(155.832 / (160 * 0.8713) + 0.42 + 5.76e-4 * 160 * np.radians(45) * 6 / 100, abs=2e-3)
    assert row.verdict is Verdict.INFO


def test_an_absurd_state_is_refused_and_never_passes():
    qd = np.zeros((3, 5))
    qd[1, 2] = 1e200
    wild = Trajectory.from_samples([0.0, 1.0, 2.0], np.tile(BOOM.pose("transport"), (3, 1)), qd, np.zeros((3, 5)))
    with pytest.raises(InputError, match=r"sample 1, t = 1 s: torques are not finite"):
        check(BOOM, wild)


def test_torque_peaks_add_up():
    for peak in plan(BOOM, "transport", "phenotyping").report.peaks:
        parts = peak.gravity + peak.inertia + peak.velocity + peak.payload + peak.friction + peak.vehicle
        assert parts == pytest.approx(peak.total, rel=1e-12)
