"""Curves over time: what a view shows, and how it is logged."""

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
    """One quantity of one joint in people's units, with the limits beside it."""

    entity: str
    name: str
    unit: str
    color: Color
    values: Array
    limits: Mapping[str, float | Array]
    """Name to value, or values (n,) where it changes with the motion; empty where no limit is known."""
    basis: Basis
    """Of the limits."""

    @property
    def title(self) -> str:
        """With the unit."""
        return f"{self.name} [{self.unit}]"

    @property
    def limit_titles(self) -> list[str]:
        """With the unit, and what is not printed anywhere marked."""
        mark = "" if self.basis is Basis.PRINTED else f" ({self.basis})"
        return [f"{name} [{self.unit}]{mark}" for name in self.limits]

    def log(self, recording: rr.RecordingStream, t: Array) -> None:
        """The curve and its limits, at times t (n,)."""
        log_curves(recording, self.entity, t, [self.title], [self.color], self.values[:, None])
        self.log_limits(recording, t)

    def log_limits(self, recording: rr.RecordingStream, t: Array) -> None:
        """Those that do not change with the motion are known by its two ends."""
        if self.limits:
            values, times = np.stack(list(self.limits.values()), axis=-1), t
            if values.ndim == 1:
                times = np.unique(t[[0, -1]])
                values = np.tile(values, (len(times), 1))
            colors = [LIMIT_COLOR] * len(self.limits)
            log_curves(recording, f"{self.entity}/limits", times, self.limit_titles, colors, values, style_of=t)

    @property
    def view(self) -> rrb.TimeSeriesView:
        """Its legend stands clear of the curve."""
        first, second = self.values[: len(self.values) // 2 + 1], self.values[len(self.values) // 2 :]
        corner = rrb.Corner2D.LeftBottom if first.min() > second.min() else rrb.Corner2D.RightBottom
        return rrb.TimeSeriesView(origin=f"/{self.entity}", name=self.title, plot_legend=corner)


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
        """The curves, at times t (n,)."""
        log_curves(recording, self.entity, t, self.names, self.colors, self.values)

    @property
    def view(self) -> rrb.TimeSeriesView:
        """Of all the curves."""
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
    """Curves (n, k) at times t (n,); a line through one sample would not be seen, so that is a point."""
    style = rr.SeriesLines if len(t if style_of is None else style_of) > 1 else rr.SeriesPoints
    recording.log(entity, style(names=names, colors=colors), static=True)
    recording.send_columns(entity, [time_column(t)], rr.Scalars.columns(scalars=values))


def for_people(joint: int, values: Array) -> Array:
    """Positions and rates of a joint in deg, or m."""
    return values if IS_LENGTH[joint] else np.degrees(values)
