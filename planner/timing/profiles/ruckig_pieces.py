"""ruckig's answers as polynomials."""

from typing import Any

import numpy as np

from boom_model.arrays import Array


def pieces(profile: Any) -> tuple[Array, Array]:
    """Durations (9,) and coefficients (4, 9), highest power first, of one degree of freedom of a ruckig trajectory.

    The first two pieces brake a state that is beyond its limits, the other seven are the profile itself.
    """
    brake = profile.brake
    t = np.array([*brake.t, *profile.t])
    p, v, a, j = (np.array([*first, *then[:7]]) for first, then in zip(
        (brake.p, brake.v, brake.a, brake.j), (profile.p, profile.v, profile.a, profile.j), strict=True
    ))  # fmt: skip
    return t, np.stack([j / 6.0, a / 2.0, v, p])
