"""What a mission requires of the drive of each joint, whether the joint has a drive or not."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from boom_model import JOINTS, Boom, InputError, jacobian
from boom_model.arrays import Array, Mask, scalar
from boom_model.drives.drive import STEPPER_MARGIN
from boom_model.dynamics.newton_euler import PayloadAs
from boom_model.words import unknown
from planner.checks.drives.gearbox import LEAST_FREQUENCY
from planner.checks.drives.joint_view import JointView
from planner.checks.drives.servo import INERTIA_RATIO
from planner.checks.evaluation import Evaluation, at_samples
from planner.checks.motion_checks import joint_views
from planner.missions.mission import Cycle, check_steady
from planner.motion.vehicle import LEVEL, VehicleCase

STEPS = 8
"""Number of steps of the torque-speed table."""

_RESTS = 1e-6
"""Speed [rad/s] and travel [rad] that are rounding."""


@dataclass(frozen=True)
class Point:
    """Largest torque [Nm] of a kind, the joint speed [rad/s] at that time, and the time [s]."""

    torque: float
    speed: float
    at_s: float


@dataclass(frozen=True)
class SpeedStep:
    """Row of the torque-speed table: largest torque between the last row's speed and this.

    A drive with its own inertia J at the joint must give `torque` + J `acceleration` at `speed`.
    """

    speed: float
    """[rad/s]"""
    torque: float
    """Torque of the load [Nm]."""
    acceleration: float
    """Largest acceleration [rad/s^2]."""


@dataclass(frozen=True, eq=False)
class Cloud:
    """Samples of a joint's motion, and of the reversed motion."""

    speed: Array
    """(n,) size of the joint speed [rad/s]."""
    torque: Array
    """(n,) torque in the direction of the motion [Nm]: positive drives, negative brakes."""
    acceleration: Array
    """(n,) size of the joint acceleration [rad/s^2]."""

    @property
    def hull(self) -> Array:
        """(k, 2) corners of the convex hull of speed and torque, anticlockwise.

        A cloud without area has the ends of its line, or its only point.
        """
        from scipy.spatial import ConvexHull, QhullError

        points = np.unique(np.column_stack([self.speed, self.torque]), axis=0)
        try:
            corners: Array = points[ConvexHull(points).vertices]
        except (QhullError, ValueError):
            corners = points[[0, -1]] if len(points) > 1 else points
        return corners


@dataclass(frozen=True, eq=False)
class Requirement:
    """What a drive must provide at one joint.

    At the extension, torques are forces [N] and angles lengths [m].
    """

    joint: str
    is_length: bool
    fitted: str | None
    """Name of the fitted drive; None if there is none."""
    cloud: Cloud
    steps: tuple[SpeedStep, ...]
    """Torque-speed table."""
    peak: Point
    """Largest torque."""
    mean: float | None
    """Cube mean of the torque, weighted by travel [Nm]; None without travel."""
    mean_speed: float
    """Mean speed over the whole cycle [rad/s]."""
    moving_speed: float
    """Mean speed while the joint moves [rad/s]."""
    hold: Point
    """Largest static torque. A brake must hold it without power."""
    creep: float
    """Largest static torque with Coulomb friction [Nm], for the slowest motion through the poses.
    """
    rms: float
    """RMS torque over the cycle [Nm]; the larger of both directions counts."""
    top_speed: float
    output_power: float
    """Largest power that the joint takes up [W]."""
    braking_power: float
    """Largest power that the joint gives back [W]."""
    inertia: tuple[float, float]
    """Smallest and largest inertia at the joint, with the others locked and without any drive [kg
    m^2]."""
    largest_reflected: float
    """Largest admissible inertia of the drive at the joint [kg m^2]."""
    least_reflected: float
    """Inertia of the rotor at the joint [kg m^2] from which on the guideline of the inertia ratio
    is kept."""
    frequency: float
    """First frequency [Hz] that the stiffnesses give."""
    stiffness: float
    """Stiffness [Nm/rad] for that frequency, with the other joints locked."""
    stiffness_together: float
    """Stiffness [Nm/rad] for that frequency, if every joint has its own of these."""
    tip_error: float | None
    """Error of the tip [m] that the backlash of all joints together may cause; None if not stated.
    """
    backlash: float | None
    """Largest backlash [rad] for that error; None if not stated, or if the joint does not move the
    tip."""
    starts: float
    """Number of moves of this joint in a cycle."""
    travel: float
    """Travel in a cycle [rad]."""
    moving_share: float
    """Share of the cycle in which the joint moves."""
    stroke: float
    """Travel between the farthest positions [rad]; of the extension from its lower limit [m]."""
    cycle_s: float
    """Duration of the cycle [s]."""
    life_s: float | None
    """Required life, pauses included [s]; None if not stated."""

    @property
    def margin(self) -> float:
        """Margin asked of the motor's torque and holding torque."""
        return 0.0 if self.is_length else STEPPER_MARGIN

    @property
    def life_starts(self) -> float | None:
        """Number of moves in the required life."""
        return None if self.life_s is None else self.starts * self.life_s / self.cycle_s


def requirements(
    boom: Boom,
    cycle: Cycle,
    joints: Sequence[str] = JOINTS,
    *,
    frequency: float = LEAST_FREQUENCY,
    tip_error: float | None = None,
    payload_as: PayloadAs = "mass",
    vehicle: VehicleCase = LEVEL,
) -> tuple[Requirement, ...]:
    """Return what a planned mission requires of the drives of some joints.

    Torques contain the joints' known friction and no drive's own inertia. The largest admissible
    reflected inertia is

        J = max |tau| / max |qdd|,

    so moving the drive itself never takes more than the largest torque again (our own choice). The
    least one of the rotor is the load's inertia over INERTIA_RATIO. The stiffnesses for a first
    frequency f follow from the mass matrix M at the poses of the mission: with the other joints
    locked

        K_i = (2 pi f)^2 D_i,   D_i = max M_ii,

    and with all joints elastic K_i = (2 pi f)^2 D_i max lambda, with the largest eigenvalue of
    D^-1/2 M D^-1/2. It is at most 5, so this is also Dunkerley's bound. Backlash b_i shares the tip
    error evenly: b_i max |J_v,i| is the same for every joint that moves the tip.

    Args:
        boom: the boom; its drives do not matter.
        cycle: the planned mission.
        joints: names of the joints.
        frequency: first frequency [Hz].
        tip_error: largest error of the tip through backlash [m]; None is the mission's tolerance.
        payload_as: see `inverse_dynamics`.
        vehicle: the slope that the boom stands on.

    Raises:
        InputError: unknown joint, a moving vehicle, or a frequency or error that is not positive.
    """
    check_steady(vehicle)
    for joint in joints:
        if joint not in JOINTS:
            raise unknown("joint", joint, JOINTS)
    if tip_error is None and cycle.duty.tip_tolerance is not None:
        tip_error = cycle.duty.tip_tolerance.value
    for name, value in (("frequency", frequency), ("tip error", tip_error)):
        if value is not None and not scalar(name, value) > 0.0:
            raise InputError(f"{name} is {value:g}; it must be above 0")
    evaluation = at_samples(boom, cycle.trajectory, vehicle=vehicle, payload_as=payload_as, reactions=False)
    views = joint_views(evaluation, cycle.duty)
    together = _stiffness_together(evaluation.inertia, frequency)
    backlash = _backlash(evaluation, tip_error)
    return tuple(
        _requirement(boom, cycle, views[i], frequency, float(together[i]), tip_error, backlash[i])
        for i in (JOINTS.index(joint) for joint in dict.fromkeys(joints))
    )


def _requirement(
    boom: Boom,
    cycle: Cycle,
    view: JointView,
    frequency: float,
    together: float,
    tip_error: float | None,
    backlash: float | None,
) -> Requirement:
    duty, i, fitted = cycle.duty, view.index, boom.drive_of(view.joint)
    cloud = _cloud(view)
    speed = np.abs(view.qd)
    back = view.tau - 2.0 * view.friction if view.steady else view.tau  # friction changes its sign
    moving = duty.mean((speed > (0.0 if view.is_length else _RESTS)).astype(float))
    mean_speed = duty.mean(speed)
    creep = float(np.abs(view.static).max()) + view.coulomb
    peak, fastest = _point(view, view.tau), float(speed.max())
    accelerated, inertia = float(cloud.acceleration.max()), view.inertia
    load = max(peak.torque, creep)
    position = view.trajectory.q[:, i]
    lowest = float(boom.limits.lower[i]) if view.is_length else float(position.min())
    counts = zip(cycle.legs, cycle.counts, strict=True)
    return Requirement(
        joint=view.joint,
        is_length=view.is_length,
        fitted=None if fitted is None else fitted.name,
        cloud=cloud,
        steps=_steps(cloud, creep),
        peak=peak,
        mean=duty.travel_mean(view.tau_without_shock, view.qd),
        mean_speed=mean_speed,
        moving_speed=mean_speed / moving if moving > 0.0 else 0.0,
        hold=_point(view, view.static, still=True),
        creep=creep,
        rms=duty.mean(np.maximum(view.tau**2, back**2)) ** 0.5,
        top_speed=fastest,
        output_power=max(float((cloud.torque * cloud.speed).max()), 0.0),
        braking_power=max(float((-cloud.torque * cloud.speed).max()), 0.0),
        inertia=(float(inertia.min()), float(inertia.max())),
        largest_reflected=load / accelerated if accelerated > 0.0 else np.inf,
        least_reflected=float(inertia.max()) / INERTIA_RATIO,
        frequency=frequency,
        stiffness=(2.0 * np.pi * frequency) ** 2 * float(inertia.max()),
        stiffness_together=together,
        tip_error=tip_error,
        backlash=backlash,
        starts=float(sum(n for leg, n in counts if leg.moves and np.ptp(leg.trajectory.q[:, i]) > _RESTS)),
        travel=mean_speed * duty.duration,
        moving_share=moving,
        stroke=max(float(position.max()) - lowest, 0.0),
        cycle_s=duty.duration,
        life_s=None if duty.required_life is None else duty.required_life.value,
    )


def _point(view: JointView, torque: Array, *, still: bool = False) -> Point:
    at = int(np.argmax(np.abs(torque)))
    return Point(float(abs(torque[at])), 0.0 if still else float(abs(view.qd[at])), float(view.t[at]))


def _cloud(view: JointView) -> Cloud:
    forwards = view.tau * np.sign(view.qd) + np.where(view.qd == 0.0, np.abs(view.tau), 0.0)
    speed, acceleration = np.abs(view.qd), np.abs(view.qdd)
    if not view.steady:
        return Cloud(speed, forwards, acceleration)
    back = -(view.tau - 2.0 * view.friction) * np.sign(view.qd) + np.where(view.qd == 0.0, np.abs(view.tau), 0.0)
    return Cloud(np.tile(speed, 2), np.concatenate([forwards, back]), np.tile(acceleration, 2))


def _steps(cloud: Cloud, creep: float) -> tuple[SpeedStep, ...]:
    """Return the torque-speed table; its first row includes the slowest motion."""
    fastest = float(cloud.speed.max())
    if fastest == 0.0:
        return (SpeedStep(0.0, max(float(np.abs(cloud.torque).max()), creep), float(cloud.acceleration.max())),)
    edges = np.linspace(0.0, fastest, STEPS + 1)[1:]
    row = np.searchsorted(edges, cloud.speed)
    found = []
    for k, edge in enumerate(edges):
        inside: Mask = row == k
        torque = float(np.abs(cloud.torque[inside]).max(initial=creep if k == 0 else 0.0))
        found.append(SpeedStep(float(edge), torque, float(cloud.acceleration[inside].max(initial=0.0))))
    return tuple(found)


def _stiffness_together(M: Array, frequency: float) -> Array:
    """Return the stiffness (5,) of joints for a first frequency, at mass matrices M (m, 5, 5)."""
    largest = np.diagonal(M, axis1=-2, axis2=-1).max(axis=0)
    root = 1.0 / np.sqrt(np.where(largest > 0.0, largest, 1.0))
    factor = float(np.linalg.eigvalsh(root[:, None] * M * root)[..., -1].max())
    stiffness: Array = (2.0 * np.pi * frequency) ** 2 * largest * factor
    return stiffness


def _backlash(evaluation: Evaluation, tip_error: float | None) -> tuple[float | None, ...]:
    if tip_error is None:
        return (None,) * 5
    reach = np.linalg.norm(jacobian(evaluation.boom, evaluation.trajectory.q)[..., :3, :], axis=-2).max(axis=0)
    moves = reach > 0.0
    return tuple(float(tip_error / moves.sum() / r) if r > 0.0 else None for r in reach)
