"""Torque-speed plane of each motor with the operating point moving in it."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from boom_model import JOINTS, Basis, Drive
from boom_model.arrays import Array
from boom_model.drives.drive import available_torque, motor_torque
from planner.checks.kinds import CheckKind
from planner.planning import Move
from planner.recording.palette import JOINT_COLORS, LIMIT_COLOR, OUTSIDE_COLOR, PAYLOAD_COLOR, PURPLE, Color
from planner.recording.stream import time_column

WIDTH = 1.6
"""Width of a plane whose height is 1; y points down."""

_RPM = 30.0 / np.pi
_TICKS = 8


@dataclass(frozen=True, eq=False)
class Plane:
    """The operating points of a motor, and the curve that limits them."""

    entity: str
    title: str
    color: Color
    speed: Array
    """(n,) absolute motor speed [rad/s]"""
    torque: Array
    """(n,) absolute motor torque [Nm]"""
    reversed: Array | None
    """(n,) absolute motor torque of the reversed motion [Nm]; None if the checks do not include it.
    """
    curve_speed: Array
    curve: Array
    basis: Basis
    """Basis of the curve."""
    margin: float
    """Margin that the motor's torque needs."""

    @property
    def most(self) -> Array:
        """Speed [rad/s] and torque [Nm] at the far corner of the plane."""
        torques = [self.curve, self.torque, *([] if self.reversed is None else [self.reversed])]
        return np.array([self.curve_speed[-1], 1.08 * max(each.max() for each in torques)])

    def points(self, speed: Array, torque: Array) -> Array:
        """Return the coordinates (n, 2) of speeds [rad/s] and torques [Nm] in the plane."""
        x, y = np.stack([speed, torque], axis=-1).T / self.most[:, None]
        return np.stack([WIDTH * x, 1.0 - y], axis=-1)

    @property
    def view(self) -> rrb.Spatial2DView:
        """View of the plane, with room for the labels of the ticks."""
        bounds = rrb.VisualBounds2D(x_range=(-0.2, WIDTH + 0.1), y_range=(-0.1, 1.2))
        return rrb.Spatial2DView(origin=f"/{self.entity}", name=self.title, visual_bounds=bounds)


def planes(move: Move) -> Iterator[Plane]:
    """Yield the plane of each motor whose curve and torque are known."""
    motion = move.trajectory
    for i, (joint, drive) in enumerate(zip(JOINTS, move.boom.drives, strict=True)):
        if drive is None:
            continue
        speed = drive.gearbox.ratio * np.abs(motion.qd[:, i])
        w = np.linspace(0.0, max(1.25 * float(speed.max()), 30.0), 200)
        curve, torque = available_torque(drive, w), motor_torque(drive, move.loads.tau[:, i], motion.qd[:, i], motion.qdd[:, i])
        if curve is None or torque is None:
            continue
        basis = Basis.weakest([Basis.ESTIMATED, *(origin.basis for origin in drive.supply_origins)])
        title = f"{joint}, {drive.motor.name}: absolute motor torque [Nm] over speed [rpm]{_supply(drive)}"
        back = None
        if any(row.joint == joint and row.kind is CheckKind.MOTOR_TORQUE_REVERSED for row in move.report.rows):
            back = motor_torque(drive, move.loads.tau[:, i], -motion.qd[:, i], motion.qdd[:, i])
        yield Plane(
            entity=f"plane/{joint}",
            title=title,
            color=JOINT_COLORS[joint],
            speed=speed,
            torque=np.abs(torque),
            reversed=None if back is None else np.abs(back),
            curve_speed=w,
            curve=curve,
            basis=basis,
            margin=drive.motor.torque_margin,
        )


def _supply(drive: Drive) -> str:
    if drive.bus_voltage is None or drive.wiring is None:
        return ""
    return f"; {drive.bus_voltage.value:g} V, {drive.wiring.value}"


def log_plane(recording: rr.RecordingStream, t: Array, plane: Plane) -> None:
    """Log the curve, the curve less its margin, the motion, and the operating point over time."""

    def line(name: str, points: Array, color: Color, width: float, label: str | None = None) -> None:
        look = rr.LineStrips2D([points], colors=[color], radii=rr.Radius.ui_points(width))
        recording.log(f"{plane.entity}/{name}", look, static=True)
        if label is not None:
            _text(recording, f"{plane.entity}/{name}/name", points[len(points) // 3] - [0.0, 0.12], label)

    for axis, most, unit in ((0, plane.most[0] * _RPM, "rpm"), (1, plane.most[1], "Nm")):
        for k, value in enumerate(np.arange(0.0, most, _step(most))):
            along = value / most
            ends = [(WIDTH * along, 1.0), (WIDTH * along, 0.0)] if axis == 0 else [(0.0, 1.0 - along), (WIDTH, 1.0 - along)]
            line(f"grid/{unit}/{k}", np.array(ends), OUTSIDE_COLOR, 0.5)
            at = np.array(ends[0]) + ([0.0, 0.05] if axis == 0 else [-0.1, -0.04])
            _text(recording, f"{plane.entity}/grid/{unit}/{k}/value", at, f"{value:g} {unit}")
    curve = plane.points(plane.curve_speed, plane.curve)
    with_margin = plane.points(plane.curve_speed, plane.curve / (1.0 + plane.margin))
    line("available", curve, PAYLOAD_COLOR, 1.2, f"available ({plane.basis})")
    line("with_margin", with_margin, LIMIT_COLOR, 1.2, f"with {plane.margin:.0%} margin")
    if plane.reversed is not None:
        line("reversed", plane.points(plane.speed, plane.reversed), PURPLE, 0.8, "motion reversed")
    points = plane.points(plane.speed, plane.torque)
    line("motion", points, plane.color, 1.2)
    look = rr.Points2D.from_fields(colors=[plane.color], radii=rr.Radius.ui_points(6.0))
    recording.log(f"{plane.entity}/now", look, static=True)
    recording.send_columns(f"{plane.entity}/now", [time_column(t)], rr.Points2D.columns(positions=points))


def _text(recording: rr.RecordingStream, entity: str, at: Array, text: str) -> None:
    look = rr.Points2D([at], colors=[PAYLOAD_COLOR], radii=rr.Radius.ui_points(0.1), labels=[text], show_labels=True)
    recording.log(entity, look, static=True)


def _step(most: float) -> float:
    """Return 1, 2 or 5 times a power of ten that divides `most` into about _TICKS intervals."""
    power = 10.0 ** np.floor(np.log10(most / _TICKS))
    return float(next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= most / _TICKS))
