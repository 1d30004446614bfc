"""The command `boom`: parsing and printing, nothing else. What is slow to import is imported by the command that needs it."""

import json
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from boom_model import Boom, BoomError, InfeasibleError, InputError, inverse_kinematics
from planner.targets import HOLDS, parse_along, parse_hold, parse_pitch, parse_target, unreachable

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from planner.report import Report

ANSWER_IS_NO, BAD_INPUT = 1, 2
_PIPE_WIDTH = 132

boom_option = click.option("--boom", "boom_file", metavar="FILE.toml", help="A boom of your own; else the third generation.")
payload_option = click.option("--payload", type=float, metavar="KG", help="Mass at the tip; else the boom's own.")
payload_as_option = click.option(
    "--payload-as", type=click.Choice(["mass", "force"]), default="mass", show_default=True,
    help="Accelerate the payload with the tip, or hang its weight there and leave out its inertia, as the thesis does.",
)  # fmt: skip
json_option = click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output, in SI.")
vehicle_option = click.option(
    "--vehicle",
    metavar="CASE",
    help="What the vehicle does meanwhile: slope, track, shock, ditch or a FILE.toml; else it rests.",
)
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
    "--profile", type=click.Choice(["cubic", "time-optimal", "jerk-limited"]), default="cubic", show_default=True,
    help="How the path is timed.",
)  # fmt: skip
@click.option("--via", multiple=True, metavar="TARGET", help="A target on the way, with a stop; may be given again.")
@click.option(
    "--along", default="joint", show_default=True, metavar="joint|line|arc=X,Y,Z",
    help="What goes straight: the joints, or the tip from tip target to tip target; or an arc of the tip through a point.",
)  # fmt: skip
@click.option("--duration", type=float, metavar="S", help="Else the least that the limits allow.")
@pitch_option
@hold_option
@payload_option
@click.option("--out", default="move.rrd", show_default=True, metavar="FILE.rrd", help="The recording, for `boom view`.")
@click.option("--csv", "csv_file", metavar="FILE.csv", help="The motion with its torques.")
@vehicle_option
@boom_option
@json_option
def plan(
    start: str,
    goal: str,
    profile: str,
    via: tuple[str, ...],
    along: str,
    duration: float | None,
    pitch: str,
    hold: str,
    payload: float | None,
    out: str,
    csv_file: str | None,
    vehicle: str | None,
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
    """
    from planner.files import check_writable
    from planner.planning import plan as plan_move
    from planner.trajectory import write_csv
    from planner.vehicle import load_case

    boom = _load(boom_file, payload)
    case = None if vehicle is None else load_case(vehicle)
    check_writable(out, csv_file)
    try:
        move = plan_move(
            boom,
            parse_target(start),
            parse_target(goal),
            profile=profile,
            duration=duration,
            pitch=parse_pitch(pitch),
            hold=parse_hold(hold),
            via=[parse_target(text) for text in via],
            along=parse_along(along),
            vehicle=case,
        )
    except InfeasibleError as error:
        if as_json:
            _print_json(
                {
                    "profile": profile,
                    "duration_s": None,
                    "verdict": "FAIL",
                    "checks": [],
                    "files": {},
                    "reason": str(error),
                }
            )
        raise
    from planner.recording import write_recording

    written = {"recording": out}
    write_recording(out, move)
    if csv_file is not None:
        write_csv(move.trajectory, csv_file, move.loads.tau)
        written["csv"] = csv_file
    return _print_report(move.report, written, as_json)


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
@click.argument("motion", metavar="IN.csv")
@click.option("--out", required=True, metavar="OUT.csv", help="The motion with tau1..tau5 appended.")
@payload_option
@payload_as_option
@boom_option
@json_option
def torque(motion: str, out: str, payload: float | None, payload_as: Any, boom_file: str | None, as_json: bool) -> int:
    """Inverse dynamics of a motion: the torque of each joint at each sample, with its friction where the boom's file gives it.

    IN.csv holds t, q1..q5, qd1..qd5, qdd1..qdd5 in SI, or t, q1..q5 alone.

    \b
    Example:
      boom torque move.csv --out torques.csv --payload 8
    """
    from boom_model import JOINTS
    from planner.planning import torques
    from planner.trajectory import read_csv, write_csv

    boom, trajectory = _load(boom_file, payload), read_csv(motion)
    tau = torques(boom, trajectory, payload_as)
    write_csv(trajectory, out, tau)
    at = np.abs(tau).argmax(axis=0)
    peaks = [
        {"joint": joint, "tau": float(tau[k, i]), "unit": "N" if i == 3 else "Nm", "at_s": float(trajectory.t[k])}
        for i, (joint, k) in enumerate(zip(JOINTS, at, strict=True))
    ]
    if as_json:
        _print_json({"peaks": peaks, "notes": list(trajectory.notes), "files": {"csv": out}})
        return 0
    table = _table("joint", "peak", "at")
    for peak in peaks:
        table.add_row(str(peak["joint"]), f"{peak['tau']:.3f} {peak['unit']}", f"{peak['at_s']:.3f} s")
    _console().print(table)
    _print_lines("Note", trajectory.notes)
    click.echo(f"csv: {out}")
    return 0


@cli.command()
@click.argument("motion", metavar="IN.csv")
@payload_option
@payload_as_option
@vehicle_option
@boom_option
@json_option
def check(
    motion: str, payload: float | None, payload_as: Any, vehicle: str | None, boom_file: str | None, as_json: bool
) -> int:
    """Hold any motion against the joint limits and the drives' datasheets.

    \b
    Example:
      boom plan transport phenotyping --csv move.csv
      boom check move.csv --payload 8
    """
    from planner.planning import check as check_motion
    from planner.trajectory import read_csv
    from planner.vehicle import load_case

    boom, trajectory = _load(boom_file, payload), read_csv(motion)
    case = None if vehicle is None else load_case(vehicle)
    return _print_report(check_motion(boom, trajectory, payload_as=payload_as, vehicle=case), {}, as_json)


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
    boom = Boom.load(boom_file)
    return boom if payload is None else boom.with_payload(payload)


def _print_report(report: "Report", written: dict[str, str], as_json: bool) -> int:
    from planner.checks import Verdict
    from planner.report import PEAK_HEADER, cells, peak_cells

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
        _print_lines("Note", report.notes)
        _print_lines("Assumed", report.assumptions)
        console.print(f"{report.profile}, {report.duration:.3f} s", highlight=False)
        console.print(report.summary, style=_STYLES.get(report.verdict), highlight=False, soft_wrap=True)
        for kind, name in written.items():
            click.echo(f"{kind}: {name}")
    return ANSWER_IS_NO if report.verdict is Verdict.FAIL else 0


_STYLES = {"FAIL": "bold red", "WARN": "yellow", "NOT CHECKABLE": "magenta", "INCOMPLETE": "magenta"}


def _print_lines(title: str, lines: tuple[str, ...]) -> None:
    for line in lines:
        click.echo(f"{title}: {line}")


def _print_json(answer: dict[str, Any]) -> None:
    click.echo(json.dumps(answer, allow_nan=False, indent=2))


def _complain(message: str) -> None:
    click.echo(f"boom: {' '.join(message.split())}", err=True)


def _console() -> "Console":
    from rich.console import Console

    width = None if sys.stdout.isatty() else _PIPE_WIDTH
    return Console(width=width, markup=False)  # a unit in brackets is no style


def _table(*columns: str) -> "Table":
    from rich.box import SIMPLE
    from rich.table import Table

    return Table(*columns, box=SIMPLE, pad_edge=False)
