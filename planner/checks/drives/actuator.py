"""The extension's linear actuator against its datasheet."""

from collections.abc import Iterator

import numpy as np

from boom_model import Basis, LinearDrive, Origin, screw_torque
from planner.checks.drives.joint_view import JointView
from planner.checks.rows import Row, Verdict


def actuator_rows(view: JointView, drive: LinearDrive, retracted: float) -> Iterator[Row]:
    """Forces, speed, stroke from `retracted` [m], duty, what the screw's own motor must give, and power-off."""
    actuator = drive.actuator
    sheet = Origin(Basis.PRINTED, actuator.source)
    peak, at = view.peak(view.tau)
    yield view.held("actuator peak force", peak, actuator.peak_force, "N", at, sheet)
    mean = view.duty.travel_mean(view.calm, view.qd)
    if mean is not None:
        cube = Origin(Basis.PRINTED, f"{actuator.source}; cube mean over the travel, as for ball screws")
        yield view.held("actuator mean force", mean, actuator.rated_force, "N", None, cube)
    hold, held_at = view.peak(view.static)
    yield view.held("actuator hold", hold, actuator.static_force, "N", held_at, sheet)
    fastest, fastest_at = view.peak(view.qd)
    yield view.held("actuator speed", fastest, actuator.max_speed, "m/s", fastest_at, sheet)
    out, out_at = view.peak(np.maximum(view.trajectory.q[:, view.index] - retracted, 0.0))
    yield view.held("actuator stroke", out, actuator.stroke, "m", out_at, sheet)
    moving = view.duty.mean((view.qd != 0.0).astype(float))
    cycle = Origin(Basis.PRINTED, f"{actuator.source}; share of the cycle that it moves, a lone move repeated without a pause")
    yield view.held("actuator duty", moving, actuator.duty, "", None, cycle)
    torque = screw_torque(actuator, view.tau, view.qd)
    largest = (None, None) if torque is None else view.peak(torque)
    yield view.told("actuator screw torque", largest[0], "Nm", largest[1], sheet)
    turning = None if actuator.lead is None else 2.0 * np.pi * fastest / actuator.lead
    yield view.told("actuator screw speed", turning, "rad/s", fastest_at, sheet)
    yield _power_off_row(view, drive, hold, held_at)


def _power_off_row(view: JointView, drive: LinearDrive, hold: float, at: float) -> Row:
    """As for a gearbox: the force that starts to drive it back is no holding margin."""
    facts = (view.joint, "power-off hold", hold, drive.actuator.backdrive_force, "N", None, 0.0, at)
    brake, sheet = drive.brake, drive.actuator.source
    if brake is not None and brake.value:
        verdict = Verdict.WARN if brake.origin.basis is not Basis.PRINTED else Verdict.PASS
        return Row(*facts, verdict, brake.origin.basis, f"held by a brake: {brake.origin.source}; {sheet}")
    return Row(*facts, Verdict.FAIL, Basis.PRINTED, f"no brake is declared, and the screw may be driven back: {sheet}")
