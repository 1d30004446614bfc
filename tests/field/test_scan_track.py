"""Scans along a log: the tip's way from the planned joints and the true motion of the mount."""

from dataclasses import replace

import numpy as np
import pytest

from boom_model import Boom, InfeasibleError, InputError, forward_kinematics, inverse_dynamics
from planner.checks.rows import Verdict
from planner.field import attitude
from planner.field.earth import geodetic_of
from planner.field.rig import read_rig
from planner.field.scan import plan_scan
from planner.field.scan_task import ScanTask
from planner.field.scan_timeline import seen_so_far, timeline
from planner.field.scan_track import LEAD, scan_along
from planner.field.vehicle_log import VehicleLog
from planner.missions.mission import load_mission, plan_cycle
from planner.timing.limit_ratios import Limit
from tests.field.field_files import RIG
from tests.field.weave import BACK, BEYOND, OFFSET, SPEED, Weave

BOOM = Boom.load()
TASK = ScanTask((0.5, 0.5))


@pytest.fixture(scope="module")
def weave():
    return Weave()


@pytest.fixture(scope="module")
def along(weave):
    return scan_along(BOOM, weave.plots, TASK, weave.log())


def test_the_tip_is_on_its_line_while_the_vehicle_weaves(weave, along):
    assert [each.row for each in along.passes] == [1, 1, 1]
    for number, each in enumerate(along.passes):
        motion = each.trajectory
        place, R = weave.pose(each.curve.mount.begin + motion.t)
        ground = place + np.einsum("nij,nj->ni", R, forward_kinematics(BOOM, motion.q).position)
        across = (ground[:, :2] - weave.row.middle) @ weave.row.left
        beside = (ground[:, :2] - weave.row.middle) @ weave.row.ahead
        assert np.ptp(across) < 1e-3  # the vehicle weaves by 100 mm
        assert across.mean() == pytest.approx(-0.35 + 0.35 * number, abs=1e-3)
        assert beside == pytest.approx(weave.along(each.curve.mount.begin + motion.t), abs=1e-3)
        assert ground[:, 2] - place[:, 2] == pytest.approx(np.full(len(motion.t), 0.9), abs=1e-3)


def test_the_row_is_covered_and_the_others_are_not(weave, along):
    rows = np.array(along.plots.rows)
    assert along.coverage[rows == 1].min() >= 0.99
    assert along.coverage[rows > 2].max() < 0.01
    assert len(along.unreachable) == 36
    assert "the vehicle passes 0 times with row 5 on its left" in along.unreachable["5-1"]


def test_limits_count_the_motion_of_the_mount(along):
    """Torques are those with the base's motion, and others than those of a mount at rest."""
    each = along.passes[1]
    motion = each.trajectory
    still = inverse_dynamics(BOOM, motion.q, motion.qd, motion.qdd, friction=True, reactions=False).tau
    base = each.curve.mount.base(motion.t)
    tau = inverse_dynamics(BOOM, motion.q, motion.qd, motion.qdd, base=base, friction=True, reactions=False).tau
    assert np.abs(tau - still).max() > 1.0
    assert each.worst < 1.0
    whole = each.move.trajectory  # from rest to rest
    assert each.ratios[Limit.VELOCITY] == pytest.approx((np.abs(whole.qd) / BOOM.limits.velocity).max(), rel=1e-9)


def test_the_boom_comes_from_rest_and_to_rest(along):
    """Before and after the pass, velocities are those of the positions, and nothing jumps."""
    for each in along.passes:
        whole = each.move.trajectory
        assert np.abs(whole.qd[[0, -1]]).max() < 1e-9
        assert np.abs(whole.qdd[[0, -1]]).max() < 1e-9
        assert np.abs(np.gradient(whole.q, whole.t, axis=0) - whole.qd)[1:-1].max() < 1e-3
        assert np.abs(np.diff(whole.qdd, axis=0)).max() < 0.02
        assert whole.duration == pytest.approx(each.trajectory.duration + 2.0 * LEAD)
        assert each.move.report.verdict is not Verdict.FAIL
    assert all(way.move.report.verdict is not Verdict.FAIL for way in along.ways)


def test_the_mission_puts_the_tip_on_its_lines_at_the_times_of_the_log(weave, along, tmp_path):
    """Legs of the file as boom mission reads it, with the vehicle's true pose at these times."""
    (tmp_path / "scan.toml").write_text(along.mission)
    mission = load_mission(str(tmp_path / "scan.toml"))
    assert mission.plots == 4
    cycle = plan_cycle(BOOM, mission)
    begin, number = along.passes[0].curve.mount.begin - LEAD, 0
    for leg in cycle.legs[1:-1]:
        if leg.label == "a motion of the file":
            t = np.linspace(LEAD, leg.trajectory.duration - LEAD, 400)
            q = np.stack([np.interp(t, leg.trajectory.t, column) for column in leg.trajectory.q.T], axis=-1)
            place, R = weave.pose(begin + t)
            ground = place + np.einsum("nij,nj->ni", R, forward_kinematics(BOOM, q).position)
            across = (ground[:, :2] - weave.row.middle) @ weave.row.left
            assert np.abs(across - (-0.35 + 0.35 * number)).max() < 1e-3
            number += 1
        begin += leg.trajectory.duration
    assert number == 3
    last = along.passes[-1].curve.mount
    assert begin == pytest.approx(last.begin + last.duration + LEAD, abs=1e-3)
    assert "level ground" in along.mission


def test_the_timeline_is_that_of_the_log(weave, along):
    """Mount and joints of the recording's day against the true motion, without jumps."""
    step = 0.1
    line = timeline(BOOM, along, step)
    t = along.passes[0].span[0] + line.t
    place, R = weave.pose(t)
    assert line.t[-1] == pytest.approx(along.duration, abs=2.0 * step)
    assert (np.diff(line.t) > 0.0).all()
    assert np.abs(line.place - place).max() < 0.04  # between passes the log's 20 Hz, where the vehicle turns about
    assert np.abs(line.R - R)[line.looking].max() < 1e-3
    assert (np.abs(np.diff(line.q, axis=0)) <= 1.01 * step * BOOM.limits.velocity).all()
    tips = line.tips(BOOM)[line.looking]
    across = (tips[:, :2] - weave.row.middle) @ weave.row.left
    assert np.abs(across[:, None] - [-0.35, 0.0, 0.35]).min(axis=1).max() < 1e-3
    assert line.looking.sum() == pytest.approx(sum(each.curve.mount.duration for each in along.passes) / step, abs=6)


def test_what_was_seen_so_far_ends_at_the_coverage(along):
    seen = seen_so_far(BOOM, along, 20.0)
    assert (np.diff(seen.share, axis=0) >= 0.0).all()
    assert seen.share[-1] == pytest.approx(along.coverage, abs=0.015)  # on points 5 cm apart


def test_a_straight_log_sees_what_the_line_of_the_row_sees():
    """The same three lines past a row, from a log at a constant speed and from `plan_scan`."""
    straight = Weave(sway=0.0)
    by_log = scan_along(BOOM, straight.plots, TASK, straight.log())
    by_line = plan_scan(BOOM, straight.plots, replace(TASK, speed=SPEED, offset=OFFSET, profile="cubic"))
    mine = np.array(straight.plots.rows) == 1
    assert by_log.coverage[mine] == pytest.approx(by_line.coverage[mine], abs=1e-6)
    once = 3 * (0.25 * 0.5) / (1.2 * 3.6)  # one more image of half a footprint at an end of each line
    assert by_log.overlap[mine] == pytest.approx(by_line.overlap[mine], abs=once)
    assert by_line.coverage[mine].min() > 0.9999


def test_two_of_three_lines_see_their_share():
    """Lines of 0.5 m, 0.35 m apart: 0.85 m of a plot's 1.2 m."""
    straight = Weave(passes=2, sway=0.0)
    found = scan_along(BOOM, straight.plots, TASK, straight.log())
    mine = np.array(straight.plots.rows) == 1
    assert found.coverage[mine] == pytest.approx(np.full(4, 0.85 / 1.2), abs=1e-4)
    assert "takes 3 lines" in found.unreachable["1-1"]


def test_a_line_that_the_tip_does_not_reach_in_time_is_named(weave):
    """Joints thirty times slower: the extension takes more than the vehicle's way back."""
    slow = replace(BOOM, limits=replace(BOOM.limits, velocity=BOOM.limits.velocity / 30.0))
    found = scan_along(slow, weave.plots, TASK, weave.log())
    gap = 2.0 * BEYOND / SPEED + weave.length / BACK - 2.0 * LEAD
    assert [each.move is None for each in found.passes] == [False, True, False]
    assert found.passes[1].reason.startswith("the tip takes ")
    assert found.passes[1].reason.endswith(f"m beside the mount; the log leaves {gap:.1f} s")
    assert found.unreachable["1-1"].startswith("the tip takes ")
    assert found.passes[0].worst > 1.0


def test_no_line_in_reach_is_no_mission(weave):
    far = scan_along(BOOM, weave.plots, ScanTask((0.5, 0.5), tip_height=4.0), weave.log())
    with pytest.raises(InfeasibleError, match=r"log\.csv: no line is reached, so there is nothing to do: on the line"):
        _ = far.mission


def test_the_motion_of_the_mount_is_that_of_the_vehicle(weave, along):
    """Velocity, turn rate and acceleration against differences of the true motion."""
    mount = along.passes[0].curve.mount
    t, h = np.linspace(2.0, mount.duration - 2.0, 50), 1e-3
    before, (place, R), after = (weave.pose(mount.begin + t + dt) for dt in (-h, 0.0, h))
    base = mount.base(t)
    velocity = np.einsum("nji,nj->ni", R, (after[0] - before[0]) / (2 * h))
    acceleration = np.einsum("nji,nj->ni", R, (after[0] - 2 * place + before[0]) / h**2)
    assert base.velocity == pytest.approx(velocity, abs=1e-3)
    assert base.acceleration == pytest.approx(acceleration, abs=3e-3)
    turned = place + np.einsum("nij,nj->ni", R, np.cross(base.angular_velocity, [1.0, 2.0, 3.0])) * h
    true = place + np.einsum("nij,j->ni", after[1] - before[1], [1.0, 2.0, 3.0]) / 2.0
    assert turned == pytest.approx(true, abs=1e-5)


def test_a_rig_takes_the_antenna_to_the_mount(weave, tmp_path):
    """A log of the antenna, with its inertial sensor turned, gives the mount's own motion."""
    (tmp_path / "rig.toml").write_text(RIG)
    rig = read_rig(tmp_path / "rig.toml")
    lever = rig.R_body_mount.T @ (rig.antenna - rig.mount)
    found = scan_along(BOOM, weave.plots, TASK, weave.log(0.0, lever, rig.R_body_mount.T @ rig.R_body_imu), rig)
    for each in found.passes:
        t = np.linspace(0.0, each.curve.mount.duration, 50)
        assert each.curve.mount.pose(t)[0] == pytest.approx(weave.pose(each.curve.mount.begin + t)[0], abs=1e-3)


def test_rtk_noise_leaves_the_tip_within_a_centimetre(weave):
    """White noise of 14 mm at 20 Hz, smoothed over a second: some 14 mm * sqrt(1 / 20)."""
    found = scan_along(BOOM, weave.plots, TASK, weave.log(0.0143))
    each = found.passes[0]
    place, R = weave.pose(each.curve.mount.begin + each.trajectory.t)
    ground = place + np.einsum("nij,nj->ni", R, forward_kinematics(BOOM, each.trajectory.q).position)
    across = (ground[:, :2] - weave.row.middle) @ weave.row.left + 0.35
    assert 1e-3 < np.sqrt((across**2).mean()) < 6e-3
    assert each.curve.mount.residual == pytest.approx(0.0143 * np.sqrt(3.0), rel=0.1)


@pytest.mark.parametrize("seconds", [2.0, 20.0])
def test_a_gap_is_named_and_its_pass_left_out(weave, seconds):
    """The next passes take the lines from the first on; a gap between passes does not matter."""
    log = weave.log()
    begin = 10.0
    kept = ~((log.t > begin) & (log.t < begin + seconds)) & ~((log.t > 50.0) & (log.t < 55.0))
    latitude, longitude, height = (column[kept] for column in log.geodetic)
    gappy = VehicleLog.of(log.t[kept], latitude, longitude, height, *log.angles[kept].T, source="log.csv")
    found = scan_along(BOOM, weave.plots, TASK, gappy)
    assert [round(each.curve.mount.begin) for each in found.passes] == [69, 134]
    assert found.notes[0] == f"log.csv: no fix for {seconds:.1f} s from 10 s on; that pass along row 1 is left out"
    assert "the vehicle passes 2 times with row 1 on its left; it takes 3 lines" in found.unreachable["1-1"]


def test_a_log_of_one_fix_a_second(weave):
    """Knots 3 s apart cannot follow a weave of 8 s as well: some 10 mm."""
    log = weave.log()
    latitude, longitude, height = (column[::20] for column in log.geodetic)
    slow = VehicleLog.of(log.t[::20], latitude, longitude, height, *log.angles[::20].T, source="log.csv")
    each = scan_along(BOOM, weave.plots, TASK, slow).passes[0]
    t = np.linspace(0.0, each.curve.mount.duration, 200)
    off = each.curve.mount.pose(t)[0] - weave.pose(each.curve.mount.begin + t)[0]
    assert np.linalg.norm(off, axis=1).max() < 0.03


def test_a_log_elsewhere_is_refused(weave):
    place, R = weave.pose(weave.t)
    ecef = weave.plots.frame.ecef(place + np.array([0.0, 200.0, 0.0]))
    log = VehicleLog.of(weave.t, *geodetic_of(ecef), *attitude.angles(R).T, source="far.csv")
    with pytest.raises(InputError, match=r"far\.csv: it passes no row of plots on its left, 0\.5 to 3\.5 m away"):
        scan_along(BOOM, weave.plots, TASK, log)
