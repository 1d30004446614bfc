"""The time-optimal law within the gearboxes' average torque as well."""

from dataclasses import replace
from functools import cache

import numpy as np

from boom_model import JOINTS, BaseMotion, Boom, Drive, inverse_dynamics
from boom_model.arrays import Array
from planner.paths.path import Path
from planner.timing.path_limits import InfeasiblePathError, path_dynamics, spread
from planner.timing.profiles.time_optimal import GRID_INTERVALS, time_optimal
from planner.timing.roots import just_kept
from planner.timing.time_law import Motion, TimeLaw
from planner.timing.travel_mean import average_torque

_SLOWEST = 1e3
_SLOWING_ACCURACY = 1e-10
_SHARE_ACCURACY = 2e-4
_EACH = 3


def within_average_torque(boom: Boom, path: Path, base: BaseMotion | None = None) -> TimeLaw:
    """Find the fastest law within the average torque limits of the gearboxes.

    Along a path the average, (int |tau|^3 |p'| ds / int |p'| ds)^(1/3), depends on the whole
    motion, which toppra cannot take in. Two ways are searched, and the faster taken: a cap on the
    gearboxes' torque, between what holding the load asks for and the unbounded law's peak, all
    joints' in proportion; and slowing that law evenly.

    Raises:
        InfeasiblePathError: as `time_optimal`, or the average of the held load alone is beyond the
            limit.
    """
    sharp = time_optimal(boom, path, base)
    limits = np.array([(drive and drive.gearbox.max_average_torque) or np.inf for drive in boom.drives])

    def excess(law: TimeLaw) -> float:
        return float((_averages(boom, path, law, base) / limits).max()) - 1.0

    if excess(sharp) <= 0.0:
        return sharp
    slowest = sharp.stretched(_SLOWEST)
    if excess(slowest) > 0.0:
        raise _held_too_much(boom, path, slowest, limits, base)
    even = sharp.stretched(just_kept(lambda slowing: excess(sharp.stretched(slowing)), 1.0, _SLOWEST, _SLOWING_ACCURACY))
    floor = np.abs(path_dynamics(boom, path, spread(path, GRID_INTERVALS), base).c).max(axis=0)
    peak = np.abs(_torque(boom, Motion(path, sharp), base)[2]).max(axis=0)
    laws: list[TimeLaw] = []

    @cache
    def excess_of_share(share: float) -> float:
        """Of the law capped at a share of the way from the held load to the peak; or 0."""
        try:
            capped = time_optimal(_capped(boom, floor + share * (peak - floor)), path, base)
        except InfeasiblePathError:
            return -1.0
        laws.append(capped)
        return excess(capped)

    if excess_of_share(0.0) <= 0.0 < excess_of_share(1.0):
        just_kept(excess_of_share, 1.0, 0.0, _SHARE_ACCURACY)
    best = min((law for law in (even, *laws) if excess(law) <= 0.0), key=lambda each: each.duration)
    solves = sharp.iterations + sum(law.iterations for law in laws)
    return replace(best, iterations=solves, residual=max(best.residual, 0.0 if best is even else _SHARE_ACCURACY))


def _torque(boom: Boom, motion: Motion, base: BaseMotion | None) -> tuple[Array, Array, Array]:
    """Return times, joint velocities and torques of a motion."""
    t = motion.law.times(_EACH)
    q, qd, qdd, _ = motion(t)
    return t, qd, inverse_dynamics(boom, q, qd, qdd, base=base, friction=True, reactions=False).tau


def _averages(boom: Boom, path: Path, law: TimeLaw, base: BaseMotion | None) -> Array:
    t, qd, tau = _torque(boom, Motion(path, law), base)
    return np.array([average_torque(t, tau[:, i], qd[:, i]) or 0.0 for i in range(5)])


def _capped(boom: Boom, caps: Array) -> Boom:
    """Return the boom with gearbox limits of at most `caps` (5,)."""
    drives: list[Drive | None] = []
    for drive, cap in zip(boom.drives, caps, strict=True):
        limit = None if drive is None else drive.gearbox.start_stop_torque
        if drive is None:
            drives.append(None)
        else:
            bounded = float(cap) if limit is None else min(float(cap), limit)
            drives.append(replace(drive, gearbox=replace(drive.gearbox, start_stop_torque=bounded)))
    return replace(boom, drives=tuple(drives))


def _held_too_much(boom: Boom, path: Path, slowest: TimeLaw, limits: Array, base: BaseMotion | None) -> InfeasiblePathError:
    averages = _averages(boom, path, slowest, base)
    worst = int(np.argmax(averages / limits))
    t, _, tau = _torque(boom, Motion(path, slowest), base)
    s = float(slowest.s(t[int(np.argmax(np.abs(tau[:, worst])))]))
    return InfeasiblePathError(
        f"no motion keeps the gearboxes' average torque: at {JOINTS[worst]} the load that is held alone averages "
        f"{averages[worst]:.1f} Nm, and the sheet allows {limits[worst]:.1f} Nm",
        JOINTS[worst], s, float(averages[worst]), float(limits[worst]),
    )  # fmt: skip
