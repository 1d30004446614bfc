"""Checks as data: units, severities and margins of every kind, by the enumeration alone."""

import numpy as np
import pytest

from boom_model import JOINTS, Basis, Boom, Origin
from planner import Verdict, check, plan
from planner.checks.kinds import DRIVE_PARTS, CheckKind, Margin, Part, Quantity, Severity
from planner.checks.rows import bounded, compared, informative, overall, unknown

SHEET = Origin(Basis.PRINTED, "this test")
SI = {
    "rad": ("deg", np.degrees(1.0)),
    "rad/s": ("deg/s", np.degrees(1.0)),
    "rad/s^2": ("deg/s^2", np.degrees(1.0)),
    "rad/s^3": ("deg/s^3", np.degrees(1.0)),
}


def test_people_read_angles_in_degrees_shafts_in_rpm_and_lengths_of_the_tip_in_millimetres():
    other = {
        Quantity.SHAFT_SPEED: ("rpm", 60.0 / (2.0 * np.pi)),
        Quantity.LOST_MOTION: ("mrad", 1e3),
        Quantity.DEFLECTION: ("mm", 1e3),
        Quantity.LIFE: ("h", 1.0 / 3600.0),
    }
    for quantity in Quantity:
        for joint in (*JOINTS, "tip", "arm", "mount"):
            si = quantity.unit(joint)
            name, per_si = other.get(quantity, SI.get(si, (si, 1.0)))
            shown = quantity.for_people(joint)
            assert (shown.name, shown.per_si) == (name, pytest.approx(per_si, rel=1e-15))


@pytest.mark.parametrize(("joint", "unit"), [("inner", "Nm"), ("extension", "N")])
def test_a_joint_that_slides_has_forces(joint, unit):
    assert CheckKind.DRIVE_WORST_HOLD.quantity.unit(joint) == unit
    assert CheckKind.POSITION.quantity.unit(joint) == {"Nm": "rad", "N": "m"}[unit]


def test_a_text_names_one_kind():
    assert len({str(kind) for kind in CheckKind}) == len(CheckKind)
    assert CheckKind("motor torque, reversed") is CheckKind.MOTOR_TORQUE_REVERSED
    assert {kind.part for kind in CheckKind} == set(Part)


def test_motors_keep_half_as_much_again_and_nothing_else_does():
    kept = {kind for kind in CheckKind if kind.required_margin}
    assert {str(kind) for kind in kept} == {
        "motor hold",
        "motor torque",
        "motor torque, reversed",
        "motor torque, quasi-static",
    }
    assert {kind.required_margin for kind in kept} == {0.5}


@pytest.mark.parametrize("kind", CheckKind)
def test_a_demand_beyond_its_limit_has_the_verdict_of_its_severity(kind):
    if kind.severity is Severity.INFORMATION:
        assert informative(joint="lower", kind=kind, figure=2.0, limit=1.0, origin=SHEET).verdict is Verdict.INFO
        return
    if kind.margin is Margin.DISTANCE:
        row = bounded(joint="lower", kind=kind, value=2.0, bound=1.0, distance=-1.0, at=0.0, origin=SHEET)
        within = bounded(joint="lower", kind=kind, value=0.5, bound=1.0, distance=0.5, at=0.0, origin=SHEET)
    else:
        row = compared(joint="lower", kind=kind, demand=2.0, limit=1.0, origin=SHEET)
        within = compared(joint="lower", kind=kind, demand=0.5, limit=1.0, origin=SHEET)
    assert row.verdict is {Severity.LIMIT: Verdict.FAIL, Severity.GUIDELINE: Verdict.WARN}[kind.severity]
    assert within.verdict is Verdict.PASS
    missing = unknown(joint="lower", kind=kind, why="not printed")
    assert missing.verdict is Verdict.NOT_CHECKABLE
    assert overall([missing, within]) is Verdict.INCOMPLETE


def test_rows_of_a_move_are_of_the_part_that_their_kind_says():
    """Joints with a drive have gearbox, motor and brake; the others say what they need of one."""
    report = check(Boom.load(), plan(Boom.load(), "transport", "phenotyping").trajectory)
    for joint in JOINTS:
        parts = {row.kind.part for row in report.rows if row.joint == joint} & DRIVE_PARTS
        driven = joint in ("inner", "lower")
        assert parts == ({Part.GEARBOX, Part.MOTOR, Part.BRAKE} if driven else {Part.UNKNOWN_DRIVE})
