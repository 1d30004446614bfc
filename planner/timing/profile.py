"""Timing profiles, each with its own options.

To add a profile, write its law in a file of `profiles/`, write a class for it here, and add the
class to PROFILES.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import ClassVar

from numpy.typing import ArrayLike

from boom_model import BaseMotion, Boom, InputError
from boom_model.arrays import Array, checked, read_only
from boom_model.words import unknown
from planner.paths.clearance import require_path_clear
from planner.paths.path import Path, SplinePath
from planner.timing.time_law import Motion, TimeLaw


class Profile(StrEnum):
    """Words for the profiles."""

    CUBIC = "cubic"
    QUINTIC = "quintic"
    TRAPEZOIDAL = "trapezoidal"
    JERK_LIMITED = "jerk-limited"
    TIME_OPTIMAL = "time-optimal"
    LEAST_ENERGY = "least-energy"


@dataclass(frozen=True)
class TimingProfile(ABC):
    """Way of timing a path.

    A law's library is imported where it is used, because these libraries are slow to import.
    """

    name: ClassVar[Profile]
    needs_duration: ClassVar[bool] = False
    """Whether the profile has no shortest time of its own."""

    @abstractmethod
    def law(self, boom: Boom, path: Path, base: BaseMotion | None = None) -> TimeLaw:
        """Return the time law along a path. `base` may be tilted, but must not move.

        Raises:
            InfeasibleError: no law respects the limits.
        """

    def motion(self, boom: Boom, path: Path, base: BaseMotion | None = None) -> Motion:
        """Return the motion along a path in the shortest time of this profile.

        Raises:
            InfeasibleError: as `law`.
        """
        return Motion(path, self.law(boom, path, base))

    @property
    def limits_average_torque(self) -> bool:
        """Whether the profile respects the gearboxes' average torque limit."""
        return False

    @property
    def exact_on_lines(self) -> bool:
        """Whether the law respects every limit between its grid points on a straight joint path."""
        return True

    def __str__(self) -> str:
        return str(self.name)


@dataclass(frozen=True, eq=False)
class Cubic(TimingProfile):
    """Cubic polynomial in time from rest to rest.

    Through waypoints without a stop it is a cubic spline.
    """

    name = Profile.CUBIC
    velocities: Array | None = None
    """(k, 5) joint velocities at the k waypoints [rad/s, m/s for the extension]. None makes the
    acceleration continuous."""

    @staticmethod
    def with_velocities(velocities: ArrayLike) -> "Cubic":
        """Return the cubic with given velocities at its waypoints.

        Raises:
            InputError: the velocities are not finite or not (k, 5).
        """
        return Cubic(read_only(checked("via_velocities", velocities, 5)))

    def law(self, boom: Boom, path: Path, base: BaseMotion | None = None) -> TimeLaw:
        """Return the time law along a path; see `TimingProfile.law`."""
        from planner.timing.profiles.cubic import cubic

        return cubic(boom, path, base)

    def motion(self, boom: Boom, path: Path, base: BaseMotion | None = None) -> Motion:
        """Return the motion along a path; see `TimingProfile.motion`.

        Through waypoints, the cubics have a path of their own, which must keep its clearance as
        well.
        """
        if not isinstance(path, SplinePath):
            return super().motion(boom, path, base)
        from planner.timing.profiles.cubic_through import cubic_through

        motion = cubic_through(boom, path.waypoints, base)
        require_path_clear(boom, motion.path)  # it differs from the path that was checked before
        return motion


@dataclass(frozen=True)
class Quintic(TimingProfile):
    """Quintic polynomial in time: zero acceleration at both ends."""

    name = Profile.QUINTIC

    def law(self, boom: Boom, path: Path, base: BaseMotion | None = None) -> TimeLaw:
        """Return the time law along a path; see `TimingProfile.law`."""
        from planner.timing.profiles.quintic import quintic

        return quintic(boom, path, base)


@dataclass(frozen=True)
class Trapezoidal(TimingProfile):
    """Constant acceleration, constant speed, constant deceleration."""

    name = Profile.TRAPEZOIDAL

    def law(self, boom: Boom, path: Path, base: BaseMotion | None = None) -> TimeLaw:
        """Return the time law along a path; see `TimingProfile.law`."""
        from planner.timing.profiles.trapezoidal import trapezoidal

        return trapezoidal(boom, path, base)


@dataclass(frozen=True)
class JerkLimited(TimingProfile):
    """Shortest motion within constant limits on speed, acceleration and jerk along the path."""

    name = Profile.JERK_LIMITED

    def law(self, boom: Boom, path: Path, base: BaseMotion | None = None) -> TimeLaw:
        """Return the time law along a path; see `TimingProfile.law`."""
        from planner.timing.profiles.jerk_limited import jerk_limited

        return jerk_limited(boom, path, base)

    @property
    def exact_on_lines(self) -> bool:
        """Whether the law respects every limit between its grid points on a straight joint path."""
        return False


@dataclass(frozen=True)
class TimeOptimal(TimingProfile):
    """Shortest motion along the path within the limits of joints and drives."""

    name = Profile.TIME_OPTIMAL
    jerk_bound: bool = False
    """Respect the jerk limits as well, with zero acceleration at both ends."""
    average_torque: bool = False
    """Respect the gearboxes' average torque limit as well."""

    def law(self, boom: Boom, path: Path, base: BaseMotion | None = None) -> TimeLaw:
        """Return the time law along a path; see `TimingProfile.law`."""
        from planner.timing.profiles.average_torque import within_average_torque
        from planner.timing.profiles.jerk_bound import jerk_bounded, with_jerk_bound
        from planner.timing.profiles.jerk_limited import evenly_limited
        from planner.timing.profiles.time_optimal import time_optimal

        if self.average_torque:
            law = within_average_torque(boom, path, base)
            return with_jerk_bound(boom, path, law, base) if self.jerk_bound else law
        if not self.jerk_bound:
            return time_optimal(boom, path, base)
        laws = jerk_bounded(boom, path, base), evenly_limited(boom, path, base)[0]
        return min(laws, key=lambda each: each.duration)

    @property
    def limits_average_torque(self) -> bool:
        """Whether the profile respects the gearboxes' average torque limit."""
        return self.average_torque

    @property
    def exact_on_lines(self) -> bool:
        """Whether the law respects every limit between its grid points on a straight joint path."""
        return False


@dataclass(frozen=True)
class LeastEnergy(TimingProfile):
    """Motion of least loss in the windings within a duration and all limits."""

    name = Profile.LEAST_ENERGY
    needs_duration = True
    within: float | None = None
    """Largest duration along the path [s]; `timed` fills it in from the duration of the whole move.
    """

    def law(self, boom: Boom, path: Path, base: BaseMotion | None = None) -> TimeLaw:
        """Return the time law along a path; see `TimingProfile.law`.

        Raises:
            InputError: no duration is given, or no joint has a motor with winding data.
        """
        from planner.timing.profiles.least_energy import least_energy

        if self.within is None:
            raise InputError("the least-energy profile needs a duration")
        return least_energy(boom, path, self.within, base)

    @property
    def exact_on_lines(self) -> bool:
        """Whether the law respects every limit between its grid points on a straight joint path."""
        return False


PROFILES: Mapping[str, type[TimingProfile]] = MappingProxyType(
    {kind.name: kind for kind in (Cubic, Quintic, Trapezoidal, JerkLimited, TimeOptimal, LeastEnergy)}
)
"""Each profile by its word."""

SHORTEST: tuple[Profile, ...] = tuple(Profile(word) for word, kind in PROFILES.items() if not kind.needs_duration)
"""Words of the profiles that have a shortest time."""


def parse_profile(
    word: str, *, jerk_bound: bool = False, average_torque: bool = False, velocities: ArrayLike | None = None
) -> TimingProfile:
    """Return the profile for a word and the options given with it.

    Raises:
        InputError: the profile is unknown, an option belongs to another profile, or the velocities
            are not finite or not (k, 5).
    """
    kind = PROFILES.get(word)
    if kind is None:
        raise unknown("profile", word, PROFILES)
    for name, given in (("jerk_bound", jerk_bound), ("average_torque", average_torque)):
        if given and kind is not TimeOptimal:
            raise InputError(f"{name} is for the time-optimal profile, not for {word}")
    if velocities is not None:
        cubic = Cubic.with_velocities(velocities)
        if kind is not Cubic:
            raise InputError(f"velocities at waypoints are for the cubic profile, not for {word}")
        return cubic
    return TimeOptimal(jerk_bound, average_torque) if kind is TimeOptimal else kind()
