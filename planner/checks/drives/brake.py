"""Whether a joint holds its load without power."""

from boom_model import Basis, Sourced
from planner.checks.drives.joint_view import JointView
from planner.checks.kinds import CheckKind
from planner.checks.rows import Row, Verdict


def power_off_row(
    view: JointView, *, demand: float, limit: float | None, at: float, brake: Sourced[bool] | None, held: str, unheld: str
) -> Row:
    """The row of a joint without power: only a declared brake holds, and one that is not printed WARNs.

    Args:
        demand, at: the largest static torque, and its time.
        limit: the torque that starts to drive gearbox or screw back. It is shown, and does not decide.
        held, unheld: the source with a brake, and the reason without one.
    """
    if brake is not None and brake.value:
        verdict = Verdict.WARN if brake.origin.basis is not Basis.PRINTED else Verdict.PASS
        basis, source = brake.origin.basis, f"held by a brake: {brake.origin.source}; {held}"
    else:
        verdict, basis, source = Verdict.FAIL, Basis.PRINTED, unheld
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
