"""The commands that plan a move, compare profiles, and compute torques and checks of a motion."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from boom_model import Boom, InfeasibleError, InputError
from planner.cli.completion import OutFile, any_file
from planner.cli.options import (
    all_option,
    boom_option,
    check_picture,
    doubts,
    json_option,
    load_boom,
    load_vehicle,
    move_options,
    outputs,
    payload_as_option,
    payload_option,
    picture_option,
    report_option,
    vehicle_option,
    with_names,
)
from planner.cli.printing import (
    ANSWER_IS_NO,
    STYLES,
    complain,
    print_files,
    print_json,
    print_lines,
    print_report,
    print_rows,
    tracked,
)
from planner.cli.view import require_screen, show
from planner.move_spec import MoveSpec, MoveWords

if TYPE_CHECKING:
    from planner.files import Outputs
    from planner.planning import Move
    from planner.profile_table import ProfileRow
    from planner.reports.report import Report


_LEAST_ASKED = ("motor speed", "acceleration", "velocity", "jerk")
"""Columns that a narrow terminal leaves out of the table of profiles."""


@click.command(context_settings={"ignore_unknown_options": True})  # so that -0.5 is a number
@move_options()
@payload_option
@click.option(
    "--out",
    type=OutFile(".rrd"),
    default="move.rrd",
    show_default=True,
    metavar="FILE.rrd",
    help="Recording to write, for `boom view`.",
)
@click.option("--csv", "csv_file", type=OutFile(".csv"), metavar="FILE.csv", help="Write the motion with its torques.")
@report_option
@picture_option
@click.option("--view", "then_view", is_flag=True, help="Open the recording in the viewer.")
@click.option("--show-reach", is_flag=True, help="Add the workspace with --pitch and --constraint to the recording.")
@boom_option
@all_option
@json_option
def plan(
    move: MoveWords,
    payload: float | None,
    out: str,
    csv_file: str | None,
    picture: str | None,
    document: str | None,
    then_view: bool,
    show_reach: bool,
    boom_file: str | None,
    whole: bool,
    as_json: bool,
) -> int:
    """Plan a move, check it against limits and drives, and record it.

    START and GOAL are a named pose (transport, phenotyping), a joint position
    q=YAW,INNER,LOWER,EXTENSION,WRIST, or a tip target tip=X,Y,Z.

    \b
    Examples:
      boom plan transport phenotyping
      boom plan transport tip=1.4,0,1.0 --constraint extension=0.25 --profile time-optimal
      boom plan tip=1,1.7,0.9 tip=-1,1.7,0.9 --along line --profile jerk-limited
      boom plan transport phenotyping --via q=40,60,120,0.3,0 --pass-via --profile time-optimal
      boom plan transport phenotyping --profile time-optimal --jerk-bound --rate 250
    """
    check_picture(picture)
    if then_view:
        require_screen()
    files = outputs(out, csv_file, picture, document=document, inputs=(boom_file, move.vehicle))
    boom, spec = load_boom(boom_file, payload), move.spec()
    if show_reach and spec.pitch is None:
        raise InputError("pitch free: the workspace is drawn for one pitch")
    planned = _planned(boom, spec, as_json)
    report = planned.full_report if whole or as_json or document is not None else planned.report
    report = replace(report, notes=(*report.notes, *doubts(spec)))
    if report.verdict == "FAIL":
        report = replace(report, suggestions=_fixes(boom, spec))
    written = {"recording": out, "csv": csv_file, "picture": picture, "report": document}
    _write(files, planned, report, written, f"{move.start} to {move.goal}", spec if show_reach else None)
    asked = f"{move.start} to {move.goal}, {report.profile}, {report.duration:.3f} s, payload {boom.payload.mass:g} kg"
    code = print_report(report, asked, with_names(written), as_json, whole, f"boom view {out}")
    if then_view:
        show(out)
    return code


def _planned(boom: Boom, spec: MoveSpec, as_json: bool) -> "Move":
    """Return the planned move. If it is infeasible, print the possible fixes and raise."""
    from planner.planning import plan_move

    try:
        return plan_move(boom, spec)
    except InfeasibleError as error:
        fixes = _fixes(boom, spec)
        if as_json:
            failed: dict[str, Any] = {"profile": str(spec.profile), "duration_s": None, "verdict": "FAIL", "checks": []}
            print_json({**failed, "files": {}, "reason": str(error), "remedies": fixes})
        else:
            print_lines("possible fix", fixes)
        raise


def _fixes(boom: Boom, spec: MoveSpec) -> tuple[str, ...]:
    from planner.suggestions import suggestions

    return tuple(each.sentence for each in suggestions(boom, spec, tracked("looking for possible fixes")))


def _write(
    files: "Outputs",
    move: "Move",
    report: "Report",
    written: dict[str, str | None],
    title: str,
    workspace: MoveSpec | None = None,
) -> None:
    """Write the output files of a move, where they have a name.

    The recording includes the workspace of a description, if one is given.
    """
    from planner.motion.trajectory import write_csv

    recording, csv_file, picture, document = (written.get(kind) for kind in ("recording", "csv", "picture", "report"))
    shown = (move.boom, move.trajectory)
    with files:
        if recording is not None:
            from planner.recording import write_recording

            write_recording(files.temporary(recording), move, reach=_workspace(move.boom, workspace), title=title)
        if csv_file is not None:
            write_csv(move.trajectory, files.temporary(csv_file), move.loads.tau)
        if picture is not None:
            from planner.reports.drive_pictures import write_drive_picture

            write_drive_picture(files.temporary(picture), *shown, move.loads.tau, report)
        if document is not None:
            from planner.reports.document import write_document
            from planner.reports.drive_pictures import drive_pages
            from planner.reports.first_page import circumstances, first_page, first_picture
            from planner.reports.move_pictures import move_pictures

            pages = move_pictures(*shown, move.loads.tau) | drive_pages(*shown, move.loads.tau, report)
            asked = circumstances(move.boom, move.vehicle, report)
            first = first_page(title, asked, report), first_picture(*shown, move.loads.tau)
            write_document(files.temporary(document), report.details(), pages, first)


def _workspace(boom: Boom, spec: MoveSpec | None) -> Any:
    if spec is None or spec.pitch is None:
        return None
    from boom_model.kinematics.reach import reach_map

    return reach_map(boom, spec.constraint, spec.pitch)


@click.command(context_settings={"ignore_unknown_options": True})
@move_options("profile", "via_velocity", "along", "duration", "jerk_bound", "average_torque", "rate", "vehicle")
@payload_option
@click.option("--out", type=OutFile(".rrd"), metavar="FILE.rrd", help="Write a recording with all profiles for `boom view`.")
@boom_option
@json_option
def profiles(move: MoveWords, payload: float | None, out: str | None, boom_file: str | None, as_json: bool) -> int:
    """Compare every profile on one move: verdict, duration, ratio to each limit, worst stop.

    \b
    Example:
      boom profiles transport phenotyping --payload 20 --out profiles.rrd
    """
    from planner.profile_table import HEADER, cells, profile_markdown, profile_moves, profile_rows

    files, boom = outputs(out, inputs=(boom_file,)), load_boom(boom_file, payload)
    moves, refused = profile_moves(boom, move.spec(), tracked("planning with each profile"))
    rows = profile_rows(moves)
    written = {} if out is None else {"recording": out}
    if out is not None:
        from planner.recording import write_moves_recording

        with files:
            title = f"{move.start} to {move.goal}, payload {boom.payload.mass:g} kg"
            reading = f"Each ratio is demand / limit.\n\n{profile_markdown(rows)}"
            write_moves_recording(files.temporary(out), moves, reading, title)
    failed = [f"{row.profile}: a check FAILs" for row in rows if row.verdict == "FAIL"]
    failed += [f"{name}: {reason}" for name, reason in refused.items()]
    if as_json:
        print_json({"profiles": [asdict(row) for row in rows], "refused": refused, "files": written})
    else:
        print_lines(None, [f"{move.start} to {move.goal}, payload {boom.payload.mass:g} kg; each ratio is demand / limit"])
        print_rows(
            HEADER,
            map(cells, rows),
            drop=("motor speed", "acceleration", "velocity", "jerk"),
            styles=[STYLES.get(row.verdict) for row in rows],
        )
        print_lines("refused", (f"{name}: {reason}" for name, reason in refused.items()))
        print_files(written)
        print_lines("next", _quickest(move, rows))
    if failed:
        complain("; ".join(failed))
    return ANSWER_IS_NO if failed else 0


def _quickest(move: MoveWords, rows: Sequence["ProfileRow"]) -> list[str]:
    """Return the command that plans the quickest profile without a FAIL, if there is one."""
    possible = [row for row in rows if row.verdict != "FAIL"]
    if not possible:
        return []
    name = min(possible, key=lambda row: row.duration_s).profile
    words = name.replace(", jerk bound", " --jerk-bound")
    return [f"boom plan {move.start} {move.goal} --profile {words}"]


@click.command()
@click.argument("motion", type=click.Path(), metavar="IN")
@click.option(
    "--out",
    required=True,
    shell_complete=any_file,
    metavar="OUT",
    help="Motion with torques to write: .csv, .parquet, .yaml or .json.",
)
@payload_option
@payload_as_option
@boom_option
@json_option
def torque(motion: str, out: str, payload: float | None, payload_as: Any, boom_file: str | None, as_json: bool) -> int:
    """Compute the torque of each joint at each sample of a motion.

    Torques include friction if the boom file has friction data. IN is a CSV or Parquet file with
    the columns t, q1..q5, qd1..qd5, qdd1..qdd5 in SI, or t and q1..q5 only.

    \b
    Example:
      boom torque move.csv --out torques.csv --payload 8
    """
    from boom_model.boom import JOINTS, LOAD_UNITS
    from planner.motion.motion_files import form_of, read_motion, write_motion
    from planner.planning import torques

    form, files = form_of(out), outputs(out, inputs=(motion, boom_file))
    boom, trajectory = load_boom(boom_file, payload), read_motion(motion)
    tau = torques(boom, trajectory, payload_as)
    with files:
        write_motion(trajectory, files.temporary(out), tau)
    at = np.abs(tau).argmax(axis=0)
    peaks = [
        {"joint": joint, "tau": float(tau[k, i]), "unit": LOAD_UNITS[i], "at_s": float(trajectory.t[k])}
        for i, (joint, k) in enumerate(zip(JOINTS, at, strict=True))
    ]
    if as_json:
        print_json({"peaks": peaks, "notes": list(trajectory.notes), "files": {form[1:]: out}})
        return 0
    shown = [(str(peak["joint"]), f"{peak['tau']:.3f} {peak['unit']}", f"{peak['at_s']:.3f} s") for peak in peaks]
    print_rows(("joint", "largest load", "at"), shown)
    print_lines("note", trajectory.notes)
    print_files({form[1:]: out})
    return 0


@click.command()
@click.argument("motion", type=click.Path(), metavar="IN")
@payload_option
@payload_as_option
@vehicle_option
@click.option("--out", type=OutFile(".rrd"), metavar="FILE.rrd", help="Write a recording of the motion for `boom view`.")
@report_option
@picture_option
@boom_option
@all_option
@json_option
def check(
    motion: str,
    payload: float | None,
    payload_as: Any,
    vehicle: str | None,
    out: str | None,
    picture: str | None,
    document: str | None,
    boom_file: str | None,
    whole: bool,
    as_json: bool,
) -> int:
    """Check a motion against joint limits and drive datasheets.

    IN is a CSV or Parquet file.

    \b
    Example:
      boom plan transport phenotyping --csv move.csv
      boom check move.csv --payload 8 --out checked.rrd
    """
    from planner.motion.motion_files import read_motion
    from planner.planning import check_motion

    check_picture(picture)
    files = outputs(out, picture, document=document, inputs=(motion, boom_file, vehicle))
    boom = load_boom(boom_file, payload)
    move = check_motion(boom, read_motion(motion), payload_as=payload_as, vehicle=load_vehicle(vehicle))
    written = {"recording": out, "picture": picture, "report": document}
    _write(files, move, move.report, written, f"Motion of {motion}")
    asked = f"{motion}, {move.report.duration:.3f} s, payload {boom.payload.mass:g} kg"
    carried = "" if payload is None else f" --payload {payload:g}"
    then = f"boom check {motion}{carried} --out checked.rrd" if out is None else f"boom view {out}"
    return print_report(move.report, asked, with_names(written), as_json, whole, then)
