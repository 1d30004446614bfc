"""Reach of the tip: the reachable point nearest to a target, and a map of a vertical plane."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array, Mask, checked, read_only, scalar
from boom_model.boom import Boom
from boom_model.drives.drive import drive_torque_limit
from boom_model.errors import InputError
from boom_model.kinematics.constraints import Constraint, FixedExtension, LeastTorque, measure
from boom_model.kinematics.inverse import solve_branches

_SAMPLES = 4001
_BISECTIONS = 60
_CELL = 0.02  # [m]
_MOST_CELLS = 400  # along one side of a default grid


@dataclass(frozen=True, eq=False)
class NearestReachable:
    """The reachable point nearest to a target on the line through the target and the base.

    The base is the origin of frame 1.
    """

    position: Array
    """(3,) [m]"""
    distance: float
    """distance from the target [m]"""
    within_limits: bool
    """False if no point of the line is reachable within the limits; this one then violates them."""


def nearest_reachable(boom: Boom, position: ArrayLike, pitch: float, constraint: Constraint) -> NearestReachable | None:
    """Return the reachable point nearest to `position` on its line to the base, or None.

    The line is scanned in steps of about a millimetre, and the boundary is found by bisection. A
    reachable interval shorter than a step can be missed.

    Raises:
        InputError: position is not finite or not (3,).
    """
    position, pitch = checked("position", position, 3), scalar("pitch", pitch)
    if position.shape != (3,):
        raise InputError(f"position has shape {position.shape}; it must be (3,)")
    with np.errstate(over="ignore"):
        length = float(np.linalg.norm(position))
    if not np.isfinite(length):
        raise InputError(f"position {position.tolist()} m is too far away to measure a distance")
    if length == 0.0:
        return None
    g, limits = boom.geometry, boom.limits
    extensions = [limits.lower[3], limits.upper[3], constraint.extension if isinstance(constraint, FixedExtension) else 0.0]
    outermost = abs(g.L1) + abs(g.L2) + g.L9 + abs(g.L6) + g.L7 + g.L8 + float(np.abs(extensions).max())
    shares = np.linspace(0.0, outermost / length, _SAMPLES)
    branches = solve_branches(boom, shares[:, None] * position, pitch, constraint)
    for reached, within in ((branches.within_limits, True), (branches.exists, False)):
        usable = np.flatnonzero(reached.any(axis=-1))
        if usable.size:
            inside = float(shares[usable[np.argmin(np.abs(shares[usable] - 1.0))]])
            share = _boundary(boom, position, pitch, constraint, inside, within)
            return NearestReachable(read_only(share * position), abs(1.0 - share) * length, within)
    return None


def _boundary(boom: Boom, position: Array, pitch: float, constraint: Constraint, inside: float, within: bool) -> float:
    """Return the share nearest to 1 that is reachable, between a reachable share and the target."""
    outside = 1.0
    for _ in range(_BISECTIONS):
        middle = (inside + outside) / 2.0
        found = solve_branches(boom, middle * position, pitch, constraint)
        reachable = (found.within_limits if within else found.exists).any()
        inside, outside = (middle, outside) if reachable else (inside, middle)
    return inside


@dataclass(frozen=True, eq=False)
class ReachMap:
    """Reach of the tip in the vertical plane y = 0 of frame 1 with torque margins, cell by cell."""

    constraint: Constraint
    pitch: float
    """[rad]"""
    r: Array
    """(n,) x in frame 1 of the middles of the cells, ascending [m]; negative behind the base."""
    z: Array
    """(m,) heights of the middles of the cells in frame 1, ascending [m]."""
    exists: Mask
    """(m, n) True where a branch exists.

    A constraint that chooses among branches finds only those within the limits; `exists` then
    equals `within_limits`.
    """
    within_limits: Mask
    """(m, n) True where a branch within the limits exists."""
    q: Array
    """(m, n, 5) best branch within the limits; NaN where there is none.

    Under a constraint that chooses among branches it is the one of least cost; otherwise it is the
    one nearest to the middle of the joint ranges, as in `inverse_kinematics`.
    """
    torque_margin: Array
    """(m, n) 1 - the largest |static torque| / (limit of the drive at rest), at q on level ground.

    Joints without a drive do not count, because their limit is unknown. The margin is negative
    above a drive's limit. It is NaN where q is, and everywhere if no joint has a drive.
    """


def reach_map(
    boom: Boom, constraint: Constraint, pitch: float = -np.pi / 2.0, r: ArrayLike | None = None, z: ArrayLike | None = None
) -> ReachMap:
    """Map the reach in the arm's vertical plane for one constraint and pitch.

    The tip is at (r, 0, z) of frame 1 in each cell. The arm stands forward or turned by 180
    degrees, as the limits of the yaw allow. Collisions with the ground, the vehicle or the boom
    itself are not checked.

    Args:
        boom: the boom.
        constraint: the constraint that determines the redundant joint.
        pitch: elevation of the end effector above the boom's own forward horizontal [rad]; -pi/2
            faces down.
        r: (n,) ascending [m]. None covers all that any constraint reaches within the limits, in
            cells of 2 cm, or coarser for a very large boom.
        z: (m,) likewise.

    Raises:
        InputError: pitch, r or z is not finite, r or z is not an ascending vector, or constraint is
            not a constraint.
    """
    pitch = scalar("pitch", pitch)
    r, z = (
        read_only(grid if given is None else _rising(name, given))
        for name, given, grid in zip("rz", (r, z), _default_grid(boom, pitch), strict=True)
    )
    x, height = np.meshgrid(r, z)
    found = solve_branches(boom, np.stack([x, np.zeros_like(x), height], axis=-1), pitch, constraint)
    cost = np.full(found.within_limits.shape, np.inf)
    cost[found.within_limits] = measure(boom, constraint).cost(boom, found.q[found.within_limits])
    best = np.argmin(cost, axis=-1)[..., None]
    q = np.take_along_axis(found.q, best[..., None], axis=-2)[..., 0, :]
    within, exists = (np.asarray(mask.any(axis=-1)) for mask in (found.within_limits, found.exists))
    q[~within] = np.nan
    margin = np.full(within.shape, np.nan)
    if any(drive is not None and drive_torque_limit(drive, 0.0) is not None for drive in boom.drives):
        margin[within] = 1.0 - LeastTorque().cost(boom, q[within])
    exists.flags.writeable = within.flags.writeable = False
    return ReachMap(constraint, pitch, r, z, exists, within, read_only(q), read_only(margin))


def _rising(name: str, values: ArrayLike) -> Array:
    grid = checked(name, values)
    if grid.ndim != 1 or grid.size == 0 or not (np.diff(grid) > 0.0).all():
        raise InputError(f"{name} of shape {grid.shape} must be a vector of ascending numbers")
    return grid


def _default_grid(boom: Boom, pitch: float) -> tuple[Array, Array]:
    """Return a grid around every tip position within the limits, with one more cell on each side.

    The arm may stand forward or turned by 180 degrees. 0 is among r and z.
    """
    g, low, high = boom.geometry, boom.limits.lower, boom.limits.upper
    theta2, theta3 = (np.linspace(low[i], high[i], 721) for i in (1, 2))
    rho = g.L7 + np.array([low[3], high[3]])[:, None]
    sides = (
        (g.L2 + g.L8 * np.cos(pitch), g.L9 * np.cos(theta2), g.L6 * np.sin(theta3) - rho * np.cos(theta3)),
        (g.L1 + g.L8 * np.sin(pitch), g.L9 * np.sin(theta2), -g.L6 * np.cos(theta3) - rho * np.sin(theta3)),
    )
    (left, right), (bottom, top) = ((tip + a.min() + b.min(), tip + a.max() + b.max()) for tip, a, b in sides)
    reach = max(abs(left), abs(right))
    cell = max(_CELL, 2.0 * reach / _MOST_CELLS, (top - bottom) / _MOST_CELLS)
    across = int(np.ceil(reach / cell)) + 1
    return cell * np.arange(-across, across + 1), cell * np.arange(np.floor(bottom / cell) - 1, np.ceil(top / cell) + 2)
