"""Description of a move, shared by Python, the command and mission files.

`MoveSpec` describes a move with objects, `MoveWords` with words. The options of the command are
made from the fields of `MoveWords`, so a new option is described once.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from boom_model import InputError
from boom_model.arrays import scalar
from boom_model.kinematics.constraints import CONSTRAINTS, Constraint, parse_constraint
from boom_model.plausible import DURATION, RATE
from planner.motion.trajectory import STEP, check_size
from planner.motion.vehicle import LEVEL, VehicleCase, load_case
from planner.option_field import option_field
from planner.paths.legs import Along
from planner.paths.targets import Target, parse_along, parse_joint_velocity, parse_pitch, parse_target
from planner.timing.profile import PROFILES, Cubic, TimingProfile, parse_profile
from planner.timing.timing import Timing


@dataclass(frozen=True, eq=False)
class MoveSpec:
    """Description of a move. `MoveSpec.of` makes one from words or objects, and checks it."""

    start: Target
    goal: Target
    via: tuple[Target, ...]
    """Targets on the way."""
    stop_at_via: bool
    """Whether the move stops at them; if not, it passes them on a smooth path."""
    constraint: Constraint
    """The extra constraint of tip targets."""
    pitch: float | None
    """Elevation of the end effector at tip targets [rad]; None lets the constraint choose it."""
    along: Along
    """Kind of path: "joint", "line", or a point (3,) [m] on an arc of the tip."""
    profile: TimingProfile
    duration: float | None
    """[s]; None is the shortest that the limits allow."""
    rate: float | None
    """Rate of a controller [Hz], on whose clock samples and stops lie."""
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
        """Return a move from words, as in the command, or from objects.

        Args:
            start: "transport", "q=0,90,180,0,0" (deg, m for the extension), "tip=1.4,0,1.0" (m), a
                joint position (5,) [rad, m for the extension], or a TipTarget.
            goal: as `start`.
            via: targets on the way, each as `start`.
            stop_at_via: whether to stop at them. A cubic with velocities at waypoints never does.
            constraint: "horizontal", "least-torque", "extension=0.25", ..., or a constraint object.
            pitch: "down", "level", "up", degrees as text, or [rad]; "free" or None lets the
                constraint choose it.
            along: "joint", "line", "arc=X,Y,Z", or a point (3,) [m] on the arc.
            profile: "cubic", "quintic", "trapezoidal", "jerk-limited", "time-optimal",
                "least-energy", or a profile with its options, such as TimeOptimal(jerk_bound=True).
            duration: [s]; None is the shortest that the limits allow. A longer one slows that
                motion down uniformly. The least-energy profile needs it, and may take less.
            rate: rate of a controller [Hz]. The samples lie on its clock, and the motion from stop
                to stop lasts a whole number of its periods. Replaces `step`.
            vehicle: "slope", a FILE.toml, or a vehicle case. Planning accounts for its slope only;
                checks include track and shock.
            step: longest sampling step [s].

        Raises:
            InputError: a word is unknown, a number is malformed or out of range, or there would be
                too many samples.

        >>> MoveSpec.of("transport", "tip=1.4,0,1.0", profile="time-optimal").profile
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


@dataclass(frozen=True)
class MoveWords:
    """Description of a move in words: the options of the command and the keys of a mission."""

    start: str
    goal: str
    profile: str = option_field("cubic", "How the path is timed.", choices=tuple(map(str, PROFILES)))
    via: tuple[str, ...] = option_field((), "Target on the way, with a stop there; may be repeated.", "TARGET")
    pass_via: bool = option_field(False, "Pass the targets on the way on a smooth path, without a stop.")
    via_velocity: tuple[str, ...] = option_field(
        (),
        "Velocity of the cubic at each --via in order, without a stop. Default: continuous acceleration.",
        "DEG/S,DEG/S,DEG/S,M/S,DEG/S",
    )
    along: str = option_field(
        "joint",
        "Kind of path: straight in the joints, a line between tip targets, or an arc of the tip through a point.",
        "joint|line|arc=X,Y,Z",
    )
    duration: float | None = option_field(
        None, "Duration. Default: the shortest that the limits allow.", "S", quantity=DURATION
    )
    jerk_bound: bool = option_field(False, "Keep the jerk limits as well (time-optimal profile).")
    average_torque: bool = option_field(False, "Keep the gearboxes' average torque as well (time-optimal profile).")
    rate: float | None = option_field(None, "Rate of a controller; samples and stops lie on its clock.", "HZ", quantity=RATE)
    pitch: str = option_field(
        "down", "Elevation of the end effector at a tip target; free: the constraint chooses it.", "down|level|up|free|DEG"
    )
    constraint: str = option_field("horizontal", f"Extra constraint of a tip target: {CONSTRAINTS}.", "CONSTRAINT")
    vehicle: str | None = option_field(
        None, "Vehicle case: slope, track, shock, ditch or a FILE.toml. Default: at rest on level ground.", "CASE"
    )

    def spec(self) -> MoveSpec:
        """Return the move as objects.

        Raises:
            InputError: a word is unknown, a number is malformed or out of range, or options
                contradict each other.
        """
        velocities = [parse_joint_velocity(text) for text in self.via_velocity]
        if velocities and len(velocities) != len(self.via):
            raise InputError(f"via velocity: {len(velocities)} given for {len(self.via)} via; give one for each")
        return MoveSpec.of(
            self.start,
            self.goal,
            via=self.via,
            stop_at_via=not self.pass_via,
            constraint=self.constraint,
            pitch=self.pitch,
            along=self.along,
            profile=parse_profile(
                self.profile,
                jerk_bound=self.jerk_bound,
                average_torque=self.average_torque,
                velocities=velocities or None,
            ),
            duration=self.duration,
            rate=self.rate,
            vehicle=LEVEL if self.vehicle is None else self.vehicle,
        )


def _target(target: Target) -> Target:
    return parse_target(target) if isinstance(target, str) else target
