"""Rows of plots as a vehicle drives along them, plots on its left, and its turns between rows."""

from dataclasses import dataclass

import numpy as np

from boom_model import InputError
from boom_model.arrays import Array
from planner.field.plots import PlotMap

MOST_PLOTS = 5000
_POINTS = 24  # of an arc


@dataclass(frozen=True, eq=False)
class Beside:
    """A plot beside its track: x along the track from its middle, y to the left of the row [m]."""

    plot: int
    row: int
    along: float
    """Of its middle along the track [m]."""
    x: tuple[float, float]
    y: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Row:
    """A row of plots, and the direction in which it is driven, in the plane of the map [m]."""

    number: int
    middle: Array
    """(2,) of its plots"""
    ahead: Array
    """(2,) unit vector"""
    plots: tuple[Beside, ...]
    """In the order of the drive."""

    @property
    def left(self) -> Array:
        """(2,) unit vector."""
        return np.array([-self.ahead[1], self.ahead[0]])

    @property
    def span(self) -> tuple[float, float]:
        """From the first edge of a plot to the last one, along the row."""
        return min(p.along + p.x[0] for p in self.plots), max(p.along + p.x[1] for p in self.plots)

    @property
    def width(self) -> tuple[float, float]:
        """From the right edge of the plots to the left one, from the row's middle line [m]."""
        return min(plot.y[0] for plot in self.plots), max(plot.y[1] for plot in self.plots)

    @property
    def period(self) -> float:
        """Least way from one plot to the next; infinite for a single plot."""
        return float(min(np.diff([plot.along for plot in self.plots]), default=np.inf))

    def at(self, along: float, offset: float) -> Array:
        """Return the mount's place (2,) along the row, `offset` to the right of its middle."""
        place: Array = self.middle + along * self.ahead - offset * self.left
        return place


def rows_of(plots: PlotMap) -> tuple[Row, ...]:
    """Return the rows of a map in serpentine order.

    Raises:
        InputError: a plot has no row or no range, or the plots are too many.
    """
    if None in plots.rows or None in plots.ranges:
        raise InputError(f"{plots.source}: a scan needs the row and the range of every plot")
    if len(plots.names) > MOST_PLOTS:
        raise InputError(f"{plots.source}: {len(plots.names):,} plots; a scan takes {MOST_PLOTS:,}")
    middles = np.array([polygon.centroid.coords[0] for polygon in plots.polygons])
    rows, ranges = np.array(plots.rows, dtype=int), np.array(plots.ranges, dtype=int)
    axis = _axis(plots, middles, rows, ranges)
    found = []
    for number, row in enumerate(np.unique(rows)):
        sense = 1 if number % 2 == 0 else -1
        ahead = sense * axis
        left = np.array([-ahead[1], ahead[0]])
        mine = np.flatnonzero(rows == row)
        mine = mine[np.argsort(ranges[mine])][::sense]
        middle = middles[mine].mean(axis=0)
        beside = []
        for k in mine:
            flat = np.array(plots.polygons[k].exterior.coords)[:, :2]
            x, y = (flat - middles[k]) @ ahead, (flat - middle) @ left
            along = float((middles[k] - middle) @ ahead)
            beside.append(Beside(int(k), int(row), along, (float(x.min()), float(x.max())), (float(y.min()), float(y.max()))))
        found.append(Row(int(row), middle, ahead, tuple(beside)))
    return tuple(found)


def _axis(plots: PlotMap, middles: Array, rows: Array, ranges: Array) -> Array:
    """Return the unit vector along the rows: from plot to plot, or along a plot's longer side."""
    for row in np.unique(rows):
        mine = np.flatnonzero(rows == row)
        if len(mine) > 1:
            ends = mine[np.argsort(ranges[mine])][[0, -1]]
            axis = middles[ends[1]] - middles[ends[0]]
            return np.asarray(axis / np.linalg.norm(axis))
    sides = np.diff(np.array(plots.polygons[0].minimum_rotated_rectangle.exterior.coords)[:3], axis=0)
    longest = sides[int(np.argmax(np.linalg.norm(sides, axis=1)))]
    return np.asarray(longest / np.linalg.norm(longest))


def turn(start: Array, ahead: Array, goal: Array, radius: float) -> Array:
    """Return the way (n, 2) from a row's end to the next row, driven in the opposite direction.

    Arcs of one radius: a half circle with a straight part where the rows are two radii apart or
    more. Else the vehicle first swings away by the angle b, cos b = (w + 2 R) / (4 R), turns by
    pi + 2 b and swings back. Where one row ends before the other, a straight part is added.

    Args:
        start: (2,) [m].
        ahead: (2,) unit vector, direction of the drive at the start.
        goal: (2,) [m].
        radius: of the vehicle's turns [m].
    """
    left = np.array([-ahead[1], ahead[0]])
    along, apart = float((goal - start) @ ahead), float((goal - start) @ left)
    side = 1.0 if apart >= 0.0 else -1.0
    points = _half_turn(abs(apart), radius)
    if along > 0.0:
        points = np.vstack([np.zeros(2), points + np.array([along, 0.0])])
    elif along < 0.0:
        points = np.vstack([points, [along, abs(apart)]])
    way: Array = start + points[:, :1] * ahead + side * points[:, 1:] * left
    return way


def turn_length(apart: float, radius: float) -> float:
    """Return the length [m] of `turn` between rows that end beside each other."""
    if apart >= 2.0 * radius:
        return float(np.pi * radius + apart - 2.0 * radius)
    return float(radius * (np.pi + 4.0 * np.arccos((apart + 2.0 * radius) / (4.0 * radius))))


def length(way: Array) -> float:
    """Return the length [m] of a way (n, 2)."""
    return float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())


def _half_turn(apart: float, radius: float) -> Array:
    """Return points (n, 2) from the origin, heading (1, 0), to (0, apart), heading (-1, 0)."""
    if apart >= 2.0 * radius:
        arcs = [(0.5 * np.pi, 1.0, 0.0), (0.0, 0.0, apart - 2.0 * radius), (0.5 * np.pi, 1.0, 0.0)]
    else:
        away = float(np.arccos((apart + 2.0 * radius) / (4.0 * radius)))
        arcs = [(away, -1.0, 0.0), (np.pi + 2.0 * away, 1.0, 0.0), (away, -1.0, 0.0)]
    points, place, heading = [np.zeros((1, 2))], np.zeros(2), 0.0
    for angle, side, straight in arcs:
        if straight:
            place = place + straight * np.array([np.cos(heading), np.sin(heading)])
            points.append(place[None])
            continue
        center = place + radius * side * np.array([-np.sin(heading), np.cos(heading)])
        headings = heading + side * np.linspace(0.0, angle, _POINTS + 1)[1:]
        arc = center + radius * side * np.stack([np.sin(headings), -np.cos(headings)], axis=-1)
        points.append(arc)
        place, heading = arc[-1], float(headings[-1])
    return np.concatenate(points)
