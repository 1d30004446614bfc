"""Plot maps: layout, files there and back, and the probability of a plot against samples."""

import json

import numpy as np
import pyogrio
import pytest
import shapely
from geographiclib.geodesic import Geodesic
from scipy.stats import multivariate_normal, norm

from boom_model import InputError
from planner.field.earth import coordinates_in, ecef_of
from planner.field.plot_files import FORMS, read_plots, write_plots
from planner.field.plots import PlotMap, lay_out, locate, require_near, shares
from planner.field.polygons import probability
from tests.field.trials import TRIAL, corners, trial


@pytest.mark.parametrize(("count", "side"), [(2, 1.0), (3, 1.0), (4, 1.0), (3, -1.0), (4, -1.0)])
def test_layout_meets_the_corners(count, side):
    plots, off = trial(count, side=side)
    assert off < 1e-4  # up of the corners is not 0 over 20 m of round earth
    assert len(plots.names) == 40
    assert [polygon.area for polygon in plots.polygons] == pytest.approx([1.2 * 3.6] * 40, rel=1e-6)
    # The last plot of row 1 ends at the second corner; geographiclib measures its long side on the
    # ground.
    last = plots.rings[plots.names.index("1-4")][0]
    a, b = np.degrees(last[0]), np.degrees(last[1])
    side_on_ellipsoid = Geodesic.WGS84.Inverse(*a, *b)["s12"]
    assert side_on_ellipsoid * (1.0 + 480.0 / 6.38e6) == pytest.approx(3.6, abs=1e-5)
    gap = np.linalg.norm(ecef_of(*last[1], 480.0) - ecef_of(*corners()[1], 480.0))
    assert gap < 1e-4
    # Rows follow each other at 1.5 m, plots of a row at 5.1 m.
    middles = np.array([polygon.centroid.coords[0] for polygon in plots.polygons]).reshape(10, 4, 2)
    assert np.linalg.norm(np.diff(middles, axis=0), axis=-1) == pytest.approx(np.full((9, 4), 1.5), abs=1e-5)
    assert np.linalg.norm(np.diff(middles, axis=1), axis=-1) == pytest.approx(np.full((10, 3), 5.1), abs=1e-5)


def test_wrong_corners_are_refused():
    with pytest.raises(InputError, match="check their order and the sizes"):
        lay_out(corners()[[0, 2, 1, 3]], 10, 4, (1.2, 3.6), (0.3, 1.5))
    with pytest.raises(InputError, match="5 corners; it needs 2 to 4"):
        lay_out(np.zeros((5, 2)), 10, 4, (1.2, 3.6), (0.3, 1.5))


@pytest.mark.parametrize("form", FORMS)
def test_files_there_and_back(form, tmp_path):
    plots, _ = trial()
    place = tmp_path / f"plots{form}"
    write_plots(plots, place, {"coverage": [0.5] * 40})
    again = read_plots(place)
    assert again.names == plots.names
    assert (again.rows, again.ranges) == (plots.rows, plots.ranges)
    for ours, theirs in zip(plots.polygons, again.at_height(480.0).polygons, strict=True):
        assert ours.symmetric_difference(theirs).area < 1e-3 * 3.6


def test_geopackage_as_qgis_writes_it(tmp_path):
    """Multipolygons in UTM with heights, numbers with a blank as names, beside a table and a layer
    of points."""
    plots, _ = trial()
    place = tmp_path / "field.gpkg"
    rings = [coordinates_in(32613, ecef_of(*plot[0].T, 480.0)) for plot in plots.rings[:3]]
    assert rings[0].shape == (4, 3)
    shapes = shapely.to_wkb([shapely.MultiPolygon([shapely.Polygon(ring)]) for ring in rings])
    pyogrio.raw.write(
        place, shapes, [np.array([101, 102, 103])], ["plot_id"], layer="trial", driver="GPKG", geometry_type="MultiPolygon Z",
        crs="EPSG:32613",
    )  # fmt: skip
    pyogrio.raw.write(
        place, shapely.to_wkb([shapely.Point(4e5, 5.7e6)]), [np.array(["gate"], dtype=object)], ["what"], layer="gates",
        driver="GPKG", geometry_type="Point", crs="EPSG:32613", append=True,
    )  # fmt: skip
    again = read_plots(place)
    assert again.names == ("101", "102", "103")
    for ours, theirs in zip(plots.rings, again.rings, strict=False):
        assert np.abs(ours[0] - theirs[0]).max() < 1e-12 * np.pi
    with pytest.raises(InputError, match="it is EPSG 32613, and 32614 was given"):
        read_plots(place, 32614)


def test_layers_that_are_not_told_apart_are_refused(tmp_path):
    place = tmp_path / "field.gpkg"
    square = shapely.to_wkb([shapely.box(0.0, 0.0, 1e-4, 1e-4)])
    for name in ("wheat", "barley"):
        pyogrio.raw.write(
            place, square, [], [], layer=name, driver="GPKG", geometry_type="Polygon", crs="EPSG:4326", append=True
        )
    with pytest.raises(InputError, match="its layers of polygons are wheat, barley; it needs one of polygons"):
        read_plots(place)


@pytest.mark.parametrize("form", [".gpkg", ".shp"])
def test_files_of_gdal_that_are_cut_or_changed_are_refused_in_a_line(form, tmp_path):
    write_plots(trial()[0], tmp_path / f"whole{form}")
    data, random, messages = (tmp_path / f"whole{form}").read_bytes(), np.random.default_rng(5), []
    for k in range(60):
        at = int(random.integers(len(data)))
        changed = data[:at] if k % 2 else data[:at] + bytes(random.integers(0, 256, 64, dtype=np.uint8)) + data[at + 64 :]
        (tmp_path / f"whole{form}").write_bytes(changed)
        try:
            read_plots(tmp_path / f"whole{form}")
        except InputError as error:
            messages.append(str(error))
    assert len(messages) > 15
    assert not [text for text in messages if "\n" in text or len(text) > 400]


def test_a_trial_in_utm_is_the_same(tmp_path):
    geographic, projected = tmp_path / "a.toml", tmp_path / "b.toml"
    there = corners()
    geographic.write_text(TRIAL.format(corners=np.degrees(there).tolist()))
    utm = coordinates_in(32613, ecef_of(there[:, 0], there[:, 1], 0.0))[:, :2]
    projected.write_text(TRIAL.format(corners=utm.tolist()) + "epsg = 32613\n")
    a, b = read_plots(geographic), read_plots(projected)
    assert any("assumed" in note for note in a.notes)
    for ours, theirs in zip(a.polygons, b.polygons, strict=True):
        assert ours.symmetric_difference(theirs).area < 1e-4


def test_geojson_is_as_rfc_7946_says(tmp_path):
    """Longitude first, the outer ring anticlockwise and closed."""
    plots, _ = trial()
    write_plots(plots, tmp_path / "plots.geojson")
    ring = json.loads((tmp_path / "plots.geojson").read_text())["features"][0]["geometry"]["coordinates"][0]
    assert ring[0] == ring[-1]
    assert ring[0][0] == pytest.approx(-106.62, abs=1e-3)
    assert shapely.LinearRing(ring).is_ccw


# Probability


def test_probability_of_a_box_is_a_product():
    box = np.array([[-1.0, -0.5], [2.0, -0.5], [2.0, 0.7], [-1.0, 0.7]])
    means = np.random.default_rng(1).uniform(-3.0, 3.0, (50, 2))
    std = np.array([0.6, 0.25])
    exact = (norm.cdf((2.0 - means[:, 0]) / std[0]) - norm.cdf((-1.0 - means[:, 0]) / std[0])) * (
        norm.cdf((0.7 - means[:, 1]) / std[1]) - norm.cdf((-0.5 - means[:, 1]) / std[1])
    )
    found = probability([box], means, np.tile(np.diag(std**2), (50, 1, 1)))
    assert found == pytest.approx(exact, abs=1e-9)


def test_probability_of_a_quadrant_under_correlation():
    """Sheppard's 1/4 + asin(rho) / 2 pi; the box reaches far enough."""
    far = np.array([[0.0, 0.0], [60.0, 0.0], [60.0, 60.0], [0.0, 60.0]])
    for rho in (-0.9, -0.3, 0.0, 0.5, 0.95):
        found = probability([far], np.zeros((1, 2)), np.array([[[1.0, rho], [rho, 1.0]]]))
        assert found[0] == pytest.approx(0.25 + np.arcsin(rho) / (2.0 * np.pi), abs=1e-6)


def test_probability_with_hole_and_notch_equals_samples():
    random = np.random.default_rng(2)
    outer = np.array([[0, 0], [4, 0], [4, 3], [2, 1], [0, 3]], dtype=float)
    hole = np.array([[0.5, 0.3], [1.0, 0.3], [1.0, 0.8], [0.5, 0.8]])
    shape = shapely.Polygon(outer, [hole])
    for mean in ([1.0, 1.0], [2.0, 1.5], [3.9, 2.8]):
        cov = np.array([[0.5, 0.2], [0.2, 0.3]])
        samples = multivariate_normal(mean, cov).rvs(200_000, random_state=random)
        share = shapely.contains_xy(shape, *samples.T).mean()
        assert probability([outer, hole], np.array([mean]), cov[None])[0] == pytest.approx(share, abs=4e-3)


def test_without_error_it_is_inside_or_not():
    plots, _ = trial()
    middles = np.array([polygon.centroid.coords[0] for polygon in plots.polygons])
    found = locate(plots, middles, np.zeros((40, 2, 2)))
    assert list(found.plot) == list(range(40))
    assert found.probability == pytest.approx(np.ones(40), abs=1e-9)
    nowhere = locate(plots, np.array([[500.0, 0.0], [np.nan, 0.0]]), np.zeros((2, 2, 2)))
    assert list(nowhere.plot) == [-1, -1]
    assert nowhere.outside[0] == 1.0
    assert np.isnan(nowhere.outside[1])


def test_probabilities_are_calibrated():
    """Of points said to be on their plot with a probability in a band, that share is on it (a
    reliability diagram)."""
    plots, random, n = trial()[0], np.random.default_rng(3), 20_000
    west, south, east, north = shapely.MultiPolygon(plots.polygons).bounds
    true = random.uniform([west - 1.0, south - 1.0], [east + 1.0, north + 1.0], (n, 2))
    half = random.normal(0.0, 0.25, (n, 2, 2))
    covariance = half @ np.swapaxes(half, -1, -2) + 0.05**2 * np.eye(2)
    measured = true + np.einsum("nij,nj->ni", np.linalg.cholesky(covariance), random.normal(size=(n, 2)))
    found = locate(plots, measured, covariance)
    on = found.plot >= 0
    hit = np.zeros(n, dtype=bool)
    for i, polygon in enumerate(plots.polygons):
        mine = found.plot == i
        hit[mine] = shapely.contains_xy(polygon, *true[mine].T)
    for low in np.arange(0.1, 1.0, 0.1):
        band = on & (found.probability >= low) & (found.probability < low + 0.1 + 1e-9)
        expected = found.probability[band].mean()
        assert band.sum() > 150
        assert abs(hit[band].mean() - expected) < 4.0 * np.sqrt(expected * (1.0 - expected) / band.sum()) + 0.005


def test_share_of_a_footprint():
    plots, _ = trial(angle=0.0)
    box = shapely.Polygon(plots.polygons[0])
    _, south, east, north = box.bounds
    footprint = np.array([[east - 0.5, south], [east + 0.5, south], [east + 0.5, north], [east - 0.5, north]])
    assert shares(plots, footprint) == pytest.approx({"1-1": 0.5}, abs=1e-3)


# What is refused


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda f: f.clear(), "no plot"),
        (lambda f: f[1]["properties"].update(plot="1-1"), "two plots bear the name '1-1'"),
        (lambda f: f[0]["geometry"].update(type="Point"), "feature 1 is no polygon"),
        (lambda f: f[0]["geometry"].update(coordinates=[[[1, 2], [3, 4]]]), "fewer than four points"),
        (lambda f: f[0]["geometry"].update(coordinates="x"), "malformed"),
        (lambda f: f[0]["geometry"]["coordinates"][0].reverse() or _cross(f), "no simple polygon"),
        (lambda f: f[1].update(geometry=f[0]["geometry"]), "overlap by 4"),
        (lambda f: [p.reverse() for p in f[0]["geometry"]["coordinates"][0]], "latitude and longitude are swapped"),
    ],
)
def test_refused_geojson(change, message, tmp_path):
    place = tmp_path / "plots.geojson"
    write_plots(trial()[0], place)
    data = json.loads(place.read_text())
    change(data["features"])
    place.write_text(json.dumps(data))
    with pytest.raises(InputError, match=message):
        read_plots(place)


def _cross(features):
    ring = features[0]["geometry"]["coordinates"][0]
    ring[1], ring[2] = ring[2], ring[1]


def test_logs_far_from_the_plots_are_refused():
    plots, _ = trial()
    latitude, longitude = corners()[0]
    require_near(plots, np.array([latitude]), np.array([longitude]), "log")
    with pytest.raises(InputError, match=r"log is .* km from the plots"):
        require_near(plots, np.array([0.5]), np.array([longitude]), "log")
    swapped = PlotMap.of(["a"], [[np.array([[0.1, 0.8], [0.1, 0.800001], [0.100001, 0.8]])]])
    with pytest.raises(InputError, match="swapped in one of them"):
        require_near(swapped, np.array([0.8]), np.array([0.1]), "log")
