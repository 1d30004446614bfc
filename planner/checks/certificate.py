"""What a planned motion asks of each limit at worst, recomputed from the model on a grid finer than the planner's."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from boom_model import JOINTS, BaseMotion, Boom, inverse_dynamics
from boom_model.arrays import Array
from boom_model.drives.drive import available_torque, motor_limit
from planner.checks.motion_checks import average_torque as mean
from planner.timing.path_limits import gear_ratio, looks, motor_ratio
from planner.timing.time_law import Motion

RATIO_TOLERANCE = 1e-3
"""How far above 1 a ratio may be: what a planner may miss between the points that it looks at."""

FINER = 10
"""A motion is certified at this many times the points that its planner looked at, and at both sides of every jump."""


@dataclass(frozen=True)
class WorstRatio:
    """The largest demand / limit of one kind of limit."""

    limit: str
    joint: str
    ratio: float
    """For a position: distance from the middle of its range over half the range; for the linkage: limit / angle."""
    at_s: float | None
    """None of what the whole motion decides."""


@dataclass(frozen=True)
class Certificate:
    """The worst ratio to each limit over a planned motion."""

    samples: int
    worst: tuple[WorstRatio, ...]
    iterations: int
    """Solves of the planner, over all parts of the motion."""
    residual: float
    """What one more solve could still add, as a share of a limit, the most of the parts."""

    @property
    def broken(self) -> tuple[WorstRatio, ...]:
        """The ratios that are too large."""
        return tuple(worst for worst in self.worst if worst.ratio > 1.0 + RATIO_TOLERANCE)


def certify(boom: Boom, motions: Sequence[Motion], base: BaseMotion | None = None, average_torque: bool = False) -> Certificate:
    """Positions, linkage, velocities, accelerations, jerks where they are limited, gearbox and motor torque.

    Friction is counted. Only the base's tilt is: what else a vehicle does was not planned for. A motor whose supply is not
    given is held against its torque at standstill, and the limit named so.

    Args:
        average_torque: whether the gearboxes' average torque was asked for too.
    """
    parts = [motion.times(FINER * looks(motion.path)) for motion in motions]
    starts = np.cumsum([0.0, *(motion.duration for motion in motions)])
    t = np.concatenate([start + part for start, part in zip(starts[:-1], parts, strict=True)])
    states = zip(*(motion(part) for motion, part in zip(motions, parts, strict=True)), strict=True)
    q, qd, qdd, qddd = (np.concatenate(each) for each in states)
    tau = inverse_dynamics(boom, q, qd, qdd, base=base, friction=True, reactions=False).tau
    jerk = qddd if all(motion.law.jerk_limited for motion in motions) else None
    ratios = dict(_ratios(boom, q, qd, qdd, jerk, tau))
    worst = []
    for limit, ratio in ratios.items():
        at, joint = np.unravel_index(int(np.argmax(ratio)), ratio.shape)
        worst.append(WorstRatio(limit, JOINTS[joint], float(ratio[at, joint]), float(t[at])))
    if average_torque:
        worst += _averages(boom, t, qd, tau)
    laws = [motion.law for motion in motions]
    return Certificate(len(t), tuple(worst), sum(law.iterations for law in laws), max(law.residual for law in laws))


def _ratios(boom: Boom, q: Array, qd: Array, qdd: Array, qddd: Array | None, tau: Array) -> Iterator[tuple[str, Array]]:
    """Each limit's name with (n, 5) ratios to it; limits that no drive gives are left out."""
    limits = boom.limits
    half, middle = (limits.upper - limits.lower) / 2.0, (limits.upper + limits.lower) / 2.0
    away = np.abs(q - middle)
    yield "position", np.divide(away, half, out=np.where(away > 0.0, np.inf, 0.0), where=half > 0.0)
    gap, linkage = q[:, 2] - q[:, 1], np.zeros_like(q)
    linkage[:, 2] = np.divide(limits.linkage, gap, out=np.full_like(gap, np.inf), where=gap > 0.0)
    yield "lower - inner", linkage
    yield "velocity", np.abs(qd) / limits.velocity
    yield "acceleration", np.abs(qdd) / limits.acceleration
    if qddd is not None:
        yield "jerk", np.abs(qddd) / limits.jerk
    fed = all(
        available_torque(drive, 0.0) is not None for drive in boom.drives if drive and motor_limit(drive, 0.0) is not None
    )
    motor = "motor torque" if fed else "motor torque at standstill"
    for name, ratio in (("gearbox torque", gear_ratio(boom, tau)), (motor, motor_ratio(boom, tau, qd, qdd))):
        if ratio.any():
            yield name, ratio


def _averages(boom: Boom, t: Array, qd: Array, tau: Array) -> list[WorstRatio]:
    """The gearbox nearest to its average torque, or beyond it."""
    ratios = []
    for i, drive in enumerate(boom.drives):
        limit = None if drive is None else drive.gearbox.max_average_torque
        if limit is not None:
            ratios.append(WorstRatio("average torque", JOINTS[i], (mean(t, tau[:, i], qd[:, i]) or 0.0) / limit, None))
    return [max(ratios, key=lambda each: each.ratio)] if ratios else []
