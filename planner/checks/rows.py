"""Rows of a report: one demand compared with one limit, and the verdict."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from boom_model import Basis, Origin
from boom_model.boom import LIMIT_TOLERANCE
from planner.checks.kinds import CheckKind, Severity, Unit

SAMPLING_SLACK = 1e-3
"""Share of a limit within which a demand counts as equal to it.

Checks see a motion at samples only, and solvers end within a tolerance.
"""

ESTIMATE_WARNING = 0.25
"""Margin beyond the required one below which an estimated or assumed limit WARNs."""


class Verdict(StrEnum):
    """Verdict of a row or of a report. A report is PASS, FAIL or INCOMPLETE."""

    PASS = "PASS"
    WARN = "WARN"
    FAIL = "FAIL"
    NOT_CHECKABLE = "NOT CHECKABLE"
    INFO = "INFO"
    """Figure for information, with no limit or with one that does not decide."""
    INCOMPLETE = "INCOMPLETE"
    """No row failed, and at least one could not be checked."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """One demand compared with one limit, in SI."""

    joint: str
    kind: CheckKind
    demand: float | None
    limit: float | None
    margin: float | None
    """Margin as `kind.margin` defines it; None without a limit or a demand."""
    at_s: float | None
    verdict: Verdict
    basis: Basis | None
    """Weakest basis of the figures that decide the row; None if it is not checkable."""
    source: str
    subject: str = ""
    """Objects of the check, as in "of payload to post"; empty for most kinds."""

    @property
    def check(self) -> str:
        """Text of the kind, followed by the subject."""
        return f"{self.kind} {self.subject}" if self.subject else str(self.kind)

    @property
    def unit(self) -> str:
        """SI unit of demand and limit."""
        return self.kind.quantity.unit(self.joint)

    @property
    def shown_unit(self) -> Unit:
        """Displayed unit of demand and limit."""
        return self.kind.quantity.for_people(self.joint)

    @property
    def required_margin(self) -> float:
        """Smallest margin that passes."""
        return self.kind.required_margin

    def to_json(self) -> dict[str, Any]:
        """Return the row as an object of the JSON of `boom plan` and `boom check`, in SI."""
        return {
            "joint": self.joint,
            "check": self.check,
            "demand": self.demand,
            "limit": self.limit,
            "unit": self.unit,
            "margin": self.margin,
            "required_margin": self.required_margin,
            "at_s": self.at_s,
            "verdict": self.verdict,
            "basis": self.basis,
            "source": self.source,
        }


def compared(
    *,
    joint: str,
    kind: CheckKind,
    demand: float,
    limit: float | None,
    origin: Origin,
    at: float | None = None,
    warn_near: bool = False,
) -> Row:
    """Return the row of a demand that must not exceed its limit.

    The row is NOT CHECKABLE without a limit. If the margin is too small, a guideline WARNs and a
    limit check FAILs.

    Args:
        joint: the joint, or the part of the boom that is no joint.
        kind: the kind of check.
        demand: the largest demand.
        limit: the limit; None if it is not known.
        origin: source of the limit, or the reason why there is none.
        at: time of the demand [s].
        warn_near: whether the row WARNs if its margin exceeds the required one by less than
            ESTIMATE_WARNING. It is for limits that are only estimated.
    """
    if limit is None:
        return unknown(joint=joint, kind=kind, demand=demand, at=at, why=origin.source)
    margin, required = _ratio(demand, limit), kind.required_margin
    if margin is None or margin >= required + (ESTIMATE_WARNING if warn_near else 0.0):
        verdict = Verdict.PASS
    elif not margin >= required - SAMPLING_SLACK:
        verdict = Verdict.WARN if kind.severity is Severity.GUIDELINE else Verdict.FAIL
    else:
        verdict = Verdict.WARN if warn_near else Verdict.PASS
    return Row(
        joint=joint,
        kind=kind,
        demand=demand,
        limit=limit,
        margin=margin,
        at_s=at,
        verdict=verdict,
        basis=origin.basis,
        source=origin.source,
    )


def bounded(
    *, joint: str, kind: CheckKind, value: float, bound: float, distance: float, at: float, origin: Origin, subject: str = ""
) -> Row:
    """Return the row of a position, angle or distance that has a bound.

    `distance` is the distance to the bound, negative beyond it. Beyond the bound a guideline WARNs
    and a limit check FAILs.
    """
    guideline = kind.severity is Severity.GUIDELINE
    inside = distance >= (0.0 if guideline else -LIMIT_TOLERANCE)
    return Row(
        joint=joint,
        kind=kind,
        demand=float(value),
        limit=float(bound),
        margin=0.0 if abs(distance) <= LIMIT_TOLERANCE and not guideline else float(distance),
        at_s=float(at),
        verdict=Verdict.PASS if inside else Verdict.WARN if guideline else Verdict.FAIL,
        basis=origin.basis,
        source=origin.source,
        subject=subject,
    )


def informative(
    *, joint: str, kind: CheckKind, figure: float | None, origin: Origin, at: float | None = None, limit: float | None = None
) -> Row:
    """Return the row of a figure for information; NOT CHECKABLE if the figure is None.

    The row shows `limit`, which does not decide the verdict.
    """
    if figure is None:
        return unknown(joint=joint, kind=kind, why=origin.source)
    return Row(
        joint=joint,
        kind=kind,
        demand=figure,
        limit=limit,
        margin=None if limit is None else _ratio(figure, limit),
        at_s=at,
        verdict=Verdict.INFO,
        basis=origin.basis,
        source=origin.source,
    )


def unknown(
    *,
    joint: str,
    kind: CheckKind,
    why: str,
    demand: float | None = None,
    limit: float | None = None,
    at: float | None = None,
) -> Row:
    """Return the row of a check that cannot be made because the limit or the demand is missing."""
    return Row(
        joint=joint,
        kind=kind,
        demand=demand,
        limit=limit,
        margin=None,
        at_s=at,
        verdict=Verdict.NOT_CHECKABLE,
        basis=None,
        source=why,
    )


def overall(rows: Iterable[Row]) -> Verdict:
    """Return the verdict of all rows together.

    FAIL if a row fails, else INCOMPLETE if a row is not checkable, else PASS. A WARN passes.
    """
    verdicts = {row.verdict for row in rows}
    if Verdict.FAIL in verdicts:
        return Verdict.FAIL
    return Verdict.INCOMPLETE if Verdict.NOT_CHECKABLE in verdicts else Verdict.PASS


def _ratio(demand: float, limit: float) -> float | None:
    return (limit - demand) / demand if demand > 0.0 else None
