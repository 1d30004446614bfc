"""Jobs on one move: plan it, compare its profiles, its torques, and the checks of any motion."""

from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from boom_model import Boom, InfeasibleError, InputError
from boom_model.plausible import DURATION, RATE
from planner.cli.options import (
    boom_option,
    check_picture,
    hold_option,
    json_option,
    load_boom,
    load_vehicle,
    outputs,
    payload_as_option,
    payload_option,
    picture_option,
    pitch_option,
    plausible,
    report_option,
    vehicle_option,
)
from planner.cli.printing import ANSWER_IS_NO, complain, print_files, print_json, print_lines, print_report, print_rows, tracked
from planner.paths.targets import parse_joint_velocity, parse_pitch

if TYPE_CHECKING:
    from boom_model.arrays import Array
    from planner.files import Outputs
    from planner.motion.trajectory import Trajectory
    from planner.reports.report import Report


@click.command(context_settings={"ignore_unknown_options": True})  # so that -0.5 is a number
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
@click.option("--duration", type=float, callback=plausible(DURATION), metavar="S", help="Else the least that the limits allow.")
@click.option("--jerk-bound", is_flag=True, help="Hold the time-optimal profile to the jerk limits as well.")
@click.option("--average-torque", is_flag=True, help="Hold the time-optimal profile to the gearboxes' average torque as well.")
@click.option(
    "--rate",
    type=float,
    callback=plausible(RATE),
    metavar="HZ",
    help="Sample at a controller's rate; the move ends on its clock.",
)
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
    from planner.motion.trajectory import write_csv
    from planner.move_spec import MoveSpec
    from planner.planning import plan_move
    from planner.suggestions import suggestions
    from planner.timing.profile import parse_profile

    boom = load_boom(boom_file, payload)
    case = load_vehicle(vehicle)
    check_picture(picture)
    files = outputs(out, csv_file, picture, document=document, inputs=(boom_file, vehicle))
    elevation = parse_pitch(pitch)
    if show_reach and elevation is None:
        raise InputError("pitch free: the reach is drawn for one pitch")
    velocities = [parse_joint_velocity(text) for text in via_velocity]
    if velocities and len(velocities) != len(via):
        raise InputError(f"{len(velocities)} --via-velocity for {len(via)} --via; give one for each")
    spec = MoveSpec.of(
        start,
        goal,
        profile=parse_profile(profile, jerk_bound=jerk_bound, average_torque=average_torque, velocities=velocities or None),
        duration=duration,
        pitch=pitch,
        constraint=hold,
        via=via,
        stop_at_via=not pass_via,
        along=along,
        vehicle=case,
        rate=rate,
    )
    track = tracked("looking for what would mend it")
    try:
        move = plan_move(boom, spec)
    except InfeasibleError as error:
        mend = [each.sentence for each in suggestions(boom, spec, track)]
        if as_json:
            failed: dict[str, Any] = {"profile": profile, "duration_s": None, "verdict": "FAIL", "checks": [], "files": {}}
            print_json({**failed, "reason": str(error), "remedies": mend})
        print_lines("Would mend it" if not as_json else None, mend)
        raise
    report = move.full_report
    if report.verdict == "FAIL":
        report = replace(report, suggestions=tuple(each.sentence for each in suggestions(boom, spec, track)))
    from planner.recording import write_recording

    reach = None
    if show_reach and elevation is not None:
        from boom_model.kinematics.reach import reach_map

        reach = reach_map(boom, spec.constraint, elevation)
    written = {"recording": out}
    with files:
        write_recording(files.temporary(out), move, reach=reach)
        if csv_file is not None:
            write_csv(move.trajectory, files.temporary(csv_file), move.loads.tau)
            written["csv"] = csv_file
        if picture is not None:
            from planner.reports.drive_pictures import write_drive_picture

            write_drive_picture(files.temporary(picture), boom, move.trajectory, move.loads.tau, report)
            written["picture"] = picture
        _write_report(files, document, report, boom, move.trajectory, move.loads.tau, written)
    return print_report(report, written, as_json)


@click.command(context_settings={"ignore_unknown_options": True})
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
    from planner.move_spec import MoveSpec
    from planner.profile_table import HEADER, cells, profile_markdown, profile_moves, profile_rows

    files = outputs(out, inputs=(boom_file,))
    spec = MoveSpec.of(start, goal, via=via, stop_at_via=not pass_via, pitch=pitch, constraint=hold)
    moves, refused = profile_moves(load_boom(boom_file, payload), spec, tracked("planning with each profile"))
    rows = profile_rows(moves)
    written: dict[str, str] = {}
    if out is not None:
        from planner.recording import write_moves_recording

        with files:
            write_moves_recording(files.temporary(out), moves, profile_markdown(rows))
        written["recording"] = out
    if as_json:
        print_json({"profiles": [asdict(row) for row in rows], "refused": refused, "files": written})
    else:
        print_rows(HEADER, map(cells, rows))
        print_files(written)
    failed = [f"{row.profile}: a check FAILs" for row in rows if row.verdict == "FAIL"]
    failed += [f"{name}: {reason}" for name, reason in refused.items()]
    if failed:
        complain("; ".join(failed))
    return ANSWER_IS_NO if failed else 0


@click.command()
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
    from boom_model.boom import JOINTS, LOAD_UNITS
    from planner.motion.motion_files import form_of, read_motion, write_motion
    from planner.planning import torques

    form = form_of(out)
    files = outputs(out, inputs=(motion, boom_file))
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
    print_rows(
        ("joint", "peak", "at"),
        [(str(peak["joint"]), f"{peak['tau']:.3f} {peak['unit']}", f"{peak['at_s']:.3f} s") for peak in peaks],
    )
    print_lines("Note", trajectory.notes)
    click.echo(f"{form[1:]}: {out}")
    return 0


@click.command()
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
    from planner.motion.motion_files import read_motion
    from planner.planning import examine

    check_picture(picture)
    files = outputs(out, picture, document=document, inputs=(motion, boom_file, vehicle))
    boom, trajectory = load_boom(boom_file, payload), read_motion(motion)
    move = examine(boom, trajectory, payload_as=payload_as, vehicle=load_vehicle(vehicle))
    written: dict[str, str] = {}
    with files:
        if out is not None:
            from planner.recording import write_recording

            write_recording(files.temporary(out), move)
            written["recording"] = out
        _write_report(files, document, move.report, boom, trajectory, move.loads.tau, written)
        if picture is not None:
            from planner.reports.drive_pictures import write_drive_picture

            write_drive_picture(files.temporary(picture), boom, trajectory, move.loads.tau, move.report)
            written["picture"] = picture
    return print_report(move.report, written, as_json)


def _write_report(
    files: "Outputs",
    document: str | None,
    report: "Report",
    boom: Boom,
    motion: "Trajectory",
    tau: "Array",
    written: dict[str, str],
) -> None:
    from planner.reports.document import write_document
    from planner.reports.drive_pictures import drive_pages
    from planner.reports.move_pictures import move_pictures

    if document is not None:
        write_document(
            files.temporary(document),
            report.to_markdown(),
            move_pictures(boom, motion, tau) | drive_pages(boom, motion, tau, report),
        )
        written["report"] = document
