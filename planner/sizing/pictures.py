"""Pictures of the choice of drives: the mass and the spare margin of each drive."""

from collections.abc import Sequence
from itertools import islice, zip_longest
from typing import TYPE_CHECKING

from planner.sizing.choice import Choice, spare

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MARKS = "osD^vPX*"
_COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Okabe and Ito's palette, readable with colour blindness, for the best drives."""

_OTHER = "#bbbbbb"

_SHOWN = (-0.5, 3.0)
"""Range of the spare margin shown; values outside are drawn at the edge."""


def sizing_pictures(choices: Sequence[Choice]) -> dict[str, "Figure"]:
    """Return the figure by title: a panel per joint with drives by mass and smallest spare margin.

    The best drives of each joint have a colour and a name. Drives without a mass on their
    datasheet, and drives for which no motion was found, are not shown.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    joints = list(dict.fromkeys(choice.joint for choice in choices if choice.judged))
    variants = list(dict.fromkeys(choice.variant for choice in choices))
    names = _best(choices)
    if not joints:
        return {}
    columns = min(len(joints), 3)
    figure = Figure(figsize=(12.0, 6.5 if len(joints) <= 3 else 7.8), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(-(-len(joints) // columns), columns, squeeze=False).ravel()
    for joint, axes in zip(joints, panels, strict=False):
        axes.axhline(0.0, color="black", linewidth=0.8)
        for choice in choices:
            mark = _MARKS[variants.index(choice.variant) % len(_MARKS)]
            for judged in choice.judged if choice.joint == joint else ():
                tightest = judged.tightest()
                if judged.mass is None or tightest is None:
                    continue
                percent = 100.0 * min(max(spare(tightest), _SHOWN[0]), _SHOWN[1])
                named = judged.name in names
                color = _COLORS[names.index(judged.name)] if named else _OTHER
                fill = "none" if judged.fails else "full"
                size, order = (6, 3) if named else (3, 2)
                axes.plot(judged.mass, percent, mark, color=color, fillstyle=fill, markersize=size, zorder=order)
        axes.set(title=joint, xlabel="mass of the drive [kg]", ylabel="smallest margin beyond the required one [%]")
        axes.margins(x=0.15)
        axes.grid(alpha=0.3, linewidth=0.5)
    for axes in panels[len(joints) :]:
        axes.axis("off")
    key = panels[0]
    for k, name in enumerate(names):
        key.plot([], [], "s", color=_COLORS[k], label=name)
    key.plot([], [], "s", color=_OTHER, markersize=3, label="another drive")
    for k, variant in enumerate(variants):
        key.plot([], [], _MARKS[k % len(_MARKS)], color="grey", label=f"boom: {variant}")
    key.plot([], [], "o", color="grey", fillstyle="none", label="hollow: FAIL")
    figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=8)
    return {"Drives by mass and spare margin": figure}


def _best(choices: Sequence[Choice]) -> list[str]:
    """Return the names of the first ranked drives with a mass of every choice, one per colour."""
    weighed = ([judged.name for judged in choice.judged if judged.mass is not None] for choice in choices)
    ranked = (name for place in zip_longest(*weighed) for name in place if name is not None)
    return list(islice(dict.fromkeys(ranked), len(_COLORS)))
