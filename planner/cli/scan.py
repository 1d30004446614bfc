"""Row scans: stops or passes, the boom's moves, the coverage of each plot."""

from typing import TYPE_CHECKING, Any

import click
import numpy as np

from boom_model import InfeasibleError, InputError
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


def _write_scan(files: "Outputs", boom: "Boom", found: "Scan | TrackScan", written: dict[str, str], failed: str) -> None:
    """Write the files of a scan by kind."""
    from planner.field.plot_files import write_plots
    from planner.field.plot_picture import map_figure, write_picture
    from planner.field.scan_report import scan_columns, scan_report
    from planner.field.scan_track import TrackScan
    from planner.field.scan_track_report import track_columns, track_report
    from planner.reports.document import write_document

    place = {kind: files.temporary(name) for kind, name in written.items()}
    look = {"coverage": found.coverage, "track": found.track}
    if "mission" in place:
        with open(place["mission"], "w", encoding="utf-8") as file:
            file.write(found.mission)
    if "plots" in place:
        columns = track_columns(found) if isinstance(found, TrackScan) else scan_columns(found)
        write_plots(found.plots, place["plots"], columns)
    if "picture" in place:
        write_picture(place["picture"], found.plots, **look)
    if "recording" in place:
        from planner.recording.scan import write_scan_recording  # slow to import

        write_scan_recording(place["recording"], boom, found)
    if "report" in place:
        told = track_report(found, failed) if isinstance(found, TrackScan) else scan_report(found, failed)
        write_document(place["report"], told, {"The field": map_figure(found.plots, **look)})


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
    from planner.field.rig import read_rig
    from planner.field.scan_track import scan_along
    from planner.field.scan_track_report import track_failed

    log, rig = given
    if log is None:
        raise InputError("--rig says where the antenna of a log is; give the log by --track")
    asked = {"speed": task.speed, "passes": task.passes, "offset": task.offset}
    for name in (name for name, value in asked.items() if value is not None):
        raise InputError(f"--{name} does not go with --track: the log gives the track and the speed")
    found = scan_along(boom, field, task, read_vehicle_log(log, None), None if rig is None else read_rig(rig))
    failed = track_failed(found)
    if not found.reached and written.keys() & {"mission", "recording"}:
        raise InfeasibleError(f"{found.source}: no mission and no recording, since no line is reached: {failed}")
    with files:
        _write_scan(files, boom, found, written, failed)
    if as_json:
        print_json(_track_json(found, written))
    else:
        _print_track(found, whole)
        print_files(written)
        print_lines("next", [f"boom mission {written['mission']}" if "mission" in written else "add --mission scan.toml"])
    if failed:
        complain(failed)
    return ANSWER_IS_NO if failed else 0


def _print_track(found: "TrackScan", whole: bool) -> None:
    from planner.field.scan_track_report import PASSES, pass_cells, track_headline, track_seen

    n = len(found.plots.names)
    print_lines(None, [track_headline(found), track_seen(found)])
    listed = [pass_cells(each) for each in found.passes]
    print_rows(PASSES, listed if whole else listed[:_FEW])
    print_lines(None, [f"{len(listed) - _FEW} more passes: --all lists them"] if len(listed) > _FEW and not whole else [])
    plots = [
        (name, f"{c:.1%}", f"{o:.1f}") for name, c, o in zip(found.plots.names, found.coverage, found.overlap, strict=True)
    ]
    print_rows(("plot", "seen", "times"), plots if whole else plots[:_FEW])
    print_lines(None, [f"{n - _FEW} more plots: --all lists them"] if n > _FEW and not whole else [])
    reasons = [f"row {each.row}: {each.reason}" for each in found.passes if each.reason]
    print_lines("note", [*found.notes, *reasons] if whole else found.notes[:_FEW])


def _track_json(found: "TrackScan", written: dict[str, str]) -> dict[str, Any]:
    from planner.field.scan_track_report import track_columns

    columns = track_columns(found)
    passes = [
        {
            "row": each.row, "line_m": each.line, "begin_s": each.curve.mount.begin, "duration_s": each.curve.mount.duration,
            "speed_m_s": each.speed, "residual_m": each.curve.mount.residual, "reason": each.reason,
            "verdict": None if each.move is None else str(each.move.report.verdict),
            "ratios": {str(limit): ratio if np.isfinite(ratio) else None for limit, ratio in each.ratios.items()},
        }
        for each in found.passes
    ]  # fmt: skip
    plots = [{"plot": name, **{key: values[k] for key, values in columns.items()}} for k, name in enumerate(found.plots.names)]
    ways = [
        {"to": way.target, "along": way.along, "duration_s": way.duration, "log_s": way.gap,
         "verdict": None if way.move is None else str(way.move.report.verdict)}
        for way in found.ways
    ]  # fmt: skip
    day, notes = found.duration, list(found.notes)
    return {"day_s": day, "passes": passes, "ways": ways, "plots": plots, "notes": notes, "files": written}
