"""The design of a link as a job: the thesis's link and its saving, files, the command, the
recording."""

import json
import subprocess
import sys
from dataclasses import replace

import ezdxf
import numpy as np
import pytest

from boom_model import Body, Boom, inverse_dynamics
from boom_model.drives.catalogue import CATALOGUE_FILE
from boom_model.link_design import Beam, Material, link_body, load_link, thesis_design
from boom_model.link_design.link import LINKS_FILE
from boom_model.link_design.thesis_method import THESIS_LOAD
from planner import plan
from planner.links.convergence import study
from planner.links.design import default_moves, design_link
from planner.links.files import COLUMNS, write_boom, write_contour, write_outline, write_stations
from planner.links.picture import write_link_picture
from planner.links.report import to_json, to_markdown
from planner.links.task import LinkTask
from planner.recording import write_link_recording
from planner.validation.tables import table_3_1_motion
from tests.recordings import recorded_entities

BOOM = Boom.load()
OPTIMISED = Body(
    5.55, np.array([0.3627, 0.0014, 0.0]), np.array([[0.014, 0.0, -0.001], [0.0, 0.486, 0.0], [-0.001, 0.0, 0.477]])
)


@pytest.fixture(scope="module")
def old():
    return design_link(BOOM, LinkTask(load="thesis", method="thesis"), default_moves(BOOM, LinkTask(load="thesis")))


@pytest.fixture(scope="module")
def new():
    move = plan(BOOM, "transport", "phenotyping", duration=5.0).trajectory
    return design_link(BOOM, LinkTask(slices=200), [move])


def test_the_thesis_contour_and_the_fittings_are_the_thesis_link(old):
    assert old.body.mass == pytest.approx(OPTIMISED.mass, abs=5e-5)
    np.testing.assert_allclose(old.body.com, OPTIMISED.com, atol=1e-6)
    np.testing.assert_allclose(old.body.inertia, OPTIMISED.inertia, atol=1e-6)


def test_joint_2_saves_what_figure_3_25_shows(old):
    t = np.linspace(0.0, 5.0, 501)
    q, qd, qdd, _ = table_3_1_motion(BOOM)(t)
    before, after = (inverse_dynamics(b, q, qd, qdd, payload_as="force").tau[:, 1] for b in (BOOM, old.after))
    saved = 100.0 * (1.0 - after / before)
    assert (saved.min(), saved.max()) == pytest.approx((10.98, 11.71), abs=0.01)


def test_a_body_of_plates_is_that_of_its_boxes():
    beam = Beam(1.0, 0.01, Material.load("steel"), slices=400)
    link = replace(load_link(BOOM, "inner"), fittings=None, designed=(0.0, 1.0))
    H = np.full(401, 0.06)
    body = link_body(link, beam, H)
    m = 7950.0 * 0.01 * 0.06
    apart = (link.spacing / 2.0) ** 2 + 0.005**2 / 12.0
    assert body.mass == pytest.approx(m, rel=1e-12)
    np.testing.assert_allclose(body.com, [0.5, 0.0, 0.0], atol=1e-12)
    expected = m * np.array([0.06**2 / 12.0 + apart, 1.0 / 12.0 + apart, (1.0 + 0.06**2) / 12.0])
    np.testing.assert_allclose(body.inertia, np.diag(expected), rtol=1e-9, atol=1e-12)
    # The extension's beam ends where its frame stands, and lies against its frame's z.
    rod = link_body(replace(link, name="extension"), beam, H)
    np.testing.assert_allclose(rod.com, [0.0, 0.0, -0.5], atol=1e-12)
    np.testing.assert_allclose(np.diag(rod.inertia), expected[[1, 2, 0]], rtol=1e-9)
    crossed = link_body(replace(link, cross_plates=3), beam, H)
    assert crossed.mass - body.mass == pytest.approx(3 * 7950.0 * 0.005 * 0.06 * (link.spacing - 0.005), rel=1e-12)


def test_a_designed_link_is_held_by_its_own_checks(new):
    names = {c.model: c for c in new.checks}
    assert names["Timoshenko beam"].deflection == pytest.approx(0.01, rel=1e-3)
    assert names["plane stress"].deflection <= 0.01 * 1.001
    assert all(c.stress <= 175e6 for c in new.checks)
    assert new.stress_check.by_elements == pytest.approx(new.stress_check.own, rel=9e-3)
    assert new.mass < 0.6 * 3.72
    assert 0.0 <= new.exact.gap <= 1e-10
    assert new.tapered_load >= 2.0 * new.pressed * (1.0 - 1e-5)
    least, most = new.saved
    assert 0.12 < least < most < 0.16


def test_largest_components_weigh_more_than_every_instant(new):
    task = replace(new.task, largest_components=True)
    assert design_link(BOOM, task, new.trajectories).mass > new.mass


@pytest.mark.parametrize("name", ["lower", "outer", "extension"])
def test_every_link_can_be_designed(new, name):
    found = design_link(BOOM, LinkTask(link=name, slices=60, material="aluminium"), new.trajectories)
    assert found.own_deflection <= 0.01 * (1.0 + 1e-5)
    assert found.max_stress <= 138e6 * (1.0 + 1e-5)
    assert found.tapered_load >= 2.0 * found.pressed * (1.0 - 1e-4)
    assert any("fittings of this link are unknown" in note for note in found.notes)


def test_assumed_material_is_said_to_be(new):
    found = design_link(BOOM, replace(new.task, material="cfrp", slices=60), new.trajectories)
    assert any(note.startswith("material cfrp (assumed)") for note in found.notes)


def test_picture_report_and_json_share_one_convergence_study(new):
    assert study(new) is study(new)


def test_convergence_studies(old, new):
    by_thesis, by_optimum = study(old), study(new)
    for found in (by_thesis, by_optimum):
        errors = np.abs(found.slices[:-1, 1] - found.slices[-1, 1])
        assert (np.diff(errors) < 0.0).all()
        assert errors[-1] < 2e-3 * found.slices[-1, 1]
    assert by_optimum.steps is None
    assert (by_thesis.steps[:, 1] > by_thesis.stepless).all()
    excess = by_thesis.steps[[0, 3, 6], 1] / by_thesis.stepless - 1.0
    assert excess[0] - excess[1] > 20.0 * (excess[1] - excess[2]) > 0.0
    assert len(by_optimum.deflections) == 4
    assert by_optimum.deflections["Timoshenko beam"][-1, 1] == pytest.approx(0.01, rel=1e-3)
    last = by_thesis.stresses[:, 1:]
    np.testing.assert_allclose(last[-1, 1:4], np.interp([0.3, 0.5, 0.7], old.beam.stations, old.stress), rtol=8e-3)
    assert (np.abs(np.diff(last, axis=0)[-1]) < np.abs(np.diff(last, axis=0)[0])).all()


def test_files_hold_the_design(old, tmp_path):
    write_contour(tmp_path / "c.txt", old)
    curve = np.loadtxt(tmp_path / "c.txt")
    np.testing.assert_allclose(curve, np.stack([old.beam.stations, old.heights / 2.0, np.zeros(1001)], axis=-1), atol=1e-9)
    write_stations(tmp_path / "s.csv", old)
    lines = (tmp_path / "s.csv").read_text().splitlines()
    assert lines[0].split(",") == list(COLUMNS)
    table = np.loadtxt(tmp_path / "s.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(table[:, 8], old.stress, rtol=1e-8)
    np.testing.assert_allclose(table[0, 4] * 12.0 / table[0, 2], table[0, 1] ** 3, rtol=1e-6)
    write_outline(tmp_path / "o.dxf", old)
    drawing = ezdxf.readfile(tmp_path / "o.dxf")
    (outline,) = drawing.modelspace().query("LWPOLYLINE")
    points = np.array([p[:2] for p in outline.get_points()])
    x, y = points.T
    area = abs(x @ np.roll(y, 1) - y @ np.roll(x, 1)) / 2.0
    assert outline.closed
    assert drawing.units == ezdxf.units.MM
    assert area * 1e-6 == pytest.approx(np.trapezoid(old.heights, old.beam.stations), rel=1e-9)


def test_the_boom_with_the_new_link_is_the_old_one_but_for_it(old, tmp_path):
    write_boom(tmp_path / "new.toml", None, old)
    read = Boom.load(tmp_path / "new.toml")
    body = read.bodies["inner"]
    assert body.mass == pytest.approx(old.body.mass, abs=1e-6)
    np.testing.assert_allclose(body.inertia, old.body.inertia, atol=1e-9)
    assert read.bodies["outer"].mass == BOOM.bodies["outer"].mass
    assert "# designed: thesis method" in (tmp_path / "new.toml").read_text()
    peaks = [plan(b, "transport", "phenotyping", duration=5.0).report.peaks[1].total for b in (BOOM, read)]
    assert 0.10 < 1.0 - peaks[1] / peaks[0] < 0.13


def test_picture_and_recording(new, tmp_path):
    write_link_picture(tmp_path / "p.png", new)
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")
    write_link_recording(tmp_path / "r.rrd", new)
    verified = subprocess.run(
        [sys.executable, "-m", "rerun", "rrd", "verify", tmp_path / "r.rrd"], capture_output=True, check=False
    )
    assert verified.returncode == 0
    assert {"/world/boom/inner/plates", "/plots/torque/inner", "/picture", "/report"} <= recorded_entities(tmp_path / "r.rrd")


def test_the_command_as_json(boom, tmp_path):
    code, out, err = boom("link", "--load", "thesis", "--method", "thesis", "--json", "--out-boom", "new.toml")
    answer = json.loads(out)
    assert (code, err) == (0, "")
    assert answer["mass_kg"] == pytest.approx(3.7262, abs=5e-5)
    assert answer["tip_deflection_m"] == pytest.approx(0.01, abs=1e-6)
    assert answer["buckling_load_N"] == pytest.approx(6714.0, abs=0.1)
    assert answer["stress_only"]["mass_kg"] == pytest.approx(2.9117, abs=5e-5)
    assert answer["stress_only"]["tip_deflection_m"] == pytest.approx(0.02096, abs=5e-6)
    assert any("does not follow from its move" in note for note in answer["notes"])
    assert answer["files"] == {"boom": "new.toml"}
    code, out, _ = boom("plan", "transport", "phenotyping", "--boom", "new.toml", "--json")
    assert code == 0


def test_the_command_for_people_and_its_moves(boom):
    code, out, _ = boom("link", "--move", "transport", "q=0,30,90,0,0", "--slices", "100", "--contour", "c.txt")
    assert code == 0
    assert "lower bound of the mass" in out
    assert "contour: c.txt" in out


@pytest.mark.parametrize(
    ("options", "code", "message"),
    [
        (("--deflection", "0"), 2, "deflection is 0 m; it must be between 1e-06 and 1 m"),
        (("--min-height", "0.2", "--max-height", "0.1"), 2, "minimum height 0.2 m is not below the maximum of 0.1 m"),
        (("--slices", "1"), 2, "slices is 1; it must be a whole number of at least 2"),
        (("--safety-factor", "nan"), 2, "safety-factor is nan"),
        (("--max-height", "0.01"), 1, "the stress needs"),
        (("--link", "wrist"), 2, "unknown link 'wrist'"),
        (("--material", "wood"), 2, "unknown material 'wood'"),
        (("--step", "0", "--method", "thesis"), 2, "step is 0"),
        (("--method", "thesis", "--min-height", "0.01"), 2, "the thesis's method has no minimum height"),
        (("--link", "outer", "--load", "thesis"), 2, "the thesis's load is for the inner link"),
        (("--payload", "inf"), 2, "payload"),
        (("--out", "missing/x.rrd"), 2, "cannot be written"),
        (("--min-height", "1"), 2, "minimum height is 1 m; it must be below the link's length, 1 m"),
        (("--frozen", "--shear"), 2, "frozen moments leave out shear"),
        (("--method", "thesis", "--frozen"), 2, "always freezes the moments"),
        (("--method", "thesis", "--no-shear"), 2, "leaves out shear"),
        (("--method", "thesis", "--no-buckling"), 2, "has no buckling constraint"),
        (("--method", "thesis", "--largest-components"), 2, "always takes the largest components"),
        (("--load", "thesis", "--largest-components"), 2, "has no largest components"),
        (("--convergence",), 2, "--convergence is part of the JSON"),
        (("--method", "thesis", "--step", "1e-9"), 2, "step is 1e-09 m"),
    ],
)
def test_the_command_refuses_what_cannot_be(boom, tmp_path, options, code, message):
    base = () if "--load" in options or "outer" in options else ("--load", "thesis")
    found, out, err = boom("link", *base, *options, "--picture", "p.png")
    assert (found, out) == (code, "")
    assert message in err
    assert err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_picture_is_a_png(boom, tmp_path):
    code, _, err = boom("link", "--load", "thesis", "--picture", "p.jpg")
    assert (code, err) == (2, "boom: p.jpg: a picture is written as .png\n")
    assert not list(tmp_path.iterdir())


def test_motors_of_your_own_are_tried(boom, tmp_path):
    shipped = CATALOGUE_FILE.read_text()
    block = shipped[shipped.index("[motors.MST341B02]") :]
    block = block[: block.index("\n[", 1)]
    (tmp_path / "mine.toml").write_text(block.replace("[motors.MST341B02", "[motors.MINE"))
    motors = json.loads(boom("link", "--load", "thesis", "--slices", "50", "--catalogue", "mine.toml", "--json")[1])["motors"]
    found = {m["motor"]: m for m in motors}
    assert found["MINE"] == found["MST341B02"] | {"motor": "MINE"}


def test_a_heavier_link_is_said_to_be(boom):
    _, out, _ = boom("link", "--load", "thesis", "--min-height", "0.25", "--slices", "50")
    told = " ".join(out.split())
    assert "% more along the moves" in told
    assert "less along" not in told
    assert "beam theory is not valid" in told


def test_no_saving_is_given_where_fittings_are_unknown(new):
    found = design_link(BOOM, LinkTask(link="lower", slices=60), new.trajectories)
    assert "saving unknown" in to_markdown(found)
    assert to_json(found, {})["torque"]["saved_least"] is None


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("designed_to = 0.90", "designed_to = 0.10", "designed_to is 0.1; it must be above designed_from, 0.15"),
        ("spacing_m = 0.091", "spacing_m = 0.004", "spacing is 0.004 m; 2 plates of 0.005 m need at least 0.005 m"),
        ("designed_from = 0.15", "cross_plates = 151\ndesigned_from = 0.15", "151 cross plates of 0.005 m do not fit into"),
    ],
)
def test_plates_that_do_not_fit_are_refused(boom, tmp_path, old, new, message):
    (tmp_path / "mine.toml").write_text(LINKS_FILE.read_text().replace(old, new, 1))
    code, out, err = boom("link", "--load", "thesis", "--links", "mine.toml")
    assert (code, out) == (2, "")
    assert message in err


def test_loads_that_are_not_finite_are_refused(boom, tmp_path):
    (tmp_path / "wild.csv").write_text("t,q1,q2,q3,q4,q5\n0,0,0.5,1.5,0,0\n1,0,0.5,nan,0,0\n2,0,0.5,1.5,0,0\n")
    code, _, err = boom("link", "--motion", "wild.csv", "--slices", "50")
    assert code == 2
    assert "finite" in err


def test_links_of_your_own(boom, tmp_path):
    text = LINKS_FILE.read_text().replace("designed_from = 0.15", "cross_plates = 4\ndesigned_from = 0.15")
    (tmp_path / "mine.toml").write_text(text)
    thesis = ("link", "--load", "thesis", "--method", "thesis", "--json")
    masses = [json.loads(boom(*thesis, *more)[1])["body"]["mass_kg"] for more in ((), ("--links", "mine.toml"))]
    assert 0.3 < masses[1] - masses[0] < 1.0
    (tmp_path / "mine.toml").write_text(text.replace("plates = 2", "plates = 0", 1))
    code, _, err = boom(*thesis, "--links", "mine.toml")
    assert code == 2
    assert "mine.toml: key links.inner.plates" in err


def test_thesis_method_on_the_loads_of_moves(new):
    found = design_link(BOOM, replace(new.task, method="thesis", slices=200), new.trajectories)
    assert found.thesis is not None
    assert found.mass == pytest.approx(new.mass, rel=0.02)
    direct = thesis_design(found.beam, THESIS_LOAD, stress_limit=175e6, deflection_limit=0.01)
    assert direct.mass > 1.5 * found.mass
