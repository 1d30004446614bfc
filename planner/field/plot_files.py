"""Files of plot maps: GeoJSON, GeoPackage, shapefile, CSV with WKT, and a trial's TOML.

The one file that uses pyogrio, which brings GDAL.

What is written is in WGS 84 (EPSG:4326), longitude first, as QGIS reads it.
"""

import csv
import json
import re
import warnings
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from boom_model import InputError
from boom_model.arrays import Array
from boom_model.plausible import Range
from boom_model.provenance import BasisName
from boom_model.toml_file import Table, read_toml
from planner.field.earth import GEOGRAPHIC, datum_note, ecef_from, geodetic_of, reference_system
from planner.field.extra import library
from planner.field.plots import PlotMap, lay_out
from planner.field.vehicle_log import ELLIPSOIDAL_HEIGHT

FORMS = (".geojson", ".json", ".gpkg", ".shp", ".csv")
"""Endings of the files that a map is written to."""
_DRIVERS = {".gpkg": "GPKG", ".shp": "ESRI Shapefile"}
_LONGEST_ERROR = 200  # letters of GDAL's messages that are shown
_LONGEST_NAME = 10  # of a shapefile's column
_NAMES = ("plot", "name", "plot_id", "plotid", "id", "plot_name")
_DECIMALS = 10  # of a degree: 0.01 mm
_PLOT_SIDE = Range(0.05, 1e3, "m")
_ALLEY = Range(0.0, 100.0, "m")
_MOST = 100_000
_Side = Annotated[float, _PLOT_SIDE]
_Between = Annotated[float, _ALLEY]
_Count = Annotated[int, Field(ge=1, le=10_000)]


class _Trial(Table):
    name: str
    basis: BasisName
    source: str
    rows: _Count
    ranges: _Count
    plot_m: Annotated[list[_Side], Field(min_length=2, max_length=2)]
    alley_m: Annotated[list[_Between], Field(min_length=2, max_length=2)]
    corners: Annotated[list[list[float]], Field(min_length=2, max_length=4)]
    epsg: int = GEOGRAPHIC
    height_m: Annotated[float, ELLIPSOIDAL_HEIGHT] = 0.0
    rows_to: Literal["left", "right"] = "left"


def read_plots(path: str | Path, epsg: int | None = None) -> PlotMap:
    """Read a map by the ending of its file: a trial's .toml, or one of FORMS.

    Args:
        path: the file.
        epsg: reference system of a file that does not name its own; EPSG:4326 else.

    Raises:
        InputError: the file cannot be read, is malformed, or is of another form; names the plot.
    """
    form = Path(path).suffix.lower()
    if form == ".toml":
        return _of_trial(Path(path))
    if form in (".geojson", ".json"):
        return _read_geojson(path, epsg)
    if form in _DRIVERS:
        return _read_layer(path, epsg)
    if form == ".csv":
        return _read_csv(path, epsg)
    raise InputError(f"{path}: a plot map ends in .toml, {', '.join(FORMS)}")


def write_plots(plots: PlotMap, path: str | Path, columns: dict[str, list[Any]] | None = None) -> None:
    """Write a map by the ending of the name, with further columns, one value a plot.

    Raises:
        InputError: the ending is none of FORMS.
    """
    form = Path(path).suffix.lower()
    more = columns or {}
    if form in (".geojson", ".json"):
        features = [_feature(plots, i, more) for i in range(len(plots.names))]
        text = json.dumps({"type": "FeatureCollection", "features": features}, allow_nan=False, indent=1)
        Path(path).write_text(text + "\n", encoding="utf-8")
    elif form == ".csv":
        with open(path, "w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["plot", "row", "range", *more, "wkt"])
            for i, name in enumerate(plots.names):
                extra = [values[i] for values in more.values()]
                writer.writerow([name, plots.rows[i] or "", plots.ranges[i] or "", *extra, _wkt(plots, i)])
    elif form in _DRIVERS:
        _write_layer(plots, path, more)
    else:
        raise InputError(f"{path}: a plot map is written to {', '.join(FORMS)}")


def _of_trial(path: Path) -> PlotMap:
    table = read_toml(path, _Trial)
    for k, corner in enumerate(table.corners):
        if len(corner) != 2:
            raise InputError(f"{path}: key corners.{k}: {len(corner)} numbers; a corner has two")
        if table.epsg == GEOGRAPHIC and not (abs(corner[0]) <= 90.0 and abs(corner[1]) <= 360.0):
            raise InputError(f"{path}: key corners.{k}: {corner[0]:g}, {corner[1]:g}; it must be latitude, longitude in deg")
    given = np.array(table.corners, dtype=float)
    if not np.isfinite(given).all():
        raise InputError(f"{path}: key corners: a number is not finite")
    if table.rows * table.ranges > _MOST:
        raise InputError(f"{path}: {table.rows * table.ranges:,} plots; at most {_MOST:,}")
    x, y = (given[:, 1], given[:, 0]) if reference_system(table.epsg).is_geographic else given.T
    latitude, longitude, _ = geodetic_of(_placed(str(path), table.epsg, x, y))
    plots, off = lay_out(
        np.column_stack([latitude, longitude]), table.rows, table.ranges, (table.plot_m[0], table.plot_m[1]),
        (table.alley_m[0], table.alley_m[1]), height=table.height_m, source=str(path), rows_to_right=table.rows_to == "right",
    )  # fmt: skip
    notes = [f"{path}: the corners are {off:.3f} m (RMS) from the layout"]
    if table.basis == "assumed":
        notes.append(f"assumed: the plots: {table.source}")
    return PlotMap.of(
        list(plots.names), [list(r) for r in plots.rings], rows=list(plots.rows), ranges=list(plots.ranges),
        height=table.height_m, source=str(path), notes=(*notes, *_datum(table.epsg)),
    )  # fmt: skip


def _read_geojson(path: str | Path, epsg: int | None) -> PlotMap:
    try:
        data = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not GeoJSON: {error}") from None
    if not isinstance(data, dict) or not isinstance(data.get("features"), list):
        raise InputError(f"{path}: not GeoJSON: no list of features")
    found = []
    for k, feature in enumerate(data["features"]):
        geometry = feature.get("geometry") if isinstance(feature, dict) else None
        if not isinstance(geometry, dict) or geometry.get("type") not in ("Polygon", "MultiPolygon"):
            raise InputError(f"{path}: feature {k + 1} is no polygon")
        rings: Any = geometry.get("coordinates")
        if geometry["type"] == "MultiPolygon":
            if not isinstance(rings, list) or len(rings) != 1:
                raise InputError(f"{path}: feature {k + 1} has several parts; a plot has one")
            rings = rings[0]
        properties = feature.get("properties")
        found.append((properties if isinstance(properties, dict) else {}, _rings(f"{path}: feature {k + 1}", rings)))
    return _map(path, found, _code_of(path, data, epsg))


def _code_of(path: str | Path, data: dict[str, Any], epsg: int | None) -> int:
    """Return the EPSG code of GeoJSON's old member crs; RFC 7946 knows WGS 84 alone."""
    crs = data.get("crs")
    if crs is None:
        return GEOGRAPHIC if epsg is None else epsg
    name = str(crs.get("properties", {}).get("name", "")) if isinstance(crs, dict) else ""
    if name.endswith("CRS84"):
        return GEOGRAPHIC
    code = re.search(r"EPSG:+(\d{4,6})$", name)
    if code is None:
        raise InputError(f"{path}: crs {name!r} is not known; write WGS 84")
    if epsg is not None and epsg != int(code[1]):
        raise InputError(f"{path}: crs is EPSG {code[1]}, and {epsg} was given")
    return int(code[1])


def _read_layer(path: str | Path, epsg: int | None) -> PlotMap:
    """Read the one layer of polygons of a GeoPackage or shapefile."""
    pyogrio, shapely = library("pyogrio"), library("shapely")
    if not Path(path).is_file():
        raise InputError(f"{path}: cannot be read: no such file")
    if Path(path).suffix.lower() == ".shp" and not Path(path).with_suffix(".dbf").is_file():
        raise InputError(f"{path}: the file {Path(path).with_suffix('.dbf').name} of its attributes is missing")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of what GDAL mends, such as the sense of a ring
            kinds = [(str(name), str(kind)) for name, kind in pyogrio.list_layers(path)]
            layers = [name for name, kind in kinds if "Polygon" in kind or kind == "Unknown"]
            if len(layers) != 1:
                listed = ", ".join(layers or [name for name, _ in kinds]) or "none"
                raise InputError(f"{path}: its layers{' of polygons' if layers else ''} are {listed}; it needs one of polygons")
            meta, _, geometry, columns = pyogrio.raw.read(path, layer=layers[0], force_2d=True)
            shapes = shapely.from_wkb(geometry)
    except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError, shapely.errors.GEOSException, ValueError) as error:
        driver, said = _DRIVERS[Path(path).suffix.lower()], str(error).splitlines()[0][:_LONGEST_ERROR]
        raise InputError(f"{path}: cannot be read as {driver}: {said}") from None
    names = [str(name) for name in meta["fields"]]
    found = []
    for k, shape in enumerate(shapes):
        properties = {name: _cell(column[k]) for name, column in zip(names, columns, strict=True)}
        found.append((properties, _rings_of_shape(f"{path}: feature {k + 1}", shape)))
    return _map(path, found, _code_of_layer(path, meta["crs"], epsg))


def _cell(value: Any) -> Any:
    """Return a whole number as int: a column of them with a blank cell comes as floats."""
    return int(value) if isinstance(value, np.floating) and float(value).is_integer() else value


def _rings_of_shape(where: str, shape: Any) -> list[Array]:
    parts = [] if shape is None else list(getattr(shape, "geoms", [shape]))
    if not parts or any(part.geom_type != "Polygon" or part.is_empty for part in parts):
        raise InputError(f"{where} is no polygon")
    if len(parts) > 1:
        raise InputError(f"{where} has several parts; a plot has one")
    return _rings(where, [ring.coords for ring in (parts[0].exterior, *parts[0].interiors)])


def _code_of_layer(path: str | Path, crs: str | None, epsg: int | None) -> int:
    if crs is None:
        return GEOGRAPHIC if epsg is None else epsg
    pyproj = library("pyproj")
    try:
        code = pyproj.CRS.from_user_input(crs).to_epsg(min_confidence=60)
    except pyproj.exceptions.CRSError:
        code = None
    if code is None and epsg is None:
        raise InputError(f"{path}: its reference system has no EPSG code; give --epsg CODE")
    if code is not None and epsg is not None and int(code) != epsg:
        raise InputError(f"{path}: it is EPSG {code}, and {epsg} was given")
    return int(code) if epsg is None else epsg


def _read_csv(path: str | Path, epsg: int | None) -> PlotMap:
    shapely = library("shapely")
    try:
        rows = list(csv.DictReader(Path(path).read_text(encoding="utf-8-sig").splitlines(), strict=True))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: not CSV: {error}") from None
    found = []
    for line, row in enumerate(rows, start=2):
        by_name = {str(key).strip().lower(): value for key, value in row.items()}
        if not isinstance(by_name.get("wkt"), str):
            raise InputError(f"{path}, line {line}: no column wkt with the plot as POLYGON ((longitude latitude, ...))")
        try:
            shape = shapely.from_wkt(by_name["wkt"])
        except shapely.errors.GEOSException as error:
            raise InputError(f"{path}, line {line}: wkt is malformed: {str(error).splitlines()[0]}") from None
        found.append((by_name, _rings_of_shape(f"{path}, line {line}: wkt", shape)))
    return _map(path, found, GEOGRAPHIC if epsg is None else epsg)


def _rings(where: str, rings: Any) -> list[Array]:
    """Return rings (k, 2) of coordinates x, y, without the first point again."""
    try:
        found = [np.array([[float(point[0]), float(point[1])] for point in ring]) for ring in rings]
    except (TypeError, ValueError, IndexError, KeyError, OverflowError):
        raise InputError(f"{where}: its coordinates are malformed") from None
    if not found or any(ring.ndim != 2 or len(ring) < 4 or not np.isfinite(ring).all() for ring in found):
        raise InputError(f"{where}: a ring has fewer than four points, or a coordinate that is not finite")
    return [ring[:-1] if np.array_equal(ring[0], ring[-1]) else ring for ring in found]


def _map(path: str | Path, found: list[tuple[dict[str, Any], list[Array]]], epsg: int) -> PlotMap:
    if len(found) > _MOST:
        raise InputError(f"{path}: {len(found):,} plots; at most {_MOST:,}")
    names, rings, rows, ranges = [], [], [], []
    for k, (properties, plot) in enumerate(found):
        given = {str(key).lower(): value for key, value in properties.items()}
        name = next((str(given[key]).strip() for key in _NAMES if given.get(key) not in (None, "")), str(k + 1))
        names.append(name)
        flat = []
        for ring in plot:
            x, y = ring.T
            if reference_system(epsg).is_geographic and not ((np.abs(y) <= 90.0).all() and (np.abs(x) <= 360.0).all()):
                swapped = (np.abs(x) <= 90.0).all() and (np.abs(y) <= 360.0).all()
                hint = "; latitude and longitude are swapped" if swapped else "; they look like metres: give --epsg CODE"
                raise InputError(f"{path}: plot {name}: {x[0]:g}, {y[0]:g} is no longitude, latitude in deg{hint}")
            latitude, longitude, _ = geodetic_of(_placed(f"{path}: plot {name}", epsg, x, y))
            flat.append(np.column_stack([latitude, longitude]))
        rings.append(flat)
        rows.append(_whole(given.get("row")))
        ranges.append(_whole(given.get("range")))
    return PlotMap.of(names, rings, rows=rows, ranges=ranges, source=str(path), notes=_datum(epsg))


def _placed(where: str, epsg: int, x: Array, y: Array) -> Array:
    try:
        return ecef_from(epsg, x, y, np.zeros(len(x)))
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def _datum(epsg: int) -> tuple[str, ...]:
    note = datum_note(epsg)
    return () if note is None else (note,)


def _whole(value: Any) -> int | None:
    try:
        number = float(value)
    except (TypeError, ValueError):
        return None
    return int(number) if np.isfinite(number) and number == int(number) and abs(number) < 1e9 else None


def _degrees(ring: Array) -> list[list[float]]:
    """Longitude and latitude of a ring [deg], the first point again at the end."""
    closed = np.degrees(np.vstack([ring, ring[:1]]))[:, ::-1]
    return [[round(float(x), _DECIMALS), round(float(y), _DECIMALS)] for x, y in closed]


def _wound(plots: PlotMap, i: int) -> list[list[list[float]]]:
    """Return the rings of a plot [deg], the outer one anticlockwise, its holes clockwise."""
    wound = []
    for k, ring in enumerate(plots.rings[i]):
        x, y = plots.plane(ring[:, 0], ring[:, 1]).T
        positive = float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum()) > 0.0
        wound.append(_degrees(ring if positive == (k == 0) else ring[::-1]))
    return wound


def _feature(plots: PlotMap, i: int, more: dict[str, list[Any]]) -> dict[str, Any]:
    properties = {"plot": plots.names[i], "row": plots.rows[i], "range": plots.ranges[i]}
    properties |= {name: values[i] for name, values in more.items()}
    return {
        "type": "Feature",
        "properties": properties,
        "geometry": {"type": "Polygon", "coordinates": _wound(plots, i)},
    }


def _wkt(plots: PlotMap, i: int) -> str:
    rings = (", ".join(f"{x:.{_DECIMALS}f} {y:.{_DECIMALS}f}" for x, y in ring) for ring in _wound(plots, i))
    return f"POLYGON ({', '.join(f'({ring})' for ring in rings)})"


def _write_layer(plots: PlotMap, path: str | Path, more: dict[str, list[Any]]) -> None:
    shapely = library("shapely")
    driver = _DRIVERS[Path(path).suffix.lower()]
    columns: dict[str, list[Any]] = {"plot": list(plots.names), "row": list(plots.rows), "range": list(plots.ranges), **more}
    longest = _LONGEST_NAME if driver == "ESRI Shapefile" else None
    shapes = [shapely.Polygon(rings[0], rings[1:]) for rings in (_wound(plots, i) for i in range(len(plots.names)))]
    library("pyogrio").raw.write(
        path,
        shapely.to_wkb(shapes),
        [_column(values) for values in columns.values()],
        [name[:longest] for name in columns],
        field_mask=[np.array([value is None for value in values]) for values in columns.values()],
        layer="plots" if longest is None else None,
        driver=driver,
        geometry_type="Polygon",
        crs=f"EPSG:{GEOGRAPHIC}",
    )


def _column(values: list[Any]) -> Any:
    """Return a column as an array of one type, 0 for None, which its mask leaves blank."""
    if all(value is None or isinstance(value, int) for value in values):
        return np.array([value or 0 for value in values], dtype=np.int64)
    if all(value is None or isinstance(value, int | float) for value in values):
        return np.array([value or 0.0 for value in values], dtype=float)
    return np.array(["" if value is None else str(value) for value in values], dtype=object)
