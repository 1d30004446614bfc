"""Sampling a motion, and its CSV."""

import numpy as np
import pytest

from boom_model import InputError
from planner import Move, Trajectory
from planner.motion.trajectory import COLUMNS, read_csv, sample, write_csv
from tests.builders import main_move


@pytest.fixture
def move() -> Move:
    return main_move("jerk-limited")


def lines_of(trajectory: Trajectory, tmp_path, columns=COLUMNS) -> list[str]:
    write_csv(trajectory, tmp_path / "full.csv")
    header, *rows = (tmp_path / "full.csv").read_text().splitlines()
    keep = [header.split(",").index(c) for c in columns]
    return [",".join(np.array(line.split(","))[keep]) for line in (header, *rows)]


def test_samples_are_evenly_spaced_and_end_with_the_move(move):
    trajectory = sample(move.motions[0], 0.3)
    assert trajectory.t[-1] == pytest.approx(move.motions[0].duration, rel=1e-15)
    assert np.ptp(np.diff(trajectory.t)) < 1e-14
    assert np.diff(trajectory.t).max() <= 0.3
    assert not trajectory.q.flags.writeable


@pytest.mark.parametrize("step", [0.0, -1.0, np.nan])
def test_bad_step_is_refused(step, move):
    with pytest.raises(InputError, match="step"):
        sample(move.motions[0], step)


def test_csv_brings_back_every_bit(tmp_path, move):
    tau = move.loads.tau
    write_csv(move.trajectory, tmp_path / "move.csv", tau)
    header = (tmp_path / "move.csv").read_text().splitlines()[0]
    assert header == "t,q1,q2,q3,q4,q5,qd1,qd2,qd3,qd4,qd5,qdd1,qdd2,qdd3,qdd4,qdd5,tau1,tau2,tau3,tau4,tau5"
    back = read_csv(tmp_path / "move.csv")
    for name in ("t", "q", "qd", "qdd"):
        np.testing.assert_array_equal(getattr(back, name), getattr(move.trajectory, name))
    assert back.notes == ()


def test_positions_alone_get_their_derivatives_from_a_spline_and_say_so(tmp_path, move):
    (tmp_path / "q.csv").write_text("\n".join(lines_of(move.trajectory, tmp_path, COLUMNS[:6])))
    back = read_csv(tmp_path / "q.csv")
    np.testing.assert_allclose(back.qd, move.trajectory.qd, rtol=0, atol=1e-5)
    np.testing.assert_allclose(back.qdd[5:-5], move.trajectory.qdd[5:-5], rtol=0, atol=5e-3)
    assert "spline" in back.notes[0]


def test_given_derivatives_are_used_as_given(tmp_path):
    odd = Trajectory.from_samples([0.0, 1.0], np.zeros((2, 5)), np.ones((2, 5)), np.full((2, 5), 7.0))
    write_csv(odd, tmp_path / "odd.csv")
    np.testing.assert_array_equal(read_csv(tmp_path / "odd.csv").qdd, odd.qdd)


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda rows: [], "not a motion's CSV"),
        (lambda rows: [rows[0], ""], "at least one sample"),
        (lambda rows: [rows[0].replace("q3,", "x3,"), *rows[1:]], "lacks the column q3"),
        (lambda rows: [rows[0].replace("qdd5", "qdd6"), *rows[1:]], "lacks the column qdd5"),
        (lambda rows: [rows[0] + ",speed", *(r + ",1" for r in rows[1:])], "unknown column speed"),
        (lambda rows: [*rows[:3], "hello" + rows[3][rows[3].index(",") :], *rows[4:]], "invalid value 'hello'"),
        (lambda rows: [*rows[:3], "nan" + rows[3][rows[3].index(",") :], *rows[4:]], "line 4, column t: nan"),
        (lambda rows: [*rows[:3], rows[3] + ",1", *rows[4:]], "Expected 16 columns, got 17"),
        (lambda rows: [*rows[:3], rows[2], *rows[4:]], "times must increase"),
    ],
)
def test_malformed_csv_is_refused_with_the_reason(edit, message, tmp_path, move):
    path = tmp_path / "bad.csv"
    path.write_text("\n".join(edit(lines_of(move.trajectory, tmp_path))))
    with pytest.raises(InputError, match=message) as caught:
        read_csv(path)
    assert str(path) in str(caught.value)


def test_too_few_positions_for_a_spline(tmp_path, move):
    (tmp_path / "q.csv").write_text("\n".join(lines_of(move.trajectory, tmp_path, COLUMNS[:6])[:4]))
    with pytest.raises(InputError, match="at least 4"):
        read_csv(tmp_path / "q.csv")


def test_missing_file_is_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_csv(tmp_path / "none.csv")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"t": [1.0, 0.0]}, "times must increase"),
        ({"q": np.zeros((3, 5))}, r"q has shape \(3, 5\)"),
        ({"t": []}, "at least one"),
    ],
)
def test_samples_that_do_not_fit_are_refused(change, message):
    good = {"t": [0.0, 1.0], "q": np.zeros((2, 5)), "qd": np.zeros((2, 5)), "qdd": np.zeros((2, 5))}
    with pytest.raises(InputError, match=message):
        Trajectory.from_samples(**(good | change))
