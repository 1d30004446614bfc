"""A boom with another drive, and the law of friction."""

from dataclasses import replace

import numpy as np
import pytest

from boom_model import Boom, Friction, InputError, LinearActuator, LinearDrive, inverse_dynamics

BOOM = Boom.load()
SCREW = LinearActuator("screw", "this test", *[None] * 10)


def test_another_drive_leaves_the_rest_of_the_boom_as_it_is():
    drive = replace(BOOM.drives[1], bus_voltage=None)
    changed = BOOM.with_drive("lower", drive)
    assert changed.drives == (*BOOM.drives[:2], drive, *BOOM.drives[3:])
    assert replace(changed, drives=BOOM.drives).__dict__ == BOOM.__dict__
    assert BOOM.with_drive("inner", None).drives[1] is None
    assert BOOM.with_drive("extension", LinearDrive(SCREW)).actuator == LinearDrive(SCREW)


@pytest.mark.parametrize(
    ("joint", "drive", "message"),
    [("elbow", None, "unknown joint 'elbow'"), ("yaw", LinearDrive(SCREW), "yaw turns")],
)
def test_a_drive_that_does_not_fit_is_named(joint, drive, message):
    with pytest.raises(InputError, match=message):
        BOOM.with_drive(joint, drive)


def test_friction_is_viscous_and_coulomb_against_the_motion_and_is_what_the_dynamics_adds():
    friction = Friction(np.array([1.0, 2.0, 3.0, 4.0, 5.0]), np.array([10.0, 0.0, 20.0, 0.0, 30.0]), (None,) * 5)
    qd = np.array([[0.5, -0.5, 0.0, 2.0, -1.0], [-0.5, 0.5, 1.0, 0.0, 0.1]])
    by_hand = [[10.5, -1.0, 0.0, 8.0, -35.0], [-10.5, 1.0, 23.0, 0.0, 30.5]]
    np.testing.assert_allclose(friction.torque(qd), by_hand, rtol=1e-15)
    rough, q = replace(BOOM, friction=friction), BOOM.pose("phenotyping")
    with_it, without = (inverse_dynamics(rough, q, qd, np.zeros(5), friction=f).tau for f in (True, False))
    np.testing.assert_allclose(with_it - without, by_hand, rtol=0, atol=1e-12)
