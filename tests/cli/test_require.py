"""The command boom require: text, files, JSON, exit codes."""

import json
from pathlib import Path

import pypdf
import pytest
from click.testing import CliRunner

from boom_model import JOINTS
from planner.cli import cli
from planner.cli.failures import failure


def boom(*arguments: str) -> tuple[int, str]:
    """Exit code and standard output of the command."""
    result = CliRunner().invoke(cli, ["require", *arguments], standalone_mode=False)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        return failure(result.exception), result.output
    return result.return_value or 0, result.output


def test_the_answer_is_short_and_names_what_is_not_counted():
    code, answer = boom("table-3-1")
    assert code == 0
    assert len(answer.splitlines()) <= 16
    assert all(joint in answer for joint in JOINTS)
    assert "not counted, without drive data" in answer


def test_json_is_one_object_in_si():
    code, answer = boom("table-3-1", "--joint", "extension", "--joint", "yaw", "--current", "full", "--cycles", "12", "--json")
    found = json.loads(answer)
    assert code == 0
    assert [sheet["joint"] for sheet in found["joints"]] == ["extension", "yaw"]
    assert found["joints"][0]["stroke_m"] == pytest.approx(1.0)
    assert found["energy"]["current"] == "full"
    assert found["energy"]["day"]["usable_J"] == pytest.approx(12 * found["energy"]["drawn_J"])


def test_files_are_written_and_bad_input_leaves_none(tmp_path: Path):
    report, picture = tmp_path / "sheet.md", tmp_path / "cloud.png"
    assert boom("table-3-1", "--joint", "yaw", "--report", str(report), "--picture", str(picture))[0] == 0
    assert "## Power and energy" in report.read_text(encoding="utf-8")
    assert picture.read_bytes().startswith(b"\x89PNG")
    for bad in (
        ("--joint", "knee"),
        ("--frequency", "-1"),
        ("--tip-error", "0"),
        ("--current", "half"),
        ("--vehicle", "track"),
    ):
        other = tmp_path / "other.md"
        assert boom("table-3-1", *bad, "--report", str(other))[0] == 2, bad
        assert not other.exists()


def test_a_sheet_for_a_supplier_is_one_page_a_joint(tmp_path: Path):
    report = tmp_path / "sheet.pdf"
    assert boom("table-3-1", "--tip-error", "5", "--report", str(report))[0] == 0
    pages = [page.extract_text() for page in pypdf.PdfReader(report).pages]
    for joint, page in zip(JOINTS, pages[1:], strict=False):
        assert page.startswith(f"{joint}\n")
        assert "speed up to" in page
        assert "To be printed on the datasheet" in page
    assert pages[1 + len(JOINTS)].startswith("Nearest drives of the catalogue")
