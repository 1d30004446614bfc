"""The commands that check a mission and size the drives for it."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

from boom_model import Boom, InfeasibleError, InputError
from boom_model.measured import measured_lines
from boom_model.plausible import VOLTAGE
from planner.cli.completion import OneOf, OutFile, joints, missions
from planner.cli.options import (
    all_option,
    boom_option,
    check_picture,
    given_catalogue,
    json_option,
    load_boom,
    load_vehicle,
    outputs,
    payload_as_option,
    payload_option,
    picture_option,
    plausible,
    report_option,
    vehicle_option,
    with_names,
)
from planner.cli.printing import ANSWER_IS_NO, complain, print_files, print_json, print_lines, print_report, print_rows, tracked

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from planner.files import Outputs
    from planner.missions.mission import Cycle, Mission
    from planner.motion.vehicle import VehicleCase
    from planner.planning import Move
    from planner.reports.report import Report
    from planner.sizing.choice import Adapt, Choice


@click.command()
@click.argument("missions", metavar="MISSION...", nargs=-1, required=True, shell_complete=missions)
@click.option(
    "--joint",
    "joints",
    multiple=True,
    shell_complete=joints,
    help="Compare only the drive checks of this joint; repeatable.",
)
@payload_option
@payload_as_option
@vehicle_option
@click.option("--out", type=OutFile(".rrd"), metavar="FILE.rrd", help="A recording of each distinct leg, for `boom view`.")
@report_option
@picture_option
@boom_option
@all_option
@json_option
def mission(
    missions: tuple[str, ...],
    joints: tuple[str, ...],
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
    """Check a duty cycle of moves, holds and pauses, or compare several.

    MISSION is a FILE.toml, or one of field-day, table-2-4 and table-3-1.

    \b
    Examples:
      boom mission field-day --picture drives.png
      boom mission table-2-4 table-3-1 --joint inner --joint lower --report judged.pdf
    """
    from planner.missions.mission import cycle_move, load_mission, plan_cycle

    boom, case = load_boom(boom_file, payload), load_vehicle(vehicle)
    check_picture(picture)
    files = outputs(out, picture, document=document, inputs=(*missions, boom_file, vehicle))
    for option, name in (("--picture", picture), ("--out", out)):
        if name is not None and len(missions) > 1:
            raise InputError(f"{option} {name}: it shows one mission, and {len(missions)} are given")
    loaded = [load_mission(name) for name in missions]
    cycles = {each.name: plan_cycle(boom, each, case, track=tracked(f"planning {each.name}")) for each in loaded}
    if len(cycles) < len(missions):
        raise InputError(f"two missions have the same name: {', '.join(each.name for each in loaded)}")
    moves = {name: cycle_move(boom, cycle, payload_as=payload_as, vehicle=case) for name, cycle in cycles.items()}
    reports = {name: move.report for name, move in moves.items()}
    written = with_names({"recording": out, "report": document, "picture": picture})
    _write(files, moves, cycles, joints, written)
    if len(reports) == 1 and not joints:
        ((name, report),) = reports.items()
        asked = f"mission {name}, {report.duration:.0f} s, payload {boom.payload.mass:g} kg"
        cost = None if report.energy is None else report.energy.sentence
        return print_report(report, asked, written, as_json, whole, f"boom size {missions[0]}", cost)
    return _print_compared(reports, joints, written, as_json, whole)


def _write(
    files: "Outputs",
    moves: Mapping[str, "Move"],
    cycles: Mapping[str, "Cycle"],
    joints: Sequence[str],
    written: Mapping[str, str],
) -> None:
    """Write the recording, the report and the picture of missions, where they have a name."""
    from planner.reports.document import write_document
    from planner.reports.drive_pictures import drive_pages, write_drive_picture
    from planner.reports.side_by_side import side_by_side_markdown

    reports = {name: move.report for name, move in moves.items()}
    alone, first = len(moves) == 1 and not joints, next(iter(moves.values()))
    with files:
        if "recording" in written:
            from planner.recording import write_recording

            write_recording(files.temporary(written["recording"]), first)
        drawn = {
            name: (move.boom, move.trajectory, move.loads.tau, move.report, cycles[name].moves)
            for name, move in (moves.items() if "report" in written or "picture" in written else ())
        }
        if "report" in written:
            text = first.report.details() if alone else side_by_side_markdown(reports, joints)
            titled = {
                title if alone else f"{name}: {title}": page
                for name, shown in drawn.items()
                for title, page in drive_pages(*shown).items()
            }
            write_document(
                files.temporary(written["report"]),
                text,
                titled,
                _first_page(first, next(iter(cycles.values()))) if alone else None,
            )
        if "picture" in written:
            write_drive_picture(files.temporary(written["picture"]), *next(iter(drawn.values())))


def _first_page(move: "Move", cycle: "Cycle") -> "tuple[str, Figure]":
    """Return text and picture of the first page of a mission's report."""
    from planner.reports.first_page import conditions, first_page, first_picture

    asked = conditions(move.boom, move.vehicle, move.report.duration)
    picture = first_picture(move.boom, move.trajectory, move.loads.tau, cycle.moves)
    return first_page(f"Mission {cycle.mission.name}", asked, move.report), picture


def _print_compared(
    reports: Mapping[str, "Report"], joints: Sequence[str], written: dict[str, str], as_json: bool, whole: bool
) -> int:
    """Print the reports of missions side by side, and return the exit code."""
    from planner.checks.rows import Verdict
    from planner.reports.answer import answer
    from planner.reports.side_by_side import compared, loads_side_by_side

    header, rows = compared(reports, joints)
    if as_json:
        print_json({"missions": {name: report.to_json({}) for name, report in reports.items()}, "files": written})
    else:
        for name, report in reports.items():
            print_lines(name, (answer(report).sentence,))
        if whole:
            print_rows(header, rows)
        else:
            loads = loads_side_by_side(reports)
            print_rows(("joint", *reports), [row for row in loads if not joints or row[0] in joints])
            print_lines(None, [f"{len(rows)} checks: --all lists them side by side"])
        print_files(written)
    failed = [f"{name}: a check FAILs" for name, report in reports.items() if report.verdict is Verdict.FAIL]
    if failed:
        complain("; ".join(failed))
    return ANSWER_IS_NO if failed else 0


@click.command()
@click.argument("mission", default="field-day", shell_complete=missions)
@click.option(
    "--joint", "joints", multiple=True, shell_complete=joints, help="Joint to size; repeatable. Default: every joint."
)
@click.option(
    "--voltage",
    "voltages",
    type=float,
    multiple=True,
    callback=plausible(VOLTAGE),
    metavar="V",
    help="Bus voltage to try; repeatable.",
)
@click.option(
    "--adapt",
    type=OneOf(["nothing", "rescale", "replan"]),
    metavar="nothing|rescale|replan",
    default="nothing",
    show_default=True,
    help="Adapt the motion to each drive: rescale slows every move, replan plans them again.",
)
@click.option(
    "--variant", "variants", multiple=True, metavar="BODY=KG,...",
    help="Also size for a boom with other masses, such as inner=5.55,payload=5; repeatable.",
)  # fmt: skip
@payload_option
@payload_as_option
@vehicle_option
@report_option
@boom_option
@all_option
@json_option
def size(
    mission: str,
    joints: tuple[str, ...],
    voltages: tuple[float, ...],
    adapt: str,
    variants: tuple[str, ...],
    payload: float | None,
    payload_as: Any,
    vehicle: str | None,
    document: str | None,
    boom_file: str | None,
    whole: bool,
    as_json: bool,
) -> int:
    """Check the drives of the catalogue on a mission; rank those that do not fail.

    \b
    Example:
      boom size field-day --variant inner=5.55 --variant payload=5 --report drives.html
    """
    from boom_model import JOINTS, Catalogue
    from boom_model.boom import IS_LENGTH
    from planner.missions.mission import check_steady, load_mission
    from planner.sizing.choice import Adapt, choose, parse_variant, too_high, untried
    from planner.sizing.tables import sizing_json, sizing_notes

    boom, case = load_boom(boom_file, payload), load_vehicle(vehicle)
    files = outputs(document=document, inputs=(mission, boom_file, vehicle))
    catalogue = Catalogue.load().with_file(given_catalogue())
    booms = {"as it is": boom} | {text: parse_variant(boom, text) for text in variants}
    how, asked = Adapt(adapt), load_mission(mission)
    check_steady(case)
    work = _work(boom, asked, how, case)
    choices = choose(booms, work, joints or JOINTS, catalogue, voltages, how, payload_as, tracked("checking drives"), case)
    turned = any(not IS_LENGTH[JOINTS.index(joint)] for joint in joints or JOINTS)
    left_out = untried(catalogue) if turned else ()
    notes = sizing_notes(choices, how, case, (*too_high(catalogue, voltages), *left_out))
    written = with_names({"report": document})
    _write_sizing(files, boom, asked, choices, notes, document)
    if as_json:
        print_json(sizing_json(asked.name, choices, notes) | {"measured": list(measured_lines(boom)), "files": written})
    else:
        print_lines(None, [f"mission {asked.name}, payload {boom.payload.mass:g} kg"])
        _print_choices(choices, notes, whole, left_out)
        print_lines("measured", measured_lines(boom))
        print_files(written)
        print_lines("next", [] if whole else [f"boom size {mission} --report drives.pdf"])
    unmet = [f"{choice.joint}, {choice.variant}" for choice in choices if choice.unmet]
    if unmet:
        complain(f"no drive of the catalogue is suitable for the mission: {'; '.join(unmet)}")
    return ANSWER_IS_NO if unmet else 0


def _work(boom: Boom, mission: "Mission", how: "Adapt", case: "VehicleCase") -> "Cycle | Mission":
    """Return the cycle of the fitted drives, or the mission if each drive has its own plan."""
    from planner.missions.mission import plan_cycle
    from planner.sizing.choice import Adapt

    if how is Adapt.REPLAN:
        return mission
    try:
        return plan_cycle(boom, mission, case, track=tracked("planning the mission"))
    except InfeasibleError as error:
        raise InfeasibleError(
            "the fitted drives cannot do this mission, so there is no motion on which to check the others; --adapt replan "
            f"plans a motion for each drive: {error}"
        ) from None


def _write_sizing(
    files: "Outputs", boom: Boom, mission: "Mission", choices: Sequence["Choice"], notes: Sequence[str], document: str | None
) -> None:
    """Write the report of a choice of drives, if it has a name."""
    from planner.reports.document import write_document
    from planner.reports.report import assumptions
    from planner.sizing.pictures import sizing_pictures
    from planner.sizing.tables import sizing_markdown

    if document is None:
        return
    assumed = (*mission.assumptions, *assumptions(boom, mission.jerk_limited))
    text = sizing_markdown(f"Drives for the mission {mission.name}", choices, notes, assumed)
    with files:
        write_document(files.temporary(document), text, sizing_pictures(choices))


def _print_choices(choices: Sequence["Choice"], notes: Sequence[str], whole: bool, left_out: Sequence[str]) -> None:
    """Print the conclusion and the best drive per joint, and with `whole` every drive and note."""
    from planner.sizing.tables import (
        SAVING,
        answer_rows,
        conclusion,
        motors,
        no_motion,
        not_checked,
        ranking,
        saving,
    )

    print_lines(None, conclusion(choices))
    print_rows(*answer_rows(choices), drop=("fitted", "mass"))
    if not whole:
        print_lines("not checked", (f"{joints}: {reason}" for joints, reason in not_checked(choices)))
        print_lines("not tried", left_out)
        print_lines(None, [f"{len(notes)} notes, every drive ranked: --all lists them"])
        return
    print_rows(SAVING, saving(choices))
    for choice in (choice for choice in choices if choice.judged):
        print_lines(None, [f"{choice.joint}, {choice.variant}"])
        print_rows(*ranking(choice), drop=("warnings", "moving", "mass"))
        print_lines("no motion with", no_motion(choice))
        print_lines("every drive has these warnings", choice.warned)
    print_lines(None, ["each drive in its best supply"])
    print_rows(*motors(choices))
    print_lines("note", notes)
