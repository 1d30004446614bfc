"""Analysis of a study's dataset.

It gives quantiles, the probability of FAIL, first-order propagation, sensitivity indices and the
Pareto front.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from boom_model.arrays import Array, Mask
from boom_model.errors import InputError
from planner.checks.rows import Verdict
from planner.studies.designs import DESIGN, DesignKind, problem
from planner.studies.extra import required
from planner.studies.responses import LABELS, unknown_response
from planner.studies.sample import DONE, INFEASIBLE, REFUSED
from planner.studies.study import Study

CONFIDENCE = 0.95
FAILS = "FAIL"
"""Name of the response that is 1 where a sample FAILs, and 0 elsewhere."""

_LEAST = 32
"""Blocks of Saltelli's design below which no index is estimated."""

_LEAST_GIVEN = 100
"""Samples below which RBD-FAST, with its 10 harmonics, estimates no index."""

_RESAMPLES = 200

_NUMBER = re.compile(r"-?\d[\d.e+-]*")


@dataclass(frozen=True)
class Probability:
    """Share of samples that FAIL, with Wilson's confidence interval."""

    fails: int
    samples: int
    """Samples with an answer."""
    low: float
    high: float

    @property
    def estimate(self) -> float:
        """Share of the samples that FAIL."""
        return self.fails / self.samples

    @staticmethod
    def of(fails: int, samples: int) -> "Probability | None":
        """Return the probability; None without samples.

        The interval takes the samples as independent; those of a Latin hypercube or of Sobol's
        sequence spread more evenly, so for them it is on the safe side.
        """
        if samples == 0:
            return None
        from scipy.stats import binomtest

        interval = binomtest(fails, samples).proportion_ci(CONFIDENCE, method="wilson")
        return Probability(fails, samples, float(interval.low), float(interval.high))


@dataclass(frozen=True)
class Index:
    """Sobol indices of one factor, with the half widths of their confidence intervals."""

    factor: str
    first: float
    first_error: float
    total: float | None
    """None where the design gives first-order indices only."""
    total_error: float | None

    @property
    def rank(self) -> float:
        """The total index, or the first-order one."""
        return self.first if self.total is None else self.total


@dataclass(frozen=True)
class Swing:
    """A response where one factor is off nominal."""

    factor: str
    low: float
    """Least value of the factor's one-at-a-time points."""
    high: float
    share: float | None
    """Its share of the first-order variance; None of a factor with levels."""


@dataclass(frozen=True)
class ResponseSummary:
    """Distribution of a response over the samples of the design, and what decides it."""

    name: str
    nominal: float | None
    quantiles: tuple[float, float, float]
    """5 %, 50 % and 95 %."""
    mean: float
    deviation: float
    first_order: float | None
    """Standard deviation by first-order propagation; None where a factor has levels."""
    swings: tuple[Swing, ...]
    indices: tuple[Index, ...]
    """The factor that decides first."""


@dataclass(frozen=True)
class Boundary:
    """How far a factor can go."""

    others: tuple[str, ...]
    """Levels of the other factors."""
    largest: float | None
    """Largest level up to which no sample FAILs; None if the smallest does."""
    then: str | None
    """What ends the way: the tightest limit of the next level, or why it has no motion."""


class Results:
    """A dataset with its study."""

    def __init__(self, study: Study, path: str | Path) -> None:
        """Read what every analysis needs of a dataset; other columns are read when asked for."""
        import pyarrow.parquet as pq

        self.study = study
        self._file = pq.ParquetFile(path)
        self._columns: dict[str, Any] = {}
        self.names = tuple(self._file.schema_arrow.names)

    def column(self, name: str) -> Any:
        """Return a column as an array over all points: numbers (NaN where missing) or objects.

        Raises:
            InputError: there is no such column; suggests the nearest.
        """
        import pyarrow as pa

        if name not in self.names:
            raise unknown_response(name, self.names)
        if name not in self._columns:
            column = self._file.read([name])[name]
            numeric = pa.types.is_floating(column.type) or pa.types.is_integer(column.type)
            self._columns[name] = (
                column.cast(pa.float64()).to_numpy() if numeric else np.array(column.to_pylist(), dtype=object)
            )
        return self._columns[name]

    def numbers(self, name: str) -> Array:
        """Return a response over all points; NaN where a sample has none.

        FAILS is 1 where a sample FAILs, NaN where it was refused.

        Raises:
            InputError: there is no such column, or it holds no numbers.
        """
        if name == FAILS:
            return np.where(self.refused, np.nan, (self.column("verdict") == str(Verdict.FAIL)).astype(float))
        if name not in self.names and (name in LABELS or not (self.column("status") == DONE).any()):
            return np.full(len(self.refused), np.nan)
        values = self.column(name)
        if values.dtype == object:
            raise InputError(f"response {name}: it is not a number")
        return np.asarray(values, dtype=float)

    @cached_property
    def refused(self) -> Mask:
        """Which points make no boom, drive or mission."""
        return np.asarray(self.column("status") == REFUSED)

    @cached_property
    def infeasible(self) -> Mask:
        """Which points have no motion; they FAIL."""
        return np.asarray(self.column("status") == INFEASIBLE)

    @cached_property
    def drawn(self) -> Mask:
        """Which points are a sample of the factors' distributions.

        Of Saltelli's design, these are the points of its two base samples.
        """
        drawn = np.asarray(self.column("point") == DESIGN)
        if self.study.design.kind is DesignKind.SOBOL_INDICES:
            block = len(self.study.design.factors) + 2
            place = (np.arange(len(drawn)) - self.study.design.first) % block
            drawn &= (place == 0) | (place == block - 1)
        return drawn

    def fails(self, where: Mask | None = None) -> Probability | None:
        """Return the probability of FAIL over all or some of the drawn samples with an answer."""
        chosen = self.drawn & ~self.refused
        if where is not None:
            chosen = chosen & where
        return Probability.of(int(np.nansum(self.numbers(FAILS)[chosen])), int(chosen.sum()))

    def by_level(self) -> tuple[tuple[str, str, Probability | None], ...]:
        """Return the probability of FAIL for each level of each factor that has levels."""
        found = []
        for i, factor in enumerate(self.study.design.factors):
            for k in range(len(factor.levels)):
                found.append((factor.name, factor.shown(k), self.fails(self.study.design.coordinates[:, i] == k)))
        return tuple(found)

    def by_combination(self) -> tuple[tuple[tuple[str, ...], Probability], ...]:
        """Return the probability of FAIL for each combination of levels.

        Return () where at most one factor has levels.
        """
        leveled = [i for i, factor in enumerate(self.study.design.factors) if len(factor.levels) > 1]
        if len(leveled) < 2:
            return ()
        coordinates = self.study.design.coordinates[:, leveled]
        found = []
        for combination in np.unique(coordinates, axis=0):
            each = self.fails((coordinates == combination).all(axis=1))
            shown = (self.study.design.factors[i].shown(x) for i, x in zip(leveled, combination, strict=True))
            if each is not None:
                found.append((tuple(shown), each))
        return tuple(found)

    def boundary(self) -> tuple[Boundary, ...]:
        """Return how far the study's bounded factor can go before a sample FAILs.

        There is one answer for each combination of the other factors. Levels are taken in ascending
        order. A refused sample ends the way too. () without such a factor.
        """
        study = self.study
        if study.boundary is None:
            return ()
        names = [factor.name for factor in study.design.factors]
        b = names.index(study.boundary)
        others = [i for i in range(len(names)) if i != b]
        factor, coordinates = study.design.factors[b], study.design.coordinates
        fails, tightest, reason = self.numbers(FAILS), self.column("tightest"), self.column("reason")
        sizes = np.array([float(level) for level in factor.levels])
        found = []
        for combination in np.unique(coordinates[:, others], axis=0):
            mine = np.flatnonzero((coordinates[:, others] == combination).all(axis=1))
            mine = mine[np.argsort(sizes[coordinates[mine, b].astype(int)], kind="stable")]
            bad = np.flatnonzero(fails[mine] != 0.0)
            good = mine if not len(bad) else mine[: bad[0]]
            then = None if not len(bad) else str(tightest[mine[bad[0]]] or reason[mine[bad[0]]])
            largest = float(sizes[int(coordinates[good[-1], b])]) if len(good) else None
            shown = tuple(study.design.factors[i].shown(x) for i, x in zip(others, combination, strict=True))
            found.append(Boundary(shown, largest, then))
        return tuple(found)

    def tightest(self) -> tuple[tuple[str, int], ...]:
        """Return the rows that use most of their limit, and in how many drawn samples.

        The most frequent is first.
        """
        names = [name for name in self.column("tightest")[self.drawn] if name is not None]
        counts = {name: names.count(name) for name in dict.fromkeys(names)}
        return tuple(sorted(counts.items(), key=lambda pair: -pair[1]))

    def reasons(self, status: str) -> tuple[tuple[str, int], ...]:
        """Return the reasons of refused or infeasible points, and how many points have each.

        The most frequent is first. Reasons that differ in numbers alone are one: that of the first
        point.
        """
        counts: dict[str, tuple[str, int]] = {}
        for reason in self.column("reason")[self.column("status") == status]:
            alike = _NUMBER.sub("#", reason)
            first, count = counts.get(alike, (reason, 0))
            counts[alike] = first, count + 1
        return tuple(sorted(counts.values(), key=lambda pair: -pair[1]))

    def summary(self, name: str) -> ResponseSummary | None:
        """Return what the samples say of a response; None where no sample has it.

        Raises:
            InputError: there is no such response.
        """
        values = self.numbers(name)
        drawn = values[self.drawn]
        drawn = drawn[np.isfinite(drawn)]
        if not len(drawn):
            return None
        swings, first_order = self._swings(values)
        has_nominal = self.study.design.first > 0 and np.isfinite(values[0])
        return ResponseSummary(
            name=name,
            nominal=float(values[0]) if has_nominal else None,
            quantiles=tuple(float(q) for q in np.quantile(drawn, (0.05, 0.5, 0.95))),  # type: ignore[arg-type]
            mean=float(drawn.mean()),
            deviation=float(drawn.std(ddof=1)) if len(drawn) > 1 else 0.0,
            first_order=first_order,
            swings=swings,
            indices=self.indices(name),
        )

    def _swings(self, values: Array) -> tuple[tuple[Swing, ...], float | None]:
        """Return each factor's swing, the widest first, and the first-order standard deviation.

            sd^2 = sum_i ((y(m + s_i) - y(m - s_i)) / 2)^2

        with m the means and s_i the standard deviation of factor i alone (the central difference
        over two deviations, times the deviation).
        """
        design = self.study.design
        points = np.array(design.points, dtype=object)
        parts: dict[str, float] = {}
        ends: dict[str, tuple[float, float]] = {}
        for factor in design.factors:
            own = values[: design.first][points == factor.name]
            if not len(own) or not np.isfinite(own).all():
                continue
            around = np.append(own, values[0]) if factor.shape is None else own
            ends[factor.name] = float(around.min()), float(around.max())
            if factor.shape is not None:
                parts[factor.name] = float((own[1] - own[0]) / 2.0) ** 2
        total = sum(parts.values())
        swings = [
            Swing(name, *end, parts[name] / total if name in parts and total > 0.0 else None) for name, end in ends.items()
        ]
        swings.sort(key=lambda swing: swing.low - swing.high)
        return tuple(swings), float(np.sqrt(total)) if parts and len(parts) == len(design.factors) else None

    def indices(self, name: str) -> tuple[Index, ...]:
        """Return the Sobol indices of a response, the factor that decides first.

        They are total and first-order ones by SALib's estimators from Saltelli's design, where
        blocks with a missing value are left out; first-order ones of the factors with a
        distribution, by RBD-FAST, from any other random design. A grid has every combination, so
        its shares of the variance are exact. () where there are too few samples, or where the
        response does not vary.
        """
        design = self.study.design
        values = self.numbers(name)[design.first :]
        if design.kind is DesignKind.SOBOL_INDICES:
            found = self._saltelli(values)
        elif design.kind is DesignKind.GRID:
            found = self._factorial(values)
        else:
            found = self._given_data(values)
        return tuple(sorted(found, key=lambda index: -index.rank))

    def _saltelli(self, values: Array) -> list[Index]:
        names = [factor.name for factor in self.study.design.factors]
        blocks = values.reshape(-1, len(names) + 2)
        whole = blocks[np.isfinite(blocks).all(axis=1)]
        if len(whole) < _LEAST or np.ptp(whole) == 0.0:
            return []
        found = required("SALib.analyze.sobol").analyze(
            problem(names),
            whole.ravel(),
            calc_second_order=False,
            num_resamples=_RESAMPLES,
            conf_level=CONFIDENCE,
            seed=self.study.seed,
        )
        columns = (found[key] for key in ("S1", "S1_conf", "ST", "ST_conf"))
        return [Index(name, *map(float, row)) for name, *row in zip(names, *columns, strict=True)]

    def _factorial(self, values: Array) -> list[Index]:
        """Return shares of the variance over a grid.

        first = 1 - SS(y - mean of y at the factor's level) / SS(y - mean of y)
        total = SS(y - mean of y at the other factors' levels) / SS(y - mean of y)

        Where combinations have no value, levels are left out until the rest is a whole grid: each
        time the level with the largest share of them.
        """
        y, levels = values, self.study.design.coordinates
        while not np.isfinite(y).all():
            slabs = [levels[:, i] == level for i in range(levels.shape[1]) for level in np.unique(levels[:, i])]
            worst = max(slabs, key=lambda slab: float(np.isnan(y[slab]).mean()))
            y, levels = y[~worst], levels[~worst]
        if not len(y) or np.ptp(y) == 0.0:
            return []
        whole = _spread(y, np.zeros((len(y), 1)))
        return [
            Index(
                factor.name,
                max(1.0 - _spread(y, levels[:, [i]]) / whole, 0.0),
                0.0,
                _spread(y, np.delete(levels, i, axis=1)) / whole,
                0.0,
            )
            for i, factor in enumerate(self.study.design.factors)
            if len(factor.levels) > 1
        ]

    def _given_data(self, values: Array) -> list[Index]:
        design = self.study.design
        which = [i for i, factor in enumerate(design.factors) if factor.shape is not None]
        known = np.isfinite(values)
        if known.sum() < _LEAST_GIVEN or np.ptp(values[known]) == 0.0 or not which:
            return []
        names = [design.factors[i].name for i in which]
        X = np.asarray(design.coordinates[design.first :][known][:, which])
        found = required("SALib.analyze.rbd_fast").analyze(
            problem(names), X, values[known], num_resamples=_RESAMPLES, conf_level=CONFIDENCE, seed=self.study.seed
        )
        pairs = zip(names, found["S1"], found["S1_conf"], strict=True)
        return [Index(name, float(first), float(error), None, None) for name, first, error in pairs]

    def front(self, names: Sequence[str]) -> Array:
        """Return the points (k,) of the Pareto front that minimises responses.

        Points that FAIL are left out. Of points with equal responses, the first stays.

        Raises:
            InputError: there is no such response.
        """
        table = np.stack([self.numbers(name) for name in names], axis=-1)
        able = np.flatnonzero(np.isfinite(table).all(axis=1) & (self.numbers(FAILS) == 0.0))
        order = able[np.lexsort(table[able].T[::-1])]
        kept: list[int] = []
        for i in order:  # lexicographic order: only points before it can dominate a point
            if not kept or not (table[kept] <= table[i]).all(axis=1).any():
                kept.append(int(i))
        return np.array(kept, dtype=int)


def _spread(y: Array, keys: Array) -> float:
    """Return the sum of squares of y (n,) about the means of its groups of equal keys (n, k)."""
    group = np.unique(keys, axis=0, return_inverse=True)[1].ravel()
    means = np.bincount(group, weights=y) / np.bincount(group)
    return float(((y - means[group]) ** 2).sum())
