"""Checks of a motion against the joint limits and the drives' datasheets."""

from collections.abc import Iterator

import numpy as np

from boom_model import JOINTS, Basis, Drive, LinearDrive, Origin, transmission_angle
from boom_model.boom import IS_LENGTH
from planner.checks.drives.actuator import actuator_rows
from planner.checks.drives.duty import Duty
from planner.checks.drives.gearbox import gearbox_rows
from planner.checks.drives.joint_view import JointView, Shock
from planner.checks.drives.motor import motor_rows
from planner.checks.drives.tip import tip_rows
from planner.checks.evaluation import Evaluation
from planner.checks.kinds import CheckKind
from planner.checks.rows import Row, bounded, compared
from planner.paths.clearance import nearest_approach


def check_rows(evaluation: Evaluation, duty: Duty | None = None) -> tuple[Row, ...]:
    """Return every check of a motion.

    Checks of position, velocity, acceleration and jerk come first, then those of each joint's
    drive, the mount, the clearance and the tip.

    Args:
        evaluation: evaluation of the motion. Without reactions the mount is not checked.
        duty: duty cycle that the samples represent; None is the motion repeated without a pause.
    """
    boom, motion = evaluation.boom, evaluation.trajectory
    duty = Duty.alone(motion.t) if duty is None else duty
    rows: list[Row] = []
    for i in range(5):
        rows += _position_rows(evaluation, i)
        rows += _rate_rows(evaluation, i)
    views = joint_views(evaluation, duty)
    for view, drive in zip(views, boom.drives, strict=True):
        fitted = boom.actuator if drive is None and view.is_length else drive
        retracted = float(boom.limits.lower[view.index])
        rows += _undriven_rows(view) if fitted is None else drive_rows(view, fitted, evaluation.shock, retracted)
    rows += _mount_rows(evaluation)
    rows += _clearance_rows(evaluation)
    basis = Basis.weakest(view.basis for view in views)
    rows += tip_rows(boom, motion, evaluation.tau, duty, evaluation.inertia, basis)
    return tuple(rows)


def joint_views(evaluation: Evaluation, duty: Duty | None = None) -> tuple[JointView, ...]:
    """Return what the drive checks need to know of each joint's motion."""
    boom, motion, base, shock = evaluation.boom, evaluation.trajectory, evaluation.base, evaluation.shock
    origins = boom.friction.origins
    return tuple(
        JointView(
            joint=JOINTS[i],
            is_length=bool(IS_LENGTH[i]),
            trajectory=motion,
            duty=Duty.alone(motion.t) if duty is None else duty,
            tau=evaluation.tau[:, i],
            tau_without_shock=evaluation.tau[:, i] if shock is None else shock.tau_without_shock[:, i],
            friction=evaluation.friction[:, i],
            coulomb=float(boom.friction.coulomb[i]),
            static=evaluation.static[:, i],
            inertia=evaluation.inertia[:, i, i],
            index=i,
            basis=Basis.weakest([evaluation.basis, *(o.basis for o in (origins[i],) if o is not None)]),
            steady=base is None or base.up.ndim == 1 or bool(np.ptp(base.up, axis=0).max() == 0.0),
        )
        for i in range(5)
    )


def drive_rows(
    view: JointView, drive: Drive | LinearDrive, shock: Shock | None = None, retracted: float = 0.0
) -> Iterator[Row]:
    """Return every check of a joint's gearbox and motor, or of its linear actuator.

    Args:
        view: motion of the joint.
        drive: the joint's drive.
        shock: shock of the vehicle, if there is one. During it a gearbox may reach its momentary
            peak torque.
        retracted: the joint's lower limit [m], where an actuator's stroke starts.
    """
    if isinstance(drive, LinearDrive):
        yield from actuator_rows(view, drive, retracted)
    else:
        yield from gearbox_rows(view, drive, shock)
        yield from motor_rows(view, drive)


def _position_rows(evaluation: Evaluation, i: int) -> Iterator[Row]:
    limits, motion = evaluation.boom.limits, evaluation.trajectory
    q = motion.q[:, i]
    excess = np.maximum(limits.lower[i] - q, q - limits.upper[i])
    at = int(np.argmax(excess))
    nearest = limits.lower[i] if abs(q[at] - limits.lower[i]) <= abs(q[at] - limits.upper[i]) else limits.upper[i]
    yield bounded(
        joint=JOINTS[i],
        kind=CheckKind.POSITION,
        value=q[at],
        bound=nearest,
        distance=-excess[at],
        at=motion.t[at],
        origin=limits.origins["position"][i],
    )
    if JOINTS[i] != "lower":
        return
    transmitted = transmission_angle(evaluation.boom, motion.q)
    for kind, angle, bound, origin in (
        (CheckKind.LINKAGE, motion.q[:, 2] - motion.q[:, 1], limits.linkage, limits.origins["linkage"][0]),
        # pin forces grow as the linkage becomes flat
        (CheckKind.TRANSMISSION_ANGLE, transmitted, limits.transmission, limits.origins["transmission"][0]),
    ):
        at = int(np.argmin(angle))
        room = angle[at] - bound
        yield bounded(joint="lower", kind=kind, value=angle[at], bound=bound, distance=room, at=motion.t[at], origin=origin)


def _rate_rows(evaluation: Evaluation, i: int) -> Iterator[Row]:
    limits, motion = evaluation.boom.limits, evaluation.trajectory
    for kind, values in ((CheckKind.VELOCITY, motion.qd), (CheckKind.ACCELERATION, motion.qdd), (CheckKind.JERK, motion.qddd)):
        if values is None:
            continue
        at = int(np.argmax(np.abs(values[:, i])))
        yield compared(
            joint=JOINTS[i],
            kind=kind,
            demand=float(abs(values[at, i])),
            limit=float(getattr(limits, kind)[i]),
            at=float(motion.t[at]),
            origin=limits.origins[kind][i],
        )


def _clearance_rows(evaluation: Evaluation) -> Iterator[Row]:
    """Return the check of the smallest distance between the arm and the keep-out shapes."""
    keep = evaluation.boom.keep_out
    if keep is None:
        return
    at, found = nearest_approach(evaluation.boom, evaluation.trajectory.q)
    origins = [keep.origin, *(shape.origin for shape in keep.shapes if shape.name == found.shape)]
    yield bounded(
        joint="arm",
        kind=CheckKind.CLEARANCE,
        subject=f"of {found.link} to {found.shape}",
        value=found.distance,
        bound=keep.clearance,
        distance=found.distance - keep.clearance,
        at=evaluation.t[at],
        origin=Origin(Basis.weakest([each.basis for each in origins]), "; ".join(each.source for each in origins)),
    )


def _undriven_rows(view: JointView) -> Iterator[Row]:
    """Return what the motion requires of a drive, at a joint without drive data."""
    origin = Origin(Basis.PRINTED, "NOT CHECKED: no drive data")
    for kind, values in (
        (CheckKind.DRIVE_PEAK_FORCE if view.is_length else CheckKind.DRIVE_PEAK_TORQUE, view.tau),
        (CheckKind.DRIVE_TOP_SPEED, view.qd),
        (CheckKind.DRIVE_PEAK_POWER, view.tau * view.qd),
        (CheckKind.DRIVE_WORST_HOLD, view.static),
    ):
        peak, at = view.peak(values)
        yield view.compared(kind, demand=peak, limit=None, at=at, origin=origin)
    kind = CheckKind.DRIVE_RMS_FORCE if view.is_length else CheckKind.DRIVE_RMS_TORQUE
    yield view.compared(kind, demand=view.duty.mean(view.tau**2) ** 0.5, limit=None, origin=origin)


def _mount_rows(evaluation: Evaluation) -> Iterator[Row]:
    wrench, mount = evaluation.loads.mount, evaluation.boom.mount
    if wrench is None:
        return
    for kind, vectors, bearable in (
        (CheckKind.MOUNT_PEAK_FORCE, wrench[:, :3], mount.force),
        (CheckKind.MOUNT_PEAK_MOMENT, wrench[:, 3:], mount.moment),
    ):
        size = np.linalg.norm(vectors, axis=-1)
        at = int(np.argmax(size))
        yield compared(
            joint="mount",
            kind=kind,
            demand=float(size[at]),
            limit=None if bearable is None else bearable.value,
            at=float(evaluation.t[at]),
            origin=Origin(Basis.PRINTED, "the boom's file gives no limit of the mount")
            if bearable is None
            else bearable.origin,
        )
