"""Root of the excess over a limit."""

from collections.abc import Callable

_FINITE = 1e12


def just_kept(excess: Callable[[float], float], broken: float, kept: float, accuracy: float = 1e-12) -> float:
    """Return where the excess over a limit becomes 0, on the side that respects the limit.

    Brent's method finds the root.

    Args:
        excess: function of one variable, positive at `broken` and not positive at `kept`. It may be
            infinite.
        broken: value that exceeds the limit.
        kept: value that respects the limit.
        accuracy: largest distance of the result from the root, relative to the larger of |broken|
            and |kept|.
    """
    from scipy.optimize import brentq

    if excess(kept) == 0.0:
        return kept
    near = accuracy * max(abs(broken), abs(kept))
    root = float(brentq(lambda x: min(excess(x), _FINITE), broken, kept, xtol=near))
    return min(root + near, kept) if kept > broken else max(root - near, kept)
