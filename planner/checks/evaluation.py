"""States and loads of a motion on one grid. Certificate, checks and reports read them from here."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from boom_model import BaseMotion, Basis, Boom, InputError, Loads, gravity_torque, inverse_dynamics, mass_matrix
from boom_model.arrays import Array
from boom_model.dynamics.newton_euler import PayloadAs
from planner.checks.drives.joint_view import Shock
from planner.motion.planned import SHOCK_SAMPLES, PlannedMotion
from planner.motion.trajectory import Trajectory
from planner.motion.vehicle import LEVEL, VehicleCase
from planner.timing.limit_ratios import Limit, limit_ratios

INERTIA_POSES = 1000
"""Number of evenly spread poses of a motion at which the mass matrix is computed."""


@dataclass(frozen=True, eq=False)
class Evaluation:
    """States and loads of a motion at times t (n,). Loads include the joints' known friction."""

    boom: Boom
    trajectory: Trajectory
    """States on the grid: the fine grid of a planned motion, or the samples of a sampled one."""
    planned: PlannedMotion | None
    """Continuous motion; None if only samples are known."""
    vehicle: VehicleCase
    payload_as: PayloadAs
    base: BaseMotion | None
    """Motion of the vehicle under the boom; None at rest on level ground."""
    loads: Loads

    @property
    def t(self) -> Array:
        """Times (n,) [s]."""
        return self.trajectory.t

    @property
    def tau(self) -> Array:
        """Joint torques (n, 5) [Nm], a force [N] at the extension."""
        return self.loads.tau

    @cached_property
    def static(self) -> Array:
        """Static torque (n, 5) at each pose on the tilted base, without friction."""
        tilt = None if self.base is None else BaseMotion.of(up=self.base.up)
        return gravity_torque(self.boom, self.trajectory.q, base=tilt)

    @cached_property
    def inertia(self) -> Array:
        """Mass matrix (m, 5, 5) at up to INERTIA_POSES poses, without the drives' own inertia."""
        count = len(self.t)
        poses = np.unique(np.linspace(0, count - 1, min(count, INERTIA_POSES)).astype(int))
        return mass_matrix(self.boom, self.trajectory.q[poses])

    @cached_property
    def friction(self) -> Array:
        """Part of the torques (n, 5) that overcomes friction."""
        return self.boom.friction.torque(self.trajectory.qd)

    @cached_property
    def ratios(self) -> dict[Limit, Array]:
        """Demand divided by limit (n, 5), for each limit."""
        motion = self.trajectory
        return limit_ratios(self.boom, motion.q, motion.qd, motion.qdd, motion.qddd, self.tau)

    @cached_property
    def shock(self) -> Shock | None:
        """Shock of the vehicle, with the torques without it; None if the vehicle has no shock."""
        vehicle, t = self.vehicle, self.t
        if vehicle.peak == 0.0:
            return None
        undisturbed = _loads(self.boom, self.trajectory, replace(vehicle, peak=0.0).base(t), self.payload_as, reactions=False)
        start, end = vehicle.shock_start, vehicle.shock_start + vehicle.shock_duration
        inside = (t >= start) & (t <= end)
        resolved = bool(t[0] <= start and end <= t[-1] and inside.sum() >= SHOCK_SAMPLES)
        return Shock(undisturbed.tau, resolved, inside, vehicle.shock_duration, vehicle.shock_events)

    @property
    def basis(self) -> Basis:
        """Weakest basis of the figures that all torques depend on.

        These are the figures of the bodies and of a vehicle that is not at rest. A body without a
        basis counts as printed.
        """
        bodies = [Basis.PRINTED if body.origin is None else body.origin.basis for body in self.boom.bodies.values()]
        return Basis.weakest(bodies if self.vehicle is LEVEL else [*bodies, self.vehicle.origin.basis])


def evaluate(
    boom: Boom,
    motion: PlannedMotion | Trajectory,
    *,
    vehicle: VehicleCase = LEVEL,
    payload_as: PayloadAs = "mass",
    reactions: bool = True,
) -> Evaluation:
    """Return states and loads of a motion on one grid.

    A planned motion, or a trajectory sampled from one, is evaluated on the plan's fine grid. Any
    other trajectory is evaluated at its samples.

    Args:
        boom: the boom.
        motion: the planned motion or the samples.
        vehicle: motion of the vehicle under the boom.
        payload_as: see `inverse_dynamics`.
        reactions: see `inverse_dynamics`.

    Raises:
        InputError: as `inverse_dynamics`, or a torque is not finite because a state is too large.
            The message names the sample.
    """
    if isinstance(motion, Trajectory) and motion.planned is not None:
        motion = motion.planned
    if isinstance(motion, Trajectory):
        return at_samples(boom, motion, vehicle=vehicle, payload_as=payload_as, reactions=reactions)
    fine = motion.fine(vehicle)
    return at_samples(boom, fine, vehicle=vehicle, payload_as=payload_as, reactions=reactions, planned=motion)


def at_samples(
    boom: Boom,
    trajectory: Trajectory,
    *,
    vehicle: VehicleCase = LEVEL,
    payload_as: PayloadAs = "mass",
    reactions: bool = True,
    planned: PlannedMotion | None = None,
) -> Evaluation:
    """Return states and loads at the trajectory's own samples, even if a plan is behind them.

    Args:
        boom: the boom.
        trajectory: the samples.
        vehicle: motion of the vehicle under the boom.
        payload_as: see `inverse_dynamics`.
        reactions: see `inverse_dynamics`.
        planned: the continuous motion behind the samples.

    Raises:
        InputError: as `evaluate`.
    """
    base = vehicle.base(trajectory.t)
    loads = _loads(boom, trajectory, base, payload_as, reactions)
    return Evaluation(boom, trajectory, planned, vehicle, payload_as, base, loads)


def _loads(boom: Boom, trajectory: Trajectory, base: BaseMotion | None, payload_as: PayloadAs, reactions: bool) -> Loads:
    states = (trajectory.q, trajectory.qd, trajectory.qdd)
    with np.errstate(over="ignore", invalid="ignore"):
        loads = inverse_dynamics(boom, *states, base=base, payload_as=payload_as, friction=True, reactions=reactions)
    finite = np.isfinite(loads.tau).all(axis=-1)
    if not finite.all():
        at = int(np.argmin(finite))
        raise InputError(f"sample {at}, t = {trajectory.t[at]:g} s: torques are not finite because the state is too large")
    return loads
