"""A row scan in words: its answer's lines, its report in Markdown, and the columns of its plots."""

from typing import Any

from planner.checks.rows import Verdict
from planner.field.scan import Scan
from planner.field.scan_day import STARTS
from planner.reports.markdown import section, table

_KINDS = {"stop": "at stops", "pass": "past plots", "drive": "between", "back": "back", "turn": "in turns"}


def headline(scan: Scan) -> str:
    """Return what is scanned and how."""
    visit = next(visit for visit in scan.visits if visit.lines)
    if scan.task.speed is None:
        how = f"{sum(len(v.stops) for v in scan.visits)} stops, {len(visit.lines)} lines a plot"
    elif visit.ground:
        across = visit.ground[0][0].crossing.lines
        how = f"{_passes(scan)} at {scan.task.speed:g} m/s, {across} lines across"
    else:
        how = f"{_passes(scan)} at {scan.task.speed:g} m/s, the boom still"
    return f"{scan.plots.source}: {len(scan.plots.names)} plots, {how}, track at {scan.offset:g} m"


def _passes(scan: Scan) -> str:
    return f"{scan.passes} pass{'es' if scan.passes > 1 else ''} a row"


def seen_line(scan: Scan) -> str:
    """Return how much of the plots is seen."""
    low, high = f"{scan.coverage.min():.1%}", f"{scan.coverage.max():.1%}"
    return f"{low if low == high else f'{low} to {high}'} of each plot seen, each spot {scan.overlap.mean():.1f} times"


def day_seconds(scan: Scan) -> dict[str, float]:
    """Return the seconds of the day by what the vehicle does."""
    found: dict[str, float] = {}
    for leg in scan.legs:
        found[leg.what] = found.get(leg.what, 0.0) + leg.duration
    return found


def day_line(scan: Scan) -> str:
    """Return the day's time and what it is spent on."""
    parts = ", ".join(f"{seconds / 60:.1f} {_KINDS[what]}" for what, seconds in day_seconds(scan).items())
    return f"day: {scan.duration / 60:.1f} min: {parts}"


def pass_lines(scan: Scan) -> list[str]:
    """Return up to which speed the boom can follow the ground with fewer passes than are driven."""
    fewer = [each for each in scan.options if each.passes < scan.passes]
    if not fewer:
        return []
    speeds = [
        f"{each.passes} pass{'es' if each.passes > 1 else ''}: {each.speed:.3f} m/s"
        if each.speed
        else f"{each.passes}: no reach"
        for each in fewer
    ]
    return [f"with fewer passes the boom follows the ground up to about: {', '.join(speeds)}"]


def assumptions(scan: Scan) -> list[str]:
    """Return what is assumed of the vehicle."""
    task = scan.task
    speeds = f"{task.turn_radius:g} m turns at {task.drive_speed:g} m/s"
    starts = f"starts and stops of {STARTS:g} m/s^2 take {scan.starting:.2f} of what the drives hold"
    return [f"{speeds}; {starts}; level ground, constant speed past plots, no shocks"]


def scan_columns(scan: Scan) -> dict[str, list[Any]]:
    """Return the columns of the plots' file, one value a plot."""
    return {
        "coverage": [round(float(x), 4) for x in scan.coverage],
        "overlap": [round(float(x), 2) for x in scan.overlap],
        "time_s": [round(float(x), 1) for x in scan.seconds],
        "energy_J": [round(float(x), 1) for x in scan.energy],
        "reason": [scan.unreachable.get(name, "") for name in scan.plots.names],
    }


def scan_report(scan: Scan, failed: str = "") -> str:
    """Return the report in Markdown; its first paragraph is the verdict."""
    open_ = any(move.report.verdict is Verdict.INCOMPLETE for move in scan.moves.values())
    fine = "INCOMPLETE: nothing fails, some drives have no data" if open_ else "PASS: nothing fails"
    verdict = f"FAIL: {failed}" if failed else f"{fine}; {seen_line(scan)}"
    said = [headline(scan), day_line(scan), *pass_lines(scan)]
    lines = ["# Row scan", "", verdict, *(line for text in said for line in ("", f"{text[0].upper()}{text[1:]}."))]
    lines += ["", "## Plots", ""]
    columns = scan_columns(scan)
    header = ("plot", "seen", "times", "time", "work of joints", "reason")
    rows = [
        (name, f"{c:.1%}", f"{o:g}", f"{t:g} s", f"{e:g} J", why)
        for name, c, o, t, e, why in zip(scan.plots.names, *columns.values(), strict=True)
    ]
    lines += table(header, rows)
    lines += ["", "## Moves", ""]
    moves = []
    for name, move in scan.moves.items():
        worst = None if move.report.certificate is None else max(move.report.certificate.worst, key=lambda each: each.ratio)
        tightest = "" if worst is None else f"{worst.limit} of {worst.joint}"
        ratio = "" if worst is None else f"{worst.ratio:.3f}"
        moves.append((name, f"{move.report.duration:.2f} s", str(move.report.verdict), tightest, ratio))
    lines += table(("move", "time", "verdict", "tightest limit", "ratio"), moves)
    if scan.options:
        lines += ["", "## Passes along a row", ""]
        options = [(str(o.passes), f"{o.sweep:.3f} m", f"{o.speed:.3f} m/s", o.limit) for o in scan.options]
        lines += table(("passes", "sweep across", "largest speed", "limited by"), options)
    return "\n".join([*lines, *section("Assumed", assumptions(scan)), *section("Notes", scan.plots.notes)]) + "\n"
