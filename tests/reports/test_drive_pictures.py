"""The drives' page: what is drawn, read back from the figure; how it looks is looked at by hand."""

import numpy as np
import pytest

from boom_model import Boom, InputError, tip_deflection
from boom_model.drives.drive import available_torque, motor_torque
from planner.missions.mission import check_cycle
from planner.planning import torques
from planner.reports.drive_pictures import drive_figure, write_drive_picture
from tests.builders import main_move, planned_mission, with_drives, without_drives

BOOM = Boom.load()


@pytest.fixture
def move():
    return main_move(step=0.05)


def panels(boom, trajectory, tau, report, parts=()):
    """A page's panels by title."""
    return {axes.get_title(): axes for axes in drive_figure(boom, trajectory, tau, report, parts).axes}


def drawn(move, boom=BOOM):
    return panels(boom, move.trajectory, move.loads.tau, move.report)


def curves(axes):
    return {line.get_label(): line.get_xydata() for line in axes.get_lines()}


@pytest.mark.parametrize(("i", "joint"), [(1, "inner"), (2, "lower")])
def test_the_plane_holds_the_motion_both_ways_and_the_curve(i, joint, move):
    drive, motion = BOOM.drives[i], move.trajectory
    found = curves(drawn(move)[f"{joint}: MST342C02"])
    speed = 160 * np.abs(motion.qd[:, i])
    for name, sign in (("motion", 1.0), ("motion reversed", -1.0)):
        torque = motor_torque(drive, move.loads.tau[:, i], sign * motion.qd[:, i], motion.qdd[:, i])
        np.testing.assert_allclose(found[name], np.stack([speed * 30 / np.pi, np.abs(torque)], axis=-1), rtol=1e-12)
    (curve,) = (xy for name, xy in found.items() if name.startswith("available (estimated, 80 V parallel (assumed))"))
    np.testing.assert_allclose(curve[:, 1], available_torque(drive, curve[:, 0] * np.pi / 30), rtol=1e-9)
    np.testing.assert_allclose(found["with 50% margin"][:, 1], curve[:, 1] / 1.5, rtol=1e-12)


def test_the_gearbox_has_its_ratings_beside_it(move):
    found = curves(drawn(move)["inner: CBG320160"])
    np.testing.assert_allclose(found["absolute torque"][:, 1], np.abs(move.loads.tau[:, 1]), rtol=1e-12)
    assert {f"{name} Nm" for name in ("rated 172", "largest average 275", "start-stop 460")} <= found.keys()


def test_every_margin_is_a_bar(move):
    axes = drawn(move)["lower: margins"]
    rows = {r.check: r for r in move.report.rows if r.joint == "lower" and r.check.startswith(("gearbox", "motor"))}
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert set(names) == {n for n, r in rows.items() if r.margin is not None or r.verdict == "NOT CHECKABLE"}
    lengths = [bar.get_width() for bar in axes.patches]
    assert lengths == pytest.approx([np.clip(rows[n].margin, -1, 3) for n in names if rows[n].margin is not None])


def test_the_tips_budget_is_in_millimetres(move):
    axes = next(axes for title, axes in drawn(move).items() if title.startswith("tip"))
    budget = tip_deflection(BOOM, move.trajectory.q, move.loads.tau)
    np.testing.assert_allclose(curves(axes)["total"][:, 1], 1e3 * budget.total, rtol=1e-12)


def test_a_missions_moves_stand_end_to_end():
    cycle = planned_mission("field-day")
    moves = [samples for leg, samples in cycle.slices() if leg.moves]
    found = panels(BOOM, cycle.trajectory, torques(BOOM, cycle.trajectory), check_cycle(BOOM, cycle), moves)
    lines = [line for line in found["inner: CBG320160"].get_lines() if len(line.get_xdata()) > 2]
    assert len(lines) == len(moves)
    ends = [(line.get_xdata()[0], line.get_xdata()[-1]) for line in lines]
    durations = [leg.trajectory.duration for leg in cycle.legs if leg.moves]
    assert [b - a for a, b in ends] == pytest.approx(durations)
    assert [a for a, _ in ends] == pytest.approx([0.0, *np.cumsum(durations)[:-1]])


def test_without_a_supply_the_running_torque_stands_for_the_curve(move):
    found = curves(drawn(move, with_drives(BOOM, bus_voltage=None))["inner: MST342C02"])
    assert "running torque (the curve needs voltage and wiring)" in found


def test_a_boom_without_motors_has_nothing_to_show(tmp_path, move):
    with pytest.raises(InputError, match="has no motor to show"):
        write_drive_picture(tmp_path / "x.png", without_drives(BOOM), move.trajectory, move.loads.tau, move.report)
    assert not list(tmp_path.iterdir())
