"""A scan in time: mount, joints, and what the sensor sees, in the plane of the map."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from boom_model import Boom, forward_kinematics
from boom_model.arrays import Array
from planner.field.extra import library
from planner.field.scan import Scan
from planner.field.scan_day import held
from planner.field.scan_task import Leg
from planner.field.scan_track import LEAD, TrackScan
from planner.motion.trajectory import Trajectory

_Part = tuple[Array, Array, Array, Array, NDArray[np.bool_]]


@dataclass(frozen=True, eq=False)
class Timeline:
    """Samples of the day."""

    t: Array
    """(n,) [s]"""
    place: Array
    """(n, 3) of the mount: east, north, up [m]"""
    R: Array
    """(n, 3, 3) R_enu_mount"""
    q: Array
    """(n, 5)"""
    looking: NDArray[np.bool_]
    """(n,) whether the sensor looks: at a stop, or past plots"""

    @property
    def mount(self) -> Array:
        """(n, 2) place of the mount in the plane of the map [m]."""
        return self.place[:, :2]

    def tips(self, boom: Boom) -> Array:
        """Return the tip (n, 3): east, north, up [m]."""
        return self._placed(forward_kinematics(boom, self.q).position)

    def footprints(self, boom: Boom, size: tuple[float, float]) -> Array:
        """Return the corners (n, 4, 2) [m] of the footprint of a size along the arm, across it."""
        tip = forward_kinematics(boom, self.q).position
        signs = 0.5 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * size
        c, s = np.cos(self.q[:, 0]), np.sin(self.q[:, 0])
        out, across = np.stack([c, s, 0.0 * c], axis=-1), np.stack([-s, c, 0.0 * c], axis=-1)
        corners = [self._placed(tip + a * out + b * across)[:, :2] for a, b in signs]
        return np.stack(corners, axis=1)

    def _placed(self, points: Array) -> Array:
        """Return points (n, 3) of the mount's frame in that of the map."""
        placed: Array = self.place + np.einsum("nij,nj->ni", self.R, points)
        return placed


def timeline(boom: Boom, scan: Scan | TrackScan, step: float) -> Timeline:
    """Return the day of a scan at steps of at most `step` seconds.

    Args:
        boom: the boom of the scan.
        scan: the scan. One along a log goes from the first pass to the last, at the log's poses.
        step: longest time between two samples [s].
    """
    parts = list(_along_log(scan, step) if isinstance(scan, TrackScan) else _along_rows(boom, scan, step))
    t, place, R, q, looking = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    return Timeline(t, place, R, q, looking)


def _along_rows(boom: Boom, scan: Scan, step: float) -> Iterator[_Part]:
    begin = 0.0
    for leg in scan.legs:
        t = _times(leg.duration, step)
        mount, ahead = leg.mount(t)
        R = np.tile(np.eye(3), (len(t), 1, 1))
        R[:, :2, 0], R[:, 0, 1], R[:, 1, 1] = ahead, -ahead[:, 1], ahead[:, 0]
        looking = np.full(len(t), leg.what in ("stop", "pass"))
        yield begin + t, np.column_stack([mount, np.zeros(len(t))]), R, _joints(boom, scan, leg, t), looking
        begin += leg.duration


def _along_log(scan: TrackScan, step: float) -> Iterator[_Part]:
    """Yield lead, pass and lead of each pass, and the way to the next; t is 0 at the first lead."""
    passes = scan.reached
    for number, each in enumerate(passes):
        assert each.move is not None
        begin, end = (at - passes[0].span[0] for at in each.span)
        for since, duration, looking in (
            (0.0, LEAD, False), (LEAD, each.curve.mount.duration, True), (LEAD + each.curve.mount.duration, LEAD, False),
        ):  # fmt: skip
            t = since + _times(duration, step)
            yield begin + t, *each.curve.mount.pose(t - LEAD), _at(each.move.trajectory, t), np.full(len(t), looking)
        if number < len(passes) - 1:
            way = scan.ways[number]
            t = _times(way.gap, step)
            q = np.tile(each.move.trajectory.q[-1], (len(t), 1)) if way.move is None else _at(way.move.trajectory, t)
            yield end + t, *scan.mount.pose(each.span[1] + t), q, np.zeros(len(t), dtype=bool)


def _times(duration: float, step: float) -> Array:
    """Return times from 0 on, without the end."""
    return np.linspace(0.0, duration, int(np.ceil(duration / step)) + 1)[:-1]


def _at(motion: Trajectory, t: Array) -> Array:
    """Return joint positions (n, 5) at t (n,) from the begin; after the end the boom holds."""
    return np.stack([np.interp(t, motion.t, column) for column in motion.q.T], axis=-1)


def _joints(boom: Boom, scan: Scan, leg: Leg, t: Array) -> Array:
    """Return joint positions (n, 5) at times from a leg's begin; after its moves the boom holds."""
    if not leg.moves:
        return np.tile(held(boom, scan.task, scan.moves, leg), (len(t), 1))
    q = np.empty((len(t), 5))
    begin = 0.0
    for name in leg.moves:
        motion = scan.moves[name].trajectory
        later = t >= begin
        q[later] = _at(motion, t[later] - begin)
        begin += motion.duration
    return q


@dataclass(frozen=True, eq=False)
class Seen:
    """Share of every plot that was seen, after each of some times."""

    t: Array
    """(m,) [s]"""
    share: Array
    """(m, plots)"""


def seen_so_far(boom: Boom, scan: Scan | TrackScan, every: float, spacing: float = 0.05) -> Seen:
    """Return how much of each plot was seen so far, counted on a grid of points.

    Args:
        boom: the boom of the scan.
        scan: the scan.
        every: time between two counts [s].
        spacing: of the points [m].
    """
    shapely = library("shapely")
    line = timeline(boom, scan, 1.0 / scan.task.rate)
    corners = line.footprints(boom, scan.task.footprint)
    points = [_grid(polygon, spacing) for polygon in scan.plots.polygons]
    seen = [np.zeros(len(each), dtype=bool) for each in points]
    times = np.append(np.arange(every, line.t[-1], every), line.t[-1])
    share = np.zeros((len(times), len(points)))
    looking = np.flatnonzero(line.looking)
    images, touched = scan.plots.tree.query(shapely.polygons(corners[looking]), predicate="intersects")
    order = np.argsort(images, kind="stable")
    images, touched, done = looking[images[order]], touched[order], 0
    for k, until in enumerate(times):
        while done < len(images) and line.t[images[done]] <= until:
            i, plot = images[done], touched[done]
            sides = [corners[i, 1] - corners[i, 0], corners[i, 3] - corners[i, 0]]
            away = points[plot] - corners[i, 0]
            inside = [(away @ side >= 0.0) & (away @ side <= side @ side) for side in sides]
            seen[plot] |= inside[0] & inside[1]
            done += 1
        share[k] = [each.mean() for each in seen]
    return Seen(times, share)


def _grid(polygon: object, spacing: float) -> Array:
    """Return points (k, 2) inside a polygon, evenly spaced along its longer side and across."""
    shapely = library("shapely")
    box = np.array(shapely.minimum_rotated_rectangle(polygon).exterior.coords)[:4]
    sides = [box[1] - box[0], box[3] - box[0]]
    counts = [max(2, int(np.ceil(np.linalg.norm(side) / spacing))) for side in sides]
    a, b = np.meshgrid(*((np.arange(count) + 0.5) / count for count in counts))
    points: Array = box[0] + a.reshape(-1, 1) * sides[0] + b.reshape(-1, 1) * sides[1]
    return np.asarray(points[shapely.contains_xy(polygon, points)])
