"""A plot map as a picture, in metres east and north of its middle."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize, to_rgba_array
from matplotlib.figure import Figure

from boom_model.arrays import Array
from planner.field.plots import PlotMap
from planner.field.polygons import rings_of

_LABELLED = 120  # plots with names
_COLOURS = "viridis"
_LUMINANCE = np.array([0.299, 0.587, 0.114])  # of red, green and blue


def map_figure(
    plots: PlotMap, points: Array | None = None, coverage: Array | None = None, track: Array | None = None
) -> Figure:
    """Return the map with points (n, 2) and a track (m, 2) [m], coloured by the share seen."""
    figure = Figure(figsize=(8.0, 6.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    scale = ScalarMappable(Normalize(0.0, 1.0), _COLOURS)
    draw_plots(axes, plots, "#dfe9d8" if coverage is None else scale.to_rgba(coverage))
    if coverage is not None:
        figure.colorbar(scale, ax=axes, label="share seen")
    if track is not None:
        axes.plot(*track.T, color="#8a4b16", linewidth=1.2, label="track of the mount")
    if points is not None and len(points):
        axes.plot(*points.T, ".", color="#b3261e", markersize=4, label="points")
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="upper right", fontsize=8)
    axes.set(aspect="equal", xlabel="east (m)", ylabel="north (m)", title=f"{len(plots.names)} plots")
    axes.autoscale_view()
    return figure


def draw_plots(axes: Axes, plots: PlotMap, colours: Any) -> None:
    """Draw outlines of plots, filled with one colour or one each, and names where there is room."""
    outlines = [rings_of(polygon)[0] for polygon in plots.polygons]
    axes.add_collection(PolyCollection(outlines, facecolors=colours, edgecolors="#3c5a2e", linewidths=0.8))
    if len(outlines) <= _LABELLED:
        light = np.broadcast_to(to_rgba_array(colours)[:, :3] @ _LUMINANCE, len(outlines))
        for name, outline, bright in zip(plots.names, outlines, light, strict=True):
            ink = "black" if bright > 0.4 else "white"
            axes.annotate(name, outline.mean(axis=0), ha="center", va="center", fontsize=6, color=ink, clip_on=True)


def write_picture(
    path: str | Path, plots: PlotMap, points: Array | None = None, *, coverage: Array | None = None, track: Array | None = None
) -> None:
    """Write `map_figure` as .png."""
    known = None if points is None else points[np.isfinite(points).all(axis=-1)]
    map_figure(plots, known, coverage, track).savefig(path, dpi=120, format="png")
