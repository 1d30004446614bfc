"""What colours mean, as swatches beside each other."""

from collections.abc import Sequence

import rerun as rr
import rerun.blueprint as rrb

from planner.recording.palette import LIGHT, Color


def log_legend(recording: rr.RecordingStream, named: Sequence[tuple[str, Color]]) -> None:
    """A swatch a colour, with its name below."""
    for k, (name, color) in enumerate(named):
        swatch = rr.Points2D([(float(k), 0.0)], colors=[color], radii=rr.Radius.ui_points(6.0))
        recording.log(f"legend/{k}", swatch, static=True)
        text = rr.Points2D([(float(k), 0.22)], colors=[LIGHT], radii=rr.Radius.ui_points(0.1), labels=[name], show_labels=True)
        recording.log(f"legend/{k}/name", text, static=True)


def legend_view(named: Sequence[tuple[str, Color]], title: str) -> rrb.Spatial2DView:
    """The view of the swatches."""
    bounds = rrb.VisualBounds2D(x_range=(-0.6, max(len(named), 2) - 0.4), y_range=(-0.25, 0.55))
    return rrb.Spatial2DView(origin="/legend", name=title, visual_bounds=bounds)
