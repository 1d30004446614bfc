"""Curves over time: their data, their views and how they are logged."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from boom_model import Basis
from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH
from planner.recording.palette import LIMIT_COLOR, Color
from planner.recording.stream import time_column

_FEW, _BESIDE = (2.0, 5.0), 0.03

HIDDEN = rrb.PlotLegend(visible=False)
"""A plot's own legend would cover its curves."""


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
        return [f"{name} [{self.unit}]{_mark(self.basis)}" for name in self.limits]

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
    def legend(self) -> list[tuple[str, Color]]:
        """Name and colour of the limits; the title names the curve."""
        return [(f"limits{_mark(self.basis)}", LIMIT_COLOR)] if self.limits else []

    @property
    def view(self) -> rrb.TimeSeriesView:
        """View of the curve and its limits; its legend is drawn beside it."""
        return rrb.TimeSeriesView(origin=f"/{self.entity}", name=self.view_title, plot_legend=HIDDEN, axis_y=self.scale(()))

    def scale(self, others: Iterable[Array]) -> rrb.ScalarAxis | None:
        """Return the axis for the curve, its limits and other moves' curves; see `scale_of`."""
        return scale_of([self.values, *map(np.asarray, self.limits.values()), *others])


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
    def legend(self) -> list[tuple[str, Color]]:
        """Names without units, and colours; none for a single curve, which the title names."""
        names = [name.partition(" [")[0] for name in self.names]
        return list(dict.fromkeys(zip(names, self.colors, strict=True))) if len(self.names) > 1 else []

    @property
    def view(self) -> rrb.TimeSeriesView:
        """View of all the curves; their legend is drawn beside it."""
        return rrb.TimeSeriesView(origin=f"/{self.entity}", name=self.title, plot_legend=HIDDEN, axis_y=scale_of([self.values]))


def scale_of(values: Sequence[Array]) -> rrb.ScalarAxis | None:
    """Return an axis between multiples of a power of ten; None where the viewer's own will do.

    The viewer numbers powers of ten only. A range of 2 to 5 of them has one or two numbers, if the
    plot is not tall; a range that starts and ends with one has at least four.
    """
    low, high = min(float(each.min()) for each in values), max(float(each.max()) for each in values)
    if not (np.isfinite([low, high]).all() and high > low):
        return None
    step = 10.0 ** np.floor(np.log10(high - low))
    if not _FEW[0] <= (high - low) / step < _FEW[1]:
        return None
    ends = step * np.array([np.floor(low / step), np.ceil(high / step)])
    return rrb.ScalarAxis(range=ends + _BESIDE * np.ptp(ends) * np.array([-1.0, 1.0]))


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


def _mark(basis: Basis) -> str:
    return "" if basis is Basis.PRINTED else f" ({basis})"


def for_people(joint: int, values: Array) -> Array:
    """Return positions or rates of a joint in degrees, or in metres for the extension."""
    return values if IS_LENGTH[joint] else np.degrees(values)
