"""Files of geotags: a table as CSV or GeoParquet, points with footprints as GeoJSON for QGIS."""

import csv
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from planner.field.earth import coordinates_in, geodetic_of
from planner.field.extra import library
from planner.field.geotag import Geotags, ellipses
from planner.field.plots import Located, PlotMap
from planner.field.sensor_tags import SensorTags

_DEGREES, _METRES = 10, 4  # decimals
_TEXTS = ("label", "plot", "reason")
_WITH_HEIGHT, _WITHOUT_HEIGHT = "OGC:CRS84h", "OGC:CRS84"
"""WGS 84, longitude first."""


def rows_of(tags: SensorTags, epsg: int, plots: PlotMap | None = None, located: Located | None = None) -> list[dict[str, Any]]:
    """Return a row for every trigger, with None where it has no value; units are in the names.

    Args:
        tags: the geotags.
        epsg: reference system of x and y.
        plots: the map, and with it
        located: which plot each spot is on.
    """
    sensor, seen = _columns("sensor", tags.sensor, epsg), _columns("seen", tags.seen, epsg)
    heading = np.degrees(np.arctan2(tags.sensor.R_enu_body[:, 0, 0], tags.sensor.R_enu_body[:, 1, 0])) % 360.0
    elevation = np.degrees(np.arcsin(np.clip(tags.view[:, 2], -1.0, 1.0)))
    bearing = np.degrees(tags.bearing)
    rows = []
    for k, label in enumerate(tags.triggers.labels):
        row: dict[str, Any] = {"label": label, "utc" if tags.triggers.clock == "utc" else "t": float(tags.triggers.t[k])}
        row |= {name: _number(values[k], name) for name, values in (*sensor.items(), *seen.items())}
        row["vehicle_heading_deg"] = _number(heading[k], "_m")
        row["view_bearing_deg"] = _number(bearing[k], "_m")
        row["view_elevation_deg"] = _number(elevation[k], "_m")
        row["sag_m"] = _number(-tags.sag[k, 2], "_m")
        if plots is not None and located is not None:
            row["plot"] = plots.names[located.plot[k]] if located.plot[k] >= 0 else None
            row["probability"] = _number(located.probability[k], "_m")
            row["no_plot_probability"] = _number(located.outside[k], "_m")
        row["reason"] = tags.sensor.reasons[k] or None
        rows.append(row)
    return rows


def write_table(path: str | Path, tags: SensorTags, rows: list[dict[str, Any]]) -> None:
    """Write rows as CSV, None as an empty cell; or as GeoParquet, if the name ends in .parquet."""
    if str(path).endswith(".parquet"):
        _write_geoparquet(path, tags, rows)
        return
    with open(path, "w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def _write_geoparquet(path: str | Path, tags: SensorTags, rows: list[dict[str, Any]]) -> None:
    """Write GeoParquet 1.1: the sensor's position as `geometry`, what it saw as `footprint`.

    Source: https://geoparquet.org/releases/v1.1.0/
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    shapely, pyproj = library("shapely"), library("pyproj")
    points = [shapely.Point(_point(row)) if known else None for known, row in zip(tags.known, rows, strict=True)]
    footprints = [None if ring is None else shapely.Polygon(ring) for ring in _rings(tags)]
    columns = {name: pa.array([row[name] for row in rows], pa.string() if name in _TEXTS else pa.float64()) for name in rows[0]}
    about = {}
    for name, shapes, kind, crs in (
        ("geometry", points, "Point Z", _WITH_HEIGHT),
        ("footprint", footprints, "Polygon", _WITHOUT_HEIGHT),
    ):
        columns[name] = pa.array([None if shape is None else shapely.to_wkb(shape) for shape in shapes], pa.binary())
        about[name] = {"encoding": "WKB", "geometry_types": [kind], "crs": pyproj.CRS.from_user_input(crs).to_json_dict()}
        bounds = shapely.total_bounds([shape for shape in shapes if shape is not None]).tolist()
        if kind == "Point Z":
            heights = [row["sensor_height_m"] for row in rows if row["sensor_height_m"] is not None]
            bounds = [*bounds[:2], min(heights), *bounds[2:], max(heights)]
        if np.isfinite(bounds).all():
            about[name]["bbox"] = bounds
    about["footprint"]["orientation"] = "counterclockwise"
    meta = {"version": "1.1.0", "primary_column": "geometry", "columns": about}
    table = pa.table(columns).replace_schema_metadata({"geo": json.dumps(meta, allow_nan=False)})
    pq.write_table(table, path, compression="zstd")


def write_geojson(path: str | Path, tags: SensorTags, rows: list[dict[str, Any]]) -> None:
    """Write a point for every sensor position, and a polygon for every footprint, in WGS 84."""
    features = list(_features(tags, rows))
    text = json.dumps({"type": "FeatureCollection", "features": features}, allow_nan=False, indent=1)
    Path(path).write_text(text + "\n", encoding="utf-8")


def _features(tags: SensorTags, rows: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    for known, row, ring in zip(tags.known, rows, _rings(tags), strict=True):
        if not known:
            continue
        geometry: dict[str, Any] = {"type": "Point", "coordinates": _point(row)}
        yield {"type": "Feature", "properties": {"of": "sensor", **row}, "geometry": geometry}
        if ring is not None:
            what = {name: row[name] for name in ("label", "plot", "probability") if name in row}
            geometry = {"type": "Polygon", "coordinates": [ring]}
            yield {"type": "Feature", "properties": {"of": "footprint", **what}, "geometry": geometry}


def _point(row: dict[str, Any]) -> list[float]:
    return [row["sensor_longitude_deg"], row["sensor_latitude_deg"], row["sensor_height_m"]]


def _rings(tags: SensorTags) -> list[list[list[float]] | None]:
    """Return longitude, latitude [deg] of footprints, anticlockwise and closed; None for none."""
    known = np.asarray(np.isfinite(tags.footprint).all(axis=(1, 2)))
    found: list[list[list[float]] | None] = [None] * len(known)
    if not known.any():
        return found
    latitude, longitude, _ = geodetic_of(tags.footprint[known])
    rings = np.degrees(np.stack([longitude, latitude], axis=-1)).round(_DEGREES)
    x, y = np.moveaxis(rings - rings[:, :1], -1, 0)
    clockwise = (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1) < 0.0
    rings[clockwise] = rings[clockwise, ::-1]
    for k, ring in zip(np.flatnonzero(known).tolist(), np.concatenate([rings, rings[:, :1]], axis=1).tolist(), strict=True):
        found[k] = ring
    return found


def _columns(of: str, tags: Geotags, epsg: int) -> dict[str, Any]:
    latitude, longitude, height = np.full((3, len(tags.t)), np.nan)
    x, y = np.full((2, len(tags.t)), np.nan)
    known = np.isfinite(tags.ecef).all(axis=-1)
    if known.any():
        latitude[known], longitude[known], height[known] = geodetic_of(tags.ecef[known])
        x[known], y[known] = coordinates_in(epsg, tags.ecef[known])[:, :2].T
    std = np.sqrt(np.diagonal(tags.covariance, axis1=1, axis2=2))
    a, b, bearing = ellipses(tags.covariance[:, :2, :2]).T
    C = tags.covariance
    return {
        f"{of}_latitude_deg": np.degrees(latitude),
        f"{of}_longitude_deg": np.degrees(longitude),
        f"{of}_height_m": height,
        f"{of}_x_epsg_{epsg}": x,
        f"{of}_y_epsg_{epsg}": y,
        f"{of}_std_east_m": std[:, 0],
        f"{of}_std_north_m": std[:, 1],
        f"{of}_std_up_m": std[:, 2],
        f"{of}_cov_east_north_m2": C[:, 0, 1],
        f"{of}_cov_east_up_m2": C[:, 0, 2],
        f"{of}_cov_north_up_m2": C[:, 1, 2],
        f"{of}_ellipse95_long_m": a,
        f"{of}_ellipse95_short_m": b,
        f"{of}_ellipse95_bearing_deg": np.degrees(bearing),
    }


def _number(value: float, name: str) -> float | None:
    if not np.isfinite(value):
        return None
    if name.endswith("_m2"):
        return float(f"{value:.6g}")
    exact = name.endswith(("itude_deg",)) or "epsg" in name
    return round(float(value), _DEGREES if exact and name.endswith("_deg") else _METRES)
