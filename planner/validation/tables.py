"""Comparison of the thesis's printed tables with this model, row by row.

Rows marked "corrected" or "recomputed" contain values that the thesis prints wrongly, or with fewer
digits. They were found with independent rigid-body models of the same bodies, and they guard this
model against change.

A value must agree within half a unit of its last printed digit. Values of table 2-7 must agree
within one unit, because the thesis rounded them twice or truncated them. The two known misprints of
the tables are replaced by the corrected value, and the note of the row says so.
"""

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from importlib.resources import files

import numpy as np

from boom_model import (
    JOINTS,
    ActuatorHorizontal,
    Body,
    Boom,
    FixedExtension,
    body_motion,
    forward_kinematics,
    inner_link_load,
    inverse_dynamics,
    inverse_kinematics,
)
from boom_model.arrays import Array, read_only
from boom_model.link_design import THESIS_LOAD, Beam, Material, euler_load, internal_forces, thesis_design
from planner.paths.path import JointLine
from planner.timing.profiles.cubic import cubic
from planner.timing.time_law import Motion

_HALF_DIGIT = 0.0005 + 1e-9  # tables 2-6 to 2-8 print three decimals; 1e-9 allows for binary rounding
_WHOLE_DIGIT = 0.001 + 1e-9

_JOINT_1 = (0.2288, 0.2059, 0.2303, 0.2984, 0.3695, 0.3712, 0.2388, -0.0417, -0.4228, -0.8174, -1.1236)
"""Joint 1 of table 2-8 for the same load, to four decimals [Nm].

The values were found by virtual work and by an independent rigid-body model.
"""


@dataclass(frozen=True)
class ValidationRow:
    """One printed value and the model's value."""

    table: str
    row: str
    quantity: str
    expected: float
    actual: float
    tolerance: float
    note: str = ""

    @property
    def ok(self) -> bool:
        """Whether the two values agree within the tolerance."""
        return bool(abs(self.actual - self.expected) <= self.tolerance)


ROW_HEADER = ("table", "row", "quantity", "expected", "actual", "tolerance", "ok", "note")


def row_cells(row: ValidationRow) -> tuple[str, ...]:
    """Return a row as table cells under ROW_HEADER."""
    numbers = (f"{row.expected:.6g}", f"{row.actual:.5f}", f"{row.tolerance:.1g}")
    return row.table, row.row, row.quantity, *numbers, "OK" if row.ok else "FAIL", row.note


def by_table(rows: Sequence[ValidationRow]) -> list[tuple[str, str, str, str]]:
    """Return per table: name, number of values, how many hold, largest difference / tolerance."""
    found = []
    for table in dict.fromkeys(row.table for row in rows):
        own = [row for row in rows if row.table == table]
        used = max(abs(row.actual - row.expected) / row.tolerance for row in own)
        found.append((table, f"{len(own)}", f"{sum(row.ok for row in own)}", f"{used:.2f}"))
    return found


def validate(boom: Boom) -> tuple[ValidationRow, ...]:
    """Compare a boom's model with the thesis's tables.

    These are tables 2-5 to 2-8 and 3-2, the loads of sections 3.5 and 3.6, and the link of chapter
    3.
    """
    motion = table_2_4_motion(boom)
    return (
        *_table_2_5(motion),
        *_table_2_6(boom, motion),
        *_table_2_7(boom),
        *_table_2_8(boom, motion),
        *_section_3_5(boom),
        *_section_3_6(boom),
        *_table_3_2(),
    )


def table_2_4_motion(boom: Boom) -> Motion:
    """Return the thesis's test path: a cubic of 10 s (table 2-4)."""
    start, goal = np.radians([0, 90, 180, 0, 0]), np.radians([90, 45, 150, 0, 90])
    goal[3] = 0.5
    return _cubic_motion(boom, start, goal, 10.0)


def table_3_1_motion(boom: Boom) -> Motion:
    """Return the thesis's move from transport to phenotyping: a cubic of 5 s (table 3-1)."""
    start, goal = np.radians([0, 0, 30, 0, -45]), np.radians([90, 60, 180, 0, 0])
    goal[3] = 1.0
    return _cubic_motion(boom, start, goal, 5.0)


def _cubic_motion(boom: Boom, start: Array, goal: Array, duration: float) -> Motion:
    path = JointLine(start, goal)
    law = cubic(boom, path)
    return Motion(path, law.stretched(duration / law.duration))


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
                "exact in decimal notation",
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
        constraint = FixedExtension(float(printed["hold_value"])) if fixed else ActuatorHorizontal()
        branches = [s.q for s in inverse_kinematics(boom, target, pitch, constraint).solutions]
        nearest = min(branches, key=lambda branch: float(np.abs(branch - q).max()), default=np.full(5, np.nan))
        for i, joint in enumerate(JOINTS):
            note = "pi, truncated to 3.141 in print" if f"{q[i]:.3f}" == "3.141" else ""
            if printed["test"] == "5" and joint == "yaw":
                note = "corrected: with the printed 0.785 the tip is at x = y; pi/2 reaches the target"
            unit = "m" if joint == "extension" else "rad"
            yield ValidationRow(
                "2-7", f"test {printed['test']}", f"{joint} [{unit}]", float(q[i]), float(nearest[i]), _WHOLE_DIGIT, note
            )
        for axis, wanted, value in zip("xyz", target, forward_kinematics(boom, q).position, strict=True):
            note = "tip position of the printed joint values, which have two decimals"
            yield ValidationRow("2-7", f"test {printed['test']}", f"{axis} [m]", wanted, float(value), 0.005, note)


def _table_2_8(boom: Boom, motion: Motion) -> Iterator[ValidationRow]:
    printed = _read("table_2_8_joint_torques.csv")
    q, qd, qdd, _ = motion(_times(printed))
    loads = inverse_dynamics(boom.with_payload(10.0), q, qd, qdd, payload_as="force", reactions=False)
    for row, tau, corrected in zip(printed, loads.tau, _JOINT_1, strict=True):
        at = f"t = {row['time_s']} s"
        note = f"corrected: the printed {row['matlab_tau1_Nm']} contains a wrong inertial force of the inner link"
        yield ValidationRow("2-8", at, "tau1 [Nm]", corrected, float(tau[0]), 0.00005 + 1e-9, note)
        for i in range(1, 5):
            unit = "N" if i == 3 else "Nm"
            expected = float(row[f"matlab_tau{i + 1}_{unit}"])
            yield ValidationRow("2-8", at, f"tau{i + 1} [{unit}]", expected, float(tau[i]), _HALF_DIGIT)


def _section_3_5(boom: Boom) -> Iterator[ValidationRow]:
    """Yield the loads of the inner link on table 3-1's move.

    They use the thesis's steps of 0.01 s, and the payload as a force.
    """
    q, qd, qdd, _ = table_3_1_motion(boom)(np.linspace(0.0, 5.0, 501))
    loads = inverse_dynamics(boom.with_payload(10.0), q, qd, qdd, payload_as="force")
    if loads.pins is None:
        raise RuntimeError("inverse_dynamics returned no pin forces")
    f8 = -inner_link_load(q, loads.pins)
    f8_note = (
        "recomputed: force of the inner link on the upper link in frame 5; "
        "the printed 758.1 and 859.9 N do not follow from this move"
    )
    for axis, low, high in ((0, -440.9, 935.8), (1, 85.0, 176.0)):
        for bound, expected, actual in (("least", low, f8[:, axis].min()), ("largest", high, f8[:, axis].max())):
            name = f"f8{'xy'[axis]} [N]"
            yield ValidationRow("3-1", f"{bound} of the move", name, expected, float(actual), 0.05 + 1e-9, f8_note)
    for at, expected in ((0, 220.3), (-1, 107.0)):
        yield ValidationRow(
            "3-1", f"t = {5 * -at} s", "tau2 [Nm]", expected, float(loads.tau[at, 1]), 0.05 + 1e-9, "recomputed"
        )
    inner = body_motion(boom, q, qd, qdd)["inner"]
    felt = inner.acceleration + boom.gravity * np.array([0.0, 0.0, 1.0])
    for name, vectors, printed in (
        ("omega {} [rad/s]", inner.angular_velocity, (0.293, 0.423, 0.314)),
        ("omega-dot {} [rad/s^2]", inner.angular_acceleration, (0.327, 0.377, 0.251)),
        ("v-dot-c {} [m/s^2]", felt, (8.493, 9.912, 0.165)),
    ):
        largest = np.abs(np.einsum("nji,nj->ni", inner.T[:, :3, :3], vectors)).max(axis=0)
        for letter, figure, size in zip("xyz", printed, largest, strict=True):
            yield ValidationRow("3-1", "largest of the move", name.format(letter), figure, float(size), _WHOLE_DIGIT)
    tip = forward_kinematics(boom, q).position
    speed = float(np.linalg.norm(np.diff(tip, axis=0), axis=-1).sum() / 5.0)
    yield ValidationRow("3-1", "mean of the move", "tip speed [m/s]", 0.726, speed, _HALF_DIGIT, "corrected: printed as 0.82")


def _section_3_6(boom: Boom) -> Iterator[ValidationRow]:
    """Yield the reduction of joint 2's torque with the thesis's optimised inner link."""
    q, qd, qdd, _ = table_3_1_motion(boom)(np.linspace(0.0, 5.0, 501))
    inertia = [[0.014, 0.0, -0.001], [0.0, 0.486, 0.0], [-0.001, 0.0, 0.477]]
    optimised = Body(5.55, read_only([0.3627, 0.0014, 0.0]), read_only(inertia))
    lighter = replace(boom, bodies={**boom.bodies, "inner": optimised})
    before, after = (
        inverse_dynamics(b.with_payload(10.0), q, qd, qdd, payload_as="force", reactions=False).tau[:, 1]
        for b in (boom, lighter)
    )
    reduction = 100.0 * (1.0 - after / before)
    note = "recomputed: printed as 12-11 %"
    yield ValidationRow("3-25", "least of the move", "tau2 saved [%]", 10.98, float(reduction.min()), 0.005 + 1e-9, note)
    yield ValidationRow("3-25", "largest of the move", "tau2 saved [%]", 11.71, float(reduction.max()), 0.005 + 1e-9, note)


def _table_3_2() -> Iterator[ValidationRow]:
    """Yield the thesis's link designed by its own method.

    The load case is that of section 3.5, with 1000 slices and steps of 0.1 mm.
    """
    steel = Material.load("steel")
    beam = Beam(length=1.0, width=0.01, material=steel)
    design = thesis_design(beam, THESIS_LOAD, stress_limit=175e6, deflection_limit=0.01)
    truncated = "truncated in print: the table's own 175.0 at 0.7 m is larger"
    for row in _read("table_3_2_beam_stress.csv"):
        last = row["x_m"] == "max"
        stress = design.stress.max() if last else design.stress[round(1000 * float(row["x_m"]))]
        at, tolerance = ("largest", 0.1) if last else (f"x = {row['x_m']} m", 0.05)
        printed = 1e-6 * float(row["program_stress_Pa"])
        note = truncated if last else ""
        yield ValidationRow("3-2", at, "stress [MPa]", printed, float(1e-6 * stress), tolerance + 1e-9, note)
    for stage, H in (("stage 1", design.stress_heights), ("stage 2", design.heights)):
        yield ValidationRow("3-19", stage, "end's height [mm]", 1.0, float(1e3 * H[-1]), 1e-9, "printed in section 3.6")
    own = internal_forces(beam, design.heights, THESIS_LOAD.cases).M[0]
    again = float((design.coefficients / design.moments.clip(min=1e-300) * np.abs(own) / design.heights**3)[:-1].sum())
    for stage, expected, actual, tolerance, note in (
        ("stage 1", 2.1, design.stress_deflection, 0.05, ""),
        ("stage 2", 1.0, design.deflection, 0.00005, "by the thesis's formula, with the moments of stage 1"),
        ("stage 2, own mass", 1.0019, again, 0.00005, "recomputed with the final mass: above the thesis's limit"),
    ):
        yield ValidationRow("3-3", stage, "end's deflection [cm]", expected, 100.0 * actual, tolerance + 1e-9, note)
    solid = euler_load(steel.elastic_modulus, 0.02 * 0.01**3 / 12.0, 1.0)
    note = "one solid section; two loose plates carry a quarter of it"
    yield ValidationRow("3.38", "2 cm x 1 cm", "buckling [N]", 6700.0, solid, 50.0 + 1e-9, note)


def _read(name: str) -> list[dict[str, str]]:
    """Return the rows of a table as text, because a note may quote a value as it is printed."""
    text = (files("planner.validation") / "thesis_tables" / name).read_text(encoding="utf-8")
    return list(csv.DictReader(text.splitlines()))


def _times(printed: list[dict[str, str]]) -> Array:
    return np.array([float(row["time_s"]) for row in printed])
