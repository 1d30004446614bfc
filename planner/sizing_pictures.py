"""The choice of drives as pictures: what each drive weighs and what it has to spare."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from planner.sizing import Choice, room

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MARKS = "osD^vPX*"
_FINE, _FAILS = "#0072b2", "#d55e00"  # Okabe and Ito's blue and vermilion, which the colour-blind can tell apart
_SHOWN = (-0.5, 3.0)
"""Rooms beyond are drawn at the edge."""


def sizing_pictures(choices: Sequence[Choice]) -> dict[str, "Figure"]:
    """A figure with a panel for each joint: drives by mass and by the least room beyond the required margin, by title.

    A drive without a mass on its sheet, and one for which no motion was found, has no place in it.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    joints = list(dict.fromkeys(choice.joint for choice in choices if choice.judged))
    variants = list(dict.fromkeys(choice.variant for choice in choices))
    if not joints:
        return {}
    columns = min(len(joints), 3)
    figure = Figure(figsize=(12.0, 4.5 if len(joints) <= 3 else 7.5), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(-(-len(joints) // columns), columns, squeeze=False).ravel()
    for joint, axes in zip(joints, panels, strict=False):
        axes.axhline(0.0, color="black", linewidth=0.8)
        for choice in choices:
            mark, named = _MARKS[variants.index(choice.variant) % len(_MARKS)], set()
            for judged in choice.judged if choice.joint == joint else ():
                tightest = judged.tightest()
                if judged.mass is None or tightest is None:
                    continue
                spare = min(max(room(tightest), _SHOWN[0]), _SHOWN[1])
                axes.plot(judged.mass, 100.0 * spare, mark, color=_FAILS if judged.fails else _FINE, markersize=5, alpha=0.7)
                if not judged.fails and judged.name not in named and choice is _first(choices, joint):
                    named.add(judged.name)
                    place = {"xytext": (4, 3), "textcoords": "offset points", "fontsize": 6}
                    axes.annotate(judged.name, (judged.mass, 100.0 * spare), **place)
        axes.set(title=joint, xlabel="mass of the drive [kg]", ylabel="least room beyond what is required [%]")
        axes.margins(x=0.25)
        axes.grid(alpha=0.3, linewidth=0.5)
    for axes in panels[len(joints) :]:
        axes.axis("off")
    for variant, mark in zip(variants, _MARKS, strict=False):
        panels[0].plot([], [], mark, color="grey", label=variant)
    for color, label in ((_FINE, "no FAIL"), (_FAILS, "FAIL")):
        panels[0].plot([], [], "s", color=color, label=label)
    figure.legend(loc="outside lower center", ncols=8, frameon=False, fontsize=8)
    return {"Drives by mass and room": figure}


def _first(choices: Sequence[Choice], joint: str) -> Choice:
    return next(choice for choice in choices if choice.joint == joint)
