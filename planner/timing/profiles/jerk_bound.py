"""A law whose acceleration jumps, smoothed until the joints' jerk limits are kept."""

from contextlib import suppress
from functools import cache

import numpy as np

from boom_model import BaseMotion, Boom
from planner.paths.path import JointLine, Path
from planner.timing.path_limits import InfeasiblePathError, PathLoads, peak_rate_ratios
from planner.timing.profiles.time_optimal import time_optimal
from planner.timing.time_law import Motion, TimeLaw

_NARROWEST = -2.5  # of the windows to average over: the power of ten, as a share of the duration
_WINDOWS = 11
_WINDOW_TOLERANCE = 1e-3
_SHAPE_SHARES = (0.5, 0.25)  # of the jerk limits, that a path's shape may take


def jerk_bounded(boom: Boom, path: Path, base: BaseMotion | None = None) -> TimeLaw:
    """Find the fastest smoothed time-optimal law within the joint limits, including jerk.

    On a curved path the path's own shape asks for jerk, at a waypoint above all. Laws that are slow
    there, and there alone, are tried besides, and one on equal steps: between near waypoints it is
    smoother.

    Raises:
        InfeasiblePathError: as `time_optimal`.
    """
    laws = [time_optimal(boom, path, base)]
    if not isinstance(path, JointLine):
        for share in _SHAPE_SHARES:
            with suppress(InfeasiblePathError):
                laws.append(time_optimal(boom, path, base, jerk_share=share))
    if len(path.knots):
        with suppress(InfeasiblePathError):
            laws.append(time_optimal(boom, path, base, even=True))
    return min((with_jerk_bound(boom, path, law, base) for law in laws), key=lambda each: each.duration)


def with_jerk_bound(boom: Boom, path: Path, law: TimeLaw, base: BaseMotion | None = None) -> TimeLaw:
    """Average a law over a window, and slow it to respect the joint limits, including jerk.

    Averaging s(t) neither leaves the path nor starts or ends in motion, makes the acceleration
    continuous and 0 at both ends, and bounds the jerk by the jump of the acceleration over the
    window. Where it exceeds a limit, the law is slowed evenly; the window is the one that makes the
    whole shortest. Of the time-optimal law of a straight path under joint limits alone this makes
    the least-time jerk-limited one where the law cruises for as long as the window; elsewhere it is
    not the optimum.

    The limits are looked at in few places of each of the law's pieces, with torques interpolated
    along the path: between these places the law may break them by a trifle.
    """
    from scipy.optimize import minimize_scalar

    loads = PathLoads.along(boom, path, base)

    @cache
    def smooth(exponent: float) -> TimeLaw:
        smoothed = law.averaged(law.duration * 10.0**exponent)
        motion = Motion(path, smoothed)
        jerk = float(np.cbrt(peak_rate_ratios(boom, motion, motion.times(1))[2]))
        return smoothed.stretched(loads.stretch(smoothed, smoothed.s.x, max(1.0, jerk)))

    exponents = np.linspace(_NARROWEST, 0.0, _WINDOWS)
    least = int(np.argmin([smooth(float(exponent)).duration for exponent in exponents]))
    around = exponents[max(least - 1, 0)], exponents[min(least + 1, _WINDOWS - 1)]
    found = minimize_scalar(
        lambda x: smooth(float(x)).duration, bounds=around, method="bounded", options={"xatol": _WINDOW_TOLERANCE}
    )
    return min(smooth(float(found.x)), smooth(float(exponents[least])), key=lambda each: each.duration)
