"""Intervals of a log: between which samples a time lies, and why it may not be used there."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from boom_model.arrays import Array

Indices = NDArray[np.int_]


def intervals(
    t: Array, stamps: Array, source: str, lines: Indices, flaws: Sequence[tuple[str, Array, str]]
) -> tuple[Indices, Array, tuple[str, ...]]:
    """Return the interval of each time, the share of it that has passed, and why it is refused.

    Args:
        t: (n,) times of the samples, increasing [s].
        stamps: (m,) times to find [s].
        source: what a message calls the log.
        lines: (n,) line of each sample.
        flaws: kinds of flaws, the gravest first: its name, its size in each interval (n - 1,), 0
            where there is none, and the unit of the size.
    """
    k = np.clip(np.searchsorted(t, stamps, side="right") - 1, 0, len(t) - 2)
    share = np.clip((stamps - t[k]) / (t[k + 1] - t[k]), 0.0, 1.0)

    def reason(stamp: float, i: int) -> str:
        if stamp < t[0]:
            return f"{t[0] - stamp:.3g} s before {source} begins"
        if stamp > t[-1]:
            return f"{stamp - t[-1]:.3g} s after {source} ends"
        for name, size, unit in flaws:
            if size[i] > 0.0:
                return f"in a {name} of {size[i]:.3g} {unit} before line {lines[i + 1]} of {source}"
        return ""

    return k, share, tuple(reason(float(stamp), int(i)) for stamp, i in zip(stamps, k, strict=True))
