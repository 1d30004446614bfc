"""Plot maps."""

from typing import TYPE_CHECKING, Any

import click
import numpy as np

from boom_model import InputError
from boom_model.plausible import Range
from planner.cli.completion import OutFile, any_file
from planner.cli.options import (
    all_option,
    epsg_option,
    figure_option,
    json_option,
    outputs,
)
from planner.cli.printing import print_files, print_json, print_lines, print_rows

if TYPE_CHECKING:
    from planner.field.plots import PlotMap

_MAPS = (".geojson", ".json", ".gpkg", ".shp", ".csv")
_STD = Range(0.0, 100.0, "m")
_FEW = 3


@click.command()
@click.argument("source", metavar="MAP", shell_complete=any_file)
@click.option("--out", type=OutFile(*_MAPS), metavar="FILE", help="Write .geojson, .gpkg, .shp or .csv.")
@click.option("--picture", type=OutFile(".png"), metavar="FILE.png", help="Draw the map.")
@click.option("--at", "points", multiple=True, metavar="LAT,LON", help="Which plot a point is on; may be given again.")
@figure_option("--std", _STD, "M", "Standard deviation of those points.", 0.0)
@epsg_option
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

    MAP is a trial's .toml, .geojson, .gpkg, .shp, or a .csv with a column wkt.

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
