"""Branches of the tip target with the reasons against each, and the legend of the workspace."""

from html import escape

import numpy as np

from boom_model import JOINTS
from planner.page.html import block, table_html
from planner.page.pose_view import fixed
from planner.page.state import Branches, shown
from planner.page.workspace import Workspace
from planner.reports.reach_picture import OVERLOADED, margin_colors

_DIGITS = (2, 2, 2, 4, 2)


def branches_html(branches: Branches | None) -> str:
    """Return the branches as a table, with what speaks against each below it."""
    if branches is None:
        return block("Change the target or drag the gizmo to see its branches.")
    found = branches.found
    if not found.solutions:
        return block("No branch reaches this target.")
    rows, reasons = [], []
    for i, solution in enumerate(found.solutions):
        mark = "shown" if i == branches.chosen else "in limits" if solution.within_limits else "outside"
        values = (fixed(value, digits) for value, digits in zip(shown(solution.q), _DIGITS, strict=True))
        rows.append((str(i + 1), mark, *values))
        reasons += [f"branch {i + 1}: {reason}" for reason in solution.reasons]
    units = ("deg", "deg", "deg", "m", "deg")
    header = ("", "", *(f"{joint} [{unit}]" for joint, unit in zip(JOINTS, units, strict=True)))
    said = "".join(f'<div style="margin-top:2px">{escape(reason)}</div>' for reason in reasons)
    return block(table_html(header, rows, "branches") + f'<div id="reasons">{said}</div>')


def workspace_html(layer: Workspace | None) -> str:
    """Return what the layer shows, with its colours."""
    if layer is None:
        return ""
    pitch = np.degrees(layer.pitch)
    head = f"{len(layer.points)} cells reached, constraint {layer.constraint}, pitch {pitch:.4g} deg"
    known = layer.margin[np.isfinite(layer.margin)]
    if not known.size:
        return block(f'<div id="workspace">{escape(head)}. No drive: margins are not known.</div>')
    low, high = margin_span(layer)
    swatches = "".join(
        _swatch(tuple(int(c) for c in color), f"{level:.2f}")
        for level, color in zip(np.linspace(low, high, 4), margin_colors(np.linspace(low, high, 4), (low, high)), strict=True)
    )
    over = int((known < 0.0).sum())
    return block(
        f'<div id="workspace">{escape(head)}. Torque margin at rest on level ground:</div>{swatches}'
        f"{_swatch(OVERLOADED, f'above a limit ({over} cells)')}"
    )


def margin_span(layer: Workspace) -> tuple[float, float]:
    """Return the range of the colours: the margins of the layer to tenths, and none below 0."""
    known = layer.margin[np.isfinite(layer.margin)]
    if not known.size:
        return 0.0, 1.0
    low = max(float(np.floor(10.0 * known.min())) / 10.0, 0.0)
    return low, max(float(np.ceil(10.0 * known.max())) / 10.0, low + 0.1)


def _swatch(color: tuple[int, ...], name: str) -> str:
    look = f"display:inline-block;width:10px;height:10px;background:rgb({color[0]},{color[1]},{color[2]})"
    return f'<span style="margin-right:8px;white-space:nowrap"><span style="{look}"></span> {escape(name)}</span>'
