"""Golden section search on many intervals at once."""

from collections.abc import Callable

import numpy as np

from boom_model.arrays import Array

_SHRINK = (np.sqrt(5.0) - 1.0) / 2.0


def golden_section(cost: Callable[[Array], Array], low: Array, high: Array, steps: int) -> Array:
    """Return where a cost is least between `low` and `high` (...), if it has one minimum there.

    Args:
        cost: of places (..., 2), likewise shaped.
        low: lower ends of the intervals.
        high: upper ends.
        steps: each shrinks the intervals to 0.618 of their lengths.
    """
    a, b = low, high
    for _ in range(steps):
        c, d = b - _SHRINK * (b - a), a + _SHRINK * (b - a)
        values = cost(np.stack([c, d], axis=-1))
        left = values[..., 0] <= values[..., 1]
        a, b = np.where(left, a, c), np.where(left, d, b)
    middle: Array = (a + b) / 2.0
    return middle
