"""The TOML form of a boom: schema, validation, and conversion to SI."""

from collections.abc import Iterator, Mapping
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Generic, Literal, TypeVar

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from boom_model.arrays import Array, checked, read_only
from boom_model.boom import JOINTS, MOVING_BODIES, Body, Boom, Friction, Geometry, Limits, Mount
from boom_model.calibration import Calibration
from boom_model.drives.catalogue import CATALOGUE_FILE, Catalogue
from boom_model.drives.drive import Drive, Wiring
from boom_model.drives.linear_actuator import LinearDrive
from boom_model.errors import InputError
from boom_model.keep_out import Box, Capsule, KeepOut
from boom_model.plausible import (
    ACCELERATION,
    ANGLE,
    ANGULAR_ACCELERATION,
    ANGULAR_JERK,
    ANGULAR_VELOCITY,
    CLEARANCE,
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
    POSITION,
    SIZE,
    TRANSMISSION_ANGLE,
    VELOCITY,
    VISCOUS_FRICTION,
    VOLTAGE,
    WIDTH,
)
from boom_model.provenance import Basis, BasisName, Origin, Sourced
from boom_model.toml_file import Table, read_toml, validated
from boom_model.words import nearest_name

BOOM_FILE = Path(str(files("boom_model") / "data" / "third_generation.toml"))

V = TypeVar("V")
_Mass = Annotated[float, MASS]
_Offset = Annotated[float, OFFSET]
Triple = Annotated[list[_Offset], Field(min_length=3, max_length=3)]
_Place = Annotated[list[Annotated[float, POSITION]], Field(min_length=3, max_length=3)]
_Gap = Annotated[float, CLEARANCE]
_Viscous = Annotated[float, VISCOUS_FRICTION]
_Finite = Annotated[float, Field(allow_inf_nan=False)]
_Spread = Annotated[float, Field(ge=0, allow_inf_nan=False)]
_Factor = Annotated[float, Field(ge=-10, le=100, allow_inf_nan=False)]
_Scale = Annotated[float, Field(ge=0.5, le=2, allow_inf_nan=False)]
_Inertia = Annotated[float, DRIVE_INERTIA]
_Coulomb = Annotated[float, COULOMB_FRICTION]
_Asymmetric = Annotated[float, Field(ge=-COULOMB_FRICTION.high, le=COULOMB_FRICTION.high, allow_inf_nan=False)]


def inertia_tensor(value: Any) -> Array:
    """Return the inertia tensor (3, 3) for [Ixx, Iyy, Izz] or for a 3 x 3 matrix.

    Raises:
        ValueError: no body can have this tensor.
    """
    try:
        given = checked("inertia", value)
    except InputError:
        given = np.empty(0)
    if given.shape not in ((3,), (3, 3)) or not all(type(entry) in (int, float) for entry in _entries(value)):
        raise ValueError("must be [Ixx, Iyy, Izz] or a 3 x 3 matrix, of finite numbers")
    if not np.abs(given).max() <= INERTIA.high:
        raise ValueError(f"an entry is {given.flat[np.abs(given).argmax()]:g} {INERTIA.unit}; the bound is {INERTIA.high:g}")
    tensor = read_only(np.diag(given) if given.ndim == 1 else given)
    if not np.allclose(tensor, tensor.T, rtol=1e-12, atol=0.0):
        raise ValueError("the inertia must be symmetric")
    principal = np.linalg.eigvalsh(tensor)
    if principal[0] < 0 or principal[0] + principal[1] < principal[2] * (1 - 1e-9):
        shown = ", ".join(f"{p:.6g}" for p in principal)
        raise ValueError(f"no body has principal inertias {shown}: the two smaller ones must sum to the largest or more")
    return tensor


def _entries(value: Any) -> Iterator[Any]:
    """Iterate over the entries of a list of numbers or of such lists."""
    for part in value if isinstance(value, list) else [value]:
        yield from part if isinstance(part, list) else [part]


class _Origin(Table):
    basis: BasisName
    source: str

    @property
    def origin(self) -> Origin:
        return Origin(Basis(self.basis), self.source)


class _Sourced(_Origin, Generic[V]):
    value: V

    @property
    def sourced(self) -> Sourced[V]:
        return Sourced(self.value, self.origin)


class _Range(_Origin):
    lower: float
    upper: float

    @model_validator(mode="after")
    def _ordered(self) -> "_Range":
        if self.lower > self.upper:
            raise ValueError(f"lower {self.lower} is above upper {self.upper}")
        return self


class _AngleRange(_Range):
    lower: Annotated[float, ANGLE]
    upper: Annotated[float, ANGLE]


class _StrokeRange(_Range):
    lower: _Offset
    upper: _Offset


class _GeometryTable(Table):
    L1_m: _Offset
    L2_m: _Offset
    L3_m: Annotated[float, LENGTH]
    L4_m: Annotated[float, LENGTH]
    L6_m: _Offset
    L7_m: Annotated[float, LENGTH]
    L8_m: Annotated[float, WIDTH]
    L5_m: Annotated[float, LENGTH] | None = None
    """None: equal to L3."""
    L9_m: Annotated[float, LENGTH] | None = None
    """None: equal to L4."""

    @property
    def geometry(self) -> Geometry:
        return Geometry(
            L1=self.L1_m,
            L2=self.L2_m,
            L3=self.L3_m,
            L4=self.L4_m,
            L6=self.L6_m,
            L7=self.L7_m,
            L8=self.L8_m,
            upper_less_lower=0.0 if self.L5_m is None else self.L5_m - self.L3_m,
            inner_less_outer=0.0 if self.L9_m is None else self.L9_m - self.L4_m,
        )


class _BodyTable(Table):
    mass_kg: _Mass
    com_m: Triple
    inertia_kg_m2: Annotated[Any, AfterValidator(inertia_tensor)]
    basis: BasisName | None = None
    source: str | None = None

    @model_validator(mode="after")
    def _both(self) -> "_BodyTable":
        if (self.basis is None) != (self.source is None):
            raise ValueError("basis and source belong together")
        return self

    @property
    def origin(self) -> Origin | None:
        return None if self.basis is None or self.source is None else Origin(Basis(self.basis), self.source)


class _DriveTable(Table):
    motor: str
    gearbox: str
    bus_voltage_V: _Sourced[Annotated[float, VOLTAGE]] | None = None
    wiring: _Sourced[Literal["parallel", "series", "single"]] | None = None
    brake: _Sourced[bool] | None = None


class _ActuatorTable(Table):
    model: str
    brake: _Sourced[bool] | None = None


class _RevoluteFriction(_Origin):
    viscous_Nm_s_per_rad: _Viscous
    coulomb_Nm: _Coulomb
    asymmetric_Nm: _Asymmetric = 0.0

    @property
    def figures(self) -> tuple[float, float, float]:
        """Viscous, Coulomb and asymmetric."""
        return self.viscous_Nm_s_per_rad, self.coulomb_Nm, self.asymmetric_Nm


class _PrismaticFriction(_Origin):
    viscous_N_s_per_m: _Viscous
    coulomb_N: _Coulomb
    asymmetric_N: _Asymmetric = 0.0

    @property
    def figures(self) -> tuple[float, float, float]:
        return self.viscous_N_s_per_m, self.coulomb_N, self.asymmetric_N


class _RevoluteTable(Table):
    position_deg: _AngleRange
    velocity_deg_s: _Sourced[Annotated[float, ANGULAR_VELOCITY]]
    acceleration_deg_s2: _Sourced[Annotated[float, ANGULAR_ACCELERATION]]
    jerk_deg_s3: _Sourced[Annotated[float, ANGULAR_JERK]]
    friction: _RevoluteFriction | None = None
    drive: _DriveTable | None = None
    drive_inertia_kg_m2: _Sourced[_Inertia] | None = None

    @property
    def rotor(self) -> Sourced[float] | None:
        """Measured inertia of the drive at the joint."""
        return _given(self.drive_inertia_kg_m2)

    @property
    def rows(self) -> tuple[_Range, _Sourced[float], _Sourced[float], _Sourced[float], float]:
        """Position, velocity, acceleration, jerk, and the factor that makes them SI."""
        unit = np.pi / 180.0
        return self.position_deg, self.velocity_deg_s, self.acceleration_deg_s2, self.jerk_deg_s3, unit


class _PrismaticTable(Table):
    position_m: _StrokeRange
    velocity_m_s: _Sourced[Annotated[float, VELOCITY]]
    acceleration_m_s2: _Sourced[Annotated[float, ACCELERATION]]
    jerk_m_s3: _Sourced[Annotated[float, JERK]]
    friction: _PrismaticFriction | None = None
    actuator: _ActuatorTable | None = None
    drive_inertia_kg: _Sourced[_Inertia] | None = None

    @property
    def rotor(self) -> Sourced[float] | None:
        """Measured mass of the drive at the joint."""
        return _given(self.drive_inertia_kg)

    @property
    def rows(self) -> tuple[_Range, _Sourced[float], _Sourced[float], _Sourced[float], float]:
        return self.position_m, self.velocity_m_s, self.acceleration_m_s2, self.jerk_m_s3, 1.0


class _JointsTable(Table):
    yaw: _RevoluteTable
    inner: _RevoluteTable
    lower: _RevoluteTable
    extension: _PrismaticTable
    wrist: _RevoluteTable


class _BodiesTable(Table):
    base: _BodyTable
    lower: _BodyTable
    inner: _BodyTable
    outer: _BodyTable
    upper: _BodyTable
    extension: _BodyTable
    end_effector: _BodyTable


class _LinkageTable(Table):
    minimum_angle_deg: _Sourced[Annotated[float, LINKAGE_ANGLE]]
    transmission_warning_deg: _Sourced[Annotated[float, TRANSMISSION_ANGLE]]


class _MountTable(Table):
    force_N: _Sourced[Annotated[float, MOUNT_LOAD]] | None = None
    moment_Nm: _Sourced[Annotated[float, MOUNT_LOAD]] | None = None


class _BoxTable(_Origin):
    name: str
    center_m: _Place
    size_m: Annotated[list[Annotated[float, SIZE]], Field(min_length=3, max_length=3)]


class _CapsuleTable(_Origin):
    name: str
    start_m: _Place
    end_m: _Place
    radius_m: Annotated[float, SIZE]


class _KeepOutTable(_Origin):
    clearance_m: _Gap
    link_radius_m: _Gap
    payload_radius_m: _Gap
    box: list[_BoxTable] = Field(default_factory=list)
    capsule: list[_CapsuleTable] = Field(default_factory=list)

    @model_validator(mode="after")
    def _named_once(self) -> "_KeepOutTable":
        names = [*(box.name for box in self.box), *(capsule.name for capsule in self.capsule)]
        twice = {name for name in names if names.count(name) > 1}
        if twice:
            raise ValueError(f"two shapes are named {', '.join(sorted(twice))}")
        if not names:
            raise ValueError("no box and no capsule is given")
        return self


class _PoseTable(Table):
    yaw_deg: Annotated[float, ANGLE]
    inner_deg: Annotated[float, ANGLE]
    lower_deg: Annotated[float, ANGLE]
    extension_m: _Offset
    wrist_deg: Annotated[float, ANGLE]


class _WindUpTable(Table):
    yaw: _Factor = 1.0
    inner: _Factor = 1.0
    lower: _Factor = 1.0
    wrist: _Factor = 1.0


class _UncertaintyTable(Table):
    parameters: list[str]
    standard_deviation: list[_Spread]
    covariance: list[list[_Finite]]


class _CalibrationTable(_Origin):
    offset: _PoseTable
    extension_scale: _Scale = 1.0
    wind_up: _WindUpTable = Field(default_factory=lambda: _WindUpTable())
    uncertainty: _UncertaintyTable

    @property
    def calibration(self) -> Calibration:
        yields, count = self.wind_up, len(self.uncertainty.parameters)
        return Calibration(
            origin=self.origin,
            offset=_pose(self.offset),
            scale=read_only([1.0, 1.0, 1.0, self.extension_scale, 1.0]),
            wind_up=read_only([yields.yaw, yields.inner, yields.lower, 1.0, yields.wrist]),
            parameters=tuple(self.uncertainty.parameters),
            covariance=read_only(np.reshape(self.uncertainty.covariance, (count, count))),
        )

    @model_validator(mode="after")
    def _square(self) -> "_CalibrationTable":
        count = len(self.uncertainty.parameters)
        rows = [len(row) for row in self.uncertainty.covariance]
        if rows != [count] * count or len(self.uncertainty.standard_deviation) != count:
            raise ValueError(f"uncertainty must have {count} standard deviations and a covariance of {count} by {count}")
        return self


class _PayloadTable(_Origin):
    mass_kg: _Mass
    com_m: Triple = Field(default_factory=lambda: [0.0, 0.0, 0.0])
    inertia_kg_m2: Annotated[Any, AfterValidator(inertia_tensor)] = Field(default_factory=lambda: read_only(np.zeros((3, 3))))


class _BoomTable(Table):
    name: str
    gravity_m_s2: Annotated[float, GRAVITY] = 9.81
    geometry: _GeometryTable
    bodies: _BodiesTable
    payload: _PayloadTable
    joints: _JointsTable
    linkage: _LinkageTable
    mount: _MountTable = Field(default_factory=_MountTable)
    poses: dict[str, _PoseTable] = Field(default_factory=dict)
    keep_out: _KeepOutTable | None = None
    calibration: _CalibrationTable | None = None


def read_boom(path: str | Path | None, catalogue: str | Path | None) -> Boom:
    """See `Boom.load`."""
    file = Path(path) if path is not None else BOOM_FILE
    table = read_toml(file, _BoomTable)
    searched = CATALOGUE_FILE.name if catalogue is None else f"{CATALOGUE_FILE.name} or {catalogue}"
    return _boom(str(file), table, Catalogue.load().with_file(catalogue), searched)


def boom_of(data: dict[str, Any], known: Catalogue, name: str) -> Boom:
    """Return the boom of a boom's file that is read already, as nested dictionaries.

    Args:
        data: what the file holds.
        known: the drives that it may name.
        name: of the file in messages.

    Raises:
        InputError: as `Boom.load`.
    """
    return _boom(name, validated(name, data, _BoomTable), known, "the catalogue")


def _boom(file: str, table: _BoomTable, known: Catalogue, searched: str) -> Boom:
    """Return the boom of a table; messages name `searched` as the place of the drives."""
    joints = [getattr(table.joints, joint) for joint in JOINTS]
    limits = _limits(joints, table.linkage)
    poses = {name: _pose(pose) for name, pose in table.poses.items()}
    for name, q in poses.items():
        if broken := limits.reasons(q):
            raise InputError(f"{file}: key poses.{name}: outside the limits: {'; '.join(broken)}")
    return Boom(
        name=table.name,
        gravity=table.gravity_m_s2,
        geometry=table.geometry.geometry,
        bodies=MappingProxyType({name: _body(getattr(table.bodies, name)) for name in ("base", *MOVING_BODIES)}),
        payload=_body(table.payload),
        friction=_friction(joints),
        mount=Mount(_given(table.mount.force_N), _given(table.mount.moment_Nm)),
        limits=limits,
        drives=tuple(
            _drive(file, f"joints.{name}.drive", getattr(joint, "drive", None), joint.rotor, known, searched)
            for name, joint in zip(JOINTS, joints, strict=True)
        ),
        actuator=_linear_drive(file, table.joints.extension.actuator, known, searched),
        poses=MappingProxyType(poses),
        keep_out=None if table.keep_out is None else _keep_out(table.keep_out),
        calibration=None if table.calibration is None else table.calibration.calibration,
        rotors=tuple(joint.rotor if getattr(joint, "drive", None) is None else None for joint in joints),
    )


def _body(table: _BodyTable | _PayloadTable) -> Body:
    return Body(table.mass_kg, read_only(table.com_m), table.inertia_kg_m2, table.origin)


def _keep_out(table: _KeepOutTable) -> KeepOut:
    boxes = [Box(b.name, read_only(b.center_m), read_only(b.size_m), b.origin) for b in table.box]
    capsules = [Capsule(c.name, read_only(c.start_m), read_only(c.end_m), c.radius_m, c.origin) for c in table.capsule]
    return KeepOut((*boxes, *capsules), table.clearance_m, table.link_radius_m, table.payload_radius_m, table.origin)


def _given(table: "_Sourced[V] | None") -> Sourced[V] | None:
    return None if table is None else table.sourced


def _friction(joints: list[Any]) -> Friction:
    tables = [joint.friction for joint in joints]
    viscous, coulomb, asymmetric = zip(*((0.0, 0.0, 0.0) if t is None else t.figures for t in tables), strict=True)
    origins = tuple(None if t is None else t.origin for t in tables)
    return Friction(read_only(viscous), read_only(coulomb), origins, read_only(asymmetric))


def _limits(joints: list[Any], linkage: _LinkageTable) -> Limits:
    position, velocity, acceleration, jerk, unit = zip(*(joint.rows for joint in joints), strict=True)
    rates = {"velocity": velocity, "acceleration": acceleration, "jerk": jerk}
    return Limits(
        lower=read_only([p.lower * u for p, u in zip(position, unit, strict=True)]),
        upper=read_only([p.upper * u for p, u in zip(position, unit, strict=True)]),
        linkage=linkage.minimum_angle_deg.value * np.pi / 180.0,
        transmission=linkage.transmission_warning_deg.value * np.pi / 180.0,
        **{name: read_only([r.value * u for r, u in zip(row, unit, strict=True)]) for name, row in rates.items()},
        origins=MappingProxyType(
            {
                "position": tuple(p.origin for p in position),
                "linkage": (linkage.minimum_angle_deg.origin,),
                "transmission": (linkage.transmission_warning_deg.origin,),
                **{name: tuple(r.origin for r in row) for name, row in rates.items()},
            }
        ),
    )


def _drive(
    file: str, key: str, table: _DriveTable | None, inertia: Sourced[float] | None, known: Catalogue, searched: str
) -> Drive | None:
    if table is None:
        return None
    for kind, name, entries in (("motor", table.motor, known.motors), ("gearbox", table.gearbox, known.gearboxes)):
        _complain_unless_known(f"{file}: key {key}.{kind}", name, entries, searched)
    motor = known.motors[table.motor]
    voltage = table.bus_voltage_V
    if voltage is not None and motor.max_voltage is not None and voltage.value > motor.max_voltage:
        raise InputError(
            f"{file}: key {key}.bus_voltage_V: {voltage.value:g} V is above the {motor.max_voltage:g} V of {motor.name}"
        )
    wiring = table.wiring
    return Drive(
        motor=motor,
        gearbox=known.gearboxes[table.gearbox],
        bus_voltage=_given(voltage),
        wiring=None if wiring is None else Sourced(Wiring(wiring.value), wiring.origin),
        brake=_given(table.brake),
        inertia=inertia,
    )


def _linear_drive(file: str, table: _ActuatorTable | None, known: Catalogue, searched: str) -> LinearDrive | None:
    if table is None:
        return None
    _complain_unless_known(f"{file}: key joints.extension.actuator.model", table.model, known.actuators, searched)
    return LinearDrive(known.actuators[table.model], _given(table.brake))


def _complain_unless_known(where: str, name: str, entries: Mapping[str, object], searched: str) -> None:
    if name not in entries:
        meant = nearest_name(name, entries)
        hint = "" if meant is None else f"; did you mean {meant}?"
        raise InputError(f"{where}: {name!r} is not in {searched} ({', '.join(entries) or 'none'}){hint}")


def _pose(table: _PoseTable) -> Array:
    degrees = np.radians([table.yaw_deg, table.inner_deg, table.lower_deg, table.wrist_deg])
    return read_only([*degrees[:3], table.extension_m, degrees[3]])
