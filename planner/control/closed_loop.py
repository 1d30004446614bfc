"""Closed-loop simulation of planned moves on the full nonlinear plant, many cases in one batch."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from boom_model import JOINTS, BaseMotion, Boom, InputError, gravity_torque, inverse_dynamics, up_on_slope
from boom_model.arrays import Array, checked
from boom_model.dynamics.equations_of_motion import mass_matrix_and_bias
from planner.control.design import Controller, Gains, Goals, design
from planner.control.plant import (
    Plant,
    accelerations,
    equilibrium,
    friction,
    quick_index,
    spring_torque,
    torque_limits,
    twist_under,
)
from planner.control.shaping import Impulses
from planner.motion.vehicle import VehicleCase, base_motion
from planner.planning import Move
from planner.progress import Track
from planner.timing.time_law import Motion

DIVERGED = 1.0
"""Position error [rad, m at the extension] above which a case counts as diverged and is stopped."""

MAX_STATE = 1e6
"""Bound on coordinates and rates [SI]. It keeps a diverging case finite until it is stopped."""

LONGEST_STEP = 1e-3
"""Longest default step of the integrator [s].

It is an eighth of the period of a stepper's rotor about its command.
"""

_BASE = ("velocity", "angular_velocity", "acceleration", "angular_acceleration", "up")


@dataclass(frozen=True, eq=False)
class Command:
    """Reference of a controller: a planned move, filtered by an input shaper."""

    motions: tuple[Motion, ...]
    impulses: Impulses
    at_rest: Array
    """(5,) joint position of an empty move."""

    @staticmethod
    def of(move: Move, impulses: Impulses) -> "Command":
        """Return the command of a move with an input shaper."""
        return Command(move.motions, impulses, move.trajectory.q[-1])

    @cached_property
    def duration(self) -> float:
        """Duration [s], including the shaper's delay."""
        return sum(motion.duration for motion in self.motions) + float(self.impulses.times[-1])

    def __call__(self, t: Array) -> tuple[Array, Array, Array]:
        """Return q, qd, qdd (n, 5) at times t (n,); at rest before 0 and after the end."""
        parts = [self._unshaped(t - late) for late in self.impulses.times]
        q, qd, qdd = (np.tensordot(self.impulses.amplitudes, np.stack(part), 1) for part in zip(*parts, strict=True))
        return q, qd, qdd

    def _unshaped(self, t: Array) -> tuple[Array, Array, Array]:
        if not self.motions:
            still = np.zeros((t.size, 5))
            return still + self.at_rest, still, still
        ends = np.cumsum([motion.duration for motion in self.motions])
        piece = np.minimum(np.searchsorted(ends, t, side="right"), len(ends) - 1)
        q, qd, qdd = (np.empty((t.size, 5)) for _ in range(3))
        for i, motion in enumerate(self.motions):
            chosen = piece == i
            q[chosen], qd[chosen], qdd[chosen], _ = motion(t[chosen] - (ends[i] - motion.duration))
        outside = (t < 0.0) | (t >= ends[-1])
        qd[outside], qdd[outside] = 0.0, 0.0
        return q, qd, qdd


@dataclass(frozen=True)
class Gust:
    """Gust on the tip, force (1 - cos(2 pi (t - start) / duration)) / 2 in frame 1."""

    force: tuple[float, float, float]
    """Largest force [N]."""
    start: float
    """Start [s]."""
    duration: float
    """Duration [s]."""

    def __call__(self, t: Array) -> Array:
        """Return the force (n, 3) [N] at times t (n,)."""
        phase = np.clip((t - self.start) / self.duration, 0.0, 1.0)
        pushes: Array = 0.5 * (1.0 - np.cos(2.0 * np.pi * phase))[:, None] * np.array(self.force)
        return pushes


def parse_gust(text: str) -> Gust:
    """Return the gust that FX,FY,FZ,START,DURATION describes, in N and s.

    Raises:
        InputError: the text is not five finite numbers, or the duration is not above 0.
    """
    try:
        values = checked("gust", [float(part) for part in text.split(",")], 5)
    except (ValueError, InputError):
        raise InputError(f"gust {text!r} is not FX,FY,FZ,START,DURATION, five finite numbers in N and s") from None
    x, y, z, start, duration = map(float, values)
    if not duration > 0.0:
        raise InputError(f"duration of the gust is {duration:g} s; it must be above 0 s")
    return Gust((x, y, z), start, duration)


@dataclass(frozen=True, eq=False)
class Case:
    """One controller that follows one command."""

    command: Command
    gains: tuple[Gains, ...]
    """Gains designed at evenly spaced times of the command; a single design holds throughout."""

    @staticmethod
    def of(plant: Plant, controller: Controller, goals: Goals, command: Command, knots: int = 17) -> "Case":
        """Return a case whose controller is designed at the end of the command.

        lqr is designed at `knots` poses along the command, because its gains contain the coupling
        between joints at one pose.
        """
        t = np.linspace(0.0, command.duration, knots) if controller is Controller.LQR else np.array([command.duration])
        return Case(command, tuple(design(plant, controller, goals, q) for q in command(t)[0]))

    @property
    def controller(self) -> Controller:
        """Kind of controller."""
        return self.gains[0].controller

    def place(self, t: ArrayLike) -> tuple[NDArray[np.intp], Array]:
        """Return the index of the design before times t (...), and the way to the next (0 to 1)."""
        last = len(self.gains) - 1
        along = np.clip(np.asarray(t) / max(self.command.duration, 1e-9), 0.0, 1.0) * last
        before = np.minimum(along.astype(np.intp), max(last - 1, 0))
        return before, along - before

    def gains_at(self, t: float) -> Gains:
        """Return the gains at time t [s], linearly interpolated between designs."""
        before, share = self.place(t)
        low, high = self.gains[before], self.gains[min(int(before) + 1, len(self.gains) - 1)]
        if low is high or share == 0.0:
            return low
        Kp, Kd, Ki, at = ((1.0 - share) * getattr(low, name) + share * getattr(high, name) for name in ("Kp", "Kd", "Ki", "at"))
        return Gains(low.controller, Kp, Kd, Ki, at)


@dataclass(frozen=True, eq=False)
class Run:
    """Simulation of B cases over the same time, with n samples, one per sampling period.

    A case that diverged keeps its last state.
    """

    t: Array
    """(n,) times [s]."""
    command: Array
    """(n, B, 5) commanded joint position."""
    q: Array
    """(n, B, 5) joint position of the links."""
    qd: Array
    """(n, B, 5) joint velocity of the links."""
    motor: Array
    """(n, B, 5) motor position at the joint side of the gears; q at a joint that is not elastic."""
    torque: Array
    """(n, B, 5) torque command [Nm] at the joint side of the gears, before any limit."""
    limit: Array
    """(n, B, 5) torque that the motors can give at their speed [Nm]; infinite if not known."""
    spring: Array
    """(n, B, m) spring torque T_s [Nm]."""
    ended: Array
    """(B,) time at which a case diverged [s]; NaN if it did not."""
    lost: Array
    """(B, 5) time at which a stepper lost its first step [s]; NaN if it did not."""


class _Table(NamedTuple):
    """References (k, R, 5) of R different commands, at the k times of the grid of half substeps."""

    q: Array
    qd: Array
    qdd: Array
    gravity: Array
    full: Array
    """Rigid feedforward with the drives' inertia and friction."""
    gearbox_friction: Array


def simulate(
    plant: Plant,
    cases: Sequence[Case],
    duration: float,
    *,
    model: Boom | None = None,
    vehicle: VehicleCase | None = None,
    gust: Gust | None = None,
    substeps: int | None = None,
    continuous: bool = False,
    compensate_sag: bool = False,
    track: Track = iter,
) -> Run:
    """Simulate every case from rest with the classical Runge-Kutta method.

    The controllers read the quantised positions of the motors. They know the slope of the vehicle,
    but not its other motion. A torque command is limited to what the motor can give at its speed.
    While it is limited, the integral of the error is frozen.

    A stepper's torque is T_available(speed) sin(p N (command - theta)), with p = 50 for a step of
    1.8 degrees, plus damping relative to the command's speed. It is at most T_available. The
    command moves in microsteps. The stepper has lost a step if p N |command - theta| > pi.

    Args:
        plant: the plant.
        cases: controllers with their commands.
        duration: simulated time [s].
        model: boom that the controllers assume; None is the plant's.
        vehicle: motion of the vehicle under the boom; None is at rest on level ground.
        gust: gust on the tip, if there is one.
        substeps: integration steps per sampling period; None takes enough for steps of at most
            LONGEST_STEP.
        continuous: whether the controllers use exact states at every stage of the integrator,
            without sampling, quantisation and filter.
        compensate_sag: whether the motor references include the twist under the model's gravity.
        track: iterates over the sampling periods, and may show progress.

    Raises:
        InputError: there are no cases, the duration is not above 0, a stepper has no elastic
            joint, or an elastic joint has a servo motor.
    """
    if not cases or not duration > 0.0:
        raise InputError(f"nothing to simulate: {len(cases)} cases for {duration:g} s")
    boom, figures = plant.boom if model is None else model, plant.figures
    T, B, E, m = figures.sampling_period, len(cases), plant.columns, len(plant.elastic)
    steppers, inverse = (
        quick_index([b for b, case in enumerate(cases) if case.controller is kind])
        for kind in (Controller.STEPPER, Controller.COMPUTED_TORQUE)
    )
    kinds = {case.controller for case in cases}
    if Controller.STEPPER in kinds and not m:
        raise InputError("a stepper needs an elastic gearbox for its simulation, and no joint is elastic")
    if Controller.STEPPER in kinds:
        _require_steppers(plant)
    if substeps is None:
        substeps = max(1, int(np.ceil(T / LONGEST_STEP - 1e-9)))
    count, h = int(np.ceil(duration / T - 1e-9)) + 1, T / substeps
    half: Array = np.arange(2.0 * substeps * (count - 1) + 1.0) * (h / 2.0)

    tilt = None if vehicle is None else BaseMotion.of(up=up_on_slope(vehicle.roll, vehicle.pitch))
    commands = list(dict.fromkeys(case.command for case in cases))
    table = _table(plant, boom, commands, half, tilt, compensate_sag)
    row = np.array([commands.index(case.command) for case in cases])
    grounds = _base_arrays(vehicle, half)
    pushes = None if gust is None else gust(half)
    scheduled = quick_index([b for b, case in enumerate(cases) if len(case.gains) > 1])
    Kp, Kd, Ki = (np.stack([getattr(case.gains[0], name) for case in cases]) for name in ("Kp", "Kd", "Ki"))
    several = [case for case in cases if len(case.gains) > 1]
    schedule = _schedule(several, half[:: 2 * substeps]) if several else None
    light = np.array([case.controller in (Controller.PD, Controller.PID) for case in cases])[:, None]

    resolution = _resolutions(plant)
    keep = np.exp(-2.0 * np.pi * figures.velocity_filter_Hz * T)
    teeth, holding, drag, micro = _stepper_figures(plant)
    pulled = None  # torques of steppers
    if Controller.STEPPER in kinds:
        by_slices = isinstance(steppers, slice) and isinstance(E, slice)
        pulled = (steppers, E) if by_slices else np.ix_(np.arange(B)[steppers], np.arange(5)[E])
    field, field_speed = (reference[:, row[steppers]][:, :, E] for reference in (table.q, table.qd))
    field = np.rint(field / micro) * micro
    alive, ended, lost = np.ones(B, dtype=bool), np.full(B, np.nan), np.full((B, 5), np.nan)
    held, cap = np.zeros((B, 5)), np.full((B, 5), np.inf)

    def law(i: int, p: Array, v: Array, total: Array) -> Array:
        """Return torques (B, 5) at half step i for positions p, velocities v, integral action."""
        w = _matvec(Kp, table.q[i][row] - p) + _matvec(Kd, table.qd[i][row] - v) + total
        u: Array = np.where(light, table.gravity[i][row], table.full[i][row]) + w
        if Controller.COMPUTED_TORQUE in kinds:
            a = table.qdd[i][row[inverse]] + w[inverse]
            M, bias = mass_matrix_and_bias(boom, p[inverse], v[inverse], base=tilt)
            friction_torque = boom.friction.torque(v[inverse]) + table.gearbox_friction[i][row[inverse]]
            u[inverse] = _matvec(M, a) + plant.rotor * a + bias + friction_torque
        return u

    def torque(i: int, x: Array) -> Array:
        """Return the applied torques (B, 5) at half step i: held, or a stepper's own torque."""
        u = held
        if continuous:
            q, qd, theta, theta_d = _split(x, m)
            p, v = _measured(q, theta, E), _measured(qd, theta_d, E)
            u = _within(law(i, p, v, total), cap)
        if pulled is not None:
            theta, theta_d, most = x[steppers, 10 : 10 + m], x[steppers, 10 + m :], cap[pulled]
            u = u.copy()
            u[pulled] = _within(most * np.sin(teeth * (field[i] - theta)) + drag * (field_speed[i] - theta_d), most)
        return u

    def rates(i: int, x: Array) -> Array:
        x = np.fmin(np.fmax(x, -MAX_STATE), MAX_STATE)
        q, qd, theta, theta_d = _split(x, m)
        base = None if grounds is None else BaseMotion(*(ground[i] for ground in grounds))
        push = None if pushes is None else pushes[i]
        qdd, theta_dd = accelerations(plant, q, qd, theta, theta_d, torque(i, x), base=base, tip_force=push)
        return np.concatenate([qd, qdd, theta_d, theta_dd], axis=1) * alive[:, None]

    theta_0 = table.q[0][row]
    if pulled is not None:  # the rotor lags its command under the load at rest
        pull = gravity_torque(plant.boom, equilibrium(plant, theta_0, tilt), base=tilt)[:, E]
        lag = np.arcsin(np.clip(pull / holding, -1.0, 1.0)) / teeth
        theta_0[pulled] -= lag[steppers]
    x = np.concatenate([equilibrium(plant, theta_0, tilt), np.zeros((B, 5)), theta_0[:, E], np.zeros((B, m))], axis=1)
    before, v, total = _quantised(_measured(x[:, :5], x[:, 10 : 10 + m], E), resolution), np.zeros((B, 5)), np.zeros((B, 5))

    torque_s, limit_s = np.empty((count, B, 5)), np.empty((count, B, 5))
    states = np.empty((count, *x.shape))
    for k in track(list(range(count))):
        i = 2 * substeps * k
        q, qd, theta, theta_d = _split(x, m)
        motor, motor_d = _measured(q, theta, E), _measured(qd, theta_d, E)
        off = np.abs(motor - table.q[i][row])
        fallen = alive & (~np.isfinite(x).all(axis=1) | (off > DIVERGED).any(axis=1))
        if fallen.any():
            ended[fallen], alive[fallen] = k * T, False
            x[fallen, 5:10], x[fallen, 10 + m :] = 0.0, 0.0
        if pulled is not None:
            slipped = (teeth * off[pulled] > np.pi) & np.isnan(lost[pulled])
            lost[pulled] = np.where(slipped, k * T, lost[pulled])
        cap = torque_limits(plant, motor_d)
        if schedule is not None:
            Kp[scheduled], Kd[scheduled], Ki[scheduled] = schedule(k)
        p = _quantised(motor, resolution)
        v = keep * v + (1.0 - keep) * (p - before) / T
        before = p
        asked = law(i, motor, motor_d, total) if continuous else law(i, p, v, total)
        held = _within(asked, cap)
        if pulled is not None:
            asked[steppers] = torque(i, x)[steppers]
        total = total + np.where(np.abs(asked) > cap, 0.0, T * _matvec(Ki, table.q[i][row] - p))
        states[k], torque_s[k], limit_s[k] = x, asked, cap
        if k + 1 < count:
            for j in range(substeps):
                x = _runge_kutta(rates, i + 2 * j, h, x)
    command = np.stack([c(half[:: 2 * substeps])[0] for c in commands], axis=1)[:, row]
    q, qd, theta, _ = _split(states, m)
    spring = spring_torque(plant, q, theta - q[..., E])
    return Run(half[:: 2 * substeps], command, q, qd, _measured(q, theta, E), torque_s, limit_s, spring, ended, lost)


def _runge_kutta(rates: Callable[[int, Array], Array], i: int, h: float, x: Array) -> Array:
    k1 = rates(i, x)
    k2 = rates(i + 1, x + 0.5 * h * k1)
    k3 = rates(i + 1, x + 0.5 * h * k2)
    k4 = rates(i + 2, x + h * k3)
    return x + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)


def _table(plant: Plant, boom: Boom, commands: Sequence[Command], t: Array, tilt: BaseMotion | None, sag: bool) -> _Table:
    E = list(plant.elastic)
    q, qd, qdd = (np.stack(part, axis=1) for part in zip(*(command(t) for command in commands), strict=True))
    gravity = gravity_torque(boom, q, base=tilt)
    load = inverse_dynamics(boom, q, qd, qdd, base=tilt, reactions=False, friction=True).tau
    gearbox_friction = np.zeros_like(q)
    if E:
        gearbox_friction[..., E] = friction(plant, qd[..., E], load[..., E])
        if sag:
            q = q.copy()
            q[..., E] += twist_under(plant, q, gravity[..., E])
    return _Table(q, qd, qdd, gravity, load + plant.rotor * qdd + gearbox_friction, gearbox_friction)


def _schedule(cases: Sequence[Case], t: Array) -> Callable[[int], Array]:
    """Return a function of the index of t: Kp, Kd, Ki (3, S, 5, 5) of S cases."""
    most = max(len(case.gains) for case in cases)
    knots = np.empty((3, len(cases), most, 5, 5))
    for s, case in enumerate(cases):
        for i in range(most):
            gains = case.gains[min(i, len(case.gains) - 1)]
            knots[:, s, i] = gains.Kp, gains.Kd, gains.Ki
    places, shares = (np.stack(each, axis=1) for each in zip(*(case.place(t) for case in cases), strict=True))
    each = np.arange(len(cases))

    def at(k: int) -> Array:
        before, share = places[k], shares[k][:, None, None]
        gains: Array = (1.0 - share) * knots[:, each, before] + share * knots[:, each, before + 1]
        return gains

    return at


def _base_arrays(vehicle: VehicleCase | None, t: Array) -> tuple[Array, ...] | None:
    if vehicle is None:
        return None
    base = base_motion(vehicle, t)
    return tuple(np.broadcast_to(getattr(base, name), (t.size, 3)) for name in _BASE)


def _require_steppers(plant: Plant) -> None:
    for i in plant.elastic:
        drive = plant.boom.drives[i]
        if drive is not None and drive.motor.is_servo:
            raise InputError(f"{JOINTS[i]}: {drive.motor.name} is a servo motor; it cannot be simulated as a stepper")


def _stepper_figures(plant: Plant) -> tuple[Array, Array, Array, Array]:
    """Return p N [1/rad], N T_run, rotor damping and microstep, each (m,) for the elastic joints.

    All are at the joint side of the gears.
    """
    drives = [drive for i in plant.elastic if (drive := plant.boom.drives[i])]
    ratio = np.array([drive.gearbox.ratio for drive in drives])
    step = np.array([drive.motor.step or 2.0 * np.pi for drive in drives])  # a servo motor has none, and needs none
    holding = ratio * np.array([drive.motor.running_torque or 0.0 for drive in drives])
    teeth = np.pi / (2.0 * step) * ratio  # a full step is a quarter of an electrical turn
    drag = 2.0 * plant.figures.rotor_damping * np.sqrt(holding * teeth * plant.rotor[list(plant.elastic)])
    return teeth, holding, drag, step / ratio / plant.figures.microsteps


def _resolutions(plant: Plant) -> Array:
    """Return the resolution (5,) of the encoders at the joints; 0 is exact."""
    figures, joint = plant.figures, np.empty(5)
    for i, drive in enumerate(plant.boom.drives):
        counts = figures.joint_counts if drive is None else figures.encoder_counts * drive.gearbox.ratio
        joint[i] = 2.0 * np.pi / counts if counts else 0.0
    joint[3] = figures.extension_count_mm * 1e-3
    return joint


def _quantised(p: Array, resolution: Array) -> Array:
    size = np.where(resolution > 0.0, resolution, 1.0)
    rounded: Array = np.where(resolution > 0.0, np.rint(p / size) * size, p)
    return rounded


def _measured(q: Array, theta: Array, E: slice | list[int]) -> Array:
    """Return what the encoders measure: theta at elastic joints, q elsewhere."""
    p = q.copy()
    p[..., E] = theta
    return p


def _split(x: Array, m: int) -> tuple[Array, Array, Array, Array]:
    return x[..., :5], x[..., 5:10], x[..., 10 : 10 + m], x[..., 10 + m :]


def _within(torque: Array, most: Array) -> Array:
    """Limit a torque to +-most; `np.clip` takes longer on small arrays."""
    cut: Array = np.minimum(np.maximum(torque, -most), most)
    return cut


def _matvec(K: Array, e: Array) -> Array:
    product: Array = (K @ e[..., None])[..., 0]
    return product
