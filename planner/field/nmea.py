"""A vehicle's log in NMEA 0183. The one file that uses pynmeagps.

GGA gives position and quality, GST standard deviations, RMC or ZDA the date, PASHR roll, pitch and
heading, HDT or THS a heading alone. The time is UTC.
"""

from dataclasses import dataclass, field
from datetime import UTC, date, datetime, time, timedelta
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from boom_model import InputError
from boom_model.arrays import Array
from planner.field import attitude
from planner.field.assumed import (
    HEADING_STD,
    NO_TILT_STD,
    TILT_STD,
    TRACK_STD,
    covariance_of_quality,
    heading_of_track,
    track_note,
)
from planner.field.earth import ecef_of
from planner.field.extra import library
from planner.field.tables import UTC_CLOCK
from planner.field.vehicle_log import DEVIATION, VehicleLog, listed

_NEAR = 1.0  # [s] between a fix and an attitude that may be used for it
_APART = 0.2  # [s] that is pointed out
_HALF_DAY = timedelta(hours=12)


@dataclass
class _Sentences:
    """What has been read so far."""

    fixes: list[tuple[datetime, float, float, float, int, int]] = field(default_factory=list)
    """Time, latitude, longitude [deg], ellipsoidal height [m], quality, line."""
    std: dict[datetime, tuple[float, float, float]] = field(default_factory=dict)
    attitudes: list[tuple[datetime, float, float, float]] = field(default_factory=list)
    """Time, roll, pitch, heading [deg]."""
    headings: list[tuple[datetime, float]] = field(default_factory=list)
    broken: list[int] = field(default_factory=list)
    lost: list[int] = field(default_factory=list)
    day: date | None = None
    last: datetime | None = None


def read_nmea(path: str | Path, longest_gap: float | None = None) -> VehicleLog:
    """Read a vehicle's log in NMEA.

    Lines with a wrong checksum are left out and noted.

    Raises:
        InputError: it cannot be read, no sentence gives the date, or fewer than two GGA have a fix.
    """
    parse = library("pynmeagps").NMEAReader.parse
    wrong = library("pynmeagps.exceptions").NMEAParseError
    try:
        lines = Path(path).read_bytes().splitlines()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    read = _Sentences()
    read.day = _first_day(lines, parse, wrong)
    if read.day is None:
        raise InputError(f"{path}: no sentence RMC or ZDA gives the date; NMEA's other times have none")
    for number, line in enumerate(lines, start=1):
        text = line.strip()
        if not text:
            continue
        try:
            sentence = parse(text + b"\r\n")
            if sentence is None:
                raise ValueError("not a sentence")
            _take(read, sentence, number)
        except (wrong, ValueError, TypeError, OverflowError, AttributeError):
            read.broken.append(number)
    if len(read.fixes) < 2:
        raise InputError(f"{path}: {len(read.fixes)} GGA sentences with a fix; it needs two")
    return _log(str(path), read, longest_gap)


def _first_day(lines: list[bytes], parse: Any, wrong: type[Exception]) -> date | None:
    for line in lines:
        if line[3:6] not in (b"RMC", b"ZDA"):
            continue
        try:
            found = _day(parse(line.strip() + b"\r\n"))
        except (wrong, ValueError, TypeError, AttributeError):
            continue
        if found is not None:
            return found
    return None


def _day(sentence: Any) -> date | None:
    if sentence.msgID == "ZDA":
        return date(int(sentence.year), int(sentence.month), int(sentence.day))
    day = sentence.date
    if not isinstance(day, date):
        return None
    return day.replace(year=day.year % 100 + 2000)  # two digits; GPS logs of the last century are not read here


def _take(read: _Sentences, sentence: Any, line: int) -> None:
    """Add one sentence to what has been read."""
    kind = sentence.msgID
    if kind in ("RMC", "ZDA"):
        read.day = _day(sentence) or read.day
        _instant(read, sentence.time)
    elif kind == "GGA":
        if not isinstance(sentence.quality, int) or sentence.quality == 0:
            read.lost.append(line)
            return
        at = _instant(read, sentence.time)
        height = float(sentence.alt) + float(sentence.sep)
        read.fixes.append((at, float(sentence.lat), float(sentence.lon), height, sentence.quality, line))
    elif kind == "GST":
        east, north, up = float(sentence.stdLong), float(sentence.stdLat), float(sentence.stdAlt)
        if min(east, north, up) <= 0.0 or max(east, north, up) > DEVIATION.high:
            raise ValueError("a standard deviation that is not plausible")
        read.std[_instant(read, sentence.time)] = (east, north, up)
    elif kind == "ASHR":
        angles = float(sentence.roll), float(sentence.pitch), float(sentence.trueHdg)
        read.attitudes.append((_instant(read, sentence.utctime), *angles))
    elif kind in ("HDT", "THS") and read.last is not None:
        read.headings.append((read.last, float(sentence.headingT if kind == "HDT" else sentence.headt)))


def _instant(read: _Sentences, of_day: Any) -> datetime:
    """Return the instant of a time of day, which may be past midnight since the date was given."""
    if not isinstance(of_day, time) or read.day is None:
        raise ValueError("no time")
    at = datetime.combine(read.day, of_day, tzinfo=UTC)
    if read.last is not None and at - read.last < -_HALF_DAY:
        at += timedelta(days=1)
        read.day = at.date()
    read.last = at
    return at


def _log(path: str, read: _Sentences, longest_gap: float | None) -> VehicleLog:
    t = np.array([fix[0].timestamp() for fix in read.fixes])
    values = np.array([fix[1:5] for fix in read.fixes])
    latitude, longitude, height = np.radians(values[:, 0]), np.radians(values[:, 1]), values[:, 2]
    quality, lines = values[:, 3].astype(int), np.array([fix[5] for fix in read.fixes])
    broken = "broken or with a wrong checksum, left out"
    notes = [f"{path}: {listed(broken, read.broken)}"] if read.broken else []
    std = np.array([read.std.get(fix[0], (np.nan,) * 3) for fix in read.fixes])
    if np.isfinite(std).all():
        covariance = std[:, :, None] ** 2 * np.eye(3)
    else:
        covariance, said = covariance_of_quality(quality, path)
        notes += said
        given = np.isfinite(std).all(axis=-1)
        covariance[given] = std[given][:, :, None] ** 2 * np.eye(3)
    angles, spread, said = _attitude(path, read, t)
    notes += said
    if np.isnan(angles[:, 2]).any():
        angles[:, 2] = heading_of_track(ecef_of(latitude, longitude, height), path)
        spread[2] = TRACK_STD
        notes.append(track_note(path))
    return VehicleLog.of(
        t,
        latitude,
        longitude,
        height,
        *angles.T,
        position_covariance=covariance,
        attitude_covariance=np.diag(spread**2),
        quality=quality,
        lines=lines,
        clock=UTC_CLOCK,
        source=path,
        longest_gap=longest_gap,
        lost=tuple(read.lost),
        notes=tuple(notes),
    )


def _attitude(path: str, read: _Sentences, t: Array) -> tuple[Array, Array, tuple[str, ...]]:
    """Return roll, pitch, heading (n, 3) [rad] at the fixes, their deviations, and notes.

    Without a heading, that is NaN.
    """
    notes: tuple[str, ...] = ()
    level = f"{path}: no roll and pitch; assumed level, with a standard deviation of {np.degrees(NO_TILT_STD):g} deg"
    angles = np.zeros((len(t), 3))
    if read.attitudes:
        angles[:], said = _at_fixes(path, t, [(each[0].timestamp(), *each[1:]) for each in read.attitudes])
        spread, notes = np.array([TILT_STD, TILT_STD, HEADING_STD]), said
    elif read.headings:
        angles[:], said = _at_fixes(path, t, [(each[0].timestamp(), 0.0, 0.0, each[1]) for each in read.headings])
        spread, notes = np.array([NO_TILT_STD, NO_TILT_STD, HEADING_STD]), (level, *said)
    else:
        angles[:, 2] = np.nan
        return angles, np.array([NO_TILT_STD, NO_TILT_STD, TRACK_STD]), (level,)
    figures = ", ".join(f"{np.degrees(each):g}" for each in spread)
    return angles, spread, (*notes, f"{path}: assumed standard deviations of roll, pitch and heading {figures} deg")


def _at_fixes(path: str, t: Array, rows: list[tuple[float, float, float, float]]) -> tuple[Array, tuple[str, ...]]:
    """Return roll, pitch, heading (n, 3) [rad] at the fixes, turned evenly, and a note on gaps.

    Args:
        path: the file.
        t: (n,) times of the fixes [s].
        rows: time [s], roll, pitch, heading [deg].
    """
    at, first = np.unique([row[0] for row in rows], return_index=True)
    turned = Rotation.from_matrix(attitude.rotation(*np.radians([rows[int(k)][1:] for k in first]).T))
    after = np.clip(np.searchsorted(at, t), 0, len(at) - 1)
    away = np.minimum(np.abs(at[after] - t), np.abs(at[np.maximum(after - 1, 0)] - t))
    if (away > _NEAR).any():
        k = int(np.argmax(away > _NEAR))
        raise InputError(f"{path}: the fix at {datetime.fromtimestamp(t[k], UTC):%H:%M:%S} has no attitude within {_NEAR:g} s")
    between = Slerp(at, turned) if len(at) > 1 else None
    found = attitude.angles((turned if between is None else between(np.clip(t, at[0], at[-1]))).as_matrix())
    farthest = float(away.max())
    note = f"{path}: a fix is {farthest:.2g} s from the nearest attitude or heading, which is turned evenly between two"
    return np.broadcast_to(found, (len(t), 3)), (note,) if farthest > _APART else ()
