"""Margins of all checks of a drive, as bars."""

from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import ArrayLike

from planner.checks.kinds import Part
from planner.checks.rows import Row, Verdict
from planner.planning import Move
from planner.recording.drive_plots import MOST_MARGIN
from planner.recording.palette import GREEN, GREY, LIGHT, ORANGE, OUTSIDE_COLOR, PURPLE, TOTAL_COLOR, VERMILION, Color
from planner.reports.report import cells

_COLORS: dict[Verdict, Color] = {
    Verdict.PASS: GREEN,
    Verdict.WARN: ORANGE,
    Verdict.FAIL: VERMILION,
    Verdict.INFO: GREY,
    Verdict.NOT_CHECKABLE: PURPLE,
}
_HEIGHT = 2.8
"""Height of all bars; the margin -100% to 300% is 4 wide. The view keeps this ratio."""
_NAMES_AT, _VALUE_BEHIND = -1.75, 0.3
_TICKS = (-1.0, 0.0, 1.0, 2.0, 3.0)
_BAR = 0.18
"""Half the thickness of a bar, as a share of the distance of two rows."""
_LABEL_BELOW = 0.6
"""Distance of a label below its point in the viewer, as a share of the distance of two rows."""


def margin_rows(move: Move, joint: str) -> list[Row]:
    """Return a joint's gearbox and motor checks that have a margin or could not be checked."""
    rows = [row for row in move.report.rows if row.joint == joint and row.kind.part in (Part.GEARBOX, Part.MOTOR)]
    return [row for row in rows if row.margin is not None or row.verdict is Verdict.NOT_CHECKABLE]


def margins_view(joint: str) -> rrb.Spatial2DView:
    """Return the view of a joint's bars."""
    title = f"{joint}: (limit - demand) / demand, up to {MOST_MARGIN:.0%}; a white line is the required margin [%]"
    bounds = rrb.VisualBounds2D(x_range=(-2.4, MOST_MARGIN + 0.7), y_range=(-0.05, _HEIGHT + 0.2))
    return rrb.Spatial2DView(origin=f"/margins/{joint}", name=title, visual_bounds=bounds)


def log_margins(recording: rr.RecordingStream, joint: str, rows: Sequence[Row]) -> None:
    """Log a bar for each row in the colour of its verdict, with a line at the required margin."""
    step = _HEIGHT / (len(rows) + 1)
    heights = step * (np.arange(len(rows)) + 1.0)
    lengths = [0.0 if row.margin is None else float(np.clip(row.margin, -1.0, MOST_MARGIN)) for row in rows]
    colors = [_COLORS[row.verdict] for row in rows]

    def lines(name: str, strips: Sequence[Sequence[tuple[float, float]]], colors: Sequence[Color], radii: ArrayLike) -> None:
        recording.log(f"margins/{joint}/{name}", rr.LineStrips2D(strips, colors=colors, radii=radii), static=True)

    def texts(name: str, x: Sequence[float], y: ArrayLike, labels: Sequence[str], colors: Sequence[Color]) -> None:
        places = np.column_stack([x, np.asarray(y) - _LABEL_BELOW * step])
        look = rr.Points2D(places, colors=colors, radii=0.0, labels=labels, show_labels=True)
        recording.log(f"margins/{joint}/{name}", look, static=True)

    lines("grid", [[(x, step / 2.0), (x, _HEIGHT)] for x in _TICKS], [OUTSIDE_COLOR], 0.003)
    texts("grid/value", _TICKS, [_HEIGHT + step] * len(_TICKS), [f"{x:.0%}" for x in _TICKS], [LIGHT])
    known = [
        (y, length, color)
        for y, length, color, row in zip(heights, lengths, colors, rows, strict=True)
        if row.margin is not None
    ]
    radii = [min(_BAR * step, abs(length) / 2.0) for _, length, _ in known]  # a line's round caps end at 0 and at the margin
    caps = [float(np.copysign(radius, length)) for radius, (_, length, _) in zip(radii, known, strict=True)]
    bars = [[(cap, y), (length - cap, y)] for cap, (y, length, _) in zip(caps, known, strict=True)]
    lines("bars", bars, [color for _, _, color in known], radii)
    required = [
        (y, row.required_margin) for y, row in zip(heights, rows, strict=True) if row.margin is not None and row.required_margin
    ]
    lines("required", [[(x, y - step / 2.0), (x, y + step / 2.0)] for y, x in required], [TOTAL_COLOR], 0.008)
    values = [str(row.verdict) if row.margin is None else cells(row)[4] for row in rows]
    texts("margin", [max(length, 0.0) + _VALUE_BEHIND for length in lengths], heights, values, colors)
    texts("check", [_NAMES_AT] * len(rows), heights, [row.check for row in rows], [LIGHT])
