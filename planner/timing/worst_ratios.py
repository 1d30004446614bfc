"""What motions ask of each limit at worst, recomputed from the model on a grid finer than the planner's."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from boom_model import JOINTS, BaseMotion, Boom, inverse_dynamics
from boom_model.arrays import Array
from boom_model.drives.drive import available_torque, motor_limit
from planner.timing.path_limits import gear_ratio, looks, motor_ratio, rate_ratios
from planner.timing.time_law import Motion
from planner.timing.travel_mean import average_torque as mean

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


def fine_times(motion: Motion) -> Array:
    """The times at which a motion is certified."""
    return motion.times(FINER * looks(motion.path))


def worst_ratios(
    boom: Boom, motions: Sequence[Motion], base: BaseMotion | None = None, average_torque: bool = False
) -> tuple[tuple[WorstRatio, ...], int]:
    """The worst ratio to each limit over motions in turn, and the number of samples.

    Positions, linkage, velocities, accelerations, jerks where they are limited, gearbox and motor torque. Friction is counted.
    A motor whose supply is not given is held against its torque at standstill, and the limit named so.

    Args:
        base: how the base is tilted; None is level.
        average_torque: whether the gearboxes' average torque counts too.
    """
    parts = [fine_times(motion) for motion in motions]
    starts = np.cumsum([0.0, *(motion.duration for motion in motions)])
    t = np.concatenate([start + part for start, part in zip(starts[:-1], parts, strict=True)])
    states = zip(*(motion(part) for motion, part in zip(motions, parts, strict=True)), strict=True)
    q, qd, qdd, qddd = (np.concatenate(each) for each in states)
    tau = inverse_dynamics(boom, q, qd, qdd, base=base, friction=True, reactions=False).tau
    jerk = qddd if all(motion.law.jerk_limited for motion in motions) else None
    worst = []
    for limit, ratio in _ratios(boom, q, qd, qdd, jerk, tau):
        at, joint = np.unravel_index(int(np.argmax(ratio)), ratio.shape)
        worst.append(WorstRatio(limit, JOINTS[joint], float(ratio[at, joint]), float(t[at])))
    if average_torque:
        worst += _averages(boom, t, qd, tau)
    return tuple(worst), len(t)


def joint_stretch(boom: Boom, motion: Motion) -> float:
    """The factor by which a motion must be slowed to keep the joints' velocity, acceleration and jerk at `fine_times`.

    Slowed by k, they fall as 1/k, 1/k^2 and 1/k^3. Below 1 where the motion may be hastened.
    """
    velocity, acceleration, jerk = rate_ratios(boom, motion, fine_times(motion))
    return float(max(velocity, np.sqrt(acceleration), np.cbrt(jerk) if motion.law.jerk_limited else 0.0))


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
