"""What a row scan is to do, and what is planned: visits of plots, legs of the day."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from boom_model.arrays import Array
from planner.field.scan_ground import GroundLines
from planner.field.scan_rows import Beside


@dataclass(frozen=True)
class ScanTask:
    """What to scan with, in SI."""

    footprint: tuple[float, float]
    """Of the sensor on the canopy, along the arm and across it [m]."""
    rate: float = 4.0
    """Of the sensor [Hz]."""
    tip_height: float = 0.9
    """Of the tip over the mount [m]: canopy and distance, less the height of the mount."""
    overlap: float = 0.1
    """Of two lines beside each other, as a share of the footprint."""
    offset: float | None = None
    """From the track to the middle of a row [m]; None is where the fewest stops do."""
    speed: float | None = None
    """Of the vehicle past the plots [m/s]; None is with stops."""
    passes: int | None = None
    """Along each row at that speed; None is the fewest that the boom can follow."""
    drive_speed: float = 1.0
    """Of the vehicle from stop to stop, back along a row, and in turns [m/s]."""
    turn_radius: float = 4.0
    """Of the vehicle's turns between rows [m]."""
    profile: str = "jerk-limited"
    constraint: str = "horizontal"


@dataclass(frozen=True, eq=False)
class Visit:
    """A plot's part of the scan."""

    stops: tuple[float, ...]
    """Of the mount, along the plot from its middle [m]."""
    lines: tuple[float, ...]
    """Of the tip, to the left of the track [m]."""
    half: float
    """How far the tip goes to either side of the mount [m]."""
    reason: str
    """Why a line cannot be reached; empty where all can."""
    kind: int = 0
    """Number of its kind: plots of one kind have the same moves."""
    ground: tuple[tuple[GroundLines, ...], ...] = ()
    """Of each pass, lines across the plot that stand still over the ground: from the near edge, and
    from the far edge if they end there. With them, `lines` are not driven."""


@dataclass(frozen=True)
class PassOption:
    """How fast the vehicle may go if it passes each row a number of times."""

    passes: int
    sweep: float
    """How far the tip goes across the row in each pass [m]."""
    speed: float
    """About the largest of the vehicle [m/s]; 0 where the tip does not reach."""
    limit: str


@dataclass(frozen=True, eq=False)
class Leg:
    """Part of the vehicle's day, with the mount's way in the plane of the map."""

    what: str
    """stop, pass, drive, back, turn"""
    duration: float
    """[s]"""
    way: Array
    """(n, 2) places of the mount, driven evenly [m]; one where it stands"""
    ahead: Array | None
    """(2,) where the vehicle looks; None is along the way"""
    moves: tuple[str, ...] = ()
    """Of the boom, one after the other from the leg's begin; then it holds still."""
    start: str = ""
    """The tip's target at the begin."""
    goal: str = ""
    """The tip's target at the end."""
    plot: int = -1

    def mount(self, t: Array) -> tuple[Array, Array]:
        """Return places (n, 2) [m] and unit vectors ahead (n, 2) at times t (n,) from its begin."""
        if len(self.way) == 1:
            ahead = np.array([1.0, 0.0]) if self.ahead is None else self.ahead
            return np.tile(self.way[0], (len(t), 1)), np.tile(ahead, (len(t), 1))
        steps = np.array([np.linalg.norm(b - a) for a, b in pairwise(self.way)])
        at = np.concatenate([[0.0], np.cumsum(steps)])
        along = np.clip(t / self.duration, 0.0, 1.0) * at[-1]
        places = np.stack([np.interp(along, at, column) for column in self.way.T], axis=-1)
        if self.ahead is not None:
            return places, np.tile(self.ahead, (len(t), 1))
        piece = np.clip(np.searchsorted(at, along, side="right") - 1, 0, len(steps) - 1)
        directions = np.diff(self.way, axis=0) / np.maximum(steps, 1e-12)[:, None]
        return places, directions[piece]


def targets_of(visit: Visit, task: ScanTask) -> tuple[str, ...]:
    """Return the targets of the tip over one stop, to and fro, or in every pass."""
    targets = []
    for number, y in enumerate(visit.lines):
        half = visit.half
        ends = (-half, half) if number % 2 == 0 else (half, -half)
        targets += [f"tip={x + 0.0:.4f},{y:.4f},{task.tip_height:.4f}" for x in (ends if half > 0.0 else (0.0,))]
    return tuple(targets)


def ground_name(kind: int, number: int, side: int) -> str:
    """Return the words of a move over the ground.

    Args:
        kind: of the plot.
        number: of the pass, from 0 on.
        side: where it begins: 0 at the near edge, 1 at the far one.
    """
    plots = f", plots of kind {kind + 1}" if kind else ""
    return f"lines across, pass {number + 1}, from the {'far' if side else 'near'} edge{plots}"


def first_line(plot: Beside, lines: int, task: ScanTask) -> float:
    """Return where the first line across a plot is, along the row from its middle [m]."""
    return plot.x[0] + 0.5 * task.footprint[1] if lines > 1 else 0.5 * (plot.x[0] + plot.x[1])
