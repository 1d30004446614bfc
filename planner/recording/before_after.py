"""Recording of a log beside two models of the machine, before and after it was measured."""

from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from boom_model import JOINTS
from boom_model.boom import LOAD_UNITS
from planner.experiments.residuals import Residuals
from planner.recording.layout import PlotTab, eye_of, scene, shown_beside, text
from planner.recording.palette import (
    AFTER_COLOR,
    LIMIT_COLOR,
    PART_COLORS,
    PAYLOAD_COLOR,
    SKY_BLUE,
    VERMILION,
)
from planner.recording.plots import Bundle
from planner.recording.scene import (
    BEFORE,
    ground_level,
    log_edges,
    log_motion,
    log_mount,
    log_path,
    log_solids,
    log_surroundings,
)
from planner.recording.stream import log_markdown, save


def write_before_after_recording(path: str | Path, found: Residuals, report: str) -> None:
    """Write the recording of a log with the models before and after, with its blueprint.

    The entities are those of a move (see `write_recording`), with these differences:

    /world/boom                 the boom as measured, with solid bodies, at the joint positions of
                                the log
    /world/before               the boom before: edges only, frames "before <body>" in "mount"
    /plots/left/<joint>         torque of the log less that of each model; a gap where the joint
                                does not move
    /plots/tau/<joint>          torques of the log and of both models
    /plots/parts/<joint>        change of each part of the torque from the model before to the one
                                after
    /plots/left/tip             distance between the tips of the two models, and the remaining
                                standard deviation of a calibrated boom [mm]

    Args:
        path: the .rrd file.
        found: the log and both models.
        report: Markdown for the tab of the report.

    Raises:
        InputError: the file cannot be written. An existing file is left unchanged.
    """
    after, before = found.after, found.before
    tabs = [PlotTab(name, bundles) for name, bundles in before_after_bundles(found).items()]
    reached = np.concatenate([after.tip, before.tip])

    def log(recording: rr.RecordingStream) -> None:
        right = rrb.Tabs(*(tab.view for tab in tabs), text("report", "Report"), active_tab=0)
        view = scene("Boom [m]", eye_of(after.boom, after.q), ground_level(after.boom, reached))
        recording.send_blueprint(shown_beside(view, right, [1, 1]))
        log_markdown(recording, "report", report)
        log_mount(recording, found.t, None)
        log_solids(recording, after.boom)
        log_edges(recording, before.boom, BEFORE)
        log_motion(recording, after.boom, found.t, after.q)
        log_motion(recording, before.boom, found.t, before.q, BEFORE)
        log_surroundings(recording, after.boom, reached)
        log_path(recording, "world/tip_path", after.tip, PAYLOAD_COLOR)
        log_path(recording, f"{BEFORE.entity}/tip_path", before.tip, LIMIT_COLOR)
        for tab in tabs:
            tab.log(recording, found.t)

    save(path, f"{after.boom.name}: before and after", log)


def before_after_bundles(found: Residuals) -> dict[str, list[Bundle]]:
    """Return the curves of a log and two models, by tab."""
    before, after = found.before, found.after
    left, torques, parts = list[Bundle](), list[Bundle](), list[Bundle]()
    for i, (joint, unit) in enumerate(zip(JOINTS, LOAD_UNITS, strict=True)):
        pair, colors = [f"before [{unit}]", f"after [{unit}]"], [LIMIT_COLOR, AFTER_COLOR]
        values = np.stack([fit.residual[:, i] for fit in (before, after)], axis=-1)
        shown = np.where(found.used[:, i, None], values, np.nan)
        left.append(Bundle(f"plots/left/{joint}", f"{joint}: log less model [{unit}]", pair, colors, shown))
        models = [fit.total[:, i] for fit in (before, after)]
        names = [f"measured [{unit}]", *pair]
        both = np.stack([found.tau[:, i], *models], axis=-1)
        torques.append(Bundle(f"plots/tau/{joint}", f"{joint} [{unit}]", names, [SKY_BLUE, *colors], both))
        changes = {name: (after.parts[name] - before.parts[name])[:, i] for name in after.parts}
        shades = [PART_COLORS.get(name, VERMILION) for name in changes]
        values = np.stack(list(changes.values()), axis=-1)
        parts.append(Bundle(f"plots/parts/{joint}", f"{joint}: after less before [{unit}]", list(changes), shades, values))
    left.append(_tip(found))
    return {"Not explained": left, "Torques": torques, "Parts": parts}


def _tip(found: Residuals) -> Bundle:
    curves, names, colors = [found.apart], ["apart [mm]"], [PAYLOAD_COLOR]
    if found.after.tip_sd is not None:
        curves, names, colors = [*curves, found.after.tip_sd], [*names, "sd after [mm]"], [*colors, AFTER_COLOR]
    return Bundle("plots/left/tip", "tips of the two models [mm]", names, colors, np.stack(curves, axis=-1) * 1e3)
