"""Pictures of a study: tornado, Sobol indices, scatter, map of a grid, Pareto front."""

from typing import TYPE_CHECKING

import numpy as np

from planner.studies.analysis import FAILS, Index, Results, Swing
from planner.studies.designs import DesignKind
from planner.studies.report import decided_by, summaries
from planner.studies.responses import label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PASS, _FAIL, _FRONT = "#0072b2", "#d55e00", "#009e73"
_MOST_DOTS = 5000
_MOST_BARS = 15


def study_pictures(results: Results) -> dict[str, "Figure"]:
    """Return the figures of a study by title: those for which it has data."""
    pictures: dict[str, Figure] = {}
    found = summaries(results)
    for each in found:
        swings = [swing for swing in each.swings if swing.high > swing.low]
        if swings and each.nominal is not None:
            pictures[f"Tornado: {label(each.name)[0]}"] = _tornado(each.name, swings, each.nominal)
        if each.indices:
            pictures[f"What decides {label(each.name)[0]}"] = _indices(each.name, list(each.indices))
    scatter = _grid_map(results) if results.study.design.kind is DesignKind.GRID else None
    if scatter is not None:
        pictures["FAIL over the grid"] = scatter
    elif results.study.design.kind is not DesignKind.GRID and found:
        pictures["Samples"] = _scatter(results, found[0].name, decided_by(found[0]).rpartition(" (")[0] or decided_by(found[0]))
    if len(results.study.pareto) >= 2:
        pictures["Pareto front"] = _pareto(results)
    return pictures


def write_study_picture(path: str, results: Results) -> None:
    """Write the figures of a study below one another as one PNG."""
    import io

    from matplotlib.image import imread, imsave

    images = []
    for title, figure in study_pictures(results).items():
        figure.suptitle(title)
        data = io.BytesIO()
        figure.savefig(data, format="png")
        data.seek(0)
        images.append(imread(data))
    width = max((image.shape[1] for image in images), default=1)
    padded = [np.pad(image, ((0, 0), (0, width - image.shape[1]), (0, 0)), constant_values=1.0) for image in images]
    imsave(path, np.concatenate(padded) if padded else np.ones((1, 1, 4)), format="png")


def _figure(height: float = 4.5) -> "tuple[Figure, Axes]":
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, height), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots()


def _tornado(name: str, swings: list[Swing], nominal: float) -> "Figure":
    shown = swings[:_MOST_BARS][::-1]
    text, size = label(name)
    figure, axes = _figure(1.5 + 0.3 * len(shown))
    axes.barh(
        [s.factor for s in shown], [(s.high - s.low) / size for s in shown], left=[s.low / size for s in shown], color=_PASS
    )
    axes.use_sticky_edges = False  # else the first bar would start at the frame
    axes.axvline(nominal / size, color="black", linewidth=0.8)
    axes.set(xlabel=f"{text}; each factor a standard deviation, or a level, off nominal")
    axes.grid(alpha=0.3, axis="x")
    return figure


def _indices(name: str, indices: list[Index]) -> "Figure":
    shown = indices[:_MOST_BARS][::-1]
    figure, axes = _figure(1.8 + 0.35 * len(shown))
    places = np.arange(len(shown))
    first = [index.first for index in shown]
    axes.barh(places + 0.2, first, 0.38, xerr=[index.first_error for index in shown], color=_PASS, label="alone")
    if all(index.total is not None for index in shown):
        totals, errors = [index.total or 0.0 for index in shown], [index.total_error or 0.0 for index in shown]
        axes.barh(places - 0.2, totals, 0.38, xerr=errors, color=_FRONT, label="with interactions")
    axes.set_yticks(places, [index.factor for index in shown])
    axes.set(xlabel=f"share of the variance of {label(name)[0].partition(' [')[0]} (Sobol index, 95 % interval)")
    axes.grid(alpha=0.3, axis="x")
    axes.legend(frameon=False)
    return figure


def _scatter(results: Results, response: str, factor: str) -> "Figure":
    figure, axes = _figure()
    names = [each.name for each in results.study.design.factors]
    i = names.index(factor) if factor in names else 0
    chosen = np.flatnonzero(results.drawn)[:_MOST_DOTS]
    text, size = label(response)
    x, y = results.study.design.coordinates[chosen, i], results.numbers(response)[chosen] / size
    fails = results.numbers(FAILS)[chosen] == 1.0
    axes.scatter(x[~fails], y[~fails], s=8, color=_PASS, label="does not FAIL")
    axes.scatter(x[fails], y[fails], s=14, color=_FAIL, marker="x", label="FAIL")
    levels = results.study.design.factors[i].levels
    if levels:
        axes.set_xticks(range(len(levels)), [str(level) for level in levels])
    axes.set(xlabel=names[i], ylabel=text)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    return figure


def _grid_map(results: Results) -> "Figure | None":
    """Return a map over the two factors that decide most: the share of the other combinations that FAIL."""
    design = results.study.design
    counts = [len(factor.levels) for factor in design.factors]
    if sum(count > 1 for count in counts) < 2:
        return None
    ranks = {index.factor: index.rank for index in results.indices(FAILS)}
    order = sorted(range(len(counts)), key=lambda k: (round(ranks.get(design.factors[k].name, 0.0), 3), counts[k]))
    i, j = sorted(order[-2:])
    fails, known = results.numbers(FAILS), ~results.refused
    shape = (counts[j], counts[i])
    total, failing = np.zeros(shape), np.zeros(shape)
    at = design.coordinates[known][:, [j, i]].astype(int)
    np.add.at(total, tuple(at.T), 1.0)
    np.add.at(failing, tuple(at.T), fails[known])
    share = np.divide(failing, total, out=np.full(shape, np.nan), where=total > 0.0)
    figure, axes = _figure(5.5)
    image = axes.imshow(share, origin="lower", aspect="auto", vmin=0.0, vmax=1.0, cmap="RdYlBu_r")
    for axis, k in ((axes.xaxis, i), (axes.yaxis, j)):
        levels = design.factors[k].levels
        step = max(len(levels) // 12, 1)
        axis.set_ticks(range(0, len(levels), step), [_label(level) for level in levels[::step]])
    axes.set(xlabel=design.factors[i].name, ylabel=design.factors[j].name)
    figure.colorbar(image, label="share that FAIL")
    return figure


def _label(level: object) -> str:
    return f"{level:.3g}" if isinstance(level, float) else str(level)


def _pareto(results: Results) -> "Figure":
    figure, axes = _figure(5.0)
    x_name, y_name, *rest = results.study.pareto
    (x_text, x_size), (y_text, y_size) = label(x_name), label(y_name)
    x, y, fails = results.numbers(x_name) / x_size, results.numbers(y_name) / y_size, results.numbers(FAILS)
    front = results.front(results.study.pareto)
    for mask, color, mark, said in ((fails == 0.0, _PASS, "o", "does not FAIL"), (fails == 1.0, _FAIL, "x", "FAIL")):
        axes.scatter(x[mask], y[mask], s=18, color=color, marker=mark, label=said, alpha=0.5)
    if rest:
        text, size = label(rest[0])
        third = results.numbers(rest[0])[front] / size
        dots = axes.scatter(
            x[front], y[front], s=70, c=third, cmap="viridis", edgecolors="black", label="Pareto front", zorder=3
        )
        figure.colorbar(dots, label=text)
    else:
        axes.plot(x[front], y[front], "o-", color=_FRONT, label="Pareto front", zorder=3)
    axes.set(xlabel=x_text, ylabel=y_text)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    return figure
