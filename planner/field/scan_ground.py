"""Lines of the tip across a plot that are straight over the ground while the vehicle drives past.

The vehicle's travel is the parameter of the path: at the travel d, the tip is in the mount's frame
at

    p(d) = ground(d) - d x

so the tip stays on its line over the ground whatever the speed of the vehicle. At a constant speed
v the joints follow the path at d = v t: their speeds grow with v, accelerations with v^2, jerks
with v^3. The largest speed is where the first of them, or a drive, is at its limit. A mount at
constant speed is an inertial frame, so the loads are those of a mount at rest.

Over a plot the tip comes to rest over the ground, crosses the plot, steps on, crosses it back and
so on, and comes to rest beside the vehicle again. Then a line along the row takes it forward for
the next plot.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from boom_model import Boom, InfeasibleError
from boom_model.arrays import Array
from boom_model.kinematics.constraints import Constraint, parse_constraint
from planner.motion.planned import PlannedMotion
from planner.motion.trajectory import STEP
from planner.move_spec import MoveSpec
from planner.paths.clearance import require_path_clear
from planner.paths.tip_path import TipPath, follow
from planner.planning import Move, check_motion, plan_motion
from planner.timing.path_limits import jerk_stretch, least_stretch
from planner.timing.time_law import Motion, TimeLaw

DOWN = -np.pi / 2.0
_SHARES = (0.6, 0.75, 0.9)
"""Tried: share of the travel from plot to plot in which the tip is over the ground."""
_LONGEST, _LEAST = 1.5, 1.0
"""That travel counts up to 1.5 times what the lines span, or 1 m."""
_WEIGHTS = (1.0, 1.6)
"""Tried: travel of a crossing over that of a step."""
_FEW_LOOKS, _LOOKS = 201, 1001
_JERK_LIMITED = "jerk-limited"
_DECIMALS = 9

Kind = Literal["catch", "cross", "step", "release"]


@dataclass(frozen=True, eq=False)
class GroundPiece:
    """Piece of the tip's curve in the mount's frame, over a share s of its travel.

    The smooth step S(s) = s^4 (35 - 84 s + 70 s^2 - 20 s^3) leads from 0 to 1 with zero speed,
    acceleration and jerk at both ends.
    """

    kind: Kind
    start: tuple[float, float, float]
    """Of the tip [m]."""
    travel: float
    """Of the vehicle [m]."""
    by: float = 0.0
    """Across the row in a crossing, along it in a step, over the ground [m]."""

    def __call__(self, s: Array) -> Array:
        """Return positions (..., 3) at s (...)."""
        s = np.asarray(s, dtype=float)
        step = s**4 * (35.0 - 84.0 * s + 70.0 * s**2 - 20.0 * s**3)
        ahead, across = -self.travel * s, np.zeros_like(s)
        if self.kind in ("catch", "release"):  # over the ground, the speed goes from the vehicle's to 0, or back
            travelled = self.travel * (7.0 * s**5 - 14.0 * s**6 + 10.0 * s**7 - 2.5 * s**8)
            ahead = -travelled if self.kind == "catch" else ahead + travelled
        elif self.kind == "step":
            ahead = ahead + self.by * step
        else:
            across = self.by * step
        positions: Array = np.stack([self.start[0] + ahead, self.start[1] + across, np.full(s.shape, self.start[2])], axis=-1)
        return positions

    @property
    def end(self) -> tuple[float, float, float]:
        """Of the tip at the end [m]."""
        x, y, z = self(np.array(1.0))
        return float(x), float(y), float(z)

    @property
    def length(self) -> float:
        """Length in the mount's frame [m]."""
        return float(np.linalg.norm(np.diff(self(np.linspace(0.0, 1.0, 201)), axis=0), axis=-1).sum())


@dataclass(frozen=True)
class Crossing:
    """What the tip does over one plot, in metres."""

    y: tuple[float, float]
    """Of the tip beside the track, at the first and at the last edge."""
    lines: int
    spacing: float
    """Of the lines, along the row."""
    period: float
    """From plot to plot."""
    height: float
    """Of the tip over the mount."""
    cross: float
    """Travel of the vehicle in a line across."""
    step: float
    """Travel in a step to the next line, and in both ends together."""

    @property
    def travel(self) -> float:
        """Of the vehicle from the tip's start to its end."""
        return self.lines * (self.cross + self.step)

    @property
    def back(self) -> float:
        """How far the tip falls back beside the vehicle, and the way forward for the next plot."""
        return self.travel - (self.lines - 1) * self.spacing - 0.5 * self.step

    @property
    def begin(self) -> float:
        """Of the mount before the first line, along the row, when the tip sets out."""
        return -0.25 * self.step - 0.5 * self.back

    @property
    def reversed(self) -> "Crossing":
        """The same from the other edge."""
        return replace(self, y=self.y[::-1])

    @property
    def end_y(self) -> float:
        """Where the tip is at the end, beside the track."""
        return self.y[self.lines % 2]

    @property
    def targets(self) -> tuple[str, str]:
        """The targets of the tip at the start and at the end."""
        return _target(0.5 * self.back, self.y[0], self.height), self.forward[0]

    @property
    def forward(self) -> tuple[str, str]:
        """The targets of the tip at the end of a plot, and where it sets out for the next one."""
        return _target(-0.5 * self.back, self.end_y, self.height), _target(0.5 * self.back, self.end_y, self.height)

    def pieces(self) -> tuple[GroundPiece, ...]:
        """Return the curve, piece by piece."""
        return tuple(self._pieces())

    def _pieces(self) -> Iterator[GroundPiece]:
        piece = GroundPiece("catch", (0.5 * self.back, self.y[0], self.height), 0.5 * self.step)
        yield piece
        for number in range(self.lines):
            by = (self.y[1] - self.y[0]) * (1.0 if number % 2 == 0 else -1.0)
            piece = GroundPiece("cross", piece.end, self.cross, by)
            yield piece
            if number < self.lines - 1:
                piece = GroundPiece("step", piece.end, self.step, self.spacing)
                yield piece
        yield GroundPiece("release", piece.end, 0.5 * self.step)


@dataclass(frozen=True, eq=False)
class GroundLines:
    """A crossing that the boom can do, and up to which speed of the vehicle."""

    crossing: Crossing
    paths: tuple[TipPath, ...]
    profile: str
    speed: float
    """Largest of the vehicle [m/s]."""
    limit: str
    """What limits it."""


def fastest_crossing(
    boom: Boom, y: tuple[float, float], lines: int, spacing: float, period: float, height: float, constraint: str, profile: str
) -> tuple[float, Crossing] | None:
    """Return the crossing with the largest speed of the vehicle, and about that speed [m/s].

    None is returned where none is within reach. The speed is that of the first, a middle and the
    last pieces; `ground_lines` gives that of all.

    Args:
        boom: the boom.
        y: of the tip beside the track, at both edges [m].
        lines: across the plot.
        spacing: of the lines, along the row [m].
        period: from plot to plot, along the row [m].
        height: of the tip over the mount [m].
        constraint: as of `plan`.
        profile: of the move forward; jerk limits hold everywhere with "jerk-limited".
    """
    rule = parse_constraint(constraint)
    longest = min(period, max(_LONGEST * lines * spacing, _LEAST))
    tried: list[tuple[float, Crossing]] = []
    for share in _SHARES:
        for weight in _WEIGHTS:
            step = share * longest / (lines * (1.0 + weight))
            crossing = Crossing(y, lines, spacing, period, height, weight * step, step)
            pieces = crossing.pieces()
            some = (*pieces[:3], pieces[2 * (lines // 2) - 1], pieces[-2])
            try:
                over = min(_speed(boom, piece, rule, profile) for piece in dict.fromkeys(some))
                tried.append((min(over, _between(boom, crossing, constraint, profile)), crossing))
            except InfeasibleError:
                continue
    return max(tried, key=lambda pair: pair[0], default=None)


def ground_lines(boom: Boom, crossing: Crossing, constraint: str, profile: str) -> GroundLines:
    """Return a crossing's joint paths and the largest speed of the vehicle.

    Raises:
        InfeasibleError: the tip cannot follow it.
    """
    pieces = crossing.pieces()
    paths = _paths(boom, pieces, parse_constraint(constraint))
    over = min(piece.travel / _least(boom, path, profile, _LOOKS) for path, piece in zip(paths, pieces, strict=True))
    between = _between(boom, crossing, constraint, profile)
    limit = "the lines over the plot" if over < between else "the way forward between plots"
    return GroundLines(crossing, paths, profile, min(over, between), limit)


def mirrored(boom: Boom, found: GroundLines, constraint: str) -> GroundLines:
    """Return the same lines from the other edge, at the same largest speed."""
    crossing = found.crossing.reversed
    paths = _paths(boom, crossing.pieces(), parse_constraint(constraint))
    return replace(found, crossing=crossing, paths=paths)


def ground_move(boom: Boom, found: GroundLines, speed: float) -> Move:
    """Return the checked move over a plot with the vehicle at a constant speed [m/s]."""
    pieces = found.crossing.pieces()
    motions = tuple(
        Motion(path, _even(piece.travel / speed, found.profile)) for path, piece in zip(found.paths, pieces, strict=True)
    )
    note = f"the tip crosses the plot on {found.crossing.lines} lines straight over the ground, the vehicle at {speed:g} m/s"
    planned = PlannedMotion(motions, motions[0].path(0.0), STEP, (note,))
    return check_motion(boom, planned.trajectory, profile=f"ground lines at {speed:g} m/s")


def _speed(boom: Boom, piece: GroundPiece, rule: Constraint, profile: str) -> float:
    (path,) = _paths(boom, (piece,), rule)
    return piece.travel / _least(boom, path, profile, _FEW_LOOKS)


def _between(boom: Boom, crossing: Crossing, constraint: str, profile: str) -> float:
    """Return the speed [m/s] at which the tip has come forward at the next plot."""
    forward = plan_motion(boom, MoveSpec.of(*crossing.forward, along="line", profile=profile, constraint=constraint))
    return (crossing.period - crossing.travel) / forward.duration


def _paths(boom: Boom, pieces: tuple[GroundPiece, ...], rule: Constraint) -> tuple[TipPath, ...]:
    paths: list[TipPath] = []
    for piece in pieces:
        paths.append(follow(boom, piece, DOWN, rule, reference=paths[-1](1.0) if paths else None))
        require_path_clear(boom, paths[-1])
    return tuple(paths)


def _least(boom: Boom, path: TipPath, profile: str, looks: int) -> float:
    """Return the shortest time [s] of a path followed evenly."""
    law = _even(1.0, profile)
    least = least_stretch(boom, path, law, samples=looks)
    return max(least, jerk_stretch(boom, path, law, samples=looks)) if profile == _JERK_LIMITED else least


def _even(duration: float, profile: str) -> TimeLaw:
    return TimeLaw.from_pieces([duration], [[1.0 / duration], [0.0]], jerk_limited=profile == _JERK_LIMITED)


def _target(x: float, y: float, z: float) -> str:
    return "tip=" + ",".join(f"{round(v, _DECIMALS) + 0.0:.10g}" for v in (x, y, z))
