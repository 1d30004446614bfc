"""A sampled motion, and its CSV file."""

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array, checked, read_only
from boom_model.errors import InputError
from boom_model.plausible import MOTION, TIME
from planner.files import replacing
from planner.timing.time_law import Motion

if TYPE_CHECKING:
    import pyarrow as pa

    from planner.motion.planned import PlannedMotion

STEP = 0.01
"""Default sampling step [s] (thesis, section 3.5)."""

_ROUNDING = 1e-9  # relative; rounding must not add a step to a whole number of steps
MOST_SAMPLES = 10_000_000
"""Largest number of samples of a motion: a day at a controller's 100 Hz."""

_QUANTITIES = ("q", "qd", "qdd")
COLUMNS = ("t", *(f"{name}{i}" for name in _QUANTITIES for i in range(1, 6)))
"""Header of a motion's CSV file, in SI units."""

TORQUES = tuple(f"tau{i}" for i in range(1, 6))
"""Further columns for torques [Nm, N for the extension]."""

_CLOSEST = 1e-9  # [s]
_SHOWN = 20  # largest number of columns that a message names
_FITTED = "velocities and accelerations are not in the file; they come from a cubic spline through its positions"


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Joint motion sampled at times t (n,): q, qd, qdd (n, 5), read-only, in rad, m and s."""

    t: Array
    q: Array
    qd: Array
    qdd: Array
    qddd: Array | None = None
    """Jerk; None unless the motion was planned with a jerk limit."""
    notes: tuple[str, ...] = ()
    """Notes on the origin of the samples, for the report."""
    planned: "PlannedMotion | None" = None
    """Continuous motion behind the samples, which checks examine between them. None if only the
    samples are known."""

    @staticmethod
    def from_samples(
        t: ArrayLike,
        q: ArrayLike,
        qd: ArrayLike,
        qdd: ArrayLike,
        qddd: ArrayLike | None = None,
        notes: tuple[str, ...] = (),
    ) -> "Trajectory":
        """Return a trajectory from arrays, after checking them.

        Raises:
            InputError: an array is not finite, the shapes do not match, there is no sample, or the
                times do not increase.
        """
        t = checked("t", t)
        if t.ndim != 1 or t.size == 0:
            raise InputError(f"t has shape {t.shape}; it must be (n,) with at least one sample")
        if (np.diff(t) <= 0).any():
            at = int(np.argmax(np.diff(t) <= 0)) + 1
            raise InputError(f"t[{at}] = {t[at]:g} s does not come after t[{at - 1}] = {t[at - 1]:g} s; times must increase")
        arrays = {"q": q, "qd": qd, "qdd": qdd} | ({} if qddd is None else {"qddd": qddd})
        # A joint is one run of numbers in memory: NumPy is slow on many rows of five.
        ready = {name: read_only(checked(name, values, 5), order="F") for name, values in arrays.items()}
        for name, array in ready.items():
            if array.shape != (t.size, 5):
                raise InputError(f"{name} has shape {array.shape}; with {t.size} times it must be ({t.size}, 5)")
        return Trajectory(read_only(t), ready["q"], ready["qd"], ready["qdd"], ready.get("qddd"), notes)

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return float(self.t[-1] - self.t[0])


def check_size(duration: float, step: float) -> None:
    """Check that a motion of a given duration can be sampled.

    Raises:
        InputError: it needs more than MOST_SAMPLES samples.
    """
    if duration > MOST_SAMPLES * step:
        raise InputError(f"{duration:g} s at steps of {step:g} s needs more than {MOST_SAMPLES:,} samples")


def sample(motion: Motion, step: float = STEP) -> Trajectory:
    """Sample a motion at equal steps of at most `step` seconds, both ends included.

    Raises:
        InputError: step is not a positive number, or the motion needs more than MOST_SAMPLES
            samples.
    """
    if not float(checked("step", step)) > 0.0:
        raise InputError(f"step is {step} s; it must be above 0 s")
    check_size(motion.duration, step)
    intervals = max(1, int(np.ceil(motion.duration / step * (1.0 - _ROUNDING))))
    t = np.linspace(0.0, motion.duration, intervals + 1)
    q, qd, qdd, qddd = motion(t)
    return Trajectory.from_samples(t, q, qd, qdd, qddd if motion.law.jerk_limited else None)


def concatenate(parts: Sequence[Trajectory], notes: tuple[str, ...] = ()) -> Trajectory:
    """Concatenate trajectories, each of which starts at rest where the previous one ends.

    The sample that two neighbours share is kept once.
    """
    if len(parts) == 1:
        return replace(parts[0], notes=notes)
    starts = np.concatenate([[0.0], np.cumsum([part.t[-1] for part in parts])])
    kept = [slice(None), *[slice(1, None)] * (len(parts) - 1)]
    t = np.concatenate([part.t[k] + start for part, k, start in zip(parts, kept, starts[:-1], strict=True)])
    q, qd, qdd = (
        np.concatenate([getattr(part, name)[k] for part, k in zip(parts, kept, strict=True)]) for name in ("q", "qd", "qdd")
    )
    jerks = [part.qddd[k] for part, k in zip(parts, kept, strict=True) if part.qddd is not None]
    return Trajectory.from_samples(t, q, qd, qdd, np.concatenate(jerks) if len(jerks) == len(parts) else None, notes)


def through_rest(t: Array, q: Array) -> Trajectory:
    """Return the motion of a cubic spline through samples, at rest at both ends.

    Args:
        t: (n,) times from 0 on [s].
        q: (n, 5) joint positions.

    Raises:
        InputError: the times do not increase.
    """
    from scipy.interpolate import CubicSpline

    still = np.zeros_like(q)
    plain = Trajectory.from_samples(t, q, still, still)
    spline = CubicSpline(plain.t, plain.q, bc_type="clamped")
    return Trajectory.from_samples(t, q, spline(t, 1), spline(t, 2))


def at_rest(q: Array, notes: tuple[str, ...] = ()) -> Trajectory:
    """Return the trajectory of an empty move: one sample at rest at q (5,)."""
    zero = np.zeros((1, 5))
    return Trajectory.from_samples([0.0], q[None], zero, zero, notes=notes)


def write_csv(trajectory: Trajectory, path: str | Path, tau: Array | None = None) -> None:
    """Write a motion as CSV with all digits, with tau1..tau5 appended if given.

    Raises:
        InputError: the file cannot be written; an existing file is left as it was.
    """
    from pyarrow import csv

    table = motion_table(trajectory, tau)
    with replacing(path) as temporary, open(temporary, "wb") as file:
        file.write(f"{','.join(table.column_names)}\n".encode())  # pyarrow would quote the names
        csv.write_csv(table, file, csv.WriteOptions(include_header=False))


def motion_table(trajectory: Trajectory, tau: Array | None = None) -> "pa.Table":
    """Return a table with the columns COLUMNS, and TORQUES if given."""
    import pyarrow as pa

    columns = [trajectory.t, *trajectory.q.T, *trajectory.qd.T, *trajectory.qdd.T]
    names = list(COLUMNS)
    if tau is not None:
        columns += [*tau.T]
        names += TORQUES
    return pa.table([np.ascontiguousarray(c) for c in columns], names=names)


def read_csv(path: str | Path) -> Trajectory:
    """Read a motion from CSV.

    The columns are t, q1..q5, and either all of qd1..qd5 and qdd1..qdd5 or none of them. Without
    them, a cubic spline through q gives the derivatives; with them, they are used as they are.
    Columns tau1..tau5 are ignored.

    Raises:
        InputError: the file cannot be read, is not CSV, lacks a column, has an unknown one or no
            samples, or it has values that are not finite or times that do not increase.
    """
    return trajectory_of(path, quantities(path, csv_table(path)))


def csv_table(path: str | Path) -> "pa.Table":
    """Read the table in a motion's CSV file, with its known columns as float64.

    Raises:
        InputError: the file cannot be read or is not CSV.
    """
    import pyarrow as pa
    from pyarrow import csv

    numbers = dict.fromkeys((*COLUMNS, *TORQUES), pa.float64())
    try:
        table = csv.read_csv(opened(path), convert_options=csv.ConvertOptions(column_types=numbers))
        table.column_names  # noqa: B018, decodes the names
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    except (pa.ArrowInvalid, UnicodeDecodeError) as error:
        reason = _OTHER_FILES.get(Path(path).suffix, f"not a motion's CSV: {error}")
        raise InputError(f"{path}: {reason}") from None
    if table.num_columns == 1 and ";" in table.column_names[0]:
        raise InputError(
            f"{path}: its columns are separated by semicolons; a motion's CSV has commas, and points in its numbers"
        )
    return table


_OTHER_FILES = {
    ".rrd": "a recording is not read back; boom plan START GOAL --csv FILE.csv writes the motion of a plan",
    ".toml": "not a motion; it is the file of a boom, a vehicle or a mission",
    ".yaml": "a ROS trajectory is not read back; give its CSV or Parquet file",
    ".yml": "a ROS trajectory is not read back; give its CSV or Parquet file",
    ".json": "a ROS trajectory is not read back; give its CSV or Parquet file",
}


def opened(path: str | Path) -> "pa.OSFile":
    """Open a file for pyarrow, which does not accept a name that is not UTF-8.

    Raises:
        OSError: the file cannot be opened.
    """
    import pyarrow as pa

    open(path, "rb").close()  # its errors are shorter than pyarrow's
    return pa.OSFile(os.fsencode(path))


def quantities(path: str | Path, table: "pa.Table", first: str = "line 2", *, with_torques: bool = False) -> dict[str, Array]:
    """Return the quantities in a motion's table.

    They are t (n,) and q (n, 5), and those of qd, qdd and (with `with_torques`) tau (n, 5) that the
    table has.

    Args:
        path: the file, for messages.
        table: the table.
        first: name of the first sample in messages.
        with_torques: whether to read tau. If not, tau may contain NaN.

    Raises:
        InputError: a column is missing, repeated or unknown, or a value is not finite or
            implausible.
    """
    names = set(table.column_names)
    _complain(path, "repeats the column", {name for name, count in Counter(table.column_names).items() if count > 1})
    looked_for = (*_QUANTITIES, "tau") if with_torques else _QUANTITIES
    found = [name for name in looked_for if name == "q" or any(f"{name}{i}" in names for i in range(1, 6))]
    needed = {"t", *(f"{name}{i}" for name in found for i in range(1, 6))}
    _complain(path, "lacks the column", needed - names)
    _complain(path, "has an unknown column", names - {*COLUMNS, *TORQUES})
    unit, start = first.split()
    for name in (name for name in (*COLUMNS, *TORQUES) if name in names):
        values = table[name].to_numpy()
        good = np.isfinite(values) if name in needed else ~np.isinf(values)
        if not good.all():
            row = int(np.argmin(good))
            raise InputError(f"{path}: {unit} {row + int(start)}, column {name}: {values[row]} is not a finite number")
        (TIME if name == "t" else MOTION).require(f"{path}: column {name}", values[np.isfinite(values)])
    stacked = {name: np.stack([table[f"{name}{i}"].to_numpy() for i in range(1, 6)], axis=-1) for name in found}
    return {"t": table["t"].to_numpy()} | stacked


def trajectory_of(path: str | Path, data: dict[str, Array], notes: tuple[str, ...] = ()) -> Trajectory:
    """Return the motion given by a file's quantities.

    If qd and qdd are both missing, a cubic spline through q supplies them.

    Raises:
        InputError: only one of qd and qdd is there, there are no samples or too few for the spline,
            or the times do not increase.
    """
    given = [name for name in ("qd", "qdd") if name in data]
    if len(given) == 1:
        _complain(path, "lacks the column", {f"{name}{i}" for name in {"qd", "qdd"} - {*given} for i in range(1, 6)})
    try:
        if given:
            return Trajectory.from_samples(data["t"], data["q"], data["qd"], data["qdd"], notes=notes)
        return _fitted(data["t"], data["q"], notes)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _fitted(t: Array, q: Array, notes: tuple[str, ...]) -> Trajectory:
    from scipy.interpolate import CubicSpline

    still = np.zeros_like(q)
    plain = Trajectory.from_samples(t, q, still, still)
    if t.size < 4:
        raise InputError(f"{t.size} samples without velocities and accelerations; a spline needs at least 4")
    if np.diff(plain.t).min() < _CLOSEST:
        raise InputError(f"two samples are {np.diff(plain.t).min():g} s apart; a spline needs at least {_CLOSEST:g} s")
    spline = CubicSpline(plain.t, plain.q)
    return Trajectory.from_samples(t, q, spline(t, 1), spline(t, 2), notes=(*notes, _FITTED))


def _complain(path: str | Path, what: str, names: set[str]) -> None:
    if names:
        shown = sorted(names)[:_SHOWN]
        more = f" and {len(names) - _SHOWN:,} more" if len(names) > _SHOWN else ""
        raise InputError(
            f"{path}: {what} {', '.join(shown)}{more}; a motion has the columns {','.join(COLUMNS)}, or the first six of them"
        )
