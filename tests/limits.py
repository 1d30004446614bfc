"""What a motion asks of the third-generation boom's limits, from the datasheets' own figures: what
tests hold the planner to.

It shares the rigid-body dynamics with the planner (held against MuJoCo and Pinocchio elsewhere) and
nothing else: neither the drives' curves nor the way a motion is sampled.
"""

import numpy as np

from boom_model import Boom, inverse_dynamics
from boom_model.arrays import Array
from planner.timing.time_law import Motion

DRIVEN = (1, 2)
RATIO, EFFICIENCY, NO_LOAD, START_STOP = 160.0, 0.65, 0.42, 460.0  # CBG320160; Nm
RUNNING, CURRENT, RESISTANCE, INDUCTANCE = 7.2, 9.5, 0.2, 1.4e-3  # MST342C02, wired in parallel; SI
VOLTAGE, POLE_PAIRS, MARGIN = 80.0, 50.0, 0.5
INERTIA = RATIO**2 * (4.0e-4 + 1.76e-4)  # at the joint


def motor_allows(qd: Array) -> Array:
    """Joint torque [Nm] that the motor drives at a joint speed [rad/s], its margin kept."""
    w, peak = RATIO * np.abs(qd), np.sqrt(2.0) * CURRENT
    needed = np.sqrt((RESISTANCE * peak + RUNNING / peak * w) ** 2 + (POLE_PAIRS * w * INDUCTANCE * peak) ** 2)
    torque = RUNNING * np.minimum(1.0, VOLTAGE / needed)
    return np.maximum(torque / (1.0 + MARGIN) - NO_LOAD, 0.0) * RATIO * EFFICIENCY


def times(motion: Motion, step: float) -> Array:
    """Equal times, and either side of every jump."""
    breaks, end = np.asarray(motion.law.s.x), motion.duration
    inner = np.concatenate([breaks - 1e-9 * end, breaks + 1e-9 * end])
    grid = np.linspace(0.0, end, int(np.ceil(end / step)) + 1)
    return np.unique(np.concatenate([grid, inner[(inner > 0.0) & (inner < end)]]))


def ratios(boom: Boom, q: Array, qd: Array, qdd: Array) -> dict[str, Array]:
    """(n, 5) ratios to the limits of velocity, acceleration, gearbox and motor."""
    tau = inverse_dynamics(boom, q, qd, qdd, friction=True, reactions=False).tau
    gear, motor = np.zeros_like(tau), np.zeros_like(tau)
    for i in DRIVEN:
        gear[:, i] = np.abs(tau[:, i]) / START_STOP
        motor[:, i] = np.abs(tau[:, i] + EFFICIENCY * INERTIA * qdd[:, i]) / motor_allows(qd[:, i])
    limits = boom.limits
    return {
        "velocity": np.abs(qd) / limits.velocity,
        "acceleration": np.abs(qdd) / limits.acceleration,
        "gearbox torque": gear,
        "motor torque": motor,
    }


def worst(boom: Boom, motion: Motion, step: float = 5e-4, jerk: bool = False) -> dict[str, float]:
    """The largest ratio to each limit, and how far a position limit is exceeded."""
    q, qd, qdd, qddd = motion(times(motion, step))
    limits = boom.limits
    found = {name: float(each.max()) for name, each in ratios(boom, q, qd, qdd).items()}
    if jerk:
        found["jerk"] = float((np.abs(qddd) / limits.jerk).max())
    outside = max((limits.lower - q).max(), (q - limits.upper).max(), (q[:, 1] + np.radians(5.0) - q[:, 2]).max())
    return found | {"outside": float(outside)}


def held(boom: Boom, q: Array) -> float:
    """The largest ratio of merely holding the load at q (n, 5) to what a drive allows at rest."""
    still = np.zeros_like(q)
    tau = np.abs(inverse_dynamics(boom, q, still, still, reactions=False).tau[:, DRIVEN])
    return float((tau / min(START_STOP, float(motor_allows(np.zeros(1))[0]))).max())


def random_pairs(boom: Boom, count: int, seed: int) -> list[Array]:
    """(2, 5) start and goal, uniform within the position limits."""
    rng, limits, found = np.random.default_rng(seed), boom.limits, []
    while len(found) < count:
        pair = rng.uniform(limits.lower, limits.upper, (2, 5))
        if limits.contain(pair).all():
            found.append(pair)
    return found
