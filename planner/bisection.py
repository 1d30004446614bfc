"""Bisection for the boundary between values that work and values that do not."""

from collections.abc import Callable

import numpy as np


def bisect(
    works: Callable[[float], bool], good: float, bad: float, *, steps: int = 60, within: float = 0.0, geometric: bool = False
) -> float:
    """Return the value nearest to `bad` that works.

    If no value between the two works, return `good`, which is taken to work and is not tried.

    Args:
        works: whether a value works.
        good: value that works.
        bad: value that does not work.
        steps: largest number of halvings.
        within: distance of good and bad at which halving ends.
        geometric: whether to halve the ratio of good and bad instead of their difference.
    """
    for _ in range(steps):
        if abs(bad - good) < within:
            break
        middle = float(np.sqrt(good * bad)) if geometric else (good + bad) / 2.0
        good, bad = (middle, bad) if works(middle) else (good, middle)
    return good
