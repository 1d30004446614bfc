"""Recording of a reach map: points in the plane of the arm, or a boundary in another scene."""

from pathlib import Path

import numpy as np
import rerun as rr

from boom_model import Boom
from boom_model.arrays import Array
from boom_model.kinematics.frames import frame_transforms
from boom_model.kinematics.reach import ReachMap
from planner.recording.layout import eye_on, scene, shown_beside, text
from planner.recording.palette import GREY, OUTSIDE_COLOR, PAYLOAD_COLOR
from planner.recording.scene import log_motion, log_mount, log_solids
from planner.recording.stream import log_markdown, save
from planner.reports.reach_picture import margin_colors, margin_range, reach_title, reference_pose


def write_reach_recording(path: str | Path, boom: Boom, reach_map: ReachMap) -> None:
    """Write a reach map as points in the vertical plane of the arm, with the boom and a blueprint.

    /world/reach/within_limits   one point per cell; its colour is the torque margin
    /world/reach/outside_limits  cells that the linkage reaches only outside the joint limits
    /world/reach/scale           the colours with their margins
    /reading                     description of the map and its assumptions

    Args:
        path: the .rrd file.
        boom: the boom of the map.
        reach_map: the map.

    Raises:
        InputError: the file cannot be written. An existing file is left unchanged.
    """
    q, pose = reference_pose(boom)
    title = reach_title(boom, reach_map)
    reading = (
        f"{title}\nThe colour of a point is the torque margin [-]; the scale beside the map gives its values. "
        "Orange points are above the limit of a drive. Small grey points are reached only outside the joint limits.\n"
        f"Pose of the boom: {pose}."
    )
    x, z = np.meshgrid(reach_map.r, reach_map.z)
    cells = np.stack([x, np.zeros_like(x), z], axis=-1)
    half = min((float(np.diff(grid).min()) for grid in (reach_map.r, reach_map.z) if grid.size > 1), default=0.02) / 2.0
    shown = np.concatenate([cells[[0, 0, -1, -1], [0, -1, 0, -1]], frame_transforms(boom, q, "outer")[:, :3, 3]])

    def log(recording: rr.RecordingStream) -> None:
        view = scene("Reach [m]", eye_on(shown, 0.0, away=0.85))
        recording.send_blueprint(shown_beside(view, text("reading", "Reading"), [3, 1]))
        log_markdown(recording, "reading", reading.replace("\n", "\n\n"))
        log_mount(recording, np.zeros(1), None)
        log_solids(recording, boom)
        log_motion(recording, boom, np.zeros(1), q[None])
        _log_reach(recording, reach_map, cells, half)

    save(path, title.partition("\n")[0], log)


def log_boundary(recording: rr.RecordingStream, reach_map: ReachMap) -> None:
    """Log the boundary of the reach within the limits, to half a cell.

    It lies in the plane of the arm and yaws with it.
    """
    if not reach_map.within_limits.any():
        return
    strips = [np.stack([line[:, 0], np.zeros(len(line)), line[:, 1]], axis=-1) for line in boundary(reach_map)]
    lines = rr.LineStrips3D(strips, colors=[GREY], radii=[0.004])
    recording.log("world/reach", lines, rr.CoordinateFrame("base"), static=True)


def boundary_sentence(reach_map: ReachMap) -> str:
    """Return a description of the boundary for a title."""
    line = "grey line: reach" if reach_map.within_limits.any() else "no point reachable"
    return f"{line} with constraint {reach_map.constraint}, pitch {np.degrees(reach_map.pitch):.4g} deg"


def boundary(reach_map: ReachMap) -> list[Array]:
    """Return the boundary of the reach as lines (k, 2) of r and z [m].

    The lines run half way between the cells that are reached within the limits and those that are
    not.
    """
    from contourpy import contour_generator

    def beyond(grid: Array) -> Array:
        return np.array([2.0 * grid[0] - grid[1], *grid, 2.0 * grid[-1] - grid[-2]])

    if min(reach_map.within_limits.shape) < 2:
        return []
    reached = np.pad(reach_map.within_limits, 1).astype(float)
    lines = contour_generator(beyond(reach_map.r), beyond(reach_map.z), reached).lines(0.5)
    return [np.asarray(line) for line in lines]


def _log_reach(recording: rr.RecordingStream, reach_map: ReachMap, cells: Array, half: float) -> None:
    """Log the cells (m, n, 3) of a map as points of radius `half` [m], with a colour scale."""

    def log(name: str, points: rr.Points3D) -> None:
        recording.log(f"world/reach/{name}", points, rr.CoordinateFrame("mount"), static=True)

    within, margin = reach_map.within_limits, reach_map.torque_margin
    known = bool(np.isfinite(margin).any())
    between = margin_range(reach_map) if known else (0.0, 1.0)
    colors = margin_colors(margin[within], between).astype(np.uint8)
    log("within_limits", rr.Points3D(cells[within], colors=colors, radii=half))
    outside = cells[reach_map.exists & ~within]
    log("outside_limits", rr.Points3D(outside, colors=OUTSIDE_COLOR, radii=half / 2.0))
    if known:
        levels = np.linspace(*between, 5)
        height = np.linspace(reach_map.z[0], reach_map.z[-1], 5)
        at = np.stack([np.full(5, reach_map.r[-1] + 0.15), np.zeros(5), height], axis=-1)
        colors = margin_colors(levels, between).astype(np.uint8)
        log("scale", rr.Points3D(at, colors=colors, radii=0.06))
        # One colour for all labels: the dark end of the scale is not legible.
        labels = [f"margin {level:.3g}" for level in levels]
        beside = at + np.array([0.25, 0.0, 0.0])
        log("scale/labels", rr.Points3D(beside, colors=PAYLOAD_COLOR, radii=0.001, labels=labels, show_labels=True))
