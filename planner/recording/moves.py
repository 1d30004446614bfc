"""Recording of several moves: one stick figure for each, and their curves in shared plots."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import cycle
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from boom_model import InputError, forward_kinematics
from planner.planning import Move
from planner.recording import joint_plots
from planner.recording.joint_plots import MOST_RATIO
from planner.recording.layout import eye_of, scene, shown_beside, text
from planner.recording.legend import legend_view, log_legend
from planner.recording.palette import LIMIT_COLOR, MOVE_COLORS
from planner.recording.plots import HIDDEN, Plot, log_curves
from planner.recording.scene import Place, ground_level, log_motion, log_mount, log_path, log_sticks, log_surroundings
from planner.recording.stream import log_markdown, save
from planner.recording.torque_ratio import torque_ratios, worst_ratio


def write_moves_recording(path: str | Path, moves: Mapping[str, Move], reading: str, title: str = "") -> None:
    """Write several moves into one recording, each in its own colour, with a blueprint.

    /world/moves/<name>/<body>   pose of the body over time (frame "<name> <body>" in "mount");
                                 links as lines
    /world/moves/<name>/tip_path path of the tip
    /plots/<quantity>/<joint>/<name>   q, qd, qdd, tau over time; the joint limits in .../limits
    /plots/ratio/<name>          largest torque / limit of all drives
    /legend                      colours of the moves
    /reading                     description of the comparison, as Markdown

    A move that has ended keeps its final pose. The mount does not move, so moves on a vehicle are
    refused.

    Args:
        path: the .rrd file.
        moves: the moves by name.
        reading: description of the comparison in Markdown.
        title: what moves where, for the first tab; may be empty.

    Raises:
        InputError: no move is given, a move is on a vehicle, or the file cannot be written. An
            existing file is left unchanged.
    """
    if not moves:
        raise InputError("moves is empty; give at least one move to record")
    if any(not move.vehicle.is_level for move in moves.values()):
        raise InputError("moves on a vehicle cannot share one recording; record each move separately")
    longest = max(moves.values(), key=lambda move: move.trajectory.duration)
    colors = dict(zip(moves, cycle(MOVE_COLORS), strict=False))
    legend = [*colors.items(), ("limit", LIMIT_COLOR)]
    tips = {name: forward_kinematics(move.boom, move.trajectory.q).position for name, move in moves.items()}
    reached = np.concatenate(list(tips.values()))
    curves = {name: _tabs(move) for name, move in moves.items()}
    shared = _tabs(longest)
    known = {name: worst_ratio(torque_ratios(m.boom, m.trajectory, m.loads.tau)) for name, m in moves.items()}
    ratios = {name: np.minimum(ratio, MOST_RATIO) for name, ratio in known.items() if ratio is not None}

    def log(recording: rr.RecordingStream) -> None:
        name = f"largest torque / limit of all drives, up to {MOST_RATIO:g} [-]"
        ratio = [rrb.TimeSeriesView(origin="/plots/ratio", name=name, plot_legend=HIDDEN)] if ratios else []
        first = rrb.Vertical(text("reading", "Answer"), *ratio, name="Answer")
        torques, *others = (_grid(name, tab, [each[name] for each in curves.values()]) for name, tab in shared.items())
        right = rrb.Tabs(first, torques, rrb.Tabs(*others, active_tab=0, name="Motion"), active_tab=0)
        view = scene(
            "Booms [m]",
            eye_of(longest.boom, *(move.trajectory.q for move in moves.values())),
            ground_level(longest.boom, reached),
        )
        left = rrb.Vertical(view, legend_view("Colours"), row_shares=[8, 1])
        recording.send_blueprint(shown_beside(left, right, [2, 3]))
        log_legend(recording, legend)
        log_markdown(recording, "reading", f"# {title}\n\n{reading}" if title else reading)
        log_mount(recording, longest.trajectory.t, None)
        log_surroundings(recording, longest.boom, reached)
        for tab in shared.values():
            for plot in tab:
                plot.log_limits(recording, longest.trajectory.t)
        for name, move in moves.items():
            t, color = move.trajectory.t, colors[name]
            place = Place(rr.new_entity_path(["world", "moves", name]).lstrip("/"), f"{name} ")
            log_sticks(recording, move.boom, place, color)
            log_motion(recording, move.boom, t, move.trajectory.q, place)
            log_path(recording, place.of("tip_path"), tips[name], color)
            for plot in (plot for tab in curves[name].values() for plot in tab):
                entity = f"{plot.entity}{rr.new_entity_path([name])}"
                log_curves(recording, entity, t, [f"{name} [{plot.unit}]"], [color], plot.values[:, None])
            if name in ratios:
                log_curves(recording, f"plots/ratio{rr.new_entity_path([name])}", t, [name], [color], ratios[name][:, None])
        ends = np.unique(longest.trajectory.t[[0, -1]])
        if ratios:
            log_curves(recording, "plots/ratio/limit", ends, ["limit"], [LIMIT_COLOR], np.ones((len(ends), 1)))

    save(path, f"{longest.boom.name}: {', '.join(moves)}", log)


def _grid(name: str, plots: list[Plot], moves: list[list[Plot]]) -> rrb.Grid:
    """Return a tab of plots; their legend is shown below the scene."""
    views = [
        rrb.TimeSeriesView(
            origin=f"/{plot.entity}",
            name=plot.view_title,
            plot_legend=HIDDEN,
            axis_y=plot.scale(move[k].values for move in moves),
        )
        for k, plot in enumerate(plots)
    ]
    return rrb.Grid(*views, grid_columns=3, name=name)


def _tabs(move: Move) -> dict[str, list[Plot]]:
    """Return the plots that the moves share.

    The drive limits are left out: they depend on the speed of each move.
    """
    boom, trajectory = move.boom, move.trajectory
    torques = joint_plots.torque_plots(boom, trajectory, move.loads.tau)
    return {
        "Torques": [replace(plot, limits={}, without=plot.without or "limits: see Answer") for plot in torques],
        "Positions": joint_plots.position_plots(boom, trajectory),
        "Velocities": joint_plots.velocity_plots(boom, trajectory),
        "Accelerations": joint_plots.acceleration_plots(boom, trajectory),
    }
