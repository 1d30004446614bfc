"""The commands that convert and compare motions, export models, and validate the model."""

from typing import Any

import click

from boom_model import Boom, InputError
from boom_model.plausible import TIME, TIP_ERROR, WINDOW
from planner.cli.completion import OutFile, any_file
from planner.cli.options import (
    all_option,
    boom_option,
    json_option,
    load_boom,
    outputs,
    payload_as_option,
    payload_option,
    plausible,
)
from planner.cli.printing import ANSWER_IS_NO, complain, print_files, print_json, print_lines, print_rows


@click.command()
@click.argument("motion", type=click.Path(), metavar="IN")
@click.argument("out", metavar="OUT", shell_complete=any_file)
def export(motion: str, out: str) -> int:
    """Convert a motion to the format given by the ending of OUT.

    \b
    .csv          t, q1..q5, qd1..qd5, qdd1..qdd5 in SI, and tau1..tau5 if IN has them
    .parquet      the same columns, with their units
    .yaml, .json  ROS trajectory_msgs/JointTrajectory

    IN is a CSV or Parquet file. Its torques are copied unchanged.

    \b
    Examples:
      boom export move.csv move.parquet
      boom torque move.csv --out torques.csv && boom export torques.csv move.yaml
    """
    from planner.motion.motion_files import form_of, read_quantities, write_motion
    from planner.motion.trajectory import trajectory_of

    form = form_of(out)
    files = outputs(out, inputs=(motion,))
    data, notes = read_quantities(motion)
    trajectory = trajectory_of(motion, data, notes)
    with files:
        write_motion(trajectory, files.temporary(out), data.get("tau"))
    print_lines("Note", trajectory.notes)
    click.echo(f"{form[1:]}: {out}")
    return 0


@click.command()
@click.argument("out", metavar="OUT.urdf|OUT.xml", shell_complete=any_file)
@payload_option
@boom_option
def export_model(out: str, payload: float | None, boom_file: str | None) -> int:
    """Write the boom, with its payload, as URDF or as MJCF for MuJoCo (.xml).

    \b
    URDF  a tree; mimic joints keep the parallelogram. A torque that a tool computes for a
          mimic joint acts on the joint that it mimics.
    MJCF  a constraint closes the loop; a motor on each joint; the named poses are keyframes.

    \b
    Example:
      boom export-model boom.urdf --payload 8
    """
    from planner.exports.robot_models import write_model

    files, boom = outputs(out, inputs=(boom_file,)), load_boom(boom_file, payload)
    with files:
        write_model(boom, files.temporary(out))
    click.echo(f"model: {out}")
    return 0


@click.command(context_settings={"ignore_unknown_options": True})  # so that --offset takes -0.5
@click.argument("planned", metavar="PLANNED", shell_complete=any_file)
@click.argument("measured", metavar="MEASURED", shell_complete=any_file)
@click.option(
    "--offset", default="0", show_default=True, metavar="S|best",
    help="Time added to the log. best fits it to the plan, which hides a delay of the drives.",
)  # fmt: skip
@click.option(
    "--window",
    type=float,
    callback=plausible(WINDOW),
    metavar="S",
    help="Width of the filter that differentiates the log. Default: 0.2 s.",
)
@click.option(
    "--tolerance",
    type=float,
    callback=plausible(TIP_ERROR),
    metavar="M",
    help="Largest allowed tip error.",
)
@click.option("--out", type=OutFile(".rrd"), metavar="FILE.rrd", help="Write a recording of both for `boom view`.")
@click.option(
    "--after", type=click.Path(), metavar="FILE.toml", help="The boom as identified: the log's torques before and after."
)
@payload_option
@payload_as_option
@boom_option
@all_option
@json_option
def compare(
    planned: str,
    measured: str,
    offset: str,
    window: float | None,
    tolerance: float | None,
    out: str | None,
    after: str | None,
    payload: float | None,
    payload_as: Any,
    boom_file: str | None,
    whole: bool,
    as_json: bool,
) -> int:
    """Compare a measured motion with its plan: joints, tip and torques.

    PLANNED and MEASURED are CSV or Parquet files. MEASURED has the columns t and q1..q5 in SI, and
    optionally qd1..qd5, qdd1..qdd5 and tau1..tau5. A Savitzky-Golay filter computes missing
    derivatives; their noise is reported.

    \b
    Example:
      boom compare move.csv log.csv --offset best --out both.rrd
    """
    from planner.experiments.comparison import WINDOW as USUAL_WINDOW
    from planner.experiments.comparison import compare as compare_motions
    from planner.experiments.comparison import read_log
    from planner.motion.motion_files import read_motion

    try:
        shift = None if offset == "best" else float(offset)
    except ValueError:
        raise InputError(f"offset {offset!r} is neither a number of seconds nor best") from None
    if shift is not None:
        TIME.require("offset", shift)
    files = outputs(out, inputs=(planned, measured, boom_file, after))
    found = compare_motions(
        load_boom(boom_file, payload),
        read_motion(planned),
        read_log(measured),
        offset=shift,
        window=USUAL_WINDOW if window is None else window,
        payload_as=payload_as,
        after=None if after is None else load_boom(after, payload),
    )
    written = {}
    if out is not None:
        from planner.recording import write_comparison_recording

        with files:
            write_comparison_recording(files.temporary(out), found)
        written["recording"] = out
    answer = found.to_json(written)
    peak = answer["tip"]["peak_m"]
    failed = tolerance is not None and peak > tolerance
    answer |= {"tolerance_m": tolerance, "verdict": None if tolerance is None else "FAIL" if failed else "PASS"}
    words = "" if tolerance is None else f"tip error {peak * 1e3:.2f} mm of {tolerance * 1e3:g} mm"
    if as_json:
        print_json(answer)
    else:
        times = f"{answer['samples']} samples from {answer['from_s']:.3f} to {answer['to_s']:.3f} s"
        _print_comparison(
            answer, f"{measured} against {planned}, {times}", f"{answer['verdict']}: {words}" if words else None, whole
        )
    if failed:
        complain(words)
    return ANSWER_IS_NO if failed else 0


@click.command()
@all_option
@json_option
def validate(whole: bool, as_json: bool) -> int:
    """Compare the model with the thesis, row by row: tables 2-5 to 2-8, 3-2; sections 3.5, 3.6.

    \b
    Example:
      boom validate
    """
    from planner.validation.tables import ROW_HEADER, by_table, row_cells
    from planner.validation.tables import validate as validate_model

    rows = validate_model(Boom.load())
    failed = sum(not row.ok for row in rows)
    if as_json:
        listed = [{**vars(row), "ok": row.ok} for row in rows]
        print_json({"ok": failed == 0, "rows": listed})
    else:
        print_lines(None, [f"{len(rows) - failed} of {len(rows)} rows hold"])
        print_rows(("table", "values", "hold", "largest difference, of its tolerance"), by_table(rows))
        shown = rows if whole else [row for row in rows if not row.ok]
        if shown:
            print_rows(ROW_HEADER, map(row_cells, shown), drop=("note", "quantity"))
        if not whole:
            click.echo("--all lists every value with its note")
    if failed:
        complain(f"{failed} of {len(rows)} rows do not hold")
    return ANSWER_IS_NO if failed else 0


def _print_comparison(answer: dict[str, Any], asked: str, verdict: str | None, whole: bool) -> None:
    from planner.experiments import comparison

    print_lines(None, [asked, *([] if verdict is None else [verdict])])
    print_lines(None, comparison.summary(answer))
    print_rows(comparison.ANSWER_HEADER, map(comparison.answer_cells, answer["joints"]), drop=("RMS", "at"))
    if answer["joints"][0]["torque"]["parts_after"] is not None:
        if answer["joints"][0]["torque"]["logged_less_after"] is not None:
            click.echo("Torques of the log less the model's, before and after identification, RMS")
            print_rows(comparison.AFTER_HEADER, map(comparison.after_cells, answer["joints"]))
        if whole:
            click.echo("Parts of the model's torques, before and after identification, RMS")
            print_rows(comparison.PARTS_HEADER, map(comparison.part_cells, answer["joints"]))
    if whole:
        for title, header, cells in (
            ("Positions, measured minus planned", comparison.POSITION_HEADER, comparison.position_cells),
            ("Torques of the measured motion minus those of the plan", comparison.TORQUE_HEADER, comparison.torque_cells),
            ("Torques of the log minus those of the model", comparison.LOGGED_HEADER, comparison.logged_cells),
        ):
            click.echo(title)
            print_rows(header, map(cells, answer["joints"]))
        print_lines("note", answer["notes"])
    else:
        print_lines(None, [f"{len(answer['notes'])} notes, noise, means: --all lists them"])
    print_files(answer["files"])
