"""Curves over time: their data, their views and how they are logged."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from boom_model import Basis
from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH
from planner.recording.palette import LIMIT_COLOR, Color
from planner.recording.stream import time_column


@dataclass(frozen=True, eq=False)
class Plot:
    """One quantity of one joint with its limits, in degrees, metres, newtons or newton metres."""

    entity: str
    name: str
    unit: str
    color: Color
    values: Array
    limits: Mapping[str, float | Array]
    """Limits by name: a value, or values (n,) that change with the motion.

    Empty if no limit is known.
    """
    basis: Basis
    """Basis of the limits."""
    without: str = ""
    """Why no limit is shown."""

    @property
    def title(self) -> str:
        """Name and unit of the quantity."""
        return f"{self.name} [{self.unit}]"

    @property
    def view_title(self) -> str:
        """The title, and why no limit is shown."""
        return f"{self.title}, {self.without}" if self.without else self.title

    @property
    def limit_titles(self) -> list[str]:
        """Name, unit and, if it is not printed in a source, basis of each limit."""
        mark = "" if self.basis is Basis.PRINTED else f" ({self.basis})"
        return [f"{name} [{self.unit}]{mark}" for name in self.limits]

    def log(self, recording: rr.RecordingStream, t: Array) -> None:
        """Log the curve and its limits at times t (n,)."""
        log_curves(recording, self.entity, t, [self.title], [self.color], self.values[:, None])
        self.log_limits(recording, t)

    def log_limits(self, recording: rr.RecordingStream, t: Array) -> None:
        """Log the limits; constant ones at the two ends of the motion only."""
        if self.limits:
            values, times = np.stack(list(self.limits.values()), axis=-1), t
            if values.ndim == 1:
                times = np.unique(t[[0, -1]])
                values = np.tile(values, (len(times), 1))
            colors = [LIMIT_COLOR] * len(self.limits)
            log_curves(recording, f"{self.entity}/limits", times, self.limit_titles, colors, values, style_of=t)

    @property
    def view(self) -> rrb.TimeSeriesView:
        """View of the curve, with the legend in the corner that the curve leaves free."""
        first, second = self.values[: len(self.values) // 2 + 1], self.values[len(self.values) // 2 :]
        corner = rrb.Corner2D.LeftBottom if first.min() > second.min() else rrb.Corner2D.RightBottom
        return rrb.TimeSeriesView(origin=f"/{self.entity}", name=self.view_title, plot_legend=corner)


@dataclass(frozen=True, eq=False)
class Bundle:
    """Several curves of one kind in one view."""

    entity: str
    title: str
    names: Sequence[str]
    colors: Sequence[Color]
    values: Array
    """(n, curves)"""

    def log(self, recording: rr.RecordingStream, t: Array) -> None:
        """Log the curves at times t (n,)."""
        log_curves(recording, self.entity, t, self.names, self.colors, self.values)

    @property
    def view(self) -> rrb.TimeSeriesView:
        """View of all the curves."""
        return rrb.TimeSeriesView(origin=f"/{self.entity}", name=self.title)


def log_curves(
    recording: rr.RecordingStream,
    entity: str,
    t: Array,
    names: Sequence[str],
    colors: Sequence[Color],
    values: Array,
    style_of: Array | None = None,
) -> None:
    """Log curves (n, k) at times t (n,).

    A single sample is logged as a point, because a line through one sample is invisible.
    """
    style = rr.SeriesLines if len(t if style_of is None else style_of) > 1 else rr.SeriesPoints
    recording.log(entity, style(names=names, colors=colors), static=True)
    recording.send_columns(entity, [time_column(t)], rr.Scalars.columns(scalars=values))


def for_people(joint: int, values: Array) -> Array:
    """Return positions or rates of a joint in degrees, or in metres for the extension."""
    return values if IS_LENGTH[joint] else np.degrees(values)
