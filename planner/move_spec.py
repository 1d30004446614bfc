"""The description of a move, which Python, the command and mission files share."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from boom_model import InputError
from boom_model.arrays import scalar
from boom_model.kinematics.constraints import Constraint, parse_constraint
from planner.motion.trajectory import STEP, check_size
from planner.motion.vehicle import LEVEL, VehicleCase, load_case
from planner.paths.legs import Along
from planner.paths.targets import Target, parse_along, parse_pitch, parse_target
from planner.timing.profile import Cubic, TimingProfile
from planner.timing.timing import Timing


@dataclass(frozen=True, eq=False)
class MoveSpec:
    """A move as it is asked for. `MoveSpec.of` builds it from words or objects, and checks it."""

    start: Target
    goal: Target
    via: tuple[Target, ...]
    """Targets on the way."""
    stop_at_via: bool
    """Whether the move stops at them; else it passes them on a smooth path."""
    constraint: Constraint
    """The extra constraint of tip targets."""
    pitch: float | None
    """End effector's elevation at tip targets [rad]; None lets the constraint choose it."""
    along: Along
    """What goes straight: "joint", "line", or a point (3,) [m] on an arc of the tip."""
    profile: TimingProfile
    duration: float | None
    """[s]; None is the least that the limits allow."""
    rate: float | None
    """[Hz] of a controller, on whose clock samples and stops are."""
    vehicle: VehicleCase
    step: float
    """Longest sampling step [s]; with a rate, its period."""

    @staticmethod
    def of(
        start: Target,
        goal: Target,
        *,
        via: Sequence[Target] = (),
        stop_at_via: bool = True,
        constraint: str | Constraint = "horizontal",
        pitch: str | float | None = "down",
        along: str | ArrayLike = "joint",
        profile: str | TimingProfile = "cubic",
        duration: float | None = None,
        rate: float | None = None,
        vehicle: str | VehicleCase = LEVEL,
        step: float = STEP,
    ) -> "MoveSpec":
        """A move from words, as in the command, or from objects.

        Args:
            start, goal, via: "transport", "q=0,90,180,0,0" (deg, the extension in m), "tip=1.4,0,1.0" (m), a joint position
                (5,) [rad, the extension in m], or a TipTarget.
            stop_at_via: a cubic with velocities at its waypoints passes them whatever this says.
            constraint: "horizontal", "least-torque", "extension=0.25", ..., or the constraint itself.
            pitch: "down", "level", "up", degrees as text, or [rad]; "free" or None lets the constraint choose it.
            along: "joint", "line", "arc=X,Y,Z", or the arc's point (3,) [m].
            profile: "cubic", "quintic", "trapezoidal", "jerk-limited", "time-optimal", or a profile with its options, such as
                TimeOptimal(jerk_bound=True).
            duration: [s]; None is the least that the limits allow. A longer one slows the least-time motion evenly.
            rate: a controller's [Hz]: the samples are on its clock, and the move lasts a whole number of its periods, from
                stop to stop. Takes the place of `step`.
            vehicle: "slope", a FILE.toml, or a case. Planning accounts for its slope only; checks include track and shock.
            step: longest sampling step [s].

        Raises:
            InputError: a word is not known, a number is malformed or out of range, or the samples would be too many.

        >>> MoveSpec.of("transport", "tip=1.4,0,1.0", profile="time-optimal", constraint="least-torque").profile
        TimeOptimal(jerk_bound=False, average_torque=False)
        """
        timing = Timing.of(profile, duration, rate=rate)
        if not scalar("step", step) > 0.0:
            raise InputError(f"step is {step:g} s; it must be above 0 s")
        step = step if rate is None else 1.0 / rate
        if duration is not None:
            check_size(duration, step)
        passes = isinstance(timing.profile, Cubic) and timing.profile.velocities is not None
        return MoveSpec(
            start=_target(start),
            goal=_target(goal),
            via=tuple(_target(target) for target in via),
            stop_at_via=stop_at_via and not passes,
            constraint=parse_constraint(constraint) if isinstance(constraint, str) else constraint,
            pitch=parse_pitch(pitch) if isinstance(pitch, str) else None if pitch is None else scalar("pitch", pitch),
            along=parse_along(along) if isinstance(along, str) else np.asarray(along, dtype=float),
            profile=timing.profile,
            duration=duration,
            rate=rate,
            vehicle=load_case(vehicle) if isinstance(vehicle, str) else vehicle,
            step=step,
        )

    @property
    def targets(self) -> tuple[Target, ...]:
        """Start, targets on the way, and goal."""
        return (self.start, *self.via, self.goal)

    @property
    def timing(self) -> Timing:
        """Profile, duration and rate."""
        return Timing(self.profile, self.duration, self.rate)


def _target(target: Target) -> Target:
    return parse_target(target) if isinstance(target, str) else target
