"""Poses worth measuring, by D-optimality.

With J_p the derivative of a pose's tip by the parameters, in standard deviations and tolerances,
the information of a set of poses is A = I + sum J_p^T J_p: what is known beforehand, and what the
poses add. The set of largest log det A is approached from random candidates, one pose after
another, and then by exchanging single poses while that helps (Fedorov 1972; Sun and Hollerbach,
"Observability index selection for robot calibration", 2008, index O1).
"""

from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from boom_model import Boom, InfeasibleError, InputError, forward_kinematics, gravity_torque
from boom_model.arrays import Array, read_only
from boom_model.drives.limits import static_limits
from boom_model.kinematics.linkage import directions
from boom_model.tip_uncertainty import printed_wind_up
from planner.experiments.calibration_model import BASE, TOLERANCE, TipModel, candidates
from planner.paths.clearance import require_clear

_TRIED = 4096  # joint positions from which the candidates are taken
_CANDIDATES = 800
_EXCHANGES = 200
_MOST = 500


@dataclass(frozen=True, eq=False)
class SuggestedPoses:
    """Poses to measure, in order of the yaw."""

    q: Array
    """(n, 5)"""
    names: tuple[str, ...]
    """Parameters that they are to tell."""
    sd: Array
    """(k,) expected standard deviation of the parameters, what is known beforehand included [SI]"""
    gain: float
    """Volume of the uncertainty, per parameter, of as many random poses over that of these."""


def suggest_poses(
    boom: Boom,
    count: int,
    *,
    tip_sd: float,
    known_frame: bool = False,
    lowest: float | None = None,
    measured: Array | None = None,
    seed: int = 0,
) -> SuggestedPoses:
    """Choose poses within the joint limits and the drives' static torque, clear of keep-out shapes.

    The linkage keeps its transmission angle above the boom's warning.

    Args:
        boom: the boom, with the payload of the measurement.
        count: number of poses.
        tip_sd: standard deviation of a measured coordinate [m].
        known_frame: whether the tips will be measured in frame 1.
        lowest: least height of the tip in frame 1 [m]; None is no bound.
        measured: (m, 5) poses that are measured already.
        seed: of the candidates.

    Raises:
        InputError: count is not from 1 to 500.
        InfeasibleError: too few poses are within all bounds.
    """
    if not 1 <= count <= _MOST:
        raise InputError(f"--suggest is {count}; it must be from 1 to {_MOST} poses")
    q = _allowed(boom, lowest, seed, count)
    names, model = candidates(boom, known_frame=known_frame, equal_links=False), TipModel.of(boom, np.zeros(3))
    unit = np.array([TOLERANCE[name] for name in names])

    def information(q: Array) -> Array:
        return np.asarray(model.derivative(names, q, printed_wind_up(boom, q)) * unit / tip_sd)

    J = information(q)
    start = np.eye(len(names))
    if measured is not None:
        known = information(measured)
        start = start + np.einsum("nik,nil->kl", known, known)
    chosen = _exchanged(J, _greedy(J, start, count), start)
    A = start + np.einsum("nik,nil->kl", J[chosen], J[chosen])
    random = start + np.einsum("nik,nil->kl", J[:count], J[:count])
    gain = float(np.exp((np.linalg.slogdet(A)[1] - np.linalg.slogdet(random)[1]) / 2.0 / len(names)))
    poses = q[chosen][np.argsort(q[chosen][:, 0])]
    own = [k for k, name in enumerate(names) if name not in BASE]
    sd = np.sqrt(np.diag(np.linalg.inv(A)))[own] * unit[own]
    return SuggestedPoses(read_only(poses), tuple(names[k] for k in own), read_only(sd), gain)


def _allowed(boom: Boom, lowest: float | None, seed: int, count: int) -> Array:
    limits = boom.limits
    points = qmc.Sobol(5, rng=np.random.default_rng(seed)).random(_TRIED)
    q = limits.lower + points * (limits.upper - limits.lower)
    q = q[limits.contain(q)]
    psi, chi = directions(boom, q[:, 1], q[:, 2])
    with np.errstate(invalid="ignore"):
        q = q[np.abs(np.sin(psi - chi)) >= np.sin(limits.transmission)]
    if len(q) and lowest is not None:
        q = q[forward_kinematics(boom, q).position[:, 2] >= lowest]
    if len(q):
        q = q[(np.abs(gravity_torque(boom, q)) <= static_limits(boom)).all(axis=-1)]
    kept: list[Array] = []
    for pose in q:
        if len(kept) == _CANDIDATES:
            break
        try:
            require_clear(boom, pose, "candidate")
        except InfeasibleError:
            continue
        kept.append(pose)
    if len(kept) < count:
        bound = "" if lowest is None else f", the tip above {lowest:g} m"
        raise InfeasibleError(
            f"only {len(kept)} of {_TRIED} random poses are within the limits of joints, linkage and drives{bound}; "
            f"{count} are asked for"
        )
    return np.array(kept)


def _gains(J: Array, inverse: Array) -> Array:
    """Return the growth of log det by one more pose, for each candidate."""
    return np.asarray(np.linalg.slogdet(np.eye(3) + J @ inverse @ np.swapaxes(J, -1, -2))[1])


def _greedy(J: Array, A: Array, count: int) -> list[int]:
    chosen: list[int] = []
    for _ in range(count):
        gains = _gains(J, np.asarray(np.linalg.inv(A)))
        gains[chosen] = -np.inf
        chosen.append(int(np.argmax(gains)))
        A = A + J[chosen[-1]].T @ J[chosen[-1]]
    return chosen


def _exchanged(J: Array, chosen: list[int], start: Array) -> list[int]:
    """Exchange one pose for a better one, the first that gains, until none does."""
    A = start + np.einsum("nik,nil->kl", J[chosen], J[chosen])
    left = _EXCHANGES
    improved = True
    while improved and left > 0:
        improved = False
        for place, pose in enumerate(chosen):
            without = A - J[pose].T @ J[pose]
            gains = _gains(J, np.asarray(np.linalg.inv(without)))
            now = gains[pose]
            gains[chosen] = -np.inf
            best = int(np.argmax(gains))
            left -= 1
            if gains[best] > now + 1e-6:
                chosen[place], A, improved = best, without + J[best].T @ J[best], True
            if left == 0:
                break
    return chosen
