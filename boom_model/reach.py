"""How far a target is out of reach, and the nearest point that is not."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array, checked, read_only, scalar
from boom_model.boom import Boom
from boom_model.errors import InputError
from boom_model.inverse_kinematics import FixedExtension, Hold, solve_branches

_SAMPLES = 4001
_BISECTIONS = 60


@dataclass(frozen=True, eq=False)
class NearestReachable:
    """The reachable point nearest to a target on the line through the target and the base (the origin of frame 1)."""

    position: Array
    """(3,) [m]"""
    distance: float
    """from the target [m]"""
    within_limits: bool
    """False where no point of the line is reachable within the limits: then the geometry alone allows this one."""


def nearest_reachable(boom: Boom, position: ArrayLike, pitch: float, hold: Hold) -> NearestReachable | None:
    """The reachable point nearest to `position` on its line to the base; None where the line has none.

    The line is scanned in steps of about a millimetre and the boundary found by bisection, so a reachable stretch
    shorter than a step can be missed.

    Raises:
        InputError: position is not finite or not (3,).
    """
    position, pitch = checked("position", position, 3), scalar("pitch", pitch)
    if position.shape != (3,):
        raise InputError(f"position has shape {position.shape}; it must be (3,)")
    length = float(np.linalg.norm(position))
    if length == 0.0:
        return None
    g, limits = boom.geometry, boom.limits
    extensions = [limits.lower[3], limits.upper[3], hold.extension if isinstance(hold, FixedExtension) else 0.0]
    outermost = abs(g.L1) + abs(g.L2) + g.L9 + abs(g.L6) + g.L7 + g.L8 + float(np.abs(extensions).max())
    shares = np.linspace(0.0, outermost / length, _SAMPLES)
    branches = solve_branches(boom, shares[:, None] * position, pitch, hold)
    for reached, within in ((branches.within_limits, True), (branches.exists, False)):
        usable = np.flatnonzero(reached.any(axis=-1))
        if usable.size:
            inside = float(shares[usable[np.argmin(np.abs(shares[usable] - 1.0))]])
            share = _boundary(boom, position, pitch, hold, inside, within)
            return NearestReachable(read_only(share * position), abs(1.0 - share) * length, within)
    return None


def _boundary(boom: Boom, position: Array, pitch: float, hold: Hold, inside: float, within: bool) -> float:
    """The share nearest to 1 that is still reachable, between a reachable share and the target."""
    outside = 1.0
    for _ in range(_BISECTIONS):
        middle = (inside + outside) / 2.0
        found = solve_branches(boom, middle * position, pitch, hold)
        reachable = (found.within_limits if within else found.exists).any()
        inside, outside = (middle, outside) if reachable else (inside, middle)
    return inside
