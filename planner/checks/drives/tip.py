"""What the drives let the tip deflect along a motion: wind-up, backlash, hysteresis and step error, in an error budget."""

from collections.abc import Iterator

import numpy as np

from boom_model import Basis, Boom, Origin, gear_frequencies, tip_deflection
from boom_model.arrays import Array
from planner.checks.drives.duty import Duty
from planner.checks.rows import Row, Verdict, held, told
from planner.motion.trajectory import Trajectory


def tip_rows(boom: Boom, trajectory: Trajectory, tau: Array, duty: Duty, M: Array, basis: Basis) -> Iterator[Row]:
    """The parts of the budget at their worst, their sum against the tolerance, and the arm's first frequency on its gearboxes.

    Args:
        tau: (n, 5) joint torques.
        M: (m, 5, 5) mass matrix at some of the motion's poses.
        basis: of the torques.
    """
    if all(drive is None for drive in boom.drives):
        if duty.tip_tolerance is not None:
            why = "no drive data: nothing of the budget is known"
            facts = (None, duty.tip_tolerance.value, "m", None, 0.0, None)
            yield Row("tip", "deflection in all", *facts, Verdict.NOT_CHECKABLE, None, why)
        return
    budget = tip_deflection(boom, trajectory.q, tau)
    left_out = f"; left out: {', '.join(budget.uncounted)}" if budget.uncounted else ""
    origin = Origin(basis, f"tip's Jacobian on the gearboxes' figures; links are rigid{left_out}")
    vector = budget.wind_up
    for check, size in (
        ("wind-up", np.linalg.norm(vector, axis=-1)),
        ("sag by wind-up", np.maximum(-vector[:, 2], 0.0)),
        ("backlash", budget.backlash),
        ("hysteresis", budget.hysteresis),
        ("step error", budget.step),
    ):
        at = int(np.argmax(size))
        yield told("tip", check, float(size[at]), "m", float(trajectory.t[at]), origin)
    at = int(np.argmax(budget.total))
    yield _total_row(float(budget.total[at]), float(trajectory.t[at]), duty, origin, bool(budget.uncounted))
    frequencies = gear_frequencies(boom, M)
    if frequencies is not None and np.isfinite(frequencies).all():
        text = "the arm on all gearboxes' first stiffness K1 together, other joints locked"
        yield told("tip", "first frequency", float(frequencies[..., 0].min()), "Hz", None, Origin(basis, text))


def _total_row(total: float, at: float, duty: Duty, origin: Origin, incomplete: bool) -> Row:
    tolerance, check = duty.tip_tolerance, "deflection in all"
    if tolerance is None:
        return told("tip", check, total, "m", at, origin)
    both = Origin(Basis.weakest([origin.basis, tolerance.origin.basis]), f"{tolerance.origin.source}; {origin.source}")
    row = held("tip", check, total, tolerance.value, "m", at, both)
    if incomplete and row.verdict is Verdict.PASS:  # what is left out can only add to it
        return Row("tip", check, total, tolerance.value, "m", None, 0.0, at, Verdict.NOT_CHECKABLE, None, both.source)
    return row
