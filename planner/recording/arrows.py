"""Pin forces and the wrench on the mount, drawn as arrows over time."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import rerun as rr

from boom_model import Boom, Loads
from boom_model.arrays import Array
from boom_model.kinematics.frames import frame_transforms
from planner.recording.palette import LIGHT, PURPLE, Color
from planner.recording.scene import POSES_AT_ONCE
from planner.recording.stream import time_column

LONGEST = 0.9
"""Upper bound of the length of the longest arrow [m]."""

_PIN_END = 0.1  # [m]: distance to the end of the pin on the boom's right, clear of the links
_PINS = {
    6: "force of the lower link on the outer link",
    7: "force of the outer link on the upper link",
    8: "force of the inner link on the upper link",
}
_FORCE, _MOMENT = LIGHT, PURPLE


ARROWS_NOTE = (
    "The title of the 3D view gives the scale of the arrows. Pin forces start at the end of their pin: "
    f"{'; '.join(f'pin {pin}, {name}' for pin, name in _PINS.items())}. "
    "The force and the moment of the boom on its mount start at the origin of frame 1."
)


@dataclass(frozen=True)
class Scale:
    """Force and moment that one metre of arrow stands for; None where there is nothing to draw."""

    force: float | None
    """[N]"""
    moment: float | None
    """[Nm]"""

    @property
    def sentence(self) -> str:
        """The scale as text for a title."""
        kinds = (("white", self.force, "N"), ("purple", self.moment, "Nm"))
        shown = [f"{color} 1 m = {value:g} {unit}" for color, value, unit in kinds if value is not None]
        return f"arrows: {', '.join(shown)}" if shown else "no arrows"


def arrow_scale(loads: Loads) -> Scale:
    """Return the scale that keeps every arrow of a motion shorter than LONGEST.

    Each value is the smallest of 1, 2, 5, 10, ... N or Nm per metre that does so.
    """
    if loads.pins is None or loads.mount is None:
        return Scale(None, None)
    forces = [*(getattr(loads.pins, f"frame_{pin}") for pin in _PINS), loads.mount[:, :3]]
    return Scale(_round_scale(max(_largest(force) for force in forces)), _round_scale(_largest(loads.mount[:, 3:])))


def _largest(vectors: Array) -> float:
    return float(np.sqrt((vectors**2).sum(axis=-1).max()))


def _round_scale(largest: float) -> float | None:
    if not largest > 0.0:
        return None
    least = largest / LONGEST
    power = 10.0 ** np.floor(np.log10(least))
    return float(next(step * power for step in (1.0, 2.0, 5.0, 10.0, 20.0) if step * power >= least))


def log_arrows(recording: rr.RecordingStream, boom: Boom, t: Array, q: Array, loads: Loads, scale: Scale) -> None:
    """Log the forces at pins 6, 7 and 8, and the force and moment of the boom on its mount.

    The arrows are drawn in the frame "mount", to the given scale. Nothing is logged for loads
    without pin forces or without the wrench on the mount.
    """
    if loads.pins is None or loads.mount is None:
        return
    for pin in _PINS:
        _log_style(recording, f"pin_{pin}", f"pin {pin}", _FORCE)
    _log_style(recording, "mount_force", "force on the mount", _FORCE, named=False)
    _log_style(recording, "mount_moment", "moment on the mount", _MOMENT, named=False)
    for start in range(0, len(t), POSES_AT_ONCE):
        part = slice(start, start + POSES_AT_ONCE)
        for name, origins, vectors in arrows(boom, q[part], loads, scale, part):
            columns = rr.Arrows3D.columns(vectors=vectors, origins=origins)
            recording.send_columns(f"world/loads/{name}", [time_column(t[part])], columns)


def arrows(boom: Boom, q: Array, loads: Loads, scale: Scale, part: slice = slice(None)) -> Iterator[tuple[str, Array, Array]]:
    """Yield name, foot (n, 3) [m] and vector (n, 3) [m] of each arrow in the frame "mount".

    Args:
        boom: the boom.
        q: (n, 5) joint positions.
        loads: loads with reactions, n of them in `part`.
        scale: what a metre of arrow stands for.
        part: samples of the loads.
    """
    assert loads.pins is not None
    assert loads.mount is not None
    c, s = np.cos(q[:, 0]), np.sin(q[:, 0])
    frames = frame_transforms(boom, q, "outer")[..., :3, 3]
    right = np.stack([s, -c, np.zeros_like(c)], axis=-1)
    for pin in _PINS:
        x, y, z = getattr(loads.pins, f"frame_{pin}")[part].T
        if scale.force is not None:
            yield (
                f"pin_{pin}",
                frames[:, pin - 1] + _PIN_END * right,
                np.stack([c * x - s * y, s * x + c * y, z], -1) / scale.force,
            )
    foot = np.zeros((len(q), 3))
    if scale.force is not None:
        yield "mount_force", foot, loads.mount[part, :3] / scale.force
    if scale.moment is not None:
        yield "mount_moment", foot, loads.mount[part, 3:] / scale.moment


def _log_style(recording: rr.RecordingStream, name: str, label: str, color: Color, *, named: bool = True) -> None:
    """Log colour and label; a label that is not `named` shows where the mouse points."""
    style = rr.Arrows3D.from_fields(colors=[color], radii=[0.007], labels=[label], show_labels=named)
    recording.log(f"world/loads/{name}", style, rr.CoordinateFrame("mount"), static=True)
