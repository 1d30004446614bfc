"""A log beside two models: residuals, what takes them away, report and recording.

Calibration and identification are also chained, one after the other.
"""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import csv

from boom_model import Basis, Boom, InputError, Origin, forward_kinematics, inverse_dynamics
from boom_model.arrays import Array, read_only
from boom_model.boom import Friction
from boom_model.boom_file import BOOM_FILE
from boom_model.calibration import Calibration
from boom_model.measured import measured_lines
from boom_model.tip_uncertainty import printed_wind_up
from planner import check
from planner.checks.kinds import CheckKind
from planner.experiments.calibration import calibrate
from planner.experiments.calibration_file import write_calibrated
from planner.experiments.comparison import Log
from planner.experiments.excitation import random_excitation
from planner.experiments.identification import identify
from planner.experiments.measured_boom import write_identified
from planner.experiments.measurements import Measurements
from planner.experiments.readings import readings_of
from planner.experiments.residuals import residuals
from planner.motion.trajectory import Trajectory, write_csv
from planner.recording import write_before_after_recording
from tests.builders import main_move
from tests.recordings import recorded_entities, recorded_rows

CAD = Boom.load().with_payload(0.0)
NOISE = 0.5
OFFSET = read_only([0.02, 0.03, -0.025, 0.004, 0.02])
FRICTION = Friction(read_only([9, 14, 12, 40, 0.4]), read_only([8, 12, 10, 14, 2.0]), (None,) * 5, read_only([1, 2, 0, 0, 0.5]))
ROTORS = np.array([0.0, 14.7456, 14.7456, 0.0, 0.0])


def truth(boom: Boom = CAD) -> Boom:
    return replace(boom.with_body_mass("inner", 1.1 * boom.bodies["inner"].mass), friction=FRICTION)


def calibrated(boom: Boom) -> Boom:
    known = Calibration(
        Origin(Basis.MEASURED, "boom calibrate tips.csv: 30 poses"), OFFSET, read_only(np.ones(5)), read_only(np.ones(5)),
        ("inner offset", "lower offset"), read_only(np.diag([1e-8, 1e-8])),
    )  # fmt: skip
    return replace(boom, calibration=known)


@cache
def motion() -> tuple[Array, Array, Array, Array]:
    found = random_excitation(CAD, np.random.default_rng(4))
    t = np.arange(0.0, found.period, 0.005)
    return (t, *found(t))


@cache
def log(offset: float = 0.0, drive: bool = False) -> Log:
    """A log of the true boom whose readings are off by a share of OFFSET."""
    t, q, qd, qdd = motion()
    tau = inverse_dynamics(truth(), q, qd, qdd, friction=True, drive_inertia=drive, reactions=False).tau
    rng = np.random.default_rng(5)
    return Log.of(t, q - offset * OFFSET + 1e-5 * rng.normal(size=q.shape), tau=tau + NOISE * rng.normal(size=q.shape))


def test_the_shares_and_what_is_left_add_up_to_the_whole():
    found = residuals(CAD, truth(), log())
    before, after = found.rms
    whole = sum(found.shares.values()) + (after / before) ** 2
    np.testing.assert_allclose(whole, 1.0, rtol=1e-12)
    np.testing.assert_allclose(after, NOISE, rtol=0.06)
    np.testing.assert_allclose(found.noise, NOISE, rtol=0.06)
    assert (before > 3.0 * after)[:4].all()
    assert found.worse == ()


def test_each_part_takes_away_what_was_put_in_it():
    """Only friction differs, then only the inner link's mass: its weight is its own."""
    rubbing = replace(CAD, friction=FRICTION)
    heavy = replace(truth(), friction=CAD.friction)
    for after, log_of, part in ((rubbing, rubbing, "friction"), (heavy, heavy, "gravity")):
        t, q, qd, qdd = motion()
        tau = inverse_dynamics(log_of, q, qd, qdd, friction=True, reactions=False).tau
        found = residuals(CAD, after, Log.of(t, q, qd, qdd, tau))
        inner = {name: share[1] for name, share in found.shares.items()}
        assert inner[part] == pytest.approx(1.0, abs=0.02)
        assert sum(inner.values()) == pytest.approx(1.0, abs=1e-9)
        assert found.rms[1].max() < 1e-9


def test_drive_inertia_is_a_part_where_the_torques_have_it():
    bare = replace(truth(), drives=(None,) * 5)
    found = residuals(bare, truth(), log(drive=True), drive_inertia=True)
    before, after = found.rms
    assert before[1] > 1.2 * after[1]
    np.testing.assert_allclose(found.shares["drive inertia"], 1.0 - (after / before) ** 2, rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.rms[1], NOISE, rtol=0.06)


def test_each_model_applies_its_own_calibration():
    after = calibrated(truth())
    found = residuals(CAD, after, log(offset=1.0))
    np.testing.assert_allclose(found.after.q - found.before.q, np.broadcast_to(OFFSET, found.after.q.shape), atol=1e-15)
    np.testing.assert_allclose(found.rms[1], NOISE, rtol=0.06)
    apart = forward_kinematics(CAD, found.before.q + OFFSET).position - forward_kinematics(CAD, found.before.q).position
    np.testing.assert_allclose(found.apart, np.linalg.norm(apart, axis=-1), rtol=1e-12)
    assert found.to_json()["tip"]["after_sd_m"] == pytest.approx(found.after.tip_sd.max(), rel=1e-12)
    assert found.before.tip_sd is None


def test_identify_after_calibrate_works_on_joint_positions_not_on_readings():
    start, right = calibrated(CAD), log(offset=1.0)
    found = identify(start, [readings_of(right)])
    assert max(joint.after for joint in found.joints) < 1.15 * NOISE
    _, *states = motion()
    true = inverse_dynamics(truth(), *states, friction=True, reactions=False).tau

    def error(of: Boom) -> float:
        tau = inverse_dynamics(of, *states, friction=True, reactions=False).tau
        return float(np.sqrt(np.mean((tau - true)[:, 1] ** 2)))

    assert error(found.boom) < 0.1 * NOISE
    assert error(identify(CAD, [readings_of(right)]).boom) > 10.0 * error(found.boom)
    assert found.boom.calibration is start.calibration


def test_a_worse_model_is_a_no_and_a_still_joint_is_left_out():
    found = residuals(truth(), CAD, log())
    assert set(found.worse) == {"yaw", "inner", "lower", "extension", "wrist"}
    still = np.array(log().q)
    still[:, 4] = 0.3
    at_rest = residuals(CAD, truth(), replace(log(), q=read_only(still)))
    assert np.isnan(at_rest.rms[:, 4]).all()
    answer = at_rest.to_json()["joints"][4]
    assert (answer["before_rms"], answer["factor"], answer["samples"]) == (None, None, 0)
    assert "wrist does not move: its torques are left out" in at_rest.notes
    json.dumps(at_rest.to_json(), allow_nan=False)


def test_other_payloads_cannot_be_compared():
    with pytest.raises(InputError, match="payload is 0 kg before and 10 kg after"):
        residuals(CAD, Boom.load(), log())


def test_the_recording_holds_residuals_of_both_models(tmp_path: Path):
    found = residuals(CAD, calibrated(truth()), log(offset=1.0))
    write_before_after_recording(tmp_path / "both.rrd", found, "# report")
    rows = np.array(recorded_rows(tmp_path / "both.rrd", "/plots/left/inner", "Scalars:scalars"))
    moves = found.used[:, 1]
    np.testing.assert_array_equal(np.isnan(rows[:, 0]), ~moves)
    np.testing.assert_allclose(rows[moves, 1], found.after.residual[moves, 1], rtol=1e-12)


@pytest.fixture
def boom(boom, tmp_path: Path):
    """The command, in a folder with a log, the boom's file and one with friction."""
    written = log()
    columns = {f"{name}{i + 1}": x[:, i] for name, x in (("q", written.q), ("tau", written.tau)) for i in range(5)}
    csv.write_csv(pa.table({"t": written.t} | columns), tmp_path / "log.csv")
    csv.write_csv(pa.table({"t": written.t} | {f"q{i + 1}": written.q[:, i] for i in range(5)}), tmp_path / "silent.csv")
    text = BOOM_FILE.read_text(encoding="utf-8")
    (tmp_path / "cad.toml").write_text(text, encoding="utf-8")
    for i, joint in enumerate(("yaw", "inner", "lower", "extension", "wrist")):
        unit = ("N_s_per_m", "N") if joint == "extension" else ("Nm_s_per_rad", "Nm")
        lines = f"viscous_{unit[0]} = {FRICTION.viscous[i]}\ncoulomb_{unit[1]} = {FRICTION.coulomb[i]}\n"
        lines += f"asymmetric_{unit[1]} = {FRICTION.asymmetric[i]}\n"
        text += f'\n[joints.{joint}.friction]\n{lines}basis = "measured"\nsource = "boom identify log.csv: well"\n'
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    return boom


def test_compare_answers_in_one_screen_and_writes_report_and_recording(boom, tmp_path: Path):
    code, out, err = boom("compare", "log.csv", "--boom", "mine.toml", "--before", "cad.toml", "--payload", "0",
                          "--report", "better.html", "--out", "both.rrd")  # fmt: skip
    assert (code, err) == (0, "")
    assert len(out.splitlines()) <= 18
    assert max(map(len, out.splitlines())) <= 80
    assert "measured: friction: boom identify log.csv" in out
    assert "friction 9" in out
    page = (tmp_path / "better.html").read_text(encoding="utf-8")
    assert "taken away by" in page
    assert page.count("<img") == 2
    assert (tmp_path / "both.rrd").exists()
    other = boom("compare", "log.csv", "--after", "mine.toml", "--payload", "0", "--json")
    answer = json.loads(other[1])["before_after"]
    assert other[0] == 0
    inner = answer["joints"][1]
    assert inner["factor"] == pytest.approx(inner["before_rms"] / inner["after_rms"])
    assert set(inner["parts"]) == {"gravity", "inertia", "velocity", "payload", "friction"}
    assert answer["after"] == "mine.toml"


def test_a_model_that_explains_less_is_a_no(boom):
    code, _, err = boom("compare", "log.csv", "--boom", "cad.toml", "--before", "mine.toml", "--payload", "0")
    assert code == 1
    assert "the model after explains the torques worse" in err


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ("log.csv", "nothing to compare log.csv with: give PLANNED before it, or --before FILE.toml"),
        ("log.csv --before cad.toml --after mine.toml", "--before and --after are both given"),
        ("silent.csv --before cad.toml", "the log has no torques: measure tau1..tau5"),
        ("log.csv --before cad.toml --offset best", "--offset, --window and --tolerance compare with a plan"),
        ("log.csv log.csv --report r.pdf", "--report is of two models"),
        ("log.csv --before none.toml", "none.toml: cannot be read"),
        ("a b c", "3 motions are given"),
    ],
)
def test_a_mistake_is_named_in_one_line(boom, typed: str, said: str):
    code, out, err = boom("compare", *typed.split())
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert said in err


def tips_of(boom: Boom, count: int = 26) -> Measurements:
    """Measured tips of a boom whose offsets are OFFSET."""
    rng = np.random.default_rng(6)
    q = rng.uniform([0.0, 0.1, 0.0, 0.0, -1.5], [6.0, 1.2, 0.0, 1.0, 1.5], (count, 5))
    q[:, 2] = q[:, 1] + rng.uniform(0.5, 1.9, count)
    tip = forward_kinematics(boom, q - printed_wind_up(boom, q)).position + 2e-4 * rng.normal(size=(count, 3))
    return Measurements.of(q - OFFSET, tip, 2e-4, name="tips.csv")


@pytest.mark.parametrize("order", ["calibrate first", "identify first"])
def test_both_measurements_go_into_one_file(tmp_path: Path, order: str):
    first, both = tmp_path / "first.toml", tmp_path / "both.toml"
    boom, tips = CAD, tips_of(truth())
    if order == "calibrate first":
        write_calibrated(calibrate(boom, tips, known_frame=True, linkage="equal"), first, None, None)
        found = identify(Boom.load(first).with_payload(0.0), [readings_of(log(offset=1.0))])
        write_identified(both, first, found, "log.csv")
    else:
        # without a calibration the masses take up the offsets
        write_identified(first, None, identify(boom, [readings_of(log())]), "log.csv")
        start = Boom.load(first).with_payload(0.0)
        write_calibrated(calibrate(start, tips, known_frame=True, linkage="equal"), both, first, None)
    made = Boom.load(both)
    lines = measured_lines(made)
    assert "lengths and zeros of the joints: boom calibrate tips.csv: 26 poses" in lines
    assert "masses, friction: boom identify log.csv" in lines
    found = residuals(CAD, made.with_payload(0.0), log(offset=1.0))
    np.testing.assert_allclose(found.rms[1], NOISE, rtol=0.15)
    report = check(made, main_move("cubic", step=0.05).trajectory)
    assert report.measured == lines
    (row,) = (row for row in report.rows if row.kind is CheckKind.TIP_GEOMETRY)
    assert row.basis is Basis.MEASURED


@pytest.mark.parametrize(
    "typed", ["plan transport phenotyping", "mission table-2-4", "size table-2-4 --joint inner", "require table-2-4"]
)
def test_plans_missions_and_sizing_say_what_was_measured(boom, typed: str):
    code, out, err = boom(*typed.split(), "--boom", "mine.toml")
    assert (code, err) == (0, "")
    assert "measured: friction: boom identify log.csv" in out
    answer = json.loads(boom(*typed.split(), "--boom", "mine.toml", "--json")[1])
    assert answer["measured"] == ["friction: boom identify log.csv"]


def test_with_a_plan_both_comparisons_are_shown(boom, tmp_path: Path):
    t, q, qd, qdd = motion()
    write_csv(Trajectory.from_samples(t, q, qd, qdd), tmp_path / "plan.csv")
    code, out, err = boom("compare", "plan.csv", "log.csv", "--after", "mine.toml", "--payload", "0", "--out", "all.rrd")
    assert (code, err) == (0, "")
    assert "tip error at most" in out
    assert "mine.toml explains the torques of 5 of 5 joints better" in " ".join(out.split())
    assert len(out.splitlines()) <= 24
    entities = recorded_entities(tmp_path / "all.rrd")
    assert {"/plots/error/inner", "/plots/left/inner", "/plots/parts/inner"} <= entities
