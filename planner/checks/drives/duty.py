"""How long each sample of a motion lasts in the cycle that a drive repeats, and what the cycle has to survive."""

from dataclasses import dataclass

import numpy as np

from boom_model import Sourced
from boom_model.arrays import Array, Mask
from planner.timing.travel_mean import trapezoid_weights, travel_mean


@dataclass(frozen=True, eq=False)
class Duty:
    """A cycle over the samples of a motion. A lone move is its own cycle, repeated without a pause."""

    weight: Array
    """(n,) how long each sample lasts in the whole cycle [s]: integral f dt = sum weight f."""
    powered: Mask
    """(n,) whether the motors are on; False in a pause, where only a motor without a brake stays on."""
    required_life: Sourced[float] | None = None
    """What the gearboxes are to live, pauses included [s]."""
    tip_tolerance: Sourced[float] | None = None
    """How far the drives may let the tip deflect [m]."""

    @staticmethod
    def alone(t: Array) -> "Duty":
        """The cycle that a motion at times t (n,) is by itself."""
        return Duty(trapezoid_weights(t), np.ones(t.shape, dtype=bool))

    @property
    def duration(self) -> float:
        return float(self.weight.sum())

    def mean(self, values: Array) -> float:
        """Mean over time of values (n,); over the samples of a cycle of no duration."""
        return float(self.weight @ values) / self.duration if self.duration > 0.0 else float(values.mean())

    def travel_mean(self, load: Array, rate: Array) -> float | None:
        """Cube mean of a load weighted by travel, (int |rate| |load|^3 dt / int |rate| dt)^(1/3); None without travel."""
        return travel_mean(self.weight, load, rate)
