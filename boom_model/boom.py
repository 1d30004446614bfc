"""The boom: geometry, bodies, joint limits, payload and drives as frozen data."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array, Mask, checked, read_only, scalar
from boom_model.calibration import Calibration
from boom_model.drives.drive import Drive, reflected_inertia
from boom_model.drives.linear_actuator import LinearDrive
from boom_model.errors import InputError
from boom_model.joints import JOINTS as JOINTS
from boom_model.keep_out import KeepOut
from boom_model.plausible import (
    ACCELERATION,
    ANGLE,
    ANGULAR_ACCELERATION,
    ANGULAR_JERK,
    ANGULAR_VELOCITY,
    COULOMB_FRICTION,
    DRIVE_INERTIA,
    GRAVITY,
    INERTIA,
    JERK,
    LENGTH,
    LINKAGE_ANGLE,
    MASS,
    MOUNT_LOAD,
    OFFSET,
    TRANSMISSION_ANGLE,
    VELOCITY,
    VISCOUS_FRICTION,
    WIDTH,
    Range,
)
from boom_model.provenance import Origin, Sourced
from boom_model.words import unknown

IS_LENGTH = read_only([0, 0, 0, 1, 0]).astype(bool)
"""True where a joint coordinate is a length [m] and not an angle [rad]."""


def in_degrees(q: ArrayLike) -> Array:
    """Return joint positions or rates (..., 5) [rad, m] in degrees, the extension in metres."""
    shown: Array = np.where(IS_LENGTH, q, np.degrees(q))
    return shown


LOAD_UNITS = tuple("N" if length else "Nm" for length in IS_LENGTH)
"""Unit of each joint's torque; the extension's is a force."""

MOVING_BODIES = ("lower", "inner", "outer", "upper", "extension", "end_effector")
"""Bodies that move relative to the yawing base. The payload moves with the end effector."""

LIMIT_TOLERANCE = 1e-9
"""Tolerance [rad or m] of every comparison with a position limit, for rounding."""


_LENGTHS = {
    "L1": OFFSET,
    "L2": OFFSET,
    "L3": LENGTH,
    "L4": LENGTH,
    "L6": OFFSET,
    "L7": LENGTH,
    "L8": WIDTH,
    "L5": LENGTH,
    "L9": LENGTH,
}


@dataclass(frozen=True, eq=False)
class Geometry:
    """Lengths [m] (thesis, figure 2-1).

    The linkage is a parallelogram where L5 = L3 and L9 = L4.
    """

    L1: float
    L2: float
    L3: float
    L4: float
    L6: float
    L7: float
    L8: float
    upper_less_lower: float = 0.0
    """L5 - L3, 0 in a parallelogram."""
    inner_less_outer: float = 0.0
    """L9 - L4, 0 in a parallelogram."""

    def __post_init__(self) -> None:
        for name, quantity in _LENGTHS.items():
            quantity.require(name, scalar(name, getattr(self, name)))

    @property
    def L5(self) -> float:
        """Side of the linkage on the upper link [m]."""
        return self.L3 + self.upper_less_lower

    @property
    def L9(self) -> float:
        """Side of the linkage on the inner link [m]."""
        return self.L4 + self.inner_less_outer

    @property
    def is_parallelogram(self) -> bool:
        """Whether opposite links of the linkage are equal."""
        return self.upper_less_lower == 0.0 and self.inner_less_outer == 0.0

    def require_parallelogram(self, what: str) -> None:
        """Refuse a general four-bar linkage.

        Raises:
            InputError: opposite links differ; the message says what needs equal ones.
        """
        if not self.is_parallelogram:
            raise InputError(
                f"{what} needs a parallelogram; this boom has L5 - L3 = {self.upper_less_lower * 1e3:.3g} mm and "
                f"L9 - L4 = {self.inner_less_outer * 1e3:.3g} mm. Leave L5_m and L9_m out of its file for equal links"
            )


@dataclass(frozen=True, eq=False)
class Body:
    """Rigid body in its own frame of the DH tables (`frames.BODY_FRAMES`)."""

    mass: float
    com: Array
    """(3,) centre of mass in the body's frame [m]."""
    inertia: Array
    """(3, 3) about the centre of mass, along the axes of the body's frame [kg m^2]."""
    origin: Origin | None = None
    """Of these figures; None where the boom's file does not say."""

    def __post_init__(self) -> None:
        MASS.require("a body's mass", scalar("a body's mass", self.mass))
        OFFSET.require("a body's centre of mass", _of_shape("a body's centre of mass", self.com, (3,)))
        INERTIA.require("a body's inertia", _of_shape("a body's inertia", self.inertia, (3, 3)))


_LIMITS: dict[str, tuple[Range, Range]] = {
    "lower": (ANGLE, OFFSET),
    "upper": (ANGLE, OFFSET),
    "velocity": (ANGULAR_VELOCITY, VELOCITY),
    "acceleration": (ANGULAR_ACCELERATION, ACCELERATION),
    "jerk": (ANGULAR_JERK, JERK),
}


@dataclass(frozen=True, eq=False)
class Limits:
    """Joint limits, arrays of shape (5,) in rad, rad/s, ... (m, m/s, ... for the extension)."""

    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    jerk: Array
    linkage: float
    """Coupled limit: theta3 - theta2 may not fall below this [rad]."""
    transmission: float
    """Transmission angle [rad] below which pin forces become large, with a warning."""
    origins: Mapping[str, tuple[Origin, ...]]
    """Origin of every value, with the keys position, velocity, acceleration and jerk (5 each),
    linkage and transmission (1)."""

    def __post_init__(self) -> None:
        for name, (angular, linear) in _LIMITS.items():
            values = _of_shape(name, getattr(self, name), (5,))
            angular.require_radians(f"{name} limit of a joint", values[~IS_LENGTH])
            linear.require(f"{name} limit of the extension", values[IS_LENGTH])
        LINKAGE_ANGLE.require_radians("linkage", scalar("linkage", self.linkage))
        TRANSMISSION_ANGLE.require_radians("transmission", scalar("transmission", self.transmission))

    def excess(self, q: ArrayLike) -> Array:
        """Return the excess of q (..., 5) over each position limit, (..., 6) [rad, m].

        It is negative inside the limit. The last entry is for the coupled limit: theta2 + linkage -
        theta3.
        """
        q = np.asarray(q, dtype=float)
        coupled = q[..., 1:2] + self.linkage - q[..., 2:3]
        return np.concatenate([np.maximum(self.lower - q, q - self.upper), coupled], axis=-1)

    def contain(self, q: ArrayLike) -> Mask:
        """Return whether q (..., 5) is within every position limit, to LIMIT_TOLERANCE, (...)."""
        return np.asarray((self.excess(q) <= LIMIT_TOLERANCE).all(axis=-1))

    def reasons(self, q: ArrayLike) -> list[str]:
        """Return a sentence per position limit that q (5,) exceeds, with excess and bound."""
        q = checked("q", q, 5)
        sentences = []
        for i in map(int, np.flatnonzero(self.excess(q)[:5] > LIMIT_TOLERANCE)):
            below = q[i] < self.lower[i]
            bound = self.lower[i] if below else self.upper[i]
            sentences.append(
                f"{JOINTS[i]} {_shown(i, q[i])} is {_shown(i, abs(q[i] - bound))} {'below' if below else 'above'} "
                f"its limit of {_shown(i, bound)}"
            )
        gap = q[2] - q[1]
        if self.linkage - gap > LIMIT_TOLERANCE:
            sentences.append(
                f"lower - inner = {_shown(2, gap)} is {_shown(2, self.linkage - gap)} below "
                f"the linkage's coupled limit of {_shown(2, self.linkage)}"
            )
        return sentences


@dataclass(frozen=True, eq=False)
class Friction:
    """Joint friction, viscous qd + coulomb sign(qd) + asymmetric |sign(qd)|.

    Arrays (5,); 0 if not given.
    """

    viscous: Array
    """[Nm s/rad, N s/m for the extension]"""
    coulomb: Array
    """[Nm, N for the extension]"""
    origins: tuple[Origin | None, ...]
    """Origin of the values of each joint; None if not given."""
    asymmetric: Array = field(default_factory=lambda: read_only(np.zeros(5)))
    """Half the difference between the dry friction forwards and backwards [Nm, N for the
    extension]."""

    def __post_init__(self) -> None:
        VISCOUS_FRICTION.require("viscous friction", _of_shape("viscous friction", self.viscous, (5,)))
        COULOMB_FRICTION.require("coulomb friction", _of_shape("coulomb friction", self.coulomb, (5,)))
        size = np.abs(_of_shape("asymmetric friction", self.asymmetric, (5,)))
        if (size > self.coulomb + 1e-9).any():
            at = int(np.argmax(size - self.coulomb))
            raise InputError(
                f"asymmetric friction of {JOINTS[at]} is {self.asymmetric[at]:g}; it must be within its Coulomb friction, "
                f"{self.coulomb[at]:g}"
            )

    def torque(self, qd: ArrayLike) -> Array:
        """Return the torque (..., 5) against friction at joint velocities qd (..., 5) [Nm, N]."""
        qd = np.asarray(qd, dtype=float)
        torque: Array = self.viscous * qd + self.dry(np.sign(qd)) if self.any else np.zeros(qd.shape)
        return torque

    @cached_property
    def any(self) -> bool:
        """Whether any joint has friction."""
        return bool(self.viscous.any() or self.coulomb.any() or self.asymmetric.any())

    def dry(self, direction: ArrayLike) -> Array:
        """Return the part that does not grow with speed, for directions -1, 0 or 1 (..., 5)."""
        direction = np.asarray(direction, dtype=float)
        torque: Array = np.zeros(direction.shape)
        if self.any:
            torque = self.coulomb * direction + self.asymmetric * np.abs(direction)
        return torque


@dataclass(frozen=True)
class Mount:
    """Largest loads of the mount on the vehicle; None if unknown."""

    force: Sourced[float] | None
    """Largest force [N]."""
    moment: Sourced[float] | None
    """Largest moment about the origin of frame 1 [Nm]."""

    def __post_init__(self) -> None:
        for name, load in (("mount force", self.force), ("mount moment", self.moment)):
            if load is not None:
                MOUNT_LOAD.require(name, load.value)


@dataclass(frozen=True, eq=False)
class Boom:
    """A five-joint boom on a parallelogram linkage."""

    name: str
    geometry: Geometry
    bodies: Mapping[str, Body]
    """The base and each of MOVING_BODIES."""
    payload: Body
    """Payload, in frame 11 at the tip."""
    limits: Limits
    drives: tuple[Drive | None, ...]
    """Drive of each joint; None if not given, and then it cannot be checked."""
    poses: Mapping[str, Array]
    """Named joint positions, each (5,)."""
    friction: Friction
    mount: Mount
    gravity: float = 9.81
    """[m/s^2]"""
    actuator: LinearDrive | None = None
    """Linear actuator of the extension; None if not given."""
    keep_out: KeepOut | None = None
    """Shapes to avoid; None if not given."""
    calibration: Calibration | None = None
    """Offsets of the joint readings and uncertainty; None where the machine was not measured."""
    rotors: tuple[Sourced[float] | None, ...] = (None,) * 5
    """Measured inertia, at the joint, of a drive without data [kg m^2, the extension's kg].

    A drive with data holds its own.
    """

    def __post_init__(self) -> None:
        GRAVITY.require("gravity", scalar("gravity", self.gravity))
        for name, q in self.poses.items():
            angles = _of_shape(f"pose {name!r}", q, (5,))
            ANGLE.require_radians(f"pose {name!r}", angles[~IS_LENGTH])
            OFFSET.require(f"pose {name!r}", angles[IS_LENGTH])

    @staticmethod
    def load(path: str | Path | None = None, catalogue: str | Path | None = None) -> "Boom":
        """Read a boom from a TOML file.

        The shipped file describes the third-generation boom (thesis, Appendix C and table 2-3).

        Args:
            path: the file; None is the shipped `boom_model/data/third_generation.toml`.
            catalogue: a TOML file with more drives, besides the shipped ones.

        Raises:
            InputError: the file cannot be read, is malformed, or has unknown keys or drives; the
                message names the key.
        """
        from boom_model.boom_file import read_boom

        return read_boom(path, catalogue)

    def with_payload(self, mass: float) -> "Boom":
        """Return the boom with another payload mass [kg].

        The centre of mass stays, and the inertia changes in proportion.

        Raises:
            InputError: the mass is not finite, negative or not plausible.
        """
        mass = scalar("payload", mass)
        MASS.require("payload", mass)
        old = self.payload
        inertia = old.inertia * (mass / old.mass) if old.mass > 0.0 else old.inertia
        return replace(self, payload=Body(mass, old.com, read_only(inertia)))

    def with_body_mass(self, name: str, mass: float) -> "Boom":
        """Return the boom with another mass [kg] of a body.

        The centre of mass stays, and the inertia changes in proportion.

        Raises:
            InputError: the body is unknown or has no mass to scale, or the mass is not finite or
                not plausible.
        """
        if name not in self.bodies:
            raise unknown("body", name, self.bodies)
        mass, old = scalar(f"mass of {name}", mass), self.bodies[name]
        if mass < 0.0 or old.mass == 0.0:
            raise InputError(
                f"mass of {name} is {mass:g} kg, from {old.mass:g} kg; the one must not be negative, the other not 0"
            )
        changed = Body(mass, old.com, read_only(old.inertia * (mass / old.mass)))
        return replace(self, bodies=MappingProxyType({**self.bodies, name: changed}))

    def drive_of(self, joint: str) -> Drive | LinearDrive | None:
        """Return what drives a joint: motor and gearbox, or the extension's actuator."""
        i = JOINTS.index(joint)
        return self.drives[i] or (self.actuator if IS_LENGTH[i] else None)

    def with_drive(self, joint: str, drive: Drive | LinearDrive | None) -> "Boom":
        """Return the boom with another drive on a joint. The masses of the bodies stay unchanged.

        Args:
            joint: name of the joint.
            drive: the drive; a linear drive replaces the actuator of the boom. None leaves the
                joint without a drive.

        Raises:
            InputError: the joint is unknown, or a linear drive is given for a rotary joint.
        """
        if joint not in JOINTS:
            raise unknown("joint", joint, JOINTS)
        if isinstance(drive, LinearDrive):
            if not IS_LENGTH[JOINTS.index(joint)]:
                raise InputError(f"{joint} turns; a linear actuator drives the extension only")
            return replace(self, actuator=drive, rotors=(*self.rotors[:3], None, self.rotors[4]))
        rotors = tuple(None if name == joint else rotor for name, rotor in zip(JOINTS, self.rotors, strict=True))
        drives = tuple(drive if name == joint else d for name, d in zip(JOINTS, self.drives, strict=True))
        return replace(self, drives=drives, rotors=rotors)

    def with_drive_inertia(self, measured: Sequence[Sourced[float]]) -> "Boom":
        """Return the boom with the measured drive inertias at the joints [kg m^2, extension kg].

        Raises:
            InputError: an inertia is not plausible.
        """
        for joint, inertia in zip(JOINTS, measured, strict=True):
            DRIVE_INERTIA.require(f"drive inertia of {joint}", scalar(f"drive inertia of {joint}", inertia.value))
        drives = tuple(None if d is None else replace(d, inertia=m) for d, m in zip(self.drives, measured, strict=True))
        rotors = tuple(m if d is None else None for d, m in zip(self.drives, measured, strict=True))
        return replace(self, drives=drives, rotors=rotors)

    @cached_property
    def drive_inertia(self) -> Array:
        """Inertia of each drive at its joint (5,) [kg m^2, extension kg]; 0 where it is unknown."""
        known = [reflected_inertia(drive) if drive is not None else rotor and rotor.value
                 for drive, rotor in zip(self.drives, self.rotors, strict=True)]  # fmt: skip
        return read_only([inertia or 0.0 for inertia in known])

    def pose(self, name: str) -> Array:
        """Return a named pose, (5,).

        Raises:
            InputError: the pose is unknown; the message lists the known ones.
        """
        try:
            return self.poses[name]
        except KeyError:
            raise unknown("pose", name, sorted(self.poses)) from None

    @cached_property
    def mass(self) -> float:
        """Total mass without payload [kg]."""
        return sum(body.mass for body in self.bodies.values())


def _of_shape(name: str, values: Array, shape: tuple[int, ...]) -> Array:
    array = checked(name, values)
    if array.shape != shape:
        raise InputError(f"{name} has shape {array.shape}; it must be {shape}")
    return array


def _shown(joint: int, value: float) -> str:
    return f"{value:.6g} m" if IS_LENGTH[joint] else f"{np.degrees(value):.6g} deg"
