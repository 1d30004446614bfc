"""One joint of a motion, as the drive checks look at it."""

from dataclasses import dataclass, replace

import numpy as np

from boom_model import Basis, Origin
from boom_model.arrays import Array, Mask
from planner.checks.drives.duty import Duty
from planner.checks.kinds import CheckKind
from planner.checks.rows import Row, compared, informative, unknown
from planner.motion.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Shock:
    """A shock of the vehicle during a motion."""

    calm: Array
    """(n, 5) the joint torques without it."""
    resolved: bool
    """Whether it lies inside the motion, with enough samples to see its peak."""
    inside: Mask
    """(n,) the samples that it lasts for"""
    duration: float
    """[s]"""
    events: float | None
    """How many a gearbox is to survive; None where nobody says."""


@dataclass(frozen=True, eq=False)
class JointView:
    """One joint of a motion. Torques are forces [N] where the joint slides."""

    joint: str
    is_length: bool
    trajectory: Trajectory
    duty: Duty
    tau: Array
    calm: Array
    """tau without the vehicle's shock"""
    friction: Array
    """what friction has in tau"""
    coulomb: float
    """the part of it that does not go with the speed"""
    static: Array
    """what holds each pose, without friction"""
    inertia: Array
    """what turns with the joint at some poses of the motion, the other joints locked [kg m^2]; the drive's own left out"""
    index: int
    basis: Basis
    """of the torques themselves"""
    steady: bool
    """whether the base rests or is tilted at most, so that the motion can be run backwards"""

    @property
    def t(self) -> Array:
        return self.trajectory.t

    @property
    def qd(self) -> Array:
        return self.trajectory.qd[:, self.index]

    @property
    def qdd(self) -> Array:
        return self.trajectory.qdd[:, self.index]

    def peak(self, values: Array) -> tuple[float, float]:
        """The largest size of values (n,), and its time [s]."""
        at = int(np.argmax(np.abs(values)))
        return float(abs(values[at])), float(self.t[at])

    def compared(
        self,
        kind: CheckKind,
        *,
        demand: float,
        limit: float | None,
        origin: Origin,
        at: float | None = None,
        warn_near: bool = False,
    ) -> Row:
        """`rows.compared` of the joint; its basis is no better than the torque's."""
        founded = self._founded(origin)
        return compared(joint=self.joint, kind=kind, demand=demand, limit=limit, origin=founded, at=at, warn_near=warn_near)

    def informative(
        self, kind: CheckKind, *, figure: float | None, origin: Origin, at: float | None = None, limit: float | None = None
    ) -> Row:
        """`rows.informative` of the joint, likewise."""
        return informative(joint=self.joint, kind=kind, figure=figure, origin=self._founded(origin), at=at, limit=limit)

    def unknown(self, kind: CheckKind, *, why: str, demand: float | None = None, limit: float | None = None) -> Row:
        """`rows.unknown` of the joint."""
        return unknown(joint=self.joint, kind=kind, why=why, demand=demand, limit=limit)

    def _founded(self, origin: Origin) -> Origin:
        return replace(origin, basis=Basis.weakest([origin.basis, self.basis]))
