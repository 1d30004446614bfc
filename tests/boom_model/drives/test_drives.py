"""Drives against numbers worked out by hand from the datasheets, and against their own curves
turned round."""

from dataclasses import replace

import numpy as np
import pytest

from boom_model.boom import Boom
from boom_model.drives.drive import (
    STEPPER_MARGIN,
    Drive,
    Wiring,
    available_torque,
    drive_inertia,
    drive_torque_limit,
    drive_torque_tangent,
    motor_torque,
    reflected_inertia,
    speed_for_torque,
)
from boom_model.provenance import Basis, Origin, Sourced
from tests.builders import thesis_catalogue
from tests.oracles import derivative

DRIVE = Boom.load().drives[1]  # MST342C02 on CBG320160, at 80 V in parallel
HERE = Origin(Basis.ASSUMED, "this test")
RPM = 2 * np.pi / 60


def fed(drive: Drive, volts: float, wiring: Wiring) -> Drive:
    return replace(drive, bus_voltage=Sourced(volts, HERE), wiring=Sourced(wiring, HERE))


def without(part: str, name: str) -> Drive:
    """The drive with one figure of its motor or gearbox not printed."""
    return replace(DRIVE, **{part: replace(getattr(DRIVE, part), **{name: None})})


def random_drives(count: int, seed: int) -> list[Drive]:
    """Motors of the catalogue in either wiring, some below the voltage that drives their current at
    standstill."""
    rng = np.random.default_rng(seed)
    motors = list(thesis_catalogue().motors.values())
    wirings = (Wiring.PARALLEL, Wiring.SERIES)
    return [
        fed(replace(DRIVE, motor=motors[rng.integers(len(motors))]), rng.uniform(1.0, 165.0), wirings[rng.integers(2)])
        for _ in range(count)
    ]


def test_the_wiring_chooses_the_winding():
    assert DRIVE.winding is DRIVE.motor.parallel
    assert fed(DRIVE, 80.0, Wiring.SERIES).winding is DRIVE.motor.series
    assert replace(DRIVE, wiring=None).winding is None


def test_origins_of_the_supply_are_those_that_are_given():
    assert DRIVE.supply_origins == (DRIVE.bus_voltage.origin, DRIVE.wiring.origin)
    assert replace(DRIVE, bus_voltage=None).supply_origins == (DRIVE.wiring.origin,)
    assert replace(DRIVE, bus_voltage=None, wiring=None).supply_origins == ()


def test_reflected_inertia_is_14_75():
    # 160^2 (4.0e-4 + 1.76e-4) kg m^2
    assert reflected_inertia(DRIVE) == pytest.approx(25600 * 5.76e-4, rel=4e-16, abs=0)
    assert reflected_inertia(DRIVE) == pytest.approx(14.75, abs=0.005)


def test_drive_inertia_is_the_share_of_it_that_passes_the_gearbox():
    # 0.65 x 14.7456 kg m^2: what the motor spends on itself while driving would lose 35 % on its
    # way to the joint
    assert drive_inertia(DRIVE) == pytest.approx(0.65 * 25600 * 5.76e-4, rel=4e-16, abs=0)
    assert drive_inertia(without("gearbox", "efficiency")) == reflected_inertia(DRIVE)


@pytest.mark.parametrize(("part", "name"), [("motor", "rotor_inertia"), ("gearbox", "input_inertia")])
def test_without_both_inertias_there_is_no_reflected_one(part, name):
    assert reflected_inertia(without(part, name)) is None
    assert drive_inertia(without(part, name)) == 0.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("qd", "expected"),
    [
        pytest.param(0.3, 155.8 / (160 * 0.65) + 0.42, id="driving"),
        pytest.param(-0.3, 155.8 / 160, id="braking"),
        pytest.param(0.0, 155.8 / 160, id="holding"),
    ],
)
def test_motor_torque_for_the_thesis_s_155_8_newton_metres(qd, expected, sign):
    assert motor_torque(DRIVE, sign * 155.8, sign * qd, 0.0) == pytest.approx(sign * expected, rel=4e-16, abs=0)


@pytest.mark.parametrize(("qd", "printed"), [(0.3, 1.918), (0.0, 0.974)])
def test_motor_torque_as_the_drive_checks_print_it(qd, printed):
    assert motor_torque(DRIVE, 155.8, qd, 0.0) == pytest.approx(printed, abs=0.0005)


def test_by_efficiency_alone_it_is_the_no_load_torque_less():
    assert motor_torque(DRIVE, 155.8, 0.3, 0.0) - DRIVE.gearbox.no_load_input_torque == pytest.approx(1.498, abs=0.0005)


@pytest.mark.parametrize("qd", [0.3, 0.0, -0.3])
@pytest.mark.parametrize("qdd", [2.0, -2.0])
def test_the_motor_turns_its_own_inertia_160_times_as_fast(qd, qdd):
    # 160 x 2 rad/s^2 x 5.76e-4 kg m^2 = 0.18432 Nm, whatever the joint does
    own = motor_torque(DRIVE, 155.8, qd, qdd) - motor_torque(DRIVE, 155.8, qd, 0.0)
    assert own == pytest.approx(160 * qdd * 5.76e-4, abs=2.5e-16)


def test_no_torque_asks_for_no_motor_torque():
    assert motor_torque(DRIVE, 0.0, 0.3, 0.0) == 0.0


def random_motion(seed: int) -> np.ndarray:
    """tau, qd, qdd, each (1000,)."""
    return np.random.default_rng(seed).normal(size=(1000, 3)).T * [[100.0], [0.5], [2.0]]


def test_the_opposite_motion_asks_for_the_opposite_torque():
    tau, qd, qdd = random_motion(1)
    np.testing.assert_array_equal(motor_torque(DRIVE, -tau, -qd, -qdd), -motor_torque(DRIVE, tau, qd, qdd))


def test_braking_gets_no_credit_for_friction():
    tau, qd, _ = random_motion(2)
    brakes = tau * qd < 0
    asked = motor_torque(DRIVE, tau, qd, 0.0)
    np.testing.assert_array_equal(asked[brakes], tau[brakes] / 160)
    assert (np.abs(asked[~brakes]) > np.abs(tau[~brakes]) / 160 + 0.42).all()


def test_motor_torque_has_the_shape_of_the_motion():
    tau, qd, qdd = random_motion(3)[:, :6].reshape(3, 2, 3)
    asked = motor_torque(DRIVE, tau, qd, qdd)
    assert asked.shape == (2, 3)
    assert asked[1, 2] == motor_torque(DRIVE, tau[1, 2], qd[1, 2], qdd[1, 2])


@pytest.mark.parametrize(
    ("part", "name"),
    [
        ("gearbox", "efficiency"),
        ("gearbox", "no_load_input_torque"),
        ("gearbox", "input_inertia"),
        ("motor", "rotor_inertia"),
    ],
)
def test_motor_torque_needs_its_figures(part, name):
    assert motor_torque(without(part, name), 155.8, 0.3, 0.0) is None


CURVES = pytest.mark.parametrize(
    ("wiring", "current", "resistance", "inductance"),
    [(Wiring.PARALLEL, 9.5, 0.2, 1.4e-3), (Wiring.SERIES, 4.7, 0.9, 5.4e-3)],
)


@CURVES
@pytest.mark.parametrize("volts", [24.0, 80.0, 165.0])
def test_the_curve_of_the_thesis_s_motor(wiring, current, resistance, inductance, volts):
    w = np.array([0.0, 100.0, 694.0, 1000.0, 1800.0, 3000.0]) * RPM
    peak = np.sqrt(2) * current
    impedance_drop = np.hypot(resistance * peak + 7.2 / peak * w, 50 * w * inductance * peak)
    expected = np.where(impedance_drop < volts, 7.2, 7.2 * volts / impedance_drop)
    drive = fed(DRIVE, volts, wiring)
    np.testing.assert_allclose(available_torque(drive, w), expected, rtol=4e-16, atol=0)
    np.testing.assert_array_equal(available_torque(drive, -w), available_torque(drive, w))


def test_the_curve_at_1000_rpm():
    # I_p 13.435 A, K_m 0.53592 Nm/A, w 104.72 rad/s: 7.2 x 80 / hypot(2.687 + 56.121, 98.484) Nm
    assert available_torque(DRIVE, 1000 * RPM) == pytest.approx(5.0215, abs=0.00005)


def test_the_corner_at_80_v_in_parallel_is_at_694_rpm():
    corner = speed_for_torque(DRIVE, 7.2)
    assert corner / RPM == pytest.approx(694, abs=0.5)
    assert available_torque(DRIVE, corner) == pytest.approx(7.2, rel=1e-15, abs=0)
    assert available_torque(DRIVE, 1.001 * corner) < 7.2


def test_finer_steps_are_more_pole_pairs():
    fine = replace(DRIVE, motor=replace(DRIVE.motor, step=DRIVE.motor.step / 2))
    w, peak = 300.0, np.sqrt(2) * 9.5
    expected = 7.2 * 80 / np.hypot(0.2 * peak + 7.2 / peak * w, 100 * w * 1.4e-3 * peak)
    assert available_torque(fine, w) == pytest.approx(expected, rel=4e-16, abs=0)


def test_the_curve_falls_with_speed():
    w = np.linspace(0.0, 600.0, 2001)
    for drive in random_drives(50, seed=4):
        steps = np.diff(available_torque(drive, w))
        below = w[1:] <= speed_for_torque(drive, drive.motor.running_torque)
        assert (steps[below] == 0.0).all()
        assert (steps[~below] < 0.0).all()


def test_speed_for_torque_turns_the_curve_round():
    rng = np.random.default_rng(5)
    for drive in random_drives(200, seed=6):
        torque = rng.uniform(0.02, 1.0) * float(available_torque(drive, 0.0))
        assert available_torque(drive, speed_for_torque(drive, torque)) == pytest.approx(torque, rel=4e-15, abs=0)


def test_the_curve_turns_speed_for_torque_round():
    rng = np.random.default_rng(7)
    for drive in random_drives(200, seed=8):
        speed = speed_for_torque(drive, drive.motor.running_torque) + rng.uniform(1.0, 500.0)
        assert speed_for_torque(drive, float(available_torque(drive, speed))) == pytest.approx(speed, rel=4e-15, abs=0)


def test_curve_and_limit_have_the_shape_that_they_are_asked_in():
    grid = np.linspace(0.5, 8.0, 6).reshape(2, 3)
    for function in (available_torque, speed_for_torque, drive_torque_limit):
        expected = np.array([[function(DRIVE, value) for value in row] for row in grid])
        np.testing.assert_array_equal(function(DRIVE, grid), expected, strict=True)


@pytest.mark.parametrize(("torque", "speed"), [(7.2001, 0.0), (100.0, 0.0), (0.0, np.inf), (-1.0, np.inf)])
def test_torques_beyond_the_curve(torque, speed):
    assert speed_for_torque(DRIVE, torque) == speed


def test_a_voltage_too_low_for_the_current_reaches_the_running_torque_at_no_speed():
    weak = fed(DRIVE, 1.0, Wiring.PARALLEL)
    assert speed_for_torque(weak, 7.2) == 0.0
    # 1 V of 0.2 ohm x 9.5 A x sqrt(2)
    assert available_torque(weak, 0.0) == pytest.approx(7.2 / (0.2 * 9.5 * np.sqrt(2)), rel=4e-16, abs=0)


@pytest.mark.parametrize(
    "drive",
    [
        pytest.param(replace(DRIVE, bus_voltage=None), id="no voltage"),
        pytest.param(replace(DRIVE, wiring=None), id="no wiring"),
        pytest.param(without("motor", "parallel"), id="no winding"),
        pytest.param(without("motor", "running_torque"), id="no running torque"),
    ],
)
def test_without_supply_or_motor_data_there_is_no_curve(drive):
    assert available_torque(drive, 0.0) is None
    assert speed_for_torque(drive, 1.0) is None


def test_the_drives_limit_at_standstill():
    # (7.2 / 1.5 - 0.42) x 160 x 0.65 Nm
    assert drive_torque_limit(DRIVE, 0.0) == pytest.approx(4.38 * 104, rel=4e-16, abs=0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("speed", [0.1, 0.45, 0.6, 1.0, 2.0])
@pytest.mark.parametrize("qdd", [-3.0, 0.0, 3.0])
def test_the_drives_limit_is_where_driving_asks_for_the_curve_less_its_margin(speed, qdd, sign):
    tau = drive_torque_limit(DRIVE, speed) - 0.65 * 25600 * 5.76e-4 * qdd
    assert tau > 0
    asked = motor_torque(DRIVE, sign * tau, sign * speed, sign * qdd)
    assert asked == pytest.approx(sign * available_torque(DRIVE, 160 * speed) / 1.5, rel=2e-15, abs=0)


def test_the_drives_limit_is_at_most_the_start_stop_torque():
    strong = replace(DRIVE, motor=replace(DRIVE.motor, running_torque=7.3))  # would allow (7.3 / 1.5 - 0.42) 104 = 462.5 Nm
    assert drive_torque_limit(strong, 0.0) == 460.0
    assert motor_torque(strong, 460.0, 1e-3, 0.0) < available_torque(strong, 0.16) / 1.5


def test_the_drives_limit_falls_with_speed_and_ends_at_none():
    limits = [drive_torque_limit(DRIVE, speed) for speed in np.linspace(0.0, 8.0, 401)]
    assert (np.diff(limits) <= 0.0).all()
    assert limits[-1] == 0.0
    assert drive_torque_limit(DRIVE, -1.0) == drive_torque_limit(DRIVE, 1.0)


@pytest.mark.parametrize("part", ["bus_voltage", "wiring"])
def test_without_a_curve_the_running_torque_limits(part):
    bare = replace(DRIVE, **{part: None})
    assert drive_torque_limit(bare, 5.0) == drive_torque_limit(DRIVE, 0.0)


@pytest.mark.parametrize(
    ("part", "name"), [("motor", "running_torque"), ("gearbox", "efficiency"), ("gearbox", "no_load_input_torque")]
)
def test_without_the_motors_figures_the_start_stop_torque_limits(part, name):
    assert drive_torque_limit(without(part, name), 5.0) == 460.0


def test_without_the_start_stop_torque_the_motor_limits():
    assert drive_torque_limit(without("gearbox", "start_stop_torque"), 0.0) == drive_torque_limit(DRIVE, 0.0)


def test_without_any_figure_nothing_limits():
    bare = replace(without("gearbox", "start_stop_torque"), motor=replace(DRIVE.motor, running_torque=None))
    assert drive_torque_limit(bare, 1.0) is None


@pytest.mark.parametrize("drive", [DRIVE, fed(DRIVE, 24.0, Wiring.SERIES), fed(DRIVE, 1.0, Wiring.PARALLEL)])
@pytest.mark.parametrize("speed", [0.0, 0.3, 0.6, 1.5, 6.0])
def test_the_tangent_is_below_the_motors_curve_at_every_speed(drive, speed):
    everywhere = np.linspace(0.0, 8.0, 4001)
    intercept, slope = drive_torque_tangent(drive, speed)
    # As the motor allows it, negative where even the no-load torque is too much.
    allowed = (available_torque(drive, 160 * everywhere) / 1.5 - 0.42) * 160 * 0.65
    assert (np.minimum(intercept + slope * everywhere**2, allowed[0]) <= allowed + 1e-13).all()


@pytest.mark.parametrize("speed", [0.6, 1.0, -1.5, 6.0])
def test_the_tangent_touches_the_motors_curve(speed):
    def allowed(square: float) -> float:
        return float((available_torque(DRIVE, 160 * np.sqrt(square)) / 1.5 - 0.42) * 160 * 0.65)

    intercept, slope = drive_torque_tangent(DRIVE, speed)
    assert intercept + slope * speed**2 == pytest.approx(allowed(speed**2), abs=5e-13)
    assert slope == pytest.approx(derivative(lambda step: allowed(speed**2 + step), h=3e-3), rel=4e-11)


@pytest.mark.parametrize("speed", [0.0, 0.2, 0.45])
def test_below_the_corner_the_tangent_is_that_of_the_corner(speed):
    corner = float(speed_for_torque(DRIVE, 7.2)) / 160
    np.testing.assert_array_equal(drive_torque_tangent(DRIVE, speed), drive_torque_tangent(DRIVE, corner))


@pytest.mark.parametrize(
    "drive",
    [
        pytest.param(replace(DRIVE, bus_voltage=None), id="no voltage"),
        pytest.param(without("motor", "running_torque"), id="no running torque"),
        pytest.param(without("gearbox", "efficiency"), id="no efficiency"),
        pytest.param(without("gearbox", "no_load_input_torque"), id="no no-load torque"),
    ],
)
def test_without_its_figures_there_is_no_tangent(drive):
    assert drive_torque_tangent(drive, 1.0) is None


def test_a_stepper_keeps_half_again_what_it_needs():
    assert STEPPER_MARGIN == 0.5
