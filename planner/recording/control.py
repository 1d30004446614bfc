"""Recording of a closed-loop study."""

from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from boom_model import JOINTS, forward_kinematics
from boom_model.boom import IS_LENGTH
from planner.control.picture import PALETTE, error_figure, loop_figure, png
from planner.control.study import Study
from planner.recording.layout import eye_of, scene, shown_beside, text
from planner.recording.palette import COLORS, LIMIT_COLOR, PAYLOAD_COLOR
from planner.recording.plots import Bundle, for_people
from planner.recording.scene import ground_level, log_motion, log_mount, log_path, log_solids, log_surroundings
from planner.recording.stream import log_markdown, log_png, save


def write_control_recording(path: str | Path, study: Study, *, step: float = 0.005) -> None:
    """Write the recording of a study, with its blueprint.

    It shows the boom as the first case moves it, the curves of every case, the pictures and the
    report:

    /world                                    the boom following the first case
    /tip_error/<profile>/<shaper>             tip error of every controller [mm]
    /cases/<profile>/<controller>/<shaper>/   q/<joint>: command, link and motor; error/<joint>;
                                              tau/<joint>: torque and limit
    /pictures/loops, /pictures/errors         Bode plots, poles and tip errors as images
    /report                                   the report as Markdown

    Args:
        path: the .rrd file.
        study: the closed-loop study.
        step: sampling step of the curves [s]. Sampling at the controller's own period would make a
            file of about 100 MB.

    Raises:
        InputError: the file cannot be written. An existing file is left unchanged.
    """
    run, boom = study.run, study.boom
    every = slice(None, None, max(1, round(step / float(run.t[1]))))
    t, q = run.t[every], run.q[every, 0]
    names = [f"{row.profile}/{row.controller}/{row.shaper}" for row in study.rows]
    errors = _tip_errors(study, every)
    tabs = {name: _case_bundles(study, b, every, name) for b, name in enumerate(names)}
    pictures = {"errors": png(error_figure(study))} | ({"loops": png(loop_figure(study))} if study.designs else {})

    def log(recording: rr.RecordingStream) -> None:
        images = [rrb.Spatial2DView(origin=f"/pictures/{name}", name=name) for name in pictures]
        errors_tab = rrb.Vertical(*(bundle.view for bundle in errors), name="Tip error")
        pages = rrb.Tabs(*images, active_tab=0, name="Pictures")
        right = rrb.Tabs(text("report", "Answer"), errors_tab, _cases(study, tabs), pages, active_tab=0)
        tip = forward_kinematics(boom, q).position
        view = scene(f"Boom [m], {names[0]}", eye_of(boom, q), ground_level(boom, tip))
        recording.send_blueprint(shown_beside(view, right, [1, 2]))
        log_markdown(recording, "report", study.to_markdown())
        log_mount(recording, t, study.setup.vehicle)
        log_solids(recording, boom)
        log_motion(recording, boom, t, q)
        log_surroundings(recording, boom, tip)
        log_path(recording, "world/tip_path", tip, PAYLOAD_COLOR)
        for bundle in (*errors, *(bundle for tab in tabs.values() for bundle in tab)):
            bundle.log(recording, t)
        for name, content in pictures.items():
            log_png(recording, f"pictures/{name}", content)

    save(path, f"{boom.name}: closed loop", log)


def _cases(study: Study, tabs: dict[str, list[Bundle]]) -> rrb.Tabs:
    """Return a tab of tabs: a profile, then one of its controllers and shapers."""
    by_profile: dict[str, list[rrb.View | rrb.Container]] = {}
    for row, tab in zip(study.rows, tabs.values(), strict=True):
        name = str(row.controller) if len({each.shaper for each in study.rows}) == 1 else f"{row.controller}, {row.shaper}"
        by_profile.setdefault(row.profile, []).append(rrb.Grid(*(each.view for each in tab), grid_columns=3, name=name))
    profiles = [rrb.Tabs(*grids, active_tab=0, name=profile) for profile, grids in by_profile.items()]
    return rrb.Tabs(*profiles, active_tab=0, name="Cases")


def _tip_errors(study: Study, every: slice) -> list[Bundle]:
    """Return the tip error of all controllers, grouped by profile and shaper."""
    groups: dict[tuple[str, str], list[int]] = {}
    for b, row in enumerate(study.rows):
        groups.setdefault((row.profile, row.shaper), []).append(b)
    return [
        Bundle(
            f"tip_error/{profile}/{shaper}",
            f"{profile}, shaper {shaper}: tip error [mm]",
            [study.rows[b].controller for b in cases],
            PALETTE[: len(cases)],
            1e3 * study.tip_error[every][:, cases],
        )
        for (profile, shaper), cases in groups.items()
    ]


def _case_bundles(study: Study, b: int, every: slice, name: str) -> list[Bundle]:
    """Return position, error and torque with its limit of each joint, for case b."""
    run = study.run
    ours, theirs = COLORS["extension"], COLORS["upper"]
    bundles = []
    for i, joint in enumerate(JOINTS):
        unit, torque = ("m", "N") if IS_LENGTH[i] else ("deg", "Nm")
        q = [for_people(i, x[every, b, i]) for x in (run.command, run.q, run.motor)]
        limit = run.limit[every, b, i]
        tau, names = [run.torque[every, b, i]], ["drive torque"]
        if np.isfinite(limit).all():
            tau += [limit, -limit]
            names += ["motor limit (estimated)"] * 2
        bundles += [
            Bundle(
                f"cases/{name}/q/{joint}",
                f"{joint} position [{unit}]",
                ["commanded", "link", "motor"],
                [LIMIT_COLOR, ours, theirs],
                np.stack(q, axis=-1),
            ),
            Bundle(f"cases/{name}/error/{joint}", f"{joint} error [{unit}]", ["link"], [ours], (q[1] - q[0])[:, None]),
            Bundle(
                f"cases/{name}/tau/{joint}",
                f"{joint} [{torque}]",
                names,
                [ours, LIMIT_COLOR, LIMIT_COLOR][: len(tau)],
                np.stack(tau, axis=-1),
            ),
        ]
    return bundles
