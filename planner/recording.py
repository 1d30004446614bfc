"""A move as one Rerun file: the moving linkage, every joint's plots beside its limits, the report, and how to show them.

    /world                    z up, the ground; frames hang from "tf#/world" [m]
    /world/mount              frame "mount", which is frame 1 of the boom: tilt and heave of the vehicle, and its plate
    /world/tip_path           the tip's whole path, static in "mount"
    /world/boom/<body>        its pose (frame "<body>" in "mount") over time, and its solid; likewise /world/boom/tip
    /plots/<quantity>/<joint> q, qd, qdd, tau over time, in deg and m, Nm and N; /plots/q/linkage is theta3 - theta2
    /plots/parts/<joint>      gravity, inertia, velocity, payload, friction and vehicle, which add up to tau
    /plots/motor/<joint>      motor torque, what the torque-speed curve leaves, and that with the stepper's margin [Nm]
    /plots/gearbox/<joint>    gearbox torque and its ratings [Nm]
    /plots/tip/deflection     what the drives let the tip deflect, in parts and in all [mm]
    /drives                   the page of `drive_pictures`, where a joint has a motor
    /plots/mount/force, moment   of the boom on the mount, along frame 1 [N, Nm]
    .../limits                the limits beside it; those that do not change with the motion at the move's two ends only
    /report                   the report as Markdown

A designed link's and a reach map's recordings say at their functions what they hold.

The timeline is "t". The linkage comes solved: each body's frame is a child of the mount, because a frame has one parent and
a closed loop cannot be shown. The solids' lengths are the model's, their thickness is for the eye only.
"""

import tempfile
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from scipy.spatial.transform import Rotation

from boom_model import JOINTS, Basis, Boom, Breakdown, Loads, body_transforms, forward_kinematics, tip_deflection
from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH
from boom_model.drives import STEPPER_MARGIN, available_torque, drive_inertia, drive_torque_limit, motor_torque
from boom_model.frames import R_LINK_BODY, frame_transforms
from boom_model.keep_out import Box, KeepOut
from boom_model.reach import ReachMap
from planner.comparison import Comparison
from planner.control.picture import PALETTE, error_figure, loop_figure, png
from planner.control.study import Study
from planner.drive_pictures import drive_picture
from planner.files import replacing
from planner.link_picture import write_link_picture
from planner.link_report import title as link_title
from planner.link_report import to_markdown as link_markdown
from planner.links import LinkDesign
from planner.planning import Move
from planner.reach_picture import margin_colors, margin_range, reach_title, reference_pose
from planner.trajectory import Trajectory
from planner.vehicle import VehicleCase, base_pose

Color = tuple[int, int, int]

# Okabe and Ito's palette, which the colour-blind can tell apart. A joint's line has the colour of the body that it moves.
COLORS: dict[str, Color] = {
    "base": (153, 153, 153),
    "lower": (240, 228, 66),
    "inner": (86, 180, 233),
    "outer": (0, 158, 115),
    "upper": (230, 159, 0),
    "extension": (0, 114, 178),
    "end_effector": (204, 121, 167),
}
JOINT_COLORS = dict(zip(JOINTS, (COLORS[b] for b in ("base", "inner", "lower", "extension", "end_effector")), strict=True))
LIMIT_COLOR: Color = (213, 94, 0)
PIN_COLOR: Color = (60, 60, 60)
PAYLOAD_COLOR: Color = (230, 230, 230)
OUTSIDE_COLOR: Color = (90, 90, 90)

_POSES_AT_ONCE = 20_000
"""Samples whose poses are in memory together; each takes some 3 kB there, and 0.5 kB in the file."""

_STEEL = 7850.0  # [kg/m^3]: the payload is shown as a ball of steel


def write_recording(path: str | Path, move: Move) -> None:
    """Writes a move's recording with its blueprint; `boom view` or `rerun` shows it.

    Args:
        path: the .rrd file.

    Raises:
        InputError: the file cannot be written; an old one is left as it was.
    """
    boom, trajectory, loads, report = move.boom, move.trajectory, move.loads, move.report
    plots = _plots(boom, trajectory, loads)
    bundles = _bundles(move)

    def log(recording: rr.RecordingStream) -> None:
        recording.send_blueprint(_blueprint(_eye(boom, trajectory.q), plots, bundles))
        recording.log("report", rr.TextDocument(report.to_markdown(), media_type="text/markdown"), static=True)
        _log_solids(recording, boom)
        _log_motion(recording, boom, trajectory.t, trajectory.q, move.vehicle)
        for plot in (plot for tab in plots.values() for plot in tab):
            _log_plot(recording, trajectory.t, plot)
        for bundle in (bundle for tab in bundles.values() for bundle in tab):
            _log_bundle(recording, trajectory.t, bundle)
        if bundles.get("Drives"):
            page = rr.EncodedImage(contents=drive_picture(boom, trajectory, loads.tau, report), media_type="image/png")
            recording.log("drives", page, static=True)

    with replacing(path) as temporary:
        Path(temporary).write_bytes(_encoded(f"{boom.name}: {report.profile}, {report.duration:.3f} s", log))


def write_comparison_recording(path: str | Path, comparison: Comparison) -> None:
    """Writes a measured motion over its plan, with its blueprint. The entities are those of a move, but that

    /world/boom             is the measured motion, solid, and /world/tip_path its tip's
    /world/planned          is the planned one, its edges alone; frames "planned <body>" in "mount"; and its tip's path
    /plots/<quantity>/<joint>   q and tau hold both, tau the measured torques too where the log has them
    /plots/error/<joint>    measured less planned, in deg and m; /plots/error/tip the distance of the tips [mm]

    Args:
        path: the .rrd file.

    Raises:
        InputError: the file cannot be written; an old one is left as it was.
    """
    boom, t = comparison.boom, comparison.planned.t
    tabs = _comparison_bundles(comparison)

    def log(recording: rr.RecordingStream) -> None:
        recording.send_blueprint(_blueprint(_eye(boom, comparison.planned.q), {}, tabs))
        notes = "\n".join(f"- {note}" for note in (_COMPARISON_LEGEND, *comparison.notes))
        recording.log("report", rr.TextDocument(notes, media_type="text/markdown"), static=True)
        _log_solids(recording, boom)
        _log_solids(recording, boom, ghost=True)
        _log_motion(recording, boom, t, comparison.measured.q, None)
        _log_motion(recording, boom, t, comparison.planned.q, None, ghost=True)
        for bundle in (bundle for tab in tabs.values() for bundle in tab):
            _log_bundle(recording, t, bundle)

    with replacing(path) as temporary:
        Path(temporary).write_bytes(_encoded(f"{boom.name}: measured and planned", log))


def write_reach_recording(path: str | Path, boom: Boom, reach_map: ReachMap) -> None:
    """Writes a reach map as points in the arm's vertical plane, with the boom standing in it, and its blueprint.

    /world/reach/within_limits   one point a cell, its colour the torque margin
    /world/reach/outside_limits  what the linkage reaches, but only outside the limits
    /world/reach/scale           the colours' margins, labelled
    /reading                     what the map stands on

    Args:
        path: the .rrd file.

    Raises:
        InputError: the file cannot be written; an old one is left as it was.
    """
    q, pose = reference_pose(boom)
    title = reach_title(boom, reach_map)
    reading = (
        f"{title}\nColour of a point: the torque margin [-], by the scale beside the map; orange: above a drive's limit; small "
        f"and grey: only outside the joint limits.\nBoom: {pose}."
    )
    x, z = np.meshgrid(reach_map.r, reach_map.z)
    cells = np.stack([x, np.zeros_like(x), z], axis=-1)
    half = min((float(np.diff(grid).min()) for grid in (reach_map.r, reach_map.z) if grid.size > 1), default=0.02) / 2.0
    shown = np.concatenate([cells[[0, 0, -1, -1], [0, -1, 0, -1]], frame_transforms(boom, q, "outer")[:, :3, 3]])

    def log(recording: rr.RecordingStream) -> None:
        view = rrb.Spatial3DView(origin="/world", name="Reach [m]", eye_controls=_eye_on(shown, 0.0, away=0.85))
        text = rrb.TextDocumentView(origin="/reading", name="Reading")
        recording.send_blueprint(_shown_beside(view, text, [3, 1]))
        recording.log("reading", rr.TextDocument(reading.replace("\n", "\n\n"), media_type="text/markdown"), static=True)
        _log_solids(recording, boom)
        _log_motion(recording, boom, np.zeros(1), q[None], None)
        _log_reach(recording, reach_map, cells, half)

    with replacing(path) as temporary:
        Path(temporary).write_bytes(_encoded(title.partition("\n")[0], log))


def write_link_recording(path: str | Path, design: LinkDesign) -> None:
    """Writes a designed link on the boom along its first move, the joint's torque before and after, the picture and the report.

    /world/boom/<link>/plates    the designed plates, in their own place and thickness, over the linkage's plain solids
    /plots/torque/<link>         the joint's torque with the original link and the designed one
    /picture                     contour, stress, convergence, torque and mass: see `link_picture`
    /report                      the report as Markdown

    Args:
        path: the .rrd file.

    Raises:
        InputError: the file cannot be written; an old one is left as it was.
    """
    boom, trajectory, link = design.after, design.trajectories[0], design.link
    before, after = (torque[: trajectory.t.size] for torque in design.torques)
    joint = JOINTS[design.joint]
    torque = _Bundle(
        f"plots/torque/{link.name}",
        f"{joint} torque [Nm]",
        ["original link [Nm]", "designed link [Nm]"],
        [LIMIT_COLOR, COLORS[link.name]],
        np.stack([before, after], axis=-1),
    )
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "link.png"
        write_link_picture(picture, design)
        image = picture.read_bytes()

    def log(recording: rr.RecordingStream) -> None:
        views = rrb.Tabs(
            rrb.Spatial2DView(origin="/picture", name="Design"),
            rrb.TimeSeriesView(origin=f"/{torque.entity}", name=torque.title),
            rrb.TextDocumentView(origin="/report", name="Report"),
            active_tab=0,
        )
        scene = rrb.Spatial3DView(origin="/world", name="Boom [m]", eye_controls=_eye(boom, trajectory.q))
        recording.send_blueprint(_shown_beside(scene, views, [2, 3]))
        recording.log("report", rr.TextDocument(link_markdown(design), media_type="text/markdown"), static=True)
        recording.log("picture", rr.EncodedImage(contents=image, media_type="image/png"), static=True)
        _log_solids(recording, boom, without=link.name)
        _log_motion(recording, boom, trajectory.t, trajectory.q, None)
        _log_plates(recording, design)
        _log_bundle(recording, trajectory.t, torque)

    with replacing(path) as temporary:
        Path(temporary).write_bytes(_encoded(link_title(design), log))


def _log_plates(recording: rr.RecordingStream, design: LinkDesign) -> None:
    """The plates as boxes, a hundred along the link: a mesh would need normals, and a box shows its edges."""
    link, beam = design.link, design.beam
    edges = np.linspace(0.0, link.length, 101)
    middle = (edges[1:] + edges[:-1]) / 2.0
    half = np.interp(middle, beam.stations, design.heights) / 2.0
    thickness = beam.width / beam.plates
    across = np.linspace(-0.5, 0.5, beam.plates) * link.spacing if beam.plates > 1 else np.zeros(1)
    centers = np.array([(x, 0.0, z) for z in across for x in middle])
    if link.name == "extension":  # from its root to the wrist, where its frame stands
        centers = (centers - [link.length, 0.0, 0.0]) * [-1.0, 1.0, 1.0]
    sizes = np.tile(np.stack([np.diff(edges) / 2.0, half, np.full_like(half, thickness / 2.0)], axis=-1), (beam.plates, 1))
    R = R_LINK_BODY[link.name]
    low, high = (centers - sizes) @ R, (centers + sizes) @ R
    recording.log(
        f"world/boom/{link.name}/plates", _boxes(low, high, COLORS[link.name]), rr.CoordinateFrame(link.name), static=True
    )


def write_control_recording(path: str | Path, study: Study, *, step: float = 0.005) -> None:
    """Writes a study's recording: the boom as the first case moves it, every case's curves, pictures and report.

    /world                                    the boom following the first case
    /tip_error/<profile>/<shaper>             of every controller [mm]
    /cases/<profile>/<controller>/<shaper>/   q/<joint> commanded, link and motor; error/<joint>; tau/<joint> asked and limit
    /pictures/loops, /pictures/errors         Bode, poles and the tip's error as images
    /report                                   the report as Markdown

    Args:
        path: the .rrd file.
        step: sampling step of the curves [s]; a controller's own period would make a file of some 100 MB.

    Raises:
        InputError: the file cannot be written; an old one is left as it was.
    """
    run, boom = study.run, study.boom
    every = slice(None, None, max(1, round(step / float(run.t[1]))))
    t = run.t[every]
    names = [f"{row.profile}/{row.controller}/{row.shaper}" for row in study.rows]
    errors = _tip_errors(study, every)
    tabs = {name: _case_bundles(study, b, every, name) for b, name in enumerate(names)}
    pictures = {"errors": png(error_figure(study))} | ({"loops": png(loop_figure(study))} if study.designs else {})

    def log(recording: rr.RecordingStream) -> None:
        grids = [
            rrb.Grid(*(rrb.TimeSeriesView(origin=f"/{b.entity}", name=b.title) for b in tab), grid_columns=3, name=name)
            for name, tab in tabs.items()
        ]
        images = [rrb.Spatial2DView(origin=f"/pictures/{name}", name=name) for name in pictures]
        report = rrb.TextDocumentView(origin="/report", name="Report")
        views = [rrb.TimeSeriesView(origin=f"/{bundle.entity}", name=bundle.title) for bundle in errors]
        tip = rrb.Vertical(*views, name="Tip error")
        view = rrb.Spatial3DView(origin="/world", name=f"Boom [m], {names[0]}", eye_controls=_eye(boom, run.q[every, 0]))
        recording.send_blueprint(_shown_beside(view, rrb.Tabs(tip, *images, report, *grids, active_tab=0), [1, 2]))
        recording.log("report", rr.TextDocument(study.to_markdown(), media_type="text/markdown"), static=True)
        _log_solids(recording, boom)
        _log_motion(recording, boom, t, run.q[every, 0], study.setup.vehicle)
        for bundle in (*errors, *(bundle for tab in tabs.values() for bundle in tab)):
            _log_bundle(recording, t, bundle)
        for name, content in pictures.items():
            recording.log(f"pictures/{name}", rr.EncodedImage(contents=content, media_type="image/png"), static=True)

    with replacing(path) as temporary:
        Path(temporary).write_bytes(_encoded(f"{boom.name}: closed loop", log))


def _tip_errors(study: Study, every: slice) -> list["_Bundle"]:
    """The tip's error of all controllers, by profile and shaper."""
    groups: dict[tuple[str, str], list[int]] = {}
    for b, row in enumerate(study.rows):
        groups.setdefault((row.profile, row.shaper), []).append(b)
    return [
        _Bundle(
            f"tip_error/{profile}/{shaper}",
            f"{profile}, shaper {shaper}: tip error [mm]",
            [study.rows[b].controller for b in cases],
            PALETTE[: len(cases)],
            1e3 * study.tip_error[every][:, cases],
        )
        for (profile, shaper), cases in groups.items()
    ]


def _case_bundles(study: Study, b: int, every: slice, name: str) -> list["_Bundle"]:
    """Of case b: commanded and actual position, error, and torque with its limit, of each joint."""
    run = study.run
    ours, theirs = COLORS["extension"], COLORS["upper"]
    bundles = []
    for i, joint in enumerate(JOINTS):
        unit, torque = ("m", "N") if IS_LENGTH[i] else ("deg", "Nm")
        q = [_for_people(i, x[every, b, i]) for x in (run.command, run.q, run.motor)]
        limit = run.limit[every, b, i]
        tau, names = [run.torque[every, b, i]], ["asked of the drive"]
        if np.isfinite(limit).all():
            tau += [limit, -limit]
            names += ["motor's limit (estimated)"] * 2
        bundles += [
            _Bundle(
                f"cases/{name}/q/{joint}",
                f"{joint} position [{unit}]",
                ["commanded", "link", "motor"],
                [LIMIT_COLOR, ours, theirs],
                np.stack(q, axis=-1),
            ),
            _Bundle(f"cases/{name}/error/{joint}", f"{joint} error [{unit}]", ["link"], [ours], (q[1] - q[0])[:, None]),
            _Bundle(
                f"cases/{name}/tau/{joint}",
                f"{joint} [{torque}]",
                names,
                [ours, LIMIT_COLOR, LIMIT_COLOR][: len(tau)],
                np.stack(tau, axis=-1),
            ),
        ]
    return bundles


def _log_reach(recording: rr.RecordingStream, reach_map: ReachMap, cells: Array, half: float) -> None:
    """The cells (m, n, 3) of a map as points of radius `half` [m], and the scale of their colours."""

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
        labels = [f"margin {level:.3g}" for level in levels]  # in a colour of their own, as the scale's dark end is not legible
        beside = at + np.array([0.25, 0.0, 0.0])
        log("scale/labels", rr.Points3D(beside, colors=PAYLOAD_COLOR, radii=0.001, labels=labels, show_labels=True))


def _encoded(name: str, log: Callable[[rr.RecordingStream], None]) -> bytes:
    """The whole .rrd of that name, with what `log` puts in.

    It is put together in memory: once a write fails, as on a full disk, Rerun's own file sink (0.41) waits for ever. Each
    recording has an id of its own, as the viewer would merge two that share one.
    """
    strict = rr.strict_mode()
    rr.set_strict_mode(True)  # a misuse of Rerun raises, and is not a line in a log
    try:
        with rr.RecordingStream("boom", recording_id=uuid.uuid4()) as recording:
            memory = recording.memory_recording()
            recording.send_recording_name(name)
            log(recording)
        return memory.drain_as_bytes()
    finally:
        rr.set_strict_mode(strict)


def _time(t: Array) -> rr.TimeColumn:
    return rr.TimeColumn("t", duration=np.rint(t * 1e9).astype("timedelta64[ns]"))


# The linkage


def _log_motion(
    recording: rr.RecordingStream, boom: Boom, t: Array, q: Array, vehicle: VehicleCase | None, ghost: bool = False
) -> None:
    place, prefix, color = ("planned", "planned ", LIMIT_COLOR) if ghost else ("boom", "", PAYLOAD_COLOR)

    def log(entity: str, T: Array, parent: str, child: str, times: Array) -> None:
        motion = rr.Transform3D.columns(
            translation=T[:, :3, 3],
            quaternion=Rotation.from_matrix(T[:, :3, :3]).as_quat(),
            parent_frame=[parent] * len(times),
            child_frame=[child] * len(times),
        )
        recording.send_columns(entity, [_time(times)], motion)

    if not ghost:
        mount = np.eye(4)[None] if vehicle is None else base_pose(vehicle, t)
        log("world/mount", mount, "tf#/world", "mount", t[: len(mount)])
    for start in range(0, len(t), _POSES_AT_ONCE):
        part = slice(start, start + _POSES_AT_ONCE)
        for name, T in body_transforms(boom, q[part]).items():
            log(f"world/{place}/{name}", T, "mount", f"{prefix}{name}", t[part])
    path = rr.LineStrips3D([forward_kinematics(boom, q).position], colors=[color], radii=[0.004])
    recording.log("world/planned/tip_path" if ghost else "world/tip_path", path, rr.CoordinateFrame("mount"), static=True)


def _log_solids(recording: rr.RecordingStream, boom: Boom, ghost: bool = False, *, without: str | None = None) -> None:
    """The solids of the boom, or the edges alone of a second one's: "planned" stands before the names of its frames."""
    place, prefix = ("planned", "planned ") if ghost else ("boom", "")
    fill: Literal["solid", "majorwireframe"] = "majorwireframe" if ghost else "solid"

    def log(name: str, shape: rr.Boxes3D | rr.Cylinders3D | rr.Points3D, frame: str | None = None) -> None:
        recording.log(name, shape, *([] if frame is None else [rr.CoordinateFrame(frame)]), static=True)

    recording.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    log("world/mount", _boxes(np.array([[-0.2, -0.2, -0.02]]), np.array([[0.2, 0.2, 0.0]]), PIN_COLOR), "mount")
    for name, bars in _bars(boom).items():
        if name == without:
            continue
        R = R_LINK_BODY[name]
        low, high = (np.array([corner(bar) for bar in bars]) @ R for corner in (_Bar.low, _Bar.high))
        log(f"world/{place}/{name}", _boxes(low, high, COLORS[name], fill), f"{prefix}{name}")
    if ghost:
        return
    for name, along in _pins(boom).items():
        centers = np.array([(e, 0.0, 0.0) for e in along]) @ R_LINK_BODY[name]
        # A cylinder lies along z, and these bodies' z is the pins' direction n.
        pins = rr.Cylinders3D(centers=centers, lengths=0.16, radii=0.018, colors=PIN_COLOR, fill_mode="solid")
        log(f"world/boom/{name}/pins", pins, name)
    if boom.keep_out is not None:
        _log_keep_out(recording, boom.keep_out)
    if boom.payload.mass > 0.0:
        radius = (boom.payload.mass / _STEEL * 0.75 / np.pi) ** (1.0 / 3.0)
        log("world/boom/tip", rr.Points3D([(0.0, 0.0, 0.0)], radii=radius, colors=PAYLOAD_COLOR), "tip")


def _log_keep_out(recording: rr.RecordingStream, keep_out: KeepOut) -> None:
    """The shapes that the arm keeps away from, as the mount carries them."""
    look: dict[str, Any] = {"colors": [OUTSIDE_COLOR], "fill_mode": "majorwireframe"}
    for shape in keep_out.shapes:
        entity = rr.new_entity_path(["world", "keep_out", shape.name])
        if isinstance(shape, Box):
            solid: Any = rr.Boxes3D(centers=[shape.center], sizes=[shape.size], labels=[shape.name], **look)
        else:
            axis = shape.end - shape.start
            turn, _ = Rotation.align_vectors([axis], [(0.0, 0.0, 1.0)]) if axis.any() else (Rotation.identity(), 0.0)
            solid = rr.Capsules3D(
                lengths=[float(np.linalg.norm(axis))],
                radii=[shape.radius],
                translations=[shape.start],
                quaternions=[turn.as_quat()],
                labels=[shape.name],
                **look,
            )
        recording.log(entity, solid, rr.CoordinateFrame("mount"), static=True)


def _boxes(low: Array, high: Array, color: Color, fill: Literal["solid", "majorwireframe"] = "solid") -> rr.Boxes3D:
    """Boxes between opposite corners, (boxes, 3) each."""
    return rr.Boxes3D(centers=(low + high) / 2.0, half_sizes=np.abs(high - low) / 2.0, colors=color, fill_mode=fill)


@dataclass(frozen=True)
class _Bar:
    """A box in a link's axes (e, p, n): from e[0] to e[1] along the link, p[0] to p[1] across it, depth along the pins [m]."""

    e: tuple[float, float]
    p: tuple[float, float]
    depth: float

    def low(self) -> tuple[float, float, float]:
        return self.e[0], self.p[0], -self.depth / 2.0

    def high(self) -> tuple[float, float, float]:
        return self.e[1], self.p[1], self.depth / 2.0


def _bars(boom: Boom) -> dict[str, list[_Bar]]:
    """The solids of every body. The extension is a rod: `grip` of it shows when retracted, and stays inside at full stroke."""
    g, grip = boom.geometry, 0.05
    rod = max(float(boom.limits.upper[3]) + 2.0 * grip, g.L7)
    return {
        "base": [_Bar((-0.09, 0.09), (0.0, g.L1 - 0.025), 0.18)],
        "lower": [_Bar((0.0, g.L3), (-0.025, 0.025), 0.10)],
        "inner": [_Bar((0.0, g.L9), (-0.025, 0.025), 0.06)],
        "outer": [_Bar((0.0, g.L4), (-0.02, 0.02), 0.05)],
        "upper": [
            _Bar((0.0, g.L5), (-0.025, 0.025), 0.10),
            _Bar((-g.L7 + grip, rod - g.L7), (-g.L6 - 0.03, -g.L6 + 0.03), 0.08),
        ],
        "extension": [_Bar((0.0, rod), (-0.018, 0.018), 0.04)],
        "end_effector": [_Bar((-0.025, 0.025), (-0.025, g.L8), 0.14)],
    }


def _pins(boom: Boom) -> dict[str, tuple[float, ...]]:
    """How far along its link each pin sits [m]: shoulder and 6, 8 and 7, wrist."""
    return {"lower": (0.0, boom.geometry.L3), "upper": (0.0, boom.geometry.L5), "end_effector": (0.0,)}


# The plots


@dataclass(frozen=True, eq=False)
class _Plot:
    """One quantity of one joint in people's units, with the limits beside it."""

    entity: str
    name: str
    unit: str
    color: Color
    values: Array
    limits: Mapping[str, float | Array]
    """Name to value, or values (n,) where it changes with the motion; empty where no limit is known."""
    basis: Basis
    """Of the limits."""

    @property
    def title(self) -> str:
        return f"{self.name} [{self.unit}]"

    @property
    def limit_titles(self) -> list[str]:
        mark = "" if self.basis is Basis.PRINTED else f" ({self.basis})"
        return [f"{name} [{self.unit}]{mark}" for name in self.limits]


def _plots(boom: Boom, trajectory: Trajectory, loads: Loads) -> dict[str, list[_Plot]]:
    """The plots of each tab."""
    limits = boom.limits
    positions = _joint_plots(boom, "q", "position", "", trajectory.q, limits.lower, limits.upper)
    velocities = _joint_plots(boom, "qd", "velocity", "/s", trajectory.qd, -limits.velocity, limits.velocity)
    accelerations = _joint_plots(boom, "qdd", "acceleration", "/s^2", trajectory.qdd, -limits.acceleration, limits.acceleration)
    linkage = _Plot(
        "plots/q/linkage",
        "lower - inner",
        "deg",
        COLORS["upper"],
        np.degrees(trajectory.q[:, 2] - trajectory.q[:, 1]),
        {"lower limit": float(np.degrees(limits.linkage))},
        limits.origins["linkage"][0].basis,
    )
    return {
        "Positions": [*positions, linkage],
        "Velocities": list(velocities),
        "Accelerations": list(accelerations),
        "Torques": list(_torque_plots(boom, trajectory, loads.tau)),
    }


def _joint_plots(boom: Boom, quantity: str, name: str, per: str, values: Array, lower: Array, upper: Array) -> Iterator[_Plot]:
    """One of q, qd and qdd: values (n, 5) between lower and upper (5,), in SI."""
    for i, joint in enumerate(JOINTS):
        low, high = _for_people(i, np.array([lower[i], upper[i]]))
        yield _Plot(
            f"plots/{quantity}/{joint}",
            f"{joint} {name}",
            f"{'m' if IS_LENGTH[i] else 'deg'}{per}",
            JOINT_COLORS[joint],
            _for_people(i, values[:, i]),
            {"lower limit": float(low), "upper limit": float(high)},
            boom.limits.origins[name][i].basis,
        )


def _for_people(joint: int, values: Array) -> Array:
    return values if IS_LENGTH[joint] else np.degrees(values)


def _torque_plots(boom: Boom, trajectory: Trajectory, tau: Array) -> Iterator[_Plot]:
    """Joint torques beside what the drive leaves for them, sample by sample.

    That is -T - J qdd to T - J qdd, with T(qd) what the drive allows at the joint's speed and J its own inertia, which it
    drives too: a curve between its limits is a drive that keeps `drive_torque_limit`.
    """
    for i, (joint, drive) in enumerate(zip(JOINTS, boom.drives, strict=True)):
        limit = None if drive is None else drive_torque_limit(drive, trajectory.qd[:, i])
        limits: dict[str, float | Array] = {}
        if drive is not None and limit is not None:
            own = drive_inertia(drive) * trajectory.qdd[:, i]
            limits = {"drive's lower limit": -limit - own, "drive's upper limit": limit - own}
        basis = Basis.weakest([Basis.ESTIMATED, *([] if drive is None else [o.basis for o in drive.supply_origins])])
        name, unit = ("force", "N") if IS_LENGTH[i] else ("torque", "Nm")
        yield _Plot(f"plots/tau/{joint}", f"{joint} {name}", unit, JOINT_COLORS[joint], tau[:, i], limits, basis)


def _log_plot(recording: rr.RecordingStream, t: Array, plot: _Plot) -> None:
    style = rr.SeriesLines if len(t) > 1 else rr.SeriesPoints  # a line through one sample is not seen
    recording.log(plot.entity, style(names=[plot.title], colors=[plot.color]), static=True)
    recording.send_columns(plot.entity, [_time(t)], rr.Scalars.columns(scalars=plot.values))
    if plot.limits:
        entity, times = f"{plot.entity}/limits", t
        values = np.stack(list(plot.limits.values()), axis=-1)
        if values.ndim == 1:  # what does not change is known by the move's two ends
            times = np.unique(t[[0, -1]])
            values = np.tile(values, (len(times), 1))
        recording.log(entity, style(names=plot.limit_titles, colors=[LIMIT_COLOR] * len(plot.limits)), static=True)
        recording.send_columns(entity, [_time(times)], rr.Scalars.columns(scalars=values))


@dataclass(frozen=True, eq=False)
class _Bundle:
    """Several curves of one kind in one view."""

    entity: str
    title: str
    names: Sequence[str]
    colors: Sequence[Color]
    values: Array
    """(n, curves)"""


_PART_BODIES = ("inner", "outer", "lower", "upper", "base", "end_effector")
PART_COLORS = dict(zip((f.name for f in fields(Breakdown)), (COLORS[b] for b in _PART_BODIES), strict=True))


def _bundles(move: Move) -> dict[str, list[_Bundle]]:
    """The tabs whose views hold several curves: the torques' parts, and the wrench on the mount."""
    parts, total = [getattr(move.parts, name) for name in PART_COLORS], move.parts.total
    names = [*PART_COLORS, "total"]
    tabs: dict[str, list[_Bundle]] = {"Torque parts": [], "Mount": []}
    for i, joint in enumerate(JOINTS):
        unit = "N" if IS_LENGTH[i] else "Nm"
        values = np.stack([part[:, i] for part in (*parts, total)], axis=-1)
        colors = [*PART_COLORS.values(), PAYLOAD_COLOR]
        tabs["Torque parts"].append(_Bundle(f"plots/parts/{joint}", f"{joint} [{unit}]", names, colors, values))
    if move.loads.mount is not None:
        bearable = (move.boom.mount.force, move.boom.mount.moment)
        for (kind, unit, columns), limit in zip(
            (("force", "N", slice(0, 3)), ("moment", "Nm", slice(3, 6))), bearable, strict=True
        ):
            vectors = move.loads.mount[:, columns]
            names, colors = ["x", "y", "z", "size"], [COLORS[b] for b in ("inner", "upper", "end_effector", "base")]
            series = [*vectors.T, np.linalg.norm(vectors, axis=-1)]
            if limit is not None:
                names.append("limit" if limit.origin.basis is Basis.PRINTED else f"limit ({limit.origin.basis})")
                colors.append(LIMIT_COLOR)
                series.append(np.full(len(vectors), limit.value))
            title = f"{kind} on the mount [{unit}]"
            curves = [f"{name} [{unit}]" for name in names]
            tabs["Mount"].append(_Bundle(f"plots/mount/{kind}", title, curves, colors, np.stack(series, axis=-1)))
    if drives := list(_drive_bundles(move)):
        tabs["Drives"] = [*drives, _tip_bundle(move)]
    return tabs


def _drive_bundles(move: Move) -> Iterator[_Bundle]:
    """Each motor's torque beside its curve, and its gearbox's beside its ratings, all as sizes."""
    motion, tau = move.trajectory, np.abs(move.loads.tau)
    for i, (joint, drive) in enumerate(zip(JOINTS, move.boom.drives, strict=True)):
        if drive is None:
            continue
        gear = drive.gearbox
        torque = motor_torque(drive, move.loads.tau[:, i], motion.qd[:, i], motion.qdd[:, i])
        curve = available_torque(drive, gear.ratio * motion.qd[:, i])
        if torque is not None and curve is not None:
            basis = Basis.weakest([Basis.ESTIMATED, *(origin.basis for origin in drive.supply_origins)])
            names = ["torque [Nm]", f"available ({basis}) [Nm]", f"with {STEPPER_MARGIN:.0%} margin ({basis}) [Nm]"]
            values = np.stack([np.abs(torque), curve, curve / (1.0 + STEPPER_MARGIN)], axis=-1)
            colors = [JOINT_COLORS[joint], PAYLOAD_COLOR, LIMIT_COLOR]
            yield _Bundle(f"plots/motor/{joint}", f"{joint}, {drive.motor.name} [Nm]", names, colors, values)
        ratings = {
            "rated": gear.continuous_torque,
            "largest average": gear.max_average_torque,
            "start-stop": gear.start_stop_torque,
        }
        known = {name: value for name, value in ratings.items() if value is not None}
        names = ["torque [Nm]", *(f"{name} [Nm]" for name in known)]
        values = np.stack([tau[:, i], *(np.full(len(tau), value) for value in known.values())], axis=-1)
        colors = [JOINT_COLORS[joint], PAYLOAD_COLOR, COLORS["upper"], LIMIT_COLOR]
        yield _Bundle(f"plots/gearbox/{joint}", f"{joint}, {gear.name} [Nm]", names, colors[: len(names)], values)


def _tip_bundle(move: Move) -> _Bundle:
    """The error budget of the tip [mm]."""
    budget = tip_deflection(move.boom, move.trajectory.q, move.loads.tau)
    parts = [np.linalg.norm(budget.wind_up, axis=-1), budget.hysteresis, budget.backlash, budget.step, budget.total]
    names = [f"{name} [mm]" for name in ("wind-up", "hysteresis", "backlash", "step error", "in all")]
    colors = [COLORS[b] for b in ("inner", "upper", "outer", "end_effector")]
    values = np.stack(parts, axis=-1) * 1e3
    return _Bundle(
        "plots/tip/deflection", "tip's deflection by the drives, at most [mm]", names, [*colors, PAYLOAD_COLOR], values
    )


_COMPARISON_LEGEND = "Solid bodies and the light path: measured. Edges and the orange path: planned."


def _comparison_bundles(c: Comparison) -> dict[str, list[_Bundle]]:
    tabs: dict[str, list[_Bundle]] = {"Errors": [], "Torques": [], "Positions": []}
    millimetres = c.tip_error[:, None] * 1e3
    tabs["Errors"].append(
        _Bundle("plots/error/tip", "distance of the tips [mm]", ["distance [mm]"], [PAYLOAD_COLOR], millimetres)
    )
    for i, joint in enumerate(JOINTS):
        unit, force = ("m", "N") if IS_LENGTH[i] else ("deg", "Nm")
        color, pair = JOINT_COLORS[joint], ["planned", "measured"]
        both = [LIMIT_COLOR, color]
        positions = np.stack([_for_people(i, motion.q[:, i]) for motion in (c.planned, c.measured)], axis=-1)
        tabs["Positions"].append(_Bundle(f"plots/q/{joint}", f"{joint} position [{unit}]", pair, both, positions))
        error = _for_people(i, c.joint_error[:, i, None])
        title = f"{joint}: measured less planned [{unit}]"
        tabs["Errors"].append(_Bundle(f"plots/error/{joint}", title, ["measured less planned"], [color], error))
        names, colors, torques = ["planned", "measured motion, by the model"], both, [c.tau_planned, c.tau_measured]
        if c.tau_logged is not None:
            names, colors = [*names, "measured"], [*both, PAYLOAD_COLOR]
            torques.append(c.tau_logged)
        values = np.stack([tau[:, i] for tau in torques], axis=-1)
        name = "force" if IS_LENGTH[i] else "torque"
        tabs["Torques"].append(_Bundle(f"plots/tau/{joint}", f"{joint} {name} [{force}]", names, colors, values))
    return tabs


def _log_bundle(recording: rr.RecordingStream, t: Array, bundle: _Bundle) -> None:
    style = rr.SeriesLines if len(t) > 1 else rr.SeriesPoints
    recording.log(bundle.entity, style(names=bundle.names, colors=bundle.colors), static=True)
    recording.send_columns(bundle.entity, [_time(t)], rr.Scalars.columns(scalars=bundle.values))


# How it is shown


def _blueprint(
    eye: rrb.EyeControls3D, plots: Mapping[str, Sequence[_Plot]], bundles: Mapping[str, Sequence[_Bundle]]
) -> rrb.Blueprint:
    tabs: list[rrb.View | rrb.Container] = [
        rrb.Grid(*(_plot_view(plot) for plot in tab), grid_columns=2, name=name) for name, tab in plots.items()
    ]
    for name, tab in bundles.items():
        views = [rrb.TimeSeriesView(origin=f"/{bundle.entity}", name=bundle.title) for bundle in tab]
        tabs.append(rrb.Grid(*views, grid_columns=2 if len(views) > 2 else 1, name=name))
    if bundles.get("Drives"):
        tabs.append(rrb.Spatial2DView(origin="/drives", name="Drives' page"))
    report = rrb.TextDocumentView(origin="/report", name="Report")
    boom = rrb.Spatial3DView(origin="/world", name="Boom [m]", eye_controls=eye)
    return _shown_beside(boom, rrb.Tabs(*tabs, report, active_tab=0), [1, 1])


def _shown_beside(left: rrb.View, right: rrb.View | rrb.Container, shares: Sequence[float]) -> rrb.Blueprint:
    return rrb.Blueprint(
        rrb.Horizontal(left, right, column_shares=shares),
        rrb.TimePanel(timeline="t", state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )


def _plot_view(plot: _Plot) -> rrb.TimeSeriesView:
    first, second = plot.values[: len(plot.values) // 2 + 1], plot.values[len(plot.values) // 2 :]
    corner = rrb.Corner2D.LeftBottom if first.min() > second.min() else rrb.Corner2D.RightBottom  # clear of the curve
    return rrb.TimeSeriesView(origin=f"/{plot.entity}", name=plot.title, plot_legend=corner)


def _eye(boom: Boom, q: Array) -> rrb.EyeControls3D:
    """From the boom's right at the middle of its move, a little from above, and far enough off to see all of it."""
    some = q[:: max(1, len(q) // 1000)]
    points = frame_transforms(boom, some, "outer")[..., :3, 3].reshape(-1, 3)
    return _eye_on(points, float(q[len(q) // 2, 0]))


def _eye_on(points: Array, yaw: float, away: float = 1.1) -> rrb.EyeControls3D:
    """From the right of a boom at `yaw`, a little from above, and far enough `away` to see all points (k, 3)."""
    center = (points.min(axis=0) + points.max(axis=0)) / 2.0
    direction = np.array([np.sin(yaw), -np.cos(yaw), 0.5])
    distance = 0.5 + away * float(np.linalg.norm(np.ptp(points, axis=0)))
    eye = center + distance * direction / np.linalg.norm(direction)
    return rrb.EyeControls3D(position=eye, look_target=center, eye_up=(0.0, 0.0, 1.0))
