"""The command `boom`: parsing and printing, nothing else. What is slow to import is imported by the command that needs it."""

import io
import json
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from contextlib import redirect_stdout
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from boom_model import Boom, BoomError, InfeasibleError, InputError, inverse_kinematics
from planner.targets import HOLDS, parse_along, parse_hold, parse_joint_velocity, parse_pitch, parse_target, unreachable

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from boom_model.arrays import Array
    from planner.control.study import Study
    from planner.report import Report
    from planner.trajectory import Trajectory

ANSWER_IS_NO, BAD_INPUT = 1, 2
_PIPE_WIDTH = 132
_CATALOGUE = "boom.catalogue"

_boom_option = click.option("--boom", "boom_file", metavar="FILE.toml", help="A boom of your own; else the third generation.")
_catalogue_option = click.option(
    "--catalogue",
    metavar="FILE.toml",
    expose_value=False,
    callback=lambda context, _, value: context.meta.update({_CATALOGUE: value}),
    help="Motors, gearboxes and actuators of your own, beside the shipped ones.",
)


def boom_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """--boom, and --catalogue, which `_load` finds in the context: whoever names a drive may have brought it."""
    return _boom_option(_catalogue_option(command))


payload_option = click.option("--payload", type=float, metavar="KG", help="Mass at the tip; else the boom's own.")
payload_as_option = click.option(
    "--payload-as", type=click.Choice(["mass", "force"]), default="mass", show_default=True,
    help="Accelerate the payload with the tip, or hang its weight there and leave out its inertia, as the thesis does.",
)  # fmt: skip
json_option = click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output, in SI.")
report_option = click.option(
    "--report", "document", metavar="FILE.md|.html|.pdf", help="The report as a document, with pictures, versions and command."
)
vehicle_option = click.option(
    "--vehicle",
    metavar="CASE",
    help="What the vehicle does meanwhile: slope, track, shock, ditch or a FILE.toml; else it rests.",
)
picture_option = click.option("--picture", metavar="FILE.png", help="The drives as a page of pictures.")
pitch_option = click.option(
    "--pitch",
    default="down",
    show_default=True,
    metavar="down|level|up|free|DEG",
    help="Elevation of the end effector at a tip target; free lets the hold choose it.",
)
hold_option = click.option(
    "--hold",
    default="horizontal",
    show_default=True,
    metavar="HOLD",
    help=f"Extra constraint of a tip target: {HOLDS}.",
)


def main() -> None:
    """Run the command; exit 0 done, 1 the answer is no, 2 bad input with one line on standard error."""
    try:
        code = cli.main(prog_name="boom", standalone_mode=False)
    except click.ClickException as error:
        _complain(error.format_message())
        code = BAD_INPUT
    except (MemoryError, OverflowError) as error:
        _complain(f"too large to compute: {error}")
        code = BAD_INPUT
    except click.Abort:
        code = 130
    except InfeasibleError as error:
        _complain(str(error))
        code = ANSWER_IS_NO
    except BoomError as error:
        _complain(str(error))
        code = BAD_INPUT
    sys.exit(code)


@click.group(context_settings={"help_option_names": ["-h", "--help"]}, no_args_is_help=False)
@click.version_option(package_name="boom", prog_name="boom")
def cli() -> None:
    """Plan, check and watch the moves of the third-generation phenotyping boom.

    Angles are in degrees and lengths in metres; files and JSON are in SI.
    """


@cli.command(context_settings={"ignore_unknown_options": True})  # so that -0.5 is a number
@click.argument("start")
@click.argument("goal")
@click.option(
    "--profile", type=click.Choice(["cubic", "quintic", "trapezoidal", "jerk-limited", "time-optimal"]), default="cubic",
    show_default=True, help="How the path is timed.",
)  # fmt: skip
@click.option("--via", multiple=True, metavar="TARGET", help="A target on the way, with a stop; may be given again.")
@click.option("--pass-via", is_flag=True, help="Go through the targets on the way on a smooth path, without a stop.")
@click.option(
    "--via-velocity", multiple=True, metavar="DEG/S,DEG/S,DEG/S,M/S,DEG/S",
    help="The cubic's velocity at each --via, in turn, without a stop; else its acceleration is continuous there.",
)  # fmt: skip
@click.option(
    "--along", default="joint", show_default=True, metavar="joint|line|arc=X,Y,Z",
    help="What goes straight: the joints, or the tip from tip target to tip target; or an arc of the tip through a point.",
)  # fmt: skip
@click.option("--duration", type=float, metavar="S", help="Else the least that the limits allow.")
@click.option("--jerk-bound", is_flag=True, help="Hold the time-optimal profile to the jerk limits as well.")
@click.option("--average-torque", is_flag=True, help="Hold the time-optimal profile to the gearboxes' average torque as well.")
@click.option("--rate", type=float, metavar="HZ", help="Sample at a controller's rate; the move ends on its clock.")
@pitch_option
@hold_option
@payload_option
@click.option("--out", default="move.rrd", show_default=True, metavar="FILE.rrd", help="The recording, for `boom view`.")
@click.option("--csv", "csv_file", metavar="FILE.csv", help="The motion with its torques.")
@report_option
@picture_option
@vehicle_option
@click.option("--show-reach", is_flag=True, help="Draw in the recording what the tip reaches under --pitch and --hold.")
@boom_option
@json_option
def plan(
    start: str,
    goal: str,
    profile: str,
    via: tuple[str, ...],
    pass_via: bool,
    via_velocity: tuple[str, ...],
    along: str,
    duration: float | None,
    jerk_bound: bool,
    average_torque: bool,
    rate: float | None,
    pitch: str,
    hold: str,
    payload: float | None,
    out: str,
    csv_file: str | None,
    picture: str | None,
    document: str | None,
    vehicle: str | None,
    show_reach: bool,
    boom_file: str | None,
    as_json: bool,
) -> int:
    """Plan a move, check it against limits and drives, and record it.

    START and GOAL are a named pose (transport, phenotyping), a joint position q=YAW,INNER,LOWER,EXTENSION,WRIST, or a tip
    target tip=X,Y,Z.

    \b
    Examples:
      boom plan transport phenotyping
      boom plan transport tip=1.4,0,1.0 --hold extension=0.25 --profile time-optimal
      boom plan tip=1,1.7,0.9 tip=-1,1.7,0.9 --along line --profile jerk-limited
      boom plan transport phenotyping --via q=40,60,120,0.3,0 --pass-via --profile time-optimal --jerk-bound --rate 250
    """
    from planner.files import check_writable
    from planner.planning import plan as plan_move
    from planner.remedies import remedies
    from planner.trajectory import write_csv
    from planner.vehicle import load_case

    boom = _load(boom_file, payload)
    case = None if vehicle is None else load_case(vehicle)
    _check_picture(picture)
    check_writable(out, csv_file, picture)
    _require_document(document)
    if show_reach and parse_pitch(pitch) is None:
        raise InputError("pitch free: the reach is drawn for one pitch")
    targets = parse_target(start), parse_target(goal)
    options: dict[str, Any] = {
        "profile": profile,
        "duration": duration,
        "pitch": parse_pitch(pitch),
        "hold": parse_hold(hold),
        "via": [parse_target(text) for text in via],
        "stop_at_via": not pass_via,
        "via_velocities": [parse_joint_velocity(text) for text in via_velocity] or None,
        "along": parse_along(along),
        "jerk_bound": jerk_bound,
        "average_torque": average_torque,
        "vehicle": case,
        "rate": rate,
    }
    try:
        move = plan_move(boom, *targets, **options)
    except InfeasibleError as error:
        mend = [remedy.sentence for remedy in remedies(boom, *targets, _tracked("looking for what would mend it"), **options)]
        if as_json:
            failed: dict[str, Any] = {"profile": profile, "duration_s": None, "verdict": "FAIL", "checks": [], "files": {}}
            _print_json({**failed, "reason": str(error), "remedies": mend})
        _print_lines("Would mend it" if not as_json else None, mend)
        raise
    report = move.report
    if report.verdict == "FAIL":
        found = remedies(boom, *targets, _tracked("looking for what would mend it"), **options)
        report = replace(report, remedies=tuple(remedy.sentence for remedy in found))
    from planner.recording import write_recording

    reach = None
    if show_reach:
        from boom_model.reach import reach_map

        reach = reach_map(boom, options["hold"], options["pitch"])
    written = {"recording": out}
    write_recording(out, move, reach=reach)
    if csv_file is not None:
        write_csv(move.trajectory, csv_file, move.loads.tau)
        written["csv"] = csv_file
    if picture is not None:
        from planner.drive_pictures import write_drive_picture

        write_drive_picture(picture, boom, move.trajectory, move.loads.tau, report)
        written["picture"] = picture
    _write_document(document, report, boom, move.trajectory, move.loads.tau, written)
    return _print_report(report, written, as_json)


@cli.command(context_settings={"ignore_unknown_options": True})
@click.argument("start")
@click.argument("goal")
@click.option("--via", multiple=True, metavar="TARGET", help="A target on the way, with a stop; may be given again.")
@click.option("--pass-via", is_flag=True, help="Go through the targets on the way on a smooth path, without a stop.")
@pitch_option
@hold_option
@payload_option
@click.option("--out", metavar="FILE.rrd", help="A recording of all of them over each other, for `boom view`.")
@boom_option
@json_option
def profiles(
    start: str,
    goal: str,
    via: tuple[str, ...],
    pass_via: bool,
    pitch: str,
    hold: str,
    payload: float | None,
    out: str | None,
    boom_file: str | None,
    as_json: bool,
) -> int:
    """Every profile on one move, side by side: duration, worst ratio to each limit, worst stop.

    \b
    Example:
      boom profiles transport phenotyping --payload 20 --out profiles.rrd
    """
    from planner.files import check_writable
    from planner.profile_table import HEADER, cells, profile_markdown, profile_moves, profile_rows

    check_writable(out)
    moves = profile_moves(
        _load(boom_file, payload),
        parse_target(start),
        parse_target(goal),
        via=[parse_target(text) for text in via],
        stop_at_via=not pass_via,
        pitch=parse_pitch(pitch),
        hold=parse_hold(hold),
    )
    rows = profile_rows(moves)
    written: dict[str, str] = {}
    if out is not None:
        from planner.recording import write_moves_recording

        write_moves_recording(out, moves, profile_markdown(rows))
        written["recording"] = out
    if as_json:
        _print_json({"profiles": [asdict(row) for row in rows], "files": written})
    else:
        table = _table(*HEADER)
        for row in rows:
            table.add_row(*cells(row))
        _console().print(table)
        for kind, name in written.items():
            click.echo(f"{kind}: {name}")
    return ANSWER_IS_NO if any(row.verdict == "FAIL" for row in rows) else 0


@cli.command(context_settings={"ignore_unknown_options": True})
@click.argument("x", type=float)
@click.argument("y", type=float)
@click.argument("z", type=float)
@pitch_option
@hold_option
@payload_option
@boom_option
@json_option
def ik(x: float, y: float, z: float, pitch: str, hold: str, payload: float | None, boom_file: str | None, as_json: bool) -> int:
    """Every joint position that puts the tip at X Y Z (m, in the base frame).

    \b
    Example:
      boom ik 1.4 0 1.0 --pitch down --hold extension=0.25
    """
    boom = _load(boom_file, payload)
    angle, held, position = parse_pitch(pitch), parse_hold(hold), (x, y, z)
    found = inverse_kinematics(boom, position, angle, held)
    reason = None if found.best is not None else unreachable(boom, position, angle, held)
    if as_json:
        answer: dict[str, Any] = {
            "target": {"position_m": position, "pitch_rad": found.pitch, "hold": str(held)},
            "solutions": [
                {"q": s.q.tolist(), "within_limits": s.within_limits, "reasons": list(s.reasons)} for s in found.solutions
            ],
            "best": found.best,
        }
        _print_json(answer if reason is None else answer | {"reason": reason})
    elif found.solutions:
        table = _table("branch", "yaw deg", "inner deg", "lower deg", "extension m", "wrist deg", "within limits", "reasons")
        for i, s in enumerate(found.solutions):
            q = np.where([0, 0, 0, 1, 0], s.q, np.degrees(s.q))
            best = " (best)" if i == found.best else ""
            table.add_row(
                f"{i + 1}{best}",
                *(f"{v:.4f}" for v in q),
                "yes" if s.within_limits else "no",
                "\n".join(s.reasons) or "-",
            )
        _console().print(table)
    if reason is not None:
        raise InfeasibleError(reason)
    return 0


@cli.command()
@pitch_option
@hold_option
@payload_option
@click.option("--out", default="reach.png", show_default=True, metavar="FILE.png|FILE.rrd", help="The picture or recording.")
@boom_option
@json_option
def reach(pitch: str, hold: str, payload: float | None, out: str, boom_file: str | None, as_json: bool) -> int:
    """What the tip reaches in the arm's vertical plane, and with what torque to spare.

    \b
    Example:
      boom reach --hold least-torque --payload 8 --out reach.png
    """
    from boom_model.reach import reach_map

    if not out.endswith((".png", ".rrd")):
        raise InputError(f"{out}: a reach map is written as .png or .rrd")
    boom, angle, held = _load(boom_file, payload), parse_pitch(pitch), parse_hold(hold)
    if angle is None:
        raise InputError("pitch free: a reach map is drawn for one pitch")
    found = reach_map(boom, held, angle)
    row, column = np.nonzero(found.within_limits)
    answer: dict[str, Any] = {
        "hold": str(held),
        "pitch_rad": angle,
        "payload_kg": boom.payload.mass,
        "cells": found.exists.size,
        "exists": int(found.exists.sum()),
        "within_limits": len(row),
        "overloaded": int((found.torque_margin < 0.0).sum()),
        "files": {},
    }
    if not len(row):
        reason = f"no tip position with pitch {np.degrees(angle):.4g} deg and hold {held} is within the limits"
        if as_json:
            _print_json(answer | {"reason": reason})
        raise InfeasibleError(reason)
    margin = found.torque_margin[row, column]
    known = bool(np.isfinite(margin).all())
    answer |= {
        "largest_r_m": float(np.abs(found.r[column]).max()),
        "lowest_z_m": float(found.z[row].min()),
        "highest_z_m": float(found.z[row].max()),
        "least_torque_margin": float(margin.min()) if known else None,
        "largest_torque_margin": float(margin.max()) if known else None,
    }
    if out.endswith(".png"):
        from planner.reach_picture import reach_title, write_reach_picture

        write_reach_picture(out, boom, found, reach_title(boom, found))
        answer["files"] = {"picture": out}
    else:
        from planner.recording import write_reach_recording

        write_reach_recording(out, boom, found)
        answer["files"] = {"recording": out}
    if as_json:
        _print_json(answer)
        return 0
    click.echo(
        f"{answer['within_limits']} of {answer['cells']} cells are reached within the limits: r up to "
        f"{answer['largest_r_m']:.2f} m, z from {answer['lowest_z_m']:.2f} to {answer['highest_z_m']:.2f} m"
    )
    if known:
        click.echo(f"torque margin {margin.min():.3f} to {margin.max():.3f}; {answer['overloaded']} cells overload a drive")
    for kind, name in answer["files"].items():
        click.echo(f"{kind}: {name}")
    return 0


@cli.command()
@click.argument("motion", metavar="IN")
@click.option("--out", required=True, metavar="OUT", help="The motion with its torques: .csv, .parquet, .yaml or .json.")
@payload_option
@payload_as_option
@boom_option
@json_option
def torque(motion: str, out: str, payload: float | None, payload_as: Any, boom_file: str | None, as_json: bool) -> int:
    """Inverse dynamics of a motion: the torque of each joint at each sample, with its friction where the boom's file gives it.

    IN is a CSV or Parquet file that holds t, q1..q5, qd1..qd5, qdd1..qdd5 in SI, or t, q1..q5 alone.

    \b
    Example:
      boom torque move.csv --out torques.csv --payload 8
    """
    from boom_model import JOINTS
    from planner.motion_files import form_of, read_motion, write_motion
    from planner.planning import torques

    form = form_of(out)
    boom, trajectory = _load(boom_file, payload), read_motion(motion)
    tau = torques(boom, trajectory, payload_as)
    write_motion(trajectory, out, tau)
    at = np.abs(tau).argmax(axis=0)
    peaks = [
        {"joint": joint, "tau": float(tau[k, i]), "unit": "N" if i == 3 else "Nm", "at_s": float(trajectory.t[k])}
        for i, (joint, k) in enumerate(zip(JOINTS, at, strict=True))
    ]
    if as_json:
        _print_json({"peaks": peaks, "notes": list(trajectory.notes), "files": {form[1:]: out}})
        return 0
    table = _table("joint", "peak", "at")
    for peak in peaks:
        table.add_row(str(peak["joint"]), f"{peak['tau']:.3f} {peak['unit']}", f"{peak['at_s']:.3f} s")
    _console().print(table)
    _print_lines("Note", trajectory.notes)
    click.echo(f"{form[1:]}: {out}")
    return 0


@cli.command()
@click.argument("motion", metavar="IN")
@payload_option
@payload_as_option
@vehicle_option
@click.option("--out", metavar="FILE.rrd", help="A recording of the motion, for `boom view`.")
@report_option
@picture_option
@boom_option
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
    as_json: bool,
) -> int:
    """Hold any motion against the joint limits and the drives' datasheets. IN is a CSV or Parquet file.

    \b
    Example:
      boom plan transport phenotyping --csv move.csv
      boom check move.csv --payload 8 --out checked.rrd
    """
    from planner.files import check_writable
    from planner.motion_files import read_motion
    from planner.planning import examine
    from planner.vehicle import load_case

    _require_document(document)
    _check_picture(picture)
    check_writable(out, document, picture)
    boom, trajectory = _load(boom_file, payload), read_motion(motion)
    case = None if vehicle is None else load_case(vehicle)
    move = examine(boom, trajectory, payload_as=payload_as, vehicle=case)
    written: dict[str, str] = {}
    if out is not None:
        from planner.recording import write_recording

        write_recording(out, move)
        written["recording"] = out
    if document is not None:
        _write_document(document, move.report, boom, trajectory, move.loads.tau, written)
    if picture is not None:
        from planner.drive_pictures import write_drive_picture

        write_drive_picture(picture, boom, trajectory, move.loads.tau, move.report)
        written["picture"] = picture
    return _print_report(move.report, written, as_json)


@cli.command()
@click.argument("motion", metavar="IN")
@click.argument("out", metavar="OUT")
def export(motion: str, out: str) -> int:
    """Turn a motion into another tool's form, by the ending of OUT.

    \b
    .csv          t, q1..q5, qd1..qd5, qdd1..qdd5 in SI, and tau1..tau5 where IN has them
    .parquet      the same columns, with their units
    .yaml, .json  ROS trajectory_msgs/JointTrajectory

    IN is a CSV or Parquet file; its torques go along as they are.

    \b
    Examples:
      boom export move.csv move.parquet
      boom torque move.csv --out torques.csv && boom export torques.csv move.yaml
    """
    from planner.motion_files import form_of, read_quantities, write_motion
    from planner.trajectory import trajectory_of

    form = form_of(out)
    data, notes = read_quantities(motion)
    trajectory = trajectory_of(motion, data, notes)
    write_motion(trajectory, out, data.get("tau"))
    _print_lines("Note", trajectory.notes)
    click.echo(f"{form[1:]}: {out}")
    return 0


@cli.command()
@click.argument("out", metavar="OUT.urdf|OUT.xml")
@payload_option
@boom_option
def export_model(out: str, payload: float | None, boom_file: str | None) -> int:
    """Write the boom, with its payload, as URDF or as MJCF for MuJoCo (.xml).

    \b
    URDF  a tree: mimic joints keep the parallelogram. A torque that a tool computes for a
          mimic joint belongs to the joint that it mimics.
    MJCF  the loop closed by a constraint, a motor on each joint, the named poses as keyframes.

    \b
    Example:
      boom export-model boom.urdf --payload 8
    """
    from planner.model_export import write_model

    write_model(_load(boom_file, payload), out)
    click.echo(f"model: {out}")
    return 0


@cli.command(context_settings={"ignore_unknown_options": True})  # so that --offset takes -0.5
@click.argument("planned", metavar="PLANNED")
@click.argument("measured", metavar="MEASURED")
@click.option(
    "--offset", default="0", show_default=True, metavar="S|best",
    help="Added to the log's times; best fits them to the plan, and so hides a delay of the drives.",
)  # fmt: skip
@click.option("--window", type=float, metavar="S", help="Width of the filter that differentiates the log; else 0.2 s.")
@click.option("--out", metavar="FILE.rrd", help="A recording of both, for `boom view`.")
@payload_option
@payload_as_option
@boom_option
@json_option
def compare(
    planned: str,
    measured: str,
    offset: str,
    window: float | None,
    out: str | None,
    payload: float | None,
    payload_as: Any,
    boom_file: str | None,
    as_json: bool,
) -> int:
    """Hold a measured motion against its plan: where joints and tip were, and what torques that takes.

    PLANNED and MEASURED are CSV or Parquet files. MEASURED holds t, q1..q5 in SI, and any of qd1..qd5, qdd1..qdd5 and
    tau1..tau5; derivatives that it lacks come from a Savitzky-Golay filter, whose noise is reported.

    \b
    Example:
      boom compare move.csv log.csv --offset best --out both.rrd
    """
    from planner.comparison import WINDOW, read_log
    from planner.comparison import compare as compare_motions
    from planner.files import check_writable
    from planner.motion_files import read_motion

    try:
        shift = None if offset == "best" else float(offset)
    except ValueError:
        raise InputError(f"offset {offset!r} is neither a number of seconds nor best") from None
    check_writable(out)
    found = compare_motions(
        _load(boom_file, payload),
        read_motion(planned),
        read_log(measured),
        offset=shift,
        window=WINDOW if window is None else window,
        payload_as=payload_as,
    )
    written = {}
    if out is not None:
        from planner.recording import write_comparison_recording

        write_comparison_recording(out, found)
        written["recording"] = out
    answer = found.to_json(written)
    if as_json:
        _print_json(answer)
        return 0
    _print_comparison(answer)
    return 0


@cli.command()
@click.argument("missions", metavar="MISSION...", nargs=-1, required=True)
@click.option("--joint", "joints", multiple=True, help="Compare the drive checks of this joint alone; may be given again.")
@payload_option
@payload_as_option
@vehicle_option
@click.option("--out", metavar="FILE.md", help="The report, or the comparison, as Markdown.")
@picture_option
@boom_option
@json_option
def mission(
    missions: tuple[str, ...],
    joints: tuple[str, ...],
    payload: float | None,
    payload_as: Any,
    vehicle: str | None,
    out: str | None,
    picture: str | None,
    boom_file: str | None,
    as_json: bool,
) -> int:
    """Check a duty cycle of moves, holds and pauses as a whole; several of them side by side.

    MISSION is a FILE.toml, or one of field-day, table-2-4 and table-3-1.

    \b
    Examples:
      boom mission field-day --picture drives.png
      boom mission table-2-4 table-3-1 --joint inner --joint lower
    """
    from planner.files import check_writable, write_text
    from planner.missions import check_cycle, load_mission, plan_cycle
    from planner.planning import torques
    from planner.rows import Verdict
    from planner.side_by_side import compared, comparison_markdown
    from planner.vehicle import load_case

    boom, case = _load(boom_file, payload), None if vehicle is None else load_case(vehicle)
    _check_picture(picture)
    check_writable(out, picture)
    if picture is not None and len(missions) > 1:
        raise InputError(f"--picture {picture}: a page shows one mission, and {len(missions)} are given")
    loaded = [load_mission(name) for name in missions]
    cycles = {each.name: plan_cycle(boom, each, case) for each in loaded}
    if len(cycles) < len(missions):
        raise InputError(f"two missions bear one name: {', '.join(each.name for each in loaded)}")
    reports = {name: check_cycle(boom, cycle, payload_as=payload_as, vehicle=case) for name, cycle in cycles.items()}
    written: dict[str, str] = {}
    header, rows = compared(reports, joints)
    alone = len(reports) == 1 and not joints
    if out is not None:
        text = next(iter(reports.values())).to_markdown() if alone else comparison_markdown(header, rows)
        write_text(out, text)
        written["markdown"] = out
    if picture is not None:
        from planner.drive_pictures import write_drive_picture

        ((name, cycle),) = cycles.items()
        tau = torques(boom, cycle.trajectory, payload_as, case)
        moves = [samples for leg, samples in cycle.slices() if leg.moves]
        write_drive_picture(picture, boom, cycle.trajectory, tau, reports[name], moves)
        written["picture"] = picture
    if alone:
        return _print_report(next(iter(reports.values())), written, as_json)
    if as_json:
        _print_json({"missions": {name: report.to_json({}) for name, report in reports.items()}, "files": written})
    else:
        _print_rows(header, rows)
        for name, report in reports.items():
            _print_lines(f"{name}", (report.summary,))
        for kind, name in written.items():
            click.echo(f"{kind}: {name}")
    return ANSWER_IS_NO if any(report.verdict is Verdict.FAIL for report in reports.values()) else 0


@cli.command()
@click.argument("mission", default="field-day")
@click.option("--joint", "joints", multiple=True, help="Size this joint; may be given again; else every one.")
@click.option("--voltage", "voltages", type=float, multiple=True, metavar="V", help="Bus voltage to try; may be given again.")
@click.option(
    "--adapt", type=click.Choice(["nothing", "rescale", "replan"]), default="nothing", show_default=True,
    help="What may change to suit a drive: the moves slowed evenly, or planned anew.",
)  # fmt: skip
@click.option(
    "--variant", "variants", multiple=True, metavar="BODY=KG,...",
    help="A boom of other masses beside the given one, payload=KG among them; may be given again.",
)  # fmt: skip
@payload_option
@payload_as_option
@click.option("--out", metavar="FILE.md", help="The tables as Markdown.")
@boom_option
@json_option
def size(
    mission: str,
    joints: tuple[str, ...],
    voltages: tuple[float, ...],
    adapt: str,
    variants: tuple[str, ...],
    payload: float | None,
    payload_as: Any,
    out: str | None,
    boom_file: str | None,
    as_json: bool,
) -> int:
    """Go through the catalogue for each joint: what does not fail, ranked by mass and margin, and why the rest does.

    \b
    Example:
      boom size field-day --variant inner=5.55 --variant payload=5
    """
    from boom_model import JOINTS, Catalogue
    from planner.files import check_writable, write_text
    from planner.missions import load_mission, plan_cycle
    from planner.sizing import Adapt, choose, parse_variant
    from planner.sizing_tables import SAVING, motors, ranking, saving, sizing_json, sizing_markdown, sizing_notes

    boom = _load(boom_file, payload)
    check_writable(out)
    catalogue = Catalogue.load().with_file(click.get_current_context().meta.get(_CATALOGUE))
    booms = {"as it is": boom} | {text: parse_variant(boom, text) for text in variants}
    cycle = plan_cycle(boom, load_mission(mission))
    choices = choose(booms, cycle, joints or JOINTS, catalogue, voltages, Adapt(adapt), payload_as)
    notes, written = sizing_notes(choices), {} if out is None else {"markdown": out}
    if out is not None:
        write_text(out, sizing_markdown(f"Drives for the mission {cycle.mission.name}", choices, notes))
    if as_json:
        _print_json(sizing_json(cycle.mission.name, choices, notes) | {"files": written})
    else:
        for choice in (choice for choice in choices if choice.judged):
            click.echo(f"{choice.joint}, {choice.variant}")
            _print_rows(*ranking(choice))
            _print_lines("All are warned of", choice.warned)
        click.echo("Each drive in its best supply")
        _print_rows(*motors(choices))
        click.echo("What the lightest saves")
        _print_rows(SAVING, saving(choices))
        _print_lines("Note", notes)
        for kind, name in written.items():
            click.echo(f"{kind}: {name}")
    return ANSWER_IS_NO if any(choice.judged and choice.lightest is None for choice in choices) else 0


@cli.command(context_settings={"ignore_unknown_options": True})
@click.argument("start")
@click.argument("goal")
@click.option(
    "--profile", "profiles", default="cubic", show_default=True, metavar="NAME,...|all", help="Profiles as in `boom plan`."
)
@click.option(
    "--controller", "controllers", default="all", show_default=True, metavar="NAME,...|all",
    help="pd, pid, computed-torque, lqr (with integral action), stepper (open loop).",
)  # fmt: skip
@click.option(
    "--shaper", "shapers", default="none", show_default=True, metavar="NAME,...|all",
    help="none, zv, zvd: impulses that cancel the lowest mode, for half a period or a whole one.",
)  # fmt: skip
@click.option("--bandwidth", default=6.0, show_default=True, metavar="HZ", help="Natural frequency of the loops' poles.")
@click.option("--damping", default=1.0, show_default=True, help="Damping ratio of the loops' poles.")
@click.option("--integral", default=0.3, show_default=True, help="Integral action's pole, as a share of the bandwidth.")
@click.option("--duration", type=float, metavar="S", help="As in `boom plan`.")
@pitch_option
@hold_option
@payload_option
@click.option("--payload-error", default=0.0, metavar="KG", help="True payload less the one that the controllers believe in.")
@click.option("--gust", metavar="FX,FY,FZ,START,DURATION", help="A push on the tip, (1 - cos)/2, in N along frame 1 and s.")
@click.option("--rigid-joints", is_flag=True, help="Leave out the gearboxes' elasticity, friction and the links' bending.")
@click.option("--rigid-links", is_flag=True, help="Leave out the bending of inner link and extension.")
@click.option("--backlash", is_flag=True, help="With the gearboxes' backlash.")
@click.option("--compensate-sag", is_flag=True, help="Send the motors ahead by the twist that the weight gives.")
@click.option("--settle-mm", default=1.0, show_default=True, metavar="MM", help="Within which the tip counts as settled.")
@click.option(
    "--set", "figures", multiple=True, metavar="NAME=VALUE",
    help="A figure that is assumed otherwise, as the report names it: rate_Hz, structural_damping, ...; may be given again.",
)  # fmt: skip
@click.option("--out", metavar="FILE.rrd", help="The recording, for `boom view`.")
@click.option("--loops", metavar="FILE.png", help="Bode diagrams and poles as a picture.")
@click.option("--errors", metavar="FILE.png", help="The tip's errors as a picture.")
@vehicle_option
@boom_option
@json_option
def control(
    start: str,
    goal: str,
    profiles: str,
    controllers: str,
    shapers: str,
    bandwidth: float,
    damping: float,
    integral: float,
    duration: float | None,
    pitch: str,
    hold: str,
    payload: float | None,
    payload_error: float,
    gust: str | None,
    rigid_joints: bool,
    rigid_links: bool,
    backlash: bool,
    compensate_sag: bool,
    settle_mm: float,
    figures: tuple[str, ...],
    out: str | None,
    loops: str | None,
    errors: str | None,
    vehicle: str | None,
    boom_file: str | None,
    as_json: bool,
) -> int:
    """Follow a planned move in closed loop: design, margins, simulation of the full model, and how far off the tip is.

    START and GOAL are as in `boom plan`. Exit code 1: a loop is unstable, or a stepper loses a step.

    \b
    Examples:
      boom control transport phenotyping --profile all
      boom control transport phenotyping --controller pid,stepper --shaper all --out control.rrd
      boom control transport phenotyping --payload-error 2 --gust 0,0,-30,5.2,0.5 --set structural_damping=0.01
    """
    from planner.control.closed_loop import parse_gust
    from planner.control.design import Controller, Goals
    from planner.control.figures import parse_figures
    from planner.control.shaping import Shaper
    from planner.control.study import Setup, study
    from planner.files import check_writable
    from planner.planning import plan as plan_move
    from planner.timing import Profile
    from planner.vehicle import load_case

    boom, case = _load(boom_file, payload), None if vehicle is None else load_case(vehicle)
    if not np.isfinite(settle_mm) or not settle_mm > 0.0:
        raise InputError(f"settle-mm is {settle_mm:g}; it must be a finite number above 0")
    setup = Setup(
        goals=Goals.of(bandwidth, damping, integral),
        figures=parse_figures(figures),
        elastic=not rigid_joints,
        bending=not rigid_links,
        backlash=backlash,
        compensate_sag=compensate_sag,
        payload_error=payload_error,
        vehicle=case,
        gust=None if gust is None else parse_gust(gust),
        settled=settle_mm * 1e-3,
    )
    chosen = [_several("controller", controllers, list(Controller)), _several("shaper", shapers, list(Shaper))]
    for name in (loops, errors):
        if name is not None and not name.endswith(".png"):
            raise InputError(f"{name}: a picture is written as .png")
    if loops is not None and chosen[0] == [Controller.STEPPER]:
        raise InputError("a stepper runs open loop: there is no Bode diagram of it")
    check_writable(out, loops, errors)
    ends, held, angle = (parse_target(start), parse_target(goal)), parse_hold(hold), parse_pitch(pitch)
    moves = [
        plan_move(boom, *ends, profile=profile, duration=duration, pitch=angle, hold=held, vehicle=case)
        for profile in _several("profile", profiles, list(Profile))
    ]
    found = study(boom, moves, [Controller(c) for c in chosen[0]], [Shaper(s) for s in chosen[1]], setup)
    written = {}
    if out is not None:
        from planner.recording import write_control_recording

        write_control_recording(out, found)
        written["recording"] = out
    if loops is not None or errors is not None:
        from planner.control.picture import error_figure, loop_figure, write_figure

        for kind, name, figure in (("loops", loops, loop_figure), ("errors", errors, error_figure)):
            if name is not None:
                write_figure(name, figure(found))
                written[kind] = name
    return _print_study(found, written, as_json)


@cli.command()
@click.option("--link", "name", default="inner", show_default=True, metavar="inner|lower|outer|extension", help="Which link.")
@click.option("--links", metavar="FILE.toml", help="Plates and fittings of your own links; else the shipped ones.")
@click.option(
    "--load", type=click.Choice(["moves", "thesis"]), default="moves", show_default=True,
    help="Every instant of the moves, or the thesis's load case.",
)  # fmt: skip
@click.option(
    "--method", type=click.Choice(["exact", "thesis"]), default="exact", show_default=True,
    help="Least mass by its optimality conditions, or the thesis's two-stage search.",
)  # fmt: skip
@click.option(
    "--move", "moves", nargs=2, multiple=True, metavar="START GOAL", help="A move that loads the link; may be given again."
)
@click.option(
    "--motion", "motions", multiple=True, metavar="FILE.csv", help="A motion that loads the link; may be given again."
)
@click.option(
    "--largest-components", is_flag=True, help="Each load component's largest at once, as the thesis does, not every instant."
)
@payload_option
@payload_as_option
@click.option("--material", default="steel", show_default=True, metavar="steel|aluminium|cfrp", help="cfrp is assumed data.")
@click.option("--thickness", type=float, metavar="M", help="Of one plate; else the link's own.")
@click.option("--safety-factor", type=float, default=2.0, show_default=True, help="Against yield and buckling.")
@click.option("--deflection", type=float, default=0.01, show_default=True, metavar="M", help="Largest deflection.")
@click.option("--min-height", type=float, default=0.0, show_default=True, metavar="M", help="Of the plates.")
@click.option("--max-height", type=float, metavar="M", help="Of the plates; else free.")
@click.option("--max-taper", type=float, metavar="RATIO", help="Largest change of height over length; else free.")
@click.option("--frozen", is_flag=True, help="Exact method: freeze the moments as the thesis does, and leave out shear.")
@click.option(
    "--shear/--no-shear",
    default=None,
    help="Exact method: whether shear counts in the deflection; else for the loads of moves, not for the thesis's.",
)
@click.option("--no-buckling", is_flag=True, help="Exact method: do not hold the safety factor against buckling.")
@click.option("--slices", type=int, default=1000, show_default=True, help="Along the link.")
@click.option("--step", type=float, default=1e-4, show_default=True, metavar="M", help="Thesis's method: its delta-H.")
@click.option("--out", metavar="FILE.rrd", help="A recording of the design.")
@click.option("--picture", metavar="FILE.png", help="Contour, stress, convergence, torque and mass.")
@click.option("--convergence", is_flag=True, help="Studies by slices, delta-H and elements, in the JSON.")
@click.option("--contour", metavar="FILE.txt", help="x, H/2, 0 for a CAD curve.")
@click.option("--csv", "csv_file", metavar="FILE.csv", help="Heights, sections, forces and stress at the stations.")
@click.option("--dxf", metavar="FILE.dxf", help="Outline of one plate in millimetres.")
@click.option("--out-boom", metavar="FILE.toml", help="The boom with the new link, for `boom plan --boom`.")
@boom_option
@json_option
def link(
    name: str,
    links: str | None,
    load: str,
    method: str,
    moves: tuple[tuple[str, str], ...],
    motions: tuple[str, ...],
    largest_components: bool,
    payload: float | None,
    payload_as: Any,
    material: str,
    thickness: float | None,
    safety_factor: float,
    deflection: float,
    min_height: float,
    max_height: float | None,
    max_taper: float | None,
    frozen: bool,
    shear: bool | None,
    no_buckling: bool,
    slices: int,
    step: float,
    out: str | None,
    picture: str | None,
    convergence: bool,
    contour: str | None,
    csv_file: str | None,
    dxf: str | None,
    out_boom: str | None,
    boom_file: str | None,
    as_json: bool,
) -> int:
    """Design a link: the least mass that holds stress, deflection and buckling, and what it does to the joint's torque.

    Without --move and --motion the moves are transport to phenotyping with every profile, each in its least time; for the
    thesis's load its own, a cubic of 5 s.

    \b
    Examples:
      boom link --load thesis --method thesis
      boom link --picture link.png --out-boom lighter.toml
      boom link --link lower --material aluminium --min-height 0.02 --dxf lower.dxf
    """
    from planner import link_files, link_report
    from planner.files import check_writable
    from planner.links import LinkTask, default_moves, design_link
    from planner.planning import plan_each_profile
    from planner.trajectory import read_csv

    files = {"recording": out, "picture": picture, "contour": contour, "csv": csv_file, "dxf": dxf, "boom": out_boom}
    check_writable(*files.values())
    boom = _load(boom_file, payload)
    task = LinkTask(
        link=name,
        load=load,
        method=method,
        material=material,
        safety_factor=safety_factor,
        deflection=deflection,
        slices=slices,
        step=step,
        min_height=min_height,
        max_height=max_height,
        max_taper=max_taper,
        thickness=thickness,
        own_mass=not frozen,
        shear=shear,
        buckling=not no_buckling,
        largest_components=largest_components,
        payload_as=payload_as,
        links=links,
    )
    trajectories = [read_csv(motion) for motion in motions]
    for start, goal in moves:
        trajectories += plan_each_profile(boom, parse_target(start), parse_target(goal))
    try:
        design = design_link(boom, task, trajectories or default_moves(boom, task))
    except InfeasibleError as error:
        if as_json:
            _print_json({"link": name, "load": load, "method": method, "mass_kg": None, "files": {}, "reason": str(error)})
        raise
    written = {kind: file for kind, file in files.items() if file is not None}
    if out is not None:
        from planner.recording import write_link_recording

        write_link_recording(out, design)
    if picture is not None:
        from planner.link_picture import write_link_picture

        write_link_picture(picture, design)
    for file, write in (
        (contour, link_files.write_contour),
        (csv_file, link_files.write_stations),
        (dxf, link_files.write_outline),
    ):
        if file is not None:
            write(file, design)
    if out_boom is not None:
        link_files.write_boom(out_boom, boom_file, design)
    if as_json:
        answer = link_report.to_json(design, written)
        if convergence:
            from planner.link_convergence import study

            answer["convergence"] = link_report.convergence_json(study(design))
        _print_json(answer)
        return 0
    console = _console()
    console.print(link_report.title(design), highlight=False)
    for header, rows in (
        (link_report.ROWS_HEADER, link_report.rows(design)),
        (link_report.MOTORS_HEADER, link_report.motor_rows(design)),
    ):
        table = _table(*header)
        for row in rows:
            table.add_row(*row)
        if rows:
            console.print(table)
    for line in link_report.sentences(design):
        console.print(line, highlight=False, soft_wrap=True)
    _print_lines("Note", design.notes)
    for kind, file in written.items():
        click.echo(f"{kind}: {file}")
    return 0


@cli.command()
@json_option
def validate(as_json: bool) -> int:
    """The thesis's tables 2-5 to 2-8 and 3-2 and its sections 3.5 and 3.6, row by row, against this model."""
    from planner.validation import validate as validate_model

    rows = validate_model(Boom.load())
    failed = sum(not row.ok for row in rows)
    if as_json:
        listed = [{**vars(row), "ok": row.ok} for row in rows]
        _print_json({"ok": failed == 0, "rows": listed})
    else:
        table = _table("table", "row", "quantity", "expected", "actual", "tolerance", "ok", "note")
        for row in rows:
            numbers = (f"{row.expected:.6g}", f"{row.actual:.5f}", f"{row.tolerance:.1g}")
            table.add_row(row.table, row.row, row.quantity, *numbers, "OK" if row.ok else "FAIL", row.note)
        _console().print(table)
        click.echo(f"{len(rows) - failed} of {len(rows)} rows hold")
    return ANSWER_IS_NO if failed else 0


@cli.command()
@click.argument("recording", metavar="FILE.rrd", type=click.Path(exists=True, dir_okay=False))
def view(recording: str) -> int:
    """Open a recording in the Rerun viewer."""
    return subprocess.run([sys.executable, "-m", "rerun", "--bind", "127.0.0.1", recording], check=False).returncode


def _load(boom_file: str | None, payload: float | None = None) -> Boom:
    boom = Boom.load(boom_file, click.get_current_context().meta.get(_CATALOGUE))
    return boom if payload is None else boom.with_payload(payload)


def _check_picture(picture: str | None) -> None:
    if picture is not None and not picture.endswith(".png"):
        raise InputError(f"{picture}: the drives' page is written as .png")


def _print_comparison(answer: dict[str, Any]) -> None:
    from planner.comparison import POSITION_HEADER, TORQUE_HEADER, position_cells, summary, torque_cells

    console = _console()
    for title, header, cells in (
        ("Positions, measured less planned", POSITION_HEADER, position_cells),
        ("Torques on level ground: the model's of the measured motion less the plan's, and the log's less the model's",
         TORQUE_HEADER, torque_cells),
    ):  # fmt: skip
        console.print(title, highlight=False)
        table = _table(*header)
        for joint in answer["joints"]:
            table.add_row(*cells(joint))
        console.print(table)
    _print_lines("Note", tuple(answer["notes"]))
    for line in summary(answer):
        console.print(line, highlight=False, soft_wrap=True)
    for kind, name in answer["files"].items():
        click.echo(f"{kind}: {name}")


def _print_report(report: "Report", written: dict[str, str], as_json: bool) -> int:
    from planner.checks import Verdict
    from planner.report import CERTIFICATE_HEADER, PEAK_HEADER, cells, peak_cells, worst_cells

    if as_json:
        _print_json(report.to_json(written))
    else:
        table = _table("joint", "check", "demand", "limit", "margin", "required", "at", "verdict", "basis")
        for i, row in enumerate(report.rows):
            last = i + 1 == len(report.rows) or report.rows[i + 1].joint != row.joint
            table.add_row(*cells(row), style=_STYLES.get(row.verdict), end_section=last)
        console = _console()
        console.print(table)
        console.print("Largest torques and where they come from (Nm, the extension's N)", highlight=False)
        peaks = _table(*PEAK_HEADER)
        for peak in report.peaks:
            peaks.add_row(*peak_cells(peak))
        console.print(peaks)
        if report.certificate is not None:
            worst = _table(*CERTIFICATE_HEADER)
            for ratio in report.certificate.worst:
                worst.add_row(*worst_cells(ratio))
            console.print("Worst ratio to each limit", highlight=False)
            console.print(worst)
        for sentence in report.sentences:
            click.echo(sentence)
        _print_lines("Note", report.notes)
        _print_lines("Assumed", report.assumptions)
        _print_lines("Would mend it", report.remedies)
        console.print(f"{report.profile}, {report.duration:.3f} s", highlight=False)
        console.print(report.summary, style=_STYLES.get(report.verdict), highlight=False, soft_wrap=True)
        for kind, name in written.items():
            click.echo(f"{kind}: {name}")
    return ANSWER_IS_NO if report.verdict is Verdict.FAIL else 0


def _print_study(study: "Study", written: dict[str, str], as_json: bool) -> int:
    from planner.control.study import LOOP_HEADER, ROW_HEADER, ROW_LEGEND, loop_cells, row_cells

    if as_json:
        _print_json(study.to_json(written))
        return ANSWER_IS_NO if study.failed else 0
    console = _console()
    table = _table(*ROW_HEADER)
    for row in study.rows:
        table.add_row(*row_cells(row), style=_STYLES.get(row.outcome))
    console.print(table)
    console.print(ROW_LEGEND, highlight=False)
    if study.designs:
        console.print("Loops at the goal, each joint's broken with the others closed", highlight=False)
        table = _table(*LOOP_HEADER)
        for design in study.designs:
            for i, cells in enumerate(loop_cells(design)):
                table.add_row(*cells, end_section=i == 4)
        console.print(table)
    _print_lines("Case", study.reasons)
    _print_lines("Note", study.notes)
    _print_lines("Assumed", study.assumptions)
    console.print(study.modes_sentence, highlight=False, soft_wrap=True)
    console.print(study.summary, style="bold red" if study.failed else None, highlight=False, soft_wrap=True)
    for kind, name in written.items():
        click.echo(f"{kind}: {name}")
    return ANSWER_IS_NO if study.failed else 0


def _several(what: str, text: str, known: Sequence[str]) -> list[str]:
    """The names of a list with commas, or all of them."""
    names = list(known) if text == "all" else list(dict.fromkeys(name.strip() for name in text.split(",")))
    for name in names:
        if name not in known:
            raise InputError(f"{what} is {name!r}; there are: {', '.join(known)}, or all")
    return names


_STYLES = {
    "FAIL": "bold red",
    "UNSTABLE": "bold red",
    "LOST STEP": "bold red",
    "WARN": "yellow",
    "saturates": "yellow",
    "NOT CHECKABLE": "magenta",
    "INCOMPLETE": "magenta",
    "INFO": "dim",
}


def _print_rows(header: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    table = _table(*header)
    for row in rows:
        table.add_row(*row)
    _console().print(table)


def _require_document(path: str | None) -> None:
    from planner.document import require_form
    from planner.files import check_writable

    if path is not None:
        require_form(path)
        check_writable(path)


def _write_document(
    path: str | None, report: "Report", boom: Boom, motion: "Trajectory", tau: "Array", written: dict[str, str]
) -> None:
    from planner.document import write_document
    from planner.drive_pictures import drive_figure
    from planner.move_pictures import move_pictures

    if path is not None:
        drives = {"Drives": drive_figure(boom, motion, tau, report)} if any(boom.drives) else {}
        write_document(path, report.to_markdown(), move_pictures(boom, motion, tau) | drives)
        written["report"] = path


def _print_lines(title: str | None, lines: Iterable[str]) -> None:
    for line in () if title is None else lines:
        click.echo(f"{title}: {line}")


def _print_json(answer: dict[str, Any]) -> None:
    out = click.get_current_context().meta.get(_LOUD, sys.stdout)
    click.echo(json.dumps(answer, allow_nan=False, indent=2), file=out)


def _complain(message: str) -> None:
    click.echo(f"boom: {' '.join(message.split())}", err=True)


def _tracked(title: str) -> Callable[[list[Any]], Iterable[Any]]:
    """Iteration with a progress bar on standard error, where that is a terminal."""

    def track(steps: list[Any]) -> Iterable[Any]:
        from rich.console import Console
        from rich.progress import track as bar

        return bar(steps, title, console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty() or _is_quiet())

    return track


_LOUD = "boom.stdout"


def _is_quiet() -> bool:
    return _LOUD in click.get_current_context().meta


def _quieten(ctx: click.Context, _: click.Parameter, quiet: bool) -> None:
    """Standard output goes nowhere until the command ends; JSON, which was asked for, still goes out."""
    if not quiet or _LOUD in ctx.meta:
        return
    ctx.meta[_LOUD], nowhere = sys.stdout, io.StringIO()
    ctx.with_resource(redirect_stdout(nowhere))


def _console() -> "Console":
    from rich.console import Console

    width = None if sys.stdout.isatty() else _PIPE_WIDTH
    return Console(width=width, markup=False)  # a unit in brackets is no style


def _table(*columns: str) -> "Table":
    from rich.box import SIMPLE
    from rich.table import Table

    return Table(*columns, box=SIMPLE, pad_edge=False)


for _command in cli.commands.values():
    _command.params.append(
        click.Option(["-q", "--quiet"], is_flag=True, expose_value=False, callback=_quieten, help="Print errors alone.")
    )
