"""Controllers designed from stated goals, and what their loops are worth.

Every controller reads positions p (5,) at its sampling period T, the motors' at elastic joints, and holds its torque between
samples:

    v_k = a v_k-1 + (1 - a) (p_k - p_k-1) / T      a = exp(-2 pi f T), the velocity filter
    w = Kp (q_r - p) + Kd (qd_r - v) + sum T Ki (q_r - p)

pd, pid            u = g(q_r) + w
lqr                u = M qdd_r + h(q_r, qd_r) + J qdd_r + friction(qd_r) + w
computed-torque    u = (M + J)(qdd_r + w) + h(p, v) + friction(qd_r)
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import expm, solve_continuous_are

from boom_model import InputError, gravity_torque, mass_matrix
from boom_model.arrays import Array, read_only, scalar
from planner.control.linear import Linear, linearise
from planner.control.plant import Plant, slopes

STABLE = 1.0 + 1e-9
"""A sampled pole of at most this size counts as stable."""


class Controller(StrEnum):
    """How torques follow from a reference."""

    PD = "pd"
    PID = "pid"
    COMPUTED_TORQUE = "computed-torque"
    LQR = "lqr"
    STEPPER = "stepper"


@dataclass(frozen=True)
class Goals:
    """What a loop is designed for: poles s^2 + 2 zeta w s + w^2 and, with integral action, s + a w, of the rigid boom."""

    bandwidth_Hz: float = 6.0
    damping: float = 1.0
    integral: float = 0.3
    """a"""

    @staticmethod
    def of(bandwidth_Hz: float = 6.0, damping: float = 1.0, integral: float = 0.3) -> "Goals":
        """Goals, checked.

        Raises:
            InputError: not finite, or not above 0.
        """
        goals = {"bandwidth_Hz": bandwidth_Hz, "damping": damping, "integral": integral}
        for name, value in goals.items():
            if not scalar(name, value) > 0.0:
                raise InputError(f"{name} is {value:g}; it must be above 0")
        return Goals(**goals)


@dataclass(frozen=True, eq=False)
class Gains:
    """Gains (5, 5) of a controller: torques, and accelerations for computed torque."""

    controller: Controller
    Kp: Array
    Kd: Array
    Ki: Array
    at: Array
    """(5,) joint position that they were designed at."""


@dataclass(frozen=True)
class Margins:
    """Of one joint's loop, broken at its torque with the other loops closed."""

    joint: int
    gain_dB: float | None
    """How much more gain it bears; None where it bears any."""
    less_gain_dB: float | None
    """How much less (negative), for a loop that gravity or an integrator makes need its gain; None where it bears any."""
    phase_deg: float | None
    crossover_Hz: float | None
    sensitivity_peak: float
    """max |1 / (1 + L)|"""


@dataclass(frozen=True, eq=False)
class Loop:
    """A closed loop about one pose."""

    at: Array
    """(5,)"""
    poles: Array
    """Complex, of the continuous time that gives the sampled ones: ln(z) / T [1/s]."""
    largest: float
    """Size of the largest sampled pole: below 1 is stable."""
    margins: tuple[Margins, ...]
    frequencies: Array
    """(k,) [Hz]"""
    response: Array
    """(k, 5) complex: each joint's loop L, the others closed."""

    @property
    def stable(self) -> bool:
        return self.largest <= STABLE


def design(plant: Plant, controller: Controller, goals: Goals, q: Array) -> Gains:
    """Gains at joint position q (5,) that give a rigid boom, whose joints were alone, the poles that the goals name.

    With J_i the inertia of joint i at q, its drive's included, and the polynomial (s^2 + 2 zeta w s + w^2)(s + a w):

        pd    Kp = J w^2, Kd = 2 zeta w J
        pid   Kp = (1 + 2 zeta a) w^2 J, Kd = (2 zeta + a) w J, Ki = a w^3 J
        lqr   least integral of e' Q e + u' R u with R = (M M')^-1, which weighs torques as the accelerations that they give,
              and, for (integral of e, e, de/dt), Q = (a^2 w^6, (1 + a^2 (4 zeta^2 - 2)) w^4, (a^2 + 4 zeta^2 - 2) w^2):
              without gravity these give exactly the pid's poles, joints coupled; M has the drives' inertia in it
        computed-torque   kp = w^2, kd = 2 zeta w, as accelerations

    A stepper has no gains; the joints without a drive follow it by pd about the full feedforward.

    Raises:
        InputError: the goals give lqr a negative weight.
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
    w, zeta, a = 2.0 * np.pi * goals.bandwidth_Hz, goals.damping, goals.integral
    weights = (1.0 + a**2 * (4.0 * zeta**2 - 2.0)) * w**4, (a**2 + 4.0 * zeta**2 - 2.0) * w**2, a**2 * w**6
    if min(weights) < 0.0:
        raise InputError(f"damping is {zeta:g}; lqr needs at least {np.sqrt(max(0.5 - a**2 / 4.0, 0.0)):.3g} for its weights")
    rigid = linearise(Plant.of(plant.boom, plant.figures, elastic=False), q)
    A = np.block([[rigid.A, np.zeros((10, 5))], [rigid.measured, np.zeros((5, 5))]])  # the integrals of the positions last
    B = np.vstack([rigid.B @ M, np.zeros((5, 5))])  # from accelerations M^-1 u: their weight is 1
    K = M @ B.T @ solve_continuous_are(A, B, np.diag(np.repeat(weights, 5)), np.eye(5))
    return K[:, :5], K[:, 5:10], K[:, 10:]


def feedback_of(plant: Plant, gains: Gains, q: Array) -> tuple[Array, Array, Array]:
    """-du/dp, -du/dv and -du/d(sum) (5, 5) of a controller about a pose q (5,)."""
    if gains.controller is not Controller.COMPUTED_TORQUE:
        return gains.Kp, gains.Kd, gains.Ki
    M = mass_matrix(plant.boom, q) + np.diag(plant.rotor)
    return M @ gains.Kp - slopes(lambda x: gravity_torque(plant.boom, x), q), M @ gains.Kd, M @ gains.Ki


def analyse(plant: Plant, gains: Gains, q: Array, *, model: Plant | None = None, responses: bool = True) -> Loop:
    """Poles, margins and sensitivity of the sampled loop about a pose q (5,): plant with hold, velocity filter and all.

    Args:
        model: the plant as the controller believes it to be; None is the plant itself.
        responses: whether to compute margins and responses too; poles come always.

    Raises:
        InputError: a stepper, which has no loop.
    """
    if gains.controller is Controller.STEPPER:
        raise InputError("a stepper runs open loop: it has no poles to place and no margins")
    T = plant.figures.sampling_period
    linear = linearise(plant, q)
    sampled = _sampled(linear, T)
    law = _law(plant if model is None else model, gains, q, T)
    poles = _poles(sampled, law)
    with np.errstate(divide="ignore"):
        continuous = np.log(poles[np.abs(poles) > 1e-6].astype(complex)) / T
    largest = float(np.abs(poles).max())
    order = np.argsort(np.abs(continuous))
    if not responses:
        return Loop(q, continuous[order], largest, (), np.zeros(0), np.zeros((0, 5)))
    f = np.geomspace(0.02, 0.4999 / T, 2000)
    z = np.exp(2j * np.pi * f * T)
    L = _response(law, z) @ _response(sampled, z)
    each = np.stack([_alone(L, i) for i in range(5)], axis=-1)
    margins = tuple(_margins(i, f, each[:, i]) for i in range(5))
    return Loop(q, continuous[order], largest, margins, f, each)


class _Sampled(NamedTuple):
    """x_k+1 = A x_k + B u_k, y_k = C x_k + D u_k."""

    A: Array
    B: Array
    C: Array
    D: Array


def _sampled(linear: Linear, T: float) -> _Sampled:
    """The linear plant behind a zero-order hold: exp([[A, B], [0, 0]] T) holds both its matrices."""
    n, inputs = linear.B.shape
    held = expm(T * np.block([[linear.A, linear.B], [np.zeros((inputs, n + inputs))]]))
    return _Sampled(held[:n, :n], held[:n, n:], linear.measured, np.zeros((len(linear.measured), inputs)))


def _law(plant: Plant, gains: Gains, q: Array, T: float) -> _Sampled:
    """The controller as a system from p to -u, its states (p_k-1, v_k-1, sum)."""
    Kp, Kd, Ki = feedback_of(plant, gains, q)
    a = np.exp(-2.0 * np.pi * plant.figures.velocity_filter_Hz * T)
    eye, zero = np.eye(5), np.zeros((5, 5))
    slope = (1.0 - a) / T
    A = np.block([[zero, zero, zero], [-slope * eye, a * eye, zero], [zero, zero, eye]])
    B = np.vstack([eye, slope * eye, T * eye])
    C, D = np.hstack([-slope * Kd, a * Kd, Ki]), Kp + slope * Kd
    kept = slice(None) if Ki.any() else slice(0, 10)
    return _Sampled(A[kept, kept], B[kept], C[:, kept], D)


def _poles(plant: _Sampled, law: _Sampled) -> Any:
    """Of the plant, which passes nothing straight through, with the law fed back: complex (k,)."""
    A = plant.A - plant.B @ law.D @ plant.C
    return np.linalg.eigvals(np.block([[A, -plant.B @ law.C], [law.B @ plant.C, law.A]]))


def _response(system: _Sampled, z: Any) -> Any:
    """C (z - A)^-1 B + D at z (k,): (k, outputs, inputs)."""
    states = np.linalg.solve(z[:, None, None] * np.eye(len(system.A)) - system.A, system.B.astype(complex))
    return system.C @ states + system.D


def _alone(L: Any, i: int) -> Any:
    """Loop i with the others closed: L_ii - L_io (1 + L_oo)^-1 L_oi, (k,)."""
    o = [j for j in range(5) if j != i]
    rest = np.linalg.solve(np.eye(4) + L[:, o][:, :, o], L[:, o, i][..., None])[..., 0]
    return L[:, i, i] - np.einsum("kj,kj->k", L[:, i, o], rest)


def _margins(joint: int, f: Array, L: Any) -> Margins:
    """From the roots of cubic splines through the response: |L| = 1, and L real and negative."""
    real, imaginary = (CubicSpline(f, part, extrapolate=False) for part in (L.real, L.imag))
    turns = imaginary.roots()
    crossings = CubicSpline(f, np.abs(L) ** 2 - 1.0, extrapolate=False).roots()
    turned = real(turns)
    decibels = -20.0 * np.log10(-turned[turned < 0.0])
    more, less = decibels[decibels > 0.0], decibels[decibels < 0.0]
    phases = np.degrees(np.arctan2(-imaginary(crossings), -real(crossings)))  # beyond -180 deg
    at = int(np.abs(phases).argmin()) if phases.size else None
    return Margins(
        joint=joint,
        gain_dB=float(more.min()) if more.size else None,
        less_gain_dB=float(less.max()) if less.size else None,
        phase_deg=None if at is None else float(phases[at]),
        crossover_Hz=None if at is None else float(crossings[at]),
        sensitivity_peak=float((1.0 / np.abs(1.0 + L)).max()),
    )
