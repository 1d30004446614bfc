"""Catalogue of motors, gearboxes and linear actuators.

It is a TOML file in the units of the datasheets; loading converts them to SI.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from boom_model.drives.drive import Gearbox, Motor, Winding
from boom_model.drives.linear_actuator import LinearActuator
from boom_model.errors import InputError
from boom_model.plausible import (
    ACCURACY,
    ACTUATOR_SPEED,
    CURRENT,
    DRIVE_MASS,
    EFFICIENCY,
    FORCE,
    INDUCTANCE,
    INPUT_INERTIA,
    INPUT_SPEED,
    LEAD,
    PERCENT,
    PLAY,
    RATED_LIFE,
    RATIO,
    RESISTANCE,
    ROTOR_INERTIA,
    SHOCK_EVENTS,
    STEP_ANGLE,
    STIFFNESS,
    STROKE,
    TEMPERATURE,
    TORQUE,
    VOLTAGE,
)
from boom_model.toml_file import Table, parse_toml, validated

CATALOGUE_FILE = Path(str(files("boom_model") / "data" / "catalogue.toml"))

_RPM = 2.0 * np.pi / 60.0

_Text = Annotated[str, Field(min_length=1)]


@dataclass(frozen=True)
class Catalogue:
    """Motors, gearboxes and linear actuators by model name."""

    motors: Mapping[str, Motor]
    gearboxes: Mapping[str, Gearbox]
    actuators: Mapping[str, LinearActuator]

    @staticmethod
    def load(path: str | Path | None = None) -> "Catalogue":
        """Return the shipped catalogue, or another file of the same form.

        Raises:
            InputError: the file cannot be read or is malformed; the message names file and key.
        """
        file = Path(path) if path is not None else CATALOGUE_FILE
        return Catalogue.of(parse_toml(file), str(file))

    @staticmethod
    def of(data: dict[str, Any], name: str) -> "Catalogue":
        """Return the catalogue of a file that is read already; `name` is of the file in messages.

        Raises:
            InputError: as `load`.
        """
        table = validated(name, data, _CatalogueTable)
        return Catalogue(
            motors=MappingProxyType({name: _motor(name, t) for name, t in table.motors.items()}),
            gearboxes=MappingProxyType({name: _gearbox(name, t) for name, t in table.gearboxes.items()}),
            actuators=MappingProxyType({name: _actuator(name, t) for name, t in table.actuators.items()}),
        )

    def with_file(self, path: str | Path | None) -> "Catalogue":
        """Return this catalogue with the entries of another file added; None adds nothing.

        Raises:
            InputError: as `load`, or an entry of the file has a name that the catalogue already
                has; the message names file and entry.
        """
        if path is None:
            return self
        own = Catalogue.load(path)
        for field in fields(self):
            for name in getattr(own, field.name):
                if name in getattr(self, field.name):
                    raise InputError(f"{path}: key {field.name}.{name}: the catalogue already has an entry of this name")
        return Catalogue(**{f.name: MappingProxyType({**getattr(self, f.name), **getattr(own, f.name)}) for f in fields(self)})


class _WindingTable(Table):
    current_A: Annotated[float, CURRENT]
    resistance_ohm: Annotated[float, RESISTANCE]
    inductance_mH: Annotated[float, INDUCTANCE]
    voltage_V: Annotated[float, VOLTAGE] | None = None


class _MotorTable(Table):
    """Table of a motor: a stepper has `step_deg`, a servo its torques and speeds.

    No check uses the phase voltage, the temperatures and the shaft loads; they are in the file for
    its readers.
    """

    source: _Text
    tolerance_percent: Annotated[float, PERCENT] | None = None
    step_deg: Annotated[float, STEP_ANGLE] | None = None
    full_step_accuracy_deg: Annotated[float, ACCURACY] | None = None
    microstep_accuracy_deg: Annotated[float, ACCURACY] | None = None
    max_voltage_V: Annotated[float, VOLTAGE] | None = None
    holding_torque_Nm: Annotated[float, TORQUE] | None = None
    running_torque_Nm: Annotated[float, TORQUE] | None = None
    mass_kg: Annotated[float, DRIVE_MASS] | None = None
    rotor_inertia_kg_cm2: Annotated[float, ROTOR_INERTIA] | None = None
    ambient_degC: Annotated[list[Annotated[float, TEMPERATURE]], Field(min_length=2, max_length=2)] | None = None
    max_operating_degC: Annotated[float, TEMPERATURE] | None = None
    max_radial_load_kg: Annotated[float, DRIVE_MASS] | None = None
    max_thrust_load_kg: Annotated[float, DRIVE_MASS] | None = None
    parallel: _WindingTable | None = None
    series: _WindingTable | None = None
    single: _WindingTable | None = None
    rated_torque_Nm: Annotated[float, TORQUE] | None = None
    peak_torque_Nm: Annotated[float, TORQUE] | None = None
    rated_speed_rpm: Annotated[float, INPUT_SPEED] | None = None
    max_speed_rpm: Annotated[float, INPUT_SPEED] | None = None

    @model_validator(mode="after")
    def _in_order(self) -> "_MotorTable":
        servo = [name for name in _SERVO if getattr(self, name) is not None]
        stepper = [name for name in _STEPPER if getattr(self, name) is not None]
        if "step_deg" in stepper and servo:
            raise ValueError(f"{servo[0]} is for a servo motor, which has no step_deg")
        if "step_deg" not in stepper and (stepper or not servo):
            raise ValueError(
                "step_deg is missing; a servo motor has rated_torque_Nm in its place, and none of a stepper's figures"
            )
        _require_order("running_torque_Nm", self.running_torque_Nm, "holding_torque_Nm", self.holding_torque_Nm)
        _require_order("rated_torque_Nm", self.rated_torque_Nm, "peak_torque_Nm", self.peak_torque_Nm)
        _require_order("rated_speed_rpm", self.rated_speed_rpm, "max_speed_rpm", self.max_speed_rpm)
        return self


_SERVO = ("rated_torque_Nm", "peak_torque_Nm", "rated_speed_rpm", "max_speed_rpm")
_STEPPER = (
    "step_deg", "full_step_accuracy_deg", "microstep_accuracy_deg", "holding_torque_Nm", "running_torque_Nm",
    "parallel", "series", "single",
)  # fmt: skip

_RATINGS = ("max_average_torque_Nm", "start_stop_torque_Nm", "peak_torque_Nm")
"""Torque ratings of a gearbox in ascending order."""


class _GearboxTable(Table):
    source: _Text
    ratio: Annotated[float, RATIO]
    continuous_torque_Nm: Annotated[float, TORQUE] | None = None
    start_stop_torque_Nm: Annotated[float, TORQUE] | None = None
    max_average_torque_Nm: Annotated[float, TORQUE] | None = None
    peak_torque_Nm: Annotated[float, TORQUE] | None = None
    efficiency_percent: Annotated[float, EFFICIENCY] | None = None
    no_load_input_torque_Nm: Annotated[float, TORQUE] | None = None
    starting_torque_Nm: Annotated[float, TORQUE] | None = None
    backdrive_torque_Nm: Annotated[float, TORQUE] | None = None
    mass_kg: Annotated[float, DRIVE_MASS] | None = None
    input_inertia_kg_m2: Annotated[float, INPUT_INERTIA] | None = None
    torsion_T1_Nm: Annotated[float, TORQUE] | None = None
    torsion_T2_Nm: Annotated[float, TORQUE] | None = None
    torsion_K1_Nm_per_mrad: Annotated[float, STIFFNESS] | None = None
    torsion_K2_Nm_per_mrad: Annotated[float, STIFFNESS] | None = None
    torsion_K3_Nm_per_mrad: Annotated[float, STIFFNESS] | None = None
    backlash_mrad: Annotated[float, PLAY] | None = None
    hysteresis_mrad: Annotated[float, PLAY] | None = None
    max_input_speed_rpm: Annotated[float, INPUT_SPEED] | None = None
    max_average_input_speed_rpm: Annotated[float, INPUT_SPEED] | None = None
    rated_life_h: Annotated[float, RATED_LIFE] | None = None
    rated_L10_h: Annotated[float, RATED_LIFE] | None = None
    rated_input_speed_rpm: Annotated[float, INPUT_SPEED] | None = None
    peak_events: Annotated[float, SHOCK_EVENTS] | None = None

    @model_validator(mode="after")
    def _in_order(self) -> "_GearboxTable":
        given = [name for name in _RATINGS if getattr(self, name) is not None]
        for low, high in pairwise(given):
            _require_order(low, getattr(self, low), high, getattr(self, high))
        T1, T2 = self.torsion_T1_Nm, self.torsion_T2_Nm
        if T1 is not None and T2 is not None and T1 >= T2:
            raise ValueError(f"torsion_T1_Nm is {T1:g}; it must be below torsion_T2_Nm, which is {T2:g}")
        return self


class _ActuatorTable(Table):
    source: _Text
    rated_force_N: Annotated[float, FORCE] | None = None
    peak_force_N: Annotated[float, FORCE] | None = None
    static_force_N: Annotated[float, FORCE] | None = None
    max_speed_m_s: Annotated[float, ACTUATOR_SPEED] | None = None
    stroke_m: Annotated[float, STROKE] | None = None
    lead_mm: Annotated[float, LEAD] | None = None
    efficiency_percent: Annotated[float, EFFICIENCY] | None = None
    backdrive_force_N: Annotated[float, FORCE] | None = None
    duty_percent: Annotated[float, PERCENT] | None = None
    mass_kg: Annotated[float, DRIVE_MASS] | None = None


class _CatalogueTable(Table):
    motors: dict[str, _MotorTable] = Field(default_factory=dict)
    gearboxes: dict[str, _GearboxTable] = Field(default_factory=dict)
    actuators: dict[str, _ActuatorTable] = Field(default_factory=dict)


def _require_order(low: str, least: float | None, high: str, most: float | None) -> None:
    if least is not None and most is not None and least > most:
        raise ValueError(f"{high} is {most:g}, less than {low}, which is {least:g}")


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor


def _winding(table: _WindingTable | None) -> Winding | None:
    if table is None:
        return None
    return Winding(table.current_A, table.resistance_ohm, table.inductance_mH * 1e-3)


_PER_UNIT = {
    "Nm_per_mrad": 1e3,
    "kg_cm2": 1e-4,
    "kg_m2": 1.0,
    "percent": 0.01,
    "mrad": 1e-3,
    "deg": np.pi / 180.0,
    "rpm": _RPM,
    "m_s": 1.0,
    "mm": 1e-3,
    "Nm": 1.0,
    "kg": 1.0,
    "N": 1.0,
    "V": 1.0,
    "m": 1.0,
    "h": 3600.0,
}
"""Unit in SI of each ending of a key, the longer endings first."""


def _in_si(table: Table, kind: type) -> dict[str, Any]:
    """Return the numbers of a table in SI, by the names of `kind`'s fields."""
    found: dict[str, Any] = {}
    names = {field.name for field in fields(kind)}
    for key, value in table:
        unit = next((unit for unit in _PER_UNIT if key.endswith(f"_{unit}")), None)
        name = key if unit is None else key.removesuffix(f"_{unit}")
        if name in names and (unit is not None or isinstance(value, float)):
            found[name] = value if unit is None or value is None else value * _PER_UNIT[unit]
    return found


def _motor(name: str, t: _MotorTable) -> Motor:
    values = _in_si(t, Motor)
    parallel, series, single = (_winding(table) for table in (t.parallel, t.series, t.single))
    return Motor(name=name, source=t.source, parallel=parallel, series=series, single=single, **values)


def _gearbox(name: str, t: _GearboxTable) -> Gearbox:
    torques = (t.torsion_T1_Nm, t.torsion_T2_Nm)
    stiffness = tuple(_scaled(k, 1e3) for k in (t.torsion_K1_Nm_per_mrad, t.torsion_K2_Nm_per_mrad, t.torsion_K3_Nm_per_mrad))
    return Gearbox(
        name=name,
        source=t.source,
        torsion_torques=None if None in torques else torques,  # type: ignore[arg-type]
        torsion_stiffness=None if None in stiffness else stiffness,  # type: ignore[arg-type]
        **_in_si(t, Gearbox),
    )


def _actuator(name: str, t: _ActuatorTable) -> LinearActuator:
    return LinearActuator(name=name, source=t.source, **_in_si(t, LinearActuator))
