"""On which plots a sensor's spots lie, spot by spot and plot by plot."""

from dataclasses import dataclass

import numpy as np

from planner.field.earth import utm_zone
from planner.field.plots import Located, PlotMap, locate, require_near
from planner.field.sensor_tags import SensorTags

SURE = 0.95
"""Probability from which a spot counts as sure."""


@dataclass(frozen=True)
class PlotCount:
    """What was seen of one plot."""

    name: str
    spots: int
    """That are likelier on it than on another plot or on none."""
    sure: int
    """Of them with a probability of SURE or more."""
    least: float
    """Least probability of them."""


def map_at(plots: PlotMap, tags: SensorTags) -> PlotMap:
    """Return the map with its ground at the median height of what was seen.

    Raises:
        InputError: the map is far from the log.
    """
    latitude, longitude, height = tags.seen.geodetic
    require_near(plots, *tags.sensor.geodetic[:2], tags.triggers.source)
    known = np.isfinite(latitude) & np.isfinite(longitude)
    return plots.at_height(float(np.median(height[known]))) if known.any() else plots


def locate_spots(plots: PlotMap, tags: SensorTags) -> Located:
    """Return the likeliest plot of every spot that the sensor saw."""
    spots = np.full((len(tags.triggers.t), 2), np.nan)
    known = np.isfinite(tags.seen.ecef).all(axis=-1)
    if known.any():
        spots[known] = plots.plane_of(tags.seen.ecef[known])
    return locate(plots, spots, tags.seen.covariance[:, :2, :2])


def counts(plots: PlotMap, located: Located) -> list[PlotCount]:
    """Return what was seen of each plot that was seen, in the order of the map."""
    found = []
    for i in sorted(set(located.plot[located.on].tolist())):
        p = located.probability[located.on & (located.plot == i)]
        found.append(PlotCount(plots.names[i], len(p), int((p >= SURE).sum()), float(p.min())))
    return found


def zone_of(tags: SensorTags) -> int:
    """Return the EPSG code of the UTM zone of the first tag."""
    latitude, longitude, _ = tags.sensor.geodetic
    first = int(np.argmax(tags.known))
    return utm_zone(float(latitude[first]), float(longitude[first]))
