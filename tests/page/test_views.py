"""The page's views: each number against another way to it."""

import numpy as np
import pytest

from boom_model import JOINTS, Boom, InfeasibleError, potential_energy, reach_map
from boom_model.drives.drive import drive_torque_limit
from boom_model.kinematics.constraints import parse_constraint
from planner.page.html import complaint, table_html
from planner.page.motion_view import charts, now_view, planes_view, verdict_view
from planner.page.plans import Planned, make_plan
from planner.page.pose_view import fixed, pose_view
from planner.page.state import first_state, solve, with_branches
from planner.page.target_view import branches_html, workspace_html
from planner.page.vehicle import LEVEL_SLOPE, Slope
from planner.page.workspace import workspace
from planner.reports.answer import answer

Q = np.array([0.3, 1.0, 2.6, 0.4, -0.2])


@pytest.fixture(scope="module")
def shipped() -> Boom:
    return Boom.load()


@pytest.fixture(scope="module")
def planned(shipped) -> Planned:
    return make_plan(shipped, first_state(shipped).move, LEVEL_SLOPE)


def figures(boom: Boom, slope: Slope = LEVEL_SLOPE) -> dict[str, float]:
    return {each.name: each.value for each in pose_view(boom, Q, slope).figures}


def test_static_torques_are_the_slope_of_the_potential_energy(shipped):
    step = 1e-5
    slope = [(potential_energy(shipped, Q + d) - potential_energy(shipped, Q - d)) / (2.0 * step) for d in step * np.eye(5)]
    np.testing.assert_allclose([bar.torque for bar in pose_view(shipped, Q, LEVEL_SLOPE).bars], slope, atol=1e-6)


def test_the_mount_bears_the_weight_on_any_slope(shipped):
    weight = (shipped.mass + shipped.payload.mass) * shipped.gravity
    level, tilted = figures(shipped), figures(shipped, Slope(roll=8.0, nose=-5.0))
    assert level["mount_Fz"] == pytest.approx(-weight, rel=1e-12)
    assert np.hypot(np.hypot(tilted["mount_Fx"], tilted["mount_Fy"]), tilted["mount_Fz"]) == pytest.approx(weight, rel=1e-12)
    # With the left side up, the weight points to the boom's right, which is -y; with the nose up,
    # backward, which is -x.
    assert tilted["mount_Fy"] == pytest.approx(-weight * np.cos(np.radians(5.0)) * np.sin(np.radians(8.0)), rel=1e-12)
    assert tilted["mount_Fx"] == pytest.approx(-weight * np.sin(np.radians(5.0)), rel=1e-12)


def test_a_bar_ends_at_what_the_drive_allows_at_standstill(shipped):
    for bar, drive in zip(pose_view(shipped, Q, LEVEL_SLOPE).bars, shipped.drives, strict=True):
        assert bar.limit == (None if drive is None else float(drive_torque_limit(drive, 0.0)))
        assert bar.used == (None if bar.limit is None else abs(bar.torque) / bar.limit)


def test_arrows_are_the_loads_at_their_scale(shipped):
    view, shown = pose_view(shipped, Q, LEVEL_SLOPE), figures(shipped)
    vectors = {name: vector for name, _, vector in view.arrows}
    for pin in (6, 7, 8):
        assert np.linalg.norm(vectors[f"pin_{pin}"]) * view.scale.force == pytest.approx(shown[f"pin_{pin}"], rel=1e-12)
    np.testing.assert_allclose(vectors["mount_moment"] * view.scale.moment, [shown[f"mount_M{a}"] for a in "xyz"], rtol=1e-12)


def test_a_flat_linkage_warns(shipped):
    flat = pose_view(shipped, np.array([0.0, 0.0, np.radians(6.0), 0.0, 0.0]), LEVEL_SLOPE)
    assert [each.name for each in flat.figures if each.warns] == ["transmission"]
    assert not any(each.warns for each in pose_view(shipped, Q, LEVEL_SLOPE).figures)


def test_text_is_escaped():
    assert "<script>" not in complaint("x", "<script>")
    assert "<script>" not in table_html(("<script>",), [("<script>",)], "t")


def test_branches_say_what_speaks_against_them(shipped):
    state = first_state(shipped)
    state = with_branches(state, solve(shipped, state.target, state.q))
    html = branches_html(state.branches)
    assert html.count(">shown<") == 1
    for i, solution in enumerate(state.branches.found.solutions):
        assert fixed(float(np.degrees(solution.q[1])), 2) in html
        assert all(f"branch {i + 1}: {reason}" in html.replace("&#x27;", "'") for reason in solution.reasons)


def test_the_bands_of_the_workspace_are_the_reach_map(shipped):
    constraint, pitch = parse_constraint("extension=0.25"), -np.pi / 2.0
    layer, whole = workspace(shipped, constraint, pitch), reach_map(shipped, constraint, pitch)
    assert len(layer.points) == whole.within_limits.sum()
    np.testing.assert_array_equal(np.sort(layer.margin), np.sort(whole.torque_margin[whole.within_limits]))
    assert f"{len(layer.points)} cells" in workspace_html(layer)


def test_a_workspace_ends_where_its_track_ends_it(shipped):
    seen = []

    def track(steps):
        for step in steps:
            if len(seen) == 3:
                raise InfeasibleError("stopped")
            seen.append(step)
            yield step

    with pytest.raises(InfeasibleError, match="stopped"):
        workspace(shipped, parse_constraint("least-torque"), -np.pi / 2.0, track)


def test_the_motion_view_has_the_lines_of_the_command(planned):
    html, first = verdict_view(planned), answer(planned.move.report)
    assert first.sentence in html
    for row in first.joints:
        assert all(f">{cell}</td>" in html for cell in row)


def test_the_values_at_a_time_are_the_samples(planned):
    k, trajectory = 137, planned.move.trajectory
    html = now_view(planned, float(trajectory.t[k]))
    for i, joint in enumerate(JOINTS):
        assert f">{joint}</td>" in html
        assert fixed(float(planned.move.loads.tau[k, i]), 2) in html
    assert f">{trajectory.t[k]:.3f}<" in html


def test_the_operating_point_is_on_the_plane(planned):
    k, html = 250, planes_view(planned, 2.5)
    (inner, lower) = planned.planes
    ratio = planned.move.boom.drives[1].gearbox.ratio
    speed = ratio * abs(planned.move.trajectory.qd[k, 1]) * 30.0 / np.pi
    assert f'id="speed_inner">{fixed(float(speed), 0)}<' in html
    assert f'id="motor_lower">{fixed(float(lower.torque[k]), 3)}<' in html
    assert html.count("<svg") == 2
    assert inner.torque[k] >= 0.0


def test_the_charts_are_the_torques_with_their_limits(planned):
    torque, used = charts(planned)
    lines = {line.label: line.values for line in torque.lines}
    k = [int(np.abs(planned.move.trajectory.t - t).argmin()) for t in torque.t]
    for i, joint in enumerate(JOINTS):
        np.testing.assert_array_equal(lines[joint], planned.move.loads.tau[k, i])
    assert {"inner allowed", "lower allowed"} < set(lines)
    assert max(line.values.max() for line in used.lines) == 1.0
