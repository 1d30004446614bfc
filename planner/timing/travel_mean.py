"""Means of a load over a motion, weighted by travel, as gearbox makers judge them."""

import numpy as np

from boom_model.arrays import Array, read_only


def trapezoid_weights(t: Array) -> Array:
    """Weights (n,) [s] of the trapezoidal rule at times t (n,)."""
    weight = np.zeros(t.shape)
    weight[:-1] += np.diff(t) / 2.0
    weight[1:] += np.diff(t) / 2.0
    return read_only(weight)


def travel_mean(weight: Array, load: Array, rate: Array) -> float | None:
    """Cube mean of a load weighted by travel, (int |rate| |load|^3 dt / int |rate| dt)^(1/3); None without travel.

    Args:
        weight: (n,) how long each sample lasts [s].
        load, rate: (n,)
    """
    share = weight * np.abs(rate)
    travel = float(share.sum())
    return float((share @ np.abs(load) ** 3 / travel) ** (1.0 / 3.0)) if travel > 0.0 else None


def average_torque(t: Array, tau: Array, qd: Array) -> float | None:
    """Cube mean of the torque weighted by speed, (int |qd| |tau|^3 dt / int |qd| dt)^(1/3) [Nm]; None for a joint that rests.

    Harmonic Drive's average torque. Its weight loses what is only held: see the hold row.
    """
    return travel_mean(trapezoid_weights(t), tau, qd)
