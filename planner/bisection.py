"""Where something starts, or ceases, to work."""

from collections.abc import Callable

import numpy as np


def bisect(
    works: Callable[[float], bool], good: float, bad: float, *, steps: int = 60, within: float = 0.0, geometric: bool = False
) -> float:
    """The value nearest to `bad` that was seen to work, or `good`, which is not tried.

    Args:
        steps: halvings at most.
        within: halving ends when good and bad are less than this apart.
        geometric: halve the ratio of good and bad, and not their difference.
    """
    for _ in range(steps):
        if abs(bad - good) < within:
            break
        middle = float(np.sqrt(good * bad)) if geometric else (good + bad) / 2.0
        good, bad = (middle, bad) if works(middle) else (good, middle)
    return good
