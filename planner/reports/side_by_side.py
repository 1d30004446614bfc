"""Several reports side by side, check by check."""

from collections.abc import Mapping, Sequence

from boom_model import JOINTS
from boom_model.words import unknown
from planner.checks.kinds import DRIVE_PARTS
from planner.checks.rows import Row
from planner.reports.answer import joint_table
from planner.reports.markdown import section, table
from planner.reports.report import Report, cells

_NOT_JOINTS = ("mount", "tip")


def compared(reports: Mapping[str, Report], joints: Sequence[str]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return header and rows of a table: the drive checks of some joints, two columns per report.

    Args:
        reports: the reports by name, in order.
        joints: the joints to show; "tip" and "mount" are also allowed. Empty shows all.

    Raises:
        InputError: unknown joint.
    """
    for joint in joints:
        if joint not in (*JOINTS, *_NOT_JOINTS):
            raise unknown("joint", joint, (*JOINTS, *_NOT_JOINTS))
    by_check: dict[tuple[str, str], dict[str, Row]] = {}
    for name, report in reports.items():
        for row in report.rows:
            if not joints or row.joint in joints:
                by_check.setdefault((row.joint, row.check), {})[name] = row
    header = ("joint", "check", *(text for name in reports for text in (f"{name}: demand of limit", "margin, verdict")))
    rows = []
    for (joint, check), found in by_check.items():
        kind = next(iter(found.values())).kind
        if joint in _NOT_JOINTS or kind.part in DRIVE_PARTS:
            rows.append((joint, check, *(text for name in reports for text in _pair(found.get(name)))))
    return header, rows


def comparison_markdown(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return the table of `compared` as Markdown."""
    return "\n".join(table(header, rows)) + "\n"


def side_by_side_markdown(reports: Mapping[str, Report], joints: Sequence[str]) -> str:
    """Return several reports as one in Markdown.

    It contains their summaries, the table of `compared`, the notes of each report, and the
    assumptions.

    Raises:
        InputError: as `compared`.
    """
    lines = ["# " + ", ".join(reports), "", *(f"- {name}: {report.summary}" for name, report in reports.items()), ""]
    lines += table(*compared(reports, joints))
    for name, report in reports.items():
        lines += section(f"Notes on {name}", report.notes)
    lines += section("Assumed", list(dict.fromkeys(text for report in reports.values() for text in report.assumptions)))
    return "\n".join(lines) + "\n"


def _pair(row: Row | None) -> tuple[str, str]:
    if row is None:
        return "-", "-"
    _, _, demand, limit, margin, *_ = cells(row)
    asked = demand if limit == "-" else f"{demand} of {limit}"
    return asked, row.verdict if margin == "-" else f"{margin}, {row.verdict}"


def loads_side_by_side(reports: Mapping[str, Report]) -> list[tuple[str, ...]]:
    """Return a row per joint: largest load, share of the tightest limit, verdict by report."""
    tables = [{row[0]: row for row in joint_table(report)} for report in reports.values()]
    rows = []
    for joint in dict.fromkeys(name for each in tables for name in each):
        found = [each.get(joint) for each in tables]
        rows.append((joint, *("-" if row is None else f"{row[1]}, {row[3]}, {row[-1]}" for row in found)))
    return rows
