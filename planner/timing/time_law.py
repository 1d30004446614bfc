"""Time laws s(t), and motions: a path with a time law."""

from dataclasses import dataclass, replace
from math import comb, factorial

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array
from planner.paths.path import Path
from planner.timing.polynomials import Polynomials

_BESIDE = 1e-9  # of the duration; distance from a knot of the path of the times on either side of it
_BETWEEN = 32  # smallest number of steps between two knots of the path
_LEFT_OF = 1e-12  # of a piece; distance from its end of the last time in it


@dataclass(frozen=True, eq=False)
class TimeLaw:
    """Piecewise polynomial s(t) from 0 to 1, from rest to rest."""

    s: Polynomials
    jerk_limited: bool = False
    """Whether the acceleration is continuous and the jerk respects a limit."""
    iterations: int = 1
    """Number of solves by which the law was found."""
    residual: float = 0.0
    """Largest change that one more solve could make, relative to a limit."""

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return float(self.s.x[-1])

    def stretched(self, factor: float) -> "TimeLaw":
        """Return the law with its duration multiplied by `factor`: s(t / factor)."""
        powers = np.arange(len(self.s.c) - 1, -1, -1.0)[:, None]
        return replace(self, s=Polynomials(self.s.c / factor**powers, self.s.x * factor))

    def times(self, each: int) -> Array:
        """Return `each` equally spaced times in every piece.

        The first is the start of the piece and the last is just before its end, so that a jump
        between two pieces is sampled on both sides.
        """
        start, length = self.s.x[:-1, None], np.diff(self.s.x)[:, None]
        inside: Array = start + length * np.linspace(0.0, 1.0 - _LEFT_OF, each)
        return np.append(inside.ravel(), self.duration)

    def after(self, at: float) -> "TimeLaw":
        """Return the rest of the law from the time `at` on."""
        breaks = np.append(at, self.s.x[self.s.x > at])
        return replace(self, s=Polynomials(self.on(breaks), breaks - at))

    def on(self, breaks: Array) -> Array:
        """Return the coefficients (powers, pieces) of the law between other breaks.

        These must include the law's own breaks. The law is at rest after its end.
        """
        pieces = np.searchsorted(self.s.x, breaks[:-1], side="right") - 1
        over = pieces >= len(self.s.x) - 1
        pieces = np.where(over, 0, pieces)
        coefficients = _moved(self.s.c[:, pieces], breaks[:-1] - self.s.x[pieces])
        rest = np.zeros((len(coefficients), 1))
        rest[-1] = self.s(self.duration)
        return np.where(over, rest, coefficients)

    def averaged(self, width: float) -> "TimeLaw":
        """Return the moving average of the law, (1/w) integral of s from t - w to t.

        It lasts `width` seconds longer, from rest to rest, and its largest speed is not higher. Its
        acceleration is continuous and 0 at both ends. Its jerk is at most the largest difference of
        the law's accelerations, divided by the width.
        """
        breaks = np.union1d(self.s.x, self.s.x + width)
        kept = np.append(True, np.diff(breaks) > _LEFT_OF * breaks[-1])
        breaks = breaks[kept]
        middle, step = (breaks[:-1] + breaks[1:]) / 2.0, np.diff(breaks)
        integral = self.s.antiderivative()
        order = len(integral.c)
        coefficients = np.zeros((order, len(step)))
        for shift, sign in ((0.0, 1.0), (width, -1.0)):
            at = middle - shift
            inside = np.clip(at, 0.0, self.duration)
            running = (at > 0.0) & (at < self.duration)
            values = integral.derivatives(inside, order - 1)
            taylor = np.array([np.where(running, value, 0.0) / factorial(k) for k, value in enumerate(values)])
            after = at >= self.duration
            taylor[0] += np.where(after, float(integral(self.duration)) + at - self.duration, 0.0)
            taylor[1] += after
            coefficients += sign / width * taylor[::-1]
        pieces = _moved(coefficients, -step / 2.0)
        return replace(self, s=Polynomials(pieces, breaks), jerk_limited=True)

    @staticmethod
    def from_pieces(durations: ArrayLike, coefficients: ArrayLike, jerk_limited: bool = False) -> "TimeLaw":
        """Return the law with given durations and coefficients of its pieces.

        Pieces of zero duration are left out.

        Args:
            durations: (pieces,) [s].
            coefficients: (powers, pieces), highest power first.
            jerk_limited: see the field.
        """
        durations, coefficients = np.asarray(durations, dtype=float), np.asarray(coefficients, dtype=float)
        kept = durations > 0.0
        breaks = np.concatenate([[0.0], np.cumsum(durations[kept])])
        return TimeLaw(Polynomials(coefficients[:, kept], breaks), jerk_limited)


def _moved(coefficients: Array, by: Array) -> Array:
    """Return polynomials (powers, pieces), highest power first, with origins moved by (pieces,)."""
    order = len(coefficients)
    moved = np.zeros_like(coefficients)
    for power in range(order):
        for low in range(power + 1):
            moved[order - 1 - low] += coefficients[order - 1 - power] * comb(power, low) * by ** (power - low)
    return moved


@dataclass(frozen=True, eq=False)
class Motion:
    """Path with a time law."""

    path: Path
    law: TimeLaw

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return self.law.duration

    def times(self, samples: int) -> Array:
        """Return at least `samples` times, equally spaced in each piece of the law.

        They include both sides of each break of the law and of each knot of the path, and several
        times between any two knots.
        """
        t = self.law.times(max(3, -(-samples // (len(self.law.s.x) - 1))))
        passed = [self.law.s.solve(knot) for knot in self.path.knots]
        if not passed:
            return t
        at = np.concatenate(passed)
        at = np.sort(at[np.isfinite(at)])
        beside = np.concatenate([at - _BESIDE * self.duration, at + _BESIDE * self.duration])
        between = np.linspace(np.append(0.0, at), np.append(at, self.duration), _BETWEEN + 1)
        return np.sort(np.concatenate([t, np.clip(beside, 0.0, self.duration), between.ravel()]))

    def __call__(self, t: ArrayLike) -> tuple[Array, Array, Array, Array]:
        """Return q, qd, qdd and qddd at times t, each (..., 5).

            qd = p' s',  qdd = p'' s'^2 + p' s'',  qddd = p''' s'^3 + 3 p'' s' s'' + p' s'''

        Times outside the motion are clipped to it.
        """
        inside = np.clip(np.asarray(t, dtype=float), 0.0, self.duration)
        s, v, a, j = self.law.s.derivatives(inside, 3)
        s, v = np.clip(s, 0.0, 1.0), np.maximum(v, 0.0)  # s never decreases except by rounding, which would reverse friction
        # A joint is one run of numbers in memory: NumPy is slow on many rows of five.
        p0, p1, p2, p3 = (np.moveaxis(self.path(s, order), -1, 0) for order in range(4))
        states = p0, p1 * v, p2 * v**2 + p1 * a, p3 * v**3 + 3.0 * p2 * v * a + p1 * j
        q, qd, qdd, qddd = (np.moveaxis(x, 0, -1) for x in states)
        return q, qd, qdd, qddd
