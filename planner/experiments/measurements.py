"""Measured tip positions with the joint readings of their poses, as a CSV file."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from boom_model import JOINTS, InputError
from boom_model.arrays import Array, checked, read_only
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
_FARTHEST = 100.0  # [m] of a target from the origin of its frame, beyond which a coordinate is taken for millimetres
_WORST = 0.1  # [m] standard deviation beyond which it is taken for millimetres


@dataclass(frozen=True, eq=False)
class Measurements:
    """Tip positions in any one frame, with the readings of the joints."""

    readings: Array
    """(n, 5) [rad, the extension in m]"""
    tip: Array
    """(n, 3) in the measuring frame [m]; NaN for a coordinate that was not measured."""
    tip_sd: Array | None
    """(n, 3) standard deviation [m]; None if unknown."""
    reading_sd: Array
    """(n, 5) standard deviation of the readings [rad, m]"""
    name: str = "measurements"

    @staticmethod
    def of(
        readings: ArrayLike,
        tip: ArrayLike,
        tip_sd: ArrayLike | None = None,
        reading_sd: ArrayLike = 0.0,
        name: str = "measurements",
    ) -> "Measurements":
        """Return checked measurements; standard deviations broadcast.

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
        return Measurements(read_only(q), read_only(where), spread, joint, name)


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
    """Read q1..q5 and x, y, z, with any of sx, sy, sz and sq1..sq5, all in SI; an empty coordinate was not measured.

    Args:
        path: the CSV file.
        tip_sd: standard deviation of a coordinate [m] where the file has none.

    Raises:
        InputError: the file cannot be read, a column is missing or does not hold numbers, or as `Measurements.of`.
    """
    table = _table(path)
    missing = [name for name in (*READINGS, *COORDINATES) if name not in table.column_names]
    if missing:
        raise InputError(
            f"{path}: column {missing[0]} is missing; a row needs {', '.join((*READINGS, *COORDINATES))}: the readings of the "
            "joints and the measured tip"
        )
    if not table.num_rows:
        raise InputError(f"{path}: has no pose; measure the tip in at least 10 poses (boom calibrate --suggest 30)")

    def columns(names: tuple[str, ...], missing: float | None = None) -> Array:
        found = []
        for name in names:
            values = np.asarray(table[name].to_numpy(), dtype=float)
            if missing is None and np.isnan(values).any():
                raise InputError(f"{path}: {name} is empty in pose {int(np.argmax(np.isnan(values))) + 1}")
            found.append(values if missing is None else np.where(np.isnan(values), missing, values))
        return np.stack(found, axis=-1)

    spread: Array | float | None = tip_sd
    if any(name in table.column_names for name in _TIP_SD):
        lacking = [name for name in _TIP_SD if name not in table.column_names]
        if lacking:
            raise InputError(f"{path}: column {lacking[0]} is missing; give all of sx, sy and sz, or none")
        spread = columns(_TIP_SD, missing=1e-3 if tip_sd is None else tip_sd)
    joint = np.zeros((table.num_rows, 5))
    for i, name in enumerate(_READING_SD):
        if name in table.column_names:
            joint[:, i] = columns((name,))[:, 0]
    return Measurements.of(columns(READINGS), columns(COORDINATES, missing=np.nan), spread, joint, str(path))


def _table(path: str | Path) -> "pa.Table":
    import pyarrow as pa
    from pyarrow import csv

    known = (*READINGS, *COORDINATES, *_TIP_SD, *_READING_SD)
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
