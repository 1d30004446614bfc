"""Plots of a study: Bode diagrams with closed-loop poles, and the tip error over time."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from boom_model import JOINTS
from boom_model.errors import InputError
from planner.control.study import Study
from planner.files import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Okabe and Ito's palette, safe for colour-blind readers. One colour per controller or joint.
PALETTE = ((0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167), (230, 159, 0), (86, 180, 233))


def loop_figure(study: Study) -> "Figure":
    """Plot magnitude and phase of every joint's loop at the goal, and the closed-loop poles.

    Each controller has a column.

    Raises:
        InputError: no controller of the study has a loop.
    """
    if not study.designs:
        raise InputError("a stepper runs in open loop and has no Bode diagram")
    columns = len(study.designs)
    figure = _figure(4.2 * columns, 9.0)
    axes = figure.subplots(3, columns, squeeze=False, sharey="row")
    for column, design in enumerate(study.designs):
        gain, phase, plane = axes[:, column]
        for i, joint in enumerate(JOINTS):
            L = design.loop.response[:, i]
            gain.semilogx(design.loop.frequencies, 20.0 * np.log10(np.abs(L)), color=_rgb(i), label=joint)
            angle = np.degrees(np.angle(L))
            angle[1:][np.abs(np.diff(angle)) > 180.0] = np.nan  # no vertical line where the phase wraps
            phase.semilogx(design.loop.frequencies, angle, color=_rgb(i))
        for f in study.modes_Hz:
            for each in (gain, phase):
                each.axvline(f, color="black", linewidth=0.6, linestyle=":")
        gain.axhline(0.0, color="black", linewidth=0.6)
        gain.set(title=f"{design.controller} ({'stable' if design.stable else 'UNSTABLE'})", xlabel="Hz", ylim=(-80.0, 80.0))
        phase.set(xlabel="Hz", ylim=(-180.0, 180.0), yticks=np.arange(-180, 181, 90))
        poles = design.loop.poles / (2.0 * np.pi)
        plane.plot(poles.real, poles.imag, "x", color="black", markersize=5)
        plane.axvline(0.0, color="black", linewidth=0.6)
        low = max(-60.0, float(poles.real.min()))
        plane.set(
            xlabel="real part / 2 pi [Hz]", xlim=(1.05 * low, max(3.0, 1.1 * float(poles.real.max()))), ylim=(-40.0, 40.0)
        )
        for each in (gain, phase, plane):
            each.grid(alpha=0.3)
    axes[0, 0].set_ylabel("loop gain [dB]")
    axes[1, 0].set_ylabel("phase [deg]")
    axes[2, 0].set_ylabel("imaginary part / 2 pi [Hz]")
    axes[0, 0].legend(fontsize=8, loc="lower left")
    figure.suptitle(
        f"{study.boom.name}: each joint's loop at the goal\nwith the others closed; closed-loop poles.\n"
        "Dotted: natural frequencies, motors fixed",
        fontsize=10,
    )
    return figure


def error_figure(study: Study) -> "Figure":
    """Plot the tip error over time, with a panel for each profile and shaper."""
    groups = list(dict.fromkeys((row.profile, row.shaper) for row in study.rows))
    figure = _figure(11.0, 1.2 + 2.0 * len(groups))
    axes = figure.subplots(len(groups), 1, squeeze=False, sharex=True)[:, 0]
    controllers = list(dict.fromkeys(row.controller for row in study.rows))
    sound = [1e3 * row.tip_error_peak_m for row in study.rows if row.tip_error_peak_m is not None]
    for panel, (profile, shaper) in zip(axes, groups, strict=True):
        for b, row in enumerate(study.rows):
            if (row.profile, row.shaper) == (profile, shaper):
                i = controllers.index(row.controller)
                label = row.controller + ("" if row.outcome == "follows" else f" ({row.outcome})")
                panel.plot(study.run.t, 1e3 * study.tip_error[:, b], color=_rgb(i), label=label, linewidth=1.2)
                panel.axvline(row.duration_s, color="black", linewidth=0.6, linestyle=":")
        panel.set_title(f"{profile}, shaper {shaper}", fontsize=9)
        panel.set_ylabel("tip error [mm]")
        panel.set_ylim(0.0, 1.05 * max(sound, default=100.0))
        panel.grid(alpha=0.3)
        panel.legend(fontsize=7, loc="upper left", ncols=len(controllers))
    axes[-1].set_xlabel("t [s]; dotted: end of the command")
    return figure


def study_pictures(study: Study) -> dict[str, "Figure"]:
    """Return both figures by title. A study of steppers only has no loops."""
    loops = {"Loops": loop_figure(study)} if study.designs else {}
    return {"Tip errors": error_figure(study)} | loops


def write_figure(path: str | Path, figure: "Figure") -> None:
    """Write a figure as a PNG file.

    Raises:
        InputError: the file cannot be written. An existing file is left unchanged.
    """
    with replacing(path) as temporary:
        Path(temporary).write_bytes(png(figure))


def png(figure: "Figure") -> bytes:
    """Return the figure as the content of a PNG file."""
    from io import BytesIO

    buffer = BytesIO()
    figure.savefig(buffer, format="png")
    return buffer.getvalue()


def _figure(width: float, height: float) -> "Figure":
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _rgb(i: int) -> str:
    return "#{:02x}{:02x}{:02x}".format(*PALETTE[i % len(PALETTE)])
