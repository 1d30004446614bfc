"""Curves of the tip: a straight line, an arc of a circle, or any other of the same form."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from boom_model import InputError
from boom_model.arrays import Array, checked, read_only


@dataclass(frozen=True, eq=False)
class TipLine:
    """Straight line of the tip from start to goal, (3,) each [m]."""

    start: Array
    goal: Array

    def __call__(self, s: Array) -> Array:
        """Return positions (..., 3) at s (...)."""
        s = np.asarray(s, dtype=float)[..., None]
        line: Array = (1.0 - s) * self.start + s * self.goal
        return line

    @property
    def length(self) -> float:
        """Length [m]."""
        return float(np.linalg.norm(self.goal - self.start))


@dataclass(frozen=True, eq=False)
class TipArc:
    """Arc of a circle of the tip, traversed at constant speed in s.

    position(s) = center + radius (cos(s angle) first + sin(s angle) second)
    """

    center: Array
    first: Array
    """(3,) unit vector from the center to the start"""
    second: Array
    """(3,) unit vector in the circle's plane along the direction of travel at the start"""
    radius: float
    angle: float
    """[rad]"""

    @staticmethod
    def through(start: ArrayLike, via: ArrayLike, goal: ArrayLike) -> "TipArc":
        """Return the arc from start through via to goal, (3,) each [m].

        Raises:
            InputError: a point is not finite, or the three points lie on a line.
        """
        a, b, c = (checked(name, p, 3) for name, p in (("start", start), ("via", via), ("goal", goal)))
        u, v = b - a, c - a
        normal = np.cross(u, v)
        square = float(normal @ normal)
        if square <= 1e-12 * float((u @ u) * (v @ v)):
            raise InputError(f"via {b.tolist()} lies on a line with start and goal; an arc needs three points of a circle")
        center = a + ((v @ v) * np.cross(normal, u) + (u @ u) * np.cross(v, normal)) / (2.0 * square)
        radius = float(np.linalg.norm(a - center))
        first = (a - center) / radius
        second = np.cross(normal / np.sqrt(square), first)
        angle = float(np.arctan2((c - center) @ second, (c - center) @ first) % (2.0 * np.pi))
        return TipArc(read_only(center), read_only(first), read_only(second), radius, angle)

    def __call__(self, s: Array) -> Array:
        """Return positions (..., 3) at s (...)."""
        turn = np.asarray(s, dtype=float)[..., None] * self.angle
        arc: Array = self.center + self.radius * (np.cos(turn) * self.first + np.sin(turn) * self.second)
        return arc

    @property
    def length(self) -> float:
        """Length [m]."""
        return self.radius * self.angle


class TipCurve(Protocol):
    """Smooth curve of the tip over s from 0 to 1."""

    def __call__(self, s: Array) -> Array:
        """Return positions (..., 3) at s (...)."""
        ...

    @property
    def length(self) -> float:
        """Length [m]."""
        ...
