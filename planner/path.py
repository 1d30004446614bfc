"""Paths in joint space, parametrised by s from 0 to 1."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array


class Path(Protocol):
    """A smooth map from s in [0, 1] to joint positions."""

    def __call__(self, s: ArrayLike, order: int = 0) -> Array:
        """The derivative of the given order (0 to 3) with respect to s, shape (..., 5) for s of shape (...)."""
        ...


@dataclass(frozen=True, eq=False)
class JointLine:
    """Straight line in joint space, q(s) = start + s (goal - start).

    Every position limit, the coupled one included, is linear in q: a line between two poses within them stays within them.
    """

    start: Array
    goal: Array

    def __call__(self, s: ArrayLike, order: int = 0) -> Array:
        s = np.asarray(s, dtype=float)[..., None]
        if order == 0:
            line: Array = (1.0 - s) * self.start + s * self.goal  # exact at both ends
            return line
        slope = self.goal - self.start if order == 1 else np.zeros(5)
        return np.broadcast_to(slope, (*s.shape[:-1], 5))
