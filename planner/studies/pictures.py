"""Pictures of a study: tornado, Sobol indices, scatter, map of a grid, Pareto front."""

from typing import TYPE_CHECKING

import numpy as np

from planner.studies.analysis import FAILS, Index, Results, Swing
from planner.studies.designs import DesignKind
from planner.studies.factors import Factor
from planner.studies.report import summaries
from planner.studies.responses import label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PASS, _FAIL, _FRONT = "#0072b2", "#d55e00", "#009e73"
_MOST_DOTS = 5000
_MOST_BARS = 15
_GOLDEN = 0.618034  # multiples of it, modulo 1, spread evenly


def study_pictures(results: Results) -> dict[str, "Figure"]:
    """Return the figures of a study by title: those for which it has data."""
    pictures: dict[str, Figure] = {}
    found = summaries(results)
    grid = results.study.design.kind is DesignKind.GRID
    deciding = list(results.indices(FAILS))
    if deciding:
        pictures[f"What decides {FAILS}"] = _indices(FAILS, deciding, grid)
    for each in found:
        swings = [swing for swing in each.swings if swing.high > swing.low]
        if swings and each.nominal is not None:
            pictures[f"Tornado: {label(each.name)[0]}"] = _tornado(each.name, swings, each.nominal)
        if each.indices:
            pictures[f"What decides {label(each.name)[0]}"] = _indices(each.name, list(each.indices), grid)
    over = _grid_map(results) if grid else None
    if over is not None:
        pictures["FAIL over the grid"] = over
    elif not grid and found:
        ranked = [index.factor for index in (*deciding, *found[0].indices)] + [swing.factor for swing in found[0].swings]
        factors = {factor.name: factor for factor in results.study.design.factors}
        pictures["Samples"] = _scatter(results, found[0].name, factors[ranked[0]] if ranked else next(iter(factors.values())))
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


def _indices(name: str, indices: list[Index], exact: bool) -> "Figure":
    shown = indices[:_MOST_BARS][::-1]
    figure, axes = _figure(2.0 + 0.35 * len(shown))
    places = np.arange(len(shown))
    totals = [index.total for index in shown if index.total is not None]
    bars = [(0.2, [index.first for index in shown], [index.first_error for index in shown], _PASS, "alone")]
    if len(totals) == len(shown):
        bars.append((-0.2, totals, [index.total_error or 0.0 for index in shown], _FRONT, "with interactions"))
    for shift, values, errors, color, said in bars:
        axes.barh(places + shift, values, 0.38, xerr=None if exact else errors, color=color, label=said)
    axes.set_yticks(places, [index.factor for index in shown])
    how = "exact over a grid" if exact else "Sobol index, 95 % interval"
    axes.set(xlabel=f"share of the variance of {label(name)[0].partition(' [')[0]} ({how})")
    axes.grid(alpha=0.3, axis="x")
    figure.legend(frameon=False, ncols=2, loc="outside lower center")
    return figure


def _scatter(results: Results, response: str, factor: Factor) -> "Figure":
    """Draw a response over a factor.

    Samples without a motion have no response and stand at the top.
    """
    figure, axes = _figure()
    i = results.study.design.factors.index(factor)
    chosen = np.flatnonzero(results.drawn & ~results.refused)[:_MOST_DOTS]
    text, size = label(response)
    x, y = results.study.design.coordinates[chosen, i], results.numbers(response)[chosen] / size
    if factor.levels:
        x = x + 0.5 * (np.arange(len(x)) * _GOLDEN % 1.0 - 0.5)  # side by side, where many are equal
        axes.set_xticks(range(len(factor.levels)), [_label(level) for level in factor.levels])
    fails, moves = results.numbers(FAILS)[chosen] == 1.0, np.isfinite(y)
    for mask, color, mark, said in (
        (moves & ~fails, _PASS, "o", "does not FAIL"),
        (moves & fails, _FAIL, "x", "FAIL"),
    ):
        if mask.any():
            axes.scatter(x[mask], y[mask], s=12, color=color, marker=mark, label=said)
    if not moves.all():
        top = np.full((~moves).sum(), 0.97)
        across = axes.get_xaxis_transform()
        axes.scatter(x[~moves], top, s=20, color=_FAIL, marker="|", label="FAIL: no motion", transform=across)
        axes.margins(y=0.12)
    beside = 0.05 * max(float(np.ptp(x)), 1e-9)  # marks at the top do not widen the axis by themselves
    axes.set_xlim(float(x.min()) - beside, float(x.max()) + beside)
    axes.set(xlabel=factor.name, ylabel=text)
    axes.grid(alpha=0.3)
    figure.legend(frameon=False, ncols=3, loc="outside lower center")
    return figure


def _grid_map(results: Results) -> "Figure | None":
    """Return a map over the two most decisive factors: share of other combinations that FAIL."""
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
        if np.isfinite(x[mask] + y[mask]).any():
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
    figure.legend(frameon=False, ncols=3, loc="outside lower center")
    return figure
