"""A planned motion, continuous from stop to stop, and its samples."""

from dataclasses import dataclass, replace
from functools import cached_property

from boom_model.arrays import Array
from planner.motion.trajectory import Trajectory, at_rest, concatenate, sample
from planner.motion.vehicle import LEVEL, VehicleCase
from planner.timing.time_law import Motion

CHECKS_PER_STEP = 10
"""Ratio of the sampling step to the step of the grid on which a planned motion is checked."""

SHOCK_SAMPLES = 20
"""Number of samples of a shock that gives its peak to 0.3 %."""


@dataclass(frozen=True, eq=False)
class PlannedMotion:
    """Motions from stop to stop, without loads or checks."""

    motions: tuple[Motion, ...]
    """Empty if start and goal are the same joint position."""
    start: Array
    """(5,) joint position."""
    step: float
    """Longest sampling step [s]."""
    notes: tuple[str, ...] = ()
    """Notes for the report."""
    average_torque: bool = False
    """Whether planning limited the gearboxes' average torque as well."""

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return sum(motion.duration for motion in self.motions)

    @cached_property
    def trajectory(self) -> Trajectory:
        """Samples of the motion at its sampling step, with a reference to the motion itself."""
        return replace(self._sampled(self.step), planned=self)

    def fine(self, vehicle: VehicleCase = LEVEL) -> Trajectory:
        """Return the motion on the grid on which it is checked.

        The grid has CHECKS_PER_STEP intervals per step, or more if the vehicle's shock needs them.
        """
        step = self.step / CHECKS_PER_STEP
        return self._sampled(step if vehicle.peak == 0.0 else min(step, vehicle.shock_duration / (2 * SHOCK_SAMPLES)))

    def _sampled(self, step: float) -> Trajectory:
        if not self.motions:
            return at_rest(self.start, self.notes)
        return concatenate([sample(motion, step) for motion in self.motions], self.notes)
