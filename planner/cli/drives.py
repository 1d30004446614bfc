"""Jobs on a duty cycle: check it, and size the drives for it."""

from typing import Any

import click

from boom_model import InfeasibleError, InputError
from boom_model.plausible import VOLTAGE
from planner.cli.completion import OneOf, joints, missions
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
)
from planner.cli.printing import ANSWER_IS_NO, complain, print_files, print_json, print_lines, print_report, print_rows, tracked


@click.command()
@click.argument("missions", metavar="MISSION...", nargs=-1, required=True, shell_complete=missions)
@click.option(
    "--joint",
    "joints",
    multiple=True,
    shell_complete=joints,
    help="Compare the drive checks of this joint alone; may be given again.",
)
@payload_option
@payload_as_option
@vehicle_option
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
    picture: str | None,
    document: str | None,
    boom_file: str | None,
    whole: bool,
    as_json: bool,
) -> int:
    """Check a duty cycle of moves, holds and pauses as a whole; several of them side by side.

    MISSION is a FILE.toml, or one of field-day, table-2-4 and table-3-1.

    \b
    Examples:
      boom mission field-day --picture drives.png
      boom mission table-2-4 table-3-1 --joint inner --joint lower --report judged.pdf
    """
    from planner.checks.rows import Verdict
    from planner.missions.mission import check_cycle, load_mission, plan_cycle
    from planner.planning import torques
    from planner.reports.answer import answer
    from planner.reports.document import write_document
    from planner.reports.drive_pictures import drive_pages, write_drive_picture
    from planner.reports.side_by_side import compared, loads_side_by_side, side_by_side_markdown

    boom, case = load_boom(boom_file, payload), load_vehicle(vehicle)
    check_picture(picture)
    files = outputs(picture, document=document, inputs=(*missions, boom_file, vehicle))
    if picture is not None and len(missions) > 1:
        raise InputError(f"--picture {picture}: a page shows one mission, and {len(missions)} are given")
    loaded = [load_mission(name) for name in missions]
    cycles = {each.name: plan_cycle(boom, each, case, track=tracked(f"planning {each.name}")) for each in loaded}
    if len(cycles) < len(missions):
        raise InputError(f"two missions bear one name: {', '.join(each.name for each in loaded)}")
    reports = {name: check_cycle(boom, cycle, payload_as=payload_as, vehicle=case) for name, cycle in cycles.items()}
    written: dict[str, str] = {}
    header, rows = compared(reports, joints)
    alone = len(reports) == 1 and not joints
    drawn = {
        name: (boom, cycle.trajectory, torques(boom, cycle.trajectory, payload_as, case), reports[name], cycle.moves)
        for name, cycle in (cycles.items() if picture or document else ())
    }
    with files:
        if document is not None:
            text = next(iter(reports.values())).to_markdown() if alone else side_by_side_markdown(reports, joints)
            pages = {name: drive_pages(*shown) for name, shown in drawn.items()}
            titled = {
                title if alone else f"{name}: {title}": page
                for name, page_of in pages.items()
                for title, page in page_of.items()
            }
            write_document(files.temporary(document), text, titled)
            written["report"] = document
        if picture is not None:
            write_drive_picture(files.temporary(picture), *next(iter(drawn.values())))
            written["picture"] = picture
    if alone:
        ((name, report),) = reports.items()
        asked = f"mission {name}, {report.duration:.0f} s, payload {boom.payload.mass:g} kg"
        cost = None if report.energy is None else report.energy.sentence
        return print_report(report, asked, written, as_json, whole, f"boom size {missions[0]}", cost)
    if as_json:
        print_json({"missions": {name: report.to_json({}) for name, report in reports.items()}, "files": written})
    else:
        for name, report in reports.items():
            print_lines(name, (answer(report).sentence,))
        if whole or joints:
            print_rows(header, rows)
        else:
            print_rows(("joint", *reports), loads_side_by_side(reports))
            print_lines(None, [f"{len(rows)} checks: --all lists them side by side"])
        print_files(written)
    failed = [f"{name}: a check FAILs" for name, report in reports.items() if report.verdict is Verdict.FAIL]
    if failed:
        complain("; ".join(failed))
    return ANSWER_IS_NO if failed else 0


@click.command()
@click.argument("mission", default="field-day", shell_complete=missions)
@click.option(
    "--joint", "joints", multiple=True, shell_complete=joints, help="Size this joint; may be given again; else every one."
)
@click.option(
    "--voltage",
    "voltages",
    type=float,
    multiple=True,
    callback=plausible(VOLTAGE),
    metavar="V",
    help="Bus voltage to try; may be given again.",
)
@click.option(
    "--adapt",
    type=OneOf(["nothing", "rescale", "replan"]),
    metavar="nothing|rescale|replan",
    default="nothing",
    show_default=True,
    help="What may change to suit a drive: the moves slowed evenly, or planned anew.",
)
@click.option(
    "--variant", "variants", multiple=True, metavar="BODY=KG,...",
    help="A boom of other masses beside the given one, payload=KG among them; may be given again.",
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
    """Go through the catalogue for each joint: what does not fail, ranked by mass and margin, and why the rest does.

    \b
    Example:
      boom size field-day --variant inner=5.55 --variant payload=5 --report drives.html
    """
    from boom_model import JOINTS, Catalogue
    from planner.missions.mission import check_steady, load_mission, plan_cycle
    from planner.reports.document import write_document
    from planner.reports.report import assumptions
    from planner.sizing.choice import Adapt, choose, parse_variant, too_high
    from planner.sizing.pictures import sizing_pictures
    from planner.sizing.tables import (
        SAVING,
        answer_rows,
        conclusion,
        motors,
        no_motion,
        not_checked,
        ranking,
        saving,
        sizing_json,
        sizing_markdown,
        sizing_notes,
    )

    boom, case = load_boom(boom_file, payload), load_vehicle(vehicle)
    files = outputs(document=document, inputs=(mission, boom_file, vehicle))
    catalogue = Catalogue.load().with_file(given_catalogue())
    booms = {"as it is": boom} | {text: parse_variant(boom, text) for text in variants}
    how, asked = Adapt(adapt), load_mission(mission)
    check_steady(case)
    try:
        work = asked if how is Adapt.REPLAN else plan_cycle(boom, asked, case, track=tracked("planning the mission"))
    except InfeasibleError as error:
        raise InfeasibleError(
            "the fitted drives cannot do this mission, on whose motion every drive would be judged; --adapt replan plans for "
            f"each: {error}"
        ) from None
    choices = choose(
        booms, work, joints or JOINTS, catalogue, voltages, how, payload_as, tracked("going through the catalogue"), case
    )
    notes = sizing_notes(choices, how, case, too_high(catalogue, voltages))
    written = {} if document is None else {"report": document}
    if document is not None:
        assumed = (*asked.assumptions, *assumptions(boom, asked.jerk_limited))
        text = sizing_markdown(f"Drives for the mission {asked.name}", choices, notes, assumed)
        with files:
            write_document(files.temporary(document), text, sizing_pictures(choices))
    if as_json:
        print_json(sizing_json(asked.name, choices, notes) | {"files": written})
    else:
        print_lines(None, [f"mission {asked.name}, payload {boom.payload.mass:g} kg"])
        print_lines(None, conclusion(choices))
        print_rows(*answer_rows(choices), drop=("fitted", "mass"))
        if whole:
            print_rows(SAVING, saving(choices))
            for choice in (choice for choice in choices if choice.judged):
                print_lines(None, [f"{choice.joint}, {choice.variant}"])
                print_rows(*ranking(choice), drop=("warnings", "moving", "mass"))
                print_lines("no motion with", no_motion(choice))
                print_lines("every drive has these warnings", choice.warned)
            print_lines(None, ["each drive in its best supply"])
            print_rows(*motors(choices))
            print_lines("note", notes)
        else:
            print_lines("not checked", (f"{joints}: {reason}" for joints, reason in not_checked(choices)))
            print_lines(None, [f"{len(notes)} notes, every drive ranked: --all lists them"])
        print_files(written)
        print_lines("next", [] if whole else [f"boom size {mission} --report drives.pdf"])
    unmet = [f"{choice.joint}, {choice.variant}" for choice in choices if choice.unmet]
    if unmet:
        complain(f"no drive of the catalogue does the mission: {'; '.join(unmet)}")
    return ANSWER_IS_NO if unmet else 0
