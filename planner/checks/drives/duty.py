"""Duty cycle of the drives: the time of each sample in the cycle, and what is required of it."""

from dataclasses import dataclass

import numpy as np

from boom_model import Sourced
from boom_model.arrays import Array, Mask
from planner.timing.travel_mean import trapezoid_weights, travel_mean


@dataclass(frozen=True, eq=False)
class Duty:
    """Duty cycle over the samples of a motion. A single move is repeated without a pause."""

    weight: Array
    """(n,) time of each sample in the whole cycle [s]: integral f dt = sum weight f."""
    powered: Mask
    """(n,) whether all motors are on. In a pause only motors without a brake stay on."""
    required_life: Sourced[float] | None = None
    """Required life of the gearboxes, pauses included [s]."""
    tip_tolerance: Sourced[float] | None = None
    """Largest allowed deflection of the tip through the drives [m]."""

    @staticmethod
    def alone(t: Array) -> "Duty":
        """Return the duty cycle of a motion at times t (n,) that is repeated without a pause."""
        return Duty(trapezoid_weights(t), np.ones(t.shape, dtype=bool))

    @property
    def duration(self) -> float:
        """Duration of the cycle [s]."""
        return float(self.weight.sum())

    def mean(self, values: Array) -> float:
        """Return the mean of values (n,) over time; over the samples if the duration is 0."""
        return float(self.weight @ values) / self.duration if self.duration > 0.0 else float(values.mean())

    def travel_mean(self, load: Array, rate: Array) -> float | None:
        """Return the cube mean of a load, weighted by travel; None without travel.

        (int |rate| |load|^3 dt / int |rate| dt)^(1/3)
        """
        return travel_mean(self.weight, load, rate)
