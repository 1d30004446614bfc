"""Motions as Parquet and as ROS's JointTrajectory, read by pyarrow, json and PyYAML."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
import yaml
from pyarrow import parquet

from boom_model import JOINTS, InputError
from planner import Move, Trajectory
from planner.motion.motion_files import UNITS, read_motion, read_quantities, write_joint_trajectory, write_motion
from planner.motion.trajectory import COLUMNS, TORQUES, read_csv, write_csv
from tests.builders import main_move

PARTS = {"positions": "q", "velocities": "qd", "accelerations": "qdd"}


@pytest.fixture
def move() -> Move:
    return main_move("jerk-limited")


def read_message(path: Path) -> Any:
    if path.suffix == ".json":
        return json.loads(path.read_text())
    return yaml.load(path.read_text(), Loader=yaml.CSafeLoader)


def test_parquet_brings_back_every_bit_and_its_units(tmp_path: Path, move: Move):
    write_motion(move.trajectory, tmp_path / "move.parquet", move.loads.tau)
    back = read_motion(tmp_path / "move.parquet")
    for name in ("t", "q", "qd", "qdd"):
        np.testing.assert_array_equal(getattr(back, name), getattr(move.trajectory, name))
    data, _ = read_quantities(tmp_path / "move.parquet")
    np.testing.assert_array_equal(data["tau"], move.loads.tau)
    schema = parquet.read_schema(tmp_path / "move.parquet")
    assert schema.names == [*COLUMNS, *TORQUES]
    units = {field.name: field.metadata[b"unit"].decode() for field in schema}
    assert [units[name] for name in ("t", "q3", "q4", "qd1", "qd4", "qdd5", "qdd4", "tau2", "tau4")] == [
        *("s", "rad", "m", "rad/s", "m/s", "rad/s^2", "m/s^2", "Nm", "N")
    ]
    assert units == UNITS


def test_parquet_remembers_where_derivatives_come_from(tmp_path: Path, move: Move):
    columns = [move.trajectory.t, *move.trajectory.q.T]
    parquet.write_table(pa.table([np.ascontiguousarray(c) for c in columns], names=COLUMNS[:6]), tmp_path / "q.parquet")
    fitted = read_motion(tmp_path / "q.parquet")
    assert "spline" in fitted.notes[0]
    write_motion(fitted, tmp_path / "fitted.parquet")
    assert read_motion(tmp_path / "fitted.parquet").notes == fitted.notes


@pytest.fixture
def table(tmp_path: Path, move: Move) -> pa.Table:
    write_motion(move.trajectory, tmp_path / "good.parquet")
    return parquet.read_table(tmp_path / "good.parquet")


def with_column(table: pa.Table, name: str, values: Any, unit: str | None = None) -> pa.Table:
    field = pa.field(name, values.type, metadata={} if unit is None else {"unit": unit})
    return table.set_column(table.schema.get_field_index(name), field, values)


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda t: with_column(t, "q2", t["q2"], "deg"), "column q2 is in deg; it must be in rad"),
        (lambda t: with_column(t, "q2", pa.array(["x"] * len(t))), "a column does not hold numbers"),
        (lambda t: with_column(t, "q2", pa.array([None, *t["q2"].to_pylist()[1:]], pa.float64())), "row 1, column q2: nan"),
        (lambda t: t.drop_columns(["qd3"]), "lacks the column qd3"),
        (lambda t: t.drop_columns([f"qd{i}" for i in range(1, 6)]), "lacks the column qd1, qd2, qd3, qd4, qd5"),
        (lambda t: t.append_column("speed", t["q1"]), "unknown column speed"),
        (lambda t: t.slice(0, 0), "at least one sample"),
        (lambda t: t.take([1, 0]), "times must increase"),
    ],
)
def test_malformed_parquet_is_refused_with_the_reason(edit: Any, message: str, tmp_path: Path, table: pa.Table):
    parquet.write_table(edit(table), tmp_path / "bad.parquet")
    with pytest.raises(InputError, match=message) as caught:
        read_motion(tmp_path / "bad.parquet")
    assert "bad.parquet" in str(caught.value)


def test_whole_numbers_and_no_units_are_taken(tmp_path: Path):
    whole = {name: pa.array([0, 1, 2]) for name in COLUMNS}
    parquet.write_table(pa.table(whole), tmp_path / "whole.parquet")
    np.testing.assert_array_equal(read_motion(tmp_path / "whole.parquet").q[2], np.full(5, 2.0))


def test_what_is_no_parquet_is_refused(tmp_path: Path):
    (tmp_path / "text.parquet").write_text("t,q1\n0,1\n")
    with pytest.raises(InputError, match="not a motion's Parquet"):
        read_motion(tmp_path / "text.parquet")
    with pytest.raises(InputError, match="cannot be read"):
        read_motion(tmp_path / "none.parquet")


@pytest.mark.parametrize("form", ["yaml", "yml", "json"])
@pytest.mark.parametrize("torques", [False, True], ids=["no torques", "torques"])
def test_joint_trajectory_is_the_motion(form: str, torques: bool, tmp_path: Path, move: Move):
    path, tau = tmp_path / f"move.{form}", move.loads.tau if torques else None
    write_motion(move.trajectory, path, tau)
    message = read_message(path)
    assert list(message) == ["header", "joint_names", "points"]
    assert message["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "mount"}
    assert message["joint_names"] == list(JOINTS)
    points = message["points"]
    expected = PARTS | ({} if tau is None else {"effort": "tau"})
    assert all(list(point) == [*expected, "time_from_start"] for point in points)
    for key, name in expected.items():
        numbers = [point[key] for point in points]
        assert all(type(x) is float for row in numbers for x in row)  # ROS takes no int for a float64
        np.testing.assert_array_equal(numbers, tau if name == "tau" else getattr(move.trajectory, name))
    times = [point["time_from_start"] for point in points]
    assert all(type(x) is int for time in times for x in time.values())
    assert all(0 <= time["nanosec"] < 10**9 for time in times)
    since = [time["sec"] + time["nanosec"] * 1e-9 for time in times]
    np.testing.assert_allclose(since, move.trajectory.t, rtol=0, atol=0.6e-9)


@pytest.mark.parametrize("form", ["yaml", "json"])
def test_awkward_numbers_stay_numbers(form: str, tmp_path: Path):
    odd = np.array([[0.0, -0.0, 1e-9, -1e22, 3.0], [5e-324, 1.7976931348623157e308, 1e-5, 123456789.0, 0.1]])
    path = tmp_path / f"odd.{form}"
    write_motion(Trajectory.from_samples([-1.0, 2.5], odd, odd, odd), path)
    points = read_message(path)["points"]
    numbers = np.array([point["positions"] for point in points])
    assert numbers.dtype == float
    np.testing.assert_array_equal(numbers, odd)
    np.testing.assert_array_equal(np.signbit(numbers), np.signbit(odd))
    assert points[1]["time_from_start"] == {"sec": 3, "nanosec": 500_000_000}


def test_batches_join_without_a_seam(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, move: Move):
    whole, parts = tmp_path / "whole.json", tmp_path / "parts.json"
    write_joint_trajectory(move.trajectory, whole)
    monkeypatch.setattr("planner.motion.motion_files._ROWS", 7)
    write_joint_trajectory(move.trajectory, parts)
    assert json.loads(whole.read_text()) == json.loads(parts.read_text())


@pytest.mark.parametrize(("t", "message"), [([0.0, 1e-10], "nanosecond"), ([0.0, 3e9], "less than 2\\^31 s")])
def test_times_that_ros_cannot_hold_are_refused(t: list[float], message: str, tmp_path: Path):
    zero = np.zeros((2, 5))
    with pytest.raises(InputError, match=message):
        write_motion(Trajectory.from_samples(t, zero, zero, zero), tmp_path / "x.yaml")
    assert list(tmp_path.iterdir()) == []


def test_another_ending_is_refused(tmp_path: Path, move: Move):
    with pytest.raises(InputError, match=r"must end in one of \.csv, \.parquet"):
        write_motion(move.trajectory, tmp_path / "move.txt")


def test_a_file_of_any_other_name_is_read_as_csv(tmp_path: Path, move: Move):
    write_csv(move.trajectory, tmp_path / "move.log")
    np.testing.assert_array_equal(read_motion(tmp_path / "move.log").q, read_csv(tmp_path / "move.log").q)


def test_torques_matter_to_those_who_ask_for_them(tmp_path: Path, table: pa.Table, move: Move):
    table = table.append_column("tau1", pa.array(np.full(move.trajectory.t.size, np.nan)))
    parquet.write_table(table, tmp_path / "nan.parquet")
    np.testing.assert_array_equal(read_motion(tmp_path / "nan.parquet").q, move.trajectory.q)
    with pytest.raises(InputError, match="lacks the column tau2, tau3, tau4, tau5"):
        read_quantities(tmp_path / "nan.parquet")
