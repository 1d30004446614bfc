"""The rig: where antenna, inertial sensor, mount and sensor are, and how late their logs are.

The vehicle's axes are x forward, y left, z up, from an origin of the user's choice.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from boom_model import Basis, InputError, Origin
from boom_model.arrays import Array, read_only
from boom_model.plausible import OFFSET, WIDTH, Range
from boom_model.provenance import BasisName
from boom_model.toml_file import Table, read_toml
from planner.field import attitude
from planner.field.geotag import Latencies

_LATENCY = Range(-10.0, 10.0, "s")
_LATENCY_STD = Range(0.0, 10.0, "s")
_STD = Range(0.0, 10.0, "m")
_ANGLE = Range(-360.0, 360.0, "deg")
_ANGLE_STD = Range(0.0, 45.0, "deg")
_SIDE = Range(1e-3, 100.0, "m")
_SHORTEST = 1e-6
_Point = Annotated[list[Annotated[float, OFFSET]], Field(min_length=3, max_length=3)]


class _Part(Table):
    basis: BasisName
    source: str
    latency_s: Annotated[float, _LATENCY] = 0.0
    latency_std_s: Annotated[float, _LATENCY_STD] = 0.0

    @property
    def origin(self) -> Origin:
        return Origin(Basis(self.basis), self.source)


class _Turned(_Part):
    roll_deg: Annotated[float, _ANGLE] = 0.0
    pitch_deg: Annotated[float, _ANGLE] = 0.0
    heading_deg: Annotated[float, _ANGLE] = 0.0
    std_deg: Annotated[float, _ANGLE_STD]

    @property
    def R(self) -> Array:
        """R_vehicle_part: for angles of 0 the part's axes are the vehicle's."""
        angles = np.radians([self.roll_deg, self.pitch_deg, self.heading_deg])
        turned: Array = attitude.rotation(0.0, 0.0, 0.0).T @ attitude.rotation(*angles)
        return turned


class _Antenna(_Part):
    position_m: _Point
    std_m: Annotated[float, _STD]


class _Mount(_Turned):
    position_m: _Point
    std_m: Annotated[float, _STD]


class _Joints(_Part):
    std_deg: Annotated[float, _ANGLE_STD]
    extension_std_m: Annotated[float, _STD]


class _Sensor(_Part):
    name: str = "sensor"
    position_m: _Point = Field(default_factory=lambda: [0.0, 0.0, 0.0])
    std_m: Annotated[float, _STD]
    view: _Point = Field(default_factory=lambda: [1.0, 0.0, 0.0])
    footprint_m: Annotated[list[Annotated[float, _SIDE]], Field(min_length=2, max_length=2)]
    range_m: Annotated[float, _SIDE]


class _Ground(_Part):
    height_m: Annotated[float, OFFSET]
    canopy_m: Annotated[float, WIDTH] = 0.0
    std_m: Annotated[float, _STD]


class _RigTable(Table):
    name: str
    antenna: _Antenna
    imu: _Turned
    mount: _Mount
    joints: _Joints
    sensor: _Sensor
    ground: _Ground


@dataclass(frozen=True, eq=False)
class Rig:
    """What stands where on the vehicle, in SI and rad."""

    name: str
    antenna: Array
    """(3,) the point that the vehicle's log is of [m]"""
    antenna_std: float
    R_body_imu: Array
    """(3, 3) axes of the log's attitude in the vehicle"""
    imu_std: float
    mount: Array
    """(3,) origin of frame 1 [m]"""
    mount_std: float
    R_body_mount: Array
    """(3, 3)"""
    mount_turn_std: float
    joint_std: Array
    """(5,) of the encoders [rad, m]"""
    sensor_name: str
    sensor: Array
    """(3,) in frame 11, the tip [m]"""
    sensor_std: float
    view: Array
    """(3,) unit vector in frame 11; x is where the end effector points"""
    spread: tuple[float, float]
    """Half the footprint over its range: along the arm's plane, and across it."""
    ground: float
    """Height of the ground under the mount, along the vehicle's z [m]."""
    canopy: float
    """Height of what is seen above the ground [m]."""
    ground_std: float
    latencies: Latencies
    origins: dict[str, Origin]
    """Of each part."""

    @property
    def assumptions(self) -> tuple[str, ...]:
        """Parts that are assumed, one phrase each."""
        return tuple(f"{part}: {o.source}" for part, o in self.origins.items() if o.basis is Basis.ASSUMED)


def read_rig(path: str | Path) -> Rig:
    """Read a rig from a TOML file; `boom geotag --help` names its keys.

    Raises:
        InputError: it cannot be read or is malformed; the message names the key.
    """
    table = read_toml(Path(path), _RigTable)
    view = np.array(table.sensor.view)
    length = float(np.linalg.norm(view))
    if length < _SHORTEST:
        raise InputError(f"{path}: key sensor.view: its length is {length:g}; it must be at least {_SHORTEST:g}")
    along, across = table.sensor.footprint_m
    reach = 2.0 * table.sensor.range_m
    angle, extension = float(np.radians(table.joints.std_deg)), table.joints.extension_std_m
    parts = {name: getattr(table, name) for name in ("antenna", "imu", "mount", "joints", "sensor", "ground")}
    return Rig(
        name=table.name,
        antenna=read_only(table.antenna.position_m),
        antenna_std=table.antenna.std_m,
        R_body_imu=read_only(table.imu.R),
        imu_std=float(np.radians(table.imu.std_deg)),
        mount=read_only(table.mount.position_m),
        mount_std=table.mount.std_m,
        R_body_mount=read_only(table.mount.R),
        mount_turn_std=float(np.radians(table.mount.std_deg)),
        joint_std=read_only([angle, angle, angle, extension, angle]),
        sensor_name=table.sensor.name,
        sensor=read_only(table.sensor.position_m),
        sensor_std=table.sensor.std_m,
        view=read_only(view / length),
        spread=(along / reach, across / reach),
        ground=table.ground.height_m,
        canopy=table.ground.canopy_m,
        ground_std=table.ground.std_m,
        latencies=Latencies(
            position=table.antenna.latency_s,
            attitude=table.imu.latency_s,
            joints=table.joints.latency_s,
            trigger=table.sensor.latency_s,
            position_std=table.antenna.latency_std_s,
            attitude_std=table.imu.latency_std_s,
            joints_std=table.joints.latency_std_s,
            trigger_std=table.sensor.latency_std_s,
        ),
        origins={name: part.origin for name, part in parts.items()},
    )
