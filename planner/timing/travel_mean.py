"""Means of a load over a motion, weighted by travel, as on gearbox datasheets."""

import numpy as np

from boom_model.arrays import Array, read_only


def trapezoid_weights(t: Array) -> Array:
    """Return the weights (n,) [s] of the trapezoidal rule at times t (n,)."""
    weight = np.zeros(t.shape)
    weight[:-1] += np.diff(t) / 2.0
    weight[1:] += np.diff(t) / 2.0
    return read_only(weight)


def travel_mean(weight: Array, load: Array, rate: Array) -> float | None:
    """Return the cubic mean of a load weighted by travel; None without travel.

        (int |rate| |load|^3 dt / int |rate| dt)^(1/3)

    Args:
        weight: (n,) duration of each sample [s].
        load: (n,) torque or force.
        rate: (n,) velocity.
    """
    share = weight * np.abs(rate)
    travel = float(share.sum())
    return float((share @ np.abs(load) ** 3 / travel) ** (1.0 / 3.0)) if travel > 0.0 else None


def average_torque(t: Array, tau: Array, qd: Array) -> float | None:
    """Return the cubic mean of the torque weighted by speed [Nm]; None for a joint at rest.

        (int |qd| |tau|^3 dt / int |qd| dt)^(1/3)

    This is Harmonic Drive's average torque. It does not include static torque at standstill, which
    the hold check covers.
    """
    return travel_mean(trapezoid_weights(t), tau, qd)
