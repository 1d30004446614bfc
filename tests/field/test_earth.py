"""Positions on the earth against EPSG's example, pymap3d and geographiclib."""

import numpy as np
import pymap3d
import pytest
from geographiclib.geodesic import Geodesic

from boom_model import InputError
from planner.field import earth

# Where, and why there: Saskatoon, south, the antimeridian, a border of UTM zones, the two poles,
# the equator.
PLACES = {
    "Saskatoon": (52.13, -106.62),
    "Tasmania": (-42.9, 147.3),
    "antimeridian": (-17.0, 179.999),
    "zone border": (52.0, -108.0),
    "north pole": (89.99, 15.0),
    "south pole": (-89.99, -120.0),
    "equator": (0.0, 0.0),
}


TOPOCENTRIC = np.array([-189013.869, -128642.040, -4220.171])  # U, V, W, as printed


def test_epsg_9836_example():
    """IOGP Guidance Note 7-2, geocentric to topocentric; printed to a millimetre, the origin to a
    tenth of one."""
    frame = earth.LocalFrame.at(np.radians(55.0), np.radians(5.0), 200.0)
    assert frame.origin == pytest.approx([3652755.3058, 319574.6799, 5201547.3536], abs=6e-5)
    ecef = np.array([3771793.968, 140253.342, 5124304.349])
    assert frame.enu(ecef) == pytest.approx(TOPOCENTRIC, abs=1e-3)
    assert frame.ecef(TOPOCENTRIC) == pytest.approx(ecef, abs=1e-3)


def test_epsg_9837_example():
    """The same note, geographic to topocentric: 53 deg 48' 33.820" N, 2 deg 7' 46.380" E, 73.0
    m."""
    frame = earth.LocalFrame.at(np.radians(55.0), np.radians(5.0), 200.0)
    latitude, longitude = np.radians(53 + 48 / 60 + 33.82 / 3600), np.radians(2 + 7 / 60 + 46.38 / 3600)
    assert frame.enu(earth.ecef_of(latitude, longitude, 73.0)) == pytest.approx(TOPOCENTRIC, abs=1e-3)
    found = earth.geodetic_of(frame.ecef(TOPOCENTRIC))
    assert found[2] == pytest.approx(73.0, abs=1e-3)
    assert np.abs(np.subtract(found[:2], [latitude, longitude])).max() < 1e-3 / 6.4e6  # 1 mm


@pytest.mark.parametrize("place", PLACES)
def test_local_frame_equals_pymap3d_within_a_kilometre(place):
    latitude, longitude = PLACES[place]
    frame = earth.LocalFrame.at(np.radians(latitude), np.radians(longitude), 480.0)
    points = np.random.default_rng(1).uniform(-700.0, 700.0, (200, 3))
    ecef = frame.ecef(points)
    assert np.stack(pymap3d.enu2ecef(*points.T, latitude, longitude, 480.0), axis=-1) == pytest.approx(ecef, abs=1e-8)
    found = earth.geodetic_of(ecef)
    theirs = pymap3d.geodetic2enu(np.degrees(found[0]), np.degrees(found[1]), found[2], latitude, longitude, 480.0)
    assert np.stack(theirs, axis=-1) == pytest.approx(points, abs=1e-6)
    assert frame.enu(earth.ecef_of(*found)) == pytest.approx(points, abs=1e-6)


def test_within_metres_of_a_pole_heights_are_right_to_three_micrometres():
    """PROJ takes the height from Z alone there."""
    frame = earth.LocalFrame.at(np.radians(-90.0), 0.0, 480.0)
    points = np.random.default_rng(2).uniform(-7.0, 7.0, (200, 3))
    assert frame.enu(earth.ecef_of(*earth.geodetic_of(frame.ecef(points)))) == pytest.approx(points, abs=5e-6)


@pytest.mark.parametrize("place", PLACES)
def test_horizontal_distance_and_azimuth_equal_geographiclib(place):
    """On the ellipsoid, a point's distance along the geodesic and its azimuth; chord and arc differ
    by s^3 / 24 R^2."""
    latitude, longitude = PLACES[place]
    for azimuth in np.arange(0.0, 360.0, 30.0):
        there = Geodesic.WGS84.Direct(latitude, longitude, azimuth, 100.0)
        frame = earth.LocalFrame.at(np.radians(latitude), np.radians(longitude), 0.0)
        ecef = earth.ecef_of(np.radians(there["lat2"]), np.radians(there["lon2"]), 0.0)
        east, north, _ = frame.enu(ecef)
        assert np.linalg.norm(ecef - frame.origin) == pytest.approx(100.0, abs=1e-6)
        across = east * np.cos(np.radians(azimuth)) - north * np.sin(np.radians(azimuth))
        assert across == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(("place", "epsg"), [("Saskatoon", 32613), ("Tasmania", 32755), ("antimeridian", 32760),
                                             ("north pole", 32661), ("south pole", 32761)])  # fmt: skip
def test_utm_zone_and_the_way_there_and_back(place, epsg):
    latitude, longitude = np.radians(PLACES[place])
    assert earth.utm_zone(latitude, longitude) == epsg
    ecef = earth.ecef_of(latitude, longitude, 480.0)
    x, y, height = earth.coordinates_in(epsg, ecef)
    assert height == pytest.approx(480.0, abs=1e-6)
    assert earth.ecef_from(epsg, x, y, height) == pytest.approx(ecef, abs=1e-6)


def test_central_meridian_of_a_utm_zone():
    """On the central meridian the easting is 500 km, and the northing 0.9996 of the
    meridian's arc."""
    ecef = earth.ecef_of(np.radians(52.0), np.radians(-105.0), 0.0)
    x, y, _ = earth.coordinates_in(32613, ecef)
    assert x == pytest.approx(500_000.0, abs=1e-6)
    assert y == pytest.approx(0.9996 * Geodesic.WGS84.Inverse(0.0, -105.0, 52.0, -105.0)["s12"], abs=1e-6)


@pytest.mark.parametrize(
    ("epsg", "x", "y", "message"),
    [
        (32613, 5_770_000.0, 400_000.0, "easting and northing are swapped"),
        (32613, 4e5, 9e6, "outside the area of EPSG 32613"),
        (999999, 4e5, 5e6, "EPSG 999999 is not known"),
        (5773, 4e5, 5e6, "gives no positions on the earth"),
    ],
)
def test_refused(epsg, x, y, message):
    with pytest.raises(InputError, match=message):
        earth.ecef_from(epsg, x, y, 0.0)


def test_another_datum_is_noted():
    assert earth.datum_note(32613) is None
    assert "NAD83" in earth.datum_note(2957) or "North American" in earth.datum_note(2957)
