"""Recording of a row scan: the vehicle drives, the boom works, a map shows what was seen."""

from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from boom_model import Boom
from boom_model.arrays import Array
from planner.field.earth import geodetic_of
from planner.field.extra import library
from planner.field.plots import PlotMap
from planner.field.scan import Scan
from planner.field.scan_report import assumptions, day_line, headline, pass_lines, scan_report, seen_line
from planner.field.scan_timeline import Timeline, seen_so_far, timeline
from planner.field.scan_track import TrackScan
from planner.field.scan_track_report import track_headline, track_report, track_seen
from planner.recording.layout import eye_on, scene, shown_beside, text
from planner.recording.legend import legend_view, log_legend
from planner.recording.palette import GREY, LIGHT, VERMILION, Color
from planner.recording.scene import log_motion, log_mount_poses, log_solids, log_vehicle
from planner.recording.stream import log_markdown, save, time_column
from planner.reports.reach_picture import margin_colors

_STEP = 0.25  # [s]
_MOST_SAMPLES = 12_000
_COUNTS = 400  # of the coverage
_MOUNT = 1.0  # [m] height of the mount over the ground, for display
_SPOT, _TRACK, _EDGE = 0.03, 0.01, 0.01  # [m]
_ON_MAP = 2.0  # pixels
_ZOOM = 19.5  # some 200 m across
_SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)


def write_scan_recording(path: str | Path, boom: Boom, scan: Scan | TrackScan) -> None:
    """Write a scan of rows, or along a log, in east, north, up [m], and a map without network.

    /answer, /report             what was asked and found
    /world/mount, /world/boom    the vehicle and the boom
    /world/plots, /map/plots     coloured by the share seen so far, dark blue to yellow
    /world/footprint             what the sensor sees at the moment; grey where it does not look
    /world/track, /map/track     the mount's way; on the map, where it is

    Args:
        path: the .rrd file.
        boom: the boom of the scan.
        scan: the scan; of one along a log, a line must be reached.

    Raises:
        InputError: the file cannot be written. An existing file is left unchanged.
    """
    line = timeline(boom, scan, max(_STEP, scan.duration / _MOST_SAMPLES))
    seen = seen_so_far(boom, scan, max(1.0, scan.duration / _COUNTS))

    def log(recording: rr.RecordingStream) -> None:
        recording.send_blueprint(_blueprint(line))
        log_markdown(recording, "answer", "\n\n".join([*_answer(scan), *_reading(scan.plots)]))
        log_markdown(recording, "report", track_report(scan) if isinstance(scan, TrackScan) else scan_report(scan))
        log_legend(recording, [(f"{share:.0%}", _color(share)) for share in _SHARES])
        log_mount_poses(recording, line.t, _poses(line))
        log_solids(recording, boom)
        log_vehicle(recording, -_MOUNT, "for display only")
        log_motion(recording, boom, line.t, line.q)
        _log_footprint(recording, boom, scan, line)
        _log_plots(recording, scan.plots, seen.t, seen.share)
        _log_track(recording, scan.plots, line)

    save(path, f"row scan of {scan.plots.source}", log)


def _blueprint(line: Timeline) -> rrb.Blueprint:
    """Return the layout.

    The map asks a server for its background, so it is shown only when its tab is opened.
    """
    around = np.column_stack([line.mount, np.zeros(len(line.t))])
    view = scene("Field: east, north, up [m]", eye_on(around, 0.8, away=0.75))
    middle, size = (around.min(axis=0) + around.max(axis=0)) / 2.0, float(np.ptp(around, axis=0).max())
    above = rrb.EyeControls3D(position=middle + np.array([0.0, -0.01 * size, size]), look_target=middle, eye_up=(0.0, 1.0, 0.0))
    plan = scene("From above, north up", above)
    earth = rrb.MapView(origin="map", name="Map", zoom=_ZOOM)
    told = rrb.Tabs(text("answer", "Answer"), text("report", "Report"), active_tab=0)
    beside = rrb.Vertical(told, rrb.Tabs(plan, earth, active_tab=0), legend_view("Share seen"), row_shares=[3, 4, 1])
    return shown_beside(view, beside, [3, 2])


def _answer(scan: Scan | TrackScan) -> list[str]:
    lost = [f"{name}: {why}" for name, why in scan.unreachable.items()]
    missing = [f"{len(lost)} plots are not reached whole. {lost[0]}." for _ in lost[:1]]
    if isinstance(scan, TrackScan):
        height = "Heights of the mount are those of the log, from their mean on."
        return [
            f"**{track_seen(scan)}.**",
            f"{track_headline(scan)}.",
            *missing,
            *(f"Note: {note}." for note in scan.notes),
            height,
        ]
    return [
        f"**{seen_line(scan)}.**",
        f"{headline(scan)}.",
        f"{day_line(scan)}.",
        *pass_lines(scan),
        *missing,
        f"Assumed: {assumptions(scan)[0]}.",
    ]


def _reading(plots: PlotMap) -> list[str]:
    place = f"{np.degrees(plots.frame.latitude):.7f}, {np.degrees(plots.frame.longitude):.7f} deg"
    return [
        f"The view is in metres from {place}. Plots are coloured by the share seen so far. Vehicle and height of the mount "
        "are for display only.",
        "The tab *Map* shows the same on the earth. Its background needs a network; plots and track do not.",
    ]


def _color(share: float) -> Color:
    red, green, blue = (int(x) for x in margin_colors(np.array([share]), (0.0, 1.0))[0])
    return red, green, blue


def _poses(line: Timeline) -> Array:
    """Return T_field_1 (n, 4, 4), with the mean of the heights at that of the display."""
    T = np.tile(np.eye(4), (len(line.t), 1, 1))
    T[:, :3, :3], T[:, :2, 3] = line.R, line.mount
    T[:, 2, 3] = _MOUNT + line.place[:, 2] - line.place[:, 2].mean()
    return T


def _log_footprint(recording: rr.RecordingStream, boom: Boom, scan: Scan | TrackScan, line: Timeline) -> None:
    corners = line.footprints(boom, scan.task.footprint)
    rings = np.concatenate([corners, corners[:, :1]], axis=1)
    rings = np.concatenate([rings, np.full((*rings.shape[:2], 1), _SPOT)], axis=-1)
    colours = np.where(line.looking[:, None], VERMILION, GREY).astype(np.uint8)
    style = rr.LineStrips3D.from_fields(radii=[_SPOT])
    recording.log("world/footprint", style, static=True)
    recording.send_columns(
        "world/footprint", [time_column(line.t)], rr.LineStrips3D.columns(strips=list(rings), colors=colours)
    )


def _log_plots(recording: rr.RecordingStream, plots: PlotMap, t: Array, share: Array) -> None:
    """Log the plots as triangles in the scene and as outlines on the map, coloured over time."""
    shapely = library("shapely")
    triangles, owner = [], []
    for k, polygon in enumerate(plots.polygons):
        for triangle in shapely.constrained_delaunay_triangles(polygon).geoms:
            triangles.append(np.asarray(triangle.exterior.coords)[:3, :2])
            owner.append(k)
    corners = np.concatenate(triangles)
    flat = np.column_stack([corners, np.zeros(len(corners))])
    up = np.tile([0.0, 0.0, 1.0], (len(corners), 1))
    mesh = rr.Mesh3D(vertex_positions=flat, triangle_indices=np.arange(len(flat)).reshape(-1, 3), vertex_normals=up)
    recording.log("world/plots", mesh, static=True)
    edges = [np.asarray(polygon.exterior.coords)[:, :2] for polygon in plots.polygons]
    strips = [np.column_stack([edge, np.zeros(len(edge))]) for edge in edges]
    recording.log("world/plots/edges", rr.LineStrips3D(strips, colors=[LIGHT], radii=[_EDGE]), static=True)
    rings = [np.degrees(np.vstack([plot[0], plot[0][:1]])) for plot in plots.rings]
    recording.log("map/plots", rr.GeoLineStrings(lat_lon=rings, radii=rr.Radius.ui_points(_ON_MAP)), static=True)
    for at, shares in zip(np.append(0.0, t), np.vstack([np.zeros(share.shape[1]), share]), strict=True):
        colours = margin_colors(shares, (0.0, 1.0)).astype(np.uint8)
        recording.set_time("t", duration=float(at))
        recording.log("world/plots", rr.Mesh3D.from_fields(vertex_colors=np.repeat(colours[owner], 3, axis=0)))
        recording.log("map/plots", rr.GeoLineStrings.from_fields(colors=colours))
    recording.reset_time()


def _log_track(recording: rr.RecordingStream, plots: PlotMap, line: Timeline) -> None:
    way = np.column_stack([line.mount, np.full(len(line.t), _TRACK)])
    recording.log("world/track", rr.LineStrips3D([way], colors=[GREY], radii=[_TRACK]), static=True)
    ecef = plots.frame.ecef(np.column_stack([line.mount, np.zeros(len(line.t))]))
    latitude, longitude, _ = geodetic_of(ecef)
    places = np.degrees(np.column_stack([latitude, longitude]))
    track = rr.GeoLineStrings(lat_lon=[places], colors=[GREY], radii=rr.Radius.ui_points(_ON_MAP / 2.0))
    recording.log("map/track", track, static=True)
    style = rr.GeoPoints.from_fields(colors=[VERMILION], radii=rr.Radius.ui_points(2.0 * _ON_MAP))
    recording.log("map/vehicle", style, static=True)
    recording.send_columns("map/vehicle", [time_column(line.t)], rr.GeoPoints.columns(positions=places))
