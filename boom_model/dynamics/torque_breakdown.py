"""Contributions of gravity, inertia, velocity, payload, friction and vehicle to joint torques."""

from dataclasses import dataclass, fields
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array, broadcast
from boom_model.boom import Boom
from boom_model.dynamics.base_motion import BaseMotion
from boom_model.dynamics.equations_of_motion import velocity_torque
from boom_model.dynamics.newton_euler import PayloadAs, inverse_dynamics


@dataclass(frozen=True, eq=False)
class Breakdown:
    """Parts of the joint torques, each (..., 5) [Nm, N for the extension].

    Their sum is `inverse_dynamics(...).tau`.
    """

    gravity: Array
    """Torque against the weight of the bodies, without payload."""
    inertia: Array
    """Torque that accelerates the bodies from rest, without payload."""
    velocity: Array
    """Coriolis and centrifugal torque of the bodies, without payload."""
    payload: Array
    """Everything that the payload adds."""
    friction: Array
    vehicle: Array
    """Everything that tilt and motion of the base add, with the payload."""

    @property
    def total(self) -> Array:
        """Sum of the parts."""
        total: Array = np.sum([getattr(self, field.name) for field in fields(self)], axis=0)
        return total


@lru_cache(maxsize=16)
def _empty(boom: Boom) -> Boom:
    """Return the boom without payload, always the same one: its regrouped masses are kept too."""
    return boom.with_payload(0.0)


def breakdown(
    boom: Boom,
    q: ArrayLike,
    qd: ArrayLike,
    qdd: ArrayLike,
    *,
    base: BaseMotion | None = None,
    payload_as: PayloadAs = "mass",
    friction: bool = False,
) -> Breakdown:
    """Split each joint's torque into parts that add up to `inverse_dynamics` of the same arguments.

    Raises:
        InputError: as `inverse_dynamics`.
    """
    q, qd, qdd = broadcast(q=q, qd=qd, qdd=qdd)
    empty = _empty(boom)

    def tau(of: Boom, on: BaseMotion | None) -> Array:
        return inverse_dynamics(of, q, qd, qdd, base=on, payload_as=payload_as, reactions=False).tau

    bare, still = tau(empty, None), tau(boom, None)
    zero = np.zeros_like(bare)
    # Rounded as `bare`, so that rest leaves 0.
    gravity = inverse_dynamics(empty, q, zero, zero, reactions=False).tau
    velocity = velocity_torque(empty, q, qd)
    return Breakdown(
        gravity=gravity,
        inertia=bare - gravity - velocity,
        velocity=velocity,
        payload=still - bare,
        friction=boom.friction.torque(qd) if friction else zero,
        vehicle=zero if base is None else tau(boom, base) - still,
    )
