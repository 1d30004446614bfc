"""Recording of a designed link on the boom."""

import tempfile
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from boom_model import JOINTS, forward_kinematics
from boom_model.kinematics.frames import R_LINK_BODY
from planner.links.design import LinkDesign
from planner.links.picture import write_link_picture
from planner.links.report import title, to_markdown
from planner.recording.layout import PlotTab, eye_of, scene, shown_beside, text
from planner.recording.palette import COLORS, LIMIT_COLOR, PAYLOAD_COLOR
from planner.recording.plots import Bundle
from planner.recording.scene import boxes, ground_level, log_motion, log_mount, log_path, log_solids, log_surroundings
from planner.recording.stream import log_markdown, log_png, save


def write_link_recording(path: str | Path, design: LinkDesign) -> None:
    """Write the recording of a designed link along the first of its moves.

    It shows the torque of the joint before and after the change, the picture and the report:

    /world/boom/<link>/plates    the designed plates at their true place and thickness, on the plain
                                 solids of the linkage
    /plots/torque/<link>         torque of the joint with the original and with the designed link
    /picture                     contour, stress, convergence, torque and mass: see `link_picture`
    /report                      the report as Markdown

    Args:
        path: the .rrd file.
        design: the designed link.

    Raises:
        InputError: the file cannot be written. An existing file is left unchanged.
    """
    boom, trajectory, link = design.after, design.trajectories[0], design.link
    before, after = (torque[: trajectory.t.size] for torque in design.torques)
    joint = JOINTS[design.joint]
    torque = Bundle(
        f"plots/torque/{link.name}",
        f"{joint} torque [Nm]",
        ["original link [Nm]", "designed link [Nm]"],
        [LIMIT_COLOR, COLORS[link.name]],
        np.stack([before, after], axis=-1),
    )
    torques = PlotTab("Torque", [torque])
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "link.png"
        write_link_picture(picture, design)
        image = picture.read_bytes()

    def log(recording: rr.RecordingStream) -> None:
        views = rrb.Tabs(
            rrb.Spatial2DView(origin="/picture", name="Design"),
            torques.view,
            text("report", "Report"),
            active_tab=0,
        )
        tip = forward_kinematics(boom, trajectory.q).position
        view = scene("Boom [m]", eye_of(boom, trajectory.q), ground_level(boom, tip))
        recording.send_blueprint(shown_beside(view, views, [2, 3]))
        log_markdown(recording, "report", to_markdown(design))
        log_png(recording, "picture", image)
        log_mount(recording, trajectory.t, None)
        log_solids(recording, boom, without=link.name)
        log_motion(recording, boom, trajectory.t, trajectory.q)
        log_surroundings(recording, boom, tip)
        log_path(recording, "world/tip_path", tip, PAYLOAD_COLOR)
        _log_plates(recording, design)
        torques.log(recording, trajectory.t)

    save(path, title(design), log)


def _log_plates(recording: rr.RecordingStream, design: LinkDesign) -> None:
    """Log each plate as a hundred boxes along the link.

    Boxes show their edges; a mesh would need normals.
    """
    link, beam = design.link, design.beam
    edges = np.linspace(0.0, link.length, 101)
    middle = (edges[1:] + edges[:-1]) / 2.0
    half = np.interp(middle, beam.stations, design.heights) / 2.0
    thickness = beam.width / beam.plates
    across = np.linspace(-0.5, 0.5, beam.plates) * link.spacing if beam.plates > 1 else np.zeros(1)
    centers = np.array([(x, 0.0, z) for z in across for x in middle])
    if link.name == "extension":  # the beam runs from its root to the wrist, where the frame of the extension is
        centers = (centers - [link.length, 0.0, 0.0]) * [-1.0, 1.0, 1.0]
    sizes = np.tile(np.stack([np.diff(edges) / 2.0, half, np.full_like(half, thickness / 2.0)], axis=-1), (beam.plates, 1))
    R = R_LINK_BODY[link.name]
    low, high = (centers - sizes) @ R, (centers + sizes) @ R
    recording.log(
        f"world/boom/{link.name}/plates", boxes(low, high, COLORS[link.name]), rr.CoordinateFrame(link.name), static=True
    )
