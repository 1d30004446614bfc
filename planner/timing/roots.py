"""Where a limit is just kept."""

from collections.abc import Callable

_FINITE = 1e12


def just_kept(excess: Callable[[float], float], broken: float, kept: float, accuracy: float = 1e-12) -> float:
    """The place between two at which an excess over a limit turns 0, by Brent's method, on the side that keeps the limit.

    Args:
        excess: above 0 at `broken`, and not at `kept`; it may be infinite.
        accuracy: how far beyond the root the answer may be, as a share of the larger of the two places.
    """
    from scipy.optimize import brentq

    if excess(kept) == 0.0:
        return kept
    near = accuracy * max(abs(broken), abs(kept))
    root = float(brentq(lambda x: min(excess(x), _FINITE), broken, kept, xtol=near))
    return min(root + near, kept) if kept > broken else max(root - near, kept)
