"""A boom that only MuJoCo knows: bodies off by up to 10 %, friction, a loop closed by a constraint,
and noisy sensors."""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import mujoco
import numpy as np

from boom_model import JOINTS, Boom, inverse_dynamics
from boom_model.arrays import Array, read_only
from boom_model.boom import Body, Friction
from boom_model.dynamics.regressor import body_parameters
from planner.experiments.comparison import Log
from planner.experiments.unknowns import IDENTIFIED_BODIES
from planner.exports.robot_models import mjcf
from tests.oracles import tree_matrix

POSITION_NOISE = np.radians(0.01)
"""[rad]; the extension's is as many metres"""
TORQUE_NOISE = 1.0
DRIVE_INERTIA = np.array([5.0, 5.0, 5.0, 15.0, 0.1])
"""[kg m^2, the extension's kg]"""
STEP = 1e-3
_SUBSTEPS = 4
_FREQUENCY = 25.0  # [rad/s] of the controller
_VISCOUS, _DRY = np.array([20.0, 20.0, 20.0, 50.0, 0.5]), np.array([15.0, 15.0, 15.0, 20.0, 1.0])


def true_parameters(truth: Boom) -> Array:
    """The parameters (90,) of `Unknowns` that the experiment has."""
    bodies = [body_parameters(truth.bodies[name]) for name in IDENTIFIED_BODIES]
    friction = truth.friction
    return np.concatenate([*bodies, DRIVE_INERTIA, friction.viscous, friction.coulomb, friction.asymmetric])


Motion = Callable[[Array], tuple[Array, Array, Array]]
"""t (n,) to q, qd, qdd (n, 5)."""


class Experiment(NamedTuple):
    """What was measured, and the truth."""

    log: Log
    truth: Boom
    clean: Array
    """(n, 5) torques without noise"""


def perturbed(boom: Boom, rng: np.random.Generator) -> Boom:
    """The boom with masses, first moments and second moments off by up to 10 %, and
    with friction."""

    def off(body: Body) -> Body:
        mass = body.mass * rng.uniform(0.9, 1.1)
        com = body.com * rng.uniform(0.9, 1.1, 3)
        return Body(mass, read_only(com), read_only(body.inertia * rng.uniform(0.9, 1.1)))

    dry = _DRY * rng.uniform(0.5, 1.0, 5)
    friction = Friction(
        read_only(_VISCOUS * rng.uniform(0.2, 1.0, 5)), read_only(dry), (None,) * 5, read_only(dry * rng.uniform(-0.3, 0.3, 5))
    )
    bodies = {name: off(body) for name, body in boom.bodies.items()}
    return replace(boom, bodies=bodies, friction=friction, drives=(None,) * 5)


def experiment(nominal: Boom, truth: Boom, motion: Motion, duration: float, rng: np.random.Generator) -> Experiment:
    """Run a motion on the true boom under a controller that knows the nominal one, and log it at 1
    kHz.

    The log holds the position at each step and the torque that acted from there on. MuJoCo's
    integrator makes the second difference of the positions the acceleration under that torque.
    """
    model = mujoco.MjModel.from_xml_string(mjcf(truth))
    model.opt.timestep = h = STEP / _SUBSTEPS
    model.dof_armature[[model.joint(name).dofadr[0] for name in JOINTS]] = DRIVE_INERTIA
    model.dof_solref[:], model.dof_solimp[:] = (2.0 * h, 1.0), (0.99, 0.99, 0.001, 0.5, 2.0)  # dry friction is stiff
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    model.jnt_limited[:] = 0
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data = mujoco.MjData(model)
    at = np.array([model.joint(name).qposadr[0] for name in JOINTS])
    dof = np.array([model.joint(name).dofadr[0] for name in JOINTS])
    count = round(duration / STEP)
    t = np.arange(count) * STEP
    wanted = motion(np.arange(count * _SUBSTEPS) * h)
    feed = inverse_dynamics(nominal, *wanted, reactions=False).tau
    M = np.array([60.0, 40.0, 15.0, 20.0, 0.1])
    kp, kd = M * _FREQUENCY**2, 2.0 * M * _FREQUENCY
    G = tree_matrix(nominal)
    data.qpos[:], data.qvel[:] = G @ wanted[0][0], G @ wanted[1][0]
    q, applied = np.empty((count, 5)), np.empty((count, 5))
    for k in range(count * _SUBSTEPS):
        if k % _SUBSTEPS == 0:
            x, v = data.qpos[at], data.qvel[dof]
            tau = feed[k] + kp * (wanted[0][k] - x) + kd * (wanted[1][k] - v)
            q[k // _SUBSTEPS], applied[k // _SUBSTEPS] = x, tau
        data.qfrc_applied[dof] = tau - truth.friction.asymmetric
        mujoco.mj_step(model, data)
    noisy = q + POSITION_NOISE * rng.normal(size=q.shape)
    return Experiment(Log.of(t, noisy, tau=applied + TORQUE_NOISE * rng.normal(size=q.shape)), truth, applied)


def fourier(boom: Boom, rng: np.random.Generator, period: float = 10.0, harmonics: int = 4, size: float = 0.9) -> Motion:
    """A random periodic motion within the limits."""
    limits = boom.limits
    lower, upper = limits.lower.copy(), limits.upper.copy()
    lower[2] = 90.0 * np.pi / 180.0  # keeps lower - inner above its limit where inner stays below 80 deg
    upper[1] = 80.0 * np.pi / 180.0
    a, b = rng.normal(size=(2, harmonics, 5)) / np.arange(1, harmonics + 1)[:, None]
    w = 2.0 * np.pi / period * np.arange(1, harmonics + 1)

    def shape(t: Array) -> tuple[Array, Array, Array]:
        c, s = np.cos(np.outer(t, w)), np.sin(np.outer(t, w))
        return s @ a + c @ b, (c * w) @ a - (s * w) @ b, -(s * w**2) @ a - (c * w**2) @ b

    q, qd, qdd = shape(np.linspace(0.0, period, 500))
    middle, half = (q.max(axis=0) + q.min(axis=0)) / 2.0, np.ptp(q, axis=0) / 2.0
    scale = size * np.min(
        [(upper - lower) / 2.0 / half, limits.velocity / np.abs(qd).max(axis=0), limits.acceleration / np.abs(qdd).max(axis=0)],
        axis=0,
    )
    centre = (lower + upper) / 2.0

    def motion(t: Array) -> tuple[Array, Array, Array]:
        q, qd, qdd = shape(t)
        return centre + scale * (q - middle), scale * qd, scale * qdd

    return motion


def quintic(start: Array, goal: Array, duration: float) -> Motion:
    """A move from rest to rest."""

    def motion(t: Array) -> tuple[Array, Array, Array]:
        s = np.clip(t / duration, 0.0, 1.0)[:, None]
        shape = 10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5
        rate = (30.0 * s**2 - 60.0 * s**3 + 30.0 * s**4) / duration
        change = (60.0 * s - 180.0 * s**2 + 120.0 * s**3) / duration**2
        way = goal - start
        return start + way * shape, way * rate, way * change

    return motion
