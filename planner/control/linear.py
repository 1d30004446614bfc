"""Linearisation of the plant, x' = A x + B u, with exact derivatives of the model."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from boom_model import InputError, inverse_dynamics, mass_matrix
from boom_model.arrays import Array, broadcast
from planner.control.plant import Plant, compliance, jacobian, tangent_stiffness


@dataclass(frozen=True, eq=False)
class Linear:
    """Linear model x' = A x + B u.

    x (n,) has the deviations of q, qd, theta and thetad, n = 10 + 2 m. u (5,) has the deviations of
    the drive torques.
    """

    A: Array
    """(n, n) system matrix."""
    B: Array
    """(n, 5) input matrix."""
    measured: Array
    """(5, n) output matrix of the encoders: theta at an elastic joint, q elsewhere."""


def linearise(plant: Plant, q: ArrayLike, qd: ArrayLike | None = None, qdd: ArrayLike | None = None) -> Linear:
    """Linearise the plant about a state of its links. Coulomb friction is left out.

    With r = `inverse_dynamics`, M dqdd = dtau - dr/dq dq - dr/dqd dqd at the state's own qdd. The
    derivatives of r are central differences of sixth order with a step of 0.01. Because r is a sum
    of sines and polynomials, their relative error is some 1e-12. An elastic joint has the tangent
    stiffness at the torque of the state.

    Args:
        plant: the plant.
        q: joint position (5,).
        qd: joint velocity (5,); None is 0.
        qdd: joint acceleration (5,); None is 0.

    Raises:
        InputError: an input is not finite or not (5,).
    """
    q, qd, qdd = broadcast(q=q, qd=np.zeros(5) if qd is None else qd, qdd=np.zeros(5) if qdd is None else qdd)
    if q.shape != (5,):
        raise InputError(f"state of the linearisation has shape {q.shape}; it must be (5,)")
    boom, E, m = plant.boom, list(plant.elastic), len(plant.elastic)

    def torque(x: Array) -> Array:
        return inverse_dynamics(boom, x[..., :5], x[..., 5:], qdd, reactions=False).tau

    by_state = -jacobian(torque, np.concatenate([q, qd]))
    by_state[:, 5:] -= np.diag(boom.friction.viscous)
    n = 10 + 2 * m
    motor, motor_d = 10 + np.arange(m), 10 + m + np.arange(m)
    forces = np.zeros((5, n))  # forces on the links, derivative with respect to x
    forces[:, :10] = by_state
    inputs = np.eye(5)
    A, B = np.zeros((n, n)), np.zeros((n, 5))
    A[:5, 5:10] = np.eye(5)
    if E:
        load = (torque(np.concatenate([q, qd])) + boom.friction.viscous * qd)[E]
        K, c = tangent_stiffness(plant, q, load), plant.damping
        _, C_4 = compliance(plant, q)
        C_44 = jacobian(lambda x: compliance(plant, _extended(q, x))[1], q[3:4], 1e-3)[:, 0]
        passed = np.zeros((m, n))  # T_s + c (thetad - qd), derivative with respect to x
        rows = np.arange(m)
        passed[rows, motor], passed[rows, E] = K, -K
        passed[rows, 3] -= K * load * C_4
        passed[rows, motor_d] = c
        passed[rows, 5 + np.array(E)] = -c
        forces[E] += passed
        spring = passed.copy()
        spring[:, 5:10], spring[:, motor_d] = 0.0, 0.0
        forces[3] += (load * C_4) @ spring
        forces[3, 3] += 0.5 * load**2 @ C_44
        inputs[E, E] = 0.0
        A[motor, motor_d] = 1.0
        A[motor_d] = -passed / plant.rotor[E][:, None]
        B[motor_d, E] = 1.0 / plant.rotor[E]
    M = mass_matrix(boom, q) + plant.rigid_inertia
    A[5:10], B[5:10] = np.linalg.solve(M, forces), np.linalg.solve(M, inputs)
    measured = np.eye(5, n)
    measured[E] = 0.0
    measured[E, motor] = 1.0
    return Linear(A, B, measured)


def _extended(q: Array, extension: Array) -> Array:
    """Return q (..., 5) with its extension replaced by `extension` (..., 1)."""
    moved = np.broadcast_to(q, (*extension.shape[:-1], 5)).copy()
    moved[..., 3] = extension[..., 0]
    return moved
