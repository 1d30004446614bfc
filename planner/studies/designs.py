"""Designs of experiments: the points of a study, in a fixed order set by the study alone."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from boom_model.arrays import Array, read_only
from boom_model.errors import InputError
from planner.studies.extra import required
from planner.studies.factors import Factor
from planner.studies.tables import Value

MOST_SAMPLES = 10_000_000
NOMINAL, DESIGN = "nominal", "design"


class DesignKind(StrEnum):
    """Words for the designs."""

    GRID = "grid"
    """Every combination of the factors' levels."""
    MONTE_CARLO = "monte-carlo"
    LATIN_HYPERCUBE = "latin-hypercube"
    SOBOL = "sobol"
    """Sobol's sequence, scrambled."""
    SOBOL_INDICES = "sobol-indices"
    """Saltelli's radial design on Sobol's sequence, from which Sobol indices are estimated."""


@dataclass(frozen=True, eq=False)
class Design:
    """Points of a study: nominal and one-at-a-time points first, then the points of the design."""

    kind: DesignKind
    factors: tuple[Factor, ...]
    points: tuple[str, ...]
    """What each of the first points is: "nominal", or the factor that is off nominal."""
    coordinates: Array
    """(n, d) coordinates of the factors; see `Factor.at`."""

    @property
    def first(self) -> int:
        """Number of points before those of the design."""
        return len(self.points)

    def __len__(self) -> int:
        return len(self.coordinates)

    def point(self, index: int) -> str:
        """Return what a point is: "nominal", the factor that is off nominal, or "design"."""
        return self.points[index] if index < len(self.points) else DESIGN

    def values(self, index: int) -> tuple[Value, ...]:
        """Return the values of the factors at a point."""
        return tuple(factor.value(x) for factor, x in zip(self.factors, self.coordinates[index], strict=True))


def design(kind: DesignKind, factors: Sequence[Factor], samples: int, seed: int) -> Design:
    """Return the points of a study.

    Args:
        kind: the design.
        factors: the factors.
        samples: number of points of the design; a grid has as many as its levels give, and
            Saltelli's design has (d + 2) times as many for d factors.
        seed: of every random number.

    Raises:
        InputError: too many points, a grid of a factor without levels, or a number of samples that
            is not a power of two where Sobol's sequence needs one.
    """
    d = len(factors)
    if kind in (DesignKind.SOBOL, DesignKind.SOBOL_INDICES) and (samples < 2 or samples & (samples - 1)):
        near = 2 ** max(round(np.log2(max(samples, 2))), 1)
        raise InputError(f"samples is {samples}; the design {kind} needs a power of two, such as {near}")
    count = int(np.prod([len(f.levels) for f in factors], dtype=float)) if kind is DesignKind.GRID else samples
    if kind is DesignKind.SOBOL_INDICES:
        count *= d + 2
    if count > MOST_SAMPLES:
        raise InputError(f"the study has {count:,} samples; at most {MOST_SAMPLES:,} are possible")
    if kind is DesignKind.GRID:
        bare = [factor.name for factor in factors if factor.shape is not None]
        if bare:
            raise InputError(f"factor {bare[0]}: a grid needs values, or low, high and levels")
        grid = np.indices([len(f.levels) for f in factors]).reshape(d, -1).T
        return Design(kind, tuple(factors), (), read_only(grid))
    nominal = np.array([factor.nominal for factor in factors])
    points, rows = [NOMINAL], [nominal]
    for i, factor in enumerate(factors):
        for coordinate in factor.around():
            points.append(factor.name)
            rows.append(np.where(np.arange(d) == i, coordinate, nominal))
    shares = _shares(kind, d, samples, seed)
    drawn = np.stack([factor.at(shares[:, i]) for i, factor in enumerate(factors)], axis=-1)
    return Design(kind, tuple(factors), tuple(points), read_only(np.concatenate([np.stack(rows), drawn])))


def problem(names: Sequence[str]) -> dict[str, object]:
    """Return SALib's description of factors on the unit cube."""
    return {"num_vars": len(names), "names": list(names), "bounds": [[0.0, 1.0]] * len(names)}


def _shares(kind: DesignKind, d: int, samples: int, seed: int) -> Array:
    """Return points (n, d) in the unit cube."""
    from scipy.stats import qmc

    rng = np.random.default_rng(seed)
    if kind is DesignKind.MONTE_CARLO:
        return rng.random((samples, d))
    if kind is DesignKind.LATIN_HYPERCUBE:
        return np.asarray(qmc.LatinHypercube(d, rng=rng).random(samples))
    if kind is DesignKind.SOBOL:
        return np.asarray(qmc.Sobol(d, rng=rng).random(samples))
    saltelli = required("SALib.sample.sobol")
    inside = np.nextafter(1.0, 0.0)
    drawn = saltelli.sample(problem([str(i) for i in range(d)]), samples, calc_second_order=False, seed=seed)
    return np.asarray(np.clip(drawn, 0.0, inside), dtype=float)
