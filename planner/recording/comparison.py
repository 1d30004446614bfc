"""Recording of a measured motion together with its plan."""

from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from boom_model import JOINTS, forward_kinematics
from boom_model.boom import IS_LENGTH
from planner.experiments.comparison import Comparison
from planner.experiments.residuals import Residuals
from planner.recording.before_after import before_after_bundles
from planner.recording.layout import PlotTab, eye_of, scene, shown_beside, text
from planner.recording.palette import JOINT_COLORS, LIMIT_COLOR, PAYLOAD_COLOR, SKY_BLUE
from planner.recording.plots import Bundle, for_people
from planner.recording.scene import (
    PLANNED,
    ground_level,
    log_edges,
    log_motion,
    log_mount,
    log_path,
    log_solids,
    log_surroundings,
)
from planner.recording.stream import log_markdown, save

_LEGEND = "Solid bodies and the light path show the measured motion. Edges and the orange path show the plan."


def write_comparison_recording(path: str | Path, comparison: Comparison, models: Residuals | None = None) -> None:
    """Write the recording of a measured motion and its plan, with its blueprint.

    The entities are those of a move (see `write_recording`), with these differences:

    /world/boom                 the measured motion, with solid bodies; /world/tip_path is the path
                                of its tip
    /world/planned              the planned motion: edges only, frames "planned <body>" in "mount",
                                and the path of its tip
    /plots/<quantity>/<joint>   planned and measured q and tau; measured torques too, where the log
                                has them
    /plots/error/<joint>        measured minus planned position [deg, m]
    /plots/error/tip            distance between the two tips [mm]

    Args:
        path: the .rrd file.
        comparison: the plan and the log at common times.
        models: the log beside two models, whose curves are added on the clock of the plan.

    Raises:
        InputError: the file cannot be written. An existing file is left unchanged.
    """
    boom, planned, measured = comparison.boom, comparison.planned, comparison.measured
    tabs = [PlotTab(name, bundles) for name, bundles in _bundles(comparison).items()]
    more = {} if models is None else before_after_bundles(models)
    named = [PlotTab(f"{name}: before, after", bundles) for name, bundles in more.items() if name != "Torques"]
    tips = [forward_kinematics(boom, motion.q).position for motion in (measured, planned)]
    reached = np.concatenate(tips)

    def log(recording: rr.RecordingStream) -> None:
        right = rrb.Tabs(*(tab.view for tab in (*tabs, *named)), text("report", "Report"), active_tab=0)
        view = scene("Boom [m]", eye_of(boom, planned.q), ground_level(boom, reached))
        recording.send_blueprint(shown_beside(view, right, [1, 1]))
        notes = "\n".join(f"- {note}" for note in (_LEGEND, *comparison.notes))
        log_markdown(recording, "report", notes)
        log_mount(recording, planned.t, None)
        log_solids(recording, boom)
        log_edges(recording, boom, PLANNED)
        log_motion(recording, boom, planned.t, measured.q)
        log_motion(recording, boom, planned.t, planned.q, PLANNED)
        log_surroundings(recording, boom, reached)
        log_path(recording, "world/tip_path", tips[0], PAYLOAD_COLOR)
        log_path(recording, "world/planned/tip_path", tips[1], LIMIT_COLOR)
        for tab in tabs:
            tab.log(recording, planned.t)
        for tab in named:
            assert models is not None
            tab.log(recording, models.t + comparison.offset)

    save(path, f"{boom.name}: measured and planned", log)


def _bundles(c: Comparison) -> dict[str, list[Bundle]]:
    tabs: dict[str, list[Bundle]] = {"Errors": [], "Torques": [], "Positions": []}
    millimetres = c.tip_error[:, None] * 1e3
    tabs["Errors"].append(
        Bundle("plots/error/tip", "distance between the tips [mm]", ["distance [mm]"], [PAYLOAD_COLOR], millimetres)
    )
    for i, joint in enumerate(JOINTS):
        unit, force = ("m", "N") if IS_LENGTH[i] else ("deg", "Nm")
        color, pair = JOINT_COLORS[joint], ["planned", "measured"]
        both = [LIMIT_COLOR, SKY_BLUE]
        positions = np.stack([for_people(i, motion.q[:, i]) for motion in (c.planned, c.measured)], axis=-1)
        tabs["Positions"].append(Bundle(f"plots/q/{joint}", f"{joint} position [{unit}]", pair, both, positions))
        error = for_people(i, c.joint_error[:, i, None])
        title = f"{joint}: measured minus planned [{unit}]"
        tabs["Errors"].append(Bundle(f"plots/error/{joint}", title, ["measured minus planned"], [color], error))
        names, colors, torques = ["planned", "model, from the measured motion"], both, [c.tau_planned, c.tau_measured]
        if c.tau_logged is not None:
            names, colors = [*names, "measured"], [*both, PAYLOAD_COLOR]
            torques.append(c.tau_logged)
        values = np.stack([tau[:, i] for tau in torques], axis=-1)
        name = "force" if IS_LENGTH[i] else "torque"
        tabs["Torques"].append(Bundle(f"plots/tau/{joint}", f"{joint} {name} [{force}]", names, colors, values))
    return tabs
