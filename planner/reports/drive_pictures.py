"""Page of the drives: torque-speed planes, gearbox torques, margins, and the tip error budget."""

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from boom_model import JOINTS, Boom, Drive, InputError, tip_deflection
from boom_model.arrays import Array
from boom_model.drives.drive import available_torque, motor_torque
from boom_model.drives.gear_compliance import SURE
from planner.checks.kinds import CheckKind, Part
from planner.checks.rows import Row, Verdict
from planner.files import replacing
from planner.motion.trajectory import Trajectory
from planner.reports.report import Report, cells

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

COLORS = {  # Okabe and Ito's palette, readable with colour blindness
    Verdict.PASS: "#009e73",
    Verdict.WARN: "#e69f00",
    Verdict.FAIL: "#d55e00",
    Verdict.INFO: "#999999",
}
_FORWARD, _REVERSED, _CURVE, _GEOMETRY = "#0072b2", "#56b4e9", "#000000", "#f0e442"
_LONGEST_BAR = 3.0
_WIDTHS = (1.0, 1.0, 0.22, 0.9)
"""Relative widths of the three panels. The third column holds the names of the bars."""
_RPM = 30.0 / np.pi


def write_drive_picture(
    path: str | Path, boom: Boom, trajectory: Trajectory, tau: Array, report: Report, parts: Sequence[slice] = ()
) -> None:
    """Write `drive_picture` to a file.

    Raises:
        InputError: no joint has a motor, or the file cannot be written. An existing file is left
            unchanged.
    """
    with replacing(path) as temporary:
        Path(temporary).write_bytes(drive_picture(boom, trajectory, tau, report, parts))


def drive_picture(boom: Boom, trajectory: Trajectory, tau: Array, report: Report, parts: Sequence[slice] = ()) -> bytes:
    """Return `drive_figure` as a PNG.

    Raises:
        InputError: no joint has a motor.
    """
    picture = BytesIO()
    quickly = {"compress_level": 1}  # the usual level doubles the time, and saves a twentieth of the size
    drive_figure(boom, trajectory, tau, report, parts).savefig(picture, format="png", pil_kwargs=quickly)
    return picture.getvalue()


def drive_figure(boom: Boom, trajectory: Trajectory, tau: Array, report: Report, parts: Sequence[slice] = ()) -> "Figure":
    """Return a figure with a row of three panels for each joint that has a motor.

    The left panel shows the torque-speed plane of the motor with the motion, and with the reversed
    motion if the checks include it. The middle panel shows the gearbox torque over time with its
    ratings. The right panel shows the margins of the joint's checks. The bottom row shows the error
    budget of the tip.

    Args:
        boom: the boom.
        trajectory: the motion.
        tau: (n, 5) torques of the motion.
        report: report of the motion.
        parts: samples of each part to show, one after the other; empty shows the whole motion.

    Raises:
        InputError: no joint has a motor.
    """
    driven = _driven(boom)
    if not driven:
        raise InputError(f"{boom.name} has no motor to show")
    high = 6.0 * len(driven) + 4.2
    figure = _figure(18.0, high)
    ratios = [1.0] * len(driven) + [0.5]
    margin = {"left": 0.04, "right": 0.985, "bottom": 0.85 / high, "top": 1.0 - 0.75 / high}
    grid = figure.add_gridspec(len(ratios), 4, height_ratios=ratios, width_ratios=_WIDTHS, wspace=0.2, hspace=0.4, **margin)
    shown = list(parts) or [slice(0, len(trajectory.t))]
    for k, (i, drive) in enumerate(driven):
        panels = [figure.add_subplot(grid[k, column]) for column in (0, 1, 3)]
        _drive(panels, i, drive, trajectory, tau, report, shown)
    _tip(figure.add_subplot(grid[-1, :]), boom, trajectory, tau, shown)
    title = f"{boom.name}, payload {boom.payload.mass:g} kg: {report.profile}, {report.duration:.3f} s: {report.verdict}"
    figure.suptitle(title, y=1.0 - 0.15 / high, va="top")
    return figure


def drive_pages(
    boom: Boom, trajectory: Trajectory, tau: Array, report: Report, parts: Sequence[slice] = ()
) -> dict[str, "Figure"]:
    """Return the panels of `drive_figure` as separate figures by title.

    There is one figure for each joint that has a motor, and one for the tip. The result is empty if
    no joint has a motor.
    """
    shown, driven = list(parts) or [slice(0, len(trajectory.t))], _driven(boom)
    pages = {}
    for i, drive in driven:
        figure = pages[f"Drive of {JOINTS[i]}"] = _figure(15.5, 9.6)
        grid = figure.add_gridspec(1, 4, width_ratios=_WIDTHS, wspace=0.22, left=0.05, right=0.985, bottom=0.18, top=0.95)
        panels = [figure.add_subplot(grid[0, column]) for column in (0, 1, 3)]
        _drive(panels, i, drive, trajectory, tau, report, shown)
    if driven:
        figure = pages["Tip"] = _figure(12.0, 7.4)
        axes = figure.add_subplot()
        figure.subplots_adjust(left=0.06, right=0.985, bottom=0.2, top=0.95)
        _tip(axes, boom, trajectory, tau, shown)
    return pages


def _driven(boom: Boom) -> list[tuple[int, Drive]]:
    return [(i, drive) for i, drive in enumerate(boom.drives) if drive is not None]


def _figure(width: float, height: float) -> "Figure":
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=90)
    FigureCanvasAgg(figure)
    return figure


def _drive(
    panels: "Sequence[Axes]",
    i: int,
    drive: Drive,
    trajectory: Trajectory,
    tau: Array,
    report: Report,
    shown: Sequence[slice],
) -> None:
    plane, gearbox, margins = panels
    rows = [row for row in report.rows if row.joint == JOINTS[i] and row.kind.part in (Part.GEARBOX, Part.MOTOR)]
    _plane(plane, drive, JOINTS[i], tau[:, i], trajectory.qd[:, i], trajectory.qdd[:, i], rows)
    _gearbox(gearbox, drive, JOINTS[i], trajectory.t, tau[:, i], shown, rows)
    _margins(margins, JOINTS[i], rows)


def _plane(axes: "Axes", drive: Drive, joint: str, tau: Array, qd: Array, qdd: Array, rows: Sequence[Row]) -> None:
    speed = drive.gearbox.ratio * np.abs(qd)
    for sign, color, name in ((1.0, _FORWARD, "motion"), (-1.0, _REVERSED, "motion reversed")):
        if sign < 0.0 and not any(row.kind is CheckKind.MOTOR_TORQUE_REVERSED for row in rows):
            continue
        torque = motor_torque(drive, tau, sign * qd, qdd)
        if torque is not None:
            axes.plot(speed * _RPM, np.abs(torque), ".", color=color, markersize=2.5, label=name)
    fastest = max(1.25 * float(speed.max()), 30.0)
    w = np.linspace(0.0, fastest, 400)
    curve, running = available_torque(drive, w), drive.motor.running_torque
    if curve is not None:
        supply = (
            ""
            if drive.bus_voltage is None or drive.wiring is None
            else (
                f", {drive.bus_voltage.value:g} V {drive.wiring.value} "
                f"({', '.join(dict.fromkeys(str(o.basis) for o in drive.supply_origins))})"
            )
        )
        axes.plot(w * _RPM, curve, color=_CURVE, label=f"available (estimated{supply})")
        if margin := drive.motor.torque_margin:
            axes.plot(w * _RPM, curve / (1.0 + margin), "--", color=_CURVE, label=f"with {margin:.0%} margin")
    elif running is not None:
        axes.axhline(running, color=_CURVE, linestyle=":", label="running torque (the curve needs voltage and wiring)")
    axes.set(title=f"{joint}: {drive.motor.name}", xlabel="motor speed [rpm]", ylabel="absolute motor torque [Nm]")
    axes.set_xlim(0.0, fastest * _RPM)
    axes.set_ylim(bottom=0.0)
    axes.grid(alpha=0.25)
    _legend_below(axes, 1)


def _gearbox(axes: "Axes", drive: Drive, joint: str, t: Array, tau: Array, parts: Sequence[slice], rows: Sequence[Row]) -> None:
    _over_time(axes, t, np.abs(tau)[:, None], parts, ["absolute torque"], [_FORWARD])
    gear = drive.gearbox
    ratings = (
        ("rated", gear.continuous_torque, COLORS[Verdict.PASS]),
        ("largest average", gear.max_average_torque, COLORS[Verdict.WARN]),
        ("start-stop", gear.start_stop_torque, COLORS[Verdict.FAIL]),
    )
    for name, value, color in ratings:
        if value is not None:
            axes.axhline(value, color=color, linewidth=1.5, label=f"{name} {value:g} Nm")
    average = next((row.demand for row in rows if row.kind is CheckKind.GEARBOX_AVERAGE), None)
    if average is not None:
        axes.axhline(average, color=_CURVE, linestyle="--", label=f"average of the cycle {average:.0f} Nm")
    axes.set(title=f"{joint}: {gear.name}", ylabel="absolute gearbox torque [Nm]")
    axes.set_ylim(bottom=0.0)
    _legend_below(axes, 2)


def _tip(axes: "Axes", boom: Boom, trajectory: Trajectory, tau: Array, parts: Sequence[slice]) -> None:
    """Draw the error budget of the tip over time: its parts and their sum."""
    budget = tip_deflection(boom, trajectory.q, tau)
    values = [np.linalg.norm(budget.wind_up, axis=-1), budget.hysteresis, budget.backlash, budget.step]
    names = ["wind-up", "hysteresis", "backlash", "step error"]
    colors = [_FORWARD, COLORS[Verdict.WARN], COLORS[Verdict.PASS], "#cc79a7"]
    by = "caused by the drives"
    if boom.calibration is not None:
        values, by = [*values, SURE * budget.geometry], "by drives and measured geometry"
        names, colors = [*names, f"geometry, {SURE:g} sd"], [*colors, _GEOMETRY]
    values, names, colors = [*values, budget.total], [*names, "total"], [*colors, _CURVE]
    _over_time(axes, trajectory.t, np.stack(values, axis=-1) * 1e3, parts, names, colors)
    missing = " (parts without data are left out)" if budget.uncounted else ""
    axes.set(title=f"tip deflection {by}{missing}", ylabel="largest deflection [mm]")
    axes.set_ylim(bottom=0.0)
    _legend_below(axes, len(names), gap=0.17)


def _over_time(
    axes: "Axes", t: Array, values: Array, parts: Sequence[slice], names: Sequence[str], colors: Sequence[str]
) -> None:
    """Draw curves (n, k) over the time of the parts, one after the other."""
    begin = 0.0
    for k, part in enumerate(parts):
        local = t[part] - t[part][0]
        for curve, name, color in zip(values[part].T, names, colors, strict=True):
            axes.plot(local + begin, curve, color=color, label=name if k == 0 else None)
        begin += float(local[-1])
        if k + 1 < len(parts):
            axes.axvline(begin, color="#cccccc", linewidth=0.8)
    axes.set_xlabel("time, one move after the other [s]" if len(parts) > 1 else "time [s]")
    axes.grid(alpha=0.25)


def _margins(axes: "Axes", joint: str, rows: Sequence[Row]) -> None:
    """Draw a bar per row with a tick at the required margin.

    Its length is the margin, up to _LONGEST_BAR.
    """
    from matplotlib.patches import Patch

    shown = [row for row in rows if row.margin is not None or row.verdict is Verdict.NOT_CHECKABLE]
    for y, row in enumerate(shown):
        if row.margin is None:
            axes.text(0.02, y, "NOT CHECKABLE", va="center", fontsize=8, color="#cc79a7")
            continue
        length = float(np.clip(row.margin, -1.0, _LONGEST_BAR))
        axes.barh(y, length, color=COLORS[row.verdict], height=0.7)
        text: dict[str, Any] = {"va": "center", "fontsize": 8}
        axes.text(max(length, 0.0) + 0.04, y, cells(row)[4], **text)
        if row.required_margin:
            axes.plot([row.required_margin] * 2, [y - 0.42, y + 0.42], color=_CURVE, linewidth=2.0)
    axes.set_yticks(range(len(shown)), [row.check for row in shown], fontsize=8)
    axes.invert_yaxis()
    axes.axvline(0.0, color=_CURVE, linewidth=0.8)
    axes.set_xlim(-1.05, _LONGEST_BAR + 0.6)
    axes.set_xticks([-1.0, 0.0, 1.0, 2.0, 3.0], ["-100%", "0", "100%", "200%", "300%"])
    axes.set(title=f"{joint}: margins", xlabel="(limit - demand) / demand;\na black tick is the required margin")
    legend = [Patch(facecolor=color, label=str(verdict)) for verdict, color in COLORS.items()]
    _legend_below(axes, 4, legend)
    axes.grid(axis="x", alpha=0.25)


def _legend_below(axes: "Axes", columns: int, handles: "Sequence[Patch] | None" = None, gap: float = 0.09) -> None:
    """Place the legend below the axes, clear of the curves."""
    place: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, -gap), "frameon": False}
    style: dict[str, Any] = {"fontsize": 8, "markerscale": 4, "ncols": columns}
    if handles is None:
        axes.legend(**place, **style)
    else:
        axes.legend(handles=handles, **place, **style)
