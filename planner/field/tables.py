"""Tables of a field's logs: CSV with a header, values traced to lines, times on a named clock."""

import csv
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from boom_model import InputError
from boom_model.arrays import Array
from boom_model.words import nearest_name

UTC_CLOCK, OWN_CLOCK = "utc", "own"
TIME_COLUMNS = ("t", "utc", "gps_s")
"""Seconds of a clock of its own; UTC, ISO 8601 or seconds since 1970; seconds of GPS time since 6
January 1980."""

_GPS_EPOCH = 315_964_800.0  # [s] of UTC
_LEAP = 18.0  # [s] GPS time ahead of UTC since 2017
_LEAP_SINCE = 1_167_264_018.0  # [s] of GPS time
_LATEST = 7.3e9  # [s] of UTC, the year 2201
_LONGEST_CELL = 40
_MOST_ROWS = 5_000_000


@dataclass(frozen=True, eq=False)
class LogTable:
    """Rows of a CSV as text."""

    path: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: NDArray[np.int_]
    """(n,) line of each row"""

    def has(self, *names: str) -> bool:
        """Whether every one of the columns is there."""
        return all(name in self.header for name in names)

    def text(self, name: str) -> list[str]:
        """Return a column as text."""
        i = self.header.index(name)
        return [row[i].strip() for row in self.rows]

    def numbers(self, name: str, *, blank: bool = False) -> Array:
        """Return a column as numbers; a blank cell is NaN where it may be blank.

        Raises:
            InputError: a cell is no finite number; names the line.
        """
        cells = self.text(name)
        try:
            values = np.array([float(cell) if cell or not blank else np.nan for cell in cells])
        except ValueError:
            bad = next(k for k, cell in enumerate(cells) if not (_is_number(cell) or (blank and not cell)))
            raise InputError(f"{self.where(bad)}: {name} is {shown(cells[bad])}; it must be a number") from None
        wrong = ~np.isfinite(values) & np.array([bool(cell) or not blank for cell in cells], dtype=bool)
        if wrong.any():
            bad = int(np.flatnonzero(wrong)[0])
            raise InputError(f"{self.where(bad)}: {name} is {shown(cells[bad])}; it must be finite")
        return values

    def where(self, row: int) -> str:
        """Return what a message calls a row."""
        return f"{self.path}, line {self.lines[row]}"

    def keep(self, rows: Sequence[int] | NDArray[np.int_]) -> "LogTable":
        """Return the table with these rows alone."""
        return LogTable(self.path, self.header, tuple(self.rows[int(k)] for k in rows), self.lines[np.asarray(rows, dtype=int)])

    def times(self) -> tuple[Array, str]:
        """Return the times (n,) [s] and their clock, "utc" or "own".

        Raises:
            InputError: no column of time or several, a time that is malformed or has no zone, or
                GPS time before 2017.
        """
        found = [name for name in TIME_COLUMNS if name in self.header]
        if len(found) != 1:
            raise InputError(
                f"{self.path}: it has {' and '.join(found) or 'no time'}; it needs one of t (s of its own clock), "
                "utc (2026-07-01T09:00:00.25Z, or s since 1970) and gps_s (s since 6 January 1980)"
            )
        if found[0] == "t":
            return self.numbers("t"), OWN_CLOCK
        if found[0] == "gps_s":
            seconds = self.numbers("gps_s")
            early = seconds < _LEAP_SINCE
            if early.any():
                k = int(np.flatnonzero(early)[0])
                raise InputError(
                    f"{self.where(k)}: gps_s is {seconds[k]:.15g}; it counts from 6 January 1980, and begins in 2017 here "
                    f"({_LEAP_SINCE:.0f}); seconds of a week need their week added"
                )
            return self._plausible(seconds + _GPS_EPOCH - _LEAP), UTC_CLOCK
        cells = self.text("utc")
        if cells and all(_is_number(cell) for cell in cells):
            return self._plausible(self.numbers("utc")), UTC_CLOCK
        return self._plausible(np.array([self._instant(k, cell) for k, cell in enumerate(cells)])), UTC_CLOCK

    def _instant(self, row: int, cell: str) -> float:
        try:
            instant = datetime.fromisoformat(cell)
        except ValueError:
            raise InputError(f"{self.where(row)}: utc is {shown(cell)}; it must be a time as 2026-07-01T09:00:00.25Z") from None
        if instant.tzinfo is None:
            raise InputError(
                f"{self.where(row)}: utc is {shown(cell)}, without a zone; write Z for UTC, or the offset as -06:00"
            )
        return (instant - datetime(1970, 1, 1, tzinfo=UTC)).total_seconds()

    def _plausible(self, times: Array) -> Array:
        odd = ~((times > 0.0) & (times < _LATEST))
        if odd.any():
            k = int(np.flatnonzero(odd)[0])
            hint = "; it looks like milliseconds" if times[k] / 1e3 < _LATEST else ""
            raise InputError(f"{self.where(k)}: the time is {times[k]:.15g} s; it must be in the years 1970 to 2200{hint}")
        return times


def read_table(path: str | Path, known: Iterable[str]) -> tuple[LogTable, tuple[str, ...]]:
    """Read a CSV with a header; return it, and a note on columns that are not known.

    Args:
        path: the file.
        known: columns that may be there.

    Raises:
        InputError: the file cannot be read, has no rows, repeats a column, has a row of another
            length, or has a column of almost the name of one that is missing.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text, at byte {error.start}") from None
    rows: list[tuple[str, ...]] = []
    lines: list[int] = []
    reader = csv.reader(text.splitlines(), strict=True)
    try:
        for row in reader:
            if not any(cell.strip() for cell in row) or row[0].lstrip().startswith("#"):
                continue
            rows.append(tuple(row))
            lines.append(reader.line_num)
            if len(rows) > _MOST_ROWS:
                raise InputError(f"{path}: more than {_MOST_ROWS:,} rows")
    except csv.Error as error:
        raise InputError(f"{path}, line {reader.line_num}: not CSV: {error}") from None
    if len(rows) < 2:
        raise InputError(f"{path}: no rows under a header")
    header = tuple(cell.strip() for cell in rows[0])
    if len(set(header)) < len(header):
        twice = next(name for name in header if header.count(name) > 1)
        raise InputError(f"{path}, line {lines[0]}: column {shown(twice)} is there twice")
    for cells, line in zip(rows[1:], lines[1:], strict=True):
        if len(cells) != len(header):
            raise InputError(f"{path}, line {line}: {len(cells)} cells; the header has {len(header)}")
    expected = list(known)
    strange = [name for name in header if name not in expected]
    for name in strange:
        meant = nearest_name(name, [each for each in expected if each not in header])
        if meant is not None and len(name) > 2 and _near(name, meant):
            raise InputError(f"{path}: unknown column {shown(name)}; did you mean {meant}?")
    notes = (f"{path}: columns not used: {', '.join(map(shown, strange))}",) if strange else ()
    return LogTable(str(path), header, tuple(rows[1:]), np.array(lines[1:])), notes


def shown(cell: str) -> str:
    """Return a cell as a message quotes it."""
    return repr(cell if len(cell) <= _LONGEST_CELL else f"{cell[:_LONGEST_CELL]}...")


def _near(name: str, meant: str) -> bool:
    """Whether a name is a slip of another: heading for heading_deg, not std_up_m for std_east_m."""
    from difflib import SequenceMatcher

    return SequenceMatcher(None, name.lower(), meant).ratio() > 0.8


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
