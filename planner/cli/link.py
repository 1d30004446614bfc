"""The design of a link."""

from typing import Any

import click

from boom_model import InfeasibleError, InputError
from planner.cli.options import (
    boom_option,
    given_catalogue,
    json_option,
    load_boom,
    outputs,
    payload_as_option,
    payload_option,
    report_option,
)
from planner.cli.printing import print_files, print_json, print_lines, print_rows, tracked
from planner.paths.targets import parse_target


@click.command()
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
@report_option
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
    document: str | None,
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
      boom link --report link.pdf --out-boom lighter.toml
      boom link --link lower --material aluminium --min-height 0.02 --dxf lower.dxf
    """
    from boom_model import Catalogue
    from planner.links import files as link_files
    from planner.links import report as link_report
    from planner.links.design import LinkTask, default_moves, design_link
    from planner.motion.trajectory import read_csv
    from planner.planning import plan_each_profile

    named = {"recording": out, "picture": picture, "contour": contour, "csv": csv_file, "dxf": dxf, "boom": out_boom}
    if convergence and not as_json:
        raise InputError("--convergence is part of the JSON: give --json with it, or --picture")
    if picture is not None and not picture.endswith(".png"):
        raise InputError(f"{picture}: a picture is written as .png")
    files = outputs(*named.values(), document=document, inputs=(boom_file, links, *motions))
    boom = load_boom(boom_file, payload)
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
    catalogue = Catalogue.load().with_file(given_catalogue())
    planning = tracked("planning with each profile")
    trajectories = [read_csv(motion) for motion in motions]
    for start, goal in moves:
        trajectories += plan_each_profile(boom, parse_target(start), parse_target(goal), planning)
    try:
        design = design_link(boom, task, trajectories or default_moves(boom, task, planning), catalogue)
    except InfeasibleError as error:
        if as_json:
            print_json({"link": name, "load": load, "method": method, "mass_kg": None, "files": {}, "reason": str(error)})
        raise
    written = {kind: file for kind, file in (named | {"report": document}).items() if file is not None}
    with files:
        if out is not None:
            from planner.recording import write_link_recording

            write_link_recording(files.temporary(out), design)
        if picture is not None:
            from planner.links.picture import write_link_picture

            write_link_picture(files.temporary(picture), design)
        for file, write in (
            (contour, link_files.write_contour),
            (csv_file, link_files.write_stations),
            (dxf, link_files.write_outline),
        ):
            if file is not None:
                write(files.temporary(file), design)
        if document is not None:
            from planner.links.picture import link_pictures
            from planner.reports.document import write_document

            write_document(files.temporary(document), link_report.to_markdown(design), link_pictures(design))
        if out_boom is not None:
            link_files.write_boom(files.temporary(out_boom), boom_file, design)
    if as_json:
        answer = link_report.to_json(design, written)
        if convergence:
            from planner.links.convergence import study

            answer["convergence"] = link_report.convergence_json(study(design))
        print_json(answer)
        return 0
    click.echo(link_report.title(design))
    for header, rows in (
        (link_report.ROWS_HEADER, link_report.rows(design)),
        (link_report.MOTORS_HEADER, link_report.motor_rows(design)),
    ):
        if rows:
            print_rows(header, rows)
    for line in link_report.sentences(design):
        click.echo(line)
    print_lines("Note", design.notes)
    print_files(written)
    return 0
