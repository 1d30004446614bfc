"""Legends of colours: swatches, or coloured names, side by side."""

from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from planner.recording.palette import LIGHT, Color

_WIDTH = 6.0
_BETWEEN = 4  # space between two names [letters]
_LINE = 30.0

Legend = Sequence[tuple[str, Color]]
"""Names and their colours."""


def log_legend(recording: rr.RecordingStream, legend: Legend) -> None:
    """Log a swatch for each colour with its name below; long names get more room."""
    widths = np.array([len(name) + _BETWEEN for name, _ in legend])
    places = _WIDTH * (np.cumsum(widths) - widths / 2.0) / widths.sum()
    for k, ((name, color), x) in enumerate(zip(legend, places, strict=True)):
        swatch = rr.Points2D([(x, 0.0)], colors=[color], radii=rr.Radius.ui_points(6.0))
        recording.log(f"legend/{k}", swatch, static=True)
        text = rr.Points2D([(x, 0.22)], colors=[LIGHT], radii=rr.Radius.ui_points(0.1), labels=[name], show_labels=True)
        recording.log(f"legend/{k}/name", text, static=True)


def log_names(recording: rr.RecordingStream, entity: str, legend: Legend) -> None:
    """Log names in their colours, in one line; see `names_view`."""
    widths = np.array([len(name) + _BETWEEN for name, _ in legend], dtype=float)
    places = _LINE * (np.cumsum(widths) - widths / 2.0) / widths.sum()
    look = rr.Points2D(
        [(x, 0.0) for x in places],
        colors=[color for _, color in legend],
        radii=rr.Radius.ui_points(0.1),
        labels=[name for name, _ in legend],
        show_labels=True,
    )
    recording.log(entity, look, static=True)


def names_view(entity: str) -> rrb.Spatial2DView:
    """Return the view of the names that `log_names` logs, for a strip below plots."""
    bounds = rrb.VisualBounds2D(x_range=(0.0, _LINE), y_range=(-0.4, 0.9))
    return rrb.Spatial2DView(origin=f"/{entity}", name="Colours of the curves", visual_bounds=bounds)


def legend_view(title: str) -> rrb.Spatial2DView:
    """Return the view of the swatches."""
    bounds = rrb.VisualBounds2D(x_range=(0.0, _WIDTH), y_range=(-0.25, 0.55))
    return rrb.Spatial2DView(origin="/legend", name=title, visual_bounds=bounds)
