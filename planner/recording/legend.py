"""What colours mean, as swatches beside each other."""

from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from planner.recording.palette import LIGHT, Color

_WIDTH = 6.0
_BETWEEN = 4  # [letters]

Legend = Sequence[tuple[str, Color]]
"""Names and their colours."""


def log_legend(recording: rr.RecordingStream, legend: Legend) -> None:
    """A swatch a colour, with its name below, as far apart as the names are long."""
    rooms = np.array([len(name) + _BETWEEN for name, _ in legend])
    places = _WIDTH * (np.cumsum(rooms) - rooms / 2.0) / rooms.sum()
    for k, ((name, color), x) in enumerate(zip(legend, places, strict=True)):
        swatch = rr.Points2D([(x, 0.0)], colors=[color], radii=rr.Radius.ui_points(6.0))
        recording.log(f"legend/{k}", swatch, static=True)
        text = rr.Points2D([(x, 0.22)], colors=[LIGHT], radii=rr.Radius.ui_points(0.1), labels=[name], show_labels=True)
        recording.log(f"legend/{k}/name", text, static=True)


def legend_view(title: str) -> rrb.Spatial2DView:
    """The view of the swatches."""
    bounds = rrb.VisualBounds2D(x_range=(0.0, _WIDTH), y_range=(-0.25, 0.55))
    return rrb.Spatial2DView(origin="/legend", name=title, visual_bounds=bounds)
