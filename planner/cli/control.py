"""A planned move followed in closed loop."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import click

from boom_model import InputError
from boom_model.plausible import BANDWIDTH, DAMPING, INTEGRAL, PAYLOAD_ERROR, TIP_TOLERANCE
from boom_model.words import unknown
from planner.cli.completion import OutFile
from planner.cli.options import (
    all_option,
    boom_option,
    json_option,
    load_boom,
    load_vehicle,
    move_options,
    outputs,
    payload_option,
    plausible,
    report_option,
)
from planner.cli.printing import ANSWER_IS_NO, STYLES, complain, print_files, print_json, print_lines, print_rows, tracked
from planner.move_spec import MoveWords

if TYPE_CHECKING:
    from planner.control.study import Study


@click.command(context_settings={"ignore_unknown_options": True})
@move_options("profile", "via_velocity", "average_torque", "rate")
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
@click.option(
    "--bandwidth",
    default=6.0,
    callback=plausible(BANDWIDTH),
    show_default=True,
    metavar="HZ",
    help="Natural frequency of the loops' poles.",
)
@click.option(
    "--damping", default=1.0, callback=plausible(DAMPING), show_default=True, help="Damping ratio of the loops' poles."
)
@click.option(
    "--integral",
    default=0.3,
    callback=plausible(INTEGRAL),
    show_default=True,
    help="Integral action's pole, as a share of the bandwidth.",
)
@payload_option
@click.option(
    "--payload-error",
    default=0.0,
    callback=plausible(PAYLOAD_ERROR),
    metavar="KG",
    help="True payload less the one that the controllers believe in.",
)
@click.option(
    "--gust",
    metavar="FX,FY,FZ,START,DURATION",
    help="A push on the tip, (1 - cos)/2, in N along frame 1 and s, within the time simulated: the move and 2 s.",
)
@click.option("--rigid-joints", is_flag=True, help="Leave out the gearboxes' elasticity, friction and the links' bending.")
@click.option("--rigid-links", is_flag=True, help="Leave out the bending of inner link and extension.")
@click.option("--backlash", is_flag=True, help="With the gearboxes' backlash.")
@click.option("--compensate-sag", is_flag=True, help="Send the motors ahead by the twist that the weight gives.")
@click.option(
    "--settle-mm",
    default=1.0,
    callback=plausible(TIP_TOLERANCE),
    show_default=True,
    metavar="MM",
    help="Within which the tip counts as settled.",
)
@click.option(
    "--set", "figures", multiple=True, metavar="NAME=VALUE",
    help="A figure that is assumed otherwise, as the report names it: rate_Hz, structural_damping, ...; may be given again.",
)  # fmt: skip
@click.option("--out", type=OutFile(".rrd"), metavar="FILE.rrd", help="The recording, for `boom view`.")
@click.option("--loops", metavar="FILE.png", help="Bode diagrams and poles as a picture.")
@click.option("--errors", metavar="FILE.png", help="The tip's errors as a picture.")
@report_option
@boom_option
@all_option
@json_option
def control(
    move: MoveWords,
    profiles: str,
    controllers: str,
    shapers: str,
    bandwidth: float,
    damping: float,
    integral: float,
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
    document: str | None,
    boom_file: str | None,
    whole: bool,
    as_json: bool,
) -> int:
    """Follow a planned move in closed loop: design, margins, simulation of the full model, and how far off the tip is.

    START and GOAL are as in `boom plan`. Exit code 1: a loop is unstable, or a stepper loses a step.

    \b
    Examples:
      boom control transport phenotyping --profile all --report followed.pdf
      boom control transport phenotyping --controller pid,stepper --shaper all --out control.rrd
      boom control transport phenotyping --payload-error 2 --gust 0,0,-30,5.2,0.5 --set structural_damping=0.01
    """
    from planner.control.closed_loop import parse_gust
    from planner.control.design import Controller, Goals
    from planner.control.figures import parse_figures
    from planner.control.plant import Plant
    from planner.control.shaping import Shaper
    from planner.control.study import Setup, study
    from planner.planning import plan_move
    from planner.timing.profile import Profile

    boom, case = load_boom(boom_file, payload), None if move.vehicle is None else load_vehicle(move.vehicle)
    boom.geometry.require_parallelogram("boom control")
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
    left_out = controllers == "all" and not Plant.of(boom, setup.figures, elastic=setup.elastic, bending=False).elastic
    if left_out:
        chosen[0].remove(Controller.STEPPER)
    for name in (loops, errors):
        if name is not None and not name.endswith(".png"):
            raise InputError(f"{name}: a picture is written as .png")
    if loops is not None and chosen[0] == [Controller.STEPPER]:
        raise InputError("a stepper runs open loop: there is no Bode diagram of it")
    files = outputs(out, loops, errors, document=document, inputs=(boom_file, move.vehicle))
    words = _several("profile", profiles, list(Profile))
    moves = [plan_move(boom, replace(move, profile=word).spec()) for word in words]
    names = [Controller(c) for c in chosen[0]], [Shaper(s) for s in chosen[1]]
    found = study(boom, moves, *names, setup, tracked("simulating"))
    if left_out:
        found = replace(found, notes=(*found.notes, "stepper: left out, as it is simulated behind elastic gearboxes alone"))
    written = {}
    with files:
        if out is not None:
            from planner.recording import write_control_recording

            write_control_recording(files.temporary(out), found)
            written["recording"] = out
        if loops is not None or errors is not None:
            from planner.control.picture import error_figure, loop_figure, write_figure

            for kind, name, figure in (("loops", loops, loop_figure), ("errors", errors, error_figure)):
                if name is not None:
                    write_figure(files.temporary(name), figure(found))
                    written[kind] = name
        if document is not None:
            from planner.control.picture import study_pictures
            from planner.reports.document import write_document

            write_document(files.temporary(document), found.to_markdown(), study_pictures(found))
            written["report"] = document
    return _print_study(found, written, as_json, whole)


def _print_study(study: "Study", written: dict[str, str], as_json: bool, whole: bool) -> int:
    from planner.control.study import LOOP_HEADER, ROW_HEADER, ROW_LEGEND, loop_cells, row_cells

    if as_json:
        print_json(study.to_json(written))
        return _code(study)
    print_lines(None, [study.summary, study.modes_sentence])
    listed = study.rows if whole else study.leading
    cells = [row_cells(row) for row in listed]
    print_rows(
        ROW_HEADER,
        cells,
        drop=("over", "rest mm", "settles s", "time s"),
        styles=[STYLES.get(row.outcome) for row in listed],
    )
    if whole:
        print_lines(None, [ROW_LEGEND])
        if study.designs:
            click.echo("Loops at the goal, each joint's broken with the others closed")
            print_rows(LOOP_HEADER, [cells for design in study.designs for cells in loop_cells(design)])
        print_lines("case", study.reasons)
        print_lines("note", study.notes)
        print_lines("assumed", study.assumptions)
    else:
        print_lines(
            None, [f"{len(listed)} of {len(study.rows)} cases, {len(study.assumptions)} assumed figures: --all lists them"]
        )
    print_files(written)
    return _code(study)


def _code(study: "Study") -> int:
    if study.failed:
        complain(study.summary)
    return ANSWER_IS_NO if study.failed else 0


def _several(what: str, text: str, known: Sequence[str]) -> list[str]:
    """The names of a list with commas, or all of them."""
    names = list(known) if text == "all" else list(dict.fromkeys(name.strip() for name in text.split(",")))
    for name in names:
        if name not in known:
            raise unknown(what, name, known, "all")
    return names
