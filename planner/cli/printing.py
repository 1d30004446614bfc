"""Printing of tables, lines, JSON, error messages and progress."""

import io
import json
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import redirect_stdout, suppress
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from rich.console import Console

    from planner.reports.answer import Answer
    from planner.reports.report import Report

ANSWER_IS_NO, BAD_INPUT = 1, 2
_FEW_NOTES = 3
_LONGEST, _FEWEST = 24, 2
"""Lines of an answer, and findings that it shows at least."""
_BETWEEN = 2  # spaces between two cells
_SHORT = 18
"""Largest number of characters of a cell that is never folded."""
_LOUD = "boom.stdout"
REPLACED = "boom.replaced"
"""Key of the context for the names of files that existed before."""

STYLES = {
    "FAIL": "bold red",
    "UNSTABLE": "bold red",
    "LOST STEP": "bold red",
    "WARN": "yellow",
    "saturates": "yellow",
    "NOT CHECKABLE": "magenta",
    "INCOMPLETE": "magenta",
    "INFO": "dim",
}


def print_report(
    report: "Report",
    asked: str,
    written: Mapping[str, str],
    as_json: bool,
    whole: bool = False,
    then: str | None = None,
    cost: str | None = None,
) -> int:
    """Print a report, and return the exit code.

    Args:
        report: the report.
        asked: the request in one line.
        written: output files by kind.
        as_json: whether to print JSON instead of text.
        whole: whether to print every row, assumption and note, instead of a summary.
        then: a command to try next.
        cost: what the motion takes from the supply, in a line.
    """
    from planner.checks.rows import Verdict
    from planner.reports.answer import answer

    first = answer(report)
    if as_json:
        print_json(report.to_json(dict(written)))
    else:
        ends = [*([] if cost is None else [cost]), *(f"{kind}: {name}" for kind, name in written.items())]
        _print_answer(report, first, asked, whole, [*ends, *([] if then is None else [f"next: {then}"])])
        print_lines(None, [] if cost is None or whole else [cost])
        if whole:
            _print_details(report)
        print_files(written)
        print_lines("next", [] if then is None else [then])
    if report.verdict is not Verdict.FAIL:
        return 0
    complain(f"{report.verdict}: {first.failed}")
    return ANSWER_IS_NO


def _print_answer(report: "Report", first: "Answer", asked: str, whole: bool, ends: Sequence[str]) -> None:
    """Print the request, the verdict, the table of joints, findings, fixes and notes.

    Unless `whole`, there are no more findings than an answer of _LONGEST lines has room for, with
    the lines `ends` that follow.
    """
    from planner.reports.answer import JOINT_HEADER

    console = new_console()
    console.print(asked, highlight=False)
    console.print(first.sentence, style=STYLES.get(first.verdict), highlight=False)
    print_rows(
        JOINT_HEADER,
        first.joints,
        drop=("at", "motor", "gearbox", "used"),
        styles=[STYLES.get(r[-1][:4]) for r in first.joints],
    )
    told = [f"{len(report.notes)} notes: --all lists them"] if len(report.notes) > _FEW_NOTES else list(report.notes)
    figures = f"{first.assumed} assumed figure{'' if first.assumed == 1 else 's'}, {len(report.rows)} checks: --all lists them"
    others = [asked, first.sentence, *(f"possible fix: {each}" for each in report.suggestions), figures, *ends]
    others += [f"note: {each}" for each in told] + [f"measured: {each}" for each in report.measured]
    room = _LONGEST - 2 - len(first.joints) - sum(_lines(text, console.width) for text in others)
    shown = first.findings if whole else _first(first.findings, room, console.width)
    for finding in shown:
        console.print(finding, style=STYLES.get(finding.split()[0]), highlight=False)
    print_lines(
        None, [f"{len(first.findings) - len(shown)} more that FAIL or WARN"] if len(shown) < len(first.findings) else []
    )
    print_lines("possible fix", report.suggestions)
    if not whole:
        print_lines("note", told)
        print_lines("measured", report.measured)
        console.print(figures, highlight=False)


def _lines(text: str, width: int) -> int:
    """Return the number of lines that a text takes."""
    return max(1, len(wrap(text, width)))


def _first(findings: Sequence[str], room: int, width: int) -> Sequence[str]:
    """Return the findings that fit `room` lines, one of them for a count; at least _FEWEST."""
    if sum(_lines(each, width) for each in findings) <= room:
        return findings
    used = 1
    for k, each in enumerate(findings):
        used += _lines(each, width)
        if used > room and k >= _FEWEST:
            return findings[:k]
    return findings


def _print_details(report: "Report") -> None:
    from planner.checks.energy import ENERGY_HEADER, energy_cells
    from planner.reports.report import CERTIFICATE_HEADER, PEAK_HEADER, ROW_HEADER, cells, peak_cells, worst_cells

    rows = report.rows
    last = [i + 1 == len(rows) or rows[i + 1].joint != row.joint for i, row in enumerate(rows)]
    print_rows(
        ROW_HEADER,
        map(cells, rows),
        drop=("basis", "required", "at"),
        styles=[STYLES.get(row.verdict) for row in rows],
        ends=last,
    )
    click.echo("Largest torques and where they come from (Nm, the extension's N)")
    print_rows(PEAK_HEADER, map(peak_cells, report.peaks), drop=("at", "vehicle", "friction", "velocity"))
    if report.energy is not None:
        click.echo("Energy")
        print_rows(ENERGY_HEADER, map(energy_cells, report.energy.joints), drop=("friction", "largest"))
        print_lines(None, report.energy.sentences)
    if report.certificate is not None:
        click.echo("Worst ratio to each limit")
        print_rows(CERTIFICATE_HEADER, map(worst_cells, report.certificate.worst))
    print_lines(None, report.sentences)
    print_lines("note", report.notes)
    print_lines("measured", report.measured)
    print_lines("assumed", report.assumptions)


def print_rows(
    header: Sequence[str],
    rows: Iterable[Sequence[str]],
    drop: Sequence[str] = (),
    styles: Sequence[str | None] = (),
    ends: Sequence[bool] = (),
) -> None:
    """Print a table that fits the console; numbers stay whole.

    Args:
        header: names of the columns.
        rows: cells of each row.
        drop: columns to leave out, in this order, if the table is too wide.
        styles: style of each row.
        ends: whether each row ends a section.
    """
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    console, listed = new_console(), [tuple(row) for row in rows]
    kept = _fitting(header, listed, drop, console.width)
    table = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0))
    for i in kept:
        table.add_column(header[i], no_wrap=not _folds(listed, i), overflow="fold")
    for k, row in enumerate(listed):
        style = styles[k] if k < len(styles) else None
        table.add_row(*(row[i] for i in kept), style=style, end_section=k < len(ends) and ends[k])
    console.print(table)
    left = [header[i] for i in range(len(header)) if i not in kept]
    if left:
        console.print(f"(a wider terminal also shows: {', '.join(left)})", style="dim", highlight=False)


def _folds(rows: Sequence[Sequence[str]], column: int) -> bool:
    """Return whether a column may be folded, because it has long text."""
    return max((len(row[column]) for row in rows), default=0) > _SHORT


def _fitting(header: Sequence[str], rows: Sequence[Sequence[str]], drop: Sequence[str], width: int) -> list[int]:
    """Return the columns that fit a width.

    Text is folded down to its longest word before a column is left out.
    """

    def needed(i: int) -> int:
        column = [header[i], *(row[i] for row in rows)]
        if _folds(rows, i):
            return max(len(word) for cell in column for word in cell.split() or [""])
        return max(map(len, column))

    kept = list(range(len(header)))
    in_turn = [header.index(name) for name in drop if name in header]
    in_turn += [i for i in reversed(range(1, len(header) - 1)) if i not in in_turn]  # the first and the last column stay
    for i in (None, *in_turn):
        if i is not None:
            kept.remove(i)
        if sum(needed(i) + _BETWEEN for i in kept) - _BETWEEN <= width:
            break
    return kept


def print_lines(title: str | None, lines: Iterable[str]) -> None:
    """Print each line, after the title if there is one, folded to the width of the console."""
    console = new_console()
    for line in lines:
        console.print(line if title is None else f"{title}: {line}", highlight=False)


def print_files(written: Mapping[str, str]) -> None:
    """Print the output files by kind, and whether each replaced a file. Names are never folded."""
    replaced = click.get_current_context().meta.get(REPLACED, ())
    for kind, name in written.items():
        click.echo(f"{kind}: {name}{', replaced' if name in replaced else ''}")


def print_json(answer: dict[str, Any]) -> None:
    """Print one JSON object, even with --quiet."""
    out = click.get_current_context().meta.get(_LOUD, sys.stdout)
    click.echo(json.dumps(answer, allow_nan=False, indent=2), file=out)


def complain(message: str) -> None:
    """Print one line on standard error, if that can be written."""
    with suppress(OSError):
        click.echo(f"boom: {' '.join(message.split())}", err=True)


def tracked(title: str) -> Callable[[list[Any]], Iterable[Any]]:
    """Return a `Track` with a progress bar on standard error, if that is a terminal."""

    def track(steps: list[Any]) -> Iterable[Any]:
        from rich.console import Console
        from rich.progress import track as bar

        return bar(steps, title, console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty() or is_quiet())

    return track


def is_quiet() -> bool:
    """Return whether --quiet is given."""
    return _LOUD in click.get_current_context().meta


def quieten(ctx: click.Context, _: click.Parameter, quiet: bool) -> None:
    """Discard standard output until the command ends, except for JSON."""
    if not quiet or _LOUD in ctx.meta:
        return
    ctx.meta[_LOUD], nowhere = sys.stdout, io.StringIO()
    ctx.with_resource(redirect_stdout(nowhere))


def new_console() -> "Console":
    """Return a console as wide as the terminal or COLUMNS, or 80 columns wide in a pipe."""
    from rich.console import Console

    return Console(markup=False, soft_wrap=False)  # a unit in brackets is not markup
