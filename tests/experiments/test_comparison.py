"""A log beside its plan: errors that were put in come out, and noise stays what the filter's theory
says."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import csv

from boom_model import (
    JOINTS,
    Basis,
    Boom,
    InputError,
    Origin,
    body_transforms,
    forward_kinematics,
    inverse_dynamics,
    jacobian,
)
from boom_model.arrays import Array
from planner import Move, Trajectory
from planner.experiments.comparison import Log, Smoothed, compare, read_log, smoothed
from planner.motion.trajectory import read_csv, write_csv
from planner.recording import write_comparison_recording
from tests.builders import main_move
from tests.recordings import recorded_rows

BOOM = Boom.load()
SIGMA = np.array([1e-4, 1e-4, 1e-4, 5e-5, 2e-4])
"""Noise of an encoder [rad, m]."""


@pytest.fixture
def planned() -> Trajectory:
    return main_move("jerk-limited", step=0.01).trajectory


@pytest.fixture
def finer() -> Move:
    return main_move("jerk-limited", step=1e-3)


def noisy(t: Array, q: Array, seed: int = 5) -> Array:
    return q + SIGMA * np.random.default_rng(seed).normal(size=q.shape)


def smooth_motion(t: Array) -> tuple[Array, Array, Array]:
    """q, qd, qdd of slow sines: a cubic in any fifth of a second, to some 1e-6."""
    w, middle, size = (
        np.array([0.5, 0.6, 0.4, 0.7, 0.9]),
        np.array([1.0, 0.6, 2.0, 0.5, 0.2]),
        np.array([0.5, 0.3, 0.4, 0.3, 0.5]),
    )
    phase = t[:, None] * w
    return middle + size * np.sin(phase), size * w * np.cos(phase), -size * w**2 * np.sin(phase)


def test_a_log_of_the_plan_itself_shows_no_error(planned: Trajectory):
    log = Log.of(planned.t, planned.q, planned.qd, planned.qdd, np.zeros_like(planned.q))
    found = compare(BOOM, planned, log)
    assert np.abs(found.joint_error).max() < 1e-15
    assert found.tip_error.max() < 1e-15
    np.testing.assert_allclose(found.tau_measured, found.tau_planned, rtol=0, atol=1e-11)
    np.testing.assert_array_equal(found.tau_logged, np.zeros_like(planned.q))
    assert found.inside.all()
    assert (found.torque_noise < 1e-3).all()  # what the filter rounds off the motion


def test_between_its_samples_the_plan_is_the_planned_motion(planned: Trajectory, finer: Move):
    """A cubic through q and qd of a jerk-limited move is that move, but where the jerk jumps within
    a step."""
    samples = finer.trajectory
    found = compare(BOOM, planned, Log.of(samples.t, samples.q, samples.qd, samples.qdd))
    assert np.abs(found.joint_error).max() < 1e-8
    assert np.abs(found.planned.qd - found.measured.qd).max() < 5e-6


def test_an_error_that_was_put_in_comes_out_where_it_was(planned: Trajectory):
    error = np.zeros_like(planned.q)
    at = 200
    error[at] = 0.0, 2e-3, -1e-3, 5e-4, 0.0
    found = compare(BOOM, planned, Log.of(planned.t, planned.q + error, planned.qd, planned.qdd))
    np.testing.assert_allclose(found.joint_error, error, rtol=0, atol=1e-15)
    answer = found.to_json({})
    assert answer["tip"]["at_s"] == planned.t[at]
    shift = jacobian(BOOM, planned.q[at])[:3] @ error[at]
    assert answer["tip"]["peak_m"] == pytest.approx(np.linalg.norm(shift), rel=5e-3)
    np.testing.assert_allclose(answer["tip"]["planned_m"], forward_kinematics(BOOM, planned.q[at]).position, rtol=1e-14)
    extension = answer["joints"][3]["position"]
    assert (extension["unit"], extension["error"]["at_s"]) == ("m", planned.t[at])
    assert extension["error"]["peak"] == pytest.approx(5e-4, rel=1e-12)
    assert extension["error"]["rms"] == pytest.approx(5e-4 / np.sqrt(planned.t.size), rel=1e-9)


def test_logged_torques_are_held_against_the_models(planned: Trajectory):
    tau = inverse_dynamics(BOOM, planned.q, planned.qd, planned.qdd).tau
    found = compare(BOOM, planned, Log.of(planned.t, planned.q, planned.qd, planned.qdd, tau + 7.0 * np.eye(5)[1]))
    difference = found.to_json({})["joints"][1]["torque"]["logged_less_measured"]
    assert (difference["peak"], difference["mean"]) == (pytest.approx(7.0, abs=1e-11), pytest.approx(7.0, abs=1e-11))


@pytest.mark.parametrize("payload_as", ["mass", "force"])
@pytest.mark.parametrize("rate", [100.0, 1000.0])
def test_torque_error_of_a_noisy_log_is_what_theory_says(rate: float, payload_as: Any):
    """Its root mean square, and no bias beside it: 200 windows of noise leave 5 % of scatter."""
    t = np.arange(int(40.0 * rate)) / rate
    q, qd, qdd = smooth_motion(t)
    found = compare(BOOM, Trajectory.from_samples(t, q, qd, qdd), Log.of(t, noisy(t, q)), payload_as=payload_as)
    np.testing.assert_allclose(found.noise, SIGMA, rtol=0.05)
    error = (found.tau_measured - found.tau_planned)[found.inside]
    rms = np.sqrt(np.mean(error**2, axis=0))
    np.testing.assert_allclose(rms, found.torque_noise, rtol=0.1)
    assert (np.abs(error.mean(axis=0)) < 0.05 * found.torque_noise).all()


def test_the_filters_gain_is_the_textbooks():
    """Of a second derivative by a quadratic or cubic over N even samples: sqrt(720 / (N (N^2 - 1)
    (N^2 - 4))) / h^2."""

    def left(ready: Smoothed) -> Array:
        return np.sqrt(ready.covariance[:, 2, 2])

    h, N = 0.01, 21
    t = np.arange(4000) * h
    q, qd, _ = smooth_motion(t)
    ready = smoothed(Log.of(t, noisy(t, q)), window=0.2)
    gain = np.sqrt(720.0 / (N * (N**2 - 1) * (N**2 - 4))) / h**2
    np.testing.assert_allclose(left(ready), ready.noise * gain, rtol=1e-9)
    from_velocities = smoothed(Log.of(t, noisy(t, q), noisy(t, qd)), window=0.2)
    assert "the log has no accelerations; they are computed from its velocities" in from_velocities.trajectory.notes[0]
    assert (left(from_velocities) < 0.2 * left(ready)).all()


def test_a_plain_spline_would_drown_the_torques(tmp_path: Path):
    """What reading the log as a motion does: the reason for the filter."""
    t = np.arange(1000) * 0.01
    q, qd, qdd = smooth_motion(t)
    columns = [t, *noisy(t, q).T]
    names = ["t", *(f"q{i}" for i in range(1, 6))]
    csv.write_csv(pa.table([np.ascontiguousarray(c) for c in columns], names=names), tmp_path / "log.csv")
    spline = read_csv(tmp_path / "log.csv")
    found = compare(BOOM, Trajectory.from_samples(t, q, qd, qdd), read_log(tmp_path / "log.csv"))
    amplified = inverse_dynamics(BOOM, spline.q, spline.qd, spline.qdd).tau - found.tau_planned
    assert (np.sqrt(np.mean(amplified**2, axis=0)) > 200.0 * found.torque_noise).all()


@pytest.mark.parametrize("lag", [-0.8, 0.0, 1.2345])
def test_the_best_offset_finds_the_clocks_difference(lag: float, planned: Trajectory):
    """With rest before and after the move, and noise: to some 4 of its standard deviations."""
    rest = np.arange(0.0, 0.5, 0.01)
    still = np.ones((rest.size, 1))
    t = np.concatenate([rest - 0.5, planned.t, planned.t[-1] + 0.01 + rest])
    q = np.concatenate([still * planned.q[0], planned.q, still * planned.q[-1]])
    log = Log.of(t - lag, noisy(t, q))
    found = compare(BOOM, planned, log, offset=None)
    assert found.offset == found.best_offset
    weight = 1.0 / (BOOM.limits.upper - BOOM.limits.lower)
    scatter = np.sqrt(np.sum((weight**2 * SIGMA * planned.qd) ** 2)) / np.sum((weight * planned.qd) ** 2)
    assert abs(found.offset - lag) < 4.0 * scatter
    assert found.planned.t[0] >= planned.t[0]
    assert found.planned.t[-1] <= planned.t[-1]
    assert abs(compare(BOOM, planned, log, offset=lag).best_offset - found.offset) < 1e-9


def test_the_best_offset_finds_a_piece_of_a_long_motion_of_many_cycles():
    """A minute of swings, one a second, each a little wider: a search from one place would end in a
    neighbour's."""
    t = np.arange(6000) * 0.01
    swing = 0.005 * t[:, None] * np.array([1.0, 0.5, 0.5, 0.3, 1.0])
    q = np.array([1.0, 0.8, 2.0, 0.5, 0.0]) + swing * np.sin(2 * np.pi * t)[:, None]
    swings = Trajectory.from_samples(t, q, np.gradient(q, t, axis=0), np.zeros_like(q))
    piece = slice(3140, 3640)
    log = Log.of(t[piece] - 31.4, noisy(t[piece], q[piece]))
    assert compare(BOOM, swings, log, offset=None).offset == pytest.approx(31.4, abs=1e-3)


def test_a_delay_is_an_error_unless_it_is_fitted_away(planned: Trajectory):
    delayed = Log.of(
        planned.t,
        compare(BOOM, planned, Log.of(planned.t, planned.q, planned.qd, planned.qdd)).planned.q,
        planned.qd,
        planned.qdd,
    )
    late = Log.of(delayed.t + 0.02, delayed.q, delayed.qd, delayed.qdd)
    seen, fitted = compare(BOOM, planned, late), compare(BOOM, planned, late, offset=None)
    assert (seen.offset, fitted.offset) == (0.0, pytest.approx(-0.02, abs=1e-6))
    assert seen.tip_error.max() > 1e-2
    assert fitted.tip_error.max() < 1e-5


def test_uneven_steps_are_evened_out_and_said_so():
    rng = np.random.default_rng(8)
    t = np.cumsum(rng.uniform(0.8e-3, 1.2e-3, 20_000))
    q, _, qdd = smooth_motion(t)
    ready = smoothed(Log.of(t, q))
    assert "uneven" in ready.trajectory.notes[0]
    _, _, expected = smooth_motion(ready.trajectory.t)
    inner = ready.inside
    assert np.abs(ready.trajectory.qdd - expected)[inner].max() < 1e-3
    assert np.abs(qdd).max() > 0.3
    assert smoothed(Log.of(np.arange(100) * 0.01, q[:100])).trajectory.notes[0].startswith("the log has no velocities")


def test_notes_say_whose_they_are_and_what_is_assumed(planned: Trajectory):
    friction = replace(BOOM.friction, origins=(None, Origin(Basis.ASSUMED, "this test"), None, None, None))
    plan_from_file = replace(planned, notes=("from a file",))
    found = compare(replace(BOOM, friction=friction), plan_from_file, Log.of(planned.t, planned.q, planned.qd))
    plan_note, log_note, assumed = found.notes
    assert plan_note == "plan: from a file"
    assert log_note.startswith("log: the log has no accelerations; they are computed from its velocities")
    assert assumed == "the friction of inner is assumed: this test"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"window": 0.0}, "window is 0 s"),
        ({"window": 0.02}, "contains 3 samples of a log with steps of 0.00998623 s"),
        ({"window": 9.0}, "a window of 9 s needs"),
        ({"offset": np.nan}, "offset is nan"),
        ({"offset": 50.0}, "fewer than two samples in common; the offset that fits best is"),
    ],
)
def test_what_cannot_be_compared_is_refused(change: dict[str, float], message: str, planned: Trajectory):
    with pytest.raises(InputError, match=message):
        compare(BOOM, planned, Log.of(planned.t, planned.q), **change)


def test_a_gap_longer_than_the_window_is_refused(planned: Trajectory):
    keep = (planned.t < 2.0) | (planned.t > 2.5)
    with pytest.raises(InputError, match=r"a gap of 0\.5"):
        smoothed(Log.of(planned.t[keep], planned.q[keep]))


def test_a_log_that_does_not_fit_together_is_refused(tmp_path: Path, planned: Trajectory):
    with pytest.raises(InputError, match="tau has shape"):
        Log.of(planned.t, planned.q, tau=planned.q[1:])
    with pytest.raises(InputError, match="the plan has a single sample"):
        compare(
            BOOM, Trajectory.from_samples([0.0], planned.q[:1], planned.qd[:1], planned.qdd[:1]), Log.of(planned.t, planned.q)
        )


# The recording and the command


def write_log(path: Path, t: Array, q: Array, tau: Array | None = None) -> None:
    columns = {"t": t} | {f"q{i + 1}": q[:, i] for i in range(5)}
    columns |= {} if tau is None else {f"tau{i + 1}": tau[:, i] for i in range(5)}
    csv.write_csv(pa.table({name: np.ascontiguousarray(c) for name, c in columns.items()}), path)


def test_the_recording_holds_both(tmp_path: Path, planned: Trajectory):
    tau = inverse_dynamics(BOOM, planned.q, planned.qd, planned.qdd).tau
    found = compare(BOOM, planned, Log.of(planned.t, noisy(planned.t, planned.q), tau=tau))
    write_comparison_recording(tmp_path / "both.rrd", found)
    done = subprocess.run(
        [sys.executable, "-m", "rerun", "rrd", "verify", tmp_path / "both.rrd"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr

    def rows(entity: str, component: str) -> Array:
        return np.array(recorded_rows(tmp_path / "both.rrd", entity, component))

    for place, motion in (("boom", found.measured), ("planned", found.planned)):
        for name, T in body_transforms(BOOM, motion.q).items():
            translation = rows(f"/world/{place}/{name}", "Transform3D:translation")[:, 0]
            np.testing.assert_allclose(translation, T[:, :3, 3], rtol=0, atol=5e-7)
        (frame,) = set(rows(f"/world/{place}/tip", "Transform3D:child_frame")[:, 0])
        assert frame == {"boom": "tip", "planned": "planned tip"}[place]
    np.testing.assert_array_equal(rows("/plots/error/tip", "Scalars:scalars")[:, 0], found.tip_error * 1e3)
    for i, joint in enumerate(JOINTS):
        expected = np.stack([found.tau_planned[:, i], found.tau_measured[:, i], tau[:, i]], axis=-1)
        np.testing.assert_array_equal(rows(f"/plots/tau/{joint}", "Scalars:scalars"), expected)
        factor = 1.0 if joint == "extension" else np.degrees(1.0)
        error = rows(f"/plots/error/{joint}", "Scalars:scalars")[:, 0]
        np.testing.assert_allclose(error, factor * found.joint_error[:, i], rtol=1e-12, atol=0)


@pytest.fixture
def boom(boom, planned: Trajectory, finer: Move):
    """The command, in a folder with a plan and a log."""
    write_csv(planned, "move.csv", finer.loads.tau[: planned.t.size])
    write_log(Path("log.csv"), planned.t + 30.0, noisy(planned.t, planned.q))
    return boom


def test_compare_prints_a_table_or_json_and_records(boom):
    code, out, err = boom("compare", "move.csv", "log.csv", "--offset", "best", "--out", "both.rrd")
    assert (code, err) == (0, "")
    assert Path("both.rrd").exists()
    assert "tip error at most" in out
    code, out, _ = boom("compare", "move.csv", "log.csv", "--offset", "best", "--all")
    assert "Savitzky-Golay filter over 21 samples" in out
    for tolerance, verdict, expected in (("0.01", "PASS", 0), ("0.0001", "FAIL", 1)):
        code, out, err = boom("compare", "move.csv", "log.csv", "--offset", "best", "--tolerance", tolerance)
        assert (code, f"{verdict}: tip error" in out) == (expected, True)
        assert bool(err) == (expected == 1)
    code, out, _ = boom("compare", "move.csv", "log.csv", "--offset", "-30", "--json")
    answer = json.loads(out)
    assert (code, answer["offset_s"], answer["files"]) == (0, -30.0, {})
    assert answer["best_offset_s"] == pytest.approx(-30.0, abs=1e-3)
    assert 1e-4 < answer["tip"]["peak_m"] < 2e-3
    assert answer["joints"][0]["torque"]["logged_less_measured"] is None


def test_exports_by_the_command(boom):
    for form in ("parquet", "yaml", "json"):
        code, out, _ = boom("export", "move.csv", f"move.{form}")
        assert (code, out) == (0, f"{form}: move.{form}\n")
    assert "effort" in json.loads(Path("move.json").read_text())["points"][0]
    assert boom("check", "move.parquet", "--out", "checked.rrd")[0] == 0
    assert boom("torque", "move.parquet", "--out", "tau.json")[1].endswith("json: tau.json\n")
    for name in ("boom.urdf", "boom.xml"):
        assert boom("export-model", name, "--payload", "8")[:2] == (0, f"model: {name}\n")
    code, out, _ = boom("export", "log.csv", "fitted.parquet")
    assert "Note: velocities and accelerations are not in the file" in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("compare", "move.csv", "log.csv"), "fewer than two samples in common"),
        (("compare", "move.csv", "log.csv", "--offset", "soon"), "neither a number of seconds nor best"),
        (("compare", "move.csv", "none.csv"), "none.csv: cannot be read"),
        (("compare", "move.csv", "log.csv", "--out", "none/x.rrd"), "cannot be written"),
        (("export", "move.csv", "move.mat"), "the name of a motion's file must end in"),
        (("export", "none.csv", "move.json"), "none.csv: cannot be read"),
        (("torque", "move.csv", "--out", "tau.txt"), "the name of a motion's file must end in"),
        (("export-model", "boom.sdf"), "the name of a boom's model must end in"),
        (("check", "move.csv", "--out", "none/x.rrd"), "cannot be written"),
    ],
)
def test_bad_input_gets_one_line_and_leaves_no_file(boom, arguments: tuple[str, ...], message: str):
    before = set(Path.cwd().iterdir())
    code, out, err = boom(*arguments)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err
    assert set(Path.cwd().iterdir()) == before
