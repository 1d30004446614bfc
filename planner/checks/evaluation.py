"""One evaluation of a motion: its states and loads on one grid, which certificate, checks and reports read."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from boom_model import BaseMotion, Basis, Boom, InputError, Loads, inverse_dynamics, mass_matrix
from boom_model.arrays import Array
from boom_model.dynamics.newton_euler import PayloadAs
from planner.checks.drives.joint_view import Shock
from planner.motion.planned import SHOCK_SAMPLES, PlannedMotion
from planner.motion.trajectory import Trajectory
from planner.motion.vehicle import LEVEL, VehicleCase
from planner.timing.limit_ratios import Limit, limit_ratios

INERTIA_POSES = 1000
"""Poses of a motion, evenly spread, at which its inertia is looked at."""


@dataclass(frozen=True, eq=False)
class Evaluation:
    """States and loads of a motion at times t (n,), with the joints' friction where it is known."""

    boom: Boom
    trajectory: Trajectory
    """The grid: a planned motion's own fine one, or a sampled motion's samples."""
    planned: PlannedMotion | None
    """The continuous motion; None where only samples are known."""
    vehicle: VehicleCase
    payload_as: PayloadAs
    base: BaseMotion | None
    """How the vehicle moves the base; None at rest on level ground."""
    loads: Loads

    @property
    def t(self) -> Array:
        return self.trajectory.t

    @property
    def tau(self) -> Array:
        """(n, 5) joint torques."""
        return self.loads.tau

    @cached_property
    def static(self) -> Array:
        """(n, 5) torque that holds each pose on the tilted base, without friction."""
        still = np.zeros(5)
        tilt = None if self.base is None else BaseMotion.of(up=self.base.up)
        q = self.trajectory.q
        return inverse_dynamics(self.boom, q, still, still, base=tilt, payload_as=self.payload_as, reactions=False).tau

    @cached_property
    def inertia(self) -> Array:
        """(m, 5, 5) mass matrix at up to INERTIA_POSES of the poses; the drives' own inertia is left out."""
        count = len(self.t)
        poses = np.unique(np.linspace(0, count - 1, min(count, INERTIA_POSES)).astype(int))
        return mass_matrix(self.boom, self.trajectory.q[poses])

    @cached_property
    def friction(self) -> Array:
        """(n, 5) the part of the torques that overcomes friction."""
        return self.boom.friction.torque(self.trajectory.qd)

    @cached_property
    def ratios(self) -> dict[Limit, Array]:
        """Demand over limit (n, 5) by limit."""
        motion = self.trajectory
        return limit_ratios(self.boom, motion.q, motion.qd, motion.qdd, motion.qddd, self.tau)

    @cached_property
    def shock(self) -> Shock | None:
        """The vehicle's shock, what the joints bear without it, and whether the grid sees it; None without a shock."""
        vehicle, t = self.vehicle, self.t
        if vehicle.peak == 0.0:
            return None
        calm = _loads(self.boom, self.trajectory, replace(vehicle, peak=0.0).base(t), self.payload_as, reactions=False)
        start, end = vehicle.shock_start, vehicle.shock_start + vehicle.shock_duration
        inside = (t >= start) & (t <= end)
        resolved = bool(t[0] <= start and end <= t[-1] and inside.sum() >= SHOCK_SAMPLES)
        return Shock(calm.tau, resolved, inside, vehicle.shock_duration, vehicle.shock_events)

    @property
    def basis(self) -> Basis:
        """How far the vehicle's figures behind the torques can be trusted."""
        return self.vehicle.origin.basis


def evaluate(
    boom: Boom,
    motion: PlannedMotion | Trajectory,
    *,
    vehicle: VehicleCase = LEVEL,
    payload_as: PayloadAs = "mass",
    reactions: bool = True,
) -> Evaluation:
    """States and loads of a motion, on one grid.

    A planned motion, or a trajectory sampled from one, is evaluated on the plan's fine grid; any other at its samples.

    Args:
        vehicle: what the vehicle does meanwhile.
        payload_as, reactions: see `inverse_dynamics`.

    Raises:
        InputError: as `inverse_dynamics`, or a load is not finite because a state is absurdly large; the sample is named.
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
    """`evaluate` at the trajectory's own samples, for what is shown or written at them."""
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
        raise InputError(f"sample {at}, t = {trajectory.t[at]:g} s: its torques are not finite; its state is too large")
    return loads
