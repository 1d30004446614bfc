"""A planned motion: continuous from stop to stop, and what it is sampled at."""

from dataclasses import dataclass, replace
from functools import cached_property

from boom_model.arrays import Array
from planner.motion.trajectory import Trajectory, at_rest, joined, sample
from planner.motion.vehicle import LEVEL, VehicleCase
from planner.timing.time_law import Motion

CHECKS_PER_STEP = 10
"""A planned motion is checked on a grid this many times finer than it is sampled."""

SHOCK_SAMPLES = 20
"""Samples that a shock must have for its peak to be seen, to 0.3 %."""


@dataclass(frozen=True, eq=False)
class PlannedMotion:
    """Motions from stop to stop, without loads or checks."""

    motions: tuple[Motion, ...]
    """None where start and goal are the same joint position."""
    start: Array
    """(5,) joint position."""
    step: float
    """Longest sampling step [s]."""
    notes: tuple[str, ...] = ()
    """What a reader of a report must know."""
    average_torque: bool = False
    """Whether the gearboxes' average torque was a limit too."""

    @property
    def duration(self) -> float:
        """[s]"""
        return sum(motion.duration for motion in self.motions)

    @cached_property
    def trajectory(self) -> Trajectory:
        """The motion at its sampling step; it knows what it was sampled from."""
        return replace(self._sampled(self.step), planned=self)

    def fine(self, vehicle: VehicleCase = LEVEL) -> Trajectory:
        """The motion on the grid that it is checked on: CHECKS_PER_STEP a step, more where the vehicle's shock needs it."""
        step = self.step / CHECKS_PER_STEP
        return self._sampled(step if vehicle.peak == 0.0 else min(step, vehicle.shock_duration / (2 * SHOCK_SAMPLES)))

    def _sampled(self, step: float) -> Trajectory:
        if not self.motions:
            return at_rest(self.start, self.notes)
        return joined([sample(motion, step) for motion in self.motions], self.notes)
