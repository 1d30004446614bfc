"""Layout of a recording: the scene on the left, tabs on the right."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from boom_model import Boom
from boom_model.arrays import Array
from boom_model.kinematics.frames import frame_transforms
from planner.recording.legend import Legend, log_names, names_view
from planner.recording.plots import Bundle, Plot


@dataclass(frozen=True, eq=False)
class PlotTab:
    """Plots with one legend for all of them below.

    Up to two plots stand in a column, up to four in two and more in three: the scale of a plot that
    is not tall has hardly a number.
    """

    name: str
    plots: Sequence[Plot | Bundle]
    root: str = "legends"
    """Entity below which the legend is logged."""

    @property
    def legend(self) -> Legend:
        """Names and colours of all curves that the titles of the plots do not name."""
        return list(dict.fromkeys(entry for plot in self.plots for entry in plot.legend))

    @property
    def view(self) -> rrb.Grid | rrb.Vertical:
        """The tab."""
        count = len(self.plots)
        columns = 1 if count <= 2 else 2 if count <= 4 else 3
        views = rrb.Grid(*(plot.view for plot in self.plots), grid_columns=columns, name=self.name)
        return rrb.Vertical(views, names_view(self._place), row_shares=[12, 1], name=self.name) if self.legend else views

    def log(self, recording: rr.RecordingStream, t: Array) -> None:
        """Log all plots at times t (n,), and the legend."""
        for plot in self.plots:
            plot.log(recording, t)
        if self.legend:
            log_names(recording, self._place, self.legend)

    @property
    def _place(self) -> str:
        return f"{self.root}{rr.new_entity_path([self.name.lower()])}"


def text(entity: str, name: str) -> rrb.TextDocumentView:
    """Return a tab that shows a Markdown document."""
    return rrb.TextDocumentView(origin=f"/{entity}", name=name)


def scene(title: str, eye: rrb.EyeControls3D, ground: float = 0.0) -> rrb.Spatial3DView:
    """Return the view of /world, with a grid at the height of the ground [m]."""
    grid = rrb.LineGrid3D(plane=rr.components.Plane3D.XY.with_distance(ground), color=(70, 70, 70))
    return rrb.Spatial3DView(origin="/world", name=title, eye_controls=eye, line_grid=grid)


def shown_beside(left: rrb.View | rrb.Container, right: rrb.View | rrb.Container, shares: Sequence[float]) -> rrb.Blueprint:
    """Return a blueprint of two parts side by side, with the viewer's own panels collapsed."""
    return rrb.Blueprint(
        rrb.Horizontal(left, right, column_shares=shares),
        rrb.TimePanel(timeline="t", state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )


def eye_of(boom: Boom, *motions: Array) -> rrb.EyeControls3D:
    """Return a camera that sees all the motions (n, 5).

    It looks from the right of the boom at the middle of the first motion, slightly from above.
    """
    some = np.concatenate([q[:: max(1, len(q) // 1000)] for q in motions])
    points = frame_transforms(boom, some, "outer")[..., :3, 3].reshape(-1, 3)
    return eye_on(points, float(motions[0][len(motions[0]) // 2, 0]))


def eye_on(points: Array, yaw: float, away: float = 1.1) -> rrb.EyeControls3D:
    """Return a camera that sees all points (k, 3) from the right of a boom, slightly from above.

    Args:
        points: (k, 3) points to see [m].
        yaw: direction of the boom [rad].
        away: distance of the camera as a multiple of the extent of the points.
    """
    center = (points.min(axis=0) + points.max(axis=0)) / 2.0
    direction = np.array([np.sin(yaw), -np.cos(yaw), 0.5])
    distance = 0.5 + away * float(np.linalg.norm(np.ptp(points, axis=0)))
    eye = center + distance * direction / np.linalg.norm(direction)
    return rrb.EyeControls3D(position=eye, look_target=center, eye_up=(0.0, 0.0, 1.0))
