"""Shapes that the arm must keep away from, such as the ground and the vehicle's body."""

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
    """(3,) whole lengths [m]."""
    origin: Origin


@dataclass(frozen=True, eq=False)
class Capsule:
    """All that is within `radius` of the line from start to end, in frame 1."""

    name: str
    start: Array
    """(3,) [m]"""
    end: Array
    """(3,) [m]"""
    radius: float
    origin: Origin


@dataclass(frozen=True, eq=False)
class KeepOut:
    """What the arm must keep away from, and how thick the arm is taken to be."""

    shapes: tuple[Box | Capsule, ...]
    clearance: float
    """Least distance [m] between arm and shapes."""
    link_radius: float
    """Each link is taken as a capsule of this radius [m] about the line between its pins."""
    payload_radius: float
    """The payload is taken as a ball of this radius [m] about the tip."""
    origin: Origin
    """Of the three lengths."""
