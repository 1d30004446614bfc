"""How a path is travelled in time: s(t), and the motion that it gives."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array
from planner.path import Path

if TYPE_CHECKING:
    from scipy.interpolate import PPoly


@dataclass(frozen=True, eq=False)
class TimeLaw:
    """s(t) from 0 to 1, a piecewise polynomial from rest to rest."""

    s: "PPoly"
    jerk_limited: bool = False
    """Whether the acceleration is continuous and the jerk was held to a limit."""

    @property
    def duration(self) -> float:
        return float(self.s.x[-1])

    def stretched(self, factor: float) -> "TimeLaw":
        """The same law, slower by `factor`: s(t / factor)."""
        powers = np.arange(len(self.s.c) - 1, -1, -1.0)[:, None]
        return replace(self, s=type(self.s)(self.s.c / factor**powers, self.s.x * factor))

    @staticmethod
    def from_pieces(durations: ArrayLike, coefficients: ArrayLike, jerk_limited: bool = False) -> "TimeLaw":
        """A law from the duration of each piece and its coefficients, highest power first, shape (powers, pieces).

        Pieces of no duration are left out.
        """
        from scipy.interpolate import PPoly  # a third of a second, which `boom ik` does not need

        durations, coefficients = np.asarray(durations, dtype=float), np.asarray(coefficients, dtype=float)
        kept = durations > 0.0
        breaks = np.concatenate([[0.0], np.cumsum(durations[kept])])
        return TimeLaw(PPoly(coefficients[:, kept], breaks), jerk_limited)


@dataclass(frozen=True, eq=False)
class Motion:
    """A path travelled by a time law."""

    path: Path
    law: TimeLaw

    @property
    def duration(self) -> float:
        return self.law.duration

    def __call__(self, t: ArrayLike) -> tuple[Array, Array, Array, Array]:
        """q, qd, qdd and qddd at the times t, each (..., 5), by the chain rule; t outside the move is clipped to it.

        qd = p' s',  qdd = p'' s'^2 + p' s'',  qddd = p''' s'^3 + 3 p'' s' s'' + p' s'''.
        """
        inside = np.clip(np.asarray(t, dtype=float), 0.0, self.duration)
        s, v, a, j = (np.asarray(self.law.s(inside, order)) for order in range(4))
        s = np.clip(s, 0.0, 1.0)
        p = [self.path(s, order) for order in range(4)]
        v, a, j = v[..., None], a[..., None], j[..., None]
        return p[0], p[1] * v, p[2] * v**2 + p[1] * a, p[3] * v**3 + 3.0 * p[2] * v * a + p[1] * j
