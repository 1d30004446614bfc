"""Cosine and sine of one angle."""

from math import tan
from typing import TypeVar

import numpy as np

from boom_model.arrays import Array

Angle = TypeVar("Angle", Array, float, Array | float)


def cosine_and_sine(angle: Angle) -> tuple[Angle, Angle]:
    """Return cosine and sine of an angle [rad], in its shape, to 4e-16.

        t = tan(angle / 2),  u = 2 / (1 + t^2),  cos = u - 1,  sin = u t

    NumPy's tangent is vectorised for doubles, its cosine and sine are not. A plain number stays
    one.
    """
    t = tan(0.5 * angle) if isinstance(angle, float) else np.tan(0.5 * angle)
    u = 2.0 / (1.0 + t * t)
    return u - 1.0, u * t
