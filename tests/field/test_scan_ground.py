"""Lines over the ground while the vehicle drives, from the planned joints and the track alone."""

from dataclasses import replace

import numpy as np
import pytest

from boom_model import BaseMotion, Boom, InfeasibleError, InputError, forward_kinematics, inverse_dynamics
from boom_model.keep_out import Capsule
from planner.checks.rows import Verdict
from planner.field.plots import PlotMap
from planner.field.scan import Scan, plan_scan
from planner.field.scan_ground import fastest_crossing, ground_lines, ground_move
from planner.field.scan_rows import length, turn, turn_length
from planner.field.scan_task import ScanTask
from planner.field.scan_timeline import seen_so_far, timeline
from planner.missions.mission import load_mission, plan_cycle
from planner.timing.path_limits import load_ratio
from tests.builders import ORIGIN, with_shapes
from tests.field.trials import trial

BOOM = Boom.load()
SPEED = 0.06
ACROSS = (1.45, 2.15)


@pytest.fixture(scope="module")
def lines():
    _, crossing = fastest_crossing(BOOM, ACROSS, 4, 0.45, 3.0, 0.9, "horizontal", "cubic")
    return ground_lines(BOOM, crossing, "horizontal", "cubic")


def small_map() -> PlotMap:
    """Two rows of two plots of the trial."""
    whole, _ = trial()
    few = [k for k in range(40) if whole.rows[k] <= 2 and whole.ranges[k] <= 2]
    names, rings = [whole.names[k] for k in few], [list(whole.rings[k]) for k in few]
    rows, ranges = [whole.rows[k] for k in few], [whole.ranges[k] for k in few]
    return PlotMap.of(names, rings, rows=rows, ranges=ranges, height=480.0)


@pytest.fixture(scope="module")
def small() -> Scan:
    return plan_scan(BOOM, small_map(), ScanTask((0.5, 0.5), speed=SPEED, profile="cubic"))


@pytest.fixture(scope="module")
def twice() -> Scan:
    """Two passes with an odd number of lines: the tip ends at the other edge."""
    return plan_scan(BOOM, small_map(), ScanTask((0.5, 0.8), speed=0.1, passes=2, profile="cubic"))


def test_lines_are_straight_over_the_ground(lines):
    """The mount drives evenly; where the tip moves across, it stays on one line of the ground."""
    move = ground_move(BOOM, lines, SPEED)
    motion = move.trajectory
    tip = forward_kinematics(BOOM, motion.q)
    ground = tip.position + SPEED * motion.t[:, None] * [1.0, 0.0, 0.0]
    speed = np.gradient(ground, motion.t, axis=0)
    crossing = np.abs(speed[:, 1]) > 1e-3
    assert crossing.mean() > 0.3
    runs = np.split(np.flatnonzero(crossing), np.flatnonzero(np.diff(np.flatnonzero(crossing)) > 1) + 1)
    assert len(runs) == 4
    middles = [float(ground[run, 0].mean()) for run in runs]
    assert np.diff(middles) == pytest.approx([0.45] * 3, abs=1e-4)
    for run, x in zip(runs, middles, strict=True):
        assert np.abs(ground[run, 0] - x).max() < 1e-4  # of the 1 mm asked for
        assert np.ptp(ground[run, 1]) == pytest.approx(0.7, abs=1e-3)
    assert tip.position[:, 2] == pytest.approx(np.full(len(motion.t), 0.9), abs=2e-5)
    assert tip.pitch == pytest.approx(np.full(len(motion.t), -np.pi / 2), abs=1e-6)
    assert speed[[0, -1], 0] == pytest.approx([SPEED, SPEED], abs=1e-3)  # beside the vehicle at both ends


def test_velocities_are_those_of_the_positions(lines):
    motion = ground_move(BOOM, lines, SPEED).trajectory
    assert np.abs(np.gradient(motion.q, motion.t, axis=0) - motion.qd)[1:-1].max() < 1e-3
    assert np.abs(np.gradient(motion.qd, motion.t, axis=0) - motion.qdd)[1:-1].max() < 1e-2


@pytest.mark.parametrize("profile", ["cubic", "jerk-limited"])
def test_the_largest_speed_is_where_a_limit_is_reached(profile):
    _, crossing = fastest_crossing(BOOM, (1.7, 1.9), 4, 0.45, 5.1, 0.9, "horizontal", profile)
    found = ground_lines(BOOM, crossing, "horizontal", profile)
    assert found.limit == "the lines over the plot"
    at_limit = ground_move(BOOM, found, found.speed).report
    assert at_limit.verdict is not Verdict.FAIL
    worst = max(each.ratio for each in at_limit.certificate.worst if each.limit not in ("position", "lower - inner"))
    assert worst == pytest.approx(1.0, abs=2e-3)
    assert ground_move(BOOM, found, 1.05 * found.speed).report.verdict is Verdict.FAIL


def test_one_pass_covers_the_plots(small):
    assert small.passes == 1
    assert small.coverage.min() >= 0.99
    assert all(move.report.verdict is not Verdict.FAIL for move in small.moves.values())
    seen = seen_so_far(BOOM, small, 60.0)
    assert (np.diff(seen.share, axis=0) >= 0.0).all()
    assert seen.share[-1].min() >= 0.985  # on points 5 cm apart


@pytest.fixture(scope="module")
def gap() -> Scan:
    """A row without its second plot: the vehicle goes on to the third one."""
    whole = small_map()
    names, rings = list(whole.names)[:3], [list(each) for each in whole.rings][:3]
    few = PlotMap.of(names, rings, rows=list(whole.rows)[:3], ranges=list(whole.ranges)[:3], height=480.0)
    return plan_scan(BOOM, few, ScanTask((0.5, 0.5), speed=SPEED, profile="cubic"))


def test_a_gap_in_a_row_is_no_hindrance(gap):
    assert gap.passes == 1
    assert gap.coverage.min() >= 0.99


def test_two_passes_with_an_odd_number_of_lines(twice):
    assert twice.passes == 2
    assert twice.visits[0].ground[0][0].crossing.lines == 5
    assert twice.coverage.min() >= 0.99
    assert sum(leg.what == "pass" for leg in twice.legs) == 8
    assert {leg.moves[0] for leg in twice.legs if leg.what == "pass"} >= {
        "lines across, pass 1, from the near edge",
        "lines across, pass 1, from the far edge",
    }


@pytest.mark.parametrize("which", ["small", "twice", "gap"])
def test_the_day_is_continuous(which, request):
    """Mount and joints do not jump from leg to leg, and the vehicle is no faster than it drives."""
    step, small = 0.1, request.getfixturevalue(which)
    line = timeline(BOOM, small, step)
    assert np.linalg.norm(np.diff(line.mount, axis=0), axis=1).max() <= 1.0 * step + 1e-6
    assert (np.abs(np.diff(line.q, axis=0)) <= 1.01 * step * BOOM.limits.velocity).all()
    assert line.t[-1] == pytest.approx(small.duration, abs=2 * step)


@pytest.mark.parametrize(("which", "passes"), [("small", 4), ("twice", 8)])
def test_its_mission_lasts_as_long_as_the_day(which, passes, tmp_path, request):
    small = request.getfixturevalue(which)
    place = tmp_path / "scan.toml"
    place.write_text(small.mission)
    cycle = plan_cycle(BOOM, load_mission(str(place)))
    pairs = list(zip(cycle.legs, cycle.counts, strict=True))
    # From transport to the first position of each pass, and back.
    ways = sum(leg.trajectory.duration for leg in cycle.legs if leg.label.startswith(("to q=", "to transport")))
    assert sum(leg.trajectory.duration * count for leg, count in pairs) - ways == pytest.approx(small.duration, abs=0.1)
    assert sum(count for leg, count in pairs if leg.label == "a motion of the file") == passes


def test_too_fast_names_the_largest_speed():
    plots, _ = trial()
    with pytest.raises(
        InfeasibleError, match=r"with 1 pass along a row, the boom follows the ground up to 0\.0\d+ m/s; 0\.5 m/s"
    ):
        plan_scan(BOOM, plots, ScanTask((0.5, 0.5), speed=0.5, passes=1, profile="cubic"))
    with pytest.raises(InputError, match="passes are driven at a speed"):
        plan_scan(BOOM, plots, ScanTask((0.5, 0.5), passes=1))
    with pytest.raises(InputError, match="9 passes; the plots take 1 to 3"):
        plan_scan(BOOM, plots, ScanTask((0.5, 0.5), speed=0.5, passes=9, profile="cubic"))


def test_keep_out_shapes_stop_lines_over_the_ground():
    """A post beside the track, on the way of the arm."""
    post = Capsule("post", np.array([0.0, 0.9, -1.0]), np.array([0.0, 0.9, 2.5]), 0.1, ORIGIN)
    assert fastest_crossing(with_shapes(post), ACROSS, 4, 0.45, 3.0, 0.9, "horizontal", "cubic") is None


def test_starts_and_stops_load_the_drives_more_than_standing(small):
    """The worst of four directions of 1 m/s^2, by gravity tilted as d'Alembert says."""
    starts = {leg.start: leg for leg in small.legs}
    worst = 0.0
    for leg in starts.values():
        name = next(name for name in small.moves if leg.moves and name == leg.moves[0])
        q = small.moves[name].trajectory.q[0]
        for way in np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]):
            pull = np.array([*way, BOOM.gravity])
            strong = replace(BOOM, gravity=float(np.linalg.norm(pull)))
            tau = inverse_dynamics(strong, q, np.zeros(5), np.zeros(5), base=BaseMotion.of(up=pull), reactions=False).tau
            worst = max(worst, load_ratio(BOOM, tau, np.zeros(5), np.zeros(5)).max())
    assert small.starting == pytest.approx(worst, rel=1e-6)
    assert 0.1 < small.starting < 1.0


@pytest.mark.parametrize("apart", [0.0, 1.5, 5.1, 8.0, 11.0, -5.1])
@pytest.mark.parametrize("beyond", [0.0, 2.0, -2.0])
def test_turns_are_arcs_from_row_to_row(apart, beyond):
    """The heading turns by 180 deg, no tighter than the radius; the length is the closed form's."""
    ahead = np.array([0.6, 0.8])
    goal = np.array([3.0, 4.0]) + beyond * ahead + apart * np.array([-0.8, 0.6])
    way = turn(np.array([3.0, 4.0]), ahead, goal, 4.0)
    assert way[0] == pytest.approx([3.0, 4.0])
    assert way[-1] == pytest.approx(goal)
    assert length(way) == pytest.approx(turn_length(abs(apart), 4.0) + abs(beyond), rel=2e-3)
    steps = np.diff(way, axis=0)
    steps = steps[np.linalg.norm(steps, axis=1) > 1e-9]
    sizes = np.linalg.norm(steps, axis=1)
    assert steps[0] @ ahead / sizes[0] > 0.99
    assert steps[-1] @ ahead / sizes[-1] < -0.99
    bends = np.arccos(np.clip((steps[1:] * steps[:-1]).sum(axis=1) / (sizes[1:] * sizes[:-1]), -1.0, 1.0))
    assert (bends / (0.5 * (sizes[1:] + sizes[:-1]))).max() < 1.01 / 4.0
