"""Solids of the links, pins and payload, as recordings and the page draw them.

The lengths are the model's; the thickness is for display only.
"""

from dataclasses import dataclass

import numpy as np

from boom_model import Boom
from boom_model.arrays import Array
from boom_model.kinematics.frames import R_LINK_BODY

PIN_LENGTH, PIN_RADIUS = 0.16, 0.018
"""Size of a drawn pin [m]."""

_STEEL = 7850.0  # [kg/m^3]: the payload is drawn as a steel ball


@dataclass(frozen=True)
class Bar:
    """A box along the link axes (e, p, n).

    It runs from e[0] to e[1] along the link, from p[0] to p[1] across it, and over `depth` along
    the pins [m].
    """

    e: tuple[float, float]
    p: tuple[float, float]
    depth: float

    def low(self) -> tuple[float, float, float]:
        """Return one corner along (e, p, n)."""
        return self.e[0], self.p[0], -self.depth / 2.0

    def high(self) -> tuple[float, float, float]:
        """Return the opposite corner along (e, p, n)."""
        return self.e[1], self.p[1], self.depth / 2.0


def bars(boom: Boom) -> dict[str, list[Bar]]:
    """Return the solids of every body.

    The extension is a rod. A length `grip` of it is visible when it is retracted, and the same
    length stays inside at full stroke.
    """
    g, grip = boom.geometry, 0.05
    rod = max(float(boom.limits.upper[3]) + 2.0 * grip, g.L7)
    return {
        "base": [Bar((-0.09, 0.09), (0.0, g.L1 - 0.025), 0.18)],
        "lower": [Bar((0.0, g.L3), (-0.025, 0.025), 0.10)],
        "inner": [Bar((0.0, g.L9), (-0.025, 0.025), 0.06)],
        "outer": [Bar((0.0, g.L4), (-0.02, 0.02), 0.05)],
        "upper": [
            Bar((0.0, g.L5), (-0.025, 0.025), 0.10),
            Bar((-g.L7 + grip, rod - g.L7), (-g.L6 - 0.03, -g.L6 + 0.03), 0.08),
        ],
        "extension": [Bar((0.0, rod), (-0.018, 0.018), 0.04)],
        "end_effector": [Bar((-0.025, 0.025), (-0.025, g.L8), 0.14)],
    }


def corners(body: str, bars: list[Bar]) -> tuple[Array, Array]:
    """Return opposite corners (k, 3) of the bars of a body, along the axes of its frame [m]."""
    low, high = (np.array([corner(bar) for bar in bars]) @ R_LINK_BODY[body] for corner in (Bar.low, Bar.high))
    return low, high


def pins(boom: Boom) -> dict[str, Array]:
    """Return the middles (k, 3) of the pins in their bodies' frames [m].

    These are the shoulder and pin 6, pins 8 and 7, and the wrist. Each pin lies along z of its
    body's frame.
    """
    along = {"lower": (0.0, boom.geometry.L3), "upper": (0.0, boom.geometry.L5), "end_effector": (0.0,)}
    return {name: np.array([(e, 0.0, 0.0) for e in places]) @ R_LINK_BODY[name] for name, places in along.items()}


def payload_radius(boom: Boom) -> float:
    """Return the radius [m] of a steel ball of the payload's mass."""
    return float((boom.payload.mass / _STEEL * 0.75 / np.pi) ** (1.0 / 3.0))
