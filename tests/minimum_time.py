"""The least time along a path by direct collocation, and a motion's worst ratios, both independent
of planner and model.

The dynamics are Pinocchio's. The drives' limits are written out here, with the datasheets' figures
of the MST342C02 on the CBG320160 that drive joints 2 and 3, wired in parallel at 80 V. The
nonlinear program is IPOPT's.
"""

from typing import NamedTuple

import casadi as ca
import numpy as np

from boom_model.arrays import Array
from boom_model.boom import Boom
from planner.paths.path import Path
from planner.timing.time_law import Motion
from tests.oracles import pinocchio_inverse_dynamics

DRIVEN = [1, 2]
RATIO, EFFICIENCY, NO_LOAD_TORQUE, START_STOP_TORQUE = 160.0, 0.65, 0.42, 460.0  # [Nm] at the input, at the output
VOLTAGE, RESISTANCE, INDUCTANCE, PEAK_CURRENT = 80.0, 0.2, 1.4e-3, 2.0**0.5 * 9.5
RUNNING_TORQUE, POLE_PAIRS, MARGIN = 7.2, 50.0, 0.5
INERTIA = EFFICIENCY * RATIO**2 * (4.0e-4 + 1.76e-4)  # of rotor and gearbox [kg m^2]
AT_STANDSTILL = (RUNNING_TORQUE / (1.0 + MARGIN) - NO_LOAD_TORQUE) * RATIO * EFFICIENCY

COEFFICIENT_NODES = 161
INTERVALS = 200
SAMPLES_PER_PIECE = 5


class Optimum(NamedTuple):
    """A least-time law at equal steps in time, each (n,)."""

    duration: float
    s: Array
    v: Array
    """s'"""
    u: Array
    """s'', linear between the samples"""


def torque_on_curve(speed):
    """What the voltage leaves at joint speeds >= 0 [rad/s], at the joint [Nm]; of NumPy or of
    CasADi."""
    w = RATIO * speed
    resistive = RESISTANCE * PEAK_CURRENT + RUNNING_TORQUE / PEAK_CURRENT * w
    reactive = POLE_PAIRS * w * INDUCTANCE * PEAK_CURRENT
    available = RUNNING_TORQUE * VOLTAGE / (resistive**2 + reactive**2) ** 0.5
    return (available / (1.0 + MARGIN) - NO_LOAD_TORQUE) * RATIO * EFFICIENCY


def minimum_time(boom: Boom, path: Path, *, drives: bool = True, credit: bool = True, intervals: int = INTERVALS) -> Optimum:
    """The least time along a path, rest to rest, on level ground, from a slow cubic as the first
    guess.

    Direct collocation in time: states s and s', control s'' linear over each of `intervals` equal
    steps and integrated exactly, limits held at every node. The path's coefficients are splines of
    degree 5 in s.

    Args:
        drives: whether the drives' limits count.
        credit: whether friction may help to brake; if not, the limits hold without friction too.
    """
    grid, zero = np.linspace(0.0, 1.0, COEFFICIENT_NODES), np.zeros((COEFFICIENT_NODES, 5))
    q, p1, p2 = (path(grid, order) for order in range(3))
    states = (zero, zero), (zero, p1), (p1, p2)
    static, pushed, carried = (pinocchio_inverse_dynamics(boom, q, *rates).tau[:, DRIVEN] for rates in states)
    columns = np.concatenate([p1, p2, static, pushed - static, carried - static], axis=1)
    look_up = ca.interpolant("look_up", "bspline", [grid], columns.ravel(), {"degree": [5]})

    s, v, u = (ca.MX.sym(name) for name in "svu")
    p1, p2, static, per_u, per_x = ca.vertsplit(look_up(s), [0, 5, 10, 12, 14, 16])
    qd, qdd = p1 * v, p1 * u + p2 * v**2
    ratios = [qd / boom.limits.velocity, qdd / boom.limits.acceleration]
    if drives:
        smooth = static + per_u * u + per_x * v**2
        rubbed = smooth + boom.friction.viscous[DRIVEN] * qd[DRIVEN] + boom.friction.coulomb[DRIVEN] * ca.sign(p1[DRIVEN])
        for tau in [rubbed] if credit else [rubbed, smooth]:
            driven = tau + INERTIA * qdd[DRIVEN]
            on_curve = torque_on_curve(ca.fabs(qd[DRIVEN]))
            ratios += [tau / START_STOP_TORQUE, driven / AT_STANDSTILL, driven / on_curve]
    rows = ca.Function("rows", [s, v, u], [ca.vertcat(*ratios)])

    n, T = intervals + 1, ca.MX.sym("T")
    S, V, U = (ca.MX.sym(name, n) for name in "SVU")
    h = T / intervals
    moved = S[1:] - S[:-1] - h * V[:-1] - h**2 * (2.0 * U[:-1] + U[1:]) / 6.0
    sped = V[1:] - V[:-1] - h * (U[:-1] + U[1:]) / 2.0
    held = ca.vec(rows.map(n)(S.T, V.T, U.T))
    bound = np.concatenate([np.zeros(2 * intervals), np.ones(held.numel())])
    lower = np.concatenate([[1e-3], np.zeros(2 * n), np.full(n, -np.inf)])
    upper = np.concatenate([[np.inf], np.ones(n), np.full(2 * n, np.inf)])
    lower[n], upper[[1, n + 1, 2 * n]] = 1.0, 0.0  # s and s' at both ends
    t, slow = np.linspace(0.0, 1.0, n), 10.0
    cubic = np.concatenate([[slow], 3.0 * t**2 - 2.0 * t**3, 6.0 * (t - t**2) / slow, (6.0 - 12.0 * t) / slow**2])
    program = {"x": ca.vertcat(T, S, V, U), "f": T, "g": ca.vertcat(moved, sped, held)}
    options = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", "error_on_fail": True}
    solve = ca.nlpsol("solve", "ipopt", program, options)
    found = solve(x0=cubic, lbx=lower, ubx=upper, lbg=-bound, ubg=bound)["x"].full().ravel()
    duration, *law = np.split(found, [1, n + 1, 2 * n + 1])
    return Optimum(float(duration[0]), *law)


def throughout(motion: Motion) -> tuple[Array, Array, Array]:
    """q, qd, qdd (n, 5) at SAMPLES_PER_PIECE places of every piece of the motion's law, its ends
    from within included."""
    breaks = motion.law.s.x
    t = breaks[:-1, None] + np.diff(breaks)[:, None] * np.linspace(1e-6, 1.0 - 1e-6, SAMPLES_PER_PIECE)
    return motion(t.ravel())[:3]


def worst_ratios(boom: Boom, q: Array, qd: Array, qdd: Array) -> dict[str, float]:
    """Largest |demand| / limit of states (n, 5) on level ground."""
    tau = pinocchio_inverse_dynamics(boom, q, qd, qdd).tau + boom.friction.viscous * qd + boom.friction.coulomb * np.sign(qd)
    tau, speed = tau[:, DRIVEN], np.abs(qd[:, DRIVEN])
    driven = np.abs(tau + INERTIA * qdd[:, DRIVEN])
    return {
        "velocity": np.abs(qd / boom.limits.velocity).max(),
        "acceleration": np.abs(qdd / boom.limits.acceleration).max(),
        "gearbox": np.abs(tau).max() / START_STOP_TORQUE,
        "motor at standstill": driven.max() / AT_STANDSTILL,
        "motor on its curve": (driven / torque_on_curve(speed)).max(),
    }
