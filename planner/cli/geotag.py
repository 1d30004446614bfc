"""Where a sensor was at every trigger, and the rig measured from a manoeuvre."""

from typing import TYPE_CHECKING

import click
import numpy as np

from boom_model.plausible import OFFSET, Range
from planner.cli.completion import OutFile, any_file
from planner.cli.options import (
    EPSG,
    all_option,
    boom_option,
    epsg_option,
    figure_option,
    json_option,
    load_boom,
    outputs,
    payload_option,
    plausible,
    report_option,
    with_names,
)
from planner.cli.printing import print_files, print_json, print_lines, print_rows

if TYPE_CHECKING:
    from boom_model.arrays import Array
    from planner.field.manoeuvre import Measured
    from planner.field.plots import Located, PlotMap
    from planner.field.sensor_tags import SensorTags

_GAP = Range(1e-3, 1e4, "s")
_FEW = 3
_SHOWN = {"s": (1e3, "ms"), "m": (1e3, "mm"), "rad": (float(np.degrees(1.0)), "deg")}

_rig_option = click.option(
    "--rig", required=True, type=click.Path(), metavar="RIG.toml", help="What stands where on the vehicle."
)
_gap_option = figure_option("--gap", _GAP, "S", "Longest gap to bridge; default: 3 intervals.")


@click.command()
@click.argument("vehicle", metavar="VEHICLE", shell_complete=any_file)
@click.argument("joints", metavar="JOINTS.csv", shell_complete=any_file)
@click.argument("triggers", metavar="TRIGGERS.csv", shell_complete=any_file)
@_rig_option
@click.option("--plots", type=click.Path(), metavar="MAP", help="Plot map: which plot was seen, and how probably.")
@click.option("--out", type=OutFile(".csv", ".parquet"), metavar="FILE.csv|.parquet", help="The tags; .parquet is GeoParquet.")
@click.option("--geojson", type=OutFile(".geojson", ".json"), metavar="FILE.geojson", help="The tags for QGIS.")
@click.option("--recording", type=OutFile(".rrd"), metavar="FILE.rrd", help="Vehicle, boom and plots in 3D, and a map.")
@click.option(
    "--to-epsg", type=int, callback=plausible(EPSG), metavar="CODE", help="Reference system written; default: the UTM zone."
)
@report_option
@_gap_option
@epsg_option
@payload_option
@boom_option
@all_option
@json_option
def geotag(
    vehicle: str,
    joints: str,
    triggers: str,
    rig: str,
    plots: str | None,
    out: str | None,
    geojson: str | None,
    recording: str | None,
    to_epsg: int | None,
    document: str | None,
    gap: float | None,
    epsg: int | None,
    payload: float | None,
    boom_file: str | None,
    whole: bool,
    as_json: bool,
) -> int:
    """Say where the sensor at the boom's end was at every trigger, what it saw, how sure that is.

    VEHICLE is CSV or NMEA: time, position, attitude and their deviations. JOINTS has a time and
    q1..q5. A time is `utc`, `gps_s`, or `t` of one clock for all. Angles: heading clockwise from
    true north, pitch nose up, roll right side down.

    \b
    Example:
      boom geotag vehicle.csv joints.csv triggers.csv --rig rig.toml --plots plots.gpkg --out t.csv
    """
    from planner.field.log_files import read_joint_log, read_triggers, read_vehicle_log
    from planner.field.on_plots import locate_spots, map_at, zone_of
    from planner.field.plot_files import read_plots
    from planner.field.rig import read_rig
    from planner.field.sensor_tags import tag_sensor
    from planner.field.tag_files import rows_of, write_geojson, write_table
    from planner.field.tag_report import all_notes, tag_markdown

    files = outputs(out, geojson, recording, document=document, inputs=(vehicle, joints, triggers, rig, plots, boom_file))
    boom, placed = load_boom(boom_file, payload), read_rig(rig)
    log = read_vehicle_log(vehicle, epsg, gap)
    tags = tag_sensor(boom, placed, log, read_joint_log(joints), read_triggers(triggers))
    field = None if plots is None else map_at(read_plots(plots, None), tags)
    located = None if field is None else locate_spots(field, tags)
    code = zone_of(tags) if to_epsg is None else to_epsg
    rows = rows_of(tags, code, field, located)
    with files:
        if out is not None:
            write_table(files.temporary(out), tags, rows)
        if geojson is not None:
            write_geojson(files.temporary(geojson), tags, rows)
        if recording is not None:
            from planner.recording.field import write_field_recording  # slow to import

            write_field_recording(files.temporary(recording), boom, placed, tags, field, located)
        if document is not None:
            from planner.field.tag_pictures import tag_pictures  # matplotlib is slow to import
            from planner.reports.document import write_document

            pictures = tag_pictures(tags, log, field, located)
            write_document(files.temporary(document), tag_markdown(tags, placed, field, located), pictures)
    written = with_names({"tags": out, "map": geojson, "recording": recording, "report": document})
    if as_json:
        print_json({"tags": rows, "epsg": code, "warnings": tags.warnings, "notes": all_notes(tags, field), "files": written})
        return 0
    _print_tags(tags, field, located, whole)
    print_files(written)
    print_lines("next", [] if out else [f"boom geotag {vehicle} {joints} {triggers} --rig {rig} --out tags.csv"])
    return 0


@click.command()
@click.argument("vehicle", metavar="VEHICLE", shell_complete=any_file)
@click.argument("points", metavar="POINTS", shell_complete=any_file)
@_rig_option
@click.option("--joints", type=click.Path(), metavar="JOINTS.csv", help="Joint log, if the point is the sensor.")
@click.option(
    "--point",
    metavar="mount|sensor|X,Y,Z",
    help="What was measured; default: the sensor with --joints, else the mount.",
)
@click.option(
    "--estimate",
    "words",
    default="delay,lever-arm",
    show_default=True,
    metavar="WORD,...",
    help="Of delay, points-delay, joints-delay, lever-arm and angles.",
)
@click.option("--out", type=OutFile(".toml"), metavar="FILE.toml", help="The rig with what was found.")
@_gap_option
@epsg_option
@payload_option
@boom_option
@all_option
@json_option
def rig(
    vehicle: str,
    points: str,
    rig: str,
    joints: str | None,
    point: str | None,
    words: str,
    out: str | None,
    gap: float | None,
    epsg: int | None,
    payload: float | None,
    boom_file: str | None,
    whole: bool,
    as_json: bool,
) -> int:
    """Measure the rig: how late the logs are, lever arm and mounting angles, from a manoeuvre.

    The vehicle turned and changed its speed while a total station or a second receiver measured
    one point. POINTS has a time and a position in any form of VEHICLE.

    \b
    delay         how late VEHICLE's stamps are, POINTS' taken as true
    points-delay  how late POINTS' stamps are, VEHICLE's taken as true
    joints-delay  how late JOINTS' stamps are
    lever-arm     from the antenna to the mount; with X,Y,Z, the antenna's place
    angles        of the mount on the vehicle

    \b
    Example:
      boom rig vehicle.csv points.csv --rig rig.toml --estimate delay,lever-arm --out measured.toml
    """
    from planner.field.log_files import read_joint_log, read_points, read_vehicle_log
    from planner.field.manoeuvre import measure_rig, write_measured
    from planner.field.rig import read_rig

    files = outputs(out, inputs=(vehicle, points, rig, joints, boom_file))
    boom, placed = load_boom(boom_file, payload), read_rig(rig)
    log, seen = read_vehicle_log(vehicle, epsg, gap), read_points(points, epsg)
    swept = None if joints is None else read_joint_log(joints)
    asked = ("mount" if joints is None else "sensor") if point is None else point
    found = measure_rig(boom, placed, log, seen, words.split(","), _point(asked), swept)
    with files:
        if out is not None:
            write_measured(files.temporary(out), rig, found, f"boom rig {vehicle} {points}: {found.sentence}")
    written = with_names({"rig": out})
    if as_json:
        print_json({**found.to_json(), "files": written})
        return 0
    print_lines(None, [f"{vehicle} against {points}: {found.sentence}"])
    _print_figures(found, whole)
    print_files(written)
    then = f"boom geotag {vehicle} JOINTS.csv TRIGGERS.csv --rig {out}"
    print_lines("next", [then if out else f"boom rig {vehicle} {points} --rig {rig} --out measured.toml"])
    return 0


def _point(text: str) -> "str | Array":
    """Return the measured point of --point: mount, sensor, or a place (3,) on the vehicle."""
    from boom_model.words import numbers, unknown
    from planner.field.manoeuvre import MOUNT, SENSOR

    if text in (MOUNT, SENSOR):
        return text
    if "," not in text:
        raise unknown("point", text, [MOUNT, SENSOR])
    place = np.array(numbers(text, text, 3))
    OFFSET.require("point", place.tolist())
    return place


def _print_figures(found: "Measured", whole: bool) -> None:
    rows = []
    for figure in found.figures:
        scale, unit = _SHOWN[figure.unit]
        decimals = 3 if unit == "deg" else 1
        cells = [f"{value * scale:.{decimals}f} {unit}" for value in (figure.before, figure.found, figure.std)]
        rows.append((figure.name, *cells))
    print_rows(("", "rig", "found", "std"), rows)
    print_lines(None, [found.correlation] if found.correlation else [])
    print_lines("WARN", found.warnings)
    print_lines("note", found.notes if whole else [f"{len(found.notes)} notes and assumptions: --all lists them"])


def _print_tags(tags: "SensorTags", field: "PlotMap | None", located: "Located | None", whole: bool) -> None:
    from planner.field.tag_report import ACCURACY, accuracy_rows, all_notes, sentences

    first, *more = sentences(tags, field, located)
    print_lines(None, [first])
    print_rows(ACCURACY, accuracy_rows(tags))
    print_lines(None, more)
    for title, lines in (("WARN", tags.warnings), ("no tag", tags.lost)):
        print_lines(title, lines if whole else lines[:_FEW])
        print_lines(title, [f"{len(lines) - _FEW} more: --all lists them"] if len(lines) > _FEW and not whole else [])
    notes = all_notes(tags, field)
    print_lines("note", notes if whole else [f"{len(notes)} notes and assumptions: --all lists them"])
