"""What the commands print: tables, sentences, JSON, complaints and progress."""

import io
import json
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import redirect_stdout, suppress
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from planner.reports.report import Report

ANSWER_IS_NO, BAD_INPUT = 1, 2
_PIPE_WIDTH = 132
_LOUD = "boom.stdout"

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


def print_report(report: "Report", written: dict[str, str], as_json: bool) -> int:
    """Prints a report as tables and sentences or as JSON; returns the exit code."""
    from planner.checks.rows import Verdict
    from planner.reports.report import CERTIFICATE_HEADER, PEAK_HEADER, cells, peak_cells, worst_cells

    if as_json:
        print_json(report.to_json(written))
    else:
        table = new_table("joint", "check", "demand", "limit", "margin", "required", "at", "verdict", "basis")
        for i, row in enumerate(report.rows):
            last = i + 1 == len(report.rows) or report.rows[i + 1].joint != row.joint
            table.add_row(*cells(row), style=STYLES.get(row.verdict), end_section=last)
        console = new_console()
        console.print(table)
        click.echo("Largest torques and where they come from (Nm, the extension's N)")
        print_rows(PEAK_HEADER, map(peak_cells, report.peaks))
        if report.certificate is not None:
            click.echo("Worst ratio to each limit")
            print_rows(CERTIFICATE_HEADER, map(worst_cells, report.certificate.worst))
        for sentence in report.sentences:
            click.echo(sentence)
        print_lines("Note", report.notes)
        print_lines("Assumed", report.assumptions)
        print_lines("Would mend it", report.suggestions)
        console.print(f"{report.profile}, {report.duration:.3f} s", highlight=False)
        console.print(report.summary, style=STYLES.get(report.verdict), highlight=False, soft_wrap=True)
        print_files(written)
    if report.verdict is not Verdict.FAIL:
        return 0
    complain(report.summary)
    return ANSWER_IS_NO


def print_rows(header: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Prints a table."""
    table = new_table(*header)
    for row in rows:
        table.add_row(*row)
    new_console().print(table)


def print_lines(title: str | None, lines: Iterable[str]) -> None:
    """Prints each line after its title; nothing without one."""
    for line in () if title is None else lines:
        click.echo(f"{title}: {line}")


def print_files(written: Mapping[str, str]) -> None:
    """Prints what was written, by kind."""
    for kind, name in written.items():
        click.echo(f"{kind}: {name}")


def print_json(answer: dict[str, Any]) -> None:
    """Prints one JSON object, even where --quiet is given."""
    out = click.get_current_context().meta.get(_LOUD, sys.stdout)
    click.echo(json.dumps(answer, allow_nan=False, indent=2), file=out)


def complain(message: str) -> None:
    """Prints one line on standard error, where that can be written."""
    with suppress(OSError):
        click.echo(f"boom: {' '.join(message.split())}", err=True)


def tracked(title: str) -> Callable[[list[Any]], Iterable[Any]]:
    """Iteration with a progress bar on standard error, where that is a terminal."""

    def track(steps: list[Any]) -> Iterable[Any]:
        from rich.console import Console
        from rich.progress import track as bar

        return bar(steps, title, console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty() or is_quiet())

    return track


def is_quiet() -> bool:
    """Whether --quiet is given."""
    return _LOUD in click.get_current_context().meta


def quieten(ctx: click.Context, _: click.Parameter, quiet: bool) -> None:
    """Standard output goes nowhere until the command ends; JSON, which was asked for, still goes out."""
    if not quiet or _LOUD in ctx.meta:
        return
    ctx.meta[_LOUD], nowhere = sys.stdout, io.StringIO()
    ctx.with_resource(redirect_stdout(nowhere))


def new_console() -> "Console":
    """A console as wide as the terminal, or of a fixed width in a pipe."""
    from rich.console import Console

    width = None if sys.stdout.isatty() else _PIPE_WIDTH
    return Console(width=width, markup=False)  # a unit in brackets is no style


def new_table(*columns: str) -> "Table":
    """An empty table with these columns."""
    from rich.box import SIMPLE
    from rich.table import Table

    return Table(*columns, box=SIMPLE, pad_edge=False)
