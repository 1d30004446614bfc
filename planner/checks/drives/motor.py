"""A hybrid stepper on its gearbox against its datasheet."""

from collections.abc import Iterator

import numpy as np

from boom_model import Basis, Drive, Motor, Origin, mesh_efficiency
from boom_model.arrays import Array
from boom_model.drives.drive import STEPPER_MARGIN, available_torque, motor_torque, speed_for_torque
from planner.checks.drives.joint_view import JointView
from planner.checks.kinds import CheckKind
from planner.checks.rows import SAMPLING_SLACK, Row, Verdict

LOW_SPEED = 2.0 * np.pi
"""Motor speed [rad/s] (60 rpm) up to which a sheet's running torque is taken where the supply is not given; our own choice."""

INERTIA_RATIO = 10.0
"""Guide for the reflected load inertia over the rotor's."""

RESONANCE_BAND = 0.2
"""Share about the full-step resonance within which a motor dwells in it; our own choice."""

RESONANCE_CYCLES = 10.0
"""Periods of the resonance that a motor may take to cross the band before it is warned of; our own choice."""


def motor_rows(view: JointView, drive: Drive) -> Iterator[Row]:
    """Every motor row of a joint: hold, torque both ways and at no speed, speed, inertia, resonance, RMS, gearbox overload."""
    motor, gear = drive.motor, drive.gearbox
    hold, at = view.peak(view.static)
    origin = Origin(Basis.PRINTED, f"{_sheet(motor)}; no credit for friction [own derivation]")
    yield view.compared(CheckKind.MOTOR_HOLD, demand=hold / gear.ratio, limit=motor.holding_torque, at=at, origin=origin)
    yield from _torque_rows(view, drive)
    yield _inertia_row(view, drive)
    yield _resonance_row(view, drive)
    yield _overload_row(view, drive)


def _torque_rows(view: JointView, drive: Drive) -> Iterator[Row]:
    directions = [(CheckKind.MOTOR_TORQUE, view.tau, view.qd)]
    if view.steady:  # backwards, friction turns round and the rest stays
        directions.append((CheckKind.MOTOR_TORQUE_REVERSED, view.tau - 2.0 * view.friction, -view.qd))
    demands, other = [], []
    for kind, tau, qd in directions:
        torque = motor_torque(drive, tau, qd, view.qdd)
        if torque is None:
            yield from _unknown_torque_rows(view, drive, [kind for kind, *_ in directions])
            return
        demands.append(np.abs(torque))
        less = motor_torque(drive, tau, qd, view.qdd, no_load_in_efficiency=True)
        other += [] if less is None else [np.abs(less)]
        yield _motor_torque_row(view, drive, kind, demands[-1])
    yield _quasi_static_row(view, drive)
    if other:
        yield _other_reading_row(view, drive, np.max(other, axis=0))
    yield _motor_speed_row(view, drive, np.max(demands, axis=0))
    braked = drive.brake is not None and drive.brake.value  # without one the motor holds in a pause too
    driven = np.where(view.duty.powered, demands[0], 0.0) if braked else demands[0]
    known = Origin(Basis.PRINTED, f"{_sheet(drive.motor)}; a stepper's heat goes with its current, not with its torque")
    yield view.informative(CheckKind.MOTOR_RMS_TORQUE, figure=view.duty.mean(driven**2) ** 0.5, origin=known)


def _unknown_torque_rows(view: JointView, drive: Drive, directions: list[CheckKind]) -> Iterator[Row]:
    """What cannot be said of a motor whose torque is not known; how fast it turns is."""
    for kind in directions:
        yield view.unknown(kind, why=_unknown_torque(drive))
    yield _quasi_static_row(view, drive)
    unknown = Origin(Basis.PRINTED, _unknown_torque(drive))
    yield view.informative(CheckKind.MOTOR_TORQUE_OTHER_READING, figure=None, origin=unknown)
    fastest, at = view.peak(view.qd)
    yield view.compared(CheckKind.MOTOR_SPEED, demand=drive.gearbox.ratio * fastest, limit=None, at=at, origin=unknown)
    yield view.informative(CheckKind.MOTOR_RMS_TORQUE, figure=None, origin=unknown)


def _unknown_torque(drive: Drive) -> str:
    return f"{_sheet(drive.motor)}; {drive.gearbox.source}; efficiency, no-load torque or an inertia is not printed"


def _motor_torque_row(view: JointView, drive: Drive, kind: CheckKind, torque: Array) -> Row:
    """The sample with the least margin against the torque-speed curve, or against the running torque where turning slowly."""
    motor = drive.motor
    speed = drive.gearbox.ratio * np.abs(view.qd)
    running = motor.running_torque
    curve = available_torque(drive, speed)
    slow = Origin(Basis.PRINTED, f"{_sheet(motor)}, running torque")
    if running is None or (curve is None and (speed > LOW_SPEED).any()):
        most, at = view.peak(torque)
        if running is not None and most * (1.0 + STEPPER_MARGIN - SAMPLING_SLACK) > running:
            # no supply makes a motor stronger than its running torque
            return view.compared(kind, demand=most, limit=running, at=at, origin=slow)
        unknown = Origin(Basis.PRINTED, f"{_sheet(motor)}; above low speed only with bus voltage and wiring")
        return view.compared(kind, demand=most, limit=None, at=at, origin=unknown)
    available = np.full_like(torque, running) if curve is None else curve
    on_curve = available < running * (1.0 - SAMPLING_SLACK)
    rows = []
    for part, origin, estimated in ((~on_curve, slow, False), (on_curve, _curve_origin(drive, "torque-speed curve"), True)):
        if part.any():
            at = int(np.flatnonzero(part)[_least_room(available[part], torque[part])])
            demand, limit, when = float(torque[at]), float(available[at]), float(view.t[at])
            rows.append(view.compared(kind, demand=demand, limit=limit, at=when, origin=origin, warn_near=estimated))
    return max(rows, key=_severity)


def _severity(row: Row) -> tuple[int, float]:
    """The worse verdict first, then the lesser margin: an estimate's warning is not hidden by a sample off the curve."""
    return (Verdict.PASS, Verdict.WARN, Verdict.FAIL).index(row.verdict), -np.inf if row.margin is None else -row.margin


def _quasi_static_row(view: JointView, drive: Drive) -> Row:
    """The limit of moving ever more slowly, either way, through the poses: lifting the worst of them at no speed."""
    load, at = view.peak(np.abs(view.static) + view.coulomb)
    torque, kind = motor_torque(drive, load, 1.0, 0.0), CheckKind.MOTOR_TORQUE_QUASI_STATIC
    if torque is None:
        return view.unknown(kind, why=_unknown_torque(drive))
    running, curve = drive.motor.running_torque, available_torque(drive, 0.0)
    limit = running if curve is None else float(curve)
    weak = running is not None and limit is not None and limit < running * (1.0 - SAMPLING_SLACK)
    slow = Origin(Basis.PRINTED, f"{_sheet(drive.motor)}, running torque; the slowest motion through the poses")
    origin = _curve_origin(drive, "torque at no speed") if weak else slow
    return view.compared(kind, demand=float(torque), limit=limit, at=at, origin=origin, warn_near=weak)


def _other_reading_row(view: JointView, drive: Drive, torque: Array) -> Row:
    """What the sheet's efficiency asks if it already contains the no-load torque: either way, the least room."""
    efficiency = mesh_efficiency(drive.gearbox)
    available = available_torque(drive, drive.gearbox.ratio * np.abs(view.qd))
    at = int(np.argmax(torque)) if available is None else _least_room(available, torque)
    origin = Origin(
        Basis.ESTIMATED,
        f"if the printed efficiency holds the no-load torque already: the mesh's is {efficiency:.3f}; {drive.gearbox.source}; "
        f"{_sheet(drive.motor)}",
    )
    limit = None if available is None else float(available[at])
    figure, when = float(torque[at]), float(view.t[at])
    return view.informative(CheckKind.MOTOR_TORQUE_OTHER_READING, figure=figure, at=when, origin=origin, limit=limit)


def _motor_speed_row(view: JointView, drive: Drive, torque: Array) -> Row:
    """The sample whose speed comes nearest to the one at which the curve gives its torque with the margin."""
    speed = drive.gearbox.ratio * np.abs(view.qd)
    highest = speed_for_torque(drive, (1.0 + STEPPER_MARGIN) * torque)
    origin = _curve_origin(drive, "speed at which the curve gives the torque of that time with its margin [own derivation]")
    if highest is None:
        at = int(np.argmax(speed))
        limit = None
    else:
        at = _least_room(highest, speed)
        limit = float(highest[at]) if np.isfinite(highest[at]) else None
    demand, when = float(speed[at]), float(view.t[at])
    return view.compared(CheckKind.MOTOR_SPEED, demand=demand, limit=limit, at=when, origin=origin, warn_near=True)


def _inertia_row(view: JointView, drive: Drive) -> Row:
    rotor, load = drive.motor.rotor_inertia, float(view.inertia.max())
    ratio = 0.0 if rotor is None else load / drive.gearbox.ratio**2 / rotor
    guide = f"load {load:.4g} kg m^2 over N^2, against the rotor's alone; a guide; {_sheet(drive.motor)}"
    limit = None if rotor is None else INERTIA_RATIO
    return view.compared(CheckKind.MOTOR_INERTIA_RATIO, demand=ratio, limit=limit, origin=Origin(Basis.PRINTED, guide))


def full_step_resonance(drive: Drive) -> float | None:
    """f = sqrt(p T_hold / (J_rotor + J_gear)) / (2 pi) [Hz], p = 50 pole pairs of a 1.8 degree step; None without a figure.

    The rotor swings against its magnetic stiffness; the gearbox is soft beside it, so that the load does not swing with it
    (our own derivation: 67 kNm/rad at the joint is 2.6 Nm/rad at the motor, against 450).
    """
    motor, gear = drive.motor.rotor_inertia, drive.gearbox.input_inertia
    if drive.motor.holding_torque is None or motor is None or gear is None:
        return None
    stiffness = 2.0 * np.pi / drive.motor.step / 4.0 * drive.motor.holding_torque
    return float(np.sqrt(stiffness / (motor + gear)) / (2.0 * np.pi))


def _resonance_row(view: JointView, drive: Drive) -> Row:
    frequency, kind = full_step_resonance(drive), CheckKind.MOTOR_RESONANCE_DWELL
    if frequency is None:
        why = Origin(Basis.PRINTED, f"{_sheet(drive.motor)}; holding torque or an inertia is not printed")
        return view.compared(kind, demand=0.0, limit=None, origin=why)
    speed, resonant = drive.gearbox.ratio * np.abs(view.qd), frequency * drive.motor.step
    longest, at = longest_dwell(view.t, speed, resonant * (1.0 - RESONANCE_BAND), resonant * (1.0 + RESONANCE_BAND))
    origin = Origin(
        Basis.ESTIMATED,
        f"full-step resonance {frequency:.0f} Hz, {resonant * 30.0 / np.pi:.1f} rpm +-{RESONANCE_BAND:.0%}, for "
        f"{RESONANCE_CYCLES:g} periods; microsteps excite it less [own derivation]; {_sheet(drive.motor)}",
    )
    return view.compared(kind, demand=longest, limit=RESONANCE_CYCLES / frequency, at=at, origin=origin)


def longest_dwell(t: Array, speed: Array, low: float, high: float) -> tuple[float, float | None]:
    """Longest time without a break that speed (n,) is between low and high, and the sample before it; linear between."""
    if t.size < 2:
        return 0.0, None
    least, most = np.minimum(speed[:-1], speed[1:]), np.maximum(speed[:-1], speed[1:])
    inside, width = np.minimum(most, high) - np.maximum(least, low), most - least
    share = np.where(width > 0.0, np.clip(np.divide(inside, width, out=np.ones_like(width), where=width > 0.0), 0.0, 1.0), 0.0)
    share[(width == 0.0) & (inside >= 0.0)] = 1.0
    spent = share * np.diff(t)
    between = (speed[1:-1] >= low) & (speed[1:-1] <= high)  # a stretch goes on where the sample between is inside
    goes_on = np.concatenate([[False], (spent[:-1] > 0.0) & between])
    starts = np.flatnonzero((spent > 0.0) & ~goes_on)
    if not len(starts):
        return 0.0, None
    stretches = np.add.reduceat(spent, starts)
    longest = int(np.argmax(stretches))
    return float(stretches[longest]), float(t[starts[longest]])


def _overload_row(view: JointView, drive: Drive) -> Row:
    """Whether the motor, at its running torque, passes what its gearbox may bear: then its current wants a limit."""
    motor, gear, kind = drive.motor, drive.gearbox, CheckKind.MOTOR_AGAINST_GEARBOX
    if motor.running_torque is None or gear.efficiency is None or gear.start_stop_torque is None:
        why = f"{_sheet(motor)}; {gear.source}; running torque, efficiency or start-stop torque is not printed"
        return view.unknown(kind, why=why)
    at_joint = motor.running_torque * gear.ratio * gear.efficiency
    enough = gear.start_stop_torque / (gear.ratio * gear.efficiency)
    mesh = mesh_efficiency(gear)
    if mesh is not None and gear.no_load_input_torque is not None:  # a better mesh breaks it sooner
        enough = min(enough, gear.start_stop_torque / (gear.ratio * mesh) + gear.no_load_input_torque)
    said = f"{_sheet(motor)}; {gear.source}"
    if enough < motor.running_torque:
        amperes = "" if drive.winding is None else f" ({drive.winding.current * enough / motor.running_torque:.2g} A)"
        said = (
            f"the motor can pass the start-stop torque: hold its current to {enough / motor.running_torque:.0%}{amperes}, "
            f"{enough:.2f} Nm at the motor, if either reading of the efficiency may hold; {said}"
        )
    return view.compared(kind, demand=at_joint, limit=gear.start_stop_torque, origin=Origin(Basis.PRINTED, said))


def _least_room(limit: Array, demand: Array) -> int:
    """The sample with the least limit / demand."""
    room = np.full(demand.shape, np.inf)
    return int(np.argmin(np.divide(limit, demand, out=room, where=demand > 0.0)))


def _sheet(motor: Motor) -> str:
    """The motor's source, and by how much a motor may differ from it."""
    return motor.source if motor.tolerance is None else f"{motor.source} (sheet values +-{motor.tolerance:.0%})"


def _curve_origin(drive: Drive, what: str) -> Origin:
    if drive.bus_voltage is None or drive.wiring is None:
        return Origin(Basis.PRINTED, f"{_sheet(drive.motor)}; needs bus voltage and wiring")
    supply = (
        f"{drive.bus_voltage.value:g} V ({drive.bus_voltage.origin.basis}), {drive.wiring.value} ({drive.wiring.origin.basis})"
    )
    basis = Basis.weakest([Basis.ESTIMATED, *(origin.basis for origin in drive.supply_origins)])
    return Origin(basis, f"{what}, estimated from {_sheet(drive.motor)} at {supply}")
