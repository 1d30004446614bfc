"""Files of a sampled motion: CSV, Parquet, and ROS's trajectory_msgs/JointTrajectory.

A JointTrajectory is written as YAML or JSON.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH, JOINTS, LOAD_UNITS
from boom_model.errors import InputError
from planner.files import replacing
from planner.motion.trajectory import (
    TORQUES,
    Trajectory,
    csv_table,
    motion_table,
    opened,
    quantities,
    trajectory_of,
    write_csv,
)
from planner.motion.units import require_si

if TYPE_CHECKING:
    import pyarrow as pa

FORMS = (".csv", ".parquet", ".yaml", ".yml", ".json")
"""Endings of the files that a motion can be written to. The first two can be read back."""

_PER = {"q": "", "qd": "/s", "qdd": "/s^2"}
UNITS = {"t": "s"} | {
    f"{name}{i + 1}": f"{'m' if IS_LENGTH[i] else 'rad'}{per}" for name, per in _PER.items() for i in range(5)
} | dict(zip(TORQUES, LOAD_UNITS, strict=True))  # fmt: skip
"""Unit of each column of a motion."""

_ROWS = 20_000  # converted to text at once


def form_of(path: str | Path) -> str:
    """Return the ending of a motion's file, which gives its form.

    Raises:
        InputError: the ending is none of FORMS.
    """
    form = Path(path).suffix.lower()
    if form not in FORMS:
        raise InputError(f"{path}: the name of a motion's file must end in one of {', '.join(FORMS)}")
    return form


def write_motion(trajectory: Trajectory, path: str | Path, tau: Array | None = None) -> None:
    """Write a motion in the form of the file's ending, with its torques (n, 5) if given.

    Raises:
        InputError: the ending is none of FORMS, the file cannot be written, or as
            `write_joint_trajectory`.
    """
    form = form_of(path)
    if form == ".csv":
        write_csv(trajectory, path, tau)
    elif form == ".parquet":
        _write_parquet(trajectory, path, tau)
    else:
        write_joint_trajectory(trajectory, path, tau)


def read_motion(path: str | Path) -> Trajectory:
    """Read a motion from Parquet (.parquet) or CSV (any other ending).

    The rules of `read_csv` hold for both.

    Raises:
        InputError: as `read_csv`, or a Parquet column has a unit other than this toolkit's.
    """
    data, notes = read_quantities(path, with_torques=False)
    return trajectory_of(path, data, notes)


def read_quantities(path: str | Path, *, with_torques: bool = True) -> tuple[dict[str, Array], tuple[str, ...]]:
    """Read the quantities in a motion's file, and its notes.

    The quantities are t (n,) and q (n, 5), and those of qd, qdd and tau (n, 5) that the file has.

    Args:
        path: the file.
        with_torques: whether to read tau.

    Raises:
        InputError: as `read_motion`, or the numbers look like another unit (`require_si`).
    """
    if Path(path).suffix.lower() == ".parquet":
        table, notes = _parquet_table(path)
        data = quantities(path, table, first="row 1", with_torques=with_torques)
    else:
        data, notes = quantities(path, csv_table(path), with_torques=with_torques), ()
    require_si(path, data)
    return data, notes


# Parquet


def _write_parquet(trajectory: Trajectory, path: str | Path, tau: Array | None) -> None:
    """Write Parquet, with units in the columns' metadata and notes in the file's metadata."""
    import pyarrow as pa
    from pyarrow import parquet

    table = motion_table(trajectory, tau)
    fields = [field.with_metadata({"unit": UNITS[field.name]}) for field in table.schema]
    schema = pa.schema(fields, metadata={"joints": json.dumps(JOINTS), "notes": json.dumps(trajectory.notes)})
    with replacing(path) as temporary, open(temporary, "wb") as file:
        parquet.write_table(table.cast(schema), file)


def _parquet_table(path: str | Path) -> "tuple[pa.Table, tuple[str, ...]]":
    import pyarrow as pa
    from pyarrow import parquet

    try:
        table = parquet.ParquetFile(opened(path)).read()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    except pa.ArrowException as error:
        raise InputError(f"{path}: not a motion's Parquet: {error}") from None
    fields = []
    for field in table.schema:
        unit = (field.metadata or {}).get(b"unit", b"").decode(errors="replace")
        if field.name in UNITS and unit not in ("", UNITS[field.name]):
            raise InputError(f"{path}: column {field.name} is in {unit}; it must be in {UNITS[field.name]}")
        fields.append(pa.field(field.name, pa.float64() if field.name in UNITS else field.type))
    try:
        table = table.cast(pa.schema(fields, metadata=table.schema.metadata))
    except pa.ArrowException as error:
        raise InputError(f"{path}: a column does not hold numbers: {error}") from None
    try:
        notes = json.loads((table.schema.metadata or {}).get(b"notes", b"[]"))
    except (ValueError, RecursionError):
        notes = []
    return table, tuple(str(note) for note in notes) if isinstance(notes, list) else ()


# ROS


def write_joint_trajectory(trajectory: Trajectory, path: str | Path, tau: Array | None = None) -> None:
    """Write a motion as ROS's trajectory_msgs/JointTrajectory, as JSON (.json) or YAML.

    The joint names are `JOINTS`, as in the URDF. The extension is in m and N. A point's
    time_from_start is measured from the first sample, in whole nanoseconds. The header's stamp is
    0, so the motion starts when the message arrives. Its frame is "mount", the URDF's root.

    The text is made here, one line per point, because a YAML library needs some 0.5 ms per point.

    Raises:
        InputError: two samples fall on the same nanosecond, the motion lasts 2^31 s or longer, or
            the file cannot be written.
    """
    since = trajectory.t - trajectory.t[0]
    if since[-1] >= 2.0**31:
        raise InputError(f"the motion lasts {since[-1]:g} s; a JointTrajectory must last less than 2^31 s")
    nanoseconds = np.rint(since * 1e9).astype(np.int64)
    if (np.diff(nanoseconds) <= 0).any():
        at = int(np.argmax(np.diff(nanoseconds) <= 0)) + 1
        raise InputError(f"t[{at}] is less than a nanosecond after t[{at - 1}]; a JointTrajectory cannot tell them apart")
    head = {"header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "mount"}, "joint_names": list(JOINTS)}
    points = _points(trajectory, nanoseconds, tau)
    with replacing(path) as temporary, open(temporary, "w", encoding="utf-8", newline="\n") as file:
        if Path(path).suffix.lower() == ".json":
            file.write(json.dumps(head)[:-1] + ', "points": [\n')
            for i, lines in enumerate(points):
                file.write((",\n" if i else "") + ",\n".join(lines))
            file.write("\n]}\n")
        else:
            file.writelines(f"{key}: {json.dumps(value)}\n" for key, value in head.items())
            file.write("points:\n")
            for lines in points:
                file.write("- " + "\n- ".join(lines) + "\n")


def _points(trajectory: Trajectory, nanoseconds: "np.typing.NDArray[np.int64]", tau: Array | None) -> Iterator[list[str]]:
    """Yield the points as JSON objects, in batches."""
    import pyarrow as pa
    import pyarrow.compute as pc

    named = {"positions": trajectory.q, "velocities": trajectory.qd, "accelerations": trajectory.qdd}
    if tau is not None:
        named["effort"] = tau
    for start in range(0, len(nanoseconds), _ROWS):
        part = slice(start, start + _ROWS)
        pieces: list[pa.Array | str] = []
        lead = "{"
        for name, values in named.items():
            for i, column in enumerate(values[part].T):
                pieces += [", " if i else f'{lead}"{name}": [', _numbers(column)]
            lead = "], "
        seconds, rest = np.divmod(nanoseconds[part], 1_000_000_000)
        pieces += ['], "time_from_start": {"sec": ', pc.cast(pa.array(seconds), pa.string())]
        pieces += [', "nanosec": ', pc.cast(pa.array(rest), pa.string()), "}}"]
        yield pc.binary_join_element_wise(*pieces, "").to_pylist()


def _numbers(values: Array) -> "pa.Array":
    """Return floats as text with all digits and a decimal point.

    Without the point, YAML 1.1 reads 1e-9 as text, and ROS does not accept 0 as a float.
    """
    import pyarrow as pa
    import pyarrow.compute as pc

    text = pc.cast(pa.array(np.ascontiguousarray(values)), pa.string())
    bare = pc.invert(pc.match_substring(text, "."))
    if not pc.any(bare).as_py():
        return text
    return pc.if_else(bare, pc.replace_substring_regex(text, r"^(-?\d+)(e|$)", r"\1.0\2"), text)
