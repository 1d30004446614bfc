"""Recording of geotags: vehicle and boom over the plots in field coordinates, and a map."""

from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from boom_model import Boom, forward_kinematics
from boom_model.arrays import Array
from planner.field.earth import LocalFrame, geodetic_of
from planner.field.plots import Located, PlotMap
from planner.field.rig import Rig
from planner.field.sensor_tags import SensorTags
from planner.recording.layout import eye_on, scene, shown_beside, text
from planner.recording.palette import GREY, OUTSIDE_COLOR, PAYLOAD_COLOR
from planner.recording.scene import log_motion, log_mount_poses, log_solids
from planner.recording.stream import log_markdown, save, time_column
from planner.reports.reach_picture import margin_colors

Indices = NDArray[np.int_]

_WIDTH, _DOT = 0.02, 0.03  # [m]
_ON_MAP = 2.0  # pixels
_ZOOM = 19.0  # some 300 m across


def write_field_recording(
    path: str | Path, boom: Boom, rig: Rig, tags: SensorTags, plots: PlotMap | None = None, located: Located | None = None
) -> None:
    """Write geotags as a scene in east, north, up [m], and an offline map of plots and tracks.

    /world/mount, /world/boom    the boom on the vehicle, at every trigger
    /world/plots                 outlines of the plots, at the height of what was seen
    /world/spots                 what was seen; blue to yellow is the probability of its plot
    /world/track                 the sensor's way
    /map/plots, /map/sensor      the same on the earth
    /reading                     what is shown

    Args:
        path: the .rrd file.
        boom: the boom of the tags.
        rig: the rig of the tags.
        tags: the geotags.
        plots: the map of plots, and with it
        located: the plot of each spot.

    Raises:
        InputError: the file cannot be written. An existing file is left unchanged.
    """
    known = np.flatnonzero(tags.known)
    frame = _frame(tags, plots)
    t = tags.triggers.t[known] - tags.triggers.t[known[0]]
    sensor, corners = frame.enu(tags.sensor.ecef[known]), frame.enu(tags.footprint[known])
    outlines = [] if plots is None else _outlines(plots)
    sure = np.zeros(len(known)) if located is None else located.probability[known]
    reading = (
        f"{len(known)} of {len(tags.triggers.t)} triggers.\n\nEast, north and up in metres from "
        f"{np.degrees(frame.latitude):.7f}, {np.degrees(frame.longitude):.7f} deg, {frame.height:.2f} m. "
        "Footprints on the canopy: the colour is the probability of the plot."
    )

    def log(recording: rr.RecordingStream) -> None:
        view = scene("Field [m]", eye_on(sensor, 0.8, away=1.0))
        beside = rrb.Vertical(rrb.MapView(origin="map", name="Map", zoom=_ZOOM), text("reading", "Reading"), row_shares=[3, 1])
        recording.send_blueprint(shown_beside(view, beside, [3, 2]))
        log_markdown(recording, "reading", reading)
        log_mount_poses(recording, t, _mount_poses(boom, rig, tags, known, sensor))
        log_solids(recording, boom)
        log_motion(recording, boom, t, tags.q[known])
        recording.log("world/plots", rr.LineStrips3D(outlines, colors=[GREY], radii=[_WIDTH]), static=True)
        recording.log("world/track", rr.LineStrips3D([sensor], colors=[PAYLOAD_COLOR], radii=[_WIDTH / 2]), static=True)
        seen = np.isfinite(corners).all(axis=(1, 2))
        colours = margin_colors(sure, (0.0, 1.0)).astype(np.uint8)
        rings = [np.vstack([ring, ring[:1]]) for ring in corners[seen]]
        recording.log("world/spots", rr.LineStrips3D(rings, colors=colours[seen], radii=[_WIDTH / 2]), static=True)
        columns = rr.Points3D.columns(positions=sensor, radii=[_DOT] * len(t), colors=[OUTSIDE_COLOR] * len(t))
        recording.send_columns("world/sensor", [time_column(t)], columns)
        _log_map(recording, tags, known, plots)

    save(path, f"geotags of {tags.triggers.source}", log)


def _frame(tags: SensorTags, plots: PlotMap | None) -> LocalFrame:
    if plots is not None:
        return plots.frame
    latitude, longitude, height = geodetic_of(tags.sensor.ecef[tags.known][0])
    return LocalFrame.at(float(latitude), float(longitude), float(height))


def _outlines(plots: PlotMap) -> list[Array]:
    flat = [np.asarray(polygon.exterior.coords)[:, :2] for polygon in plots.polygons]
    return [np.column_stack([ring, np.zeros(len(ring))]) for ring in flat]


def _mount_poses(boom: Boom, rig: Rig, tags: SensorTags, known: Indices, sensor: Array) -> Array:
    """Return T_field_1 (n, 4, 4), from where the sensor is back down the arm."""
    tip = forward_kinematics(boom, tags.q[known])
    R = tags.sensor.R_enu_body[known] @ rig.R_body_mount
    T = np.tile(np.eye(4), (len(known), 1, 1))
    T[:, :3, :3] = R
    T[:, :3, 3] = sensor - np.einsum("nij,nj->ni", R, tip.position + tip.rotation @ rig.sensor)
    return T


def _log_map(recording: rr.RecordingStream, tags: SensorTags, known: Indices, plots: PlotMap | None) -> None:
    if plots is not None:
        rings = [np.degrees(np.vstack([plot[0], plot[0][:1]])) for plot in plots.rings]
        lines = rr.GeoLineStrings(lat_lon=rings, colors=[GREY], radii=rr.Radius.ui_points(_ON_MAP))
        recording.log("map/plots", lines, static=True)
    latitude, longitude, _ = geodetic_of(tags.sensor.ecef[known])
    points = rr.GeoPoints(
        lat_lon=np.degrees(np.column_stack([latitude, longitude])), colors=[OUTSIDE_COLOR], radii=rr.Radius.ui_points(_ON_MAP)
    )
    recording.log("map/sensor", points, static=True)
