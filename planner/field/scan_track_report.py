"""A scan along a log in words: its answer's lines, its report, and the columns of its plots."""

from typing import Any

from planner.checks.rows import Verdict
from planner.field.scan_track import Pass, TrackScan
from planner.reports.markdown import section, table

PASSES = ("row", "line", "speed", "log's noise", "worst ratio")


def track_headline(scan: TrackScan) -> str:
    """Return what is scanned along which log."""
    rows = {each.row for each in scan.passes}
    return f"{scan.source}: {len(scan.passes)} passes along {len(rows)} rows of {scan.plots.source}"


def track_seen(scan: TrackScan) -> str:
    """Return how much of the plots is seen."""
    seen, n = int((scan.coverage >= 0.99).sum()), len(scan.plots.names)
    return f"{seen} of {n} plots seen to 99 % or more; the vehicle's weaving is taken off"


def track_failed(scan: TrackScan) -> str:
    """Return why the answer is no: a pass is too fast, a move fails, or a plot is not reached."""
    fast, lost, n = [each.worst for each in scan.passes if each.worst > 1.0], scan.unreachable, len(scan.plots.names)
    said = [f"{len(fast)} passes are too fast for the boom, the worst at {max(fast):.2f} of a limit"] if fast else []
    moves = [(f"the pass {each.line:.2f} m beside the mount", each.move) for each in scan.reached]
    moves += [(f"the way to {way.target}", way.move) for way in scan.ways]
    bad = [(name, move) for name, move in moves if move is not None and move.report.verdict is Verdict.FAIL]
    for name, move in bad[:1]:
        said.append(f"{len(bad)} moves FAIL, the first {name}: {move.report.summary.removeprefix('FAIL: ').partition(';')[0]}")
    reason = next((each.reason for each in scan.passes if each.reason), next(iter(lost.values()), ""))
    return "; ".join(said + ([f"{len(lost)} of {n} plots are not reached whole: {reason}"] if lost else []))


def track_columns(scan: TrackScan) -> dict[str, list[Any]]:
    """Return the columns of the plots' file, one value a plot."""
    return {
        "coverage": [round(float(x), 4) for x in scan.coverage],
        "overlap": [round(float(x), 2) for x in scan.overlap],
        "reason": [scan.unreachable.get(name, "") for name in scan.plots.names],
    }


def pass_cells(each: Pass) -> tuple[str, ...]:
    """Return the cells of a pass under PASSES."""
    return (
        str(each.row), f"{each.line:.2f} m", f"{each.speed:.2f} m/s", f"{each.curve.mount.residual * 1e3:.0f} mm",
        f"{each.worst:.3f}" if each.ratios else "not driven" if each.late else "out of reach",
    )  # fmt: skip


def track_report(scan: TrackScan, failed: str = "") -> str:
    """Return the report in Markdown; its first paragraph is the verdict."""
    moves = [each.move for each in scan.reached] + [way.move for way in scan.ways]
    open_ = any(move is not None and move.report.verdict is Verdict.INCOMPLETE for move in moves)
    fine = "INCOMPLETE: nothing fails, some drives have no data" if open_ else "PASS: nothing fails"
    lines = ["# Row scan along a log", "", f"FAIL: {failed}" if failed else f"{fine}; {track_seen(scan)}"]
    lines += ["", f"{track_headline(scan)}.", "", f"{track_seen(scan)}.", "", "## Plots", ""]
    rows = [
        (name, f"{c:.1%}", f"{o:g}", why)
        for name, c, o, why in zip(scan.plots.names, *track_columns(scan).values(), strict=True)
    ]
    lines += table(("plot", "seen", "times", "reason"), rows)
    lines += ["", "## Passes", "", "The worst ratio counts the vehicle's motion; the verdict is for level ground.", ""]
    passes = [
        (
            *pass_cells(each), f"{each.curve.mount.begin:.1f} s", f"{each.curve.mount.duration:.1f} s",
            "" if each.move is None else str(each.move.report.verdict), each.reason,
        )
        for each in scan.passes
    ]  # fmt: skip
    lines += table((*PASSES, "begin", "time", "verdict", "reason"), passes)
    ways = [
        (way.target.replace("tip=", ""), way.along, f"{way.duration:.2f} s", f"{way.gap:.2f} s", str(way.move.report.verdict))
        for way in scan.ways
        if way.move is not None
    ]
    if ways:
        lines += ["", "## Ways from line to line", "", *table(("to", "along", "time", "time of the log", "verdict"), ways)]
    return "\n".join([*lines, *section("Notes", [*scan.notes, *scan.plots.notes])]) + "\n"
