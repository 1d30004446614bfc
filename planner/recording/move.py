"""Recording of a move: the 3D scene with all its plots and documents."""

from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from boom_model import JOINTS, forward_kinematics
from boom_model.kinematics.reach import ReachMap
from planner.checks.energy import joint_powers
from planner.planning import Move
from planner.recording import drive_plots, joint_plots
from planner.recording.arrows import arrow_scale, log_arrows
from planner.recording.documents import answer_markdown, assumptions_markdown, checks_markdown
from planner.recording.layout import PlotTab, eye_of, scene, shown_beside, text
from planner.recording.legend import legend_view, log_legend
from planner.recording.margin_bars import log_margins, margin_rows, margins_view
from planner.recording.reach import boundary_sentence, log_boundary
from planner.recording.scene import ground_level, log_height, log_motion, log_mount, log_solids, log_surroundings
from planner.recording.states import events_view, lanes, log_events, log_lanes, states_view
from planner.recording.stream import log_markdown, log_properties, save
from planner.recording.torque_ratio import legend, log_tip_path, torque_ratios, worst_ratio
from planner.recording.torque_speed import log_plane, planes

_TEXTS = ("assumptions", "checks", "report")


def write_recording(path: str | Path, move: Move, *, reach: ReachMap | None = None, title: str = "") -> None:
    """Write the recording of a move with its blueprint; `boom view` or `rerun` shows it.

    /world                    z up, the ground; frames are children of "tf#/world" [m]
    /world/mount              frame "mount", which is frame 1 of the boom: tilt and heave of the
                              vehicle; the mounting plate
    /world/boom/<body>        pose of the body over time (frame "<body>" in "mount"), and its solid;
                              also /world/boom/tip
    /world/tip_path           path of the tip, static in "mount"; its colour is the largest torque /
                              limit of the drives
    /world/loads/<arrow>      forces at pins 6, 7 and 8, force and moment on the mount; the title of
                              the view gives the scale
    /world/ground, vehicle    for display only; or /world/keep_out/<shape>, if the boom file defines
                              keep-out shapes
    /world/reach              boundary of the reach in the plane of the arm, if `reach` is given
    /legend                   meaning of the colours of the tip path
    /plots/<quantity>/<joint> q, qd, qdd, tau over time [deg, m, Nm, N]; /plots/q/linkage is theta3
                              - theta2
    /plots/ratio              torque / limit of each driven joint
    /plots/parts/<joint>      gravity, inertia, velocity, payload, friction and vehicle terms, which
                              add up to tau
    /plots/power/<joint>      power at the joint; loss in windings and gearbox, and electrical
                              power, of a drive with data [W]
    /plots/motor/<joint>      motor torque, available torque, and available torque less the stepper
                              margin [Nm]
    /plots/gearbox/<joint>    gearbox torque, its ratings and the average of the cycle [Nm]
    /plots/margin/<joint>     margins of gearbox and motor [%]
    /plots/tip/deflection     tip deflection caused by the drives: its parts and their total [mm]
    /plots/pins               forces at the pins [N]
    /plots/mount/force, moment   of the boom on the mount, along frame 1 [N, Nm]
    .../limits                limits of a plot; constant limits are logged at the two ends of the
                              move only
    /plane/<joint>            torque-speed plane of the motor with the motion, and with the reversed
                              motion if the checks include it; the operating point over time is
                              .../now
    /margins/<joint>          margins of all checks of gearbox and motor, as bars [%]
    /states/phase, limit, brakes     what the move is doing, as lanes over time
    /events                          entries where a limit is met, and of the worst stops
    /answer, /checks, /assumptions, /report   documents in Markdown

    The recording's properties hold verdict, profile, duration, payload, command and versions.

    Args:
        path: the .rrd file.
        move: the move, with its loads and its report.
        reach: reach map to draw as a boundary that yaws with the boom; None draws no boundary.
        title: what moves where, for the first tab; empty for a motion without a name.

    Raises:
        InputError: the file cannot be written. An existing file is left unchanged.
    """
    boom, trajectory, loads, report = move.boom, move.trajectory, move.loads, move.full_report
    ratios = torque_ratios(boom, trajectory, loads.tau)
    torques = PlotTab("Torques", [*joint_plots.torque_plots(boom, trajectory, loads.tau), *joint_plots.ratio_bundles(ratios)])
    motion, drives = _motion_tabs(move), _drive_tabs(move)
    tip = forward_kinematics(boom, trajectory.q).position
    bands = legend(known=bool(ratios))
    motors, scale, worst = list(planes(move)), arrow_scale(loads), worst_ratio(ratios)

    drive_tabs: list[rrb.View | rrb.Container] = [tab.view for tab in drives]
    if motors:
        drive_tabs.insert(0, rrb.Vertical(*(plane.view for plane in motors), name="Torque-speed"))
    bars = {joint: rows for joint in JOINTS if (rows := margin_rows(move, joint))}
    if bars:
        drive_tabs.append(rrb.Vertical(*(margins_view(joint) for joint in bars), name="All margins"))
    tabs: list[rrb.View | rrb.Container] = [
        rrb.Vertical(text("answer", "Answer"), states_view(), events_view(), row_shares=[5, 2, 2], name="Answer"),
        torques.view,
        rrb.Tabs(*(tab.view for tab in motion), active_tab=0, name="Motion"),
        *([rrb.Tabs(*drive_tabs, active_tab=0, name="Drives")] if drive_tabs else []),
        rrb.Tabs(
            *(text(each, each.capitalize()) for each in ("assumptions", "checks", "report")), active_tab=0, name="Assumptions"
        ),
    ]
    left = rrb.Vertical(
        scene(
            "; ".join(["Boom [m]", scale.sentence, *([] if reach is None else [boundary_sentence(reach)])]),
            eye_of(boom, trajectory.q),
            ground_level(boom, tip),
        ),
        legend_view("Path of the tip: largest torque / limit of all drives [-]"),
        row_shares=[8, 1],
    )

    shown = lanes(move)

    def log(recording: rr.RecordingStream) -> None:
        recording.send_blueprint(shown_beside(left, rrb.Tabs(*tabs, active_tab=0), [2, 3]))
        log_properties(recording, boom, report)
        log_markdown(recording, "answer", answer_markdown(move, report, title))
        log_markdown(recording, "report", report.to_markdown())
        log_markdown(recording, "checks", checks_markdown(report))
        log_markdown(recording, "assumptions", assumptions_markdown(boom, report))
        log_mount(recording, trajectory.t, move.vehicle)
        log_lanes(recording, trajectory.t, shown)
        log_events(recording, move, shown)
        log_solids(recording, boom)
        log_motion(recording, boom, trajectory.t, trajectory.q)
        log_height(recording, boom, trajectory.t, tip)
        log_surroundings(recording, boom, tip)
        log_tip_path(recording, tip, worst)
        log_legend(recording, bands)
        log_arrows(recording, boom, trajectory.t, trajectory.q, loads, scale)
        if reach is not None:
            log_boundary(recording, reach)
        for tab in (torques, *motion, *drives):
            tab.log(recording, trajectory.t)
        for plane in motors:
            log_plane(recording, trajectory.t, plane)
        for joint, rows in bars.items():
            log_margins(recording, joint, rows)

    save(path, f"{boom.name}: {report.profile}, {report.duration:.3f} s", log)


def _motion_tabs(move: Move) -> list[PlotTab]:
    """Return the tabs of positions, rates, torque parts, power, and forces at pins and mount."""
    boom, trajectory = move.boom, move.trajectory
    tabs = [
        PlotTab("Positions", joint_plots.position_plots(boom, trajectory)),
        PlotTab("Velocities", joint_plots.velocity_plots(boom, trajectory)),
        PlotTab("Accelerations", joint_plots.acceleration_plots(boom, trajectory)),
        PlotTab("Torque parts", list(joint_plots.part_bundles(move.parts))),
        PlotTab("Power", list(joint_plots.power_bundles(joint_powers(move.sampled)))),
        PlotTab("Pins and mount", list(joint_plots.load_bundles(boom.mount, move.loads))),
    ]
    return [tab for tab in tabs if tab.plots]


def _drive_tabs(move: Move) -> list[PlotTab]:
    """Return the tabs of margins, motors, gearboxes and the tip; none without a drive."""
    tabs = [
        PlotTab("Margins", list(drive_plots.margin_bundles(move))),
        PlotTab("Motors", list(drive_plots.motor_bundles(move))),
        PlotTab("Gearboxes", list(drive_plots.gearbox_bundles(move))),
    ]
    driven = any(tab.plots for tab in tabs)
    return [tab for tab in tabs if tab.plots] + ([PlotTab("Tip", [drive_plots.tip_bundle(move)])] if driven else [])
