"""A plot map as a picture, in metres east and north of its middle."""

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from boom_model.arrays import Array
from planner.field.plots import PlotMap
from planner.field.polygons import rings_of

_LABELLED = 120  # plots with names
_COLOURS = "viridis"
_DARK = 0.6  # share below which its colours are dark


def map_figure(
    plots: PlotMap, points: Array | None = None, coverage: Array | None = None, track: Array | None = None
) -> Figure:
    """Return the map with points (n, 2) and a track (m, 2) [m], coloured by the share of each plot that was seen."""
    figure = Figure(figsize=(8.0, 6.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    outlines = [rings_of(polygon)[0] for polygon in plots.polygons]
    scale = ScalarMappable(Normalize(0.0, 1.0), _COLOURS)
    colours = "#dfe9d8" if coverage is None else scale.to_rgba(coverage)
    axes.add_collection(PolyCollection(outlines, facecolors=colours, edgecolors="#3c5a2e", linewidths=0.8))
    if coverage is not None:
        figure.colorbar(scale, ax=axes, label="share seen")
    if len(outlines) <= _LABELLED:
        dark = np.zeros(len(outlines), dtype=bool) if coverage is None else coverage < _DARK
        for name, outline, light in zip(plots.names, outlines, dark, strict=True):
            axes.annotate(name, outline.mean(axis=0), ha="center", va="center", fontsize=6, color="w" if light else "k")
    if track is not None:
        axes.plot(*track.T, color="#8a4b16", linewidth=1.2, label="track of the mount")
    if points is not None and len(points):
        axes.plot(*points.T, ".", color="#b3261e", markersize=4, label="points")
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="upper right", fontsize=8)
    axes.set(aspect="equal", xlabel="east (m)", ylabel="north (m)", title=f"{len(outlines)} plots")
    axes.autoscale_view()
    return figure


def write_picture(
    path: str | Path, plots: PlotMap, points: Array | None = None, *, coverage: Array | None = None, track: Array | None = None
) -> None:
    """Write `map_figure` as .png."""
    known = None if points is None else points[np.isfinite(points).all(axis=-1)]
    map_figure(plots, known, coverage, track).savefig(path, dpi=120, format="png")
