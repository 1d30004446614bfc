"""The command that designs a link."""

from collections.abc import Callable, Sequence
from functools import wraps
from typing import TYPE_CHECKING, Any

import click

from boom_model import Boom, InfeasibleError, InputError
from planner.cli.completion import OutFile, any_file, links, materials
from planner.cli.options import (
    all_option,
    boom_option,
    described_option,
    given_catalogue,
    json_option,
    load_boom,
    outputs,
    payload_as_option,
    payload_option,
    report_option,
    with_names,
)
from planner.cli.printing import print_files, print_json, print_lines, print_rows, tracked
from planner.links.task import OPTIONS, LinkTask
from planner.paths.targets import parse_target

if TYPE_CHECKING:
    from planner.files import Outputs
    from planner.links.design import LinkDesign
    from planner.motion.trajectory import Trajectory

_Command = Callable[..., Any]
_COMPLETE = {"link": links, "links": any_file, "material": materials}


def task_options(command: _Command) -> _Command:
    """Add the options of a `LinkTask` to a command, which receives them as `task`."""

    @wraps(command)
    def run(**given: Any) -> Any:
        task = LinkTask(payload_as=given.pop("payload_as"), **{name: given.pop(name) for name in OPTIONS})
        return command(task=task, **given)

    decorated: _Command = payload_as_option(run)
    for name, option in reversed(OPTIONS.items()):
        completes = _COMPLETE.get(name)
        decorated = described_option(name, option, getattr(LinkTask, name), shell_complete=completes)(decorated)
    return decorated


@click.command()
@task_options
@click.option("--move", "moves", nargs=2, multiple=True, metavar="START GOAL", help="Move that loads the link; repeatable.")
@click.option(
    "--motion",
    "motions",
    type=click.Path(),
    multiple=True,
    metavar="FILE.csv",
    help="Motion that loads the link; repeatable.",
)
@payload_option
@click.option("--out", type=OutFile(".rrd"), metavar="FILE.rrd", help="Write a recording of the design.")
@click.option(
    "--picture",
    shell_complete=any_file,
    metavar="FILE.png",
    help="Write a picture with contour, stress, convergence, torque and mass.",
)
@report_option
@click.option("--convergence", is_flag=True, help="Add convergence studies over slices, delta-H and elements to the JSON.")
@click.option(
    "--contour", shell_complete=any_file, metavar="FILE.txt", help="Write the contour as lines of x, H/2, 0 for a CAD curve."
)
@click.option(
    "--csv",
    "csv_file",
    type=OutFile(".csv"),
    metavar="FILE.csv",
    help="Write heights, sections, forces and stress at the stations.",
)
@click.option("--dxf", shell_complete=any_file, metavar="FILE.dxf", help="Write the outline of one plate in millimetres.")
@click.option(
    "--out-boom", shell_complete=any_file, metavar="FILE.toml", help="Write the boom with the new link, for `boom plan --boom`."
)
@boom_option
@all_option
@json_option
def link(
    task: "LinkTask",
    moves: tuple[tuple[str, str], ...],
    motions: tuple[str, ...],
    payload: float | None,
    out: str | None,
    picture: str | None,
    document: str | None,
    convergence: bool,
    contour: str | None,
    csv_file: str | None,
    dxf: str | None,
    out_boom: str | None,
    boom_file: str | None,
    whole: bool,
    as_json: bool,
) -> int:
    """Design the lightest link within limits on stress, deflection and buckling.

    The output includes the change of joint torque. Without --move and --motion, the moves are
    transport to phenotyping with every profile in its shortest time. For --load thesis, the move is
    that of the thesis, a cubic of 5 s.

    \b
    Examples:
      boom link --load thesis --method thesis
      boom link --report link.pdf --out-boom lighter.toml
      boom link --link lower --material aluminium --min-height 0.02 --dxf lower.dxf
    """
    from boom_model import Catalogue
    from planner.links.design import default_moves, design_link

    named = {"recording": out, "picture": picture, "contour": contour, "csv": csv_file, "dxf": dxf, "boom": out_boom}
    if convergence and not as_json:
        raise InputError("--convergence is part of the JSON: add --json, or use --picture")
    if picture is not None and not picture.endswith(".png"):
        raise InputError(f"{picture}: a picture is written as .png")
    files = outputs(*named.values(), document=document, inputs=(boom_file, task.links, *motions))
    boom, catalogue = load_boom(boom_file, payload), Catalogue.load().with_file(given_catalogue())
    boom.geometry.require_parallelogram("boom link")
    planning = tracked("planning with each profile")
    trajectories = _loading(boom, moves, motions, planning)
    try:
        design = design_link(boom, task, trajectories or default_moves(boom, task, planning), catalogue)
    except InfeasibleError as error:
        if as_json:
            asked = {"link": task.link, "load": task.load, "method": task.method}
            print_json({**asked, "mass_kg": None, "files": {}, "reason": str(error)})
        raise
    written = with_names(named | {"report": document})
    _write(files, design, written, boom_file)
    _print_design(design, written, whole, as_json, convergence)
    return 0


def _loading(boom: Boom, moves: Sequence[tuple[str, str]], motions: Sequence[str], planning: Any) -> list["Trajectory"]:
    """Return the motions that load the link: from files, and from moves with every profile."""
    from planner.motion.motion_files import read_motion
    from planner.planning import plan_each_profile

    trajectories = [read_motion(motion) for motion in motions]
    for start, goal in moves:
        trajectories += plan_each_profile(boom, parse_target(start), parse_target(goal), planning)
    return trajectories


def _write(files: "Outputs", design: "LinkDesign", written: dict[str, str], boom_file: str | None) -> None:
    """Write the output files of a design, given by kind."""
    from planner.links import files as link_files

    writers = {
        "contour": link_files.write_contour,
        "csv": link_files.write_stations,
        "dxf": link_files.write_outline,
    }
    with files:
        for kind, name in written.items():
            place = files.temporary(name)
            if kind in writers:
                writers[kind](place, design)
            elif kind == "recording":
                from planner.recording import write_link_recording

                write_link_recording(place, design)
            elif kind == "picture":
                from planner.links.picture import write_link_picture

                write_link_picture(place, design)
            elif kind == "boom":
                link_files.write_boom(place, boom_file, design)
            else:
                from planner.links.picture import link_pictures
                from planner.links.report import to_markdown
                from planner.reports.document import write_document

                write_document(place, to_markdown(design), link_pictures(design))


def _print_design(design: "LinkDesign", written: dict[str, str], whole: bool, as_json: bool, convergence: bool) -> None:
    from planner.links import report as link_report

    if as_json:
        answer = link_report.to_json(design, written)
        if convergence:
            from planner.links.convergence import study

            answer["convergence"] = link_report.convergence_json(study(design))
        print_json(answer)
        return
    print_lines(None, [link_report.title(design)])
    rows, checks = link_report.rows(design), link_report.check_rows(design)
    for header, shown in (
        (link_report.ROWS_HEADER, [*rows, *checks] if whole else rows),
        (link_report.MOTORS_HEADER, link_report.motor_rows(design)),
    ):
        if shown:
            print_rows(header, shown)
    print_lines(None, link_report.sentences(design))
    print_lines("warning", design.warnings)
    if whole:
        print_lines("note", design.notes)
    else:
        print_lines(None, [f"{len(checks)} checks by finite elements, {len(design.notes)} notes: --all lists them"])
    print_files(written)
    print_lines("next", [] if "boom" in written else ["boom link --out-boom lighter.toml"])
