"""Sensitivity, probability, propagation and Pareto front against functions and integrals that are
known exactly."""

import numpy as np
import pytest
from scipy.stats import norm

from boom_model import InputError
from planner.studies.analysis import FAILS
from planner.studies.designs import DesignKind
from planner.studies.factors import Factor
from planner.studies.report import front_rows, notes, response_rows, to_json, told
from tests.studies.helpers import normal, results_of, uniform

G = np.array([0.0, 1.0, 4.5, 9.0])


def sobol_g(x):
    return np.prod((np.abs(4.0 * x - 2.0) + G) / (1.0 + G), axis=-1)


def g_indices():
    """First and total indices of Sobol's g-function: V_i = 1 / (3 (1 + a_i)^2), V = prod(1 + V_i) -
    1."""
    parts = 1.0 / (3.0 * (1.0 + G) ** 2)
    whole = np.prod(1.0 + parts) - 1.0
    return parts / whole, np.array([p * np.prod(1.0 + np.delete(parts, i)) for i, p in enumerate(parts)]) / whole


def ishigami(x):
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def ishigami_indices():
    """Ishigami and Homma's closed form for a = 7, b = 0.1."""
    a, b = 7.0, 0.1
    first = np.array([0.5 * (1.0 + b * np.pi**4 / 5.0) ** 2, a**2 / 8.0, 0.0])
    both = 8.0 * b**2 * np.pi**8 / 225.0
    whole = first.sum() + both
    return first / whole, (first + np.array([both, 0.0, both])) / whole


CASES = {
    "g": (sobol_g, [uniform(f"x{i}", 0.0, 1.0) for i in range(4)], g_indices()),
    "ishigami": (ishigami, [uniform(f"x{i}", -np.pi, np.pi) for i in range(3)], ishigami_indices()),
}


@pytest.mark.parametrize("name", CASES)
def test_sobol_indices_are_the_closed_form_ones_within_their_errors(tmp_path, name):
    function, factors, (first, total) = CASES[name]
    found = results_of(tmp_path, function, factors, DesignKind.SOBOL_INDICES, 2048).indices("y")
    assert [index.rank for index in found] == sorted((index.rank for index in found), reverse=True)
    for index in found:
        i = int(index.factor[1:])
        assert abs(index.first - first[i]) <= index.first_error + 1e-9, index
        assert abs(index.total - total[i]) <= index.total_error + 1e-9, index
        assert index.total_error < 0.1
        assert index.first_error < 0.12


def test_a_grid_gives_exact_shares_of_the_variance(tmp_path):
    """Of y = a + 2 b + a b on levels a = -1, 1 and b = -1, 0, 1: variances 1, 8/3 and 2/3."""
    factors = [
        Factor("a", (), False, levels=(-1.0, 1.0)),
        Factor("b", (), False, levels=(-1.0, 0.0, 1.0)),
        Factor("c", (), False, levels=("only",)),
    ]
    parts = np.array([1.0, 8.0 / 3.0, 2.0 / 3.0])
    made = results_of(
        tmp_path, lambda x: (2 * x[:, 0] - 1) + (x[:, 1] - 1) * (2 + (2 * x[:, 0] - 1)), factors, DesignKind.GRID, 1
    )
    b, a = made.indices("y")
    assert (a.factor, b.factor) == ("a", "b")
    whole = parts.sum()
    np.testing.assert_allclose([a.first, b.first], parts[:2] / whole, rtol=1e-12)
    np.testing.assert_allclose([a.total, b.total], (parts[:2] + parts[2]) / whole, rtol=1e-12)
    fourth = [*factors, Factor("d", (), False, levels=(0.0, 1.0))]
    gaps = results_of(  # without a value at most combinations with d = 1
        tmp_path,
        lambda x: (2 * x[:, 0] - 1) + (x[:, 1] - 1) * (2 + (2 * x[:, 0] - 1)),
        fourth,
        DesignKind.GRID,
        1,
        refused=[1, 3, 5, 7],
    )
    shares = {index.factor: (index.first, index.total) for index in gaps.indices("y")}
    assert shares["a"] == pytest.approx((a.first, a.total))
    assert shares["b"] == pytest.approx((b.first, b.total))
    assert shares["d"] == pytest.approx((0.0, 0.0))
    assert told(("a", "b"), [("-", "1"), ("-", "-")]) == (("b",), [("1",), ("-",)])


def test_given_data_gives_first_order_indices_of_any_random_design(tmp_path):
    function, factors, (first, _) = CASES["ishigami"]
    found = results_of(tmp_path, function, factors, DesignKind.LATIN_HYPERCUBE, 4000).indices("y")
    for index in found:
        assert index.total is None
        assert index.first == pytest.approx(first[int(index.factor[1:])], abs=0.03)


def test_blocks_with_refused_samples_are_left_out_of_the_indices(tmp_path):
    function, factors, (first, _) = CASES["g"]
    found = results_of(tmp_path, function, factors, DesignKind.SOBOL_INDICES, 1024, refused=list(range(40, 900, 7)))
    assert found.refused.sum() == len(range(40, 900, 7))
    for index in found.indices("y"):
        assert abs(index.first - first[int(index.factor[1:])]) <= 1.5 * index.first_error


def test_the_probability_of_fail_of_a_linear_case_is_the_normal_one(tmp_path):
    factors = [normal("a", 1.0, 0.3), normal("b", -2.0, 0.4)]
    mean, deviation = 2.0 * 1.0 + 3.0 * -2.0, np.hypot(2.0 * 0.3, 3.0 * 0.4)
    for bound in (-4.0, -3.0, -2.0):
        exact = norm.sf((bound - mean) / deviation)
        sobol = results_of(tmp_path, lambda x: x @ [2.0, 3.0], factors, DesignKind.SOBOL, 4096, fail_above=bound)
        assert sobol.fails().estimate == pytest.approx(exact, abs=3e-3)


def test_the_interval_of_a_probability_covers_it_as_often_as_it_says(tmp_path):
    factors, exact, covered, estimates = [normal("a", 0.0, 1.0)], norm.sf(1.2), 0, []
    for seed in range(300):
        made = results_of(tmp_path, lambda x: x[:, 0], factors, DesignKind.MONTE_CARLO, 400, fail_above=1.2, seed=seed)
        found = made.fails()
        covered += found.low <= exact <= found.high
        estimates.append(found.estimate)
    assert 0.92 < covered / 300 < 0.98  # 95 % +- 2.4 standard deviations
    assert np.mean(estimates) == pytest.approx(exact, abs=3.0 * np.sqrt(exact * (1.0 - exact) / 400 / 300))


def test_refused_samples_are_in_no_probability(tmp_path):
    factors = [uniform("a", 0.0, 1.0)]
    made = results_of(
        tmp_path, lambda x: x[:, 0], factors, DesignKind.LATIN_HYPERCUBE, 100, fail_above=0.5, refused=[10, 11, 12]
    )
    assert made.fails().samples == 97
    assert made.reasons("refused") == (("the mass is -10.5e-3 kg", 3),)
    assert "3 refused, such as: the mass is -10.5e-3 kg" in notes(made)


def test_first_order_propagation_is_exact_where_the_response_is_linear(tmp_path):
    factors = [normal("a", 1.0, 0.3), uniform("b", 0.0, 2.0)]
    found = results_of(tmp_path, lambda x: x @ [2.0, 3.0], factors, DesignKind.MONTE_CARLO, 20_000).summary("y")
    exact = np.hypot(2.0 * 0.3, 3.0 * 2.0 / np.sqrt(12.0))
    assert found.first_order == pytest.approx(exact, rel=1e-12)
    assert found.deviation == pytest.approx(exact, rel=0.02)
    assert found.nominal == pytest.approx(5.0)
    assert [swing.factor for swing in found.swings] == ["b", "a"]
    assert sum(swing.share for swing in found.swings) == pytest.approx(1.0)


def test_quantiles_are_those_of_the_distribution(tmp_path):
    found = results_of(tmp_path, lambda x: x[:, 0], [normal("a", 0.0, 1.0)], DesignKind.SOBOL, 4096).summary("y")
    np.testing.assert_allclose(found.quantiles, norm.ppf([0.05, 0.5, 0.95]), atol=5e-3)


def test_the_front_is_what_no_other_point_dominates(tmp_path):
    rng = np.random.default_rng(11)
    factors = [Factor("a", (), False, levels=tuple(float(i) for i in range(200)))]
    more = {"p": rng.integers(0, 20, 200).astype(float), "q": rng.random(200)}
    made = results_of(
        tmp_path, lambda x: x[:, 0] % 5.0, factors, DesignKind.GRID, 1, fail_above=3.5, pareto=("p", "q"), more=more
    )
    front = set(made.front(("p", "q")).tolist())
    able = [i for i in range(200) if i % 5 <= 3.5]
    table = np.stack([more["p"], more["q"]], axis=-1)

    def dominated(i):
        return any((table[k] <= table[i]).all() and (table[k] < table[i]).any() for k in able)

    assert front == {i for i in able if not dominated(i)}


def test_the_boundary_is_the_last_level_before_the_first_fail(tmp_path):
    factors = [Factor("reach", (), False, levels=(1.0, 2.0)), Factor("load", (), False, levels=(30.0, 0.0, 10.0, 20.0))]
    loads, reaches = np.array([30.0, 0.0, 10.0, 20.0]), np.array([1.0, 2.0])
    made = results_of(
        tmp_path,
        lambda x: loads[x[:, 1].astype(int)] * reaches[x[:, 0].astype(int)],
        factors,
        DesignKind.GRID,
        1,
        fail_above=25.0,
        boundary="load",
    )
    assert [(each.others, each.largest, each.then) for each in made.boundary()] == [(("1",), 20.0, "y"), (("2",), 10.0, "y")]


def test_a_response_that_never_varies_has_no_indices(tmp_path):
    made = results_of(tmp_path, lambda x: 0.0 * x[:, 0], [uniform("a", 0.0, 1.0)], DesignKind.SOBOL_INDICES, 64)
    assert made.indices("y") == () == made.indices(FAILS)


def test_an_unknown_response_is_named_with_the_nearest(tmp_path):
    made = results_of(tmp_path, lambda x: x[:, 0], [uniform("a", 0.0, 1.0)], DesignKind.SOBOL, 8)
    with pytest.raises(InputError, match="unknown response 'statu'; did you mean status"):
        made.summary("statu")


def test_people_read_units_and_files_hold_si(tmp_path):
    factors = [Factor("a", (), False, levels=(0.0, 1.0, 2.0)), Factor("word", (), False, levels=("only",))]
    energy = {"energy_J": np.array([7200.0, 3600.0, 10_800.0])}
    pareto = ("y", "energy_J")
    made = results_of(tmp_path, lambda x: x[:, 0], factors, DesignKind.GRID, 1, pareto=pareto, more=energy)
    assert front_rows(made) == (("y", "energy [Wh]", "a"), [("0", "2", "0"), ("1", "1", "1")])
    assert to_json(made, {})["pareto"] == [{"y": 0.0, "energy_J": 7200.0, "a": 0.0}, {"y": 1.0, "energy_J": 3600.0, "a": 1.0}]
    found = made.summary("energy_J")
    assert (found.name, found.quantiles[1]) == ("energy_J", 7200.0)
    assert response_rows([found])[0][:4] == ("energy [Wh]", "-", "1.1", "2")
