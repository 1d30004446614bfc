"""How near the arm comes to what it must keep away from.

Distances are coal's, the collision library of Pinocchio. It is an extra, keep-out: it is large, and most booms have no shapes.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from types import ModuleType
from typing import Any, cast

import numpy as np

from boom_model import Boom, InfeasibleError, InputError
from boom_model.arrays import Array
from boom_model.keep_out import Box, Capsule
from boom_model.kinematics.frames import frame_transforms
from planner.paths.path import Path

LINKS = ("lower", "outer", "upper", "inner", "actuator", "end effector", "payload")
"""The parts of the arm: a line between two pins each, the payload the point of the tip."""

_RESOLUTION = 1e-3  # [m]
_ROUGH = 1001
_MOST_POINTS = 20_000
_FIRST_LOOKS = 33
_CLOSER = 0.01  # [m]


@dataclass(frozen=True)
class Clearance:
    """Where the arm comes nearest to a shape."""

    distance: float
    """[m], negative where they overlap"""
    link: str
    shape: str
    s: float = 0.0
    """Where on the path."""


def link_lines(boom: Boom, q: Array) -> Array:
    """Both ends of each of LINKS in frame 1, shape (..., 7, 2, 3) [m]."""
    outer = frame_transforms(boom, q, "outer")[..., :3, 3]
    inner = frame_transforms(boom, q, "inner")[..., 4, :3, 3]
    five, six, seven, eight, wrist, tip = (outer[..., i, :] for i in (4, 5, 6, 7, 9, 10))
    ends = [(five, six), (six, seven), (seven, eight), (inner, eight), (eight, wrist), (wrist, tip), (tip, tip)]
    return np.stack([np.stack(pair, axis=-2) for pair in ends], axis=-3)


def clearance(boom: Boom, q: Array) -> Clearance:
    """The nearest approach of the arm at q (5,) to a shape of `boom.keep_out`, which must be given.

    Raises:
        InputError: coal is not installed; names the extra that brings it. So do all functions here that measure distances.
    """
    return _nearest(boom, _distances(boom, q[None])[0])


def least_clearance(boom: Boom, path: Path) -> Clearance:
    """The nearest approach along a path, seen at points between which no point of the arm moves more than a millimetre."""
    rough = path(np.linspace(0.0, 1.0, _ROUGH))
    count = int(np.clip(_travel(boom, rough)[-1] / _RESOLUTION, 1, _MOST_POINTS)) + 1
    s = np.linspace(0.0, 1.0, count)
    at, found = nearest_approach(boom, path(s))
    return replace(found, s=float(s[at]))


def nearest_approach(boom: Boom, q: Array) -> tuple[int, Clearance]:
    """The sample of a motion (n, 5) at which the arm comes nearest to a shape, to a centimetre where it is clear.

    Only samples are looked at between which the arm, however it moves, could come nearer than the clearance, or nearer by a
    centimetre than the nearest so far.
    """
    keep = boom.keep_out
    assert keep is not None
    travel = _travel(boom, q)
    looked = np.unique(np.linspace(0, len(q) - 1, _FIRST_LOOKS).astype(int))
    distances = _distances(boom, q[looked])
    while True:
        near = distances.reshape(len(looked), -1).min(axis=-1)
        could = (near[:-1] + near[1:] - np.diff(travel[looked])) / 2.0
        worth = np.where(near.min() < keep.clearance, near.min(), max(keep.clearance, near.min() - _CLOSER))
        open_ = (np.diff(looked) > 1) & (could < worth)
        if not open_.any():
            break
        added = ((looked[:-1] + looked[1:]) // 2)[open_]
        looked, distances = np.concatenate([looked, added]), np.concatenate([distances, _distances(boom, q[added])])
        order = np.argsort(looked)
        looked, distances = looked[order], distances[order]
    at = int(np.argmin(near))
    return int(looked[at]), _nearest(boom, distances[at])


def _travel(boom: Boom, q: Array) -> Array:
    """(n,) the farthest that a point of the arm can have moved since the first of the positions q (n, 5) [m]."""
    return np.append(0.0, np.cumsum(np.abs(np.diff(q, axis=0)) @ _reach(boom)))


def require_clear(boom: Boom, q: Array, name: str) -> None:
    """Whether a pose keeps away from every shape, where any is given.

    Raises:
        InfeasibleError: it does not; names the link, the shape and the distance.
    """
    if boom.keep_out is None:
        return
    found = clearance(boom, q)
    if found.distance < boom.keep_out.clearance:
        raise InfeasibleError(f"{name}: {sentence(boom, found)}")


def require_path_clear(boom: Boom, path: Path) -> None:
    """Whether a path keeps away from every shape, where any is given.

    Raises:
        InfeasibleError: it does not; names the place, the link, the shape and the distance.
    """
    if boom.keep_out is None:
        return
    found = least_clearance(boom, path)
    if found.distance < boom.keep_out.clearance:
        raise InfeasibleError(f"at {found.s:.1%} of the path {sentence(boom, found)}; a path of this kind is not led round")


def sentence(boom: Boom, found: Clearance) -> str:
    """What a nearest approach says against the clearance that is asked for."""
    assert boom.keep_out is not None
    how = f"comes within {found.distance * 1e3:.0f} mm of" if found.distance > 0.0 else "runs into"
    return f"the {found.link} {how} the {found.shape}, where {boom.keep_out.clearance * 1e3:.0f} mm are to be kept"


def _nearest(boom: Boom, distances: Array) -> Clearance:
    assert boom.keep_out is not None
    link, shape = np.unravel_index(int(np.argmin(distances)), distances.shape)
    return Clearance(float(distances[link, shape]), LINKS[link], boom.keep_out.shapes[shape].name)


@lru_cache(maxsize=8)
def _reach(boom: Boom) -> Array:
    """(5,) the farthest that a point of the arm moves with each joint, per rad or m."""
    g, keep = boom.geometry, boom.keep_out
    assert keep is not None
    tip = g.L8 + max(keep.payload_radius, keep.link_radius)
    actuator = np.hypot(g.L7 + float(boom.limits.upper[3]), g.L6) + tip
    inner = g.L9 + keep.link_radius
    lower = max(g.L3, actuator) + keep.link_radius
    return np.array([abs(g.L2) + inner + lower, inner, lower, 1.0, tip])


def _distances(boom: Boom, q: Array) -> Array:
    """Distance [m] of every link to every shape at q (n, 5): (n, 7, shapes)."""
    coal, keep = _coal(), boom.keep_out
    assert keep is not None
    still = [_solid(coal, shape) for shape in keep.shapes]
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    found = np.empty((len(q), len(LINKS), len(still)))
    for i, pose in enumerate(link_lines(boom, q)):
        for k, (start, end) in enumerate(pose):
            link = _rounded(coal, start, end, keep.payload_radius if LINKS[k] == "payload" else keep.link_radius)
            for m, shape in enumerate(still):
                result.clear()
                found[i, k, m] = coal.distance(*link, *shape, request, result)
    return found


def _coal() -> ModuleType:
    try:
        import coal
    except ModuleNotFoundError:
        raise InputError(
            "the boom's file has shapes to keep away from (keep_out), which need the extra keep-out: "
            "run pip install '.[keep-out]' in the folder of boom"
        ) from None
    return cast(ModuleType, coal)


def _solid(coal: ModuleType, shape: Box | Capsule) -> tuple[Any, Any]:
    """coal's shape and where it is."""
    if isinstance(shape, Capsule):
        return _rounded(coal, shape.start, shape.end, shape.radius)
    return coal.Box(*shape.size), coal.Transform3s(np.eye(3), shape.center)


def _rounded(coal: ModuleType, start: Array, end: Array, radius: float) -> tuple[Any, Any]:
    """The capsule about a line, or the ball about a point, and where it is; coal's capsule lies along z."""
    axis = end - start
    length = float(np.linalg.norm(axis))
    middle = (start + end) / 2.0
    if length == 0.0:
        return coal.Sphere(radius), coal.Transform3s(np.eye(3), middle)
    z = axis / length
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    return coal.Capsule(radius, length), coal.Transform3s(np.stack([x, np.cross(z, x), z], axis=-1), middle)
