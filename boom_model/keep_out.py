"""Shapes that the arm must keep away from, such as the ground and the body of the vehicle."""

from dataclasses import dataclass

from boom_model.arrays import Array
from boom_model.provenance import Origin


@dataclass(frozen=True, eq=False)
class Box:
    """A box along the axes of frame 1."""

    name: str
    center: Array
    """(3,) [m]"""
    size: Array
    """(3,) full edge lengths [m]."""
    origin: Origin


@dataclass(frozen=True, eq=False)
class Capsule:
    """All points within `radius` [m] of the line from start to end, in frame 1."""

    name: str
    start: Array
    """(3,) [m]"""
    end: Array
    """(3,) [m]"""
    radius: float
    origin: Origin


@dataclass(frozen=True, eq=False)
class KeepOut:
    """The keep-out shapes, and the thickness assumed for the arm."""

    shapes: tuple[Box | Capsule, ...]
    clearance: float
    """Least distance between arm and shapes [m]."""
    link_radius: float
    """Radius [m] of the capsule about the line between its pins that stands for each link."""
    payload_radius: float
    """Radius [m] of the ball about the tip that stands for the payload."""
    origin: Origin
    """Origin of the three lengths."""
