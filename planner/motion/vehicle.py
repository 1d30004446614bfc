"""Vehicle cases: slope, sinusoidal track and half-sine shock move the mount during a move."""

from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from boom_model import Basis, InputError, Origin
from boom_model.arrays import Array, checked
from boom_model.dynamics.base_motion import BaseMotion, up_on_slope
from boom_model.plausible import (
    DIRECTION,
    SHOCK,
    SHOCK_DURATION,
    SHOCK_EVENTS,
    SHOCK_START,
    SLOPE,
    TRACK_AMPLITUDE,
    VEHICLE_SPEED,
    WAVELENGTH,
)
from boom_model.provenance import BasisName
from boom_model.toml_file import Table, read_toml
from planner.files import named_file

_FOLDER = Path(str(files("planner.motion") / "vehicle_cases"))
_SHORTEST = 1e-6
_Direction = Annotated[list[Annotated[float, DIRECTION]], Field(min_length=3, max_length=3)]


@dataclass(frozen=True)
class VehicleCase:
    """Load case of the vehicle, the sum of slope, track and shock, in SI units and rad.

    The mount follows the ground point by point; wheelbase, tyres and the position of the mount on
    the vehicle are neglected. The horizontal speed along the track is constant.
    """

    name: str
    origin: Origin
    roll: float = 0.0
    """Slope: about the forward axis, left side up."""
    pitch: float = 0.0
    """Slope: nose down."""
    amplitude: float = 0.0
    """Track: the ground is z = amplitude sin(2 pi x / wavelength), x = speed t."""
    wavelength: float = 1.0
    speed: float = 0.0
    peak: float = 0.0
    """Shock: peak acceleration of a half-sine along `direction`."""
    shock_duration: float = 1.0
    shock_start: float = 0.0
    direction: tuple[float, float, float] = (0.0, 0.0, 1.0)
    """Unit vector along frame 1."""
    shock_events: float | None = None
    """Number of such shocks that the drives must survive; None if unknown."""

    @property
    def is_level(self) -> bool:
        """Whether the vehicle rests on level ground."""
        return self.is_steady and self.roll == 0.0 and self.pitch == 0.0

    @property
    def tilt(self) -> BaseMotion | None:
        """Slope of the base, the only part that planning accounts for; None on level ground."""
        level = self.roll == 0.0 and self.pitch == 0.0
        return None if level else BaseMotion.of(up=up_on_slope(self.roll, self.pitch))

    def base(self, t: ArrayLike) -> BaseMotion | None:
        """Return `base_motion` at times t (n,), or None at rest on level ground."""
        return None if self.is_level else base_motion(self, t)

    @property
    def is_steady(self) -> bool:
        """Whether the case is a slope only, which does not change with time."""
        return (self.amplitude == 0.0 or self.speed == 0.0) and self.peak == 0.0

    @property
    def sentence(self) -> str:
        """Description of the case for a report."""
        parts = []
        if self.roll or self.pitch:
            parts.append(f"slope: roll {np.degrees(self.roll):g} deg, pitch {np.degrees(self.pitch):g} deg")
        if self.amplitude:
            parts.append(f"track: {self.amplitude:g} m waves every {self.wavelength:g} m at {self.speed:g} m/s")
        if self.peak:
            parts.append(f"shock: half-sine of {self.peak:g} m/s^2 for {self.shock_duration:g} s from {self.shock_start:g} s")
        said = "; ".join(parts) or "level ground, at rest"
        return f"vehicle case {self.name}: {said} ({self.origin.basis}: {self.origin.source})"


LEVEL = VehicleCase("level ground", Origin(Basis.PRINTED, "the vehicle rests on level ground"))
"""Default case for planning and checks."""


def base_motion(case: VehicleCase, t: ArrayLike) -> BaseMotion:
    """Return the motion of the base in a vehicle case at times t (n,) [s].

    With the slope psi = atan(dz/dx) of the track, the nose rises by psi, so the pitch of the base
    is case.pitch - psi. Heave is z(t), along `up`, and so is its acceleration.

    Raises:
        InputError: t is not finite.
    """
    t = checked("t", t)
    k = 2.0 * np.pi / case.wavelength
    phase = k * case.speed * t
    steepness = case.amplitude * k * np.cos(phase)  # dz/dx, and its time derivatives
    steepness_1 = -case.amplitude * k * np.sin(phase) * k * case.speed
    steepness_2 = -steepness * (k * case.speed) ** 2
    level = 1.0 + steepness**2
    psi_1 = steepness_1 / level
    psi_2 = steepness_2 / level - 2.0 * steepness * steepness_1**2 / level**2
    heave_1 = steepness * case.speed
    heave_2 = -case.amplitude * np.sin(phase) * (k * case.speed) ** 2
    ahead, left, up = np.moveaxis(base_pose(case, t)[..., :3, :3], -2, 0)  # axes of the ground in frame 1
    pulse = np.sin(np.pi * (t - case.shock_start) / case.shock_duration)
    inside = (t >= case.shock_start) & (t <= case.shock_start + case.shock_duration)
    shock = np.where(inside, case.peak * pulse, 0.0)[..., None] * np.asarray(case.direction)
    return BaseMotion.of(
        velocity=case.speed * ahead + heave_1[..., None] * up,
        angular_velocity=-psi_1[..., None] * left,
        acceleration=heave_2[..., None] * up + shock,
        angular_acceleration=-psi_2[..., None] * left,
        up=up,
    )


def base_pose(case: VehicleCase, t: ArrayLike) -> Array:
    """Return T_ground_1 (n, 4, 4) at times t (n,): tilt and heave, without the forward travel.

    Raises:
        InputError: t is not finite.
    """
    t = checked("t", t)
    k = 2.0 * np.pi / case.wavelength
    phase = k * case.speed * t
    pitch = case.pitch - np.arctan(case.amplitude * k * np.cos(phase))
    T = np.zeros((*t.shape, 4, 4))
    c, s = np.cos(case.roll), np.sin(case.roll)
    T[..., 0, :3] = np.stack([np.cos(pitch), np.sin(pitch) * s, np.sin(pitch) * c], axis=-1)  # R_y(pitch) R_x(roll)
    T[..., 1, :3] = [0.0, c, -s]
    T[..., 2, :3] = up_on_slope(case.roll, pitch)
    T[..., 2, 3] = case.amplitude * np.sin(phase)
    T[..., 3, 3] = 1.0
    return T


class _Slope(Table):
    roll_deg: Annotated[float, SLOPE] = 0.0
    pitch_deg: Annotated[float, SLOPE] = 0.0


class _Track(Table):
    amplitude_m: Annotated[float, TRACK_AMPLITUDE]
    wavelength_m: Annotated[float, WAVELENGTH]
    speed_m_s: Annotated[float, VEHICLE_SPEED]


class _Shock(Table):
    peak_m_s2: Annotated[float, SHOCK]
    duration_s: Annotated[float, SHOCK_DURATION]
    start_s: Annotated[float, SHOCK_START] = 0.0
    events: Annotated[float, SHOCK_EVENTS] | None = None
    direction: _Direction = Field(default_factory=lambda: [0.0, 0.0, 1.0])


class _CaseTable(Table):
    name: str
    basis: BasisName
    source: str
    slope: _Slope = Field(default_factory=_Slope)
    track: _Track | None = None
    shock: _Shock | None = None


def named_cases() -> tuple[str, ...]:
    """Return the names of the cases that come with the toolkit."""
    return tuple(sorted(path.stem for path in _FOLDER.glob("*.toml")))


def load_case(name: str) -> VehicleCase:
    """Load a named case, or one from a TOML file of the same form (a name that ends in .toml).

    Raises:
        InputError: the case is unknown, or the file cannot be read or is malformed; the message
            names the key.
    """
    path = named_file(_FOLDER, name, "vehicle case")
    table = read_toml(path, _CaseTable)
    track, shock = table.track, table.shock
    direction = np.array([0.0, 0.0, 1.0] if shock is None else shock.direction)
    length = float(np.linalg.norm(direction))
    if length < _SHORTEST:
        raise InputError(f"{path}: key shock.direction: its length is {length:g}; it must be at least {_SHORTEST:g}")
    x, y, z = (float(d) for d in direction / length)
    return VehicleCase(
        name=table.name,
        origin=Origin(Basis(table.basis), table.source),
        roll=float(np.radians(table.slope.roll_deg)),
        pitch=float(np.radians(table.slope.pitch_deg)),
        amplitude=0.0 if track is None else track.amplitude_m,
        wavelength=1.0 if track is None else track.wavelength_m,
        speed=0.0 if track is None else track.speed_m_s,
        peak=0.0 if shock is None else shock.peak_m_s2,
        shock_duration=1.0 if shock is None else shock.duration_s,
        shock_start=0.0 if shock is None else shock.start_s,
        direction=(x, y, z),
        shock_events=None if shock is None else shock.events,
    )
