"""Measured tip positions, or distances of the tip from fixed points, with the joint readings."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from boom_model import JOINTS, InputError
from boom_model.arrays import Array, Mask, checked, read_only
from boom_model.boom import IS_LENGTH
from planner.files import replacing
from planner.motion.trajectory import opened
from planner.motion.units import MOST_EXTENSION, MOST_TURNS

if TYPE_CHECKING:
    import pyarrow as pa

READINGS = tuple(f"q{i + 1}" for i in range(5))
COORDINATES = ("x", "y", "z")
_TIP_SD = ("sx", "sy", "sz")
_READING_SD = tuple(f"sq{i + 1}" for i in range(5))
_DISTANCE, _DISTANCE_SD, _ANCHOR = "d", "sd", ("ax", "ay", "az")
_NEAREST = 1e-6  # [m]
_FARTHEST = 100.0  # [m] of a target from the origin of its frame, beyond which a coordinate is taken for millimetres
_WORST = 0.1  # [m] standard deviation beyond which it is taken for millimetres


@dataclass(frozen=True, eq=False)
class Measurements:
    """Tip positions in any one frame, with the readings of the joints."""

    readings: Array
    """(n, 5) [rad, the extension in m]"""
    tip: Array
    """(n, 3) in the measuring frame [m]; NaN for a coordinate that was not measured.

    Where a pose has an anchor, the distance from it stands first, and the others are NaN.
    """
    tip_sd: Array | None
    """(n, 3) standard deviation [m]; None if unknown."""
    reading_sd: Array
    """(n, 5) standard deviation of the readings [rad, m]"""
    name: str = "measurements"
    anchor: Array | None = None
    """(n, 3) fixed point of each distance [m], NaN for poses with coordinates; None without any."""

    @property
    def by_distance(self) -> Mask:
        """(n,) whether a pose has a distance instead of coordinates."""
        return np.zeros(len(self.tip), dtype=bool) if self.anchor is None else np.isfinite(self.anchor[:, 0])

    def seen(self, tip: Array) -> Array:
        """Return what is measured of tips (n, 3): the coordinates, or the distance and zeros.

        The tips are in the measuring frame.
        """
        if self.anchor is None:
            return tip
        by, found = self.by_distance, tip.copy()
        found[by] = 0.0
        found[by, 0] = np.linalg.norm(tip[by] - self.anchor[by], axis=-1)
        return found

    def across(self, tip: Array, J: Array) -> Array:
        """Return the derivative (n, 3, k) of `seen` for that of the tips, J (n, 3, k)."""
        if self.anchor is None:
            return J
        by, found = self.by_distance, J.copy()
        arm = tip[by] - self.anchor[by]
        along = arm / np.maximum(np.linalg.norm(arm, axis=-1, keepdims=True), _NEAREST)
        found[by] = 0.0
        found[by, 0] = np.einsum("ni,nik->nk", along, J[by])
        return found

    @staticmethod
    def of(
        readings: ArrayLike,
        tip: ArrayLike,
        tip_sd: ArrayLike | None = None,
        reading_sd: ArrayLike = 0.0,
        name: str = "measurements",
        anchor: ArrayLike | None = None,
    ) -> "Measurements":
        """Return checked measurements; standard deviations broadcast.

        Args:
            readings: (n, 5)
            tip: (n, 3); see the fields.
            tip_sd: of the coordinates, and of a distance in the first of its row; None if unknown.
            reading_sd: of the readings.
            name: of the measurements in messages.
            anchor: (n, 3); see the fields.

        Raises:
            InputError: a value is not finite (but NaN in tip), shapes do not match, a unit looks
                wrong, a standard deviation is not positive, or a pose has no coordinate.
        """
        q = checked(f"{name}: readings", readings, 5)
        where = np.asarray(tip, dtype=float)
        if q.ndim != 2 or where.shape != (len(q), 3):
            raise InputError(f"{name}: readings have shape {q.shape} and tips {where.shape}; they must be (n, 5) and (n, 3)")
        if np.isinf(where).any():
            raise InputError(f"{name}: a coordinate of the tip is infinite")
        bare = np.flatnonzero(np.isnan(where).all(axis=-1))
        if bare.size:
            raise InputError(f"{name}: pose {bare[0] + 1} has no coordinate; measure one of x, y, z, or leave it out")
        _require_si(name, q, where)
        spread = None
        if tip_sd is not None:
            spread = np.broadcast_to(checked(f"{name}: standard deviation of the tip", tip_sd), where.shape)
            if not (spread > 0.0).all():
                raise InputError(f"{name}: a standard deviation of the tip is {spread.min():g} m; it must be above 0 m")
            if spread.max() > _WORST:
                raise InputError(
                    f"{name}: a standard deviation of the tip looks like millimetres: it is {spread.max():g}; it must be in m"
                )
            spread = read_only(spread)
        joint = read_only(np.broadcast_to(checked(f"{name}: standard deviation of the readings", reading_sd), q.shape))
        if (joint < 0.0).any():
            raise InputError(f"{name}: a standard deviation of a reading is {joint.min():g}; it must not be negative")
        return Measurements(read_only(q), read_only(where), spread, joint, name, _anchors(name, where, anchor))


def _anchors(name: str, tip: Array, anchor: ArrayLike | None) -> Array | None:
    if anchor is None:
        return None
    points = np.asarray(anchor, dtype=float)
    by = np.isfinite(points).all(axis=-1)
    for i in np.flatnonzero(by):
        if not 0.0 < tip[i, 0] <= _FARTHEST:
            raise InputError(
                f"{name}: the distance of pose {i + 1} is {tip[i, 0]:g}; it must be above 0 and at most {_FARTHEST:g} m"
            )
    return read_only(points) if by.any() else None


def _require_si(name: str, q: Array, tip: Array) -> None:
    largest = np.abs(q).max(axis=0, initial=0.0)
    for i, joint in enumerate(JOINTS):
        if IS_LENGTH[i] and largest[i] > MOST_EXTENSION:
            raise InputError(f"{name}: q{i + 1} ({joint}) looks like millimetres: it reaches {largest[i]:.6g}; it must be in m")
        if not IS_LENGTH[i] and largest[i] > MOST_TURNS * 2.0 * np.pi:
            raise InputError(f"{name}: q{i + 1} ({joint}) looks like degrees: it reaches {largest[i]:.6g}; it must be in rad")
    spread = np.nanmax(tip, axis=0, initial=-np.inf) - np.nanmin(tip, axis=0, initial=np.inf) if len(tip) else np.zeros(3)
    if (spread > _FARTHEST).any():
        at = int(np.argmax(spread))
        raise InputError(
            f"{name}: {COORDINATES[at]} looks like millimetres: the tips are {spread[at]:.6g} apart; it must be in m"
        )


def read_measurements(path: str | Path, tip_sd: float | None = None) -> Measurements:
    """Read q1..q5 and x, y, z, or d and ax, ay, az, with any of sx, sy, sz, sd, sq1..sq5, in SI.

    An empty coordinate was not measured. d is the tip's distance from the fixed point ax, ay, az.

    Args:
        path: the CSV file.
        tip_sd: standard deviation of a coordinate or distance [m] where the file has none.

    Raises:
        InputError: the file cannot be read, a column is missing or does not hold numbers, or as
            `Measurements.of`.
    """
    table = _table(path)
    names = frozenset(table.column_names)
    far = bool(names & {_DISTANCE, *_ANCHOR})
    needed = (*READINGS, *((_DISTANCE, *_ANCHOR) if far else COORDINATES))
    missing = [name for name in needed if name not in names]
    if missing:
        raise InputError(
            f"{path}: column {missing[0]} is missing; a row needs {', '.join((*READINGS, *COORDINATES))}: the readings of the "
            "joints and the measured tip; or d, ax, ay, az: its distance from a fixed point"
        )
    if not table.num_rows:
        raise InputError(f"{path}: has no pose; measure the tip in at least 10 poses (boom calibrate --suggest 30)")

    def column(name: str, empty: float | None = None) -> Array:
        if name not in names:
            return np.full(table.num_rows, np.nan if empty is None else empty)
        values = np.asarray(table[name].to_numpy(), dtype=float)
        if empty is None and np.isnan(values).any():
            raise InputError(f"{path}: {name} is empty in pose {int(np.argmax(np.isnan(values))) + 1}")
        return values if empty is None else np.where(np.isnan(values), empty, values)

    def columns(wanted: tuple[str, ...], empty: float | None = None) -> Array:
        return np.stack([column(name, empty) for name in wanted], axis=-1)

    spread: Array | float | None = tip_sd
    usual = 1e-3 if tip_sd is None else tip_sd
    if any(name in names for name in _TIP_SD):
        lacking = [name for name in _TIP_SD if name not in names]
        if lacking:
            raise InputError(f"{path}: column {lacking[0]} is missing; give all of sx, sy and sz, or none")
        spread = columns(_TIP_SD, usual)
    tip, anchor = columns(COORDINATES, np.nan), None
    if far:
        anchor, distance = columns(_ANCHOR, np.nan), column(_DISTANCE, np.nan)
        tip, anchor = _with_distances(str(path), tip, distance, anchor)
        if _DISTANCE_SD in names:
            spread = np.array(np.broadcast_to(usual if spread is None else spread, tip.shape))
            spread[:, 0] = np.where(np.isfinite(anchor[:, 0]), column(_DISTANCE_SD, usual), spread[:, 0])
    joint = columns(_READING_SD, 0.0)
    return Measurements.of(columns(READINGS), tip, spread, joint, str(path), anchor)


def _with_distances(name: str, tip: Array, distance: Array, anchor: Array) -> tuple[Array, Array]:
    """Return the tips with distances in the first place, and their anchors, NaN elsewhere."""
    by = np.isfinite(distance)
    for i in np.flatnonzero(by):
        if not np.isfinite(anchor[i]).all():
            raise InputError(f"{name}: pose {i + 1} has a distance d, but not all of ax, ay, az: the point it is measured from")
        if np.isfinite(tip[i]).any():
            raise InputError(f"{name}: pose {i + 1} has a distance and coordinates; give each a row of its own")
    tip[by, 0] = distance[by]
    return tip, np.where(by[:, None], anchor, np.nan)


def _table(path: str | Path) -> "pa.Table":
    import pyarrow as pa
    from pyarrow import csv

    known = (*READINGS, *COORDINATES, *_TIP_SD, *_READING_SD, _DISTANCE, _DISTANCE_SD, *_ANCHOR)
    try:
        options = csv.ConvertOptions(column_types=dict.fromkeys(known, pa.float64()))
        table = csv.read_csv(opened(path), convert_options=options)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    except (pa.ArrowInvalid, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not a CSV of measurements: {error}") from None
    twice = {name for name in table.column_names if table.column_names.count(name) > 1}
    if twice:
        raise InputError(f"{path}: repeats the column {', '.join(sorted(twice))}")
    return table


def write_poses(path: str | Path, poses: Array) -> None:
    """Write poses (n, 5) as a file of measurements to fill in: the tips are empty.

    Raises:
        InputError: the file cannot be written.
    """
    with replacing(path) as temporary, open(temporary, "w", encoding="utf-8", newline="\n") as file:
        file.write(",".join((*READINGS, *COORDINATES)) + "\n")
        file.writelines(",".join(f"{x + 0.0:.9g}" for x in q) + ",,,\n" for q in poses)
