"""Workspace of the tip as a layer, mapped in bands that show progress and can be stopped."""

from dataclasses import dataclass

import numpy as np

from boom_model import Boom, ChoosingConstraint, Constraint, ReachMap, reach_map
from boom_model.arrays import Array
from boom_model.kinematics.constraints import ActuatorHorizontal
from planner.progress import Track

_BANDS = 24


@dataclass(frozen=True, eq=False)
class Workspace:
    """Cells that the tip reaches within the limits, in the arm's vertical plane."""

    constraint: Constraint
    pitch: float
    """[rad]"""
    points: Array
    """(k, 3) x, 0 and z of the cells, in the plane that yaws with the arm [m]."""
    margin: Array
    """(k,) torque margin, as in `ReachMap`."""
    cell: float
    """Width of a cell [m]."""


def workspace(boom: Boom, constraint: Constraint, pitch: float, track: Track = iter) -> Workspace:
    """Return the cells that are reached within the limits.

    A constraint that chooses among branches costs a thousand times as much, and is mapped in cells
    twice as wide.

    Args:
        boom: the boom.
        constraint: the constraint of the tip targets.
        pitch: of the end effector [rad].
        track: goes through the bands; it may show progress, and end the work with an exception.
    """
    whole = reach_map(boom, ActuatorHorizontal(), pitch)
    every = 2 if isinstance(constraint, ChoosingConstraint) else 1
    r, heights = whole.r[::every], whole.z[::every]
    bands = [z for z in np.array_split(heights, _BANDS) if z.size]
    maps = [reach_map(boom, constraint, pitch, r, z) for z in track(bands)]
    parts = [_reached(each) for each in maps]
    points, margin = (np.concatenate(part) for part in zip(*parts, strict=True))
    return Workspace(constraint, pitch, points, margin, float(r[1] - r[0]))


def _reached(found: ReachMap) -> tuple[Array, Array]:
    row, column = np.nonzero(found.within_limits)
    points = np.stack([found.r[column], np.zeros(len(row)), found.z[row]], axis=-1)
    return points, found.torque_margin[row, column]
