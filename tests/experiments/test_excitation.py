"""Motions designed for identification: better than random ones, within every limit, from rest to
rest."""

from dataclasses import replace

import numpy as np
import pytest

from boom_model import Boom, InputError
from planner import plan
from planner.checks.rows import Verdict
from planner.experiments.excitation import (
    Excitation,
    condition_number,
    design,
    log_information,
    random_excitation,
)
from planner.planning import check_motion

BOOM = Boom.load().with_payload(0.0)
T = np.linspace(0.0, 20.0, 240, endpoint=False)


@pytest.fixture(scope="module")
def designed() -> Excitation:
    return design(BOOM, seed=1, rounds=12)


@pytest.fixture(scope="module")
def random() -> list[Excitation]:
    rng = np.random.default_rng(2)
    return [random_excitation(BOOM, rng) for _ in range(10)]


def test_it_tells_more_than_random_motions_and_the_thesis_move(designed: Excitation, random: list[Excitation]) -> None:
    found = condition_number(BOOM, designed(T))
    assert found < min(condition_number(BOOM, each(T)) for each in random) / 2.0
    assert log_information(BOOM, designed(T)) > max(log_information(BOOM, each(T)) for each in random)
    cubic = plan(BOOM, "transport", "phenotyping", duration=10.0).trajectory
    assert condition_number(BOOM, (cubic.q, cubic.qd, cubic.qdd)) > 100.0 * found


def test_every_limit_is_kept(designed: Excitation, random: list[Excitation]) -> None:
    for motion in (designed, *random):
        assert motion.worst_ratio() <= 1.0
        assert BOOM.limits.contain(motion.trajectory.q).all()
    assert designed.worst_ratio() > 0.95
    move = check_motion(BOOM, designed.trajectory)
    limits = [row for row in move.report.rows if row.check in ("position", "velocity", "acceleration")]
    assert limits
    assert all(row.verdict is not Verdict.FAIL for row in limits)


def test_it_starts_and_ends_at_rest_and_its_rates_are_its_own(designed: Excitation) -> None:
    q, qd, qdd = designed(np.array([0.0, designed.period]))
    np.testing.assert_allclose(q[0], q[1], atol=1e-12)
    np.testing.assert_allclose(qd, 0.0, atol=1e-12)
    np.testing.assert_allclose(qdd, 0.0, atol=1e-12)
    t, h = np.linspace(1.0, 19.0, 50), 1e-5
    low, middle, high = (designed(t + k * h) for k in (-1, 0, 1))
    np.testing.assert_allclose((high[0] - low[0]) / (2.0 * h), middle[1], atol=1e-9)
    np.testing.assert_allclose((high[1] - low[1]) / (2.0 * h), middle[2], atol=1e-9)


def test_the_same_seed_gives_the_same_motion() -> None:
    one, other = (random_excitation(BOOM, np.random.default_rng(3)) for _ in range(2))
    np.testing.assert_array_equal(one.trajectory.q, other.trajectory.q)


def test_too_few_harmonics_are_refused() -> None:
    with pytest.raises(InputError, match="2 harmonics in 20 s: at least 3"):
        design(BOOM, harmonics=2)


def test_motions_of_unequal_links_keep_the_limits_too() -> None:
    unequal = replace(BOOM, geometry=replace(BOOM.geometry, upper_less_lower=2e-3, inner_less_outer=-8e-3))
    random = random_excitation(unequal, np.random.default_rng(4))
    for motion in (random, design(unequal, seed=1, rounds=1)):
        assert motion.worst_ratio() <= 1.0
        assert np.isfinite(condition_number(unequal, motion(T)))
