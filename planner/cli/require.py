"""What a mission requires of the drives: the sheet that one sends to a supplier."""

from typing import Any

import click

from boom_model.measured import measured_lines
from boom_model.plausible import EFFICIENCY, FREQUENCY, TIP_TOLERANCE
from planner.cli.completion import OneOf, OutFile, joints, missions
from planner.cli.options import (
    all_option,
    boom_option,
    given_catalogue,
    json_option,
    load_boom,
    load_vehicle,
    outputs,
    payload_as_option,
    payload_option,
    plausible,
    report_option,
    vehicle_option,
)
from planner.cli.printing import print_files, print_json, print_lines, print_rows, tracked


@click.command()
@click.argument("mission", default="field-day", shell_complete=missions)
@click.option(
    "--joint",
    "joints",
    multiple=True,
    shell_complete=joints,
    help="A sheet of this joint; may be given again; else of every one.",
)
@click.option("--frequency", type=float, default=8.0, show_default=True, callback=plausible(FREQUENCY), metavar="HZ",
              help="First frequency that the stiffnesses must give.")  # fmt: skip
@click.option("--tip-error", type=float, callback=plausible(TIP_TOLERANCE), metavar="MM",
              help="Error of the tip through backlash; otherwise the mission's tip_tolerance_mm.")  # fmt: skip
@click.option(
    "--current",
    type=OneOf(["full", "reduced", "brake", "load"]),
    metavar="full|reduced|brake|load",
    default="brake",
    show_default=True,
    help="Phase current: rated always, reduced at standstill, off under a brake too, or as the load asks.",
)
@click.option(
    "--surplus",
    type=OneOf(["resistor", "battery"]),
    metavar="resistor|battery",
    default="resistor",
    show_default=True,
    help="Where power goes that the drives give back.",
)
@click.option("--driver-efficiency", type=float, default=90.0, show_default=True, callback=plausible(EFFICIENCY), metavar="%",
              help="Efficiency of the motor drivers.")  # fmt: skip
@click.option("--cycles", type=click.IntRange(1), default=1, show_default=True, help="Times that the mission runs a day.")
@click.option("--picture", type=OutFile(".png"), metavar="FILE.png", help="Torque over speed of every joint, with its hull.")
@payload_option
@payload_as_option
@vehicle_option
@report_option
@boom_option
@all_option
@json_option
def require(
    mission: str,
    joints: tuple[str, ...],
    frequency: float,
    tip_error: float | None,
    current: str,
    surplus: str,
    driver_efficiency: float,
    cycles: int,
    picture: str | None,
    payload: float | None,
    payload_as: Any,
    vehicle: str | None,
    document: str | None,
    boom_file: str | None,
    whole: bool,
    as_json: bool,
) -> int:
    """List what the drive of each joint must give on a mission, and what the fitted ones take.

    MISSION is a FILE.toml, or one of field-day, table-2-4 and table-3-1.

    \b
    Examples:
      boom require field-day --report sheet.pdf
      boom require field-day --joint yaw --tip-error 5 --picture yaw.png
      boom require field-day --current load --surplus battery --cycles 3
    """
    from boom_model import JOINTS, Catalogue
    from planner.checks.energy import Current, Supply, Surplus
    from planner.checks.evaluation import at_samples
    from planner.missions.mission import cycle_energy, load_mission, plan_cycle
    from planner.reports.report import assumptions
    from planner.sizing.choice import combinations
    from planner.sizing.day import Day
    from planner.sizing.offer import nearest
    from planner.sizing.requirement import requirements
    from planner.sizing.requirement_tables import requirement_markdown, requirement_notes

    boom, case = load_boom(boom_file, payload), load_vehicle(vehicle)
    files = outputs(picture, document=document, inputs=(mission, boom_file, vehicle))
    asked = load_mission(mission)
    cycle = plan_cycle(boom, asked, case, track=tracked("planning the mission"))
    needs = requirements(
        boom,
        cycle,
        joints or JOINTS,
        frequency=frequency,
        tip_error=None if tip_error is None else tip_error * 1e-3,
        payload_as=payload_as,
        vehicle=case,
    )
    supply = Supply(Current(current), efficiency=driver_efficiency / 100.0, surplus=Surplus(surplus))
    evaluation = at_samples(boom, cycle.trajectory, vehicle=case, payload_as=payload_as, reactions=False)
    day = Day(cycle_energy(cycle, evaluation, supply), cycles, asked.plots)
    title = f"mission {asked.name}, payload {boom.payload.mass:g} kg"
    notes, assumed = requirement_notes(needs), (*asked.assumptions, *assumptions(boom, asked.jerk_limited))
    catalogue = Catalogue.load().with_file(given_catalogue())
    shown = needs if whole or document or as_json else ()
    offers = {need.joint: nearest(need, combinations(boom, need.joint, catalogue)) for need in shown}
    text = requirement_markdown(f"Required of the drives: {title}", needs, day, offers, notes, assumed)
    written = _write(files, needs, text, picture, document)
    if as_json:
        said = {"notes": list(notes), "assumptions": list(assumed), "measured": list(measured_lines(boom))}
        _print_json(asked.name, needs, day, offers, said, written)
    else:
        print_lines(None, [f"{title}: required at the joint of each drive"])
        _print_sheet(needs, day, offers, notes, assumed, whole)
        print_lines("measured", measured_lines(boom))
        print_files(written)
        print_lines("next", [] if whole or document else [f"boom require {mission} --report sheet.pdf"])
    return 0


def _write(files: Any, needs: Any, text: str, picture: str | None, document: str | None) -> dict[str, str]:
    """Write the report and the picture; return what was written, by kind."""
    from planner.reports.document import write_document
    from planner.sizing.requirement_pictures import requirement_pictures

    written: dict[str, str] = {}
    with files:
        drawn = requirement_pictures(needs) if picture or document else {}
        if document is not None:
            write_document(files.temporary(document), text, drawn)
            written["report"] = document
        if picture is not None:
            (figure,) = drawn.values()
            figure.savefig(files.temporary(picture), format="png")
            written["picture"] = picture
    return written


def _print_sheet(needs: Any, day: Any, offers: Any, notes: Any, assumed: Any, whole: bool) -> None:
    from planner.checks.energy import ENERGY_HEADER, energy_cells
    from planner.sizing.requirement_tables import OFFER_HEADER, SHEET, items, offer_rows, sheet_rows, step_header, step_rows

    print_rows(SHEET, sheet_rows(needs), drop=("starts", "drive", "inertia"))
    print_lines(None, [day.energy.sentence, *day.sentences])
    if not whole:
        count = f"{len(notes)} notes, {len(assumed)} assumed figures"
        print_lines(None, [f"torque-speed table, stiffness, reflected inertia, life, {count}: --all lists them"])
        return
    for need in needs:
        print_lines(None, [need.joint])
        print_rows(("required", "value"), items(need))
        print_rows(step_header(need), step_rows(need))
        print_rows(OFFER_HEADER, offer_rows(offers[need.joint]))
    print_rows(ENERGY_HEADER, map(energy_cells, day.energy.joints), drop=("friction", "largest"))
    print_lines(None, day.energy.sentences[1:])
    print_lines("note", notes)
    print_lines("assumed", assumed)


def _print_json(name: str, needs: Any, day: Any, offers: Any, said: dict[str, Any], written: dict[str, str]) -> None:
    from planner.sizing.requirement_tables import requirement_json

    sheets = [requirement_json(need, offers[need.joint]) for need in needs]
    print_json({"mission": name, "joints": sheets, "energy": day.to_json(), **said, "files": written})
