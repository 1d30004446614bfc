"""Report of a log beside two models: first page, tables of parts, and pictures."""

from typing import TYPE_CHECKING, Any

import numpy as np

from boom_model import JOINTS
from boom_model.boom import LOAD_UNITS
from planner.experiments.residuals import HEADER, PARTS_HEADER, Residuals, cells, part_cells, tip_sentence
from planner.reports.markdown import section, table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_BEFORE, _AFTER, _NOISE = "#d55e00", "#009e73", "#999999"  # Okabe and Ito's, readable with colour blindness
_COLORS = ("#56b4e9", "#009e73", "#f0e442", "#e69f00", "#999999", "#cc79a7")


def first_page(title: str, asked: str, answer: dict[str, Any]) -> str:
    """Return the first page as Markdown: verdict and table of `Residuals.to_json`."""
    said = f"The boom as measured {verdict(answer)}."
    rows = table(HEADER, map(cells, answer["joints"]))
    return "\n".join([f"# {title}", "", asked, "", said, "", *rows, "", f"- {tip_sentence(answer['tip'])}", ""])


def verdict(answer: dict[str, Any]) -> str:
    """Return what the second model does to the log, as the rest of a sentence."""
    if answer["worse"]:
        return f"explains the torques of {', '.join(answer['worse'])} worse"
    moved = [joint for joint in answer["joints"] if joint["before_rms"] is not None]
    better = [joint["joint"] for joint in moved if joint["after_rms"] < joint["before_rms"]]
    return f"explains the torques of {len(better)} of {len(moved)} joints better, none worse"


def details(answer: dict[str, Any], measured: tuple[str, ...]) -> str:
    """Return the tables of parts, what was measured, and the notes, as Markdown."""
    rows = [row for joint in answer["joints"] for row in part_cells(joint)]
    explained = (
        "RMS of each part of the model's torque, and its share of the squared residual before that its change takes away. "
        "The shares and what is left add up to 100 %."
    )
    lines = ["## Parts", "", explained, "", *table(PARTS_HEADER, rows)]
    return "\n".join([*lines, *section("Measured", measured), *section("Notes", answer["notes"])]) + "\n"


def residual_figure(found: Residuals) -> "Figure":
    """Draw the torque that each model leaves over time, a panel a joint, and the tips' distance."""
    figure, panels = _panels()
    for i, axes in enumerate(panels[:5]):
        for fit, color, name in ((found.before, _BEFORE, "before"), (found.after, _AFTER, "after")):
            values = np.where(found.used[:, i], fit.residual[:, i], np.nan)
            axes.plot(found.t, values, color=color, linewidth=0.7, label=name)
        axes.axhspan(-found.noise[i], found.noise[i], color=_NOISE, alpha=0.3, label="noise, 1 sd")
        _label(axes, f"{JOINTS[i]}: log less model [{LOAD_UNITS[i]}]", "t [s]")
    panels[0].legend(fontsize=7, frameon=False)
    tip = panels[5]
    tip.plot(found.t, found.apart * 1e3, color="#0072b2", linewidth=0.9, label="tips apart")
    if found.after.tip_sd is not None:
        tip.plot(found.t, found.after.tip_sd * 1e3, color=_AFTER, linewidth=0.9, label="sd after")
    tip.set_ylim(bottom=0.0)
    tip.legend(fontsize=7, frameon=False)
    _label(tip, "tips of the two models [mm]", "t [s]")
    return figure


def part_figure(found: Residuals) -> "Figure":
    """Draw what each part of the torque takes of the squared residual before, and what is left."""
    figure, panels = _panels()
    left = (found.rms[1] / found.rms[0]) ** 2
    for i, axes in enumerate(panels[:5]):
        values = {name: share[i] for name, share in found.shares.items()} | {"left": left[i]}
        shades = [*_COLORS[: len(values) - 1], "#000000"]
        axes.barh(list(values), [100.0 * float(np.nan_to_num(x)) for x in values.values()], color=shades)
        axes.invert_yaxis()
        axes.axvline(0.0, color="#000000", linewidth=0.8)
        _label(axes, f"{JOINTS[i]}: share of the squared residual", "%")
    panels[5].axis("off")
    return figure


def _panels() -> "tuple[Figure, list[Axes]]":
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 5.2), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    return figure, list(figure.subplots(2, 3).ravel())


def _label(axes: "Axes", title: str, across: str) -> None:
    axes.set_title(title, fontsize=9)
    axes.set_xlabel(across, fontsize=8)
    axes.tick_params(labelsize=7)
    axes.grid(alpha=0.3, linewidth=0.5)
