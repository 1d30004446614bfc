"""The thesis's printed tables, row by row, against this model.

A figure is met within half a unit of its last printed digit; those of table 2-7, which are rounded twice or cut off, within a
whole one. The tables' two known slips hold the corrected value and say so.
"""

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.resources import files

import numpy as np

from boom_model import (
    JOINTS,
    ActuatorHorizontal,
    Boom,
    FixedExtension,
    forward_kinematics,
    inverse_dynamics,
    inverse_kinematics,
)
from boom_model.arrays import Array
from planner.path import JointLine
from planner.profiles.cubic import cubic
from planner.time_law import Motion

_HALF_DIGIT = 0.0005 + 1e-9  # tables 2-6 to 2-8 print three decimals; the rest is the rounding of a binary half
_WHOLE_DIGIT = 0.001 + 1e-9

_JOINT_1 = (0.2288, 0.2059, 0.2303, 0.2984, 0.3695, 0.3712, 0.2388, -0.0417, -0.4228, -0.8174, -1.1236)
"""Joint 1 of table 2-8 for the same load by virtual work and by an independent rigid-body model, to four decimals [Nm]."""


@dataclass(frozen=True)
class ValidationRow:
    """One printed figure against the model's."""

    table: str
    row: str
    quantity: str
    expected: float
    actual: float
    tolerance: float
    note: str = ""

    @property
    def ok(self) -> bool:
        return bool(abs(self.actual - self.expected) <= self.tolerance)


def validate(boom: Boom) -> tuple[ValidationRow, ...]:
    """Tables 2-5 to 2-8 of the thesis against a boom's model."""
    motion = table_2_4_motion(boom)
    return (*_table_2_5(motion), *_table_2_6(boom, motion), *_table_2_7(boom), *_table_2_8(boom, motion))


def table_2_4_motion(boom: Boom) -> Motion:
    """The thesis's test path: a cubic of 10 s (table 2-4)."""
    start, goal = np.radians([0, 90, 180, 0, 0]), np.radians([90, 45, 150, 0, 90])
    goal[3] = 0.5
    path = JointLine(start, goal)
    law = cubic(boom, path)
    return Motion(path, law.stretched(10.0 / law.duration))


def _table_2_5(motion: Motion) -> Iterator[ValidationRow]:
    start, step = motion.path(0.0), motion.path(0.0, 1)
    for printed in _read("table_2_5_cubic_coefficients.csv"):
        i = int(float(printed["joint"])) - 1
        unit = 1.0 if JOINTS[i] == "extension" else np.degrees(1.0)
        for power in range(4):
            coefficient = float(motion.law.s.c[3 - power, 0]) * step[i] + (start[i] if power == 0 else 0.0)
            yield ValidationRow(
                "2-5",
                f"joint {i + 1}",
                f"c{power}",
                float(printed[f"c{power}"]),
                coefficient * unit,
                1e-9,
                "exact in decimals",
            )


def _table_2_6(boom: Boom, motion: Motion) -> Iterator[ValidationRow]:
    printed = _read("table_2_6_tip_position.csv")
    q = motion(_times(printed))[0]
    for row, tip in zip(printed, forward_kinematics(boom, q).position, strict=True):
        for axis, value in zip("xyz", tip, strict=True):
            name = f"matlab_{axis}_m"
            yield ValidationRow("2-6", f"t = {row['time_s']} s", f"{axis} [m]", float(row[name]), float(value), _HALF_DIGIT)


def _table_2_7(boom: Boom) -> Iterator[ValidationRow]:
    for printed in _read("table_2_7_inverse_kinematics.csv"):
        q = np.array([float(printed[f"q{i}_{'m' if i == 4 else 'rad'}"]) for i in range(1, 6)])
        target = [float(printed[f"{axis}_m"]) for axis in "xyz"]
        pitch = -np.pi / 2.0 if printed["pitch"] == "down" else np.pi / 2.0
        fixed = printed["hold"] == "extension_m"
        hold = FixedExtension(float(printed["hold_value"])) if fixed else ActuatorHorizontal()
        branches = [s.q for s in inverse_kinematics(boom, target, pitch, hold).solutions]
        nearest = min(branches, key=lambda branch: float(np.abs(branch - q).max()), default=np.full(5, np.nan))
        for i, joint in enumerate(JOINTS):
            note = "pi, printed as 3.141 without rounding" if f"{q[i]:.3f}" == "3.141" else ""
            if printed["test"] == "5" and joint == "yaw":
                note = "corrected: the printed 0.785 puts the tip at x = y; pi/2 reaches the target"
            unit = "m" if joint == "extension" else "rad"
            yield ValidationRow(
                "2-7", f"test {printed['test']}", f"{joint} [{unit}]", float(q[i]), float(nearest[i]), _WHOLE_DIGIT, note
            )
        for axis, wanted, value in zip("xyz", target, forward_kinematics(boom, q).position, strict=True):
            note = "tip of the printed joints, two decimals"
            yield ValidationRow("2-7", f"test {printed['test']}", f"{axis} [m]", wanted, float(value), 0.005, note)


def _table_2_8(boom: Boom, motion: Motion) -> Iterator[ValidationRow]:
    printed = _read("table_2_8_joint_torques.csv")
    q, qd, qdd, _ = motion(_times(printed))
    loads = inverse_dynamics(boom.with_payload(10.0), q, qd, qdd, payload_as="force", reactions=False)
    for row, tau, corrected in zip(printed, loads.tau, _JOINT_1, strict=True):
        at = f"t = {row['time_s']} s"
        note = f"corrected: the printed {row['matlab_tau1_Nm']} holds a wrong inertial force of the inner link"
        yield ValidationRow("2-8", at, "tau1 [Nm]", corrected, float(tau[0]), 0.00005 + 1e-9, note)
        for i in range(1, 5):
            unit = "N" if i == 3 else "Nm"
            expected = float(row[f"matlab_tau{i + 1}_{unit}"])
            yield ValidationRow("2-8", at, f"tau{i + 1} [{unit}]", expected, float(tau[i]), _HALF_DIGIT)


def _read(name: str) -> list[dict[str, str]]:
    """The rows of a table as text: a note may quote a figure as it is printed."""
    text = (files("planner") / "thesis_tables" / name).read_text(encoding="utf-8")
    return list(csv.DictReader(text.splitlines()))


def _times(printed: list[dict[str, str]]) -> Array:
    return np.array([float(row["time_s"]) for row in printed])
