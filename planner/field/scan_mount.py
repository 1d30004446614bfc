"""The mount's motion from a vehicle's log: as logged, and smooth along a pass."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from boom_model import BaseMotion
from boom_model.arrays import Array
from planner.field import attitude
from planner.field.plots import PlotMap
from planner.field.rig import Rig
from planner.field.vehicle_log import VehicleLog

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

_KNOT, _FIXES = 1.0, 3.0  # between knots of the mount's motion: [s], and fixes at least
_BEYOND = 2.0  # [s] of the log on both sides of a pass that are fitted as well


@dataclass(frozen=True, eq=False)
class LoggedMount:
    """Mount at every fix of a log, in east, north, up."""

    t: Array
    """(n,) of the log [s]"""
    place: Array
    """(n, 3) [m]"""
    angles: Array
    """(n, 3) roll, pitch, heading, the last without jumps [rad]"""

    def pose(self, t: Array) -> tuple[Array, Array]:
        """Return positions (m, 3) [m] and R_enu_mount (m, 3, 3) at t (m,), linear between fixes."""
        values = [np.interp(t, self.t, column) for column in (*self.place.T, *self.angles.T)]
        return np.stack(values[:3], axis=-1), attitude.rotation(*values[3:])

    @property
    def knot(self) -> float:
        """Time between knots of the smooth motion [s]; a longer time without a fix is a gap."""
        return max(_KNOT, _FIXES * float(np.median(np.diff(self.t))))

    def gap(self, begin: float, end: float) -> tuple[float, float] | None:
        """Return begin and duration [s] of the first gap between two times, if there is one."""
        a, b = int(np.searchsorted(self.t, begin, side="right")) - 1, int(np.searchsorted(self.t, end)) + 1
        steps = np.diff(self.t[max(a, 0) : b])
        if not (steps > self.knot).any():
            return None
        at = int(np.argmax(steps > self.knot))
        return float(self.t[max(a, 0) + at]), float(steps[at])


@dataclass(frozen=True, eq=False)
class MountMotion:
    """Smooth motion of the mount in east, north, up, from a log."""

    spline: "BSpline"
    """Of the time from the begin: east, north, up [m], roll, pitch, heading [rad]."""
    begin: float
    """Of the pass, in the log's time [s]."""
    duration: float
    """[s]"""
    residual: float
    """Root mean square distance of the fixes from it [m]."""

    def pose(self, t: Array) -> tuple[Array, Array]:
        """Return positions (..., 3) [m] and R_enu_mount (..., 3, 3) at times t (...)."""
        values = self.spline(t)
        return values[..., :3], attitude.rotation(values[..., 3], values[..., 4], values[..., 5])

    def base(self, t: Array) -> BaseMotion:
        """Return the motion of the base at times t (n,); turn rates by central differences."""
        h = 1e-3
        _, R = self.pose(t)
        rate = _rates(self.pose(t - h)[1], R, self.pose(t + h)[1], h)
        rates = [_rates(self.pose(at - h)[1], self.pose(at)[1], self.pose(at + h)[1], h) for at in (t - h, t + h)]
        velocity, acceleration = (np.einsum("nji,nj->ni", R, self.spline(t, order)[:, :3]) for order in (1, 2))
        return BaseMotion.of(velocity, rate, acceleration, (rates[1] - rates[0]) / (2.0 * h), R[:, 2, :])


def logged_mount(log: VehicleLog, plots: PlotMap, rig: Rig | None) -> LoggedMount:
    """Return the mount at every fix, in the map's frame; without a rig, the log is its own."""
    R_ecef_body = log.R_ecef_body if rig is None else log.R_ecef_body @ rig.R_body_imu.T
    lever = np.zeros(3) if rig is None else rig.mount - rig.antenna
    R_body_mount = np.eye(3) if rig is None else rig.R_body_mount
    place = plots.frame.enu(log.ecef + R_ecef_body @ lever)
    R = np.einsum("ji,njk->nik", plots.frame.R_ecef_enu, R_ecef_body @ R_body_mount)
    return LoggedMount(log.t, place, np.unwrap(attitude.angles(R), axis=0))


def fitted(mount: LoggedMount, first: int, last: int) -> MountMotion:
    """Return the smooth motion of the mount between two fixes without a gap."""
    from scipy.interpolate import make_lsq_spline

    t = mount.t
    a = int(np.searchsorted(t, t[first] - _BEYOND))
    b = int(np.searchsorted(t, t[last] + _BEYOND, side="right"))
    gaps = np.flatnonzero(np.diff(t) > mount.knot)
    a, b = max([a, *(gaps[gaps < first] + 1)]), min([b, *(gaps[gaps >= last] + 1)])
    since, values = t[a:b] - t[first], np.column_stack([mount.place[a:b], mount.angles[a:b]])
    inner = np.linspace(since[0], since[-1], max(2, int((since[-1] - since[0]) / mount.knot)))[1:-1]
    knots = np.concatenate([[since[0]] * 6, inner, [since[-1]] * 6])
    spline = make_lsq_spline(since, values, knots, k=5)
    off = np.linalg.norm(spline(since)[:, :3] - values[:, :3], axis=1)
    return MountMotion(spline, float(t[first]), float(t[last] - t[first]), float(np.sqrt((off**2).mean())))


def _rates(before: Array, now: Array, after: Array, h: float) -> Array:
    """Return the angular velocity (n, 3) in the body's axes, from turns at t - h, t and t + h."""
    skew = np.einsum("nji,njk->nik", now, (after - before) / (2.0 * h))
    rate: Array = 0.5 * np.stack(
        [skew[:, 2, 1] - skew[:, 1, 2], skew[:, 0, 2] - skew[:, 2, 0], skew[:, 1, 0] - skew[:, 0, 1]], axis=-1
    )
    return rate
