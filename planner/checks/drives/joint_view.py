"""Motion and torques of one joint, as the drive checks read them."""

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
    """Shock of the vehicle during a motion."""

    tau_without_shock: Array
    """(n, 5) joint torques without the shock."""
    resolved: bool
    """Whether the shock lies within the motion and has enough samples to show its peak."""
    inside: Mask
    """(n,) whether each sample lies within the shock."""
    duration: float
    """[s]"""
    events: float | None
    """Number of shocks that a gearbox must survive; None if not given."""


@dataclass(frozen=True, eq=False)
class JointView:
    """Motion and torques (n,) of one joint. At a prismatic joint, torques are forces [N]."""

    joint: str
    is_length: bool
    trajectory: Trajectory
    duty: Duty
    tau: Array
    """Torque [Nm]."""
    tau_without_shock: Array
    """Torque without the vehicle's shock."""
    friction: Array
    """Part of `tau` that overcomes friction."""
    coulomb: float
    """Coulomb friction, which does not depend on the speed."""
    static: Array
    """Static torque at each pose, without friction."""
    inertia: Array
    """(m,) inertia at the joint with the others locked, at some poses [kg m^2], drive excluded."""
    index: int
    """Index of the joint."""
    basis: Basis
    """Basis of the torques."""
    steady: bool
    """Whether the base is at rest, level or tilted, so that the reversed motion can be checked."""

    @property
    def t(self) -> Array:
        """Times (n,) [s]."""
        return self.trajectory.t

    @property
    def qd(self) -> Array:
        """Joint velocity (n,)."""
        return self.trajectory.qd[:, self.index]

    @property
    def qdd(self) -> Array:
        """Joint acceleration (n,)."""
        return self.trajectory.qdd[:, self.index]

    def peak(self, values: Array) -> tuple[float, float]:
        """Return the largest absolute value of values (n,), and its time [s]."""
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
        """Return `rows.compared` for the joint. Its basis is at most that of the torques."""
        origin = self._weakened(origin)
        return compared(joint=self.joint, kind=kind, demand=demand, limit=limit, origin=origin, at=at, warn_near=warn_near)

    def informative(
        self, kind: CheckKind, *, figure: float | None, origin: Origin, at: float | None = None, limit: float | None = None
    ) -> Row:
        """Return `rows.informative` for the joint. Its basis is at most that of the torques."""
        return informative(joint=self.joint, kind=kind, figure=figure, origin=self._weakened(origin), at=at, limit=limit)

    def unknown(self, kind: CheckKind, *, why: str, demand: float | None = None, limit: float | None = None) -> Row:
        """Return `rows.unknown` for the joint."""
        return unknown(joint=self.joint, kind=kind, why=why, demand=demand, limit=limit)

    def _weakened(self, origin: Origin) -> Origin:
        """Return the origin with the weaker of its own basis and that of the torques."""
        basis = Basis.weakest((origin.basis, self.basis))
        return origin if basis is origin.basis else replace(origin, basis=basis)
