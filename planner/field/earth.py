"""Positions on the earth: WGS 84, earth-centred, local east-north-up, and any EPSG code.

The one file that uses pyproj.

The ECEF frame is WGS 84's earth-centred, earth-fixed one (EPSG:4978). Latitudes and longitudes are
in radians, heights above the ellipsoid in metres.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from boom_model import InputError
from boom_model.arrays import Array, checked, read_only
from planner.field.extra import library

GEODETIC, GEOCENTRIC = 4979, 4978
"""EPSG codes of WGS 84 with height, and of its earth-centred frame."""
GEOGRAPHIC = 4326
_MARGIN = 1.0  # [deg] around the area where a projection is used


@cache
def reference_system(epsg: int) -> Any:
    """Return the coordinate reference system of an EPSG code, as pyproj's object.

    Raises:
        InputError: there is no such code, or its coordinates are no positions on the earth.
    """
    pyproj = library("pyproj")
    try:
        crs = pyproj.CRS.from_epsg(int(epsg))
    except pyproj.exceptions.CRSError:
        raise InputError(f"EPSG {epsg} is not known; 4326 is WGS 84, 32613 is UTM zone 13 north") from None
    if not (crs.is_geographic or crs.is_projected or crs.is_geocentric):
        raise InputError(f"EPSG {epsg} ({crs.name}) gives no positions on the earth")
    return crs


@cache
def _transformer(source: int, target: int) -> Any:
    return library("pyproj").Transformer.from_crs(reference_system(source), reference_system(target), always_xy=True)


def transform(source: int, target: int, x: ArrayLike, y: ArrayLike, z: ArrayLike) -> Array:
    """Return coordinates (..., 3) in another reference system.

    The order is x or longitude, y or latitude, height; angles are in degrees here. A height stays
    above the ellipsoid where a system has two dimensions.

    Raises:
        InputError: a code is not known, or a point cannot be transformed.
    """
    given = np.broadcast_arrays(*(np.asarray(each, dtype=float) for each in (x, y, z)))
    moved = np.stack(_transformer(source, target).transform(*given), axis=-1)
    if not np.isfinite(moved).all():
        raise InputError(f"a point cannot be transformed from EPSG {source} to EPSG {target}")
    return np.asarray(moved, dtype=float)


def datum_note(epsg: int) -> str | None:
    """Return what has to be known of a datum other than WGS 84, or None."""
    datum = reference_system(epsg).geodetic_crs.datum
    if datum is None or "World Geodetic System 1984" in datum.name:
        return None
    accuracy = float(_transformer(epsg, GEODETIC).accuracy)
    known = "an unknown error" if accuracy < 0.0 else f"an error of up to {accuracy:g} m"
    return f"EPSG {epsg} has the datum {datum.name}: its difference from WGS 84 has {known}"


def ecef_of(latitude: ArrayLike, longitude: ArrayLike, height: ArrayLike) -> Array:
    """Return ECEF positions (..., 3) [m] of latitudes, longitudes [rad] and heights [m]."""
    return transform(GEODETIC, GEOCENTRIC, np.degrees(longitude), np.degrees(latitude), height)


def geodetic_of(ecef: ArrayLike) -> tuple[Array, Array, Array]:
    """Return latitude, longitude [rad], height [m], each (...), of ECEF positions (..., 3) [m]."""
    longitude, latitude, height = np.moveaxis(transform(GEOCENTRIC, GEODETIC, *np.moveaxis(np.asarray(ecef), -1, 0)), -1, 0)
    return np.radians(latitude), np.radians(longitude), height


def ecef_from(epsg: int, x: ArrayLike, y: ArrayLike, height: ArrayLike) -> Array:
    """Return ECEF positions (..., 3) [m] of coordinates in an EPSG code; angles in degrees.

    Raises:
        InputError: the code is not known, or a point is outside the area where the system is used;
            swapped coordinates mostly are.
    """
    crs = reference_system(epsg)
    x, y, height = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float), np.asarray(height, dtype=float))
    if crs.is_geocentric:
        return transform(epsg, GEOCENTRIC, x, y, height)
    if crs.is_projected:
        _check_area(epsg, x, y)
    latitude_first = transform(epsg, GEOGRAPHIC, x, y, np.zeros(x.shape))
    return transform(GEODETIC, GEOCENTRIC, latitude_first[..., 0], latitude_first[..., 1], height)


def coordinates_in(epsg: int, ecef: ArrayLike) -> Array:
    """Return coordinates (..., 3) in an EPSG code [m, angles in deg], height above the ellipsoid.

    Raises:
        InputError: the code is not known, or a point cannot be transformed.
    """
    if reference_system(epsg).is_geocentric:
        return transform(GEOCENTRIC, epsg, *np.moveaxis(np.asarray(ecef), -1, 0))
    latitude, longitude, height = geodetic_of(ecef)
    flat = transform(GEOGRAPHIC, epsg, np.degrees(longitude), np.degrees(latitude), np.zeros(latitude.shape))
    return np.stack([flat[..., 0], flat[..., 1], height], axis=-1)


def utm_zone(latitude: float, longitude: float) -> int:
    """Return the EPSG code of the UTM zone of a position [rad]; near the poles, that of UPS."""
    pyproj = library("pyproj")
    if np.degrees(latitude) >= 84.0:
        return 32661
    if np.degrees(latitude) < -80.0:
        return 32761
    x, y = float(np.degrees(longitude)), float(np.degrees(latitude))
    area = pyproj.aoi.AreaOfInterest(x, y, x, y)
    found = pyproj.database.query_utm_crs_info(datum_name="WGS 84", area_of_interest=area)
    return int(found[0].code)


def axes(latitude: ArrayLike, longitude: ArrayLike) -> Array:
    """Return R_ecef_enu (..., 3, 3): its columns point east, north and up at a position [rad].

    R = R_z(longitude + 90 deg) R_x(90 deg - latitude)
    """
    latitude, longitude = np.broadcast_arrays(checked("latitude", latitude), checked("longitude", longitude))
    angles = np.stack([longitude + np.pi / 2.0, np.pi / 2.0 - latitude], axis=-1)
    turns: Array = Rotation.from_euler("ZX", angles.reshape(-1, 2)).as_matrix()
    return turns.reshape(*latitude.shape, 3, 3)


@dataclass(frozen=True, eq=False)
class LocalFrame:
    """East-north-up frame at an origin on the earth."""

    latitude: float
    """[rad]"""
    longitude: float
    """[rad]"""
    height: float
    """Above the ellipsoid [m]."""
    origin: Array
    """(3,) its origin in ECEF [m]"""
    R_ecef_enu: Array
    """(3, 3)"""

    @staticmethod
    def at(latitude: float, longitude: float, height: float) -> "LocalFrame":
        """Return the frame at a position [rad, rad, m]."""
        origin = ecef_of(latitude, longitude, height)
        return LocalFrame(latitude, longitude, height, read_only(origin), read_only(axes(latitude, longitude)))

    def enu(self, ecef: ArrayLike) -> Array:
        """Return east, north, up (..., 3) [m] of ECEF positions (..., 3): R^T (p - origin)."""
        moved: Array = (np.asarray(ecef, dtype=float) - self.origin) @ self.R_ecef_enu
        return moved

    def ecef(self, enu: ArrayLike) -> Array:
        """Return ECEF positions (..., 3) [m] of east, north, up (..., 3)."""
        moved: Array = self.origin + np.asarray(enu, dtype=float) @ self.R_ecef_enu.T
        return moved


def _check_area(epsg: int, x: Array, y: Array) -> None:
    crs = reference_system(epsg)
    area = crs.area_of_use
    if area is None or not x.size:
        return
    inverse = _transformer(epsg, GEOGRAPHIC)

    def outside(x: Array, y: Array) -> Array:
        longitude, latitude = (np.asarray(v) for v in inverse.transform(x, y))
        width = (area.east - area.west) % 360.0 or 360.0
        east_of = (longitude - area.west + _MARGIN) % 360.0
        away: Array = (
            ~np.isfinite(longitude)
            | ~np.isfinite(latitude)
            | (east_of > width + 2.0 * _MARGIN)
            | (latitude < area.south - _MARGIN)
            | (latitude > area.north + _MARGIN)
        )
        return away

    wrong = outside(x, y)
    if wrong.any():
        at = int(np.flatnonzero(wrong)[0])
        swapped = "; easting and northing are swapped" if not outside(y, x).any() else ""
        raise InputError(
            f"point {at + 1} at {float(x.flat[at]):.3f}, {float(y.flat[at]):.3f} is outside the area of EPSG {epsg} "
            f"({crs.name}){swapped}"
        )
