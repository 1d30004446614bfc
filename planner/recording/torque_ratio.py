"""Torque / limit of each drive along a motion, and the tip path coloured by it."""

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
"""Upper bound, name and colour of each band of torque / limit.

A demand at its limit is not above it.
"""

UNKNOWN: tuple[str, Color] = ("no drive limit is known", LIGHT)


def torque_ratios(boom: Boom, trajectory: Trajectory, tau: Array) -> dict[str, Array]:
    """Return torque / limit (n,) of each driven joint.

    For a drive it is the larger of two ratios: gearbox torque over start-stop torque, and motor
    torque over the torque-speed limit at that speed, as the planner computes them. For the
    extension it is the force over the peak force of the actuator.
    """
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
    """Return the largest of the ratios (n,); None where no drive limit is known."""
    return np.max(list(ratios.values()), axis=0) if ratios else None


def log_tip_path(recording: rr.RecordingStream, positions: Array, worst: Array | None) -> None:
    """Log the tip path (n, 3) [m] in "mount", coloured by the ratios `worst` (n,).

    A segment between two samples has the colour of the larger of their ratios. Neighbouring
    segments of one band form one strip.
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
    """Return name and colour of every band, or of UNKNOWN if no drive limit is known."""
    return [(name, color) for _, name, color in BANDS] if known else [UNKNOWN]
