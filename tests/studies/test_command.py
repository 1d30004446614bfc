"""`boom study`: its answer, its files, and what it says where a library or every
sample is missing."""

import builtins
import json

import pytest

from tests.studies.helpers import SMALL


@pytest.fixture
def small(tmp_path):
    (tmp_path / "s.toml").write_text(SMALL.format(samples=120))


def test_the_answer_tells_verdict_responses_and_files(boom, small, tmp_path):
    code, out, err = boom("study", "s.toml", "--workers", "1", "--report", "s.md", "--picture", "s.png", "--seed", "5")
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0] == "study small: Does it hold?"
    assert lines[1] == "mission table-3-1, 125 samples of 2 factors (monte-carlo, seed 5)"
    assert lines[2].startswith("FAIL: 0 % of 120 (95% interval 0 % to ")
    assert len(lines) <= 24
    report = (tmp_path / "s.md").read_text()
    for heading in ("## Responses", "## What decides used", "## Factors and notes", "## Tornado: used", "## Samples"):
        assert heading in report
    assert "| payload | 0." in report
    assert (tmp_path / "s.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "small.parquet").exists()
    assert not (tmp_path / "small.parquet.parts").exists()


def test_json_has_every_figure(boom, small):
    code, out, _ = boom("study", "s.toml", "--workers", "1", "--json")
    found = json.loads(out)
    assert code == 0
    assert found["samples"] == 125
    assert found["probability_of_FAIL"]["fails"] == 0
    (used,) = found["responses"]
    assert used["first_order"] == pytest.approx(used["deviation"], rel=0.3)
    assert {index["factor"] for index in used["indices"]} == {"payload", "link mass"}


def test_every_sample_refused_is_the_answer_no(boom, tmp_path):
    text = SMALL.format(samples=6).replace("mean = 10.0", "mean = -10.0").replace("std = 1.0", "std = 0.1")
    (tmp_path / "s.toml").write_text(text)
    code, out, err = boom("study", "s.toml", "--workers", "1")
    assert code == 1
    assert "no sample could be checked; 11 refused" in out
    assert err == "boom: no sample could be checked: every one was refused\n"


@pytest.mark.parametrize(
    ("responses", "said"),
    [
        ('responses = ["usd"]', "unknown response 'usd'; did you mean used?"),
        ('responses = ["verdict"]', "response verdict: it is not a number"),
        ('responses = ["used"]\npareto = ["mas_kg", "used"]', "unknown response 'mas_kg'; did you mean mass_kg?"),
    ],
)
def test_a_wrong_response_is_named_before_anything_is_computed(boom, tmp_path, responses, said):
    (tmp_path / "s.toml").write_text(SMALL.format(samples=100_000).replace('responses = ["used"]', responses))
    assert boom("study", "s.toml") == (2, "", f"boom: {said}\n")
    assert [path.name for path in tmp_path.iterdir()] == ["s.toml"]


def test_samples_that_all_have_no_motion_fail(boom, tmp_path):
    hasty = SMALL.replace('mission = "table-3-1"', '[move]\nstart = "transport"\ngoal = "phenotyping"\nduration_s = 0.1\n')
    head, _, rest = hasty.format(samples=6).partition("[move]")
    move, _, rest = rest.partition("joints = ")
    keys, _, factors = rest.partition("[[factors]]")
    (tmp_path / "s.toml").write_text(f"{head}joints = {keys}[move]{move}\n[[factors]]{factors}")
    code, out, err = boom("study", "s.toml", "--workers", "1")
    assert (code, err) == (0, "")
    assert "FAIL: 100 % of 6" in out
    assert "; 11 without a motion\n" in out


def test_a_missing_extra_is_named(boom, small, tmp_path, monkeypatch):
    (tmp_path / "s.toml").write_text(SMALL.format(samples=8).replace("monte-carlo", "sobol-indices"))
    real = builtins.__import__

    def without(name, *rest):
        if name.partition(".")[0] == "SALib":
            raise ModuleNotFoundError(name=name)
        return real(name, *rest)

    for name in ("SALib.sample.sobol", "SALib.sample", "SALib"):
        monkeypatch.delitem(__import__("sys").modules, name, raising=False)
    monkeypatch.setattr("planner.studies.extra.import_module", lambda name: without(name))
    code, _, err = boom("study", "s.toml")
    assert code == 2
    assert "needs the extra study" in err


def test_workers_and_scheduler_exclude_each_other(boom, small):
    code, _, err = boom("study", "s.toml", "--workers", "2", "--scheduler", "tcp://127.0.0.1:1")
    assert code == 2
    assert "--workers is for local processes" in err
