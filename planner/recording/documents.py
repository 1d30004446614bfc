"""Answer, checks and assumptions of a report as Markdown documents."""

from boom_model import Boom
from planner.checks.rows import Verdict
from planner.planning import Move
from planner.recording.arrows import ARROWS_NOTE
from planner.recording.scene import SURROUNDINGS_NOTE
from planner.reports.answer import JOINT_HEADER, answer
from planner.reports.first_page import circumstances
from planner.reports.markdown import section, table
from planner.reports.report import Report, cells

CHECK_HEADER = ("verdict", "joint", "check", "demand", "limit", "margin", "required", "at", "basis")


def answer_markdown(move: Move, report: Report, title: str = "") -> str:
    """Return what the command prints first: verdict, joints, findings, possible fixes.

    Args:
        move: the move.
        report: its report.
        title: what moves where; empty for a motion without a name.
    """
    first = answer(report)
    listed = [*first.findings, *(f"possible fix: {each}" for each in report.suggestions)]
    listed += [f"measured: {each}" for each in report.measured]
    counted = f"{first.assumed} assumed figures, {len(report.rows)} checks: see the tab Assumptions."
    return "\n".join(
        [
            f"# {first.verdict}",
            "",
            f"{title}{': ' if title else ''}{circumstances(move.boom, move.vehicle, report)}",
            "",
            first.sentence.partition(": ")[2],
            "",
            *table(JOINT_HEADER, first.joints),
            "",
            *(f"- {each}" for each in listed),
            "",
            counted,
        ]
    )


def checks_markdown(report: Report) -> str:
    """Return the rows of a report as a table with the verdict first.

    The report itself names the source of each limit.
    """
    rows = []
    for row in report.rows:
        *figures, verdict, basis = cells(row)
        rows.append((f"**{verdict}**" if row.verdict is Verdict.FAIL else verdict, *figures, basis))
    return "\n".join([f"**{report.summary}**", "", *table(CHECK_HEADER, rows)]) + "\n"


def assumptions_markdown(boom: Boom, report: Report) -> str:
    """Return the assumed values, the notes on the motion, and notes on the 3D view."""
    drawn = [
        "The links have the lengths of the model; their thickness is for display only. "
        "The payload is drawn as a steel ball of the payload's mass.",
        ARROWS_NOTE,
        *([SURROUNDINGS_NOTE] if boom.keep_out is None else []),
    ]
    parts = (("Assumed", report.assumptions), ("Notes", report.notes), ("Drawn", drawn))
    return "\n".join(line for title, texts in parts for line in section(title, texts)) + "\n"
