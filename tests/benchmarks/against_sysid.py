"""`identify` side by side with MuJoCo's own `mujoco.sysid`, on the same log and the exported model.

Run it by hand, after `pip install "mujoco[sysid]"`:
`python -m tests.benchmarks.against_sysid [SEED ITERATIONS]`.

MuJoCo's toolbox fits positions of simulated motions: the log is cut into parts of 0.1 s that start
from its filtered states. It gets the same unknowns: pseudo-inertias of all bodies, drive inertia,
viscous and dry friction. It has no friction that differs between directions, so the true boom has
none here.
"""

import sys
import time
from dataclasses import replace
from typing import NamedTuple

import mujoco
import numpy as np
from mujoco import sysid

from boom_model import JOINTS, Boom
from boom_model.arrays import Array, read_only
from boom_model.boom import Body
from boom_model.dynamics.regressor import body_parameters
from planner.experiments.identification import HELD_OUT, identify
from planner.experiments.readings import Readings, readings_of
from planner.experiments.unknowns import IDENTIFIED_BODIES, Unknowns
from planner.exports.robot_models import mjcf
from tests.builders import without_drives
from tests.oracles import tree_matrix
from tests.virtual_boom import TORQUE_NOISE, experiment, fourier, perturbed, true_parameters

DURATION, PART = 10.0, 0.1
DAMPING, DRY, ARMATURE = np.array([10.0, 10.0, 10.0, 25.0, 0.3]), np.array([8.0, 8.0, 8.0, 10.0, 0.5]), np.full(5, 3.0)
"""Where MuJoCo's fit begins: of the right order, because it starts at no bound."""


def spec_of(boom: Boom) -> mujoco.MjSpec:
    """The exported model with a sensor of each joint's position, as the log has."""
    spec = mujoco.MjSpec.from_string(mjcf(boom))
    for name in JOINTS:
        joint = spec.joint(name)
        joint.limited = mujoco.mjtLimited.mjLIMITED_FALSE
        joint.solref_friction, joint.solimp_friction = [2e-3, 1.0], [0.99, 0.99, 0.001, 0.5, 2.0]
        spec.add_sensor(
            name=f"{name}_position", type=mujoco.mjtSensor.mjSENS_JOINTPOS, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=name
        )
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    return spec


def put_body(spec: mujoco.MjSpec, param: sysid.Parameter) -> None:
    """Set a body by its pseudo-inertia's parameters.

    The toolbox's own way leaves this model without inertia (MuJoCo 4.0.0).
    """
    body = spec.body(param.name.removesuffix("_inertia"))
    pi = sysid.model_modifier.pi_from_theta(param.value)
    com, about_frame = pi[1:4] / pi[0], pi[4:].reshape(3, 3)
    values, axes = np.linalg.eigh(about_frame - pi[0] * (com @ com * np.eye(3) - np.outer(com, com)))
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, axes.ravel())
    body.mass, body.ipos, body.inertia, body.iquat = pi[0], com, values, quaternion


def unknowns_of(spec: mujoco.MjSpec) -> sysid.ParameterDict:
    """The unknown parameters, with the nominal boom's figures where it has them."""
    params, model = sysid.ParameterDict(), spec.copy().compile()
    for body in IDENTIFIED_BODIES:
        params.add(sysid.body_inertia_param(spec, model, body, sysid.InertiaType.Pseudo, modifier=put_body))
    for kind, start in (("damping", DAMPING), ("frictionloss", DRY), ("armature", ARMATURE)):
        for name, value in zip(JOINTS, start, strict=True):

            def put(s: mujoco.MjSpec, p: sysid.Parameter, name: str = name, kind: str = kind) -> None:
                setattr(s.joint(name), kind, np.full(3, p.value[0])[:, None] if kind == "damping" else p.value[0])

            params.add(sysid.Parameter(f"{name}_{kind}", value, 0.0, 10.0 * value, modifier=put))
    return params


def sequences(boom: Boom, spec: mujoco.MjSpec, log: Readings, tau: Array) -> sysid.ModelSequences:
    """The seen part of the log as motions of PART seconds each."""
    model, G = spec.copy().compile(), tree_matrix(boom)
    count, states, controls, sensors = round(PART / log.step), [], [], []
    for first in range(0, round((1.0 - HELD_OUT) * len(log.t)) - count, count):
        part = slice(first, first + count)
        t = np.arange(count) * log.step
        states.append(sysid.create_initial_state(model, G @ log.q[first], G @ log.qd[first]))
        controls.append(sysid.TimeSeries(t, tau[part]))
        sensors.append(sysid.TimeSeries.from_names(t, log.q[part], model))
    names = [f"part {i}" for i in range(len(states))]
    return sysid.ModelSequences("boom", spec, names, states, controls, sensors)


def parameters_of(model: mujoco.MjModel) -> Array:
    """The parameters (90,) of `Unknowns` that a model of MuJoCo has."""
    rows = []
    for name in IDENTIFIED_BODIES:
        body, R = model.body(name), np.empty(9)
        mujoco.mju_quat2Mat(R, body.iquat)
        turned = R.reshape(3, 3) @ np.diag(body.inertia) @ R.reshape(3, 3).T
        rows.append(body_parameters(Body(float(body.mass[0]), read_only(body.ipos), read_only(turned))))
    dof = [model.joint(name).dofadr[0] for name in JOINTS]
    return np.concatenate([*rows, model.dof_armature[dof], model.dof_damping[dof], model.dof_frictionloss[dof], np.zeros(5)])


class Judge(NamedTuple):
    """What an identified boom is held against."""

    unknowns: Unknowns
    truth: Array
    """(90,) true parameters"""
    kept: Readings
    """held-out part of the log"""
    clean: Array
    """(n, 5) its torques without noise"""
    others: tuple[Array, Array, Array]
    """states of another motion"""

    def show(self, name: str, seconds: float, p: Array) -> None:
        """Print what the parameters p leave of the held-out torques, and their error elsewhere."""
        tau, used = self.unknowns.torque(p, self.kept), self.kept.moving
        left, wrong = (np.sqrt(((y - tau) ** 2 * used).sum(axis=0) / used.sum(axis=0)) for y in (self.kept.tau, self.clean))
        other = np.sqrt(np.mean((self.unknowns.rows(*self.others) @ (p - self.truth)) ** 2, axis=0))
        print(f"{name}: {seconds:.1f} s of one core; held-out torque RMS / noise {np.round(left / TORQUE_NOISE, 3)}")
        print(f"  off the true torque by {np.round(wrong, 2)} Nm, N; on another motion by {np.round(other, 2)}", flush=True)


def main(seed: int, iterations: int) -> None:
    """Print time and error of both."""
    nominal, rng = without_drives(Boom.load()).with_payload(0.0), np.random.default_rng(seed)
    truth = perturbed(nominal, rng)
    truth = replace(truth, friction=replace(truth.friction, asymmetric=read_only(np.zeros(5))))
    made = experiment(nominal, truth, fourier(nominal, rng), DURATION, rng)
    log = readings_of(made.log)
    first = int(np.searchsorted(made.log.t, log.t[0] - 1e-9))
    kept = log.part(slice(round((1.0 - HELD_OUT) * len(log.t)), None))
    clean = made.clean[first : first + len(log.t)][-len(kept.t) :]
    begun = time.process_time()
    found = identify(nominal, [log], drive_inertia=True)
    judge = Judge(found.unknowns, true_parameters(truth), kept, clean, fourier(nominal, rng)(np.linspace(0.0, 10.0, 1000)))
    judge.show("identify", time.process_time() - begun, found.parameters)

    spec = spec_of(nominal)
    params = unknowns_of(spec)
    fit = sysid.build_residual_fn(models_sequences=[sequences(nominal, spec, log, log.tau)], n_threads=1)
    judge.show("the file", 0.0, found.unknowns.start)
    begun = time.process_time()
    best, result = sysid.optimize(params, fit, optimizer="mujoco", verbose=False, max_iters=iterations)
    taken, model = time.process_time() - begun, sysid.apply_param_modifiers(best, spec)
    judge.show(f"mujoco.sysid, {iterations} iterations", taken, parameters_of(model))
    print(f"rank of its Jacobian: {np.linalg.matrix_rank(np.asarray(result.jac))} of {result.jac.shape[1]} columns")


if __name__ == "__main__":
    main(*(int(word) for word in (sys.argv[1:3] if len(sys.argv) > 2 else ("1", "5"))))
