"""Error budget of the tip: wind-up, backlash, hysteresis, step error and calibrated geometry."""

from collections.abc import Iterator

import numpy as np

from boom_model import Basis, Boom, Origin, gear_frequencies, tip_deflection
from boom_model.arrays import Array
from boom_model.drives.gear_compliance import SURE
from planner.checks.drives.duty import Duty
from planner.checks.kinds import CheckKind
from planner.checks.rows import Row, Verdict, compared, informative, unknown
from planner.motion.trajectory import Trajectory


def tip_rows(boom: Boom, trajectory: Trajectory, tau: Array, duty: Duty, M: Array, basis: Basis) -> Iterator[Row]:
    """Return the rows of the tip.

    These are the largest value of each part of the error budget, the calibration's remaining
    uncertainty among them, the largest sum against the tolerance, and the first natural frequency
    of the arm on its gearboxes.

    Args:
        boom: the boom.
        trajectory: the motion.
        tau: (n, 5) joint torques.
        duty: duty cycle, with the tolerance of the deflection.
        M: (m, 5, 5) mass matrix at some of the motion's poses.
        basis: basis of the torques.
    """
    known = boom.calibration
    if known is None and all(drive is None for drive in boom.drives):
        if duty.tip_tolerance is not None:
            why = "no drive data, so no part of the deflection is known"
            yield unknown(joint="tip", kind=CheckKind.TIP_DEFLECTION, why=why, limit=duty.tip_tolerance.value)
        return
    budget = tip_deflection(boom, trajectory.q, tau)
    left_out = f"; left out: {', '.join(budget.uncounted)}" if budget.uncounted else ""
    text = f"Jacobian of the tip with the gearboxes' figures; rigid links{left_out}"
    origin = Origin(Basis.weakest([basis, Basis.PRINTED]), text)
    vector = budget.wind_up
    for kind, size in (
        (CheckKind.TIP_WIND_UP, np.linalg.norm(vector, axis=-1)),
        (CheckKind.TIP_SAG, np.maximum(-vector[:, 2], 0.0)),
        (CheckKind.TIP_BACKLASH, budget.backlash),
        (CheckKind.TIP_HYSTERESIS, budget.hysteresis),
        (CheckKind.TIP_STEP_ERROR, budget.step),
    ):
        at = int(np.argmax(size))
        yield informative(joint="tip", kind=kind, figure=float(size[at]), at=float(trajectory.t[at]), origin=origin)
    if known is not None:
        at, said = int(np.argmax(budget.geometry)), f"standard deviation by the calibration's covariance; {known.origin.source}"
        yield informative(
            joint="tip",
            kind=CheckKind.TIP_GEOMETRY,
            figure=float(budget.geometry[at]),
            at=float(trajectory.t[at]),
            origin=Origin(known.origin.basis, said),
        )
        origin = Origin(origin.basis, f"{text}; with {SURE:g} standard deviations of the geometry")
    total = budget.total
    at = int(np.argmax(total))
    yield _total_row(float(total[at]), float(trajectory.t[at]), duty, origin, bool(budget.uncounted))
    frequencies = gear_frequencies(boom, M)
    if frequencies is not None and np.isfinite(frequencies).all():
        text = "arm on the first stiffness K1 of all gearboxes together; other joints locked"
        figure = float(frequencies[..., 0].min())
        yield informative(joint="tip", kind=CheckKind.TIP_FREQUENCY, figure=figure, origin=Origin(basis, text))


def _total_row(total: float, at: float, duty: Duty, origin: Origin, incomplete: bool) -> Row:
    tolerance, kind = duty.tip_tolerance, CheckKind.TIP_DEFLECTION
    if tolerance is None:
        return informative(joint="tip", kind=kind, figure=total, at=at, origin=origin)
    both = Origin(Basis.weakest([origin.basis, tolerance.origin.basis]), f"{tolerance.origin.source}; {origin.source}")
    row = compared(joint="tip", kind=kind, demand=total, limit=tolerance.value, at=at, origin=both)
    if incomplete and row.verdict is Verdict.PASS:  # the parts left out only add to the sum
        return unknown(joint="tip", kind=kind, demand=total, limit=tolerance.value, at=at, why=both.source)
    return row
