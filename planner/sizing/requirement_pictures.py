"""Picture of a requirement sheet: torque over speed with its convex hull and its table."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from planner.sizing.requirement import Requirement

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_DRIVES, _BRAKES, _HULL, _TABLE = "#0072b2", "#e69f00", "#000000", "#d55e00"
"""Okabe and Ito's palette, readable with colour blindness."""


def requirement_pictures(needs: Sequence[Requirement]) -> dict[str, "Figure"]:
    """Return the figure by title: a panel per joint; torque above 0 drives, below 0 brakes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns = min(len(needs), 3)
    rows = -(-len(needs) // columns)
    figure = Figure(figsize=(4.6 * columns + 0.4, 4.2 * rows + 0.9), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for need, axes in zip(needs, panels, strict=False):
        _panel(axes, need)
    for axes in panels[len(needs) :]:
        axes.axis("off")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    return {"Torque over speed": figure}


def _panel(axes: "Axes", need: Requirement) -> None:
    per = 1e3 if need.is_length else 30.0 / np.pi
    cloud, hull = need.cloud, need.cloud.hull
    drives = cloud.torque >= 0.0
    for part, color, label in ((drives, _DRIVES, "driving"), (~drives, _BRAKES, "braking")):
        axes.plot(cloud.speed[part] * per, cloud.torque[part], ".", color=color, markersize=2.5, alpha=0.5, label=label)
    closed = np.vstack([hull, hull[:1]])
    axes.plot(closed[:, 0] * per, closed[:, 1], "-", color=_HULL, linewidth=1.0, label="convex hull")
    edges = np.array([0.0, *(step.speed for step in need.steps)]) * per
    torques = np.array([step.torque for step in need.steps])
    axes.stairs(torques, edges, baseline=None, color=_TABLE, linewidth=1.4, label="torque-speed table")
    axes.stairs(-torques, edges, baseline=None, color=_TABLE, linewidth=1.4)
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.set(title=need.joint, xlabel=f"speed [{'mm/s' if need.is_length else 'rpm'}]",
             ylabel="force [N]" if need.is_length else "torque at the joint [Nm]")  # fmt: skip
    axes.grid(alpha=0.3, linewidth=0.5)
