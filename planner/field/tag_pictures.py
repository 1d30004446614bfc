"""Pictures of geotags: plots, track, where the sensor was, what it saw with its 95 % ellipse."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import EllipseCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from boom_model.arrays import Mask
from planner.field.earth import LocalFrame, geodetic_of
from planner.field.geotag import Geotags
from planner.field.plot_picture import draw_plots
from planner.field.plots import Located, PlotMap
from planner.field.sensor_tags import SensorTags
from planner.field.vehicle_log import VehicleLog

_HALF_WIDTH = 2.5  # [m] of the close-up
_PLOT, _TRACK, _SENSOR, _SEEN = "#eef3ea", "#8a4b16", "#222222", "#b3261e"
_COLOURS = "viridis"


def tag_pictures(
    tags: SensorTags, log: VehicleLog, plots: PlotMap | None = None, located: Located | None = None
) -> dict[str, Figure]:
    """Return the map of all tags, and a close-up of the least sure of them, by title.

    Args:
        tags: the geotags.
        log: the vehicle's log of the tags.
        plots: the map of plots, and with it
        located: the plot of each spot.
    """
    frame = _frame(tags, plots)
    figures = {title: _map(frame, tags, log, plots, located) for title in ("Map", "Close-up of the least sure spot")}
    whole, close = (figure.axes[0] for figure in figures.values())
    whole.autoscale_view()
    x, y = frame.enu((tags.seen if _known(tags.seen).any() else tags.sensor).ecef[_least_sure(tags, located)])[:2]
    close.set(xlim=(x - _HALF_WIDTH, x + _HALF_WIDTH), ylim=(y - _HALF_WIDTH, y + _HALF_WIDTH))
    return figures


def _map(frame: LocalFrame, tags: SensorTags, log: VehicleLog, plots: PlotMap | None, located: Located | None) -> Figure:
    figure = Figure(figsize=(9.0, 7.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    if plots is not None:
        draw_plots(axes, plots, _PLOT)
    axes.plot(*frame.enu(log.ecef)[:, :2].T, color=_TRACK, linewidth=1.0, label="antenna")
    at, seen = _known(tags.sensor), _known(tags.seen)
    axes.plot(*frame.enu(tags.sensor.ecef[at])[:, :2].T, ".-", color=_SENSOR, markersize=3, linewidth=0.5, label="sensor")
    _ellipses(axes, frame, tags.sensor, at, _SENSOR)
    colours: Any = _SEEN
    if located is not None:
        scale = ScalarMappable(Normalize(0.0, 1.0), _COLOURS)
        colours = scale.to_rgba(located.probability[seen])
        figure.colorbar(scale, ax=axes, label="probability of the plot")
    corners = np.isfinite(tags.footprint).all(axis=(1, 2))
    footprints = frame.enu(tags.footprint[corners])[..., :2]
    axes.add_collection(PolyCollection(list(footprints), facecolors="none", edgecolors="#00000030", linewidths=0.5))
    x, y = frame.enu(tags.seen.ecef[seen])[:, :2].T
    if len(x):
        axes.scatter(x, y, 6.0, colours, label="what it saw, with its 95 % ellipse", zorder=3)
    _ellipses(axes, frame, tags.seen, seen, colours)
    axes.legend(loc="upper right", fontsize=8)
    axes.set(aspect="equal", xlabel="east (m)", ylabel="north (m)")
    return figure


def _ellipses(axes: Axes, frame: LocalFrame, tags: Geotags, known: Mask, colours: Any) -> None:
    """Draw 95 % ellipses to scale."""
    long, short, bearing = tags.ellipses[known].T
    axes.add_collection(
        EllipseCollection(
            2.0 * long,
            2.0 * short,
            90.0 - np.degrees(bearing),
            units="xy",
            offsets=frame.enu(tags.ecef[known])[:, :2],
            offset_transform=axes.transData,
            facecolors="none",
            edgecolors=colours,
            linewidths=0.8,
            zorder=3,
        )
    )


def _known(tags: Geotags) -> Mask:
    return np.asarray(np.isfinite(tags.ecef).all(axis=-1))


def _least_sure(tags: SensorTags, located: Located | None) -> int:
    """Index of the spot whose plot is least sure; without a map, of the largest ellipse."""
    if located is not None and (located.plot >= 0).any():
        surest = np.maximum(located.probability, np.nan_to_num(located.outside))
        return int(np.argmin(np.where(located.plot >= 0, surest, np.inf)))
    each = tags.seen if _known(tags.seen).any() else tags.sensor
    return int(np.nanargmax(each.ellipses[:, 0]))


def _frame(tags: SensorTags, plots: PlotMap | None) -> LocalFrame:
    """East-north-up of the map, or at the first tag."""
    if plots is not None:
        return plots.frame
    latitude, longitude, height = geodetic_of(tags.sensor.ecef[tags.known][0])
    return LocalFrame.at(float(latitude), float(longitude), float(height))
