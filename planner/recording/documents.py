"""The checks as a table, and what is assumed, as Markdown."""

from boom_model import Boom
from planner.recording.arrows import WHAT_ARROWS_SHOW
from planner.recording.scene import FOR_THE_EYE
from planner.report import Report, cells

CHECK_HEADER = ("verdict", "joint", "check", "demand", "limit", "margin", "required", "at", "basis")


def checks_markdown(report: Report) -> str:
    """The report's rows, the verdict first; where each limit comes from stands in the report."""
    lines = [f"**{report.summary}**", "", "| " + " | ".join(CHECK_HEADER) + " |", "|" + " --- |" * len(CHECK_HEADER)]
    for row in report.rows:
        joint, check, demand, limit, margin, required, at, verdict, basis = cells(row)
        told = f"**{verdict}**" if verdict == "FAIL" else str(verdict)
        lines.append("| " + " | ".join((told, joint, check, demand, limit, margin, required, at, basis)) + " |")
    return "\n".join(lines) + "\n"


def assumptions_markdown(boom: Boom, report: Report) -> str:
    """What a reader must know of the motion, every assumed figure, and what the picture adds of its own."""
    drawn = ["The links' lengths are the model's, their thickness is for the eye; the payload is a ball of steel of its mass."]
    drawn.append(WHAT_ARROWS_SHOW)
    drawn += [FOR_THE_EYE] if boom.keep_out is None else []
    lines = []
    for title, texts in (("Assumed", report.assumptions), ("Notes", report.notes), ("Drawn", drawn)):
        if texts:
            lines += [f"## {title}", "", *(f"- {text}" for text in texts), ""]
    return "\n".join(lines)
