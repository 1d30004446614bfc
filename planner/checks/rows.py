"""The rows of a report: one demand held against one limit, and the verdict."""

from dataclasses import dataclass
from enum import StrEnum

from boom_model import Basis, Origin

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


@dataclass(frozen=True)
class Row:
    """One demand held against one limit, in SI."""

    joint: str
    check: str
    demand: float | None
    limit: float | None
    unit: str
    margin: float | None
    """(limit - demand) / demand; the distance to the bound, in `unit`, for positions. None where there is no limit, or
    nothing is asked."""
    required_margin: float
    at_s: float | None
    verdict: Verdict
    basis: Basis | None
    """The weakest of the figures that decide the row; None where nothing decides it."""
    source: str


def held(
    joint: str,
    check: str,
    demand: float,
    limit: float | None,
    unit: str,
    at: float | None,
    origin: Origin,
    required: float = 0.0,
    warn_near: bool = False,
) -> Row:
    """A demand against a limit that it may not exceed; without a limit, NOT CHECKABLE."""
    if limit is None:
        return Row(joint, check, demand, None, unit, None, required, at, Verdict.NOT_CHECKABLE, None, origin.source)
    margin = _margin(demand, limit)
    if margin is None or margin >= required + (ESTIMATE_WARNING if warn_near else 0.0):
        verdict = Verdict.PASS
    elif not margin >= required - SAMPLING_SLACK:
        verdict = Verdict.FAIL
    else:
        verdict = Verdict.WARN if warn_near else Verdict.PASS
    return Row(joint, check, demand, limit, unit, margin, required, at, verdict, origin.basis, origin.source)


def guided(joint: str, check: str, demand: float, limit: float | None, unit: str, at: float | None, origin: Origin) -> Row:
    """A demand against a rule of thumb: beyond it WARN, never FAIL; without a figure, NOT CHECKABLE."""
    row = held(joint, check, demand, limit, unit, at, origin)
    verdict = Verdict.WARN if row.verdict is Verdict.FAIL else row.verdict
    return Row(joint, check, demand, limit, unit, row.margin, 0.0, at, verdict, row.basis, origin.source)


def told(
    joint: str, check: str, figure: float | None, unit: str, at: float | None, origin: Origin, limit: float | None = None
) -> Row:
    """A figure for information, beside a `limit` that does not decide; one that cannot be had is NOT CHECKABLE."""
    if figure is None:
        return Row(joint, check, None, None, unit, None, 0.0, None, Verdict.NOT_CHECKABLE, None, origin.source)
    margin = None if limit is None else _margin(figure, limit)
    return Row(joint, check, figure, limit, unit, margin, 0.0, at, Verdict.INFO, origin.basis, origin.source)


def overall(rows: tuple[Row, ...]) -> Verdict:
    """FAIL where a row fails, INCOMPLETE where one could not be checked, PASS otherwise (a WARN passes)."""
    verdicts = {row.verdict for row in rows}
    if Verdict.FAIL in verdicts:
        return Verdict.FAIL
    return Verdict.INCOMPLETE if Verdict.NOT_CHECKABLE in verdicts else Verdict.PASS


def _margin(demand: float, limit: float) -> float | None:
    return (limit - demand) / demand if demand > 0.0 else None
