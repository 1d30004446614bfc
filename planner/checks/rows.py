"""The rows of a report: one demand held against one limit, and the verdict."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from boom_model import Basis, Origin
from boom_model.boom import LIMIT_TOLERANCE
from planner.checks.kinds import CheckKind, Severity, Unit

SAMPLING_SLACK = 1e-3
"""A demand within 0.1 % of its limit is on it: a motion is seen at samples, and solvers end within a tolerance."""

ESTIMATE_WARNING = 0.25
"""A margin on an estimated or assumed figure that exceeds the required one by less than this is a WARN, not a PASS."""


class Verdict(StrEnum):
    """Of a row; a whole report is PASS, FAIL or INCOMPLETE."""

    PASS = "PASS"
    WARN = "WARN"
    FAIL = "FAIL"
    NOT_CHECKABLE = "NOT CHECKABLE"
    INFO = "INFO"
    """A figure that has no limit of its own, or none that decides."""
    INCOMPLETE = "INCOMPLETE"


@dataclass(frozen=True, kw_only=True)
class Row:
    """One demand held against one limit, in SI."""

    joint: str
    kind: CheckKind
    demand: float | None
    limit: float | None
    margin: float | None
    """As `kind.margin` says; None where there is no limit, or no demand."""
    at_s: float | None
    verdict: Verdict
    basis: Basis | None
    """The weakest of the figures that decide the row; None where nothing decides it."""
    source: str
    subject: str = ""
    """What is checked against what, of a kind that has several rows."""

    @property
    def check(self) -> str:
        """The kind in words, with its subject."""
        return f"{self.kind} {self.subject}" if self.subject else str(self.kind)

    @property
    def unit(self) -> str:
        """SI unit of demand and limit."""
        return self.kind.quantity.unit(self.joint)

    @property
    def shown_unit(self) -> Unit:
        """The unit in which people read demand and limit."""
        return self.kind.quantity.for_people(self.joint)

    @property
    def required_margin(self) -> float:
        return self.kind.required_margin

    def to_json(self) -> dict[str, Any]:
        """The row's object in the JSON of `boom plan` and `boom check`, in SI."""
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
    """A demand held against a limit that it may not exceed; NOT CHECKABLE without one.

    Beyond the limit a guideline WARNs and a limit FAILs.

    Args:
        warn_near: whether a limit that is only estimated WARNs where the margin is within ESTIMATE_WARNING of the required one.
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
    """A position or an angle and its distance to the bound, negative beyond it: a limit FAILs there, a guideline WARNs."""
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
    """A figure for information, beside a `limit` that does not decide; NOT CHECKABLE where there is no figure."""
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
    """A check that cannot be made, for want of a limit or of the demand."""
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
    """FAIL where a row fails, INCOMPLETE where one could not be checked, PASS otherwise (a WARN passes)."""
    verdicts = {row.verdict for row in rows}
    if Verdict.FAIL in verdicts:
        return Verdict.FAIL
    return Verdict.INCOMPLETE if Verdict.NOT_CHECKABLE in verdicts else Verdict.PASS


def _ratio(demand: float, limit: float) -> float | None:
    return (limit - demand) / demand if demand > 0.0 else None
