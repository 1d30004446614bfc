"""First page of a move's report: what was asked, verdict, joints, the boom, torques."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from boom_model import JOINTS, Boom, forward_kinematics, frame_transforms
from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH
from planner.motion.trajectory import Trajectory
from planner.motion.vehicle import VehicleCase
from planner.reports.answer import JOINT_HEADER, answer
from planner.reports.markdown import table
from planner.reports.report import Report

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLORS = dict(zip(JOINTS, ("#666666", "#56b4e9", "#e69f00", "#0072b2", "#cc79a7"), strict=True))
_FARTHEST = "farthest"
_TIMES = (("start", "#bbbbbb"), ("middle", "#7aa6c2"), ("end", "#0072b2"))


def first_page(title: str, asked: str, report: Report) -> str:
    """Return the first page as Markdown.

    Args:
        title: the move.
        asked: payload, vehicle and whatever else was asked for, in a line.
        report: of the move.
    """
    first = answer(report)
    said = first.sentence.partition(": ")[2]
    findings = [*first.findings, *(f"possible fix: {each}" for each in report.suggestions)]
    findings += [f"measured: {each}" for each in report.measured]
    lines = [f"# {title}", "", asked, "", f"**{first.verdict}**: {said}", "", *table(JOINT_HEADER, first.joints), ""]
    lines += [*(f"- {each}" for each in findings), ""]
    lines.append(f"{first.assumed} assumed figures and all {len(report.rows)} checks are at the end.")
    return "\n".join(lines) + "\n"


def circumstances(boom: Boom, vehicle: VehicleCase, report: Report) -> str:
    """Return profile, duration, payload and vehicle of a move in a line."""
    return f"{report.profile}, {conditions(boom, vehicle, report.duration)}"


def conditions(boom: Boom, vehicle: VehicleCase, duration: float) -> str:
    """Return duration, payload and vehicle in a line."""
    ground = "level ground" if vehicle.is_level else vehicle.sentence
    return f"{duration:.3f} s, payload {boom.payload.mass:g} kg, {ground}"


def first_picture(boom: Boom, motion: Trajectory, tau: Array, parts: Sequence[slice] = ()) -> "Figure":
    """Draw the boom at start, middle and end, from the side and above, and torque over time.

    Args:
        boom: the boom.
        motion: its motion.
        tau: joint torques (n, 5) [Nm, N for the extension].
        parts: samples of each move of a mission, drawn one after the other, with the boom where its
            tip is farthest from the start in place of the middle; empty for a single move.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 3.6), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    side, above, torques = figure.subplots(1, 3, width_ratios=[1.0, 1.0, 1.3])
    several = len(parts) > 1
    middle = _farthest(boom, motion.q) if several else len(motion.q) // 2
    q = motion.q[[0, middle, -1]]
    loops = [frame_transforms(boom, q, loop)[..., :3, 3] for loop in ("inner", "outer")]
    times = [(_FARTHEST if several and name == "middle" else name, color) for name, color in _TIMES]
    for k, (name, color) in enumerate(times):
        for loop in loops:
            x, y, z = loop[k].T
            r = np.cos(q[k, 0]) * x + np.sin(q[k, 0]) * y
            side.plot(r, z, color=color, linewidth=2.0)
            above.plot(x, y, color=color, linewidth=2.0)
        side.plot([], [], color=color, label=name)
    side.legend(fontsize=7, frameon=False)
    _label(side, "in the arm's plane", "r [m]", "z [m]")
    _label(above, "from above", "x [m]", "y [m]")
    for i, joint in enumerate(JOINTS):
        unit = "N" if IS_LENGTH[i] else "Nm"
        for k, (t, part) in enumerate(_in_turn(motion.t, parts)):
            torques.plot(t, tau[part, i], color=_COLORS[joint], label=None if k else f"{joint} [{unit}]")
    torques.set_title("torque, the extension's force", fontsize=9)
    torques.set_xlabel("time, one move after the other [s]" if several else "t [s]", fontsize=8)
    torques.tick_params(labelsize=7)
    torques.grid(alpha=0.3, linewidth=0.5)
    torques.legend(fontsize=7, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def _farthest(boom: Boom, q: Array) -> int:
    """Return the first sample at which the tip is farthest from its start."""
    tip = forward_kinematics(boom, q).position
    away = np.linalg.norm(tip - tip[0], axis=-1)
    return int((away > away.max() - 1e-9).argmax())


def _in_turn(t: Array, parts: Sequence[slice]) -> Iterator[tuple[Array, slice]]:
    """Yield the times and the samples of each part, one after the other without gaps."""
    begin = 0.0
    for part in parts or [slice(0, len(t))]:
        own = t[part] - t[part][0]
        yield begin + own, part
        begin += float(own[-1])


def _label(axes: "Axes", title: str, across: str, up: str) -> None:
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title(title, fontsize=9)
    axes.set_xlabel(across, fontsize=8)
    axes.set_ylabel(up, fontsize=8)
    axes.tick_params(labelsize=7)
    axes.grid(alpha=0.3, linewidth=0.5)
