"""Reports as documents: each form is read back by a reader of its own."""

import os
import re
import sys
from base64 import b64decode
from html.parser import HTMLParser
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pypdf
import pytest

from boom_model import JOINTS, Boom, InputError
from planner import plan
from planner.motion.trajectory import Trajectory, write_csv
from planner.reports.document import write_document
from planner.reports.drive_pictures import drive_pages
from planner.reports.first_page import first_picture
from planner.reports.move_pictures import move_pictures
from planner.reports.report import cells

BOOM = Boom.load()
PNG = b"\x89PNG\r\n\x1a\n"
TITLES = ["Positions", "Velocities", "Torques", "Drive of inner", "Drive of lower", "Tip"]
FORMS = ["x.md", "x.html", "x.pdf"]
CONTROL = ("control", "phenotyping", "q=90,57,175,0.95,0", "--set", "rate_Hz=500", "--controller", "pid")


@pytest.fixture(scope="module")
def move():
    return plan(Boom.load(), "transport", "phenotyping", duration=5.0)


@pytest.fixture(scope="module")
def planned(move):
    shown = Boom.load(), move.trajectory, move.loads.tau
    return move.report, move_pictures(*shown) | drive_pages(*shown, move.report)


@pytest.fixture(scope="module")
def folder(planned, tmp_path_factory):
    """The plan's report in each form, as `boom plan` with some arguments would write it."""
    place = tmp_path_factory.mktemp("reports")
    report, pictures = planned
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["boom", "plan", "transport", "phenotyping", "--via", "q=1 2"])
        for name in FORMS:
            write_document(place / name, report.to_markdown(), pictures)
    return place


class Reader(HTMLParser):
    """Cells, text, pictures, and tags that close."""

    def __init__(self):
        super().__init__()
        self.open, self.cells, self.text, self.pictures = [], [], "", []

    def handle_starttag(self, tag, attrs):
        if tag in ("td", "th"):
            self.cells.append("")
        if tag == "img":
            self.pictures.append(dict(attrs))
        if tag not in ("img", "meta", "hr", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data
        if self.open and self.open[-1] in ("td", "th"):
            self.cells[-1] += data


def of_html(path):
    reader = Reader()
    reader.feed(path.read_text(encoding="utf-8"))
    reader.close()
    assert reader.open == []
    return reader


def of_pdf(path):
    """The text without spaces: a reader breaks lines where the page does."""
    return re.sub(r"\s", "", "".join(page.extract_text() for page in pypdf.PdfReader(path).pages))


def test_html_holds_every_row_and_its_pictures(planned, folder):
    report, _ = planned
    found = of_html(folder / "x.html")
    first = found.cells.index("check") - 1  # the tables of peaks and ratios come before
    rows = [tuple(found.cells[k : k + 10]) for k in range(first, first + 10 * len(report.rows) + 10, 10)]
    assert rows[0] == ("joint", "check", "demand", "limit", "margin", "required", "at", "verdict", "basis", "source")
    assert rows[1:] == [(*map(str, cells(row)), row.source) for row in report.rows]
    assert [picture["alt"] for picture in found.pictures] == TITLES
    for picture in found.pictures:
        kind, _, data = picture["src"].partition(",")
        assert kind == "data:image/png;base64"
        assert b64decode(data, validate=True).startswith(PNG)
    assert all(text in found.text for text in (report.summary, *report.assumptions, *report.notes, *report.sentences))


def test_pdf_holds_summary_assumptions_command_and_versions(planned, folder):
    report, _ = planned
    path = folder / "x.pdf"
    text = of_pdf(path)
    wanted = [report.summary, *report.assumptions, *report.notes, *(f"numpy {version('numpy')}", f"boom {version('boom')}")]
    wanted += ["boom plan transport phenotyping --via 'q=1 2'", *(row.source for row in report.rows)]
    assert [each for each in wanted if re.sub(r"\s", "", each) not in text] == []
    pages = pypdf.PdfReader(path).pages
    assert [len(page.images) for page in pages[-len(TITLES) :]] == [1] * len(TITLES)
    assert all(page.mediabox.width > page.mediabox.height for page in pages)
    assert [page.extract_text().splitlines()[0] for page in pages[-len(TITLES) :]] == TITLES


def test_pdf_keeps_words_whole(planned, folder):
    """No column is narrower than its longest word: a broken word would stand on two lines."""
    words = {word for page in pypdf.PdfReader(folder / "x.pdf").pages for word in page.extract_text().split()}
    assert {word for row in planned[0].rows for word in f"{row.check} {row.verdict} {row.source}".split()} <= words


def test_markdown_lies_beside_its_pictures(folder):
    text = (folder / "x.md").read_text(encoding="utf-8")
    names = re.findall(r"!\[(.*?)\]\((.*?)\)", text)
    assert [title for title, _ in names] == TITLES
    assert sorted(os.listdir(folder)) == sorted([*FORMS, *(name for _, name in names)])
    assert all((folder / name).read_bytes().startswith(PNG) for _, name in names)
    assert f"`boom plan transport phenotyping --via 'q=1 2'` with boom {version('boom')}, numpy" in text


def test_a_bar_within_a_cell_makes_no_column(boom, tmp_path):
    code, _, err = boom(*CONTROL, "--report", "x.html")
    assert (code, err) == (0, "")
    found = of_html(tmp_path / "x.html")
    assert found.cells.count("max |S|") == 1
    assert [picture["alt"] for picture in found.pictures] == ["Tip errors", "Loops"]
    assert "structural_damping 0.02" in found.text


@pytest.mark.parametrize("name", FORMS)
def test_texts_of_any_kind_go_into_every_form(tmp_path, name):
    wide = "| " + " | ".join(f"column{k}ofverymanyletters" for k in range(14)) + " |\n|" + " --- |" * 14 + "\n"
    wide += "| 1 |" + " <b>&amp; 5 mm² |" * 13 + "\n\n| | a |\n| --- | --- |\n| 1 | \\|S\\| |\n"
    write_document(tmp_path / name, f"# A < B & C\n\n{wide}\n\n- one\n- two\n", {})
    if name.endswith(".html"):
        found = of_html(tmp_path / name)
        assert "A < B & C" in found.text
        assert "<b>& 5 mm²" in found.cells
        assert "|S|" in found.cells
    if name.endswith(".pdf"):
        text = of_pdf(tmp_path / name)
        assert "A<B&C" in text
        assert "column13ofverymanyletters" in text


def test_the_first_page_is_the_answer(boom, tmp_path):
    arguments = ("plan", "transport", "phenotyping", "--payload", "25")
    for form in FORMS:
        assert boom(*arguments, "--report", form)[0] == 1
    _, out, _ = boom(*arguments)
    page = re.sub(r"\s", "", pypdf.PdfReader(tmp_path / "x.pdf").pages[0].extract_text())
    text = (tmp_path / "x.md").read_text()
    first = text[: text.index("## Largest torques")]
    assert first.startswith("# transport to phenotyping\n\ncubic, 5.000 s, payload 25 kg, level ground\n")
    assert "\n**FAIL**: inner gearbox" in first
    assert "![The move](x-1.png)" in first
    table = out.splitlines()[out.splitlines().index(next(line for line in out.splitlines() if line.startswith("yaw"))) :][:7]
    for line in table:
        cells_of = re.split(r"\s{2,}", line.strip())
        assert "".join(cells_of[0].split()) in page
        assert f"| {cells_of[0]} | {cells_of[1]} | {cells_of[2]} |" in first
    assert '<strong class="FAIL">FAIL</strong>' in (tmp_path / "x.html").read_text()


def test_the_first_page_of_a_mission(boom, tmp_path):
    assert boom("mission", "table-2-4", "--payload", "8", "--report", "x.md")[0] == 0
    first = (tmp_path / "x.md").read_text().partition("## Largest torques")[0]
    assert re.match(r"# Mission table 2-4\n\n[\d.]+ s, payload 8 kg, level ground\n\n\*\*INCOMPLETE\*\*: nothing fails;", first)
    assert all(f"\n| {joint} | " in first for joint in (*JOINTS, "mount", "tip"))


def test_the_picture_of_a_mission_draws_its_moves_one_after_the_other():
    t = np.array([0.0, 1.0, 2.0, 900.0, 901.0])
    q = np.tile(BOOM.poses["transport"], (5, 1))
    q[2:4, 0] += 1.0
    motion, tau = Trajectory(t, q, np.zeros((5, 5)), np.zeros((5, 5))), np.arange(25.0).reshape(5, 5)
    side, _, torques = first_picture(BOOM, motion, tau, [slice(0, 3), slice(3, 5)]).axes
    assert [text.get_text() for text in side.get_legend().get_texts()] == ["start", "farthest", "end"]
    first, second = torques.get_lines()[:2]
    np.testing.assert_array_equal(first.get_xydata(), [[0.0, 0.0], [1.0, 5.0], [2.0, 10.0]])
    np.testing.assert_array_equal(second.get_xydata(), [[2.0, 15.0], [3.0, 20.0]])


JOBS = {
    "plan": (("plan", "transport", "phenotyping", "--out", "m.rrd"), ["The move", *TITLES], "brake present"),
    "check": (("check", "m.csv"), ["The move", *TITLES], "brake present"),
    "mission": (("mission", "table-3-1"), ["The move", *TITLES[3:]], "brake present"),
    "missions": (
        ("mission", "table-2-4", "table-3-1", "--joint", "inner"),
        [f"table {n}: {title}" for n in ("2-4", "3-1") for title in TITLES[3:]],
        "brake present",
    ),
    "size": (("size", "table-3-1", "--joint", "inner"), ["Drives by mass and spare margin"], "brake present"),
    "link": (("link", "--load", "thesis", "--slices", "60"), ["Design", "Convergence"], "brake present"),
}


@pytest.mark.parametrize("job", JOBS)
def test_every_job_with_a_report_writes_it(boom, tmp_path, move, job):
    arguments, titles, assumed = JOBS[job]
    write_csv(move.trajectory, "m.csv")
    code, out, err = boom(*arguments, "--report", "x.html")
    assert (code, err) == (0, "")
    assert "report: x.html" in out
    found = of_html(tmp_path / "x.html")
    assert [picture["alt"] for picture in found.pictures] == titles
    assert assumed in found.text
    assert " ".join(arguments) in found.text
    said = [line.partition(": ")[2] for line in out.splitlines() if line.startswith(("Note: ", "Assumed: "))]
    assert [text for text in said if text not in found.text] == []


@pytest.mark.parametrize(
    "arguments",
    [
        ("plan", "transport", "phenotyping", "--out", "m.rrd"),
        ("check", "m.csv"),
        ("mission", "table-3-1"),
        ("size", "table-3-1"),
        ("link", "--load", "thesis"),
        CONTROL,
    ],
    ids=lambda arguments: arguments[0],
)
@pytest.mark.parametrize(
    ("name", "message"),
    [("x.docx", "x.docx: a report is written as .md, .html, .pdf"), ("none/x.pdf", "none/x.pdf: cannot be written")],
)
def test_a_report_that_cannot_be_written_is_refused_before_the_work(boom, tmp_path, arguments, name, message):
    (tmp_path / "m.csv").write_text("t,q1,q2,q3,q4,q5\n0,0,1,3,0,0\n1,0,1,3,0,0\n")
    code, out, err = boom(*arguments, "--report", name)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
    assert os.listdir(tmp_path) == ["m.csv"]


@pytest.mark.parametrize("name", FORMS)
def test_a_folder_that_takes_no_file_keeps_what_it_had(planned, tmp_path, monkeypatch, name):
    def refuse(*_, **__):
        raise PermissionError(13, "Permission denied")

    (tmp_path / name).write_text("old")
    monkeypatch.setattr("tempfile.mkdtemp", refuse)  # a folder's mode stops no superuser
    with pytest.raises(InputError, match="cannot be written: Permission denied"):
        write_document(tmp_path / name, "# New\n", planned[1])
    assert os.listdir(tmp_path) == [name]
    assert (tmp_path / name).read_text() == "old"


def test_a_disk_that_fills_up_leaves_no_pictures(planned, tmp_path, monkeypatch):
    written, write_bytes = [], Path.write_bytes

    def fill_up(path, data):
        if len(written) == 3:
            raise OSError(28, "No space left on device")
        written.append(path)
        return write_bytes(path, data)

    monkeypatch.setattr(Path, "write_bytes", fill_up)
    with pytest.raises(InputError, match=r"x-4\.png: cannot be written: No space left"):
        write_document(tmp_path / "x.md", "# New\n", planned[1])
    assert os.listdir(tmp_path) == []
