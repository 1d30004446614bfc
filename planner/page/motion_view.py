"""What the page shows of a planned motion: verdict, joints, plots, values at one time."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from boom_model import JOINTS
from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH, LOAD_UNITS
from planner.page.html import block, css, lines_html, table_html, verdict_html
from planner.page.plans import Planned
from planner.page.pose_view import fixed
from planner.recording.palette import JOINT_COLORS, LIGHT, LIMIT_COLOR, Color
from planner.recording.torque_ratio import torque_ratios
from planner.recording.torque_speed import Plane
from planner.reports.answer import JOINT_HEADER, answer

PLOT_POINTS = 400
"""Largest number of samples that a plot is drawn with."""
_RPM = 30.0 / np.pi
_WIDE, _HIGH, _LEFT, _BELOW = 310.0, 170.0, 34.0, 22.0  # [px] of a torque-speed plane


@dataclass(frozen=True, eq=False)
class Line:
    """A line of a plot over time."""

    label: str
    values: Array
    color: Color
    dashed: bool = False


@dataclass(frozen=True, eq=False)
class Chart:
    """A plot over time."""

    title: str
    t: Array
    lines: tuple[Line, ...]


def verdict_view(planned: Planned) -> str:
    """Return the answer to a plan, as `boom plan` prints it."""
    move, words = planned.move, planned.words
    first = answer(move.report)
    asked = (
        f"{words.start} to {words.goal}, {move.report.profile}, {move.report.duration:.3f} s, "
        f"payload {move.boom.payload.mass:g} kg"
    )
    notes = [f"note: {note}" for note in move.report.notes]
    count = f"{first.assumed} assumed figures, {len(move.report.rows)} checks; the report lists them"
    joints = table_html(_in_order(JOINT_HEADER), map(_in_order, first.joints), "joints")
    findings = lines_html((*first.findings, *notes, count))
    return block(f'<div id="asked">{escape(asked)}</div>{verdict_html(first.sentence)}{joints}{findings}')


def _in_order(row: Sequence[str]) -> tuple[str, ...]:
    """Return a row of `joint_table` with the verdict second, where a narrow panel shows it."""
    return row[0], row[-1], *row[1:-1]


def now_view(planned: Planned, time: float) -> str:
    """Return the joints' positions, velocities and torques at the sample nearest to a time."""
    k, move = planned.sample(time), planned.move
    limits, rows = move.torque_limits(), []
    for i, joint in enumerate(JOINTS):
        turn = 1.0 if IS_LENGTH[i] else 180.0 / np.pi
        unit = "m" if IS_LENGTH[i] else "deg"
        allowed = "-" if np.isinf(limits[k, i]) else f"{fixed(limits[k, i], 1)} {LOAD_UNITS[i]}"
        rows.append(
            (
                joint,
                f"{fixed(turn * move.trajectory.q[k, i], 4 if IS_LENGTH[i] else 2)} {unit}",
                f"{fixed(turn * move.trajectory.qd[k, i], 4 if IS_LENGTH[i] else 2)} {unit}/s",
                f"{fixed(move.loads.tau[k, i], 2)} {LOAD_UNITS[i]}",
                allowed,
            )
        )
    head = f'<div>at <span id="now">{fixed(float(move.trajectory.t[k]), 3)}</span> s</div>'
    return block(head + table_html(("joint", "position", "velocity", "torque", "drive allows"), rows, "values"))


def charts(planned: Planned) -> tuple[Chart, ...]:
    """Return the torques beside the drives' limits, and the share of every drive that is used."""
    move = planned.move
    some = _some(len(move.trajectory.t))
    t, tau, limits = move.trajectory.t[some], move.loads.tau[some], move.torque_limits()[some]
    torques = [Line(joint, tau[:, i], JOINT_COLORS[joint]) for i, joint in enumerate(JOINTS)]
    for i, joint in enumerate(JOINTS):
        if np.isfinite(limits[:, i]).all():
            torques.append(Line(f"{joint} allowed", limits[:, i], LIMIT_COLOR, dashed=True))
    drawn = [Chart("torque [Nm], extension [N] over t [s]", t, tuple(torques))]
    ratios = torque_ratios(move.boom, move.trajectory, move.loads.tau)
    if ratios:
        used = [Line(joint, ratio[some], JOINT_COLORS[joint]) for joint, ratio in ratios.items()]
        used.append(Line("limit", np.ones(len(t)), LIMIT_COLOR, dashed=True))
        drawn.append(Chart("torque / limit of the drive [-] over t [s]", t, tuple(used)))
    return tuple(drawn)


def planes_view(planned: Planned, time: float) -> str:
    """Return the torque-speed plane of each motor with the operating point at a time, as SVG."""
    k = planned.sample(time)
    return block("".join(_plane(plane, k) for plane in planned.planes))


def _plane(plane: Plane, k: int) -> str:
    some = _some(len(plane.speed))
    lines = (
        (np.stack([plane.curve_speed, plane.curve], -1), css(LIGHT), "available"),
        (np.stack([plane.curve_speed, plane.curve / (1.0 + plane.margin)], -1), css(LIMIT_COLOR), "with margin"),
        (np.stack([plane.speed, plane.torque], -1)[some], css(plane.color), "motion"),
    )
    joint = plane.entity.rpartition("/")[2]
    drawn = [_polyline(_pixels(plane, points), color, name) for points, color, name in lines]
    at = np.array([[plane.speed[k], plane.torque[k]]])
    (x, y), speed, torque = _pixels(plane, at)[0], plane.speed[k] * _RPM, plane.torque[k]
    point = f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="{css(plane.color)}" stroke="white"/>'
    ends = (
        _text(_LEFT, _HIGH - 6.0, "0"),
        _text(_WIDE - 58.0, _HIGH - 6.0, f"{plane.most[0] * _RPM:.0f} rpm"),
        _text(0.0, 10.0, f"{plane.most[1]:.2g}"),
        _text(0.0, 24.0, "Nm"),
    )
    said = (
        f'operating point <span id="speed_{joint}">{fixed(speed, 0)}</span> rpm, '
        f'<span id="motor_{joint}">{fixed(float(torque), 3)}</span> Nm'
    )
    axes = f'<path d="M{_LEFT} 0 V{_HIGH - _BELOW} H{_WIDE}" fill="none" stroke="currentColor" stroke-opacity=".5"/>'
    return (
        f'<div style="margin-top:6px">{escape(plane.title)}; curve {plane.basis}</div>'
        f'<svg role="img" aria-label="{escape(plane.title)}" viewBox="0 0 {_WIDE} {_HIGH}" style="width:100%" '
        f'fill="currentColor" font-size="11">{axes}{"".join(drawn)}{point}{"".join(ends)}</svg><div>{said}</div>'
    )


def _pixels(plane: Plane, points: Array) -> Array:
    x, y = (points / plane.most).T
    return np.stack([_LEFT + (_WIDE - _LEFT) * x, (_HIGH - _BELOW) * (1.0 - y)], axis=-1)


def _polyline(points: Array, color: str, name: str) -> str:
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<polyline points="{path}" fill="none" stroke="{color}" stroke-width="1.5"><title>{name}</title></polyline>'


def _text(x: float, y: float, text: str) -> str:
    return f'<text x="{x}" y="{y}">{escape(text)}</text>'


def _some(count: int) -> Sequence[int]:
    """Return at most PLOT_POINTS sample numbers, evenly spread, with both ends."""
    return [int(k) for k in np.unique(np.linspace(0, count - 1, min(count, PLOT_POINTS)).astype(int))]
