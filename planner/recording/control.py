"""Recording of a closed-loop study."""

from dataclasses import dataclass
from itertools import cycle
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from boom_model import JOINTS, forward_kinematics
from boom_model.boom import IS_LENGTH, LOAD_UNITS
from planner.control.picture import error_figure, loop_figure, png
from planner.control.shaping import Shaper
from planner.control.study import Study
from planner.recording.layout import PlotTab, eye_of, scene, shown_beside, text
from planner.recording.palette import LIMIT_COLOR, MOVE_COLORS, PAYLOAD_COLOR, Color
from planner.recording.plots import Bundle, for_people
from planner.recording.scene import ground_level, log_height, log_motion, log_mount, log_path, log_solids, log_surroundings
from planner.recording.stream import log_markdown, log_png, save


def write_control_recording(path: str | Path, study: Study, *, step: float = 0.005, title: str = "") -> None:
    """Write the recording of a study, with its blueprint.

    It shows the boom as the first case moves it, and for each profile and shaper the curves of all
    controllers:

    /world                                    the boom following the first case
    /tip_error/<profile>/<shaper>             tip error of every controller [mm]
    /error/<profile>/<shaper>/<joint>         position of the link minus its command [deg, m]
    /torque/<profile>/<shaper>/<joint>        drive torque and the limit of the motor [Nm, N]
    /pictures/loops, /pictures/errors         Bode plots, poles and tip errors as images
    /report                                   the report as Markdown

    Args:
        path: the .rrd file.
        study: the closed-loop study.
        step: sampling step of the curves [s]. Sampling at the controller's own period would make a
            file of about 100 MB.
        title: what moves where, for the first tab; may be empty.

    Raises:
        InputError: the file cannot be written. An existing file is left unchanged.
    """
    run, boom = study.run, study.boom
    every = slice(None, None, max(1, round(step / float(run.t[1]))))
    t, q, first = run.t[every], run.q[every, 0], study.rows[0]
    errors = PlotTab("Tip error", [_tip_errors(study, every, group) for group in _groups(study)])
    joints = [PlotTab(each.name, _joint_errors(study, every, each), "legends/error") for each in _groups(study)]
    torques = [PlotTab(each.name, _torques(study, every, each), "legends/torque") for each in _groups(study)]
    pictures = {"errors": png(error_figure(study))} | ({"loops": png(loop_figure(study))} if study.designs else {})

    def log(recording: rr.RecordingStream) -> None:
        images = [rrb.Spatial2DView(origin=f"/pictures/{name}", name=name) for name in pictures]
        right = rrb.Tabs(
            text("report", "Answer"),
            errors.view,
            rrb.Tabs(*(tab.view for tab in joints), active_tab=0, name="Joint errors"),
            rrb.Tabs(*(tab.view for tab in torques), active_tab=0, name="Torques"),
            rrb.Tabs(*images, active_tab=0, name="Pictures"),
            active_tab=0,
        )
        tip = forward_kinematics(boom, q).position
        shown = f"Boom [m]: {first.profile}, {first.controller}, shaper {first.shaper}"
        view = scene(shown, eye_of(boom, q), ground_level(boom, tip))
        recording.send_blueprint(shown_beside(view, right, [2, 3]))
        report = study.to_markdown()
        log_markdown(recording, "report", f"{title}\n\n{report}" if title else report)
        log_mount(recording, t, study.setup.vehicle)
        log_solids(recording, boom)
        log_motion(recording, boom, t, q)
        log_height(recording, boom, t, tip)
        log_surroundings(recording, boom, tip)
        log_path(recording, "world/tip_path", tip, PAYLOAD_COLOR)
        for tab in (errors, *joints, *torques):
            tab.log(recording, t)
        for name, content in pictures.items():
            log_png(recording, f"pictures/{name}", content)

    save(path, f"{boom.name}: closed loop", log)


@dataclass(frozen=True)
class _Group:
    """Cases of one profile and one shaper: one for each controller."""

    profile: str
    shaper: str
    cases: list[int]
    controllers: list[str]

    @property
    def name(self) -> str:
        """Name of a tab."""
        return self.profile if self.shaper == Shaper.NONE else f"{self.profile}, {self.shaper}"

    @property
    def colors(self) -> list[Color]:
        """Colour of each case."""
        return [color for color, _ in zip(cycle(MOVE_COLORS), self.cases, strict=False)]

    def entity(self, kind: str, *name: str) -> str:
        """Entity of curves of a kind."""
        return rr.new_entity_path([kind, self.profile, self.shaper, *name]).lstrip("/")


def _groups(study: Study) -> list[_Group]:
    groups: dict[tuple[str, str], list[int]] = {}
    for b, row in enumerate(study.rows):
        groups.setdefault((row.profile, row.shaper), []).append(b)
    return [_Group(*key, cases, [study.rows[b].controller for b in cases]) for key, cases in groups.items()]


def _tip_errors(study: Study, every: slice, group: _Group) -> Bundle:
    values = 1e3 * study.tip_error[every][:, group.cases]
    title = f"{group.profile}, shaper {group.shaper}: tip error [mm]"
    return Bundle(group.entity("tip_error"), title, group.controllers, group.colors, values)


def _joint_errors(study: Study, every: slice, group: _Group) -> list[Bundle]:
    run, bundles = study.run, []
    for i, joint in enumerate(JOINTS):
        error = for_people(i, (run.q - run.command)[every][:, group.cases, i])
        title = f"{joint} error [{'m' if IS_LENGTH[i] else 'deg'}]"
        bundles.append(Bundle(group.entity("error", joint), title, group.controllers, group.colors, error))
    return bundles


def _torques(study: Study, every: slice, group: _Group) -> list[Bundle]:
    """Return the torques, with the least limit that a motor has at the controllers' speeds."""
    run, bundles = study.run, []
    for i, joint in enumerate(JOINTS):
        torque = run.torque[every][:, group.cases, i]
        limit = run.limit[every][:, group.cases, i].min(axis=1)
        names, colors, title = list(group.controllers), list(group.colors), f"{joint} [{LOAD_UNITS[i]}]"
        if np.isfinite(limit).all():
            torque = np.column_stack([torque, limit, -limit])
            names += ["limit of the motor (estimated)"] * 2
            colors += [LIMIT_COLOR] * 2
        else:
            title += ", no drive limits it"
        bundles.append(Bundle(group.entity("torque", joint), title, names, colors, torque))
    return bundles
