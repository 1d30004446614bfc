"""A motion held against the joint limits and the drives' datasheets, row by row.

Gearbox rows follow Harmonic Drive's selection procedure, applied to the Cone Drive CBG, whose maker's own procedure was not
found. A figure that a datasheet does not give makes its row NOT CHECKABLE, never a pass.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from boom_model import JOINTS, BaseMotion, Basis, Boom, Drive, Loads, Origin, inverse_dynamics, transmission_angle
from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH, LIMIT_TOLERANCE
from boom_model.drives import STEPPER_MARGIN, available_torque, motor_torque, speed_for_torque
from boom_model.dynamics import PayloadAs
from planner.clearance import nearest_approach
from planner.trajectory import Trajectory

SAMPLING_SLACK = 1e-3
"""A demand within 0.1 % of its limit is on it: a motion is seen at samples, and solvers end within a tolerance."""

ESTIMATE_WARNING = 0.25
"""A margin on an estimated or assumed figure that exceeds the required one by less than this is a WARN, not a PASS."""

LOW_SPEED = 2.0 * np.pi
"""Motor speed [rad/s] (60 rpm) up to which a sheet's running torque is taken where the supply is not given; our own choice."""

ANGLE_CHECKS = ("position", "lower - inner", "transmission angle")
"""Checks whose margin is a distance to the bound."""

_PROCEDURE = "Harmonic Drive's procedure, applied to another maker's gearbox"


class Verdict(StrEnum):
    """Of a row; a whole report is PASS, FAIL or INCOMPLETE."""

    PASS = "PASS"
    WARN = "WARN"
    FAIL = "FAIL"
    NOT_CHECKABLE = "NOT CHECKABLE"
    INCOMPLETE = "INCOMPLETE"


@dataclass(frozen=True)
class Row:
    """One demand held against one limit, in SI."""

    joint: str
    check: str
    demand: float | None
    limit: float | None
    unit: str
    margin: float | None
    """(limit - demand) / demand; the distance to the bound, in `unit`, for positions. None where there is no limit, or
    nothing is asked."""
    required_margin: float
    at_s: float | None
    verdict: Verdict
    basis: Basis | None
    """The weakest of the figures that decide the row; None where nothing decides it."""
    source: str


def check_rows(
    boom: Boom,
    trajectory: Trajectory,
    loads: Loads,
    *,
    base: BaseMotion | None = None,
    payload_as: PayloadAs = "mass",
    shock: "Shock | None" = None,
    bases: tuple[Basis, ...] = (),
) -> tuple[Row, ...]:
    """Every check of a motion: positions, speeds, accelerations and jerk, then each joint's drive, then the mount.

    Args:
        loads: the motion's own, from `inverse_dynamics`, with its reactions.
        base: how the vehicle moves the base; the static torques take its tilt.
        payload_as: how the loads took the payload; the static torques take it alike.
        shock: the vehicle's, which a gearbox may meet up to its momentary peak torque; None without one.
        bases: how far the data behind the torques themselves can be trusted, the vehicle's for example.
    """
    still = np.zeros_like(trajectory.q)
    tilt = None if base is None else BaseMotion.of(up=base.up)
    static = inverse_dynamics(boom, trajectory.q, still, still, base=tilt, payload_as=payload_as, reactions=False).tau
    rows: list[Row] = []
    for i in range(5):
        rows += _position_rows(boom, trajectory, i)
        rows += _rate_rows(boom, trajectory, i)
    for i, drive in enumerate(boom.drives):
        friction, origin = boom.friction, boom.friction.origins[i]
        view = _JointView(
            joint=JOINTS[i],
            is_length=IS_LENGTH[i],
            trajectory=trajectory,
            tau=loads.tau[:, i],
            calm=loads.tau[:, i] if shock is None else shock.calm[:, i],
            friction=friction.viscous[i] * trajectory.qd[:, i] + friction.coulomb[i] * np.sign(trajectory.qd[:, i]),
            static=static[:, i],
            index=i,
            basis=Basis.weakest([*bases, *([] if origin is None else [origin.basis])]),
            steady=base is None or base.up.ndim == 1 or bool(np.ptp(base.up, axis=0).max() == 0.0),
        )
        rows += _undriven_rows(view) if drive is None else _driven_rows(view, drive, shock)
    rows += _mount_rows(boom, trajectory.t, loads)
    rows += _clearance_rows(boom, trajectory)
    return tuple(rows)


def overall(rows: tuple[Row, ...]) -> Verdict:
    """FAIL where a row fails, INCOMPLETE where one could not be checked, PASS otherwise (a WARN passes)."""
    verdicts = {row.verdict for row in rows}
    if Verdict.FAIL in verdicts:
        return Verdict.FAIL
    return Verdict.INCOMPLETE if Verdict.NOT_CHECKABLE in verdicts else Verdict.PASS


@dataclass(frozen=True, eq=False)
class Shock:
    """A shock of the vehicle during a motion."""

    calm: Array
    """(n, 5) the joint torques without it."""
    resolved: bool
    """Whether it lies inside the motion, with enough samples to see its peak."""


@dataclass(frozen=True, eq=False)
class _JointView:
    """One joint of a motion."""

    joint: str
    is_length: bool
    trajectory: Trajectory
    tau: Array
    calm: Array
    """tau without the vehicle's shock"""
    friction: Array
    """what friction has in tau"""
    static: Array
    index: int
    basis: Basis
    """of the torques themselves"""
    steady: bool
    """whether the base rests or is tilted at most, so that the motion can be run backwards"""

    def held(
        self,
        check: str,
        demand: float,
        limit: float | None,
        unit: str,
        at: float | None,
        origin: Origin,
        required: float = 0.0,
        warn_near: bool = False,
    ) -> Row:
        """`_held` for a torque: no better founded than the torque itself."""
        origin = Origin(Basis.weakest([origin.basis, self.basis]), origin.source)
        return _held(self.joint, check, demand, limit, unit, at, origin, required, warn_near)

    @property
    def qd(self) -> Array:
        return self.trajectory.qd[:, self.index]

    @property
    def qdd(self) -> Array:
        return self.trajectory.qdd[:, self.index]


def _held(
    joint: str,
    check: str,
    demand: float,
    limit: float | None,
    unit: str,
    at: float | None,
    origin: Origin,
    required: float = 0.0,
    warn_near: bool = False,
) -> Row:
    """A demand against a limit that it may not exceed; without a limit, NOT CHECKABLE."""
    if limit is None:
        return Row(joint, check, demand, None, unit, None, required, at, Verdict.NOT_CHECKABLE, None, origin.source)
    margin = (limit - demand) / demand if demand > 0.0 else None
    if margin is None or margin >= required + (ESTIMATE_WARNING if warn_near else 0.0):
        verdict = Verdict.PASS
    elif not margin >= required - SAMPLING_SLACK:
        verdict = Verdict.FAIL
    else:
        verdict = Verdict.WARN if warn_near else Verdict.PASS
    return Row(joint, check, demand, limit, unit, margin, required, at, verdict, origin.basis, origin.source)


def _position_rows(boom: Boom, trajectory: Trajectory, i: int) -> Iterator[Row]:
    limits, unit = boom.limits, "m" if IS_LENGTH[i] else "rad"
    q = trajectory.q[:, i]
    excess = np.maximum(limits.lower[i] - q, q - limits.upper[i])
    at = int(np.argmax(excess))
    nearest = limits.lower[i] if abs(q[at] - limits.lower[i]) <= abs(q[at] - limits.upper[i]) else limits.upper[i]
    yield _room(JOINTS[i], "position", q[at], nearest, -excess[at], unit, trajectory.t[at], limits.origins["position"][i])
    if JOINTS[i] == "lower":
        gap = trajectory.q[:, 2] - trajectory.q[:, 1]
        at = int(np.argmin(gap))
        room = gap[at] - limits.linkage
        yield _room(
            "lower",
            "lower - inner",
            gap[at],
            limits.linkage,
            room,
            unit,
            trajectory.t[at],
            limits.origins["linkage"][0],
        )
        angle = transmission_angle(trajectory.q)
        at, origin = int(np.argmin(angle)), limits.origins["transmission"][0]
        room = float(angle[at] - limits.transmission)
        facts = (float(angle[at]), limits.transmission, unit, room, 0.0, float(trajectory.t[at]))
        verdict = Verdict.PASS if room >= 0.0 else Verdict.WARN  # near the flat parallelogram the pins' forces grow
        yield Row("lower", "transmission angle", *facts, verdict, origin.basis, origin.source)


def _room(joint: str, check: str, demand: float, limit: float, room: float, unit: str, at: float, origin: Origin) -> Row:
    verdict = Verdict.PASS if room >= -LIMIT_TOLERANCE else Verdict.FAIL
    room = 0.0 if abs(room) <= LIMIT_TOLERANCE else float(room)
    return Row(joint, check, float(demand), float(limit), unit, room, 0.0, float(at), verdict, origin.basis, origin.source)


def _clearance_rows(boom: Boom, trajectory: Trajectory) -> Iterator[Row]:
    """The arm's nearest approach to what it must keep away from, as the mount carries it."""
    keep = boom.keep_out
    if keep is None:
        return
    at, found = nearest_approach(boom, trajectory.q)
    origins = [keep.origin, *(shape.origin for shape in keep.shapes if shape.name == found.shape)]
    origin = Origin(Basis.weakest([each.basis for each in origins]), "; ".join(each.source for each in origins))
    check, room = f"clearance of {found.link} to {found.shape}", found.distance - keep.clearance
    yield _room("arm", check, found.distance, keep.clearance, room, "m", float(trajectory.t[at]), origin)


def _rate_rows(boom: Boom, trajectory: Trajectory, i: int) -> Iterator[Row]:
    base = "m" if IS_LENGTH[i] else "rad"
    for power, (name, values) in enumerate(
        (("velocity", trajectory.qd), ("acceleration", trajectory.qdd), ("jerk", trajectory.qddd)), start=1
    ):
        if values is None:
            continue
        at = int(np.argmax(np.abs(values[:, i])))
        unit = f"{base}/s" if power == 1 else f"{base}/s^{power}"
        limit = float(getattr(boom.limits, name)[i])
        yield _held(
            JOINTS[i],
            name,
            float(abs(values[at, i])),
            limit,
            unit,
            float(trajectory.t[at]),
            boom.limits.origins[name][i],
        )


def _undriven_rows(view: _JointView) -> Iterator[Row]:
    """What a joint asks of a drive that is not given."""
    t, torque, rate = view.trajectory.t, *(("N", "m/s") if view.is_length else ("Nm", "rad/s"))
    origin = Origin(Basis.PRINTED, "NOT CHECKED: no drive data")
    force = "force" if view.is_length else "torque"
    for check, values, unit in (
        (f"drive peak {force}", view.tau, torque),
        ("drive top speed", view.qd, rate),
        ("drive peak power", view.tau * view.qd, "W"),
        ("drive worst hold", view.static, torque),
    ):
        at = int(np.argmax(np.abs(values)))
        yield view.held(check, float(abs(values[at])), None, unit, float(t[at]), origin)
    rms = _time_mean(t, view.tau**2) ** 0.5
    yield view.held(f"drive RMS {force}", rms, None, torque, None, origin)


def _driven_rows(view: _JointView, drive: Drive, shock: Shock | None) -> Iterator[Row]:
    yield from _gearbox_rows(view, drive, shock)
    yield from _motor_rows(view, drive)
    yield _power_off_row(view, drive)


def _gearbox_rows(view: _JointView, drive: Drive, shock: Shock | None) -> Iterator[Row]:
    gear, t = drive.gearbox, view.trajectory.t
    printed = Origin(Basis.PRINTED, f"{gear.source}; {_PROCEDURE}")
    if shock is not None:
        at = int(np.argmax(np.abs(view.tau)))
        unseen = Origin(Basis.PRINTED, "the shock is not inside the motion, or has too few samples to see its peak")
        limit, origin = (gear.peak_torque, printed) if shock.resolved else (None, unseen)
        yield view.held("gearbox momentary peak", float(abs(view.tau[at])), limit, "Nm", float(t[at]), origin)
    at = int(np.argmax(np.abs(view.calm)))
    yield view.held("gearbox repeated peak", float(abs(view.calm[at])), gear.start_stop_torque, "Nm", float(t[at]), printed)
    average = average_torque(t, view.calm, view.qd)
    if average is not None:
        yield view.held("gearbox average", average, gear.max_average_torque, "Nm", None, printed)
    at = int(np.argmax(np.abs(view.static)))
    derived = Origin(
        Basis.PRINTED, f"{gear.source}; held for ever at the worst pose, against the average rating [own derivation]"
    )
    yield view.held("gearbox hold", float(abs(view.static[at])), gear.max_average_torque, "Nm", float(t[at]), derived)
    at = int(np.argmax(np.abs(view.qd)))
    speed = float(gear.ratio * abs(view.qd[at]))
    missing = "" if gear.max_input_speed else "; no input speed is printed"
    limit = gear.max_input_speed
    yield view.held(
        "gearbox input speed",
        speed,
        limit,
        "rad/s",
        float(t[at]),
        Origin(Basis.PRINTED, gear.source + missing),
    )


def _power_off_row(view: _JointView, drive: Drive) -> Row:
    """Backdriving starts somewhere about the printed torque, which is no holding margin: only a brake holds."""
    at = int(np.argmax(np.abs(view.static)))
    demand, limit = float(abs(view.static[at])), drive.gearbox.backdrive_torque
    facts = (view.joint, "power-off hold", demand, limit, "Nm", None, 0.0, float(view.trajectory.t[at]))
    brake, sheet = drive.brake, drive.gearbox.source
    if brake is not None and brake.value:
        verdict = Verdict.WARN if brake.origin.basis is not Basis.PRINTED else Verdict.PASS
        return Row(
            *facts, verdict, brake.origin.basis, f"held by a brake: {brake.origin.source}; backdriven otherwise, {sheet}"
        )
    return Row(*facts, Verdict.FAIL, Basis.PRINTED, f"no brake is declared, and the gearbox is backdriven: {sheet}")


def _mount_rows(boom: Boom, t: Array, loads: Loads) -> Iterator[Row]:
    if loads.mount is None:
        return
    parts = (("force", "N", loads.mount[:, :3], boom.mount.force), ("moment", "Nm", loads.mount[:, 3:], boom.mount.moment))
    for name, unit, vectors, bearable in parts:
        size = np.linalg.norm(vectors, axis=-1)
        at = int(np.argmax(size))
        origin = Origin(Basis.PRINTED, "no limit of the vehicle's mount is given") if bearable is None else bearable.origin
        limit = None if bearable is None else bearable.value
        yield _held("mount", f"peak {name}", float(size[at]), limit, unit, float(t[at]), origin)


def _motor_rows(view: _JointView, drive: Drive) -> Iterator[Row]:
    motor, gear, t = drive.motor, drive.gearbox, view.trajectory.t
    at = int(np.argmax(np.abs(view.static)))
    yield view.held(
        "motor hold",
        float(abs(view.static[at]) / gear.ratio),
        motor.holding_torque,
        "Nm",
        float(t[at]),
        Origin(Basis.PRINTED, f"{motor.source}; no credit for friction [own derivation]"),
        STEPPER_MARGIN,
    )
    demands = []
    directions = [("motor torque", view.tau, view.qd)]
    if view.steady:  # backwards, friction turns round and the rest stays
        directions.append(("motor torque, reversed", view.tau - 2.0 * view.friction, -view.qd))
    for check, tau, qd in directions:
        torque = motor_torque(drive, tau, qd, view.qdd)
        if torque is None:
            why = f"{motor.source}; {gear.source}; efficiency, no-load torque or an inertia is not printed"
            yield Row(view.joint, check, None, None, "Nm", None, STEPPER_MARGIN, None, Verdict.NOT_CHECKABLE, None, why)
            return
        demands.append(np.abs(torque))
        yield _motor_torque_row(view, drive, check, demands[-1])
    yield _motor_speed_row(view, drive, np.max(demands, axis=0))


def _motor_speed_row(view: _JointView, drive: Drive, torque: Array) -> Row:
    """The sample whose speed comes nearest to the one at which the curve gives its torque with the margin."""
    speed = drive.gearbox.ratio * np.abs(view.qd)
    highest = speed_for_torque(drive, (1.0 + STEPPER_MARGIN) * torque)
    origin = _curve_origin(drive, "speed at which the curve gives the torque of that time with its margin [own derivation]")
    if highest is None:
        at = int(np.argmax(speed))
        limit = None
    else:
        room = np.full_like(speed, np.inf)
        at = int(np.argmin(np.divide(highest, speed, out=room, where=speed > 0.0)))
        limit = float(highest[at]) if np.isfinite(highest[at]) else None
    return view.held("motor speed", float(speed[at]), limit, "rad/s", float(view.trajectory.t[at]), origin, warn_near=True)


def _motor_torque_row(view: _JointView, drive: Drive, check: str, torque: Array) -> Row:
    """The sample with the least margin against the torque-speed curve, or against the running torque where turning slowly."""
    motor, t = drive.motor, view.trajectory.t
    speed = drive.gearbox.ratio * np.abs(view.qd)
    running = motor.running_torque
    curve = available_torque(drive, speed)
    slow = Origin(Basis.PRINTED, f"{motor.source}, running torque")
    if running is None or (curve is None and (speed > LOW_SPEED).any()):
        at = int(np.argmax(torque))
        short = running is not None and torque[at] * (1.0 + STEPPER_MARGIN - SAMPLING_SLACK) > running
        if short:  # no supply makes a motor stronger than its running torque
            return view.held(check, float(torque[at]), running, "Nm", float(t[at]), slow, STEPPER_MARGIN)
        unknown = Origin(Basis.PRINTED, f"{motor.source}; above low speed only with bus voltage and wiring")
        return view.held(check, float(torque[at]), None, "Nm", float(t[at]), unknown, STEPPER_MARGIN)
    available = np.full_like(torque, running) if curve is None else curve
    with np.errstate(divide="ignore"):
        at = int(np.argmin(available / torque))
    on_curve = available[at] < running * (1.0 - SAMPLING_SLACK)
    origin = _curve_origin(drive, "torque-speed curve") if on_curve else slow
    other = max(float(torque[at]) - (drive.gearbox.no_load_input_torque or 0.0), 0.0)
    origin = Origin(origin.basis, f"{origin.source}; {other:.3f} Nm if the sheet's efficiency holds the no-load torque already")
    return view.held(check, float(torque[at]), float(available[at]), "Nm", float(t[at]), origin, STEPPER_MARGIN, on_curve)


def _curve_origin(drive: Drive, what: str) -> Origin:
    if drive.bus_voltage is None or drive.wiring is None:
        return Origin(Basis.PRINTED, f"{drive.motor.source}; needs bus voltage and wiring")
    supply = (
        f"{drive.bus_voltage.value:g} V ({drive.bus_voltage.origin.basis}), {drive.wiring.value} ({drive.wiring.origin.basis})"
    )
    basis = Basis.weakest([Basis.ESTIMATED, *(origin.basis for origin in drive.supply_origins)])
    return Origin(basis, f"{what}, estimated from {drive.motor.source} at {supply}")


def average_torque(t: Array, tau: Array, qd: Array) -> float | None:
    """Cube mean of the torque weighted by speed, (int |qd| |tau|^3 dt / int |qd| dt)^(1/3) [Nm]; None for a joint that rests.

    Harmonic Drive's average torque. Its weight loses what is only held: see the hold row.
    """
    speed = np.abs(qd)
    travel = float(np.trapezoid(speed, t))
    if travel <= 0.0:
        return None
    return float((np.trapezoid(speed * np.abs(tau) ** 3, t) / travel) ** (1.0 / 3.0))


def _time_mean(t: Array, values: Array) -> float:
    span = float(t[-1] - t[0])
    return float(np.trapezoid(values, t)) / span if span > 0.0 else float(values.mean())
