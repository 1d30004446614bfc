"""Logs of the vehicle, of the joints and of a sensor's triggers, from CSV and NMEA."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from boom_model import InputError
from boom_model.arrays import Array, read_only
from boom_model.boom import IS_LENGTH, JOINTS
from planner.field.assumed import (
    HEADING_STD,
    NO_TILT_STD,
    TILT_STD,
    TRACK_STD,
    covariance_of_quality,
    heading_of_track,
    track_note,
)
from planner.field.earth import datum_note, ecef_from, ecef_of, geodetic_of
from planner.field.nmea import read_nmea
from planner.field.tables import TIME_COLUMNS, LogTable, read_table
from planner.field.vehicle_log import ANGLE_DEVIATION, DEVIATION, LATITUDE, VehicleLog, listed, require_each

ANGLES = ("latitude", "longitude", "roll", "pitch", "heading")
_STD = ("std_east_m", "std_north_m", "std_up_m")
_COVARIANCE = ("cov_east_north_m2", "cov_east_up_m2", "cov_north_up_m2")
_ANGLE_STD = ("std_roll", "std_pitch", "std_heading")
_VELOCITY = ("east_m_s", "north_m_s", "up_m_s")
_PLACES = (
    *("height_m", "altitude_m", "geoid_m", "easting_m", "northing_m", "epsg", "x_m", "y_m", "z_m", "quality"),
    *(f"{name}_{unit}" for name in (*ANGLES, *_ANGLE_STD) for unit in ("deg", "rad")),
)
VEHICLE_COLUMNS = (*TIME_COLUMNS, *_PLACES, *_VELOCITY, *_STD, *_COVARIANCE)
JOINT_COLUMNS = (*TIME_COLUMNS, *(f"{name}{i + 1}" for name in ("q", "qd", "qdd", "tau") for i in range(5)))

_RADIUS = 6.3e6, 6.4e6


@dataclass(frozen=True, eq=False)
class JointLog:
    """Measured joint positions."""

    t: Array
    """(n,) [s], increasing"""
    q: Array
    """(n, 5) [rad, the extension in m]"""
    clock: str
    source: str
    lines: NDArray[np.int_]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Triggers:
    """When a sensor took its measurements."""

    t: Array
    """(n,) [s]"""
    labels: tuple[str, ...]
    """What the file calls each, or its number."""
    clock: str
    source: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Points:
    """Positions of one point, measured from outside or by a second receiver."""

    t: Array
    """(n,) [s]"""
    ecef: Array
    """(n, 3) [m]"""
    std: Array
    """(n,) of each coordinate [m]"""
    clock: str
    source: str
    notes: tuple[str, ...] = ()


def read_vehicle_log(path: str | Path, epsg: int | None = None, longest_gap: float | None = None) -> VehicleLog:
    """Read the log of a vehicle: NMEA if it begins with `$` or `!`, otherwise CSV.

    Args:
        path: the file.
        epsg: reference system of easting_m and northing_m.
        longest_gap: [s] between fixes that may be interpolated; None is three median intervals.

    Raises:
        InputError: it cannot be read or is malformed; names the line and what is wrong.
    """
    if _is_nmea(path):
        return read_nmea(path, longest_gap)
    table, notes = read_table(path, VEHICLE_COLUMNS)
    table, lost = _with_fix(table)
    t, clock = table.times()
    table, t, doubled = _without_doubles(table, t)
    latitude, longitude, height, placed = _position(table, epsg)
    angles, angle_covariance, turned = _attitude(table, len(t), ecef_of(latitude, longitude, height))
    covariance, assumed = _position_covariance(table)
    return VehicleLog.of(
        t,
        latitude,
        longitude,
        height,
        *angles.T,
        velocity=np.stack([table.numbers(name) for name in _VELOCITY], axis=-1) if table.has(*_VELOCITY) else None,
        position_covariance=covariance,
        attitude_covariance=angle_covariance,
        quality=table.numbers("quality").astype(int) if table.has("quality") else None,
        lines=table.lines,
        clock=clock,
        source=str(path),
        longest_gap=longest_gap,
        lost=lost,
        notes=(*notes, *doubled, *placed, *turned, *assumed),
    )


def read_joint_log(path: str | Path) -> JointLog:
    """Read measured joint positions: a time and q1..q5 [rad, q4 in m].

    Raises:
        InputError: it cannot be read, is malformed, or looks like degrees or millimetres; names
            the line.
    """
    table, notes = read_table(path, JOINT_COLUMNS)
    names = [f"q{i + 1}" for i in range(5)]
    missing = [name for name in names if name not in table.header]
    if missing:
        raise InputError(f"{path}: column {missing[0]} is missing; a joint log has a time and q1..q5 in rad, q4 in m")
    t, clock = table.times()
    q = np.stack([table.numbers(name) for name in names], axis=-1)
    for i, joint in enumerate(JOINTS):
        bound, unit, meant = (30.0, "m", "millimetres") if IS_LENGTH[i] else (20.0, "rad", "degrees")
        if (np.abs(q[:, i]) > bound).any():
            k = int(np.argmax(np.abs(q[:, i]) > bound))
            raise InputError(f"{table.where(k)}: q{i + 1} ({joint}) is {q[k, i]:g} {unit}; it looks like {meant}")
    backwards = np.diff(t) <= 0.0
    if backwards.any():
        k = int(np.argmax(backwards)) + 1
        raise InputError(f"{table.where(k)}: the time goes back or repeats; split the log where its clock was reset")
    if len(t) < 2:
        raise InputError(f"{path}: one row; a joint log needs two")
    return JointLog(read_only(t), read_only(q), clock, str(path), table.lines, notes)


def read_triggers(path: str | Path) -> Triggers:
    """Read the times of a sensor's measurements: a time, and `label` where they have names.

    Raises:
        InputError: it cannot be read or is malformed; names the line.
    """
    table, notes = read_table(path, (*TIME_COLUMNS, "label"))
    t, clock = table.times()
    labels = table.text("label") if table.has("label") else [str(k + 1) for k in range(len(t))]
    return Triggers(read_only(t), tuple(labels), clock, str(path), notes)


def read_points(path: str | Path, epsg: int | None = None) -> Points:
    """Read measured positions of a point: NMEA, or CSV with time and position of a vehicle's log.

    Args:
        path: the file.
        epsg: reference system of easting_m and northing_m.

    Raises:
        InputError: it cannot be read or is malformed; names the line and what is wrong.
    """
    if _is_nmea(path):
        log = read_nmea(path)
        return Points(log.t, log.ecef, _mean_std(log.position_covariance), log.clock, str(path), log.notes)
    table, notes = read_table(path, VEHICLE_COLUMNS)
    table, lost = _with_fix(table)
    t, clock = table.times()
    table, t, doubled = _without_doubles(table, t)
    latitude, longitude, height, placed = _position(table, epsg)
    covariance, assumed = _position_covariance(table)
    ecef, std = ecef_of(latitude, longitude, height), _mean_std(covariance)
    left = (f"{path}: {listed('without a fix left out', lost)}",) if lost else ()
    return Points(read_only(t), read_only(ecef), read_only(std), clock, str(path), (*notes, *left, *doubled, *placed, *assumed))


def _mean_std(covariance: Array) -> Array:
    """Return the root mean square (n,) of the standard deviations of covariances (n, 3, 3)."""
    std: Array = np.sqrt(np.trace(covariance, axis1=-2, axis2=-1) / 3.0)
    return std


def require_one_clock(*logs: VehicleLog | JointLog | Triggers | Points) -> None:
    """Check that all logs have one clock.

    Raises:
        InputError: one has UTC, and another a clock of its own.
    """
    for log in logs[1:]:
        if log.clock != logs[0].clock:
            words = {"utc": "UTC", "own": "a clock of its own (column t)"}
            raise InputError(
                f"{logs[0].source} has {words[logs[0].clock]} and {log.source} {words[log.clock]}; give all one clock"
            )


# A vehicle's CSV, part by part


def _is_nmea(path: str | Path) -> bool:
    try:
        with open(path, "rb") as file:
            start = file.read(256).lstrip(b"\xef\xbb\xbf\r\n\t ")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    return start[:1] in (b"$", b"!")


def _with_fix(table: LogTable) -> tuple[LogTable, tuple[int, ...]]:
    """Leave out the rows of quality 0, which may be blank; return their lines, too."""
    if not table.has("quality"):
        return table, ()
    quality = table.numbers("quality")
    odd = ~np.isin(quality, np.arange(9))
    if odd.any():
        k = int(np.argmax(odd))
        raise InputError(f"{table.where(k)}: quality is {quality[k]:g}; NMEA's is 0 (no fix) to 8, 4 is RTK fixed")
    lost = np.flatnonzero(quality == 0)
    if not len(lost):
        return table, ()
    if len(lost) == len(quality):
        raise InputError(f"{table.path}: no row has a fix (quality is 0 throughout)")
    return table.keep(np.flatnonzero(quality != 0)), tuple(table.lines[lost].tolist())


def _without_doubles(table: LogTable, t: Array) -> tuple[LogTable, Array, tuple[str, ...]]:
    """Leave out rows that repeat the one above, word for word."""
    keep = [0, *(k for k in range(1, len(t)) if table.rows[k] != table.rows[k - 1])]
    if len(keep) == len(t):
        return table, t, ()
    note = f"{table.path}: {len(t) - len(keep)} rows that repeat the one above left out"
    return table.keep(keep), t[keep], (note,)


def _position(table: LogTable, epsg: int | None) -> tuple[Array, Array, Array, tuple[str, ...]]:
    """Return latitude, longitude [rad], ellipsoidal height [m], and notes."""
    forms = {
        "latitude and longitude": any(table.has(f"latitude_{u}", f"longitude_{u}") for u in ("deg", "rad")),
        "easting and northing": table.has("easting_m", "northing_m"),
        "x, y, z": table.has("x_m", "y_m", "z_m"),
    }
    given = [name for name, there in forms.items() if there]
    if len(given) != 1:
        raise InputError(
            f"{table.path}: it has {' and '.join(given) or 'no position'}; it needs one of "
            "latitude_deg, longitude_deg, height_m; easting_m, northing_m, height_m; and x_m, y_m, z_m (EPSG:4978)"
        )
    if given[0] == "x, y, z":
        ecef = np.stack([table.numbers(name) for name in ("x_m", "y_m", "z_m")], axis=-1)
        radius = np.linalg.norm(ecef, axis=-1)
        odd = ~((radius > _RADIUS[0]) & (radius < _RADIUS[1]))
        if odd.any():
            k = int(np.argmax(odd))
            raise InputError(
                f"{table.where(k)}: x, y, z is {radius[k] / 1e3:.6g} km from the earth's centre, not on its surface"
            )
        return (*geodetic_of(ecef), ())
    height = _height(table)
    if given[0] == "easting and northing":
        code, noted = _epsg(table, epsg), ()
        try:
            ecef = ecef_from(code, table.numbers("easting_m"), table.numbers("northing_m"), height)
        except InputError as error:
            raise InputError(f"{table.path}: {error}") from None
        note = datum_note(code)
        return (*geodetic_of(ecef), noted if note is None else (note,))
    latitude, longitude = _angle(table, "latitude"), _angle(table, "longitude")
    degrees = np.degrees(latitude), np.degrees(longitude)
    beyond = np.abs(degrees[0]) > LATITUDE.high
    if beyond.any():
        k = int(np.argmax(beyond))
        swapped = "; latitude and longitude are swapped" if abs(degrees[1][k]) <= LATITUDE.high else ""
        raise InputError(f"{table.where(k)}: latitude is {degrees[0][k]:g} deg; it must be between -90 and 90 deg{swapped}")
    if table.has("latitude_deg") and (np.abs(degrees[0]) < np.pi / 2).all() and (np.abs(degrees[1]) < np.pi).all():
        raise InputError(
            f"{table.where(0)}: {degrees[0][0]:g}, {degrees[1][0]:g} deg is in the Gulf of Guinea; it looks like radians"
        )
    return latitude, longitude, height, ()


def _height(table: LogTable) -> Array:
    if table.has("height_m"):
        return table.numbers("height_m")
    if table.has("altitude_m", "geoid_m"):
        return table.numbers("altitude_m") + table.numbers("geoid_m")
    if table.has("altitude_m"):
        raise InputError(
            f"{table.path}: altitude_m is above the sea; the geoid's height above the ellipsoid, geoid_m, is missing"
        )
    raise InputError(f"{table.path}: column height_m (above the ellipsoid) is missing")


def _epsg(table: LogTable, given: int | None) -> int:
    if not table.has("epsg"):
        if given is None:
            raise InputError(
                f"{table.path}: easting_m and northing_m need --epsg CODE, or a column epsg (32613 is UTM 13 north)"
            )
        return given
    codes = table.numbers("epsg")
    other = codes != (codes[0] if given is None else given)
    if other.any():
        k = int(np.argmax(other))
        said = f"line {table.lines[0]} has {codes[0]:g}" if given is None else f"{given} was given"
        raise InputError(f"{table.where(k)}: EPSG is {codes[k]:g}, and {said}; a log must have one code")
    if codes[0] != int(codes[0]) or not 1000 < codes[0] < 1e6:
        raise InputError(f"{table.where(0)}: EPSG is {codes[0]:g}; it must be a code such as 32613")
    return int(codes[0])


def _angle(table: LogTable, name: str) -> Array:
    if table.has(f"{name}_deg", f"{name}_rad"):
        raise InputError(f"{table.path}: it has {name}_deg and {name}_rad; one must go")
    return np.radians(table.numbers(f"{name}_deg")) if table.has(f"{name}_deg") else table.numbers(f"{name}_rad")


def _attitude(table: LogTable, n: int, ecef: Array) -> tuple[Array, Array, tuple[str, ...]]:
    """Return roll, pitch, heading (n, 3) [rad], their covariance (n, 3, 3), and what is assumed."""
    given = {name: table.has(f"{name}_deg") or table.has(f"{name}_rad") for name in ANGLES[2:]}
    angles, std = np.zeros((n, 3)), np.zeros((n, 3))
    notes, assumed = [], []
    for i, name in enumerate(ANGLES[2:]):
        if given[name]:
            angles[:, i] = _angle(table, name)
            usual = HEADING_STD if name == "heading" else TILT_STD
            if table.has(f"std_{name}_deg") or table.has(f"std_{name}_rad"):
                std[:, i] = _angle(table, f"std_{name}")
                require_each(table.path, f"std_{name}", np.degrees(std[:, i]), ANGLE_DEVIATION, table.lines)
            else:
                std[:, i] = usual
                assumed.append(f"{name} {np.degrees(usual):g} deg")
        elif name != "heading":
            std[:, i] = NO_TILT_STD
            notes.append(
                f"{table.path}: no {name}; assumed level, with a standard deviation of {np.degrees(NO_TILT_STD):g} deg"
            )
    if assumed:
        notes.append(f"{table.path}: assumed standard deviations: {', '.join(assumed)}")
    if not given["heading"]:
        angles[:, 2] = heading_of_track(ecef, table.path)
        std[:, 2] = TRACK_STD
        notes.append(track_note(table.path))
    covariance = std[:, :, None] ** 2 * np.eye(3)
    return angles, covariance, tuple(notes)


def _position_covariance(table: LogTable) -> tuple[Array, tuple[str, ...]]:
    if not table.has(*_STD):
        quality = table.numbers("quality").astype(int) if table.has("quality") else np.ones(len(table.rows), dtype=int)
        return covariance_of_quality(quality, table.path, known=table.has("quality"))
    std = np.stack([table.numbers(name) for name in _STD], axis=-1)
    for i, name in enumerate(_STD):
        require_each(table.path, name, std[:, i], DEVIATION, table.lines)
    covariance = std[:, :, None] ** 2 * np.eye(3)
    for name, (i, j) in zip(_COVARIANCE, ((0, 1), (0, 2), (1, 2)), strict=True):
        if table.has(name):
            covariance[:, i, j] = covariance[:, j, i] = table.numbers(name)
    negative = np.linalg.eigvalsh(covariance)[:, 0] < -1e-12 * np.trace(covariance, axis1=1, axis2=2)
    if negative.any():
        raise InputError(f"{table.where(int(np.argmax(negative)))}: the covariances do not go with the standard deviations")
    return covariance, ()
