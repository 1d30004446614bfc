"""Pictures of a link design."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from boom_model.arrays import Array
from boom_model.link_design import internal_forces, von_mises
from planner.files import replacing
from planner.links.convergence import PLACES, study
from planner.links.design import LinkDesign
from planner.links.report import title

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_BLUE, _ORANGE, _GREEN, _PURPLE = "#0072b2", "#d55e00", "#009e73", "#cc79a7"


def write_link_picture(path: str | Path, design: LinkDesign) -> None:
    """Write a PNG with eight plots: contour, stress, convergence, joint torque and mass.

    Raises:
        InputError: the file cannot be written; an old one is left as it was.
    """
    figure = _figure(14.0, 17.0)
    panels = figure.subplots(4, 2)
    figure.suptitle(title(design), fontsize=11)
    _draw_design(design, panels[[0, 0, 3, 3], [0, 1, 0, 1]])
    _draw_convergence(design, panels[[1, 1, 2, 2], [0, 1, 0, 1]])
    with replacing(path) as temporary:
        figure.savefig(temporary, format="png")


def link_pictures(design: LinkDesign) -> dict[str, "Figure"]:
    """Return the same plots in two figures, by title."""
    found = {}
    for name, draw in (("Design", _draw_design), ("Convergence", _draw_convergence)):
        found[name] = _figure(11.0, 7.2)
        draw(design, found[name].subplots(2, 2).ravel())
    return found


def _figure(width: float, height: float) -> "Figure":
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _draw_design(design: LinkDesign, panels: "Sequence[Axes]") -> None:
    """Draw contour, stress, torque and mass."""
    contour, stress, torque, bars = panels
    x = design.beam.stations
    for H, name, color in ((design.heights, "design", _BLUE), (design.found.stress_heights, "stress only", _ORANGE)):
        contour.fill_between(x, 500.0 * H, -500.0 * H, color=color, alpha=0.35 if name == "design" else 0.6, label=name)
    contour.plot([0.0, design.link.length], [0.0, 0.0], "ko", markersize=4, label="pins")
    contour.set(title="Contour of the plates (height not to scale)", xlabel="x from the root [m]", ylabel="y [mm]")
    before = design.found.stress_heights
    only = von_mises(design.beam, before, internal_forces(design.beam, before, design.cases))
    stress.plot(x, 1e-6 * design.stress, color=_BLUE, label="design")
    stress.plot(x, 1e-6 * only.max(axis=0), color=_ORANGE, linewidth=1.0, label="stress only")
    stress.axhline(1e-6 * design.limits.stress, color="black", linestyle="--", linewidth=1.0, label="limit")
    stress.set(title="Largest von Mises stress", xlabel="x from the root [m]", ylabel="[MPa]", ylim=(0.0, None))
    t = np.concatenate([each.t for each in design.trajectories])
    for values, name, color in zip(design.torques, ("original link", "designed link"), (_ORANGE, _BLUE), strict=True):
        torque.plot(*_broken_between_moves(design, t, values), color=color, label=name)
    torque.set(title="Torque of the link's joint along the moves", xlabel="t [s]", ylabel="[Nm]")
    masses = [design.before.bodies[design.link.name].mass, design.body.mass]
    fittings = 0.0 if design.link.fittings is None else design.link.fittings.mass
    bars.bar(["original", "designed"], masses, color=[_ORANGE, _BLUE], width=0.5)
    bars.bar(["designed"], [fittings], color="grey", width=0.5, label="of which fittings (kept)")
    for i, value in enumerate(masses):
        bars.text(i, value, f"{value:.2f} kg", ha="center", va="bottom")
    bars.set(title="Mass of the whole link", ylabel="[kg]", ylim=(0.0, 1.15 * max(masses)))
    _finish(panels)


def _draw_convergence(design: LinkDesign, panels: "Sequence[Axes]") -> None:
    """Draw mass by slices and by delta-H, deflection and stress by elements."""
    slices, steps, elements, places = panels
    found = study(design)
    slices.plot(found.slices[:, 0], found.slices[:, 1], marker="o", color=_BLUE, label="plates")
    slices.set(title="Mass by number of slices", xlabel="slices", ylabel="[kg]")
    steps.set(title="Mass by delta-H of the thesis's method", xlabel="delta-H [m]", ylabel="[kg]")
    if found.steps is None or found.stepless is None:
        _say(steps, "not run: the load cases are single instants")
    else:
        steps.semilogx(found.steps[:, 0], found.steps[:, 1], marker="o", color=_ORANGE, label="thesis's method")
        steps.axhline(found.stepless, color=_BLUE, label="exact, same constraints")
    for (name, curve), color in zip(found.deflections.items(), (_PURPLE, _BLUE, _GREEN, _ORANGE), strict=False):
        elements.semilogx(curve[:, 0], 1e3 * curve[:, 1], marker=".", color=color, label=name)
    elements.axhline(1e3 * design.limits.deflection, color="black", linestyle="--", linewidth=1.0, label="limit")
    elements.set(title="Deflection by finite elements", xlabel="elements", ylabel="[mm]")
    places.set(title="Stress at places, beam elements of constant height", xlabel="elements", ylabel="[MPa]")
    if found.stresses is None:
        for axes in (elements, places):
            _say(axes, "not modelled: the link telescopes")
    else:
        for place, curve in zip(PLACES, found.stresses.T[1:], strict=True):
            places.semilogx(found.stresses[:, 0], 1e-6 * curve, marker=".", label=f"x = {place * design.link.length:.3g} m")
    _finish(panels)


def _finish(panels: "Sequence[Axes]") -> None:
    for axes in panels:
        axes.grid(alpha=0.25)
        if axes.get_legend_handles_labels()[0]:
            axes.legend(fontsize=8)


def _say(axes: "Axes", text: str) -> None:
    axes.text(0.5, 0.5, text, ha="center", transform=axes.transAxes)


def _broken_between_moves(design: LinkDesign, t: Array, values: Array) -> tuple[Array, Array]:
    """Return times and values with a gap between motions."""
    ends = np.cumsum([each.t.size for each in design.trajectories])[:-1]
    return np.insert(t, ends, np.nan), np.insert(values, ends, np.nan)
