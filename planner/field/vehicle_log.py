"""Log of the vehicle: where one point of it was, how it was turned, and how well both are known."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import median_filter

from boom_model import InputError
from boom_model.arrays import Array, Mask, checked, read_only
from boom_model.plausible import Range
from planner.field import attitude
from planner.field.earth import axes, ecef_of, geodetic_of

LATITUDE = Range(-90.0, 90.0, "deg")
LONGITUDE = Range(-180.0, 360.0, "deg")
ELLIPSOIDAL_HEIGHT = Range(-600.0, 9500.0, "m")
TILT = Range(-89.0, 89.0, "deg")
HEADING = Range(-360.0, 720.0, "deg")
LOG_SPEED = Range(-100.0, 100.0, "m/s")
DEVIATION = Range(0.0, 1e3, "m")
ANGLE_DEVIATION = Range(0.0, 180.0, "deg")

_QUALITIES = {1: "single", 2: "differential", 3: "PPS", 4: "RTK fixed", 5: "RTK float", 6: "dead reckoning"}
_RANKS = (4, 5, 2, 3, 1, 6)  # from the best quality to the worst
_LISTED = 3
_GAPS = 3.0  # a gap is longer than this many median intervals
_SHORTEST_GAP = 0.05  # [s]
_NEIGHBOURS = 7  # intervals whose median velocity a step is compared with
_SIGMAS = 8.0
_ACCELERATION = 15.0  # [m/s^2] more than a vehicle on the ground has


@dataclass(frozen=True, eq=False)
class VehicleLog:
    """Fixes in the order of time. `VehicleLog.of` makes one, and checks it."""

    t: Array
    """(n,) [s], increasing"""
    ecef: Array
    """(n, 3) the antenna, or the point that the log is of [m]"""
    R_ecef_body: Array
    """(n, 3, 3)"""
    velocity: Array | None
    """(n, 3) of that point, in ECEF [m/s]; None where the log has none"""
    position_covariance: Array
    """(n, 3, 3) in east-north-up [m^2]"""
    attitude_covariance: Array
    """(n, 3, 3) of roll, pitch, heading [rad^2]"""
    quality: NDArray[np.int_] | None
    """(n,) as NMEA gives it: 1 single, 2 differential, 4 fixed, 5 float"""
    lines: NDArray[np.int_]
    """(n,) line of the file, for messages"""
    clock: str
    """What its time is: "utc" [s since 1970], or the name of a clock of its own."""
    source: str
    """What a message calls the log."""
    longest_gap: float
    """[s] between fixes that may still be interpolated"""
    lost: tuple[int, ...] = ()
    """Lines without a fix, which are left out."""
    notes: tuple[str, ...] = field(default=())

    @staticmethod
    def of(
        t: ArrayLike,
        latitude: ArrayLike,
        longitude: ArrayLike,
        height: ArrayLike,
        roll: ArrayLike,
        pitch: ArrayLike,
        heading: ArrayLike,
        *,
        velocity: ArrayLike | None = None,
        position_covariance: ArrayLike = 0.0,
        attitude_covariance: ArrayLike = 0.0,
        quality: ArrayLike | None = None,
        lines: ArrayLike | None = None,
        clock: str = "own",
        source: str = "vehicle log",
        longest_gap: float | None = None,
        lost: tuple[int, ...] = (),
        notes: tuple[str, ...] = (),
    ) -> "VehicleLog":
        """Return a log from arrays.

        Args:
            t: (n,) [s].
            latitude: (n,) [rad].
            longitude: (n,) [rad].
            height: (n,) above the ellipsoid [m].
            roll: (n,) [rad], right side down; angles as in `attitude`.
            pitch: (n,) [rad], nose up.
            heading: (n,) [rad], clockwise from true north.
            velocity: (n, 3) of the antenna, east, north, up [m/s].
            position_covariance: (3, 3) or (n, 3, 3) east, north, up [m^2]; 0 is no error.
            attitude_covariance: (3, 3) or (n, 3, 3) of roll, pitch, heading [rad^2].
            quality: (n,) NMEA's quality of a fix.
            lines: (n,) line of the file each fix is from.
            clock: what the time is; times of another clock are refused.
            source: what messages call the log.
            longest_gap: [s] that may be interpolated; None is three median intervals.
            lost: lines without a fix, which are left out.
            notes: what has been assumed or left out.

        Raises:
            InputError: fewer than two fixes, a value that is not finite or not plausible, a time
                that does not increase, or a covariance that is none; the message names the line.
        """
        t = checked("t", t)
        n = len(t)
        at = np.arange(1, n + 1) if lines is None else np.asarray(lines, dtype=int)
        if n < 2:
            raise InputError(f"{source} has {n} fix{'es' if n != 1 else ''}; it needs two")
        _increasing(source, t, at)
        angled = {"latitude": LATITUDE, "longitude": LONGITUDE, "roll": TILT, "pitch": TILT, "heading": HEADING}
        values = {"latitude": latitude, "longitude": longitude, "roll": roll, "pitch": pitch, "heading": heading}
        for name, bounds in angled.items():
            values[name] = _column(source, name, values[name], n)
            require_each(source, name, np.degrees(values[name]), bounds, at)
        height = _column(source, "height", height, n)
        require_each(source, "height", height, ELLIPSOIDAL_HEIGHT, at)
        R_ecef_enu = axes(values["latitude"], values["longitude"])
        speeds = None
        if velocity is not None:
            given = checked("velocity", velocity, 3)
            require_each(source, "velocity", np.abs(given).max(axis=-1), LOG_SPEED, at)
            speeds = read_only(np.einsum("nij,nj->ni", R_ecef_enu, given))
        body = attitude.rotation(values["roll"], values["pitch"], values["heading"])
        usual = float(np.median(np.diff(t)))
        return VehicleLog(
            t=read_only(t),
            ecef=read_only(ecef_of(values["latitude"], values["longitude"], height)),
            R_ecef_body=read_only(R_ecef_enu @ body),
            velocity=speeds,
            position_covariance=_covariance(source, "position covariance", position_covariance, n),
            attitude_covariance=_covariance(source, "attitude covariance", attitude_covariance, n),
            quality=None if quality is None else np.asarray(quality, dtype=int),
            lines=at,
            clock=clock,
            source=source,
            longest_gap=max(_GAPS * usual, _SHORTEST_GAP) if longest_gap is None else longest_gap,
            lost=lost,
            notes=notes,
        )

    @cached_property
    def geodetic(self) -> tuple[Array, Array, Array]:
        """Latitude, longitude [rad] and height [m], each (n,)."""
        return geodetic_of(self.ecef)

    @cached_property
    def R_ecef_enu(self) -> Array:
        """(n, 3, 3) axes east, north, up at each fix."""
        latitude, longitude, _ = self.geodetic
        return axes(latitude, longitude)

    @cached_property
    def angles(self) -> Array:
        """(n, 3) roll, pitch, heading [rad]."""
        return attitude.angles(np.swapaxes(self.R_ecef_enu, -1, -2) @ self.R_ecef_body)

    @cached_property
    def enu_velocity(self) -> Array:
        """(n, 3) velocity of the antenna, east, north, up [m/s]; by differences without one."""
        velocity = np.gradient(self.ecef, self.t, axis=0) if self.velocity is None else self.velocity
        turned: Array = np.einsum("nji,nj->ni", self.R_ecef_enu, velocity)
        return turned

    @cached_property
    def gaps(self) -> Mask:
        """(n - 1,) whether the interval after a fix is longer than `longest_gap`."""
        return np.asarray(np.diff(self.t) > self.longest_gap)

    @cached_property
    def jumps(self) -> Array:
        """(n - 1,) how far [m] the step after a fix is from the velocities around it; 0 for noise.

        It is noise below 8 standard deviations plus 15 m/s^2 over the interval.
        """
        dt = np.diff(self.t)
        steps = np.diff(self.ecef, axis=0)
        usual = median_filter(steps / dt[:, None], size=(_NEIGHBOURS, 1), mode="nearest")
        off = np.linalg.norm(steps - usual * dt[:, None], axis=-1)
        variance = np.trace(self.position_covariance, axis1=-2, axis2=-1)
        noise = _SIGMAS * np.sqrt(variance[1:] + variance[:-1])
        return np.where(off > noise + _ACCELERATION * dt * np.maximum(dt, 0.1), off, 0.0)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """Gaps, jumps, falls of the fix's quality and doubts, each naming the line."""
        said = [f"{self.source}: {listed('without a fix left out', self.lost)}"] if self.lost else []
        for kind, where in (("gap", self.gaps), ("jump", self.jumps > 0.0)):
            for k in map(int, np.flatnonzero(where)):
                size = f"{self.t[k + 1] - self.t[k]:.3g} s" if kind == "gap" else f"{self.jumps[k]:.3g} m"
                said.append(f"{self.source}: {kind} of {size} before line {self.lines[k + 1]}")
        return (*said, *_falls(self), *_heading_doubt(self))


def _falls(log: VehicleLog) -> tuple[str, ...]:
    """Where the quality of the fix falls below the best that the log has, and for how long."""
    if log.quality is None:
        return ()
    rank = np.array([_RANKS.index(q) if q in _RANKS else len(_RANKS) for q in log.quality.tolist()])
    worse = np.concatenate([[False], rank > rank.min(), [False]])
    begins, ends = np.flatnonzero(~worse[:-1] & worse[1:]), np.flatnonzero(worse[:-1] & ~worse[1:])
    said = []
    for first, last in zip(begins.tolist(), (ends - 1).tolist(), strict=True):
        kinds = ", ".join(_QUALITIES.get(q, str(q)) for q in dict.fromkeys(log.quality[first : last + 1].tolist()))
        lines = f"line {log.lines[first]}" if first == last else f"lines {log.lines[first]} to {log.lines[last]}"
        said.append(f"{log.source}: the fix is {kinds} on {lines}, {log.t[last] - log.t[first]:.3g} s")
    return tuple(said)


def _heading_doubt(log: VehicleLog) -> tuple[str, ...]:
    """Whether the heading does not go with the way driven: radians for degrees, or another zero."""
    east, north, _ = np.moveaxis(log.enu_velocity, -1, 0)
    moving = np.hypot(east, north) > 0.3
    if moving.sum() < 10:
        return ()
    course, heading = np.arctan2(east, north)[moving], log.angles[moving, 2]

    def off(angle: Array) -> float:
        apart = np.abs((angle - course + np.pi) % (2.0 * np.pi) - np.pi)
        return float(np.degrees(np.median(np.minimum(apart, np.pi - apart))))  # forwards or in reverse

    if off(heading) < 30.0:
        return ()
    likely = "; it looks like radians written as degrees" if off(np.degrees(heading)) < 5.0 else ""
    likely = "; it looks like an angle from east, anticlockwise" if off(np.pi / 2.0 - heading) < 5.0 else likely
    return (f"{log.source}: the heading is {off(heading):.0f} deg from the way driven (median){likely}",)


def listed(what: str, lines: Sequence[int]) -> str:
    """Return how many lines there are and the first: "2 lines without a fix left out: 5, 9"."""
    first = ", ".join(map(str, lines[:_LISTED])) + (", ..." if len(lines) > _LISTED else "")
    return f"{len(lines)} line{'s' if len(lines) > 1 else ''} {what}: {first}"


def require_each(source: str, name: str, values: Array, bounds: Range, lines: NDArray[np.int_]) -> None:
    """Check every value against bounds.

    Raises:
        InputError: one is outside; names the line.
    """
    outside = ~((values >= bounds.low) & (values <= bounds.high))
    if outside.any():
        at = int(np.flatnonzero(outside)[0])
        bounds.require(f"{source}, line {lines[at]}: {name}", float(values[at]))


def _increasing(source: str, t: Array, lines: NDArray[np.int_]) -> None:
    steps = np.diff(t)
    if (steps <= 0.0).any():
        k = int(np.flatnonzero(steps <= 0.0)[0])
        how = f"goes back by {-steps[k]:.6g} s" if steps[k] < 0.0 else "repeats"
        raise InputError(f"{source}, line {lines[k + 1]}: the time {how}; split the log where its clock was reset")


def _column(source: str, name: str, values: ArrayLike, n: int) -> Array:
    array = checked(f"{source}: {name}", values)
    if array.shape not in ((), (n,)):
        raise InputError(f"{source}: {name} has shape {array.shape}; it must be ({n},)")
    return np.broadcast_to(array, (n,)).copy()


def _covariance(source: str, name: str, values: ArrayLike, n: int) -> Array:
    array = checked(f"{source}: {name}", values)
    if array.shape == ():
        array = array * np.eye(3)
    if array.shape not in ((3, 3), (n, 3, 3)):
        raise InputError(f"{source}: {name} has shape {array.shape}; it must be (3, 3) or ({n}, 3, 3)")
    if not np.allclose(array, np.swapaxes(array, -1, -2), rtol=1e-6, atol=1e-12):
        raise InputError(f"{source}: {name} is not symmetric")
    if (np.linalg.eigvalsh(array) < -1e-9 * max(1.0, float(np.abs(array).max()))).any():
        raise InputError(f"{source}: {name} has a negative eigenvalue")
    return read_only(np.broadcast_to(array, (n, 3, 3)))
