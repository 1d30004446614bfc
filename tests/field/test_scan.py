"""Row scans: coverage counted again by sampled points, moves within limits, the mission file, what
cannot be reached."""

import time

import numpy as np
import pytest

from boom_model import Boom, InfeasibleError, InputError, forward_kinematics
from planner.checks.rows import Verdict
from planner.field.plots import PlotMap, lay_out
from planner.field.scan import ScanTask, plan_scan
from planner.missions.mission import load_mission, plan_cycle
from tests.field.trials import corners, trial


@pytest.fixture(scope="module")
def stopped():
    begin = time.perf_counter()
    scan = plan_scan(Boom.load(), trial()[0], ScanTask((0.5, 0.5), profile="cubic"))
    assert time.perf_counter() - begin < 30.0
    return scan


def test_forty_plots_are_covered_and_every_move_is_certified(stopped):
    assert len(stopped.visits) == 40
    assert not stopped.unreachable
    assert stopped.coverage.min() >= 0.99
    for move in stopped.moves.values():
        assert move.report.verdict is not Verdict.FAIL
        assert move.report.certificate is not None
        assert not move.report.certificate.broken


def test_coverage_equals_that_of_random_points(stopped):
    """Points strewn over a plot, each looked for in every footprint of the moves sampled again."""
    task, visit, plot = stopped.task, stopped.visits[0], stopped.beside[0]
    random = np.random.default_rng(1)
    points = random.uniform([plot.x[0], plot.y[0] + stopped.offset], [plot.x[1], plot.y[1] + stopped.offset], (20_000, 2))
    seen = np.zeros(len(points), dtype=bool)
    forward = list(stopped.moves.values())[::2]
    for x in visit.stops:
        for move in forward:
            motion = move.trajectory
            at = np.unique(np.append(np.arange(0, len(motion.t), round(1.0 / task.rate / 0.01)), len(motion.t) - 1))
            for q, tip in zip(motion.q[at], forward_kinematics(Boom.load(), motion.q[at]).position, strict=True):
                away = points - tip[:2] - [x, 0.0]
                out = away @ [np.cos(q[0]), np.sin(q[0])]
                across = away @ [-np.sin(q[0]), np.cos(q[0])]
                seen |= (np.abs(out) <= 0.25) & (np.abs(across) <= 0.25)
    assert stopped.coverage[0] == pytest.approx(seen.mean(), abs=3e-3)


def test_the_tip_keeps_its_height_and_looks_down(stopped):
    for move in stopped.moves.values():
        tip = forward_kinematics(Boom.load(), move.trajectory.q)
        assert tip.position[:, 2] == pytest.approx(np.full(len(tip.position), 0.9), abs=1e-5)
        assert tip.pitch == pytest.approx(np.full(len(tip.pitch), -np.pi / 2), abs=1e-9)


def test_the_track_is_beside_the_rows(stopped):
    """Every stop is as far from the middle line of its row as the offset says, and within half a
    plot of one."""
    middles = np.array([polygon.centroid.coords[0] for polygon in stopped.plots.polygons])
    assert len(stopped.track) == sum(len(visit.stops) for visit in stopped.visits)
    for row, stops in enumerate(np.split(stopped.track, 10), start=1):
        mine = middles[np.array(stopped.plots.rows) == row]
        ahead = (mine[-1] - mine[0]) / np.linalg.norm(mine[-1] - mine[0])
        beside = (stops - mine[0]) @ [-ahead[1], ahead[0]]
        side = -1.0 if row % 2 else 1.0  # to the right of the first row, and of the second on the way back
        assert beside == pytest.approx(np.full(len(stops), side * stopped.offset), abs=1e-3)


def test_its_mission_is_the_moves_in_order(stopped, tmp_path):
    place = tmp_path / "scan.toml"
    place.write_text(stopped.mission)
    cycle = plan_cycle(Boom.load(), load_mission(str(place)))
    pairs = list(zip(cycle.legs, cycle.counts, strict=True))
    assert sum(count for leg, count in pairs if leg.label == "hold") == sum(len(visit.stops) for visit in stopped.visits)
    swept = sum(leg.trajectory.duration * count for leg, count in pairs if "along line" in leg.label)
    one = sum(move.report.duration for move in list(stopped.moves.values())[::2])
    assert swept == pytest.approx(80 * one, rel=1e-3)


def test_driving_past_at_half_a_metre_a_second():
    scan = plan_scan(Boom.load(), trial()[0], ScanTask((0.5, 0.5), speed=0.5, profile="cubic"))
    assert scan.coverage.min() >= 0.99
    assert scan.seconds == pytest.approx(np.full(40, 3 * 3.6 / 0.5), rel=1e-6)
    assert all(len(visit.lines) == 3 for visit in scan.visits)
    with pytest.raises(InfeasibleError, match=r"leave gaps; 1\.8 m/s is the fastest"):
        plan_scan(Boom.load(), trial()[0], ScanTask((0.5, 0.5), speed=2.0))


def test_what_cannot_be_reached_is_named():
    far = plan_scan(Boom.load(), trial()[0], ScanTask((0.5, 0.5), offset=2.2, speed=0.5, profile="cubic"))
    assert len(far.unreachable) == 40
    assert "the tip reaches no line at 2.55 m beside the mount" in next(iter(far.unreachable.values()))
    assert 0.5 < far.coverage.max() < 0.9
    with pytest.raises(InfeasibleError, match="no plot can be reached"):
        plan_scan(Boom.load(), trial()[0], ScanTask((0.5, 0.5), offset=5.0))


def test_maps_without_rows_are_refused():
    plots, _ = lay_out(corners(), 10, 4, (1.2, 3.6), (0.3, 1.5))
    bare = PlotMap.of(list(plots.names), [list(rings) for rings in plots.rings])
    with pytest.raises(InputError, match="a scan needs the row and the range of every plot"):
        plan_scan(Boom.load(), bare, ScanTask((0.5, 0.5)))
