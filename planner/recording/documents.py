"""The checks as a table, and what is assumed, as Markdown."""

from boom_model import Boom
from planner.checks.rows import Verdict
from planner.recording.arrows import WHAT_ARROWS_SHOW
from planner.recording.scene import FOR_THE_EYE
from planner.reports.markdown import section, table
from planner.reports.report import Report, cells

CHECK_HEADER = ("verdict", "joint", "check", "demand", "limit", "margin", "required", "at", "basis")


def checks_markdown(report: Report) -> str:
    """The report's rows, the verdict first; where each limit comes from stands in the report."""
    rows = []
    for row in report.rows:
        *told, verdict, basis = cells(row)
        rows.append((f"**{verdict}**" if row.verdict is Verdict.FAIL else verdict, *told, basis))
    return "\n".join([f"**{report.summary}**", "", *table(CHECK_HEADER, rows)]) + "\n"


def assumptions_markdown(boom: Boom, report: Report) -> str:
    """What a reader must know of the motion, every assumed figure, and what the picture adds of its own."""
    drawn = ["The links' lengths are the model's, their thickness is for the eye; the payload is a ball of steel of its mass."]
    drawn.append(WHAT_ARROWS_SHOW)
    drawn += [FOR_THE_EYE] if boom.keep_out is None else []
    parts = (("Assumed", report.assumptions), ("Notes", report.notes), ("Drawn", drawn))
    return "\n".join(line for title, texts in parts for line in section(title, texts)) + "\n"
