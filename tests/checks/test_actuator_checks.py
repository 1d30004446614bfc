"""The linear actuator's rows by hand, and that a missing figure is never a pass."""

from dataclasses import fields, replace

import numpy as np
import pytest

from boom_model import Basis, Boom, LinearActuator, LinearDrive, Origin, Sourced, screw_torque
from planner import Trajectory, Verdict, check
from planner.checks.drives.actuator import actuator_rows
from planner.checks.drives.duty import Duty
from tests.builders import SCREW, joint_view, row

SHEET = Origin(Basis.PRINTED, "this test")


def rows_of(force, speed, actuator=SCREW, brake=None, **kwargs):
    return list(actuator_rows(joint_view(tau=force, qd=speed, **kwargs), LinearDrive(actuator, brake), 0.0))


def test_screw_torque_by_hand():
    """600 N on a lead of 10 mm: 600 x 0.01 / (2 pi) = 0.955 Nm; driven at 80 %, 1.194 Nm."""
    assert screw_torque(SCREW, 600.0, -0.1) == pytest.approx(0.95493, abs=5e-6)
    assert screw_torque(SCREW, [600.0, -600.0], [0.1, -0.1]) == pytest.approx([1.19366, -1.19366], abs=5e-6)
    assert screw_torque(replace(SCREW, lead=None), 600.0, 0.1) is None


def test_every_row_by_hand():
    """-600 N at 0.3 m/s for 1 s of 4: 0.3 / 0.01 turns a second; cube mean 600 N."""
    t = np.array([0.0, 1.0, 1.0 + 1e-9, 4.0])
    rows = rows_of([-600.0] * 4, [0.3, 0.3, 0.0, 0.0], t=t, static=-450.0)
    found = {r.check: (r.demand, r.limit) for r in rows}
    assert found == {
        "actuator peak force": (600.0, 800.0),
        "actuator mean force": (pytest.approx(600.0), 500.0),
        "actuator hold": (450.0, 900.0),
        "actuator speed": (0.3, 0.35),
        "actuator stroke": (0.0, 1.0),
        "actuator duty": (pytest.approx(0.25), 0.25),
        "actuator screw torque": (pytest.approx(0.95493, abs=5e-6), None),
        "actuator screw speed": (pytest.approx(2 * np.pi * 30), None),
        "power-off hold": (450.0, 100.0),
    }
    assert row(rows, "actuator mean force").verdict is Verdict.FAIL
    assert row(rows, "actuator screw torque").verdict is Verdict.INFO


def test_mean_force_is_the_cube_mean_over_the_travel():
    """600 N over 0.3 m, then 300 N over 0.1 m: ((0.3 x 600^3 + 0.1 x 300^3) / 0.4)^(1/3) = 552.6 N;
    the plain mean is 450 N."""
    t = np.array([0.0, 1.0, 1.0 + 1e-9, 2.0])
    mean = row(rows_of([-600.0, -600.0, 300.0, 300.0], [0.3, 0.3, -0.1, -0.1], t=t), "actuator mean force")
    assert mean.demand == pytest.approx(168.75e6 ** (1 / 3), rel=1e-8)
    assert mean.demand == pytest.approx(552.6, abs=0.05)


@pytest.mark.parametrize(
    ("figure", "check_name"),
    [
        ("peak_force", "actuator peak force"),
        ("rated_force", "actuator mean force"),
        ("static_force", "actuator hold"),
        ("max_speed", "actuator speed"),
        ("stroke", "actuator stroke"),
        ("duty", "actuator duty"),
        ("lead", "actuator screw torque"),
        ("efficiency", "actuator screw torque"),
        ("lead", "actuator screw speed"),
    ],
)
def test_a_missing_figure_is_not_checkable(figure, check_name):
    rows = rows_of(100.0, 0.1, replace(SCREW, **{figure: None}))
    assert row(rows, check_name).verdict is Verdict.NOT_CHECKABLE


@pytest.mark.parametrize(
    ("brake", "verdict"),
    [
        (None, Verdict.FAIL),
        (Sourced(False, SHEET), Verdict.FAIL),
        (Sourced(True, Origin(Basis.ASSUMED, "hoped for")), Verdict.WARN),
        (Sourced(True, SHEET), Verdict.PASS),
        (Sourced(True, Origin(Basis.MEASURED, "seen on the machine")), Verdict.PASS),
    ],
)
def test_power_off_needs_a_brake(brake, verdict):
    assert row(rows_of(100.0, 0.1, brake=brake), "power-off hold").verdict is verdict


def test_the_boom_with_an_actuator_is_checked_with_it():
    """The rows replace those of a joint without a drive, and count the stroke from the joint's
    lower limit."""
    boom = replace(Boom.load(), actuator=LinearDrive(SCREW, Sourced(True, SHEET)))
    q = np.tile(boom.pose("phenotyping"), (3, 1))
    still = Trajectory.from_samples([0.0, 1.0, 2.0], q, np.zeros((3, 5)), np.zeros((3, 5)))
    rows = [r for r in check(boom, still).rows if r.joint == "extension"]
    assert row(rows, "actuator stroke").demand == 1.0
    assert row(rows, "actuator duty").demand == 0.0
    assert not [r for r in rows if r.check.startswith("drive")]
    assert Duty.alone(still.t).duration == 2.0
    bare = LinearActuator(**{f.name: "bare" if f.name in ("name", "source") else None for f in fields(LinearActuator)})
    verdicts = {
        r.verdict for r in check(replace(boom, actuator=LinearDrive(bare)), still).rows if r.check.startswith("actuator")
    }
    assert verdicts == {Verdict.NOT_CHECKABLE}
