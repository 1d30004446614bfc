"""Row scans: stops or passes, the boom's moves, the coverage of each plot."""

from typing import TYPE_CHECKING, Any

import click
import numpy as np

from boom_model import InputError
from boom_model.plausible import OFFSET, RATE, Range
from planner.cli.completion import OneOf, OutFile, any_file
from planner.cli.options import (
    all_option,
    boom_option,
    constraint_option,
    epsg_option,
    figure_option,
    json_option,
    load_boom,
    outputs,
    payload_option,
    with_names,
)
from planner.cli.printing import ANSWER_IS_NO, complain, print_files, print_json, print_lines, print_rows, tracked

if TYPE_CHECKING:
    from boom_model import Boom
    from planner.field.plots import PlotMap
    from planner.field.scan import Scan
    from planner.field.scan_task import ScanTask
    from planner.field.scan_track import TrackScan
    from planner.files import Outputs
    from planner.planning import Move

_SIDE = Range(0.01, 100.0, "m")
_BESIDE = Range(0.1, 30.0, "m")
_SHARE = Range(0.0, 0.9, "")
_PACE = Range(0.01, 10.0, "m/s")
_RADIUS = Range(0.1, 100.0, "m")
_PROFILES = ("cubic", "quintic", "trapezoidal", "jerk-limited", "time-optimal")
_FEW = 3


@click.command()
@click.argument("source", metavar="MAP", shell_complete=any_file)
@click.option("--footprint", required=True, metavar="M,M", help="What the sensor sees: along the arm, across it.")
@figure_option("--rate", RATE, "HZ", "Of the sensor.", 4.0)
@figure_option("--tip-height", OFFSET, "M", "Of the tip over the mount: canopy and distance, less the mount's height.", 0.9)
@figure_option("--offset", _BESIDE, "M", "From the track to the middle of a row; default: where the fewest stops do.")
@figure_option("--overlap", _SHARE, "SHARE", "Of two lines beside each other.", 0.1)
@figure_option("--speed", _PACE, "M/S", "Drive past the plots; default: stop.")
@click.option(
    "--passes",
    type=click.IntRange(1, 99),
    metavar="N",
    help="Along each row at that speed; default: the fewest that the boom can follow.",
)
@figure_option("--drive-speed", _PACE, "M/S", "From stop to stop, back along a row, and in turns.", 1.0)
@figure_option("--turn-radius", _RADIUS, "M", "Of the vehicle's turns between rows (assumed).", 4.0)
@click.option(
    "--track", "log", type=click.Path(), metavar="LOG", help="Log of the vehicle to drive along, as boom geotag reads."
)
@click.option("--rig", type=click.Path(), metavar="RIG.toml", help="Where the antenna of that log and the mount are.")
@click.option("--profile", type=OneOf(_PROFILES), default="jerk-limited", show_default=True, help="How the moves are timed.")
@constraint_option
@click.option("--mission", type=OutFile(".toml"), metavar="FILE.toml", help="The scan as a mission, for boom mission and size.")
@click.option(
    "--out", type=OutFile(".geojson", ".json", ".gpkg", ".shp", ".csv"), metavar="FILE", help="The plots with their coverage."
)
@click.option("--picture", type=OutFile(".png"), metavar="FILE.png", help="Plots, coverage and track.")
@click.option("--recording", type=OutFile(".rrd"), metavar="FILE.rrd", help="The day in 3D, beside a map.")
@click.option("--report", "document", type=OutFile(".md", ".html", ".pdf"), metavar="FILE", help="Write .md, .html or .pdf.")
@payload_option
@epsg_option
@boom_option
@all_option
@json_option
def scan(
    source: str,
    footprint: str,
    mission: str | None,
    out: str | None,
    picture: str | None,
    recording: str | None,
    document: str | None,
    payload: float | None,
    epsg: int | None,
    boom_file: str | None,
    whole: bool,
    as_json: bool,
    **figures: Any,
) -> int:
    """Plan a row scan: stops or passes, the boom's moves, and the coverage of each plot.

    \b
    Examples:
      boom scan trial.toml --footprint 0.5,0.5 --mission scan.toml --picture scan.png
      boom scan trial.toml --footprint 0.5,0.5 --track vehicle.csv --rig rig.toml
      boom scan trial.toml --footprint 0.5,0.5 --speed 0.5 --recording scan.rrd --report scan.pdf
    """
    from planner.field.plot_files import read_plots
    from planner.field.scan import plan_scan

    names = {"mission": mission, "plots": out, "picture": picture, "recording": recording, "report": document}
    given = figures.pop("log"), figures.pop("rig")
    files = outputs(mission, out, picture, recording, document=document, inputs=(source, boom_file, *given))
    task = _task(footprint, figures)
    boom, field = load_boom(boom_file, payload), read_plots(source, epsg)
    if given[0] is not None or given[1] is not None:
        return _along_log(boom, field, task, given, files, with_names(names), whole=whole, as_json=as_json)
    found = plan_scan(boom, field, task, tracked("planning"))
    written, failed = with_names(names), _failed(found)
    with files:
        _write_scan(files, boom, found, written, failed)
    if as_json:
        print_json(_scan_json(found, written))
    else:
        _print_scan(found, whole)
        print_files(written)
        then = f"boom mission {mission}" if mission else f"boom scan {source} --footprint {footprint} --mission scan.toml"
        print_lines("next", [then])
    if failed:
        complain(failed)
    return ANSWER_IS_NO if failed else 0


def _task(footprint: str, figures: dict[str, Any]) -> "ScanTask":
    from boom_model.words import numbers
    from planner.field.scan_task import ScanTask

    along, across = numbers(footprint, footprint, 2)
    _SIDE.require("footprint", (along, across))
    return ScanTask((along, across), **figures)


def _write_scan(files: "Outputs", boom: "Boom", found: "Scan", written: dict[str, str], failed: str) -> None:
    """Write the files of a scan by kind."""
    from planner.field.plot_files import write_plots
    from planner.field.plot_picture import map_figure, write_picture
    from planner.field.scan_report import scan_columns, scan_report
    from planner.reports.document import write_document

    place = {kind: files.temporary(name) for kind, name in written.items()}
    look = {"coverage": found.coverage, "track": found.track}
    if "mission" in place:
        with open(place["mission"], "w", encoding="utf-8") as file:
            file.write(found.mission)
    if "plots" in place:
        write_plots(found.plots, place["plots"], scan_columns(found))
    if "picture" in place:
        write_picture(place["picture"], found.plots, **look)
    if "recording" in place:
        from planner.recording.scan import write_scan_recording  # slow to import

        write_scan_recording(place["recording"], boom, found)
    if "report" in place:
        write_document(place["report"], scan_report(found, failed), {"The field": map_figure(found.plots, **look)})


def _failed(found: "Scan") -> str:
    """Why the answer is no: a move's check fails, or a plot is not reached; else nothing."""
    from planner.checks.rows import Verdict

    bad = [name for name, move in found.moves.items() if move.report.verdict is Verdict.FAIL]
    lost = found.unreachable
    reason = next(iter(lost.values()), "")
    said = [f"{len(bad)} moves FAIL, the first {bad[0]}"] if bad else []
    said += ["a drive cannot hold while the vehicle starts or stops"] if found.starting > 1.0 else []
    return "; ".join(
        said + ([f"{len(lost)} of {len(found.plots.names)} plots are not reached whole: {reason}"] if lost else [])
    )


def _print_scan(found: "Scan", whole: bool) -> None:
    from planner.field.scan_report import assumptions, day_line, headline, pass_lines, seen_line

    n = len(found.plots.names)
    print_lines(None, [headline(found)])
    print_lines(None, [seen_line(found), day_line(found)])
    print_lines(None, pass_lines(found))
    listed = list(zip(found.plots.names, found.coverage, found.overlap, found.seconds, found.energy, strict=True))
    rows = [(name, f"{c:.1%}", f"{o:.1f}", f"{t:.1f} s", f"{e:.1f} J") for name, c, o, t, e in listed]
    print_rows(("plot", "seen", "times", "time", "work of joints"), rows if whole else rows[:_FEW])
    print_lines(None, [f"{n - _FEW} more plots: --all lists them"] if n > _FEW and not whole else [])
    moves = [
        (name.replace("tip=", ""), f"{move.report.duration:.2f} s", str(move.report.verdict), f"{_worst(move):.3f}")
        for name, move in found.moves.items()
    ]
    print_rows(("move", "time", "verdict", "worst ratio"), moves if whole else moves[:_FEW])
    print_lines(None, [f"{len(moves) - _FEW} more moves: --all lists them"] if len(moves) > _FEW and not whole else [])
    crossed = f"the track crosses {found.crossed} plots, so the vehicle must straddle them"
    print_lines("note", [crossed] if found.crossed else [])
    print_lines("assumed", assumptions(found))
    print_lines("note", found.plots.notes if whole else [])


def _worst(move: "Move") -> float:
    """Return the largest demand over limit of a move's certificate."""
    certificate = move.report.certificate
    return max((worst.ratio for worst in certificate.worst), default=0.0) if certificate is not None else 0.0


def _scan_json(found: "Scan", written: dict[str, str]) -> dict[str, Any]:
    from planner.field.scan_report import assumptions, day_seconds, scan_columns

    columns = scan_columns(found)
    plots = [{"plot": name, **{key: values[k] for key, values in columns.items()}} for k, name in enumerate(found.plots.names)]
    moves = [
        {"move": name, "duration_s": move.report.duration, "verdict": str(move.report.verdict), "worst_ratio": _worst(move)}
        for name, move in found.moves.items()
    ]
    options = [
        {"passes": each.passes, "sweep_m": each.sweep, "largest_speed_m_s": float(each.speed), "limit": each.limit}
        for each in found.options
    ]
    return {
        "offset_m": found.offset, "stops": len(found.track), "passes": found.passes, "pass_options": options,
        "starting_ratio": found.starting, "day_s": {"total": found.duration, **day_seconds(found)},
        "assumptions": assumptions(found),
        "plots": plots, "moves": moves, "files": written,
    }  # fmt: skip


def _along_log(
    boom: "Boom",
    field: "PlotMap",
    task: "ScanTask",
    given: tuple[str | None, str | None],
    files: "Outputs",
    written: dict[str, str],
    *,
    whole: bool,
    as_json: bool,
) -> int:
    """Answer what a scan along a vehicle's log would see."""
    from planner.field.log_files import read_vehicle_log
    from planner.field.plot_files import write_plots
    from planner.field.plot_picture import write_picture
    from planner.field.rig import read_rig
    from planner.field.scan_track import scan_along

    log, rig = given
    if log is None:
        raise InputError("--rig says where the antenna of a log is; give the log by --track")
    asked = {"speed": task.speed, "passes": task.passes, "offset": task.offset}
    unfit = [name for name in written if name not in ("mission", "plots", "picture")]
    unfit += [name for name, value in asked.items() if value is not None]
    if unfit:
        raise InputError(f"--{unfit[0]} does not go with --track: the log gives the track and the speed")
    found = scan_along(boom, field, task, read_vehicle_log(log, None), None if rig is None else read_rig(rig))
    columns: dict[str, list[Any]] = {
        "coverage": [round(float(x), 4) for x in found.coverage],
        "reason": [found.unreachable.get(name, "") for name in field.names],
    }
    mission = found.mission if "mission" in written else ""
    with files:
        if "mission" in written:
            with open(files.temporary(written["mission"]), "w", encoding="utf-8") as file:
                file.write(mission)
        if "plots" in written:
            write_plots(field, files.temporary(written["plots"]), columns)
        if "picture" in written:
            write_picture(files.temporary(written["picture"]), field, coverage=found.coverage, track=found.track)
    if as_json:
        print_json(_track_json(found, columns, written))
    else:
        _print_track(found, whole)
        print_files(written)
        print_lines("next", [f"boom mission {written['mission']}" if "mission" in written else "add --mission scan.toml"])
    failed = _track_failed(found)
    if failed:
        complain(failed)
    return ANSWER_IS_NO if failed else 0


def _track_failed(found: "TrackScan") -> str:
    from planner.checks.rows import Verdict

    fast, lost, n = [each.worst for each in found.passes if each.worst > 1.0], found.unreachable, len(found.plots.names)
    said = [f"{len(fast)} passes are too fast for the boom, the worst at {max(fast):.2f} of a limit"] if fast else []
    moves = [each.move for each in found.reached] + [way.move for way in found.ways]
    bad = [move for move in moves if move is not None and move.report.verdict is Verdict.FAIL]
    said += [f"{len(bad)} moves FAIL"] if bad and not fast else []
    reason = next((each.reason for each in found.passes if each.reason), next(iter(lost.values()), ""))
    return "; ".join(said + ([f"{len(lost)} of {n} plots are not reached whole: {reason}"] if lost else []))


def _print_track(found: "TrackScan", whole: bool) -> None:
    rows, n = {each.row for each in found.passes}, len(found.plots.names)
    print_lines(None, [f"{found.source}: {len(found.passes)} passes along {len(rows)} rows of {found.plots.source}"])
    seen = int((found.coverage >= 0.99).sum())
    print_lines(None, [f"{seen} of {n} plots seen to 99 % or more; the vehicle's weaving is taken off"])
    listed = [
        (
            str(each.row), f"{each.line:.2f} m", f"{each.speed:.2f} m/s", f"{each.curve.mount.residual * 1e3:.0f} mm",
            f"{each.worst:.3f}" if each.ratios else "out of reach",
        )
        for each in found.passes
    ]  # fmt: skip
    print_rows(("row", "line", "speed", "log's noise", "worst ratio"), listed if whole else listed[:_FEW])
    print_lines(None, [f"{len(listed) - _FEW} more passes: --all lists them"] if len(listed) > _FEW and not whole else [])
    plots = [(name, f"{share:.1%}") for name, share in zip(found.plots.names, found.coverage, strict=True)]
    print_rows(("plot", "seen"), plots if whole else plots[:_FEW])
    print_lines(None, [f"{n - _FEW} more plots: --all lists them"] if n > _FEW and not whole else [])
    reasons = [f"row {each.row}: {each.reason}" for each in found.passes if each.reason]
    print_lines("note", [*found.notes, *reasons] if whole else found.notes[:_FEW])


def _track_json(found: "TrackScan", columns: dict[str, list[Any]], written: dict[str, str]) -> dict[str, Any]:
    passes = [
        {
            "row": each.row, "line_m": each.line, "begin_s": each.curve.mount.begin, "duration_s": each.curve.mount.duration,
            "speed_m_s": each.speed, "residual_m": each.curve.mount.residual, "reason": each.reason,
            "ratios": {str(limit): ratio if np.isfinite(ratio) else None for limit, ratio in each.ratios.items()},
        }
        for each in found.passes
    ]  # fmt: skip
    plots = [{"plot": name, **{key: values[k] for key, values in columns.items()}} for k, name in enumerate(found.plots.names)]
    return {"passes": passes, "plots": plots, "notes": list(found.notes), "files": written}
