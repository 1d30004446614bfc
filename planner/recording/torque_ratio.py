"""How near each drive is to its limit along a motion, the path of the tip coloured by it, and what the colours mean."""

import numpy as np
import rerun as rr

from boom_model import JOINTS, Boom
from boom_model.arrays import Array
from boom_model.drives.drive import drive_torque_limit
from planner.checks.rows import SAMPLING_SLACK
from planner.motion.trajectory import Trajectory
from planner.recording.legend import Legend
from planner.recording.palette import BLUE, GREEN, LIGHT, ORANGE, SKY_BLUE, VERMILION, YELLOW, Color
from planner.timing.path_limits import load_ratio

BANDS: tuple[tuple[float, str, Color], ...] = (
    (0.2, "below 0.2", BLUE),
    (0.4, "0.2 to 0.4", SKY_BLUE),
    (0.6, "0.4 to 0.6", GREEN),
    (0.8, "0.6 to 0.8", YELLOW),
    (1.0 + SAMPLING_SLACK, "0.8 to 1", ORANGE),
    (np.inf, "over the limit", VERMILION),
)
"""Upper bound, name and colour of each band of torque / limit; at the limit is not yet over it."""

UNKNOWN: tuple[str, Color] = ("no drive's limit is known", LIGHT)


def torque_ratios(boom: Boom, trajectory: Trajectory, tau: Array) -> dict[str, Array]:
    """Torque / limit (n,) of each driven joint: the larger of gearbox torque over its start-stop torque and motor torque over
    what its curve leaves at that speed, as the planner holds them; the extension's force over its actuator's peak force."""
    ratios = load_ratio(boom, tau, trajectory.qd, trajectory.qdd)
    found = {
        joint: ratios[:, i]
        for i, (joint, drive) in enumerate(zip(JOINTS, boom.drives, strict=True))
        if drive is not None and drive_torque_limit(drive, 0.0) is not None
    }
    if boom.actuator is not None and boom.actuator.actuator.peak_force is not None:
        found["extension"] = np.abs(tau[:, 3]) / boom.actuator.actuator.peak_force
    return found


def worst_ratio(ratios: dict[str, Array]) -> Array | None:
    """The largest of the ratios (n,); None where no drive's limit is known."""
    return np.max(list(ratios.values()), axis=0) if ratios else None


def log_tip_path(recording: rr.RecordingStream, positions: Array, worst: Array | None) -> None:
    """The tip's path (n, 3) [m] in "mount", each piece between two samples in the band of the worse of their ratios (n,).

    Neighbours of one band share a strip.
    """
    if worst is None:
        strips, colors = [positions], [UNKNOWN[1]]
    else:
        worse = np.maximum(worst[1:], worst[:-1]) if len(worst) > 1 else worst
        band = np.searchsorted([bound for bound, _, _ in BANDS], worse)
        starts = np.concatenate([[0], np.flatnonzero(np.diff(band)) + 1])
        ends = np.append(starts[1:], len(band))
        strips = [positions[start : end + 1] for start, end in zip(starts, ends, strict=True)]
        colors = [BANDS[band[start]][2] for start in starts]
    path = rr.LineStrips3D(strips, colors=colors, radii=[0.006] * len(strips))
    recording.log("world/tip_path", path, rr.CoordinateFrame("mount"), static=True)


def legend(known: bool) -> Legend:
    """Name and colour of every band, or what stands for them where no drive's limit is known."""
    return [(name, color) for _, name, color in BANDS] if known else [UNKNOWN]
