"""A lower bound for the mass of a link that bends under its own mass, too.

Where the own load adds to the end load at every station, stress and deflection are posynomials of
the heights, convex in log H (Boyd and others, A tutorial on geometric programming, 2007). Then the
Lagrangian is convex in log H, and a tangent bounds it from below.
"""

from dataclasses import replace

import numpy as np

from boom_model.arrays import Array, Mask
from boom_model.link_design.beam import Beam, LoadCases, internal_forces, mass
from boom_model.link_design.conic import Optimum
from boom_model.link_design.problem import convex_share
from boom_model.link_design.search import Search, stress_only

_STEPS = 4
"""Towards a stationary point at given multipliers"""

_CLOSE = 1e-6
"""Relative gap of a bound that needs no second one"""


def lower_bound(search: Search, H: Array, found: Optimum) -> float | None:
    """Return a mass [kg] that no link goes below, its own load included; None where none is proven.

    Only load cases whose own load adds to the end load count. Of these, what pulls or presses
    counts only where it adds as well. To leave out a constraint, or its multiplier, keeps the bound
    valid.

    There are two bounds, and the larger one is returned. The first follows the gradient of the
    Lagrangian at a nearly stationary point to the ends of the range of heights. It is within 1e-6
    unless tapers or buckling act together with the own load. The second takes the forces of the
    stress-only link: no link has smaller ones.

    Args:
        search: with the constraints that matter.
        H: (n + 1,) heights of the lightest link found.
        found: with its multipliers.
    """
    beam, cases, limits = search.beam, search.cases, search.limits
    along, across = _adding(beam, cases)
    if not across.any():
        return None
    some = cases.at(np.flatnonzero(across))
    only = along[across, None]
    some = LoadCases.of(
        some.end_force * np.where([True, False], only, True),
        some.acceleration * np.where([True, False], only, True)[..., None],
        some.end_moment,
        some.clamp,
    )
    least = stress_only(beam, some, limits)
    m, counts, lightest = found.multipliers, along & across, mass(beam, H)
    kept = replace(m, deflections=np.where(across[search.deflecting], m.deflections, 0.0))
    found = replace(found, multipliers=kept)
    heaviest = lightest / search.mass_per_height  # no height of a lighter link is larger
    top = heaviest if limits.max_height is None else np.minimum(heaviest, limits.max_height)
    for _ in range(_STEPS):
        H, found = search.step(H, found, counts)
    forces = internal_forces(beam, H, cases)
    found = replace(found, lower=np.where(counts[search.governing(forces)], found.lower, 0.0))
    stress, share = search.stress(H, forces, found), convex_share(search.mass_per_height, m.slope)
    p, z = search.deflecting_only(search.problem(forces, search.price(H, forces, found))), kept.deflections
    value = mass(beam, H) + share * (float(m.slope @ H) + m.constant) + stress.value
    value += float(z @ (p.deflections(H) - 1.0))
    rise = p.cost + share * m.slope + stress.slope - 3.0 * (z @ p.bending) / H**4 - (z @ p.shear) / H**2
    down, up = (H * rise * np.log(end / H) for end in (np.minimum(least, H), top))
    bound = value + float(np.minimum(down, up).sum())
    if bound >= lightest * (1.0 - _CLOSE):
        return bound
    frozen = Search(beam, some, limits, shear=search.shear)
    return max(bound, frozen.solve(internal_forces(beam, least, some), search.mass_per_height, H).lower_bound)


def _adding(beam: Beam, cases: LoadCases) -> tuple[Mask, Mask]:
    """Whether the forces of each case (k,), along the link and across it, grow with every height.

    Across a strut none do: its shear changes sign.
    """
    end, a = cases.end_force, cases.acceleration
    far = a[..., 0] + a[..., 1] * beam.length
    rounding = 1e-12 * float(np.abs(end).max()) * float(np.abs(a).max())
    along, across = (
        (end[:, i] * a[:, i, 0] <= rounding) & (end[:, i] * far[:, i] <= rounding) & (a[:, i, 0] * far[:, i] >= -rounding)
        for i in (0, 1)
    )
    across &= (cases.end_moment * end[:, 1] >= 0.0) & (beam.support == "cantilever")
    return along, across
