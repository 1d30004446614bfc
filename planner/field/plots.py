"""Maps of plots: laid out from a trial's corners, and asked which plot a point is on.

The truth of a map are latitudes and longitudes. Areas and distances are taken in the east-north
plane at its middle, at the height of its ground: within 1 km it is true to some micrometres.
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from boom_model import InputError
from boom_model.arrays import Array, Mask, read_only
from planner.field.earth import LocalFrame, ecef_of, geodetic_of
from planner.field.extra import library
from planner.field.polygons import probability, rings_of

_FAR = 7.0  # standard deviations beyond which a plot is not asked
_LARGEST = 1e5  # [m] of a map
_SMALLEST_AREA = 1e-4  # [m^2] of a plot
_SWAPPED_AWAY = 1e5  # [m] beyond which a log is not of these plots


@dataclass(frozen=True, eq=False)
class PlotMap:
    """Plots of a field. `PlotMap.of` makes one, and checks it."""

    names: tuple[str, ...]
    rings: tuple[tuple[Array, ...], ...]
    """Of each plot its outer ring and its holes, each (k, 2) latitude, longitude [rad], without the
    first point again."""
    rows: tuple[int | None, ...]
    ranges: tuple[int | None, ...]
    height: float
    """Of the ground above the ellipsoid [m]."""
    source: str
    notes: tuple[str, ...] = field(default=())

    @staticmethod
    def of(
        names: list[str],
        rings: list[list[Array]],
        *,
        rows: list[int | None] | None = None,
        ranges: list[int | None] | None = None,
        height: float = 0.0,
        source: str = "plots",
        notes: tuple[str, ...] = (),
    ) -> "PlotMap":
        """Return a map.

        Raises:
            InputError: no plot, two of one name, a ring that crosses itself or has no area, plots
                that overlap by more than a tenth, or a map of more than 100 km.
        """
        if not names:
            raise InputError(f"{source}: no plot")
        twice = sorted({name for name in names if names.count(name) > 1}) if len(set(names)) < len(names) else []
        if twice:
            raise InputError(f"{source}: two plots bear the name {twice[0]!r}")
        kept = tuple(tuple(read_only(ring) for ring in plot) for plot in rings)
        unknown: list[int | None] = [None] * len(names)
        found = PlotMap(tuple(names), kept, tuple(rows or unknown), tuple(ranges or unknown), height, source, notes)
        found._check()
        return found

    def at_height(self, height: float) -> "PlotMap":
        """Return the same map with its ground at another height above the ellipsoid [m]."""
        return PlotMap(self.names, self.rings, self.rows, self.ranges, height, self.source, self.notes)

    @cached_property
    def frame(self) -> LocalFrame:
        """East-north-up at the middle of the map, on the ground."""
        corners = np.concatenate([plot[0] for plot in self.rings])
        middle = ecef_of(corners[:, 0], corners[:, 1], 0.0).mean(axis=0)
        latitude, longitude, _ = geodetic_of(middle)
        return LocalFrame.at(float(latitude), float(longitude), self.height)

    @cached_property
    def polygons(self) -> tuple[Any, ...]:
        """The plots in the plane of `frame`, as shapely's polygons."""
        shapely = library("shapely")
        flat = [[self.plane(ring[:, 0], ring[:, 1]) for ring in plot] for plot in self.rings]
        return tuple(shapely.Polygon(plot[0], plot[1:]) for plot in flat)

    @cached_property
    def tree(self) -> Any:
        """Index of the polygons, for what is near."""
        return library("shapely").STRtree(self.polygons)

    def plane(self, latitude: Array, longitude: Array) -> Array:
        """Return east and north (..., 2) [m] in the plane of the map; heights do not count."""
        flat: Array = self.frame.enu(ecef_of(latitude, longitude, np.full(np.shape(latitude), self.height)))[..., :2]
        return flat

    def plane_of(self, ecef: Array) -> Array:
        """Return east and north (..., 2) [m] in the map's plane, of ECEF positions (..., 3)."""
        latitude, longitude, _ = geodetic_of(ecef)
        return self.plane(latitude, longitude)

    def area(self) -> float:
        """Return the area of all plots [m^2]."""
        return float(sum(polygon.area for polygon in self.polygons))

    def _check(self) -> None:
        for name, plot in zip(self.names, self.rings, strict=True):
            if len(plot[0]) < 3:
                raise InputError(f"{self.source}: plot {name} has {len(plot[0])} corners; it needs three")
        reach = np.ptp(np.concatenate([ecef_of(p[0][:, 0], p[0][:, 1], 0.0) for p in self.rings]), axis=0)
        if np.linalg.norm(reach) > _LARGEST:
            raise InputError(
                f"{self.source}: the plots are {np.linalg.norm(reach) / 1e3:.0f} km apart; are some coordinates swapped?"
            )
        for name, polygon in zip(self.names, self.polygons, strict=True):
            if not polygon.is_valid:
                why = library("shapely").is_valid_reason(polygon).partition("[")[0]
                raise InputError(f"{self.source}: plot {name} is no simple polygon: {why.lower()}")
            if polygon.area < _SMALLEST_AREA:
                raise InputError(f"{self.source}: plot {name} has an area of {polygon.area:.2g} m^2")
        for i, j in self.tree.query(self.polygons, predicate="intersects").T:
            shared = self.polygons[i].intersection(self.polygons[j]).area
            if i < j and shared > 0.1 * min(self.polygons[i].area, self.polygons[j].area):
                raise InputError(f"{self.source}: plots {self.names[i]} and {self.names[j]} overlap by {shared:.2g} m^2")


@dataclass(frozen=True, eq=False)
class Located:
    """Which plot each point is most probably on."""

    plot: NDArray[np.int_]
    """(n,) index of the plot; -1 where no plot is likelier than 1 in 1000, or the point is not
    known"""
    probability: Array
    """(n,) that the point is on that plot; 0 where there is none"""
    outside: Array
    """(n,) that it is on no plot"""

    @property
    def on(self) -> Mask:
        """(n,) where its plot is likelier than no plot."""
        return np.asarray((self.plot >= 0) & (self.probability > np.nan_to_num(self.outside)))


def locate(plots: PlotMap, points: Array, covariance: Array) -> Located:
    """Return the likeliest plot of points with normal errors.

    Args:
        plots: the map.
        points: (n, 2) in the map's plane [m], NaN where not known.
        covariance: (n, 2, 2) [m^2].
    """
    n = len(points)
    best, sure, total = np.full(n, -1), np.zeros(n), np.zeros(n)
    known = np.flatnonzero(np.isfinite(points).all(axis=-1) & np.isfinite(covariance).all(axis=(-2, -1)))
    reach = np.zeros(n)
    reach[known] = _FAR * np.sqrt(np.trace(covariance[known], axis1=-2, axis2=-1)) + 1e-6
    for i, polygon in enumerate(plots.polygons):
        west, south, east, north = polygon.bounds
        x, y, r = points[known, 0], points[known, 1], reach[known]
        near = known[(x > west - r) & (x < east + r) & (y > south - r) & (y < north + r)]
        if not len(near):
            continue
        p = probability(rings_of(polygon), points[near], covariance[near])
        total[near] += p
        better = p > np.maximum(sure[near], 1e-3)
        best[near[better]], sure[near[better]] = i, p[better]
    outside = np.where(np.isin(np.arange(n), known), np.clip(1.0 - total, 0.0, 1.0), np.nan)
    return Located(best, sure, outside)


def shares(plots: PlotMap, footprint: Array) -> dict[str, float]:
    """Return the share of a footprint (k, 2) [m] that lies on each plot that it touches."""
    shape = library("shapely").Polygon(footprint)
    found = {plots.names[i]: plots.polygons[i].intersection(shape).area / shape.area for i in sorted(plots.tree.query(shape))}
    return {name: share for name, share in found.items() if share > 0.0}


def require_near(plots: PlotMap, latitude: Array, longitude: Array, source: str) -> None:
    """Check that a log lies at the plots.

    Raises:
        InputError: it is more than 100 km away; says so if swapped coordinates are near.
    """
    known = np.isfinite(latitude)
    if not known.any():
        return
    middle = float(np.median(latitude[known])), float(np.median(longitude[known]))

    def away(place: tuple[float, float]) -> float:
        return float(np.linalg.norm(ecef_of(*place, plots.height) - plots.frame.origin))

    if away(middle) > _SWAPPED_AWAY:
        near = abs(middle[1]) <= np.pi / 2 and away(middle[::-1]) < _SWAPPED_AWAY
        swapped = "; latitude and longitude are swapped in one of them" if near else ""
        raise InputError(f"{source} is {away(middle) / 1e3:.0f} km from the plots of {plots.source}{swapped}")


def lay_out(
    corners: Array,
    rows: int,
    ranges: int,
    plot: tuple[float, float],
    alley: tuple[float, float],
    *,
    height: float = 0.0,
    source: str = "plots",
    rows_to_right: bool = False,
) -> tuple[PlotMap, float]:
    """Return the plots of a trial from its corners, and the corners' RMS distance from them [m].

    The trial is a grid of plots and alleys of given sizes. It is laid on the corners by least
    squares, turned and moved but neither stretched nor sheared.

    Args:
        corners: (2 to 4, 2) latitude, longitude [rad] of the outer corners: of row 1 at range 1, of
            row 1 at the last range, of the last row at the last range, of the last row at range 1.
        rows: number of rows.
        ranges: number of ranges.
        plot: size of a plot [m]: from row to row, and from range to range.
        alley: between rows, and between ranges [m].
        height: of the ground above the ellipsoid [m].
        source: what messages call the map.
        rows_to_right: with two corners only: whether the rows follow to the right of the way from
            the first to the second.

    Raises:
        InputError: the corners are fewer than 2 or more than 4, or farther than a tenth of the
            trial from the layout.
    """
    count = len(corners)
    if count not in (2, 3, 4):
        raise InputError(f"{source}: {count} corners; it needs 2 to 4")
    across = rows * plot[0] + (rows - 1) * alley[0]
    along = ranges * plot[1] + (ranges - 1) * alley[1]
    middle = geodetic_of(ecef_of(corners[:, 0], corners[:, 1], height).mean(axis=0))
    frame = LocalFrame.at(float(middle[0]), float(middle[1]), height)
    measured = frame.enu(ecef_of(corners[:, 0], corners[:, 1], np.full(count, height)))[:, :2]
    ideal = np.array([[0.0, 0.0], [along, 0.0], [along, across], [0.0, across]])[:count]
    fits = [_laid(ideal * [1.0, side], measured) for side in ((-1.0 if rows_to_right else 1.0,) if count == 2 else (1.0, -1.0))]
    side = (-1.0 if rows_to_right else 1.0) if count == 2 else (1.0, -1.0)[int(np.argmin([fit[2] for fit in fits]))]
    turn, move, off = min(fits, key=lambda fit: fit[2])
    if off > 0.1 * np.hypot(along, across):
        raise InputError(
            f"{source}: the corners are {off:.2f} m (RMS) from a trial of {along:g} m along the ranges and {across:g} m "
            "along the rows; check their order and the sizes"
        )
    names, rings, row_numbers, range_numbers = [], [], [], []
    for row in range(rows):
        for rank in range(ranges):
            x, y = rank * (plot[1] + alley[1]), row * (plot[0] + alley[0])
            box = np.array([[x, y], [x + plot[1], y], [x + plot[1], y + plot[0]], [x, y + plot[0]]]) * [1.0, side]
            flat = box @ turn.T + move
            latitude, longitude, _ = geodetic_of(frame.ecef(np.column_stack([flat, np.zeros(4)])))
            names.append(f"{row + 1}-{rank + 1}")
            rings.append([np.column_stack([latitude, longitude])])
            row_numbers.append(row + 1)
            range_numbers.append(rank + 1)
    made = PlotMap.of(names, rings, rows=[*row_numbers], ranges=[*range_numbers], height=height, source=source)
    return made, off


def _laid(ideal: Array, measured: Array) -> tuple[Array, Array, float]:
    """Return the turn (2, 2), the move (2,) and the RMS distance of the best fit."""
    a, b = ideal - ideal.mean(axis=0), measured - measured.mean(axis=0)
    angle = float(np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum()))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    move = measured.mean(axis=0) - turn @ ideal.mean(axis=0)
    off = np.linalg.norm(ideal @ turn.T + move - measured, axis=-1)
    return turn, move, float(np.sqrt((off**2).mean()))
