"""Unknowns of an identification: inertial parameters, drive inertia, friction, in comparable units.

    tau = Y(q, qd, qdd) pi + J qdd + viscous qd + coulomb sign(qd) + asymmetric

The figures of the boom's file are the starting point x = 0. For a body with pseudo-inertia P0, mass
m and R = P0 + m r^2 on the diagonal of its second moments,

    P(x) = P0 + s R^(1/2) D(x) R^(1/2)

D is symmetric with entries x (those off the diagonal divided by sqrt(2)), so that x of length 1
means a change of s = 30 % in mass, or of some 15 mm in a thin body's centre of mass (r = 50 mm).
This is the distance to which Lee and Park's metric (2018) tends for small changes.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from boom_model import JOINTS, Boom
from boom_model.arrays import Array, Mask
from boom_model.dynamics.regressor import (
    PARAMETER_NAMES,
    REGRESSOR_BODIES,
    body_parameters,
    parameters_of_pseudo_inertia,
    pseudo_inertia,
    regressor,
)
from planner.experiments.readings import Readings

IDENTIFIED_BODIES = REGRESSOR_BODIES[:-1]
"""Bodies whose parameters are unknown. The payload moves with the end effector and must be known.
"""

SPREAD = 0.3
"""Relative standard deviation s that the figures of the boom's file are given. This is our own
choice."""

_RADIUS = 0.05  # [m]
_LEAST_MASS = 1e-3  # [kg]
_KINDS = ("viscous", "coulomb", "asymmetric")
_UPPER = np.triu_indices(4)


@dataclass(frozen=True, eq=False)
class Unknowns:
    """Unknowns p = p0 + T x: 70 inertial parameters, 5 drive inertias and 3 x 5 of friction."""

    boom: Boom
    drive_inertia: bool
    """Whether the torques accelerate the drives' own inertia."""
    torque_scale: Array
    """(5,) standard deviation that friction is given [Nm, N]"""

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the entries of p."""
        return (
            *(f"{body}.{name}" for body in IDENTIFIED_BODIES for name in PARAMETER_NAMES),
            *(f"{joint}.drive_inertia" for joint in JOINTS),
            *(f"{joint}.{kind}" for kind in _KINDS for joint in JOINTS),
        )

    @cached_property
    def start(self) -> Array:
        """p0 (90,): the figures of the boom's file."""
        friction = self.boom.friction
        return np.concatenate(
            [
                *(body_parameters(self.boom.bodies[name]) for name in IDENTIFIED_BODIES),
                self.boom.drive_inertia if self.drive_inertia else np.zeros(5),
                friction.viscous,
                friction.coulomb,
                friction.asymmetric,
            ]
        )

    @cached_property
    def metric(self) -> tuple[Array, Array]:
        """P0 and R^(1/2) of each body, (7, 4, 4) each."""
        P = np.stack([pseudo_inertia(self.boom.bodies[name]) for name in IDENTIFIED_BODIES])
        R = P.copy()
        mass = np.maximum(P[:, 0, 0], _LEAST_MASS)
        R[:, 0, 0] = mass
        R[:, [1, 2, 3], [1, 2, 3]] += (mass * _RADIUS**2)[:, None]
        values, vectors = np.linalg.eigh(R)
        return P, (vectors * np.sqrt(values)[:, None, :]) @ np.swapaxes(vectors, -1, -2)

    @cached_property
    def transform(self) -> Array:
        """T (90, 90)."""
        T = np.zeros((90, 90))
        for k, root in enumerate(self.metric[1]):
            changes = SPREAD * root @ symmetric(np.eye(10)) @ root
            T[10 * k : 10 * k + 10, 10 * k : 10 * k + 10] = parameters_of_pseudo_inertia(changes).T
        rotors = np.maximum(SPREAD * self.start[70:75], 0.1 * self.torque_scale)
        T[70:75, 70:75] = np.diag(rotors if self.drive_inertia else np.zeros(5))
        speed = self.boom.limits.velocity
        T[75:, 75:] = np.diag(np.concatenate([self.torque_scale / speed, self.torque_scale, self.torque_scale]))
        return T

    def rows(self, q: Array, qd: Array, qdd: Array, direction: Array | None = None) -> Array:
        """Return the derivative (n, 5, 90) of tau by p at states (n, 5).

        `direction` replaces sign(qd).
        """
        rows = np.zeros((len(q), 5, 90))
        rows[..., :70] = regressor(self.boom, q, qd, qdd)[..., :70]
        joint = np.arange(5)
        rows[:, joint, 70 + joint] = qdd
        rows[:, joint, 75 + joint] = qd
        rows[:, joint, 80 + joint] = np.sign(qd) if direction is None else direction
        rows[:, joint, 85 + joint] = 1.0
        return rows

    def torque(self, p: Array, readings: Readings) -> Array:
        """Return the torque (n, 5) of parameters p (90,), with that of the known payload."""
        states = (readings.q, readings.qd, readings.qdd)
        given = np.concatenate([p[:70], body_parameters(self.boom.payload)])
        tau: Array = regressor(self.boom, *states) @ given
        direction = np.sign(readings.qd)
        viscous, coulomb, asymmetric = p[75:].reshape(3, 5)
        return tau + p[70:75] * readings.qdd + viscous * readings.qd + coulomb * direction + asymmetric

    def payload_rows(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Return the derivative (n, 5, 10) of tau by the payload's parameters at states (n, 5)."""
        return regressor(self.boom, q, qd, qdd)[..., 70:]

    @cached_property
    def active(self) -> Mask:
        """(90,) Whether an entry of x is unknown."""
        return np.asarray(np.diag(self.transform) != 0.0) | (np.arange(90) < 70)


def symmetric(x: Array) -> Array:
    """Return the symmetric matrices (..., 4, 4) with entries x (..., 10).

    Those off the diagonal are divided by sqrt(2).
    """
    x = np.asarray(x, dtype=float)
    D = np.zeros((*x.shape[:-1], 4, 4))
    D[..., _UPPER[0], _UPPER[1]] = x / np.where(_UPPER[0] == _UPPER[1], 1.0, np.sqrt(2.0))
    D[..., _UPPER[1], _UPPER[0]] = D[..., _UPPER[0], _UPPER[1]]
    return D
