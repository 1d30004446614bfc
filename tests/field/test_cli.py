"""The commands of the field: their answers, files and refusals."""

import csv
import json

import geopandas
import numpy as np
import pyarrow.parquet as pq
import pytest
from rerun.chunk import RrdReader

from boom_model import Boom
from planner.field.earth import ecef_of
from tests.field.field_files import FRAME, joint_position, true_spots, write_field
from tests.field.motions import Drive
from tests.field.trials import TRIAL as FORTY
from tests.field.trials import corners

TRIAL = """
name = "four plots"
basis = "assumed"
source = "a test"
rows = 2
ranges = 2
plot_m = [4.0, 8.0]
alley_m = [0.5, 1.0]
height_m = 480.0
epsg = 4326
corners = [[52.13, -106.62], [52.1301, -106.6199]]
"""


@pytest.fixture
def day(boom, tmp_path):
    write_field(tmp_path, Drive())
    (tmp_path / "trial.toml").write_text(TRIAL.replace("52.1301, -106.6199", "52.13010, -106.61985"))
    return ("geotag", "vehicle.csv", "joints.csv", "triggers.csv", "--rig", "rig.toml")


def test_geotag_writes_where_the_sensor_was(boom, day, tmp_path):
    code, out, error = boom(*day, "--plots", "trial.toml", "--out", "tags.csv", "--geojson", "tags.geojson")
    assert (code, error) == (0, "")
    assert len(out.splitlines()) <= 24
    assert max(map(len, out.splitlines())) <= 80
    assert "triggers.csv: 79 triggers, 79 tagged" in out
    rows = list(csv.DictReader((tmp_path / "tags.csv").read_text().splitlines()))
    stamps = np.array([float(row["utc"]) for row in rows]) - 1.7830e9
    place = [np.radians([float(row[f"sensor_{name}_deg"]) for row in rows]) for name in ("latitude", "longitude")]
    found = FRAME.enu(ecef_of(*place, [float(row["sensor_height_m"]) for row in rows]))
    true, _ = true_spots(Boom.load(), Drive(), stamps, joint_position(stamps - 0.02))
    sag = np.array([float(row["sag_m"]) for row in rows])
    assert np.linalg.norm(found - true, axis=-1).max() < 1.5 * sag.max() + 1e-3  # the true arm here is rigid
    assert np.abs(found - true + np.outer(sag, [0.0, 0.0, 1.0]))[:, 2].max() < 1e-3
    features = json.loads((tmp_path / "tags.geojson").read_text())["features"]
    assert {feature["properties"]["of"] for feature in features} == {"sensor", "footprint"}
    assert len(features) == 2 * 79


def test_geoparquet_is_read_by_geopandas(boom, day, tmp_path):
    """The same tags as in the CSV, with a trigger that has none."""
    triggers = (tmp_path / "triggers.csv").read_text()
    (tmp_path / "triggers.csv").write_text(triggers + "\n1783009999.0,late")
    for name in ("tags.parquet", "tags.csv"):
        assert boom(*day, "--plots", "trial.toml", "--out", name)[0] == 0
    frame = geopandas.read_parquet(tmp_path / "tags.parquet")
    rows = list(csv.DictReader((tmp_path / "tags.csv").read_text().splitlines()))
    assert list(frame.columns[:-2]) == list(rows[0])
    assert len(frame) == len(rows) == 80
    assert frame.crs.to_authority() == ("OGC", "CRS84h")
    assert frame.set_geometry("footprint").crs.to_authority() == ("OGC", "CRS84")
    last = frame.iloc[-1]
    assert (last.geometry, last.footprint, last.label) == (None, None, "late")
    assert "after vehicle.csv ends" in last.reason
    for k, row in enumerate(rows[:-1]):
        place = [float(row[f"sensor_{name}"]) for name in ("longitude_deg", "latitude_deg", "height_m")]
        assert frame.geometry[k].coords[0] == pytest.approx(place, abs=1e-9)
        assert frame.footprint[k].exterior.is_ccw
        assert frame.probability[k] == float(row["probability"])
    # In metres of the UTM zone, geopandas is where the columns say.
    utm = frame.iloc[:-1].to_crs(32613).geometry
    assert utm.x.to_numpy() == pytest.approx(frame.sensor_x_epsg_32613[:-1].to_numpy(), abs=1e-3)
    meta = json.loads(pq.read_schema(tmp_path / "tags.parquet").metadata[b"geo"])
    assert (meta["version"], meta["primary_column"]) == ("1.1.0", "geometry")
    west, south, low, east, north, high = meta["columns"]["geometry"]["bbox"]
    assert [west, south, east, north] == pytest.approx(frame.total_bounds)
    assert low <= frame.sensor_height_m.min() <= frame.sensor_height_m.max() <= high


def test_geotag_records_boom_plots_and_map(boom, day, tmp_path):
    code, out, _ = boom(*day, "--plots", "trial.toml", "--recording", "tags.rrd")
    assert (code, "recording: tags.rrd" in out) == (0, True)
    entities = set(RrdReader(tmp_path / "tags.rrd").store().schema().entity_paths())
    assert {"/world/plots", "/world/spots", "/world/mount", "/map/plots", "/map/sensor", "/reading"} <= entities


def test_geotag_json(boom, day):
    code, out, _ = boom(*day, "--plots", "trial.toml", "--json", "--to-epsg", "32613")
    answer = json.loads(out)
    assert (code, answer["epsg"], len(answer["tags"])) == (0, 32613, 79)
    assert answer["tags"][0]["sensor_x_epsg_32613"] == pytest.approx(389_000.0, abs=2000.0)
    assert 0.0 <= answer["tags"][0]["probability"] <= 1.0
    assert any("assumed" in note for note in answer["notes"])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("rig.toml", "std_m = 0.003", "std_m = -1"), "rig.toml: key antenna.std_m"),
        (("rig.toml", "[ground]", "[groud]"), "rig.toml: key ground is missing; key groud is not known"),
        (("vehicle.csv", "latitude_deg,longitude_deg", "longitude_deg,latitude_deg"), "swapped"),
        (("joints.csv", "utc,", "t,"), "give all one clock"),
        (("trial.toml", "-106.62]", "-10.62]"), "check their order and the sizes"),
        (("trial.toml", "[[52.13, -106.62], [52.13010", "[[12.13, -106.62], [12.13010"), "km from the plots"),
    ],
)
def test_geotag_refuses(change, message, boom, day, tmp_path):
    name, old, new = change
    text = (tmp_path / name).read_text()
    assert old in text
    (tmp_path / name).write_text(text.replace(old, new))
    code, out, error = boom(*day, "--plots", "trial.toml", "--out", "tags.csv")
    assert (code, out) == (2, "")
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "tags.csv").exists()


def test_plots(boom, day, tmp_path):
    code, out, error = boom(
        "plots", "trial.toml", "--out", "plots.shp", "--picture", "p.png", "--at", "52.13,-106.62", "--std", "0.1"
    )
    assert (code, error) == (0, "")
    assert "4 plots, 2 rows x 2 ranges, 128.0 m^2" in out
    assert len(out.splitlines()) <= 24
    assert {path.suffix for path in tmp_path.glob("plots.*")} == {".cpg", ".dbf", ".prj", ".shp", ".shx"}
    assert boom("plots", "plots.shp", "--out", "plots.gpkg")[0] == 0
    for name in ("plots.shp", "plots.gpkg"):
        code, out, _ = boom("plots", name, "--json")
        assert [plot["plot"] for plot in json.loads(out)["plots"]] == ["1-1", "1-2", "2-1", "2-2"]


def test_a_corner_is_a_quarter_of_the_plot(boom, day, tmp_path):
    """At the corner of a box, an error much smaller than the box puts the point on it in a quarter
    of cases."""
    boom("plots", "trial.toml", "--out", "plots.geojson")
    x, y = json.loads((tmp_path / "plots.geojson").read_text())["features"][0]["geometry"]["coordinates"][0][0]
    _, out, _ = boom("plots", "trial.toml", "--json", "--at", f"{y:.10f},{x:.10f}", "--std", "0.05")
    (point,) = json.loads(out)["points"]
    assert (point["plot"], point["probability"]) == ("1-1", pytest.approx(0.25, abs=1e-3))


@pytest.mark.parametrize("arguments", [("no.toml",), ("trial.gpkg",), ("trial.toml", "--at", "106,52")])
def test_plots_refuses(arguments, boom, day):
    code, _, error = boom("plots", *arguments)
    assert code == 2
    assert error.startswith("boom: ")


def test_scan(boom, tmp_path):
    (tmp_path / "trial.toml").write_text(FORTY.format(corners=np.degrees(corners()).tolist()))
    asked = ("scan", "trial.toml", "--footprint", "0.5,0.5", "--profile", "cubic")
    code, out, error = boom(*asked, "--mission", "scan.toml", "--out", "scan.geojson", "--picture", "scan.png")
    assert (code, error) == (0, "")
    assert len(out.splitlines()) <= 24
    assert "40 plots, 80 stops, 3 lines a plot" in out
    assert "the track crosses" in out
    properties = json.loads((tmp_path / "scan.geojson").read_text())["features"][0]["properties"]
    assert properties["coverage"] >= 0.99
    code, out, _ = boom(*asked, "--json", "--speed", "0.5")
    answer = json.loads(out)
    assert code == 0
    assert min(plot["coverage"] for plot in answer["plots"]) >= 0.99
    code, out, error = boom(*asked, "--speed", "0.5", "--offset", "2.2")
    assert code == 1
    assert "40 of 40 plots are not reached whole" in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(("options", "code", "message"), [
    (("--footprint", "0.5"), 2, "has 1 number; it needs 2"),
    (("--footprint", "0,0.5"), 2, "footprint is 0 m"),
    (("--footprint", "0.5,0.5", "--speed", "3"), 1, "1.8 m/s is the fastest"),
    (("--footprint", "0.5,0.5", "--offset", "9"), 1, "no plot can be reached"),
])  # fmt: skip
def test_scan_refuses(options, code, message, boom, tmp_path):
    (tmp_path / "trial.toml").write_text(FORTY.format(corners=np.degrees(corners()).tolist()))
    given, _, error = boom("scan", "trial.toml", *options)
    assert (given, error.count("\n")) == (code, 1)
    assert message in error
