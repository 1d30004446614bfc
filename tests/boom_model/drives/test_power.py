"""Power of stepper drives against figures worked out by hand from the datasheets."""

from dataclasses import replace

import numpy as np
import pytest

from boom_model import Boom, Catalogue, Wiring
from boom_model.drives.power import copper_per_torque, copper_power, load_current, shaft_power

CATALOGUE = Catalogue.load()
DRIVE = Boom.load().drives[1]

# Current [A] and resistance [ohm] as the sheet prints them, and 2 I^2 R [W].
WINDINGS = {
    ("MST340B02", "parallel"): (6.6, 0.2, 17.424),
    ("MST340B02", "series"): (3.3, 0.8, 17.424),
    ("MST341B02", "parallel"): (6.5, 0.2, 16.9),
    ("MST341B02", "series"): (3.3, 0.9, 19.602),
    ("MST342B02", "parallel"): (6.8, 0.4, 36.992),
    ("MST342B02", "series"): (3.4, 1.9, 43.928),
    ("MST342C02", "parallel"): (9.5, 0.2, 36.1),
    ("MST342C02", "series"): (4.7, 0.9, 39.762),
    ("QSH8618-65-59-340", "parallel"): (5.9, 0.28, 19.4936),
    ("QSH8618-65-59-340", "series"): (3.0, 1.14, 20.52),
    ("QSH8618-80-55-460", "single"): (5.5, 0.42, 25.41),
    ("QSH8618-96-55-700", "single"): (5.5, 0.45, 27.225),
    ("QSH8618-118-60-870", "single"): (6.0, 0.45, 32.4),
    ("QSH8618-156-62-1280", "single"): (6.2, 0.75, 57.66),
    ("AS1060", "single"): (5.0, 0.36, 18.0),
}


def test_every_printed_winding_is_here():
    printed = {(name, wiring) for name, motor in CATALOGUE.motors.items() for wiring in Wiring if getattr(motor, wiring)}
    assert printed == set(WINDINGS)


@pytest.mark.parametrize(("motor", "wiring"), WINDINGS)
def test_holding_power_is_twice_current_squared_times_resistance(motor, wiring):
    current, resistance, power = WINDINGS[motor, wiring]
    winding = getattr(CATALOGUE.motors[motor], wiring)
    assert copper_power(winding) == pytest.approx(power, rel=1e-12)
    assert copper_power(winding, 0.5 * current) == pytest.approx(power / 4.0, rel=1e-12)
    # Two phases in quadrature at the peak current, averaged over an electrical turn.
    angle = np.linspace(0.0, 2.0 * np.pi, 1000, endpoint=False)
    phases = np.sqrt(2.0) * current * np.stack([np.sin(angle), np.cos(angle)])
    np.testing.assert_allclose((resistance * phases**2).sum(axis=0), power, rtol=1e-12)


def test_the_current_follows_the_torque():
    np.testing.assert_allclose(load_current(DRIVE, [7.2, -3.6, 0.0]), [9.5, 4.75, 0.0])
    assert copper_per_torque(DRIVE) == pytest.approx(36.1 / 7.2**2)
    for bare in (replace(DRIVE, wiring=None), replace(DRIVE, motor=replace(DRIVE.motor, running_torque=None))):
        assert load_current(bare, 1.0) is None
        assert copper_per_torque(bare) is None


def test_power_at_the_shaft_by_hand():
    # 100 Nm at 0.5 rad/s and 0.2 rad/s^2: driving, then braking.
    inertia = 160**2 * (4.0e-4 + 176e-6)
    flow = shaft_power(DRIVE, [100.0, -100.0], 0.5, 0.2)
    np.testing.assert_allclose(flow.output, [50.0, -50.0])
    np.testing.assert_allclose(flow.rotor, inertia * 0.2 * 0.5)
    np.testing.assert_allclose(flow.gear_loss, [50.0 * (1 / 0.65 - 1) + 0.42 * 160 * 0.5, 0.0], atol=1e-12)
    np.testing.assert_allclose(flow.shaft, flow.output + flow.rotor + flow.gear_loss)
    assert shaft_power(replace(DRIVE, gearbox=replace(DRIVE.gearbox, efficiency=None)), 1.0, 1.0, 1.0) is None
