"""Checks of motor and gearbox against the motor's datasheet; a servo motor has its own rows."""

from collections.abc import Iterator
from functools import reduce

import numpy as np

from boom_model import Basis, Drive, Origin, mesh_efficiency
from boom_model.arrays import Array
from boom_model.drives.drive import STEPPER_MARGIN, available_torque, motor_torque, speed_for_torque
from boom_model.drives.power import copper_power, shaft_power
from planner.checks.drives.joint_view import JointView
from planner.checks.drives.servo import inertia_row, servo_rows, sheet, unknown_torque
from planner.checks.kinds import CheckKind
from planner.checks.rows import SAMPLING_SLACK, Row, Verdict

LOW_SPEED = 2.0 * np.pi
"""Motor speed [rad/s] (60 rpm) up to which the running torque holds without a known supply.

Our own choice.
"""

RESONANCE_BAND = 0.2
"""Half width of the resonance band, as a share of the full-step resonance; our own choice."""

RESONANCE_CYCLES = 10.0
"""Guideline for the time in the resonance band, in periods of the resonance; our own choice."""


def motor_rows(view: JointView, drive: Drive) -> Iterator[Row]:
    """Return every motor row of a joint.

    Rows of static torque, torque forwards, reversed and at standstill, speed, RMS torque, power,
    inertia ratio, resonance, and the motor's torque against the gearbox.
    """
    motor, gear = drive.motor, drive.gearbox
    if motor.is_servo:
        yield from servo_rows(view, drive)
        return
    hold, at = view.peak(view.static)
    origin = Origin(Basis.PRINTED, f"{sheet(motor)}; without help from friction [own derivation]")
    yield view.compared(CheckKind.MOTOR_HOLD, demand=hold / gear.ratio, limit=motor.holding_torque, at=at, origin=origin)
    yield from _torque_rows(view, drive)
    yield from _power_rows(view, drive)
    yield inertia_row(view, drive)
    yield _resonance_row(view, drive)
    yield _overload_row(view, drive)


def _torque_rows(view: JointView, drive: Drive) -> Iterator[Row]:
    directions = [(CheckKind.MOTOR_TORQUE, view.tau, view.qd)]
    if view.steady:  # in the reversed motion only friction changes its sign
        directions.append((CheckKind.MOTOR_TORQUE_REVERSED, view.tau - 2.0 * view.friction, -view.qd))
    curve = available_torque(drive, drive.gearbox.ratio * np.abs(view.qd))
    demands, other = [], []
    for kind, tau, qd in directions:
        torque = motor_torque(drive, tau, qd, view.qdd)
        if torque is None:
            yield from _unknown_torque_rows(view, drive, [kind for kind, *_ in directions])
            return
        demands.append(np.abs(torque))
        less = motor_torque(drive, tau, qd, view.qdd, no_load_in_efficiency=True)
        other += [] if less is None else [np.abs(less)]
        yield _motor_torque_row(view, drive, kind, demands[-1], curve)
    yield _quasi_static_row(view, drive)
    if other:
        yield _other_reading_row(view, drive, reduce(np.maximum, other), curve)
    yield _motor_speed_row(view, drive, reduce(np.maximum, demands))
    braked = drive.brake is not None and drive.brake.value  # a motor without a brake stays on in a pause
    driven = np.where(view.duty.powered, demands[0], 0.0) if braked else demands[0]
    known = Origin(Basis.PRINTED, f"{sheet(drive.motor)}; a stepper's heat depends on its current, not on its torque")
    yield view.informative(CheckKind.MOTOR_RMS_TORQUE, figure=view.duty.mean(driven * driven) ** 0.5, origin=known)


def _unknown_torque_rows(view: JointView, drive: Drive, directions: list[CheckKind]) -> Iterator[Row]:
    """Return the torque and speed rows of a motor whose torque cannot be computed."""
    for kind in directions:
        yield view.unknown(kind, why=unknown_torque(drive))
    yield _quasi_static_row(view, drive)
    unknown = Origin(Basis.PRINTED, unknown_torque(drive))
    yield view.informative(CheckKind.MOTOR_TORQUE_OTHER_READING, figure=None, origin=unknown)
    fastest, at = view.peak(view.qd)
    yield view.compared(CheckKind.MOTOR_SPEED, demand=drive.gearbox.ratio * fastest, limit=None, at=at, origin=unknown)
    yield view.informative(CheckKind.MOTOR_RMS_TORQUE, figure=None, origin=unknown)


def _motor_torque_row(view: JointView, drive: Drive, kind: CheckKind, torque: Array, curve: Array | None) -> Row:
    """Return the row of the sample with the least margin.

    The limit is the torque-speed curve at the samples, or the running torque at low speed.
    """
    motor = drive.motor
    speed = drive.gearbox.ratio * np.abs(view.qd)
    running = motor.running_torque
    slow = Origin(Basis.PRINTED, f"{sheet(motor)}, running torque")
    if running is None or (curve is None and (speed > LOW_SPEED).any()):
        most, at = view.peak(torque)
        if running is not None and most * (1.0 + STEPPER_MARGIN - SAMPLING_SLACK) > running:
            # no supply gives more than the running torque
            return view.compared(kind, demand=most, limit=running, at=at, origin=slow)
        unknown = Origin(
            Basis.PRINTED, f"{sheet(motor)}; above {LOW_SPEED * 30.0 / np.pi:.0f} rpm the check needs bus voltage and wiring"
        )
        return view.compared(kind, demand=most, limit=None, at=at, origin=unknown)
    available = np.full_like(torque, running) if curve is None else curve
    on_curve = available < running * (1.0 - SAMPLING_SLACK)
    rows = []
    for part, origin, estimated in ((~on_curve, slow, False), (on_curve, _curve_origin(drive, "torque-speed curve"), True)):
        if part.any():
            at = int(np.flatnonzero(part)[_least_margin(available[part], torque[part])])
            demand, limit, when = float(torque[at]), float(available[at]), float(view.t[at])
            rows.append(view.compared(kind, demand=demand, limit=limit, at=when, origin=origin, warn_near=estimated))
    return max(rows, key=_severity)


def _severity(row: Row) -> tuple[int, float]:
    """Return the key that orders rows by verdict, then by margin.

    A WARN on the curve thus counts more than a PASS with less margin on the running torque.
    """
    return (Verdict.PASS, Verdict.WARN, Verdict.FAIL).index(row.verdict), -np.inf if row.margin is None else -row.margin


def _quasi_static_row(view: JointView, drive: Drive) -> Row:
    """Return the row of the slowest motion through the poses, in either direction.

    The demand is the torque that lifts the worst pose at zero speed.
    """
    load, at = view.peak(np.abs(view.static) + view.coulomb)
    torque, kind = motor_torque(drive, load, 1.0, 0.0), CheckKind.MOTOR_TORQUE_QUASI_STATIC
    if torque is None:
        return view.unknown(kind, why=unknown_torque(drive))
    running, curve = drive.motor.running_torque, available_torque(drive, 0.0)
    limit = running if curve is None else float(curve)
    weak = running is not None and limit is not None and limit < running * (1.0 - SAMPLING_SLACK)
    slow = Origin(Basis.PRINTED, f"{sheet(drive.motor)}, running torque; quasi-static motion through the poses")
    origin = _curve_origin(drive, "torque at zero speed") if weak else slow
    return view.compared(kind, demand=float(torque), limit=limit, at=at, origin=origin, warn_near=weak)


def _other_reading_row(view: JointView, drive: Drive, torque: Array, available: Array | None) -> Row:
    """Return the row of the other reading of the sheet's efficiency.

    In this reading the efficiency already includes the no-load torque. The row shows the sample
    with the least margin in either direction.
    """
    efficiency = mesh_efficiency(drive.gearbox)
    at = int(np.argmax(torque)) if available is None else _least_margin(available, torque)
    origin = Origin(
        Basis.ESTIMATED,
        f"if the printed efficiency includes the no-load torque: {efficiency:.3f} for the mesh alone; {drive.gearbox.source}; "
        f"{sheet(drive.motor)}",
    )
    limit = None if available is None else float(available[at])
    figure, when = float(torque[at]), float(view.t[at])
    return view.informative(CheckKind.MOTOR_TORQUE_OTHER_READING, figure=figure, at=when, origin=origin, limit=limit)


def _motor_speed_row(view: JointView, drive: Drive, torque: Array) -> Row:
    """Return the row of the sample with the least margin in speed.

    The limit is the speed at which the curve still gives the sample's torque with its margin.
    """
    speed = drive.gearbox.ratio * np.abs(view.qd)
    highest = speed_for_torque(drive, (1.0 + STEPPER_MARGIN) * torque)
    origin = _curve_origin(drive, "speed at which the curve gives the torque at that time with its margin [own derivation]")
    if highest is None:
        at = int(np.argmax(speed))
        limit = None
    else:
        at = _least_margin(highest, speed)
        limit = float(highest[at]) if np.isfinite(highest[at]) else None
    demand, when = float(speed[at]), float(view.t[at])
    return view.compared(CheckKind.MOTOR_SPEED, demand=demand, limit=limit, at=when, origin=origin, warn_near=True)


def _power_rows(view: JointView, drive: Drive) -> Iterator[Row]:
    """Return the rows of the winding loss at rated current and of the largest shaft power."""
    printed, winding = sheet(drive.motor), drive.winding
    loss = Origin(Basis.PRINTED, f"{printed}; 2 I^2 R at rated current, cold winding")
    if drive.wiring is None or winding is None:
        loss = Origin(Basis.PRINTED, f"{printed}; the loss in the windings needs the wiring")
    elif drive.wiring.origin.basis is not Basis.PRINTED:
        loss = Origin(drive.wiring.origin.basis, f"{loss.source}, {drive.wiring.value} ({drive.wiring.origin.basis})")
    held = None if winding is None else float(copper_power(winding))
    yield view.informative(CheckKind.MOTOR_HOLDING_POWER, figure=held, origin=loss)
    flow = shaft_power(drive, view.tau, view.qd, view.qdd)
    if flow is None:
        unknown = Origin(Basis.PRINTED, unknown_torque(drive))
        yield view.informative(CheckKind.MOTOR_PEAK_POWER, figure=None, origin=unknown)
        return
    peak, at = view.peak(flow.shaft)
    yield view.informative(CheckKind.MOTOR_PEAK_POWER, figure=peak, at=at, origin=Origin(Basis.PRINTED, f"{printed}; T N qd"))


def full_step_resonance(drive: Drive) -> float | None:
    """Return the full-step resonance [Hz]; None if a figure is missing.

    f = sqrt(p T_hold / (J_rotor + J_gear)) / (2 pi), with p = 50 for a step of 1.8 degrees.

    The rotor oscillates against its magnetic stiffness. The gearbox is much softer, so the load
    does not oscillate with it (our own derivation: 67 kNm/rad at the joint is 2.6 Nm/rad at the
    motor, against 450 Nm/rad).
    """
    motor, gear = drive.motor.rotor_inertia, drive.gearbox.input_inertia
    if drive.motor.holding_torque is None or drive.motor.step is None or motor is None or gear is None:
        return None
    stiffness = 2.0 * np.pi / drive.motor.step / 4.0 * drive.motor.holding_torque
    return float(np.sqrt(stiffness / (motor + gear)) / (2.0 * np.pi))


def _resonance_row(view: JointView, drive: Drive) -> Row:
    frequency, step, kind = full_step_resonance(drive), drive.motor.step, CheckKind.MOTOR_RESONANCE_DWELL
    if frequency is None or step is None:
        why = Origin(Basis.PRINTED, f"{sheet(drive.motor)}; holding torque or an inertia is not printed")
        return view.compared(kind, demand=0.0, limit=None, origin=why)
    speed, resonant = drive.gearbox.ratio * np.abs(view.qd), frequency * step
    longest, at = longest_dwell(view.t, speed, resonant * (1.0 - RESONANCE_BAND), resonant * (1.0 + RESONANCE_BAND))
    origin = Origin(
        Basis.ESTIMATED,
        f"guideline: {RESONANCE_CYCLES:g} periods within +-{RESONANCE_BAND:.0%} of the full-step resonance, "
        f"{frequency:.0f} Hz or {resonant * 30.0 / np.pi:.1f} rpm; microsteps excite it less [own derivation]; "
        f"{sheet(drive.motor)}",
    )
    return view.compared(kind, demand=longest, limit=RESONANCE_CYCLES / frequency, at=at, origin=origin)


def longest_dwell(t: Array, speed: Array, low: float, high: float) -> tuple[float, float | None]:
    """Return the longest uninterrupted time [s] that speed (n,) is between low and high.

    The second number is the time of the sample before it; None if the speed never enters the
    band. The speed is linear between samples.
    """
    if t.size < 2:
        return 0.0, None
    least, most = np.minimum(speed[:-1], speed[1:]), np.maximum(speed[:-1], speed[1:])
    inside, width = np.minimum(most, high) - np.maximum(least, low), most - least
    share = np.where(width > 0.0, np.clip(np.divide(inside, width, out=np.ones_like(width), where=width > 0.0), 0.0, 1.0), 0.0)
    share[(width == 0.0) & (inside >= 0.0)] = 1.0
    spent = share * np.diff(t)
    between = (speed[1:-1] >= low) & (speed[1:-1] <= high)  # a dwell continues if the sample between is inside
    goes_on = np.concatenate([[False], (spent[:-1] > 0.0) & between])
    starts = np.flatnonzero((spent > 0.0) & ~goes_on)
    if not len(starts):
        return 0.0, None
    stretches = np.add.reduceat(spent, starts)
    longest = int(np.argmax(stretches))
    return float(stretches[longest]), float(t[starts[longest]])


def _overload_row(view: JointView, drive: Drive) -> Row:
    """Return the row of the motor's running torque against the gearbox's start-stop torque.

    If the motor can exceed the start-stop torque, the source text names the current limit.
    """
    motor, gear, kind = drive.motor, drive.gearbox, CheckKind.MOTOR_AGAINST_GEARBOX
    if motor.running_torque is None or gear.efficiency is None or gear.start_stop_torque is None:
        why = f"{sheet(motor)}; {gear.source}; running torque, efficiency or start-stop torque is not printed"
        return view.unknown(kind, why=why)
    at_joint = motor.running_torque * gear.ratio * gear.efficiency
    enough = gear.start_stop_torque / (gear.ratio * gear.efficiency)
    mesh = mesh_efficiency(gear)
    if mesh is not None and gear.no_load_input_torque is not None:  # with a better mesh less motor torque is enough
        enough = min(enough, gear.start_stop_torque / (gear.ratio * mesh) + gear.no_load_input_torque)
    said = f"{sheet(motor)}; {gear.source}"
    if enough < motor.running_torque:
        amperes = "" if drive.winding is None else f" ({drive.winding.current * enough / motor.running_torque:.2g} A)"
        said = (
            f"the motor can exceed the start-stop torque: limit its current to {enough / motor.running_torque:.0%}{amperes}, "
            f"{enough:.2f} Nm at the motor, which is safe for both readings of the efficiency; {said}"
        )
    return view.compared(kind, demand=at_joint, limit=gear.start_stop_torque, origin=Origin(Basis.PRINTED, said))


def _least_margin(limit: Array, demand: Array) -> int:
    """Return the sample with the least limit / demand."""
    ratio = np.full(demand.shape, np.inf)
    return int(np.argmin(np.divide(limit, demand, out=ratio, where=demand > 0.0)))


def _curve_origin(drive: Drive, what: str) -> Origin:
    if drive.bus_voltage is None or drive.wiring is None:
        return Origin(Basis.PRINTED, f"{sheet(drive.motor)}; the check needs bus voltage and wiring")
    supply = (
        f"{drive.bus_voltage.value:g} V ({drive.bus_voltage.origin.basis}), {drive.wiring.value} ({drive.wiring.origin.basis})"
    )
    basis = Basis.weakest([Basis.ESTIMATED, *(origin.basis for origin in drive.supply_origins)])
    return Origin(basis, f"{what}, estimated from {sheet(drive.motor)} at {supply}")
