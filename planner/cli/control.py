"""The command that simulates planned moves in closed loop."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import click

from boom_model import Boom, InputError
from boom_model.plausible import BANDWIDTH, DAMPING, INTEGRAL, PAYLOAD_ERROR, TIP_TOLERANCE
from boom_model.words import unknown
from planner.cli.completion import OutFile, any_file, controllers, profiles, shapers
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
    with_names,
)
from planner.cli.printing import ANSWER_IS_NO, STYLES, complain, print_files, print_json, print_lines, print_rows, tracked
from planner.move_spec import MoveWords

if TYPE_CHECKING:
    from planner.control.design import Controller
    from planner.control.study import Setup, Study
    from planner.files import Outputs


@click.command(context_settings={"ignore_unknown_options": True})
@move_options("profile", "via_velocity", "average_torque", "rate")
@click.option(
    "--profile",
    "profiles",
    shell_complete=profiles,
    default="cubic",
    show_default=True,
    metavar="NAME,...|all",
    help="Profiles as in `boom plan`.",
)
@click.option(
    "--controller", "controllers", shell_complete=controllers, default="all", show_default=True, metavar="NAME,...|all",
    help="pd, pid, computed-torque, lqr (with integral action), stepper (open loop).",
)  # fmt: skip
@click.option(
    "--shaper", "shapers", shell_complete=shapers, default="none", show_default=True, metavar="NAME,...|all",
    help="none, zv, zvd: input shapers for the lowest mode; zv lasts half a period, zvd a whole one.",
)  # fmt: skip
@click.option(
    "--bandwidth",
    default=6.0,
    callback=plausible(BANDWIDTH),
    show_default=True,
    metavar="HZ",
    help="Natural frequency of the closed-loop poles.",
)
@click.option(
    "--damping", default=1.0, callback=plausible(DAMPING), show_default=True, help="Damping ratio of the closed-loop poles."
)
@click.option(
    "--integral",
    default=0.3,
    callback=plausible(INTEGRAL),
    show_default=True,
    help="Pole of the integral action, relative to the bandwidth.",
)
@payload_option
@click.option(
    "--payload-error",
    default=0.0,
    callback=plausible(PAYLOAD_ERROR),
    metavar="KG",
    help="True payload minus the payload that the controllers assume.",
)
@click.option(
    "--gust",
    metavar="FX,FY,FZ,START,DURATION",
    help="Force on the tip in N along frame 1, shaped (1 - cos)/2; start and duration in s, within the move and 2 s after it.",
)
@click.option("--rigid-joints", is_flag=True, help="Leave out gearbox elasticity, friction and bending of the links.")
@click.option("--rigid-links", is_flag=True, help="Leave out the bending of inner link and extension.")
@click.option("--backlash", is_flag=True, help="Include gearbox backlash.")
@click.option("--compensate-sag", is_flag=True, help="Correct the motor setpoints by the gearbox twist under static load.")
@click.option(
    "--settle-mm",
    default=1.0,
    callback=plausible(TIP_TOLERANCE),
    show_default=True,
    metavar="MM",
    help="Largest tip error that counts as settled.",
)
@click.option(
    "--set", "figures", multiple=True, metavar="NAME=VALUE",
    help="Replace an assumed figure of the report, such as rate_Hz or structural_damping; repeatable.",
)  # fmt: skip
@click.option("--out", type=OutFile(".rrd"), metavar="FILE.rrd", help="Write a recording for `boom view`.")
@click.option("--loops", shell_complete=any_file, metavar="FILE.png", help="Write a picture with Bode diagrams and poles.")
@click.option("--errors", shell_complete=any_file, metavar="FILE.png", help="Write a picture with the tip errors.")
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
    """Simulate planned moves in closed loop: controllers, stability margins, tip errors.

    START and GOAL are as in `boom plan`. The exit code is 1 if a loop is unstable or a stepper
    loses a step.

    \b
    Examples:
      boom control transport phenotyping --profile all --report followed.pdf
      boom control transport phenotyping --controller pid,stepper --shaper all --out control.rrd
      boom control transport phenotyping --payload-error 2 --gust 0,0,-30,5.2,0.5
      boom control transport phenotyping --set structural_damping=0.01
    """
    from planner.control.closed_loop import parse_gust
    from planner.control.design import Goals
    from planner.control.figures import parse_figures
    from planner.control.shaping import Shaper
    from planner.control.study import Setup, study
    from planner.planning import plan_move
    from planner.timing.profile import SHORTEST, Profile

    boom = load_boom(boom_file, payload)
    boom.geometry.require_parallelogram("boom control")
    setup = Setup(
        vehicle=None if move.vehicle is None else load_vehicle(move.vehicle),
        goals=Goals.of(bandwidth, damping, integral),
        figures=parse_figures(figures),
        elastic=not rigid_joints,
        bending=not rigid_links,
        backlash=backlash,
        compensate_sag=compensate_sag,
        payload_error=payload_error,
        gust=None if gust is None else parse_gust(gust),
        settled=settle_mm * 1e-3,
    )
    chosen, notes = _controllers(boom, controllers, setup)
    shaping = [Shaper(name) for name in _several("shaper", shapers, list(Shaper))]
    _check_pictures(loops, errors, chosen)
    files = outputs(out, loops, errors, document=document, inputs=(boom_file, move.vehicle))
    words = _several("profile", profiles, list(SHORTEST if move.duration is None else Profile))
    moves = [plan_move(boom, replace(move, profile=word).spec()) for word in words]
    found = study(boom, moves, chosen, shaping, setup, tracked("simulating"))
    found = replace(found, notes=(*found.notes, *notes))
    written = with_names({"recording": out, "loops": loops, "errors": errors, "report": document})
    _write(files, found, written, f"{move.start} to {move.goal}, payload {boom.payload.mass:g} kg")
    return _print_study(found, written, as_json, whole)


def _controllers(boom: Boom, text: str, setup: "Setup") -> tuple[list["Controller"], list[str]]:
    """Return the controllers to simulate, and notes on those left out.

    With "all", the stepper is left out if no gearbox is elastic.
    """
    from planner.control.design import Controller
    from planner.control.plant import Plant

    chosen = [Controller(name) for name in _several("controller", text, list(Controller))]
    if text != "all" or Plant.of(boom, setup.figures, elastic=setup.elastic, bending=False).elastic:
        return chosen, []
    chosen.remove(Controller.STEPPER)
    return chosen, ["stepper: left out, because it is simulated only with elastic gearboxes"]


def _check_pictures(loops: str | None, errors: str | None, controllers: "Sequence[Controller]") -> None:
    """Raise InputError if a picture cannot be drawn or has the wrong ending."""
    from planner.control.design import Controller

    for name in (loops, errors):
        if name is not None and not name.endswith(".png"):
            raise InputError(f"{name}: a picture is written as .png")
    if loops is not None and list(controllers) == [Controller.STEPPER]:
        raise InputError("a stepper runs in open loop: it has no Bode diagram")


def _write(files: "Outputs", study: "Study", written: dict[str, str], title: str) -> None:
    """Write the output files of a study, given by kind."""
    with files:
        for kind, name in written.items():
            place = files.temporary(name)
            if kind == "recording":
                from planner.recording import write_control_recording

                write_control_recording(place, study, title=title)
            elif kind == "report":
                from planner.control.picture import study_pictures
                from planner.reports.document import write_document

                write_document(place, study.to_markdown(), study_pictures(study))
            else:
                from planner.control.picture import error_figure, loop_figure, write_figure

                write_figure(place, loop_figure(study) if kind == "loops" else error_figure(study))


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
            click.echo("Loop margins at the goal, one joint opened at a time, the others closed")
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
    """Return the names of a comma-separated list, or all known names for "all"."""
    names = list(known) if text == "all" else list(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    for name in names:
        if name not in known:
            raise unknown(what, name, known, "all")
    return names
