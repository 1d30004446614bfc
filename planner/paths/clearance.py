"""Distance between the arm and the shapes that it must keep away from.

Distances come from coal, the collision library of Pinocchio. It is an extra, keep-out, because it
is large and most booms have no shapes.
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
"""Parts of the arm. Each is a line between two pins, except the payload, a point at the tip."""

_RESOLUTION = 1e-3  # [m]
_ROUGH = 1001
_MOST_POINTS = 20_000
_FIRST_LOOKS = 33
_CLOSER = 0.01  # [m]


@dataclass(frozen=True)
class Clearance:
    """Nearest approach of the arm to a shape."""

    distance: float
    """[m], negative where they overlap."""
    link: str
    shape: str
    s: float = 0.0
    """Parameter of the path there."""


def link_lines(boom: Boom, q: Array) -> Array:
    """Return both ends of each of LINKS in frame 1, shape (..., 7, 2, 3) [m]."""
    outer = frame_transforms(boom, q, "outer")[..., :3, 3]
    inner = frame_transforms(boom, q, "inner")[..., 4, :3, 3]
    five, six, seven, eight, wrist, tip = (outer[..., i, :] for i in (4, 5, 6, 7, 9, 10))
    ends = [(five, six), (six, seven), (seven, eight), (inner, eight), (eight, wrist), (wrist, tip), (tip, tip)]
    return np.stack([np.stack(pair, axis=-2) for pair in ends], axis=-3)


def clearance(boom: Boom, q: Array) -> Clearance:
    """Return the nearest approach of the arm at q (5,) to a shape of `boom.keep_out`.

    `boom.keep_out` must not be None.

    Raises:
        InputError: coal is not installed; the message names the extra that brings it. This holds
            for every function here that measures distances.
    """
    return _nearest(boom, _distances(boom, q[None])[0])


def least_clearance(boom: Boom, path: Path) -> Clearance:
    """Return the nearest approach along a path.

    The path is sampled so finely that no point of the arm moves more than 1 mm between two samples,
    up to 20,000 samples.
    """
    rough = path(np.linspace(0.0, 1.0, _ROUGH))
    count = int(np.clip(_travel(boom, rough)[-1] / _RESOLUTION, 1, _MOST_POINTS)) + 1
    s = np.linspace(0.0, 1.0, count)
    at, found = nearest_approach(boom, path(s))
    return replace(found, s=float(s[at]))


def nearest_approach(boom: Boom, q: Array) -> tuple[int, Clearance]:
    """Return the sample of a motion q (n, 5) at which the arm is nearest to a shape, and how near.

    The distance is exact if it is below the clearance, else to 1 cm. Between two examined samples,
    a bound on the arm's travel tells how near it could come. The samples between are examined only
    if that is below the smallest distance so far (once this violates the clearance), or else below
    the clearance or more than 1 cm below the smallest distance so far.
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
    """Return a bound (n,) [m] on the travel of any point of the arm since the first of q (n, 5)."""
    return np.append(0.0, np.cumsum(np.abs(np.diff(q, axis=0)) @ _reach(boom)))


def require_clear(boom: Boom, q: Array, name: str) -> None:
    """Check that a pose keeps the clearance to every shape, if the boom has shapes.

    Raises:
        InfeasibleError: it does not; the message names the link, the shape and the distance.
    """
    if boom.keep_out is None:
        return
    found = clearance(boom, q)
    if found.distance < boom.keep_out.clearance:
        raise InfeasibleError(f"{name}: {sentence(boom, found)}")


def require_path_clear(boom: Boom, path: Path) -> None:
    """Check that a path keeps the clearance to every shape, if the boom has shapes.

    Raises:
        InfeasibleError: it does not; the message names the place on the path, the link, the shape
            and the distance.
    """
    if boom.keep_out is None:
        return
    found = least_clearance(boom, path)
    if found.distance < boom.keep_out.clearance:
        raise InfeasibleError(
            f"at {found.s:.1%} of the path {sentence(boom, found)}; detours are planned for straight joint moves only"
        )


def sentence(boom: Boom, found: Clearance) -> str:
    """Describe a nearest approach and the required clearance."""
    assert boom.keep_out is not None
    how = f"comes within {found.distance * 1e3:.0f} mm of" if found.distance > 0.0 else "runs into"
    return f"the {found.link} {how} the {found.shape}; the required clearance is {boom.keep_out.clearance * 1e3:.0f} mm"


def _nearest(boom: Boom, distances: Array) -> Clearance:
    assert boom.keep_out is not None
    link, shape = np.unravel_index(int(np.argmin(distances)), distances.shape)
    return Clearance(float(distances[link, shape]), LINKS[link], boom.keep_out.shapes[shape].name)


@lru_cache(maxsize=8)
def _reach(boom: Boom) -> Array:
    """Return a bound (5,) on how far any point of the arm moves per rad or m of each joint."""
    g, keep = boom.geometry, boom.keep_out
    assert keep is not None
    g.require_parallelogram("the check of keep-out shapes")
    tip = g.L8 + max(keep.payload_radius, keep.link_radius)
    actuator = np.hypot(g.L7 + float(boom.limits.upper[3]), g.L6) + tip
    inner = g.L9 + keep.link_radius
    lower = max(g.L3, actuator) + keep.link_radius
    return np.array([abs(g.L2) + inner + lower, inner, lower, 1.0, tip])


def _distances(boom: Boom, q: Array) -> Array:
    """Return the distance [m] of every link to every shape at q (n, 5), shape (n, 7, shapes)."""
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
            "the boom's file has keep_out shapes, which need the extra keep-out: "
            "run pip install '.[keep-out]' in the folder of boom"
        ) from None
    return cast(ModuleType, coal)


def _solid(coal: ModuleType, shape: Box | Capsule) -> tuple[Any, Any]:
    """Return the shape and its pose as coal's objects."""
    if isinstance(shape, Capsule):
        return _rounded(coal, shape.start, shape.end, shape.radius)
    return coal.Box(*shape.size), coal.Transform3s(np.eye(3), shape.center)


def _rounded(coal: ModuleType, start: Array, end: Array, radius: float) -> tuple[Any, Any]:
    """Return the capsule about a line, or the ball about a point, and its pose, as coal's objects.

    The axis of coal's capsule is z.
    """
    axis = end - start
    length = float(np.linalg.norm(axis))
    middle = (start + end) / 2.0
    if length == 0.0:
        return coal.Sphere(radius), coal.Transform3s(np.eye(3), middle)
    z = axis / length
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    return coal.Capsule(radius, length), coal.Transform3s(np.stack([x, np.cross(z, x), z], axis=-1), middle)
