"""Checks of the extension's linear actuator against its datasheet."""

from collections.abc import Iterator

import numpy as np

from boom_model import Basis, LinearDrive, Origin, screw_torque
from planner.checks.drives.brake import power_off_row
from planner.checks.drives.joint_view import JointView
from planner.checks.kinds import CheckKind
from planner.checks.rows import Row


def actuator_rows(view: JointView, drive: LinearDrive, retracted: float) -> Iterator[Row]:
    """Return every row of a linear actuator.

    Rows of force, speed, stroke, duty, torque and speed of the screw, and power-off hold. The
    stroke starts at `retracted` [m].
    """
    actuator = drive.actuator
    sheet = Origin(Basis.PRINTED, actuator.source)
    peak, at = view.peak(view.tau)
    yield view.compared(CheckKind.ACTUATOR_PEAK_FORCE, demand=peak, limit=actuator.peak_force, at=at, origin=sheet)
    mean = view.duty.travel_mean(view.tau_without_shock, view.qd)
    if mean is not None:
        cube = Origin(Basis.PRINTED, f"{actuator.source}; cube mean over the travel, as is usual for ball screws")
        yield view.compared(CheckKind.ACTUATOR_MEAN_FORCE, demand=mean, limit=actuator.rated_force, origin=cube)
    hold, held_at = view.peak(view.static)
    yield view.compared(CheckKind.ACTUATOR_HOLD, demand=hold, limit=actuator.static_force, at=held_at, origin=sheet)
    fastest, fastest_at = view.peak(view.qd)
    yield view.compared(CheckKind.ACTUATOR_SPEED, demand=fastest, limit=actuator.max_speed, at=fastest_at, origin=sheet)
    out, out_at = view.peak(np.maximum(view.trajectory.q[:, view.index] - retracted, 0.0))
    yield view.compared(CheckKind.ACTUATOR_STROKE, demand=out, limit=actuator.stroke, at=out_at, origin=sheet)
    moving = view.duty.mean((view.qd != 0.0).astype(float))
    cycle = Origin(
        Basis.PRINTED, f"{actuator.source}; share of the duty cycle in motion; a single move repeats without a pause"
    )
    yield view.compared(CheckKind.ACTUATOR_DUTY, demand=moving, limit=actuator.duty, origin=cycle)
    torque = screw_torque(actuator, view.tau, view.qd)
    largest = (None, None) if torque is None else view.peak(torque)
    yield view.informative(CheckKind.ACTUATOR_SCREW_TORQUE, figure=largest[0], at=largest[1], origin=sheet)
    turning = None if actuator.lead is None else 2.0 * np.pi * fastest / actuator.lead
    yield view.informative(CheckKind.ACTUATOR_SCREW_SPEED, figure=turning, at=fastest_at, origin=sheet)
    # The force at which the screw starts to backdrive is not a holding limit; see the gearbox.
    yield power_off_row(
        view,
        demand=hold,
        limit=actuator.backdrive_force,
        at=held_at,
        brake=drive.brake,
        with_brake=actuator.source,
        without_brake=f"no brake is declared and the screw can be backdriven: {actuator.source}",
    )
