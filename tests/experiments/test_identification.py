"""Identification on logs that MuJoCo made: truth unknown to the fit, noise known to the test."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from boom_model import Basis, Boom, InputError, inverse_dynamics
from boom_model.arrays import Array, read_only
from boom_model.boom import Body
from planner.experiments.comparison import Log
from planner.experiments.identification import Identification, identify, with_dynamics
from planner.experiments.measured_boom import write_identified
from planner.experiments.payload import SURE, identify_payload
from planner.experiments.readings import Readings, readings_of
from planner.motion.trajectory import Trajectory, write_csv
from tests.builders import without_drives
from tests.virtual_boom import (
    DRIVE_INERTIA,
    TORQUE_NOISE,
    Experiment,
    experiment,
    fourier,
    perturbed,
    quintic,
    true_parameters,
)

BOOM = without_drives(Boom.load()).with_payload(0.0)
SEEDS = range(4)


@cache
def measured(seed: int, duration: float = 20.0) -> Experiment:
    rng = np.random.default_rng(seed)
    truth = perturbed(BOOM, rng)
    return experiment(BOOM, truth, fourier(BOOM, rng), duration, rng)


@cache
def identified(seed: int) -> Identification:
    return identify(BOOM, [readings_of(measured(seed).log)], drive_inertia=True)


def test_base_parameters_are_right_within_their_intervals() -> None:
    z, chi = [], 0.0
    for seed in SEEDS:
        base = identified(seed).base
        assert base is not None
        error = base.values - base.combinations @ true_parameters(measured(seed).truth)
        z.append(error / base.deviations)
        chi += float(error @ np.linalg.solve(base.covariance, error))
    size = np.abs(z)
    count = size.size
    assert count == len(SEEDS) * 46  # 29 of the masses, 15 of friction, 2 of the drives' inertia
    assert (size < 3.0).mean() > 0.97
    assert size.max() < 4.5
    # sigma is right: chi-square of 184 within 4 of its own standard deviations
    assert abs(chi - count) < 4.0 * np.sqrt(2.0 * count)


@pytest.mark.parametrize("seed", SEEDS)
def test_what_was_held_out_is_explained_to_the_noise(seed: int) -> None:
    found = identified(seed)
    for joint in found.joints:
        assert joint.after < 1.1 * TORQUE_NOISE
        assert joint.noise == pytest.approx(TORQUE_NOISE, rel=0.05)
    assert max(joint.before for joint in found.joints) > 8.0 * TORQUE_NOISE


@pytest.mark.parametrize("duration", [0.1, 1.0, 20.0])
def test_every_body_is_one_that_can_exist(duration: float) -> None:
    log = measured(1).log
    part = slice(3000, 3000 + round(duration * 1000))
    assert log.tau is not None
    found = identify(BOOM, [readings_of(Log.of(log.t[part], log.q[part], tau=log.tau[part]))], drive_inertia=True)
    assert (np.linalg.eigvalsh(found.pseudo_inertias) > 0.0).all()
    friction = found.boom.friction
    assert (friction.viscous >= 0.0).all()
    assert (friction.coulomb >= np.abs(friction.asymmetric)).all()
    assert found.told == sorted([0, found.told, found.countable])[1]
    if duration < 20.0:
        assert any("combinations" in note for note in found.notes)


def test_what_the_log_does_not_tell_stays_near_the_file() -> None:
    found = identified(0)
    mass = found.pseudo_inertias[:, 0, 0]
    start = np.array([BOOM.bodies[name].mass for name in BOOM.bodies])
    assert (np.abs(mass / start - 1.0) < 0.35).all()
    # the mass of the yawing base has no effect on level ground
    assert mass[list(BOOM.bodies).index("base")] == pytest.approx(BOOM.bodies["base"].mass, rel=1e-3)


def test_a_perfect_log_gives_the_truth() -> None:
    rng = np.random.default_rng(7)
    truth = perturbed(BOOM, rng)
    t = np.arange(0.0, 20.0, 0.005)
    q, qd, qdd = fourier(BOOM, rng)(t)
    tau = inverse_dynamics(truth, q, qd, qdd, friction=True, reactions=False).tau
    found = identify(BOOM, [readings_of(Log.of(t, q, qd, qdd, tau))])
    base = found.base
    assert base is not None
    true = base.combinations @ (true_parameters(truth) * (np.arange(90) // 5 != 14))  # without drives
    np.testing.assert_allclose(base.values, true, rtol=1e-6, atol=1e-6 * np.abs(base.combinations).sum(axis=1).max())


def test_the_boom_file_is_measured_and_gives_the_same_torques(tmp_path: Path) -> None:
    found = identified(2)
    file = tmp_path / "measured.toml"
    write_identified(file, None, found, "log.csv")
    read = Boom.load(file)
    expected, log = found.boom, measured(2)
    q = log.log.q[::500]
    states = (q, np.full_like(q, 0.1), np.full_like(q, 0.2))
    a, b = (inverse_dynamics(boom.with_payload(0.0), *states, friction=True, reactions=False).tau for boom in (read, expected))
    np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-6)
    for body in read.bodies.values():
        assert body.origin is not None
        assert body.origin.basis is Basis.MEASURED
    assert all(origin is not None and origin.basis is Basis.MEASURED for origin in read.friction.origins)
    assert "[joints.inner.drive]" in file.read_text(encoding="utf-8")


def turned(log: Log) -> Log:
    return scaled(log, [1.0, -1.0, 1.0, 1.0, 1.0])


def scaled(log: Log, by: list[float]) -> Log:
    assert log.tau is not None
    return replace(log, tau=read_only(log.tau * by))


def with_gap(log: Log) -> Log:
    kept = (log.t < 5.0) | (log.t > 5.4)
    assert log.tau is not None
    return Log.of(log.t[kept], log.q[kept], tau=log.tau[kept])


def still(log: Log) -> Log:
    q = log.q.copy()
    q[:, 4] = 0.3
    return replace(log, q=read_only(q))


def cut(log: Log) -> Log:
    assert log.tau is not None
    return Log.of(log.t[:30], log.q[:30], tau=log.tau[:30])


def held(log: Log) -> Log:
    """The yaw stands still, but for the noise of its encoder."""
    q = log.q.copy()
    q[:, 0] = 0.3 + 2e-4 * np.random.default_rng(0).normal(size=len(q))
    return replace(log, q=read_only(q))


def seldom(log: Log) -> Log:
    assert log.tau is not None
    return Log.of(log.t[::100], log.q[::100], tau=log.tau[::100])


def unread(log: Log) -> Log:
    assert log.tau is not None
    return replace(log, tau=read_only(np.where(np.arange(5) == 2, 7.0, log.tau)))


@pytest.mark.parametrize(
    ("slip", "said"),
    [
        (turned, r"inner \(tau2\) look turned round, because they are -\d.*multiply tau2 by -1"),
        *[
            (
                lambda log, i=i: scaled(log, [-1.0 if k == i else 1.0 for k in range(5)]),
                rf"\(tau{i + 1}\) look turned round.* \(multiply tau{i + 1} by -1",
            )
            for i in range(5)
        ],
        (lambda log: scaled(log, [1e-3, 1.0, 1.0, 1.0, 1.0]), r"yaw .* must be in Nm, behind the gearbox"),
        (lambda log: scaled(log, [1.0, 1.0, 1.0 / 160, 1.0, 1.0]), r"lower .*(gearbox of ratio|by the gear ratio) 160"),
        (lambda log: replace(log, q=read_only(np.degrees(log.q))), r"q1\) is .*far outside of its limits.*must be in rad"),
        (lambda log: scaled(log, [1.0, 1.0, 1.0, 1e-3, 1.0]), r"extension \(tau4\) .*look like kN; they must be in N"),
        (lambda log: scaled(log, [1.0, 1.0 / 160, 1.0, 1.0, 1.0]), r"inner .*those of the motor: multiply them by .* 160"),
        (with_gap, r"gap of 0\.4\d* s after t = .* measure without gaps"),
        (still, r"do not move: wrist .*boom identify --design"),
        (held, r"do not move: yaw .*boom identify --design"),
        (seldom, r"a sample every 0\.1 s; measure every 0\.05 s"),
        (unread, r"never change: lower \(tau3 = 7\)"),
        (cut, r"30 samples; measure at least 40"),
        (lambda log: replace(log, tau=None), r"no torques: measure tau1\.\.tau5"),
    ],
)
def test_a_slip_is_named_with_what_to_measure(slip: object, said: str) -> None:
    assert callable(slip)
    boom = Boom.load().with_payload(0.0)
    with pytest.raises(InputError, match=said):
        identify(boom, [readings_of(slip(measured(0).log))], drive_inertia=True)


def test_single_wrong_samples_are_noticed() -> None:
    log = measured(0).log
    assert log.tau is not None
    wrong = 500.0 * (np.random.default_rng(0).uniform(size=log.tau.shape) < 0.005)
    notes = identify(BOOM, [readings_of(replace(log, tau=read_only(log.tau + wrong)))], drive_inertia=True).warnings
    assert any("stays unexplained of" in note and "single wrong samples" in note for note in notes)
    assert not any("stays unexplained" in note for note in identified(0).notes)


def test_a_wrong_payload_is_named() -> None:
    with pytest.raises(InputError, match=r"times those of the boom's file.*--payload"):
        identify(BOOM.with_payload(10.0), [readings_of(measured(0).log)], drive_inertia=True)


def test_torques_that_are_stamped_late_are_noticed() -> None:
    log, late = measured(3).log, 20
    assert log.tau is not None
    shifted = Log.of(log.t[late:], log.q[late:], tau=log.tau[:-late])
    (warning,) = identify(BOOM, [readings_of(shifted)], drive_inertia=True).warnings
    assert "stamped" in warning
    assert "late" in warning
    assert identified(3).warnings == ()


def test_torques_of_motors_are_noticed() -> None:
    notes = identify(BOOM, [readings_of(measured(0).log)]).notes
    said = [note for note in notes if "follows the acceleration: torques of motors need --drive-inertia" in note]
    assert len(said) == 1
    assert "extension" in said[0]
    assert not any("follows the acceleration" in note for note in identified(0).notes)


START, GOAL = np.array([0.3, 0.4, 1.8, 0.2, -0.8]), np.array([1.5, 1.2, 2.8, 0.8, 0.9])


def carrying(truth: Boom, mass: float, rng: np.random.Generator, com: Array) -> Readings:
    """A move of 5 s with a payload, less the torque of the drives' inertia."""
    loaded = replace(truth, payload=Body(mass, read_only(com), read_only(1e-4 * mass * np.eye(3) + 1e-9 * np.eye(3))))
    ready = readings_of(experiment(truth.with_payload(5.0), loaded, quintic(START, GOAL, 5.0), 5.0, rng).log)
    return replace(ready, tau=ready.tau - DRIVE_INERTIA * ready.qdd)


@pytest.mark.parametrize("mass", [0.0, 1.0, 4.0, 9.0, 10.0])
def test_a_payload_is_found_from_one_move(mass: float) -> None:
    rng = np.random.default_rng(round(mass))
    truth = perturbed(BOOM, rng)
    com = rng.uniform(-0.05, 0.05, 3)
    found = identify_payload(truth.with_payload(5.0), [carrying(truth, mass, rng, com)])
    assert found.deviation < 0.01
    assert abs(found.boom.payload.mass - mass) < 4.0 * found.deviation
    if mass > 0.0:
        assert (np.abs(found.boom.payload.com - com) < 4.0 * found.com_deviation).all()
    else:
        assert found.held == ("x", "y", "z")


def test_a_kilogram_more_is_noticed_with_the_identified_boom() -> None:
    rng = np.random.default_rng(11)
    truth, known = measured(1).truth, identified(1).boom
    fits = [identify_payload(known.with_payload(5.0), [carrying(truth, mass, rng, np.zeros(3))]) for mass in (4.0, 5.0)]
    change = fits[1].boom.payload.mass - fits[0].boom.payload.mass
    assert change == pytest.approx(1.0, abs=0.05)
    assert change > SURE * np.hypot(fits[0].deviation, fits[1].deviation)


def test_the_command(tmp_path: Path) -> None:
    log = measured(0).log
    zero = np.zeros_like(log.q)
    write_csv(Trajectory.from_samples(log.t, log.q, zero, zero), tmp_path / "all.csv", log.tau)
    lines = (tmp_path / "all.csv").read_text(encoding="utf-8").splitlines()
    kept = [[0, *range(1, 6), *range(16, 21)]] * len(lines)
    text = "\n".join(",".join(line.split(",")[k] for k in keep) for line, keep in zip(lines, kept, strict=True))
    (tmp_path / "log.csv").write_text(text + "\n", encoding="utf-8")
    words = ["identify", "log.csv", "--payload", "0", "--drive-inertia", "--out", "new.toml", "--json"]
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}
    done = subprocess.run(
        [sys.executable, "-m", "planner", *words], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    assert answer["base_parameters"] == 46
    assert answer["files"] == {"boom": "new.toml"}
    assert {joint["joint"] for joint in answer["joints"]} == {"yaw", "inner", "lower", "extension", "wrist"}
    assert Boom.load(tmp_path / "new.toml").friction.coulomb.all()


def test_friction_differs_between_the_directions() -> None:
    boom = with_dynamics(BOOM, dict(BOOM.bodies), np.full(5, 2.0), np.full(5, 10.0), np.full(5, 3.0))
    np.testing.assert_allclose(boom.friction.torque([[1.0] * 5, [-1.0] * 5, [0.0] * 5]), [[15.0] * 5, [-9.0] * 5, [0.0] * 5])
    with pytest.raises(InputError, match="asymmetric friction of yaw is 11; it must be within its Coulomb friction, 10"):
        replace(boom.friction, asymmetric=np.array([11.0, 0.0, 0.0, 0.0, 0.0]))
