"""Paths between the stops of a move, from its targets."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from boom_model import Boom, InputError
from boom_model.arrays import Array, checked
from boom_model.boom import JOINTS
from boom_model.kinematics.constraints import Constraint
from planner.paths.clearance import require_clear, require_path_clear
from planner.paths.path import JointLine, Path, SplinePath, through
from planner.paths.routing import detour
from planner.paths.targets import Target, TipTarget, resolve
from planner.paths.tip_curves import TipArc, TipLine
from planner.paths.tip_path import TipPath, follow

Along = Literal["joint", "line"] | ArrayLike
"""Kind of path: straight in the joints, a line of the tip, or an arc of the tip through a point."""


def legs(
    boom: Boom,
    targets: Sequence[Target],
    pitch: float | None,
    constraint: Constraint,
    along: Along,
    stops: bool,
    reference: ArrayLike | None = None,
) -> tuple[list[Path], tuple[str, ...]]:
    """Return the paths from stop to stop, and notes about them for the report.

    Each path starts where the previous one ends, on the same branch. Equal consecutive positions
    produce no path. If the boom has shapes to keep away from, straight joint moves are planned
    around them, through poses that the notes name. Any other path that comes too near to a shape is
    refused.

    Args:
        boom: the boom.
        targets: start, targets on the way, and goal.
        pitch: of the end effector at tip targets [rad]; None lets the constraint choose it.
        constraint: the extra constraint of tip targets.
        along: kind of path.
        stops: whether the move stops at the targets on the way. If not, one smooth path goes
            through them.
        reference: (5,) joint position that selects the branch at the start of a tip line or arc.
            None is the middle of the joint ranges.

    Raises:
        InputError: the kind of path does not fit the targets.
        InfeasibleError: a target or a path is out of reach, outside the limits or too near to a
            shape.
    """
    if isinstance(along, str) and along == "joint":
        paths, notes = _joint_paths(boom, targets, pitch, constraint, stops)
    else:
        if not stops:
            raise InputError("targets can be passed without a stop on a joint path only, not on a line or an arc of the tip")
        paths, notes = _tip_paths(boom, targets, pitch, constraint, along, reference), ()
    for path in paths:
        if not isinstance(path, JointLine):  # straight joint moves are clear already: see `detour`
            require_path_clear(boom, path)
    return paths, (*notes, *(path.sentence for path in paths if isinstance(path, TipPath | SplinePath)))


def _joint_paths(
    boom: Boom, targets: Sequence[Target], pitch: float | None, constraint: Constraint, stops: bool
) -> tuple[list[Path], tuple[str, ...]]:
    found: list[Array] = []
    for target in targets:
        found.append(resolve(boom, target, pitch, constraint, reference=found[-1] if found else None))
        require_clear(boom, found[-1], target if isinstance(target, str) else f"target {len(found)}")
    places = [found[0], *(b for a, b in pairwise(found) if not np.array_equal(a, b))]
    if not stops and len(places) > 2:
        return [through(boom, np.array(places))], ()
    paths: list[Path] = []
    notes: list[str] = []
    for a, b in pairwise(places):
        way = detour(boom, a, b)
        paths += [JointLine(*pair) for pair in pairwise(way)]
        notes += [f"detour around the shapes to keep away from, with a stop at {_shown(q)}" for q in way[1:-1]]
    return paths, tuple(notes)


def _tip_paths(
    boom: Boom,
    targets: Sequence[Target],
    pitch: float | None,
    constraint: Constraint,
    along: Along,
    reference: ArrayLike | None,
) -> list[Path]:
    if isinstance(along, str) and along != "line":
        raise InputError(f"along is {along!r}; it must be 'joint', 'line' or a point of an arc")
    if not isinstance(along, str) and len(targets) != 2:
        raise InputError("an arc connects two tip targets; it takes no targets on the way")
    if pitch is None:
        raise InputError("a line or an arc of the tip has a constant pitch, which must be given")
    paths: list[Path] = []
    last = reference
    for a, b in pairwise([_place(target) for target in targets]):
        if np.array_equal(a, b):
            continue
        curve = TipLine(a, b) if isinstance(along, str) else TipArc.through(a, along, b)
        path = follow(boom, curve, pitch, constraint, reference=last)
        paths.append(path)
        last = path(1.0)
    return paths


def _place(target: Target) -> Array:
    if not isinstance(target, TipTarget):
        raise InputError(f"{target!r} is not a tip target; a line or an arc of the tip connects tip targets")
    return checked("tip target", target.position)


def _shown(q: Array) -> str:
    values = [f"{q[i]:.3f} m" if name == "extension" else f"{np.degrees(q[i]):.1f} deg" for i, name in enumerate(JOINTS)]
    return ", ".join(f"{name} {value}" for name, value in zip(JOINTS, values, strict=True))
