"""In the field: geotags of a sensor's measurements, plot maps, row scans."""

from typing import TYPE_CHECKING, Any

import click
import numpy as np

from boom_model import InputError
from boom_model.plausible import OFFSET, RATE, Range
from planner.cli.completion import OneOf, OutFile, any_file
from planner.cli.options import (
    all_option,
    boom_option,
    constraint_option,
    json_option,
    load_boom,
    outputs,
    payload_option,
    plausible,
)
from planner.cli.printing import ANSWER_IS_NO, complain, print_files, print_json, print_lines, print_rows, tracked

if TYPE_CHECKING:
    from planner.field.plots import Located, PlotMap
    from planner.field.scan import Scan
    from planner.field.sensor_tags import SensorTags
    from planner.planning import Move

_EPSG = Range(1024, 999_999, "")
_GAP = Range(1e-3, 1e4, "s")
_SIDE = Range(0.01, 100.0, "m")
_BESIDE = Range(0.1, 30.0, "m")
_SHARE = Range(0.0, 0.9, "")
_PACE = Range(0.01, 10.0, "m/s")
_PROFILES = ("cubic", "quintic", "trapezoidal", "jerk-limited", "time-optimal")
_SURE = 0.95
_FEW = 3

_epsg_option = click.option(
    "--epsg", type=int, callback=plausible(_EPSG), metavar="CODE", help="Reference system of eastings and northings read."
)


@click.command()
@click.argument("vehicle", metavar="VEHICLE", shell_complete=any_file)
@click.argument("joints", metavar="JOINTS.csv", shell_complete=any_file)
@click.argument("triggers", metavar="TRIGGERS.csv", shell_complete=any_file)
@click.option("--rig", required=True, type=click.Path(), metavar="RIG.toml", help="What stands where on the vehicle.")
@click.option("--plots", type=click.Path(), metavar="MAP", help="Plot map: which plot was seen, and how probably.")
@click.option("--out", type=OutFile(".csv"), metavar="FILE.csv", help="The tags as a table.")
@click.option("--geojson", type=OutFile(".geojson", ".json"), metavar="FILE.geojson", help="The tags for QGIS.")
@click.option("--recording", type=OutFile(".rrd"), metavar="FILE.rrd", help="Vehicle, boom and plots in 3D, and a map.")
@click.option(
    "--to-epsg", type=int, callback=plausible(_EPSG), metavar="CODE", help="Reference system written; default: the UTM zone."
)
@click.option("--gap", type=float, callback=plausible(_GAP), metavar="S", help="Longest gap to bridge; default: 3 intervals.")
@_epsg_option
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
    gap: float | None,
    epsg: int | None,
    payload: float | None,
    boom_file: str | None,
    whole: bool,
    as_json: bool,
) -> int:
    """Say where the sensor at the boom's end was at every trigger, what it saw, and how sure that is.

    VEHICLE is CSV or NMEA: time, position, attitude and their deviations. JOINTS has a time and q1..q5.
    A time is `utc`, `gps_s`, or `t` of one clock for all. Angles: heading clockwise from true north,
    pitch nose up, roll right side down.

    \b
    Example:
      boom geotag vehicle.csv joints.csv triggers.csv --rig rig.toml --plots trial.toml --out tags.csv
    """
    from planner.field.log_files import read_joint_log, read_triggers, read_vehicle_log
    from planner.field.plot_files import read_plots
    from planner.field.rig import read_rig
    from planner.field.sensor_tags import tag_sensor
    from planner.field.tag_files import rows_of, write_csv, write_geojson

    files = outputs(out, geojson, recording, inputs=(vehicle, joints, triggers, rig, plots, boom_file))
    boom = load_boom(boom_file, payload)
    log = read_vehicle_log(vehicle, epsg, gap)
    placed = read_rig(rig)
    tags = tag_sensor(boom, placed, log, read_joint_log(joints), read_triggers(triggers))
    field = None if plots is None else _map_at(read_plots(plots, None), tags)
    located = None if field is None else _located(field, tags)
    code = _zone(tags) if to_epsg is None else to_epsg
    rows = rows_of(tags, code, field, located)
    with files:
        if out is not None:
            write_csv(files.temporary(out), rows)
        if geojson is not None:
            write_geojson(files.temporary(geojson), tags, rows)
        if recording is not None:
            from planner.recording.field import write_field_recording  # slow to import

            write_field_recording(files.temporary(recording), boom, placed, tags, field, located)
    names = (("tags", out), ("map", geojson), ("recording", recording))
    written = {kind: name for kind, name in names if name is not None}
    if as_json:
        print_json({"tags": rows, "epsg": code, "warnings": tags.warnings, "notes": _notes(tags, field), "files": written})
        return 0
    _print_tags(tags, field, located, whole)
    print_files(written)
    print_lines("next", [] if out else [f"boom geotag {vehicle} {joints} {triggers} --rig {rig} --out tags.csv"])
    return 0


@click.command()
@click.argument("source", metavar="MAP", shell_complete=any_file)
@click.option("--out", type=OutFile(".geojson", ".json", ".shp", ".csv"), metavar="FILE", help="Write .geojson, .shp or .csv.")
@click.option("--picture", type=OutFile(".png"), metavar="FILE.png", help="Draw the map.")
@click.option("--at", "points", multiple=True, metavar="LAT,LON", help="Which plot a point is on; may be given again.")
@click.option("--std", type=float, default=0.0, callback=plausible(Range(0.0, 100.0, "m")), metavar="M",
              help="Standard deviation of those points.")  # fmt: skip
@_epsg_option
@all_option
@json_option
def plots(
    source: str,
    out: str | None,
    picture: str | None,
    points: tuple[str, ...],
    std: float,
    epsg: int | None,
    whole: bool,
    as_json: bool,
) -> int:
    """Make a plot map from the corners of a trial, or read one; write it, draw it, ask it.

    MAP is a trial's .toml, .geojson, .shp, or a .csv with a column wkt.

    \b
    Example:
      boom plots trial.toml --out plots.geojson --picture plots.png --at 52.13,-106.62 --std 0.05
    """
    from planner.field.plot_files import read_plots, write_plots
    from planner.field.plot_picture import write_picture
    from planner.field.plots import locate

    files = outputs(out, picture, inputs=(source,))
    field = read_plots(source, epsg)
    places = np.radians([_place(text) for text in points]).reshape(-1, 2)
    spots = field.plane(places[:, 0], places[:, 1])
    located = locate(field, spots, np.tile(np.eye(2) * std**2, (len(spots), 1, 1)))
    with files:
        if out is not None:
            write_plots(field, files.temporary(out))
        if picture is not None:
            write_picture(files.temporary(picture), field, spots)
    written = {kind: name for kind, name in (("plots", out), ("picture", picture)) if name is not None}
    on = [field.names[k] if k >= 0 else None for k in located.plot]
    if as_json:
        asked = [
            {"point": text, "plot": name, "probability": float(p)}
            for text, name, p in zip(points, on, located.probability, strict=True)
        ]
        print_json({**_map_json(field), "points": asked, "files": written})
        return 0
    _print_map(field, whole)
    if points:
        rows = [(text, name or "none", f"{p:.3f}") for text, name, p in zip(points, on, located.probability, strict=True)]
        print_rows(("point", "plot", "probability"), rows)
    print_lines("note", field.notes)
    print_files(written)
    print_lines("next", [] if out else [f"boom plots {source} --out plots.geojson --picture plots.png"])
    return 0


@click.command()
@click.argument("source", metavar="MAP", shell_complete=any_file)
@click.option("--footprint", required=True, metavar="M,M", help="What the sensor sees: along the arm, across it.")
@click.option(
    "--rate", type=float, default=4.0, show_default=True, callback=plausible(RATE), metavar="HZ", help="Of the sensor."
)
@click.option(
    "--tip-height",
    type=float,
    default=0.9,
    show_default=True,
    callback=plausible(OFFSET),
    metavar="M",
    help="Of the tip over the mount: canopy and distance, less the mount's height.",
)
@click.option(
    "--offset",
    type=float,
    callback=plausible(_BESIDE),
    metavar="M",
    help="From the track to the middle of a row; default: where the fewest stops do.",
)
@click.option(
    "--overlap",
    type=float,
    default=0.1,
    show_default=True,
    callback=plausible(_SHARE),
    metavar="SHARE",
    help="Of two lines beside each other.",
)
@click.option("--speed", type=float, callback=plausible(_PACE), metavar="M/S", help="Drive past the plots; default: stop.")
@click.option(
    "--drive-speed",
    type=float,
    default=1.0,
    show_default=True,
    callback=plausible(_PACE),
    metavar="M/S",
    help="From stop to stop.",
)
@click.option("--profile", type=OneOf(_PROFILES), default="jerk-limited", show_default=True, help="How the moves are timed.")
@constraint_option
@click.option("--mission", type=OutFile(".toml"), metavar="FILE.toml", help="The scan as a mission, for boom mission and size.")
@click.option("--out", type=OutFile(".geojson", ".json", ".shp", ".csv"), metavar="FILE", help="The plots with their coverage.")
@click.option("--picture", type=OutFile(".png"), metavar="FILE.png", help="Plots, coverage and track.")
@payload_option
@_epsg_option
@boom_option
@all_option
@json_option
def scan(
    source: str,
    footprint: str,
    mission: str | None,
    out: str | None,
    picture: str | None,
    payload: float | None,
    epsg: int | None,
    boom_file: str | None,
    whole: bool,
    as_json: bool,
    **figures: Any,
) -> int:
    """Plan a row scan: where the vehicle stops or passes, the boom's moves, and the coverage of each plot.

    \b
    Examples:
      boom scan trial.toml --footprint 0.5,0.5 --mission scan.toml --picture scan.png
      boom scan trial.toml --footprint 0.5,0.5 --speed 0.5
    """
    from boom_model.words import numbers
    from planner.field.plot_files import read_plots, write_plots
    from planner.field.plot_picture import write_picture
    from planner.field.scan import ScanTask, plan_scan

    files = outputs(mission, out, picture, inputs=(source, boom_file))
    along, across = numbers(footprint, footprint, 2)
    _SIDE.require("footprint", (along, across))
    boom, field = load_boom(boom_file, payload), read_plots(source, epsg)
    found = plan_scan(boom, field, ScanTask((along, across), **figures), tracked("planning"))
    columns: dict[str, list[Any]] = {
        "coverage": [round(float(x), 4) for x in found.coverage],
        "overlap": [round(float(x), 2) for x in found.overlap],
        "time_s": [round(float(x), 1) for x in found.seconds],
        "energy_J": [round(float(x), 1) for x in found.energy],
        "reason": [found.unreachable.get(name, "") for name in field.names],
    }
    with files:
        if mission is not None:
            with open(files.temporary(mission), "w", encoding="utf-8") as file:
                file.write(found.mission)
        if out is not None:
            write_plots(field, files.temporary(out), columns)
        if picture is not None:
            write_picture(files.temporary(picture), field, coverage=found.coverage, track=found.track)
    names = (("mission", mission), ("plots", out), ("picture", picture))
    written = {kind: name for kind, name in names if name is not None}
    if as_json:
        print_json(_scan_json(found, columns, written))
    else:
        _print_scan(found, whole)
        print_files(written)
        then = f"boom mission {mission}" if mission else f"boom scan {source} --footprint {footprint} --mission scan.toml"
        print_lines("next", [then])
    failed = _failed(found)
    if failed:
        complain(failed)
    return ANSWER_IS_NO if failed else 0


def _failed(found: "Scan") -> str:
    """Why the answer is no: a move's check fails, or a plot is not reached; else nothing."""
    from planner.checks.rows import Verdict

    bad = [name for name, move in found.moves.items() if move.report.verdict is Verdict.FAIL]
    lost = found.unreachable
    reason = next(iter(lost.values()), "")
    said = [f"{len(bad)} moves FAIL, the first {bad[0]}"] if bad else []
    return "; ".join(
        said + ([f"{len(lost)} of {len(found.plots.names)} plots are not reached whole: {reason}"] if lost else [])
    )


def _print_scan(found: "Scan", whole: bool) -> None:
    task, n = found.task, len(found.plots.names)
    stops = sum(len(visit.stops) for visit in found.visits)
    how = f"{stops} stops" if task.speed is None else f"passes at {task.speed:g} m/s"
    lines = len(found.visits[0].lines)
    print_lines(None, [f"{found.plots.source}: {n} plots, {how}, {lines} lines a plot, track at {found.offset:g} m"])
    share = f"{found.coverage.min():.1%} to {found.coverage.max():.1%} of each plot seen"
    print_lines(None, [f"{share}, each spot {found.overlap.mean():.1f} times; {found.seconds.sum() / 60:.0f} min over plots"])
    listed = list(zip(found.plots.names, found.coverage, found.overlap, found.seconds, found.energy, strict=True))
    rows = [(name, f"{c:.1%}", f"{o:.1f}", f"{t:.1f} s", f"{e:.1f} J") for name, c, o, t, e in listed]
    print_rows(("plot", "seen", "times", "time", "work of joints"), rows if whole else rows[:_FEW])
    print_lines(None, [f"{n - _FEW} more plots: --all lists them"] if n > _FEW and not whole else [])
    moves = [
        (name.replace("tip=", ""), f"{move.report.duration:.2f} s", str(move.report.verdict), f"{_worst(move):.3f}")
        for name, move in found.moves.items()
    ]
    print_rows(("move", "time", "verdict", "worst ratio"), moves if whole else moves[:_FEW])
    print_lines(None, [f"{len(moves) - _FEW} more moves: --all lists them"] if len(moves) > _FEW and not whole else [])
    crossed = f"the track crosses {found.crossed} plots, so the vehicle must straddle them"
    print_lines("note", [crossed] if found.crossed else [])
    print_lines("note", ["turns at the ends of rows, and shocks while driving, are not counted"])
    print_lines("note", found.plots.notes if whole else [])


def _worst(move: "Move") -> float:
    """Return the largest demand over limit of a move's certificate."""
    certificate = move.report.certificate
    return max((worst.ratio for worst in certificate.worst), default=0.0) if certificate is not None else 0.0


def _scan_json(found: "Scan", columns: dict[str, list[Any]], written: dict[str, str]) -> dict[str, Any]:
    plots = [{"plot": name, **{key: values[k] for key, values in columns.items()}} for k, name in enumerate(found.plots.names)]
    moves = [
        {"move": name, "duration_s": move.report.duration, "verdict": str(move.report.verdict), "worst_ratio": _worst(move)}
        for name, move in found.moves.items()
    ]
    return {"offset_m": found.offset, "stops": len(found.track), "plots": plots, "moves": moves, "files": written}


def _map_at(field: "PlotMap", tags: "SensorTags") -> "PlotMap":
    """Return the map with its ground at the height of what was seen, checked to be where the log is."""
    from planner.field.plots import require_near

    latitude, longitude, height = tags.seen.geodetic
    require_near(field, *tags.sensor.geodetic[:2], tags.triggers.source)
    known = np.isfinite(latitude) & np.isfinite(longitude)
    return field.at_height(float(np.median(height[known]))) if known.any() else field


def _located(field: "PlotMap", tags: "SensorTags") -> "Located":
    from planner.field.plots import locate

    spots = np.full((len(tags.triggers.t), 2), np.nan)
    known = np.isfinite(tags.seen.ecef).all(axis=-1)
    if known.any():
        spots[known] = field.plane_of(tags.seen.ecef[known])
    return locate(field, spots, tags.seen.covariance[:, :2, :2])


def _zone(tags: "SensorTags") -> int:
    from planner.field.earth import utm_zone

    latitude, longitude, _ = tags.sensor.geodetic
    first = int(np.argmax(tags.known))
    return utm_zone(float(latitude[first]), float(longitude[first]))


def _notes(tags: "SensorTags", field: "PlotMap | None") -> list[str]:
    return [*tags.notes, *(() if field is None else field.notes)]


def _print_tags(tags: "SensorTags", field: "PlotMap | None", located: "Located | None", whole: bool) -> None:
    n, known = len(tags.triggers.t), tags.known
    print_lines(None, [f"{tags.triggers.source}: {n} triggers, {known.sum()} tagged"])
    rows = []
    for name, each in (("sensor", tags.sensor), ("what it saw", tags.seen)):
        at = np.isfinite(each.ecef).all(axis=-1)
        if not at.any():
            continue
        std = np.sqrt(np.diagonal(each.covariance[at], axis1=1, axis2=2))
        long = each.ellipses[at, 0]
        worst = [f"{figure * 1e3:.0f} mm" for figure in (np.median(long), np.max(long))]
        rows.append((name, *(f"{np.median(s) * 1e3:.0f} mm" for s in std.T), *worst))
    print_rows(("", "std east", "north", "up", "95 % ellipse", "worst"), rows)
    print_lines(None, [f"sag by the gearboxes: {np.nanmedian(-tags.sag[:, 2]) * 1e3:.1f} mm (median), counted in"])
    if field is not None and located is not None:
        sure = int((located.probability >= _SURE).sum())
        plots = len(set(located.plot[located.plot >= 0]))
        on = int((located.plot >= 0).sum())
        print_lines(
            None, [f"{on} spots on {plots} of {len(field.names)} plots, {sure} with a probability of {_SURE:g} or more"]
        )
        print_lines(None, [f"{int(known.sum()) - on} spots on no plot"] if on < known.sum() else [])
    lost = [f"{tags.triggers.labels[k]}: {tags.sensor.reasons[k]}" for k in np.flatnonzero(~known)]
    for title, lines in (("WARN", tags.warnings), ("no tag", lost)):
        print_lines(title, lines if whole else lines[:_FEW])
        print_lines(title, [f"{len(lines) - _FEW} more: --all lists them"] if len(lines) > _FEW and not whole else [])
    notes = _notes(tags, field)
    print_lines("note", notes if whole else [f"{len(notes)} notes and assumptions: --all lists them"])


def _print_map(field: "PlotMap", whole: bool) -> None:
    grid = [(r, c) for r, c in zip(field.rows, field.ranges, strict=True) if r is not None and c is not None]
    size = f", {len({r for r, _ in grid})} rows x {len({c for _, c in grid})} ranges" if grid else ""
    print_lines(None, [f"{field.source}: {len(field.names)} plots{size}, {field.area():.1f} m^2"])
    latitude, longitude = np.degrees([field.frame.latitude, field.frame.longitude])
    print_lines(None, [f"middle at {latitude:.7f}, {longitude:.7f} deg"])
    listed = list(zip(field.names, field.polygons, strict=True))
    rows = [(name, f"{p.area:.3f} m^2", f"{p.centroid.x:.2f}", f"{p.centroid.y:.2f}") for name, p in listed]
    print_rows(("plot", "area", "east of middle", "north"), rows if whole else rows[:_FEW])
    print_lines(None, [f"{len(rows) - _FEW} more plots: --all lists them"] if len(rows) > _FEW and not whole else [])


def _map_json(field: "PlotMap") -> dict[str, Any]:
    plots = [
        {"plot": name, "row": row, "range": rank, "area_m2": float(polygon.area)}
        for name, row, rank, polygon in zip(field.names, field.rows, field.ranges, field.polygons, strict=True)
    ]
    return {"plots": plots, "latitude_rad": field.frame.latitude, "longitude_rad": field.frame.longitude, "notes": field.notes}


def _place(text: str) -> tuple[float, float]:
    """Latitude and longitude [deg] of LAT,LON."""
    from boom_model.words import numbers

    latitude, longitude = numbers(text, text, 2)
    if abs(latitude) > 90.0:
        raise InputError(f"{text!r}: latitude is {latitude:g} deg; it must be between -90 and 90 deg")
    return latitude, longitude
