"""Check that a joint holds its load without power."""

from boom_model import Basis, Sourced
from planner.checks.drives.joint_view import JointView
from planner.checks.kinds import CheckKind
from planner.checks.rows import Row, Verdict


def power_off_row(
    view: JointView,
    *,
    demand: float,
    limit: float | None,
    at: float,
    brake: Sourced[bool] | None,
    with_brake: str,
    without_brake: str,
) -> Row:
    """Return the row of a joint without power.

    Only a declared brake passes. A brake that is estimated or assumed WARNs.

    Args:
        view: motion of the joint.
        demand: largest static torque.
        limit: torque at which the gearbox or screw starts to backdrive. The row shows it, but it
            does not decide.
        at: time of the largest static torque [s].
        brake: whether there is a brake; None if nothing is declared.
        with_brake: source text added if there is a brake.
        without_brake: source text if there is none.
    """
    if brake is not None and brake.value:
        declared = brake.origin.basis in (Basis.MEASURED, Basis.PRINTED)
        verdict = Verdict.PASS if declared else Verdict.WARN
        basis, source = brake.origin.basis, f"held by a brake: {brake.origin.source}; {with_brake}"
    else:
        verdict, basis, source = Verdict.FAIL, Basis.PRINTED, without_brake
    return Row(
        joint=view.joint,
        kind=CheckKind.POWER_OFF_HOLD,
        demand=demand,
        limit=limit,
        margin=None,
        at_s=at,
        verdict=verdict,
        basis=basis,
        source=source,
    )
