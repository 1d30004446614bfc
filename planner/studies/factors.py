"""Factors of a study: what each changes, and how its values are distributed."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from boom_model.arrays import Array, read_only
from boom_model.errors import InputError
from planner.studies.tables import Value

Shape = Literal["uniform", "normal", "triangular"]


@dataclass(frozen=True)
class Factor:
    """A quantity that a study varies.

    It has either levels, of any type, or a distribution of numbers.
    """

    name: str
    keys: tuple[str, ...]
    """Dotted keys that it sets; () fills the placeholder {name} in the mission."""
    relative: bool
    """Whether its value multiplies the numbers at its keys."""
    levels: tuple[Value, ...] = ()
    shape: Shape | None = None
    low: float = 0.0
    """Lower bound; the mean of a normal distribution."""
    high: float = 0.0
    """Upper bound; the standard deviation of a normal distribution."""
    mode: float = 0.0
    """Most likely value of a triangular distribution."""
    basis: str = "assumed"
    source: str = ""

    def __post_init__(self) -> None:
        if self.shape is None:
            return
        wrong = None
        if not np.isfinite([self.low, self.high, self.mode]).all():
            wrong = "its figures must be finite"
        elif self.shape == "normal" and not self.high > 0.0:
            wrong = f"std is {self.high:g}; it must be above 0"
        elif self.shape != "normal" and not self.low < self.high:
            wrong = f"low is {self.low:g} and high is {self.high:g}; low must be below high"
        elif self.shape == "triangular" and not self.low <= self.mode <= self.high:
            wrong = f"mode is {self.mode:g}; it must be between low, {self.low:g}, and high, {self.high:g}"
        if wrong is not None:
            raise InputError(f"factor {self.name}: {wrong}")

    @property
    def numeric(self) -> bool:
        """Whether all its values are numbers."""
        return self.shape is not None or all(isinstance(v, int | float) and not isinstance(v, bool) for v in self.levels)

    @property
    def _distribution(self) -> Any:
        """Return the distribution; it is not kept, because a factor travels with every chunk."""
        if self.shape == "normal":
            return stats.norm(self.low, self.high)
        width = self.high - self.low
        if self.shape == "uniform":
            return stats.uniform(self.low, width)
        return stats.triang((self.mode - self.low) / width, self.low, width)

    def at(self, share: ArrayLike) -> Array:
        """Return coordinates at shares u of the probability, 0 <= u < 1, in their shape.

        A coordinate is the quantile of the distribution, or the index of a level.
        """
        u = np.asarray(share, dtype=float)
        if self.shape is None:
            return read_only(np.minimum(np.floor(u * len(self.levels)), len(self.levels) - 1))
        return read_only(self._distribution.ppf(u))

    @property
    def nominal(self) -> float:
        """Coordinate of the nominal point: the mean, or the first level."""
        return 0.0 if self.shape is None else float(self._distribution.mean())

    @property
    def deviation(self) -> float:
        """Standard deviation of the distribution; 0 of levels."""
        return 0.0 if self.shape is None else float(self._distribution.std())

    def around(self) -> tuple[float, ...]:
        """Return the coordinates of its one-at-a-time points.

        These are a deviation either way, or every other level.
        """
        if self.shape is None:
            return tuple(float(i) for i in range(1, len(self.levels)))
        return self.nominal - self.deviation, self.nominal + self.deviation

    def value(self, coordinate: float) -> Value:
        """Return the value at a coordinate."""
        return float(coordinate) if self.shape is not None else self.levels[int(coordinate)]

    def shown(self, coordinate: float) -> str:
        """Return the value at a coordinate as text."""
        value = self.value(coordinate)
        return f"{value:.6g}" if isinstance(value, float) else str(value)

    @property
    def law(self) -> str:
        """Distribution in words."""
        times = "times " if self.relative else ""
        if self.shape is None:
            shown = [self.shown(i) for i in range(len(self.levels))]
            few = 6
            return times + (", ".join(shown) if len(shown) <= few else f"{shown[0]} to {shown[-1]} in {len(shown)} levels")
        if self.shape == "normal":
            return f"{times}normal, mean {self.low:g}, std {self.high:g}"
        most_likely = f", mode {self.mode:g}" if self.shape == "triangular" else ""
        return f"{times}{self.shape}, {self.low:g} to {self.high:g}{most_likely}"
