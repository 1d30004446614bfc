"""The commands that convert motions, export models, and validate the model."""

import click

from boom_model import Boom
from planner.cli.completion import any_file
from planner.cli.options import (
    all_option,
    boom_option,
    json_option,
    load_boom,
    outputs,
    payload_option,
)
from planner.cli.printing import ANSWER_IS_NO, complain, print_json, print_lines, print_rows


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
    from planner.exports.robot_models import left_out, write_model

    files, boom = outputs(out, inputs=(boom_file,)), load_boom(boom_file, payload)
    with files:
        write_model(boom, files.temporary(out))
    print_lines("note", left_out(boom))
    click.echo(f"model: {out}")
    return 0


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
