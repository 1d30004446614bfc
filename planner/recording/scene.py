"""The linkage in 3D: solids and poses of the bodies, the mount, and the keep-out shapes."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import rerun as rr

from boom_model import Boom, body_transforms
from boom_model.arrays import Array
from boom_model.keep_out import Box, KeepOut
from boom_model.kinematics.frames import R_LINK_BODY
from planner.motion.vehicle import VehicleCase, base_pose
from planner.recording.palette import COLORS, DARK, LIGHT, LIMIT_COLOR, OUTSIDE_COLOR, PAYLOAD_COLOR, PIN_COLOR, Color
from planner.recording.quaternions import quaternions
from planner.recording.solids import PIN_LENGTH, PIN_RADIUS, Bar, corners, payload_radius, pins
from planner.recording.solids import bars as bars_of
from planner.recording.stream import time_column

POSES_AT_ONCE = 20_000
"""Number of samples whose poses are held in memory at a time.

A sample takes about 3 kB in memory and 0.5 kB in the file.
"""

SURROUNDINGS_NOTE = "Ground, vehicle and plot are drawn for display only, because the boom file does not define them."

_GROUND, _BELOW_TIP = 1.0, 0.25  # [m]
_PLOT = (0.6, 1.8)  # [m] half the size of a plot of 1.2 by 3.6 m
_SOIL: Color = (96, 84, 56)
_METAL: Color = (92, 96, 102)
_HEIGHTS = 500


@dataclass(frozen=True)
class Place:
    """Entity and frame names of one boom.

    The frames of the main boom have the bare names of its bodies.
    """

    entity: str = "world/boom"
    prefix: str = ""

    def of(self, body: str) -> str:
        """Return the entity of a body."""
        return f"{self.entity}/{body}"

    def frame(self, body: str) -> str:
        """Return the frame of a body."""
        return f"{self.prefix}{body}"


BOOM = Place()
PLANNED = Place("world/planned", "planned ")
BEFORE = Place("world/before", "before ")
"""A model of the machine before it was measured."""


def log_mount(recording: rr.RecordingStream, t: Array, vehicle: VehicleCase | None) -> None:
    """Log the frame "mount" (frame 1 of the boom) with its plate, moving with the vehicle."""
    T = np.eye(4)[None] if vehicle is None or vehicle.is_level else base_pose(vehicle, t)
    log_mount_poses(recording, t[: len(T)], T)


def log_mount_poses(recording: rr.RecordingStream, t: Array, T: Array) -> None:
    """Log the frame "mount" with its plate, at poses T (n, 4, 4) in the world."""
    recording.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    plate = boxes(np.array([[-0.2, -0.2, -0.02]]), np.array([[0.2, 0.2, 0.0]]), PIN_COLOR)
    recording.log("world/mount", plate, rr.CoordinateFrame("mount"), static=True)
    _log_poses(recording, "world/mount", T, "tf#/world", "mount", t)


def log_motion(recording: rr.RecordingStream, boom: Boom, t: Array, q: Array, place: Place = BOOM) -> None:
    """Log the poses of all bodies and of the tip in "mount", for t (n,) [s] and q (n, 5)."""
    for start in range(0, len(t), POSES_AT_ONCE):
        part = slice(start, start + POSES_AT_ONCE)
        for name, T in body_transforms(boom, q[part]).items():
            _log_poses(recording, place.of(name), T, "mount", place.frame(name), t[part])


def _log_poses(recording: rr.RecordingStream, entity: str, T: Array, parent: str, child: str, t: Array) -> None:
    motion = rr.Transform3D.columns(
        translation=T[:, :3, 3],
        quaternion=quaternions(T[:, :3, :3]),
        parent_frame=[parent] * len(t),
        child_frame=[child] * len(t),
    )
    recording.send_columns(entity, [time_column(t)], motion)


def log_path(recording: rr.RecordingStream, entity: str, positions: Array, color: Color) -> None:
    """Log a path of the tip (n, 3) [m] in "mount", in one colour."""
    strip = rr.LineStrips3D([positions], colors=[color], radii=[0.004])
    recording.log(entity, strip, rr.CoordinateFrame("mount"), static=True)


def log_solids(recording: rr.RecordingStream, boom: Boom, *, without: str | None = None) -> None:
    """Log the solids of the boom: links except `without`, pins and payload."""
    for name, bars in bars_of(boom).items():
        if name == without:
            continue
        _log_bars(recording, BOOM, name, bars, COLORS[name], "solid")
    for name, centers in pins(boom).items():
        # A Rerun cylinder lies along z.
        drawn = rr.Cylinders3D(centers=centers, lengths=PIN_LENGTH, radii=PIN_RADIUS, colors=PIN_COLOR, fill_mode="solid")
        recording.log(BOOM.of(f"{name}/pins"), drawn, rr.CoordinateFrame(name), static=True)
    if boom.payload.mass > 0.0:
        ball = rr.Points3D([(0.0, 0.0, 0.0)], radii=payload_radius(boom), colors=PAYLOAD_COLOR)
        recording.log(BOOM.of("tip"), ball, rr.CoordinateFrame("tip"), static=True)


def log_edges(recording: rr.RecordingStream, boom: Boom, place: Place, color: Color = LIMIT_COLOR) -> None:
    """Log the edges of the links only, for a boom shown together with another."""
    for name, bars in bars_of(boom).items():
        _log_bars(recording, place, name, bars, color, "majorwireframe")


def log_sticks(recording: rr.RecordingStream, boom: Boom, place: Place, color: Color) -> None:
    """Log the links as lines in one colour, for a boom among others."""
    for name, bars in bars_of(boom).items():
        R = R_LINK_BODY[name]
        lines = [np.array([(bar.e[0], p, 0.0), (bar.e[1], p, 0.0)]) @ R for bar in bars for p in (sum(bar.p) / 2.0,)]
        if name in ("base", "end_effector"):  # these are upright
            (bar,) = bars
            lines = [np.array([(0.0, bar.p[0], 0.0), (0.0, bar.p[1], 0.0)]) @ R]
        strips = rr.LineStrips3D(lines, colors=[color], radii=[0.012])
        recording.log(place.of(name), strips, rr.CoordinateFrame(place.frame(name)), static=True)


def ground_level(boom: Boom, tip: Array) -> float:
    """Return the height [m] of the ground drawn where the boom file defines no keep-out shapes.

    It is below all tip positions (n, 3).
    """
    return 0.0 if boom.keep_out is not None else min(-_GROUND, float(tip[:, 2].min()) - _BELOW_TIP)


def log_surroundings(recording: rr.RecordingStream, boom: Boom, tip: Array) -> None:
    """Log the keep-out shapes.

    Without any, log a ground and a vehicle for display, the ground below all tip positions.
    """
    if boom.keep_out is not None:
        _log_keep_out(recording, boom.keep_out)
        return
    ground = ground_level(boom, tip)
    label = "for display only"
    plane = rr.Boxes3D(
        centers=[(0.0, 0.0, ground - 0.01)], half_sizes=[(3.0, 3.0, 0.01)], colors=[(*DARK, 60)], fill_mode="solid",
        labels=[f"ground, {label}"], show_labels=False,
    )  # fmt: skip
    recording.log("world/ground", plane, static=True)
    log_vehicle(recording, ground, label)
    end = tip[-1]
    plot = rr.Boxes3D(
        centers=[(end[0], end[1], ground + 0.005)], half_sizes=[(*_PLOT, 0.005)], colors=[_SOIL], fill_mode="solid",
        labels=[f"breeder plot, {label}"], show_labels=False,
    )  # fmt: skip
    recording.log("world/plot", plot, static=True)


def log_height(recording: rr.RecordingStream, boom: Boom, t: Array, tip: Array) -> None:
    """Log a plumb line from the tip (n, 3) to the ground over time, with its length.

    Nothing is logged for a boom with keep-out shapes, whose ground is not known.
    """
    if boom.keep_out is not None:
        return
    ground, some = ground_level(boom, tip), slice(None, None, max(1, len(t) // _HEIGHTS))
    shown = tip[some]
    lines = np.stack([shown, np.where([False, False, True], ground, shown)], axis=1)
    style = rr.LineStrips3D.from_fields(colors=[LIGHT], radii=[0.004], show_labels=True)
    recording.log("world/height", style, rr.CoordinateFrame("mount"), static=True)
    labels = [f"{height:.2f} m above ground" for height in shown[:, 2] - ground]
    columns = rr.LineStrips3D.columns(strips=list(lines), labels=labels)
    recording.send_columns("world/height", [time_column(t[some])], columns)


def log_vehicle(recording: rr.RecordingStream, ground: float, label: str) -> None:
    """Log a vehicle on wheels behind the mount; its bracket leaves the mount's force in sight."""
    low, high = np.array([-2.7, -0.8, ground + 0.55]), np.array([-0.25, 0.8, -0.02])
    bracket = np.array([[-0.25, -0.2, -0.06], [0.2, 0.2, -0.02]])
    parts = np.array([[low, high], bracket])
    body = rr.Boxes3D(
        centers=parts.mean(axis=1), half_sizes=np.diff(parts, axis=1)[:, 0] / 2.0, colors=[_METAL], fill_mode="solid",
        labels=[f"vehicle, {label}"] * 2, show_labels=False,
    )  # fmt: skip
    recording.log("world/vehicle", body, rr.CoordinateFrame("mount"), static=True)
    radius = 0.5
    at = [(x, y, ground + radius) for x in (low[0] + radius, high[0] - radius) for y in (low[1], high[1])]
    along = np.sqrt([0.5, 0.0, 0.0, 0.5])  # a quarter turn about x
    wheels = rr.Cylinders3D(centers=at, lengths=0.3, radii=radius, quaternions=[along] * 4, colors=PIN_COLOR, fill_mode="solid")
    recording.log("world/vehicle/wheels", wheels, rr.CoordinateFrame("mount"), static=True)


def _log_keep_out(recording: rr.RecordingStream, keep_out: KeepOut) -> None:
    """Log the keep-out shapes, fixed to the mount."""
    from scipy.spatial.transform import Rotation  # slow to import, and few booms have such shapes

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


def boxes(low: Array, high: Array, color: Color, fill: Literal["solid", "majorwireframe"] = "solid") -> rr.Boxes3D:
    """Return boxes between opposite corners, (boxes, 3) each."""
    return rr.Boxes3D(centers=(low + high) / 2.0, half_sizes=np.abs(high - low) / 2.0, colors=color, fill_mode=fill)


def _log_bars(
    recording: rr.RecordingStream,
    place: Place,
    body: str,
    bars: list[Bar],
    color: Color,
    fill: Literal["solid", "majorwireframe"],
) -> None:
    low, high = corners(body, bars)
    recording.log(place.of(body), boxes(low, high, color, fill), rr.CoordinateFrame(place.frame(body)), static=True)
