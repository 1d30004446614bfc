"""Controller design from bandwidth and damping; stability margins.

Only this module imports python-control.

Every controller reads positions p (5,) once per sampling period T, and holds its torque between
samples. At an elastic joint p is the motor's position, elsewhere the joint's:

    v_k = a v_k-1 + (1 - a) (p_k - p_k-1) / T      a = exp(-2 pi f T), the velocity filter
    w = Kp (q_r - p) + Kd (qd_r - v) + sum T Ki (q_r - p)

pd, pid            u = g(q_r) + w
lqr                u = M qdd_r + h(q_r, qd_r) + J qdd_r + friction(qd_r) + w
computed-torque    u = (M + J)(qdd_r + w) + h(p, v) + friction(qd_r)
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from boom_model import InputError, gravity_torque, mass_matrix
from boom_model.arrays import Array, read_only, scalar
from planner.control.linear import Linear, linearise
from planner.control.plant import Plant, jacobian

_NEAR = 20
"""Samples on each side of a crossing. The influence of a cubic spline's samples falls by 0.27 each.
"""

STABLE = 1.0 + 1e-9
"""Largest magnitude of a discrete-time pole that counts as stable."""


class Controller(StrEnum):
    """Kind of controller."""

    PD = "pd"
    PID = "pid"
    COMPUTED_TORQUE = "computed-torque"
    LQR = "lqr"
    STEPPER = "stepper"


@dataclass(frozen=True)
class Goals:
    """Design goals: the poles of the rigid boom in closed loop.

    The polynomial is s^2 + 2 zeta w s + w^2, times s + a w with integral action.
    """

    bandwidth_Hz: float = 6.0
    """w / (2 pi) [Hz]."""
    damping: float = 1.0
    """Damping ratio zeta."""
    integral: float = 0.3
    """a, the pole of the integral action divided by w."""

    @staticmethod
    def of(bandwidth_Hz: float = 6.0, damping: float = 1.0, integral: float = 0.3) -> "Goals":
        """Return checked goals.

        Raises:
            InputError: a goal is not finite or not above 0.
        """
        goals = {"bandwidth_Hz": bandwidth_Hz, "damping": damping, "integral": integral}
        for name, value in goals.items():
            if not scalar(name, value) > 0.0:
                raise InputError(f"{name} is {value:g}; it must be above 0")
        return Goals(**goals)


@dataclass(frozen=True, eq=False)
class Gains:
    """Gains (5, 5) of a controller. They give torques, or accelerations for computed torque."""

    controller: Controller
    Kp: Array
    Kd: Array
    Ki: Array
    at: Array
    """(5,) joint position of the design."""


@dataclass(frozen=True)
class Margins:
    """Stability margins of one joint's loop, opened at its torque with the other loops closed."""

    joint: int
    """Index of the joint."""
    gain_dB: float | None
    """Gain margin [dB]; None if it is infinite."""
    less_gain_dB: float | None
    """Gain reduction margin (negative) [dB]; None if it is infinite.

    It is finite for a loop that needs its gain because of gravity or an integrator.
    """
    phase_deg: float | None
    """Phase margin [deg]; None if the gain never crosses 1."""
    crossover_Hz: float | None
    """Frequency at which the phase margin is found [Hz]."""
    sensitivity_peak: float
    """Largest sensitivity, max |1 / (1 + L)|."""


@dataclass(frozen=True, eq=False)
class Loop:
    """Closed loop linearised about one pose."""

    at: Array
    """(5,) joint position."""
    poles: Array
    """Complex poles s = ln(z) / T [1/s] of the discrete-time poles z."""
    largest: float
    """Largest magnitude of a discrete-time pole; the loop is stable below 1."""
    margins: tuple[Margins, ...]
    """Margins of each joint; empty if they were not asked for."""
    frequencies: Array
    """(k,) frequencies [Hz]."""
    response: Array
    """(k, 5) complex response L of each joint's loop, with the others closed."""

    @property
    def stable(self) -> bool:
        """Whether every discrete-time pole is at most STABLE."""
        return self.largest <= STABLE


def design(plant: Plant, controller: Controller, goals: Goals, q: Array) -> Gains:
    """Design the gains that give each joint of a rigid boom the poles of the goals at q (5,).

    Coupling between joints is neglected, except for lqr. J_i is the inertia of joint i at q,
    including its drive. With the polynomial (s^2 + 2 zeta w s + w^2)(s + a w):

        pd    Kp = J w^2, Kd = 2 zeta w J
        pid   Kp = (1 + 2 zeta a) w^2 J, Kd = (2 zeta + a) w J, Ki = a w^3 J
        lqr   minimum of the integral of x' Q x + u' R u, with x = (integral of e, e, de/dt)
              R = (M M')^-1
              Q = (a^2 w^6, (1 + a^2 (4 zeta^2 - 2)) w^4, (a^2 + 4 zeta^2 - 2) w^2)
        computed-torque   kp = w^2, kd = 2 zeta w, as accelerations

    R weighs torques by the accelerations that they cause. M includes the drives' inertia. Without
    gravity lqr gives exactly the poles of pid, with the joints coupled.

    A stepper has no gains. Beside a stepper, joints without a drive use pd with full feedforward.

    Args:
        plant: the plant.
        controller: kind of controller.
        goals: design goals.
        q: joint position (5,).

    Raises:
        InputError: the damping is too small for lqr, whose weights would be negative.
    """
    w, zeta, a = 2.0 * np.pi * goals.bandwidth_Hz, goals.damping, goals.integral
    M = mass_matrix(plant.boom, q) + np.diag(plant.rotor)
    J, zero = np.diag(np.diag(M)), np.zeros((5, 5))
    if controller is Controller.PID:
        gains = ((1.0 + 2.0 * zeta * a) * w**2 * J, (2.0 * zeta + a) * w * J, a * w**3 * J)
    elif controller is Controller.COMPUTED_TORQUE:
        gains = (w**2 * np.eye(5), 2.0 * zeta * w * np.eye(5), zero)
    elif controller is Controller.LQR:
        gains = _lqr(plant, goals, q, M)
    else:
        gains = (w**2 * J, 2.0 * zeta * w * J, zero)
    Kp, Kd, Ki = (read_only(K) for K in gains)
    return Gains(controller, Kp, Kd, Ki, read_only(q))


def _lqr(plant: Plant, goals: Goals, q: Array, M: Array) -> tuple[Array, Array, Array]:
    import control

    w, zeta, a = 2.0 * np.pi * goals.bandwidth_Hz, goals.damping, goals.integral
    weights = (1.0 + a**2 * (4.0 * zeta**2 - 2.0)) * w**4, (a**2 + 4.0 * zeta**2 - 2.0) * w**2, a**2 * w**6
    if min(weights) < 0.0:
        raise InputError(
            f"damping is {zeta:g}; lqr needs at least {np.sqrt(max(0.5 - a**2 / 4.0, 0.0)):.3g} for non-negative weights"
        )
    rigid = linearise(Plant.of(plant.boom, plant.figures, elastic=False), q)
    system = control.ss(rigid.A, rigid.B @ M, np.eye(10), 0.0)  # input is the acceleration M^-1 u, with weight 1
    k, _, _ = control.lqr(system, np.diag(np.repeat(weights, 5)), np.eye(5), integral_action=rigid.measured)
    K = M @ k
    return K[:, :5], K[:, 5:10], K[:, 10:]


def feedback_of(plant: Plant, gains: Gains, q: Array) -> tuple[Array, Array, Array]:
    """Return -du/dp, -du/dv and -du/d(sum) (5, 5) of a controller about a pose q (5,)."""
    if gains.controller is not Controller.COMPUTED_TORQUE:
        return gains.Kp, gains.Kd, gains.Ki
    M = mass_matrix(plant.boom, q) + np.diag(plant.rotor)
    return M @ gains.Kp - jacobian(lambda x: gravity_torque(plant.boom, x), q), M @ gains.Kd, M @ gains.Ki


def analyse(plant: Plant, gains: Gains, q: Array, *, model: Plant | None = None, responses: bool = True) -> Loop:
    """Compute poles, margins and sensitivity of the discrete-time loop about a pose.

    The loop includes the zero-order hold and the velocity filter.

    Args:
        plant: the plant.
        gains: gains of the controller.
        q: joint position (5,).
        model: plant that the controller assumes; None is `plant`.
        responses: whether to compute margins and frequency responses too.

    Raises:
        InputError: the controller is a stepper, which has no loop.
    """
    import control

    if gains.controller is Controller.STEPPER:
        raise InputError("a stepper runs in open loop: it has no closed-loop poles and no margins")
    T = plant.figures.sampling_period
    linear = linearise(plant, q)
    sampled = _sampled(linear, T)
    law = _law(plant if model is None else model, gains, q, T)
    poles = np.asarray(control.feedback(sampled, law).poles())
    with np.errstate(divide="ignore"):
        continuous = np.log(poles[np.abs(poles) > 1e-6].astype(complex)) / T
    largest = float(np.abs(poles).max())
    order = np.argsort(np.abs(continuous))
    if not responses:
        return Loop(q, continuous[order], largest, (), np.zeros(0), np.zeros((0, 5)))
    f = np.geomspace(0.02, 0.4999 / T, 2000)
    P, C = (_response(s, f) for s in (sampled, law))
    L = C @ P
    each = np.stack([_joint_loop(L, i) for i in range(5)], axis=-1)
    margins = tuple(_margins(i, f, each[:, i]) for i in range(5))
    return Loop(q, continuous[order], largest, margins, f, each)


def _sampled(linear: Linear, T: float) -> Any:
    import control

    return control.sample_system(control.ss(linear.A, linear.B, linear.measured, 0.0), T, method="zoh")


def _law(plant: Plant, gains: Gains, q: Array, T: float) -> Any:
    """Return the controller as a system from p to -u with states (p_k-1, v_k-1, sum)."""
    import control

    Kp, Kd, Ki = feedback_of(plant, gains, q)
    a = np.exp(-2.0 * np.pi * plant.figures.velocity_filter_Hz * T)
    eye, zero = np.eye(5), np.zeros((5, 5))
    slope = (1.0 - a) / T
    A = np.block([[zero, zero, zero], [-slope * eye, a * eye, zero], [zero, zero, eye]])
    B = np.vstack([eye, slope * eye, T * eye])
    C, D = np.hstack([-slope * Kd, a * Kd, Ki]), Kp + slope * Kd
    kept = slice(None) if Ki.any() else slice(0, 10)
    return control.ss(A[kept, kept], B[kept], C[:, kept], D, T)


def _response(system: Any, f: Array) -> Any:
    """Return C (z - A)^-1 B + D (k, 5, 5) on the unit circle.

    python-control solves for one frequency at a time.
    """
    z = np.exp(2j * np.pi * f * system.dt)[:, None, None]
    states = np.linalg.solve(z * np.eye(len(system.A)) - system.A, np.broadcast_to(system.B, (len(f), *system.B.shape)))
    return system.C @ states + system.D


def _joint_loop(L: Any, i: int) -> Any:
    """Return loop i with the others closed (k,): L_ii - L_io (1 + L_oo)^-1 L_oi."""
    o = [j for j in range(5) if j != i]
    rest = np.linalg.solve(np.eye(4) + L[:, o][:, :, o], L[:, o, i][..., None])[..., 0]
    return L[:, i, i] - np.einsum("kj,kj->k", L[:, i, o], rest)


def _near_crossings(L: Any) -> list[slice]:
    """Return the samples near which L (k,) crosses the unit circle or the negative real axis.

    python-control interpolates in a Python loop over the samples, so all 2000 take far longer.
    """
    on_axis = (np.diff(np.sign(L.imag)) != 0.0) & (L.real[:-1] <= 0.0)
    found = np.flatnonzero((np.diff(np.sign(np.abs(L) - 1.0)) != 0.0) | on_axis)
    if not found.size:
        return []
    groups = np.split(found, np.flatnonzero(np.diff(found) > 2 * _NEAR) + 1)
    return [slice(max(group[0] - _NEAR, 0), group[-1] + _NEAR + 2) for group in groups]


def _margins(joint: int, f: Array, L: Any) -> Margins:
    import control

    found: list[list[Array]] = [[], [], []]
    for near in _near_crossings(L):
        part = control.FRD(L[near], 2.0 * np.pi * f[near], smooth=True)
        gain, phase, _, _, crossing, _ = control.stability_margins(part, returnall=True)
        for values, new in zip(found, (gain, phase, crossing), strict=True):
            values.append(np.asarray(new, dtype=float))
    gains, phases, crossings = (np.concatenate(values) if values else np.zeros(0) for values in found)
    decibels = 20.0 * np.log10(gains)
    more, less = decibels[decibels > 0.0], decibels[decibels < 0.0]
    at = int(np.abs(phases).argmin()) if len(phases) else None
    return Margins(
        joint=joint,
        gain_dB=float(more.min()) if more.size else None,
        less_gain_dB=float(less.max()) if less.size else None,
        phase_deg=None if at is None else float(phases[at]),
        crossover_Hz=None if at is None else float(crossings[at] / (2.0 * np.pi)),
        sensitivity_peak=float((1.0 / np.abs(1.0 + L)).max()),
    )
