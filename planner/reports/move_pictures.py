"""Pictures of a motion for reports: positions, velocities and torques with their limits."""

from typing import TYPE_CHECKING

import numpy as np

from boom_model import JOINTS, Boom
from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH, LOAD_UNITS
from boom_model.drives.drive import drive_inertia, drive_torque_limit
from planner.motion.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_VALUE, _LIMIT = "#0072b2", "#d55e00"  # Okabe and Ito's blue and vermilion, readable with colour blindness


def move_pictures(boom: Boom, motion: Trajectory, tau: Array) -> dict[str, "Figure"]:
    """Return a figure by title for each quantity of a motion with torques `tau` (n, 5)."""
    limits = boom.limits
    return {
        "Positions": _figure(motion, "position", "", motion.q, limits.lower, limits.upper),
        "Velocities": _figure(motion, "velocity", "/s", motion.qd, -limits.velocity, limits.velocity),
        "Torques": _torques(boom, motion, tau),
    }


def move_figure(boom: Boom, motion: Trajectory, tau: Array) -> "Figure":
    """Draw positions, velocities and torques (n, 5) with their limits, one column per joint."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(16.0, 8.0), dpi=90, layout="constrained")
    FigureCanvasAgg(figure)
    rows = figure.subplots(3, 5, sharex=True)
    for axes in rows.ravel():
        axes.grid(alpha=0.3, linewidth=0.5)
    limits = boom.limits
    _draw(list(rows[0]), motion, "position", "", motion.q, limits.lower, limits.upper)
    _draw(list(rows[1]), motion, "velocity", "/s", motion.qd, -limits.velocity, limits.velocity)
    _draw_torques(list(rows[2]), boom, motion, tau)
    figure.supxlabel("t [s]")
    return figure


def _figure(motion: Trajectory, name: str, per: str, values: Array, lower: Array, upper: Array) -> "Figure":
    figure, panels = _panels()
    _draw(panels, motion, name, per, values, lower, upper)
    return figure


def _torques(boom: Boom, motion: Trajectory, tau: Array) -> "Figure":
    figure, panels = _panels()
    _draw_torques(panels, boom, motion, tau)
    return figure


def _draw(panels: list["Axes"], motion: Trajectory, name: str, per: str, values: Array, lower: Array, upper: Array) -> None:
    for i, (joint, axes) in enumerate(zip(JOINTS, panels, strict=True)):
        scale, unit = (1.0, "m") if IS_LENGTH[i] else (180.0 / np.pi, "deg")
        axes.plot(motion.t, values[:, i] * scale, color=_VALUE)
        for bound in (lower[i], upper[i]):
            axes.axhline(bound * scale, color=_LIMIT, linewidth=1.0, linestyle="--")
        axes.set_title(f"{joint} {name} [{unit}{per}]", fontsize=9)


def _draw_torques(panels: list["Axes"], boom: Boom, motion: Trajectory, tau: Array) -> None:
    """Draw the torque of each joint with the limits of its drive, -T - J qdd and T - J qdd."""
    for i, (joint, axes) in enumerate(zip(JOINTS, panels, strict=True)):
        axes.plot(motion.t, tau[:, i], color=_VALUE)
        drive = boom.drives[i]
        limit = None if drive is None else drive_torque_limit(drive, motion.qd[:, i])
        note = ", no drive data"
        if drive is not None and limit is not None:
            own, note = drive_inertia(drive) * motion.qdd[:, i], ""
            for bound in (limit - own, -limit - own):
                axes.plot(motion.t, bound, color=_LIMIT, linewidth=1.0, linestyle="--")
        name, unit = "force" if IS_LENGTH[i] else "torque", LOAD_UNITS[i]
        axes.set_title(f"{joint} {name} [{unit}]{note}", fontsize=9)


def _panels() -> tuple["Figure", list["Axes"]]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 6.0), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(2, 3, sharex=True).ravel()
    for axes in panels[:5]:
        axes.grid(alpha=0.3, linewidth=0.5)
        axes.set_xlabel("t [s]", fontsize=8)
        axes.tick_params(labelsize=8, labelbottom=True)
    panels[5].axis("off")
    panels[5].plot([], [], color=_VALUE, label="motion")
    panels[5].plot([], [], color=_LIMIT, linestyle="--", label="limit")
    panels[5].legend(loc="center", frameon=False)
    return figure, list(panels[:5])
