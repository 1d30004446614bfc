"""Summary of a report: the verdict, a line for each joint, and the findings.

Terminal, recording, report and notebook show the same lines.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from boom_model import JOINTS
from planner.checks.kinds import Margin, Part, Severity
from planner.checks.rows import Row, Verdict
from planner.reports.report import Report, cells

JOINT_HEADER = ("joint", "load", "tightest limit", "used", "at", "gearbox", "motor", "verdict")
"""Columns of `joint_table`. *Used*, gearbox and motor are the demand, with its required
margin, divided by the limit."""

_MOST_NAMED = 4
"""Failed checks that the sentence names; the rest are counted."""


@dataclass(frozen=True)
class Answer:
    """Summary of a report."""

    verdict: Verdict
    sentence: str
    """The verdict in words."""
    failed: str
    """What fails, in words; empty where nothing does."""
    joints: tuple[tuple[str, ...], ...]
    """A row for each joint, the mount and the tip, under JOINT_HEADER."""
    findings: tuple[str, ...]
    """Checks that FAIL or WARN, worst first, with their numbers."""
    assumed: int
    """Number of assumed figures."""


def answer(report: Report) -> Answer:
    """Return the summary of a report."""
    failed = _failed(report)
    return Answer(
        verdict=report.verdict,
        sentence=f"{report.verdict}: {failed or '; '.join(['nothing fails', *_open(report)])}",
        failed=failed,
        joints=joint_table(report),
        findings=tuple(_findings(report)),
        assumed=len(report.assumptions),
    )


def usage(row: Row) -> float | None:
    """Return the used share of a limit, demand (1 + required margin) / limit.

    A share of 1 is just allowed. Return None for a guideline, a distance to a bound, a row without
    a limit, and a brake, which carries what the gearbox cannot and has an unknown strength.
    """
    if row.kind.severity is not Severity.LIMIT or row.kind.margin is not Margin.RATIO or row.kind.part is Part.BRAKE:
        return None
    if row.demand is None or row.limit is None or row.limit <= 0.0:
        return None
    return row.demand * (1.0 + row.required_margin) / row.limit


def joint_table(report: Report) -> tuple[tuple[str, ...], ...]:
    """Return one row for each joint, the mount and the tip, under JOINT_HEADER."""
    loads = {peak.joint: f"{_rounded(abs(peak.total))} {peak.unit}" for peak in report.peaks}
    table = []
    for joint in (*JOINTS, "mount", "tip"):
        rows = [row for row in report.rows if row.joint == joint]
        if not rows:
            continue
        tightest = max((row for row in rows if usage(row) is not None), key=lambda row: usage(row) or 0.0, default=None)
        table.append(
            (
                joint,
                loads.get(joint) or _headline(rows),
                "-" if tightest is None else tightest.check,
                "-" if tightest is None else f"{usage(tightest):.2f}",
                "-" if tightest is None or tightest.at_s is None else f"{tightest.at_s:.2f} s",
                _share(rows, Part.GEARBOX),
                _share(rows, Part.MOTOR) if joint != "extension" else _share(rows, Part.ACTUATOR, Part.MOTOR),
                _joint_verdict(rows),
            )
        )
    return tuple(table)


def _headline(rows: Sequence[Row]) -> str:
    """Return the largest moment on the mount, or the largest tip deflection from the drives."""
    wanted = ("peak moment", "deflection in all")
    return next((cells(row)[2] for row in rows if row.check in wanted and row.demand is not None), "-")


def _share(rows: Iterable[Row], *parts: Part) -> str:
    shares = [share for row in rows if row.kind.part in parts and (share := usage(row)) is not None]
    return f"{max(shares):.2f}" if shares else "-"


def _joint_verdict(rows: Sequence[Row]) -> str:
    verdicts = [row.verdict for row in rows]
    if Verdict.FAIL in verdicts:
        return "FAIL"
    if any(row.kind.part is Part.UNKNOWN_DRIVE for row in rows):
        return "no drive"
    unknown = verdicts.count(Verdict.NOT_CHECKABLE)
    if Verdict.PASS not in verdicts and Verdict.WARN not in verdicts:
        return "no limit" if unknown else "info"
    return ("WARN" if Verdict.WARN in verdicts else "PASS") + (f", {unknown} open" if unknown else "")


def _failed(report: Report) -> str:
    failed = [f"{row.joint} {row.check}" for row in report.rows if row.verdict is Verdict.FAIL]
    if report.certificate is not None:
        failed += [f"{worst.joint} {worst.limit} (certificate)" for worst in report.certificate.broken]
    names = list(dict.fromkeys(failed))
    more = [f"{len(names) - _MOST_NAMED} more"] if len(names) > _MOST_NAMED + 1 else []
    return _listed([*names[:_MOST_NAMED], *more] if more else names) if names else ""


def _open(report: Report) -> list[str]:
    """Return what is not known, in words."""
    parts = []
    undriven = list(dict.fromkeys(row.joint for row in report.rows if row.kind.part is Part.UNKNOWN_DRIVE))
    if undriven:
        parts.append(f"{_listed(undriven)} {'has' if len(undriven) == 1 else 'have'} no drive to check")
    open_rows = [row for row in report.rows if row.verdict is Verdict.NOT_CHECKABLE and row.joint not in undriven]
    sheet = list(dict.fromkeys(row.joint for row in open_rows if row.joint in JOINTS))
    if sheet:
        parts.append(f"datasheets leave checks of {_listed(sheet)} open")
    if any(row.joint == "mount" for row in open_rows):
        parts.append("the mount has no limit")
    return parts


def _findings(report: Report) -> Iterable[str]:
    """Yield a line for each check that FAILs or WARNs, the worst first."""
    for verdict in (Verdict.FAIL, Verdict.WARN):
        checks: dict[str, list[Row]] = {}
        for row in sorted((row for row in report.rows if row.verdict is verdict), key=lambda row: row.check):
            checks.setdefault(row.check, []).append(row)
        for check, rows in sorted(checks.items(), key=lambda each: -max(usage(row) or 0.0 for row in each[1])):
            numbers = [f"{row.joint} {_numbers(row)}" for row in rows]
            yield f"{verdict} {check}: {', '.join(numbers)}"


def _numbers(row: Row) -> str:
    """Return demand and limit with their units."""
    demand, limit = cells(row)[2:4]
    margin = f" and {row.required_margin:.0%}" if row.required_margin > 0.0 else ""
    return demand if limit == "-" else f"{demand}{margin} of {limit}"


def _listed(names: Iterable[str]) -> str:
    *most, last = names
    return f"{', '.join(most)} and {last}" if most else last


def _rounded(value: float) -> str:
    return f"{float(f'{value:.4g}'):.12g}"
