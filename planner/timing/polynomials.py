"""Piecewise polynomials of one variable."""

from dataclasses import dataclass
from math import perm

import numpy as np
from numpy.typing import ArrayLike, NDArray

from boom_model.arrays import Array


@dataclass(frozen=True, eq=False)
class Polynomials:
    """Polynomials between breaks, evaluated as SciPy's `PPoly`.

    Importing that takes longer than planning a move.

    p(t) = sum_k c[k] (t - x[i])^(powers - 1 - k)  for x[i] <= t < x[i + 1]
    """

    c: Array
    """(powers, pieces) coefficients, highest power first."""
    x: Array
    """(pieces + 1,) ascending breaks. The outer pieces continue beyond the ends."""

    def __call__(self, t: ArrayLike, order: int = 0) -> Array:
        """Return the derivative of the given order at t, in its shape."""
        return self._evaluated(*self._placed(t), order)

    def derivatives(self, t: ArrayLike, highest: int) -> tuple[Array, ...]:
        """Return the derivatives of orders 0 to `highest` at t, each in its shape."""
        placed = self._placed(t)
        return tuple(self._evaluated(*placed, order) for order in range(highest + 1))

    def antiderivative(self) -> "Polynomials":
        """Return the integral from the first break on."""
        from scipy.interpolate import PPoly

        integral = PPoly(self.c, self.x).antiderivative()
        return Polynomials(integral.c, integral.x)

    def solve(self, value: float) -> Array:
        """Return the places within the breaks at which the polynomials take a value."""
        from scipy.interpolate import PPoly

        return np.asarray(PPoly(self.c, self.x).solve(value, extrapolate=False))

    def _placed(self, t: ArrayLike) -> tuple[Array, NDArray[np.intp]]:
        """Return t less the start of its piece, and the index of the piece."""
        t = np.asarray(t, dtype=float)
        piece = np.searchsorted(self.x[1:-1], t, side="right")
        return t - self.x[piece], piece

    def _evaluated(self, along: Array, piece: NDArray[np.intp], order: int) -> Array:
        if order >= len(self.c):
            return np.zeros(along.shape)
        total, power = self.c[-1 - order][piece] * float(perm(order, order)), along
        for k in range(order + 1, len(self.c)):  # in SciPy's order, to its last bit
            total = total + self.c[-1 - k][piece] * power * float(perm(k, order))
            power = power * along
        return np.asarray(total)
