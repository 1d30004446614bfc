"""How the command ends where something fails: one line on standard error, an exit code, and no file
left behind."""

import os
import random
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from boom_model import Boom
from boom_model.boom_file import BOOM_FILE
from planner import cli, plan
from planner.cli.failures import failure
from planner.motion.trajectory import COLUMNS, write_csv
from tests.builders import hidden

COMMAND = [sys.executable, "-c", "from planner.__main__ import main; main()"]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
PLAN = ("plan", "transport", "phenotyping")
LINE = ("plan", "tip=1,1.7,0.9", "tip=-1,1.7,0.9")


def started(folder, *arguments, **options):
    """The command in a process of its own."""
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options
    return subprocess.Popen([*COMMAND, *arguments], cwd=folder, text=True, **({"env": ENVIRONMENT} | streams))


def run(folder, *arguments, **options):
    process = started(folder, *arguments, **options)
    out, err = process.communicate(timeout=100)
    return process.returncode, out, err


def is_one_line(err):
    return err.startswith("boom: ") and err.count("\n") == 1


@pytest.fixture
def motion(tmp_path):
    q = Boom.load().pose("transport")
    write_csv(plan(Boom.load(), "transport", q + np.array([0.1, 0.0, 0.0, 0.0, 0.0])).trajectory, tmp_path / "in.csv")
    return "in.csv"


# Standard output


def test_a_full_disk_behind_standard_output(tmp_path):
    with open("/dev/full", "w") as full:
        code, _, err = run(tmp_path, "ik", "1.4", "0", "1.0", "--json", stdout=full)
    assert (code, err) == (2, "boom: standard output cannot be written: No space left on device\n")


@pytest.mark.parametrize("arguments", [("ik", "1.4", "0", "1.0"), ("--help",)], ids=["answer", "help"])
def test_a_pipe_without_a_reader(tmp_path, arguments):
    reader, writer = os.pipe()
    os.close(reader)
    code, _, err = run(tmp_path, *arguments, stdout=writer)
    os.close(writer)
    assert (code, err) == (2, "boom: standard output cannot be written: Broken pipe\n")


def test_no_standard_output_at_all(tmp_path):
    shell = ["sh", "-c", 'exec "$@" >&-', "sh", *COMMAND, "ik", "1.4", "0", "1.0"]
    done = subprocess.run(shell, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (2, "boom: standard output is closed\n")


def test_standard_error_that_takes_nothing_changes_no_code(tmp_path):
    with open("/dev/full", "w") as full:
        assert run(tmp_path, "ik", "9", "9", "9", stderr=full)[0] == 1


# Environments


def test_another_backend_of_matplotlib_is_no_matter(tmp_path):
    found = run(tmp_path, "reach", "--out", "r.png", "-q", env=ENVIRONMENT | {"MPLBACKEND": "nonsense"})
    assert found == (0, "", "")
    assert os.listdir(tmp_path) == ["r.png"]


def test_a_deleted_working_directory(tmp_path):
    shell = ["sh", "-c", 'mkdir gone && cd gone && rmdir ../gone && exec "$@"', "sh", *COMMAND, *PLAN]
    done = subprocess.run(shell, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (2, "boom: the working directory does not exist any more\n")


def test_a_name_may_hold_any_byte(tmp_path, motion):
    odd = os.fsdecode(b"b\xff")
    found = run(tmp_path, "check", motion, "--report", f"{odd}.html", "--out", f"{odd}.rrd", "--json")
    assert (found[0], found[2]) == (0, "")
    code, out, err = run(tmp_path, "torque", motion, "--out", f"{odd}.csv")
    assert (code, err) == (0, "")
    assert "csv: b\\udcff.csv" in out
    assert run(tmp_path, "export", f"{odd}.csv", f"{odd}.parquet")[0] == 0
    code, _, err = run(tmp_path, "check", f"{odd}{odd}.csv")
    assert (code, err) == (2, "boom: b\\udcffb\\udcff.csv: cannot be read: No such file or directory\n")
    assert {name for name in os.listdir(os.fsencode(tmp_path)) if name.startswith(b"b\xff")} == {
        *(b"b\xff." + ending for ending in (b"html", b"rrd", b"csv", b"parquet"))
    }


def test_python_runs_the_package(tmp_path):
    python = [sys.executable, "-m", "planner", "ik", "9", "9", "9", "--json"]
    done = subprocess.run(python, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert is_one_line(done.stderr)


# Exceptions


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (KeyError("x"), 70, "boom: internal error: KeyError: 'x'; please report it"),
        (AssertionError(), 70, "boom: internal error: AssertionError"),
        (RecursionError("maximum recursion depth exceeded"), 2, "too large or too small to compute with: maximum recursion"),
        (MemoryError(), 2, "too large or too small to compute with: MemoryError"),
        (RuntimeWarning("overflow encountered in multiply"), 2, "too large or too small to compute with: overflow"),
        (FileNotFoundError(2, "No such file or directory", "x"), 2, "boom: x: No such file or directory"),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, BaseException) else "",
)
def test_an_exception_that_nobody_caught_is_one_line(boom, monkeypatch, error, code, said):
    def fail(*_, **__):
        raise error

    monkeypatch.setattr(cli.cli.commands["validate"], "callback", fail)
    found, out, err = boom("validate")
    assert (found, out) == (code, "")
    assert said in err
    assert is_one_line(err)


def test_the_traceback_of_an_internal_error_is_there_for_who_asks(capsys, monkeypatch):
    monkeypatch.setenv("BOOM_DEBUG", "1")
    assert failure(KeyError("x")) == 70
    assert "KeyError: 'x'\nboom: internal error" in capsys.readouterr().err


def test_numpys_warning_ends_the_command(tmp_path):
    """Bounds leave none that is known; this is for the one that they miss."""
    fail = "import numpy as np; planner.validation.tables.validate = lambda boom: np.array([1e308]) * 1e308"
    code = f"import planner.validation.tables\n{fail}\nfrom planner.__main__ import main; main()"
    python = [sys.executable, "-c", code, "validate"]
    done = subprocess.run(python, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == "boom: a number is too large or too small to compute with: overflow encountered in multiply\n"


# Bad input


def toml(old, new):
    text = BOOM_FILE.read_text(encoding="utf-8")
    assert old in text
    return text.replace(old, new, 1)


BASE_INERTIA = "[0.58731499458, 0.25120561405, 0.59275797596]"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (f"x = {'[' * 1000}{']' * 1000}\n", "nested too deep"),
        (toml("L1_m = 0.110", f"L1_m = {'9' * 4301}"), "not valid TOML"),
        (toml("L1_m = 0.110", f"L1_m = {'9' * 4300}"), "key geometry.L1_m"),
        (toml(BASE_INERTIA, f"[1.0, 1.0, 1{'0' * 400}]"), "key bodies.base.inertia_kg_m2"),
        (toml(BASE_INERTIA, "[1.0, true, 1.0]"), "key bodies.base.inertia_kg_m2"),
        (toml("L4_m = 1.000", "L4_m = 1000.0"), "key geometry.L4_m: input should be less than or equal to 30 (it is 1000.0)"),
    ],
    ids=["nested", "too many digits", "many digits", "huge inertia", "true", "long link"],
)
def test_a_toml_file_beyond_reason(boom, tmp_path, text, said):
    (tmp_path / "mine.toml").write_text(text)
    code, out, err = boom("ik", "1.4", "0", "1.0", "--boom", "mine.toml")
    assert (code, out) == (2, "")
    assert err.startswith("boom: mine.toml: ")
    assert said in err
    assert is_one_line(err)
    assert len(err) < 300


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((*PLAN, "--payload", "1e305", "--json"), "payload is 1e+305 kg; it must be between 0 and 5000 kg"),
        ((*PLAN, "--payload", "-1e-300"), "payload is -1e-300 kg"),
        ((*PLAN, "--duration", "1e308"), "duration is 1e+308 s; it must be between 0.001 and 1e+07 s"),
        ((*PLAN, "--duration", "1e-300"), "duration is 1e-300 s"),
        ((*PLAN, "--rate", "1e308"), "rate is 1e+308 Hz"),
        (("plan", "transport", "q=1e308,0,30,0,0"), "q=1e308,0,30,0,0 is 1e+308; it must be between -10000 and 10000"),
        (("plan", "transport", "tip=1e308,0,1"), "tip=1e308,0,1 is 1e+308"),
        ((*LINE, "--along", "arc=1e308,0,1"), "arc=1e308,0,1 is 1e+308"),
        ((*PLAN, "--pitch", "1e308"), "pitch is 1e+308"),
        ((*PLAN, "--constraint", "extension=1e308"), "constraint extension is 1e+308"),
        (("link", "--load", "thesis", "--deflection", "1e-300"), "deflection is 1e-300 m; it must be between 1e-06 and 1 m"),
        (("link", "--load", "thesis", "--method", "thesis", "--step", "1e-300"), "step is 1e-300 m"),
        (("link", "--load", "thesis", "--safety-factor", "1e308"), "safety-factor is 1e+308"),
        (("size", "table-3-1", "--voltage", "1e308"), "1e+308 V"),
        (("control", *PLAN[1:], "--bandwidth", "1e308"), "bandwidth is 1e+308 Hz"),
        (("control", *PLAN[1:], "--payload-error", "1e308"), "payload-error is 1e+308 kg"),
        (("compare", "in.csv", "in.csv", "--offset", "1e308"), "offset is 1e+308 s"),
    ],
)
def test_an_absurd_number_is_refused_with_its_bounds(boom, motion, tmp_path, arguments, said):
    code, out, err = boom(*arguments)
    assert (code, out) == (2, "")
    assert said in err
    assert is_one_line(err)
    assert os.listdir(tmp_path) == [motion]


def test_a_tiny_number_where_zero_is_allowed_is_zero(boom):
    assert boom("plan", "transport", "q=1,0,30,1e-300,0", "-q")[::2] == (0, "")
    assert boom(*PLAN, "--payload", "1e-300", "-q")[::2] == (0, "")


def test_a_wide_csv_fails_at_once(boom, tmp_path):
    columns = 12_000
    row = ",".join(["1"] * columns)
    (tmp_path / "wide.csv").write_text(f"{','.join(f'c{i}' for i in range(columns))}\n{row}\n{row}\n")
    since = time.perf_counter()
    code, _, err = boom("check", "wide.csv")
    assert time.perf_counter() - since < 20.0
    assert (code, is_one_line(err)) == (2, True)
    assert "lacks the column q1, q2, q3, q4, q5, t" in err
    names = ",".join(f"q{i}" for i in range(1, 6))
    (tmp_path / "wide.csv").write_text(f"t,{names},{','.join(f'c{i}' for i in range(columns))}\n")
    code, _, err = boom("check", "wide.csv")
    assert "and 11,980 more" in err
    assert len(err) < 500


@pytest.mark.parametrize(
    ("header", "values", "said"),
    [
        (b"t,q1,q2,q3,q4,q\xff", "0,0,0,1,0,0", "wild.csv: not a motion's CSV: 'utf-8' codec can't decode"),
        (b"t,q1,q2,q3,q4,q5", "0,1e308,0,1,0,0", "column q1 is 1e+308; it must be between -1e+09 and 1e+09"),
        (b"t,q1,q2,q3,q4,q5,tau1", "0,0,0,1,0,0,inf", "line 2, column tau1: inf is not a finite number"),
    ],
    ids=["header", "position", "torque"],
)
def test_a_wild_csv(boom, tmp_path, header, values, said):
    (tmp_path / "wild.csv").write_bytes(header + b"\n" + values.encode() + b"\n")
    code, out, err = boom("check", "wild.csv")
    assert (code, out) == (2, "")
    assert said in err
    assert is_one_line(err)


def test_samples_too_close_for_a_spline(boom, tmp_path):
    rows = "\n".join(f"{k}e-300,0,0,1,0,0" for k in range(5))
    (tmp_path / "close.csv").write_text(f"t,q1,q2,q3,q4,q5\n{rows}\n")
    code, _, err = boom("check", "close.csv")
    assert (code, is_one_line(err)) == (2, True)
    assert "two samples are 1e-300 s apart; a spline needs at least 1e-09 s" in err


def test_parquet_notes_that_are_nested_deep_are_no_notes(boom, tmp_path):
    still = np.zeros(5)
    table = pa.table({name: np.arange(5.0) if name == "t" else still + (name == "q3") for name in COLUMNS})
    schema = table.schema.with_metadata({"notes": "[" * 100_000 + "]" * 100_000})
    parquet.write_table(table.cast(schema), tmp_path / "deep.parquet")
    assert boom("check", "deep.parquet", "-q")[::2] == (0, "")


# The answer is no


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (
            ("mission", "table-2-4", "table-3-1", "--payload", "45"),
            "boom: table 2-4: a check FAILs; table 3-1: a check FAILs\n",
        ),
        (
            ("size", "table-3-1", "--joint", "inner", "--payload", "30"),
            "boom: no drive of the catalogue is suitable for the mission: inner, as it is\n",
        ),
    ],
    ids=["mission", "size"],
)
@pytest.mark.parametrize("form", [(), ("--json",)], ids=["people", "json"])
def test_a_no_has_its_line(boom, arguments, said, form):
    code, _, err = boom(*arguments, *form)
    assert (code, err) == (1, said)


# Files


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("check", "in.csv", "--out", "in.csv"), "in.csv: the name must end in .rrd"),
        (("torque", "in.csv", "--out", "./../{}/in.csv"), "in.csv: cannot be written: the same command reads it"),
        (("torque", "in.csv", "--out", "in.csv"), "in.csv: cannot be written: the same command reads it"),
        (("export", "in.csv", "link.csv"), "link.csv: cannot be written: the same command reads it"),
        ((*PLAN, "--boom", "in.toml", "--out", "in.toml"), "in.toml: the name must end in .rrd"),
        (("link", "--boom", "in.toml", "--out-boom", "in.toml"), "in.toml: cannot be written: the same command reads it"),
        ((*PLAN, "--report", "r.md", "--picture", "r-1.png"), "r-1.png: the report r.md would write a picture there"),
        (("control", *PLAN[1:], "--loops", "a.png", "--errors", "a.png"), "a.png: cannot be written: it is to hold two things"),
    ],
)
def test_no_file_takes_the_place_of_another_of_the_command(boom, motion, tmp_path, arguments, said):
    (tmp_path / "in.toml").write_bytes(BOOM_FILE.read_bytes())
    (tmp_path / "link.csv").symlink_to("in.csv")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    code, out, err = boom(*(part.format(tmp_path.name) for part in arguments))
    assert (code, out) == (2, "")
    assert said in err
    assert is_one_line(err)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_long_name_is_written(boom, tmp_path):
    name = "n" * 246 + ".csv"
    assert boom(*PLAN, "--csv", name, "-q") == (0, "", "")
    assert name in os.listdir(tmp_path)
    code, _, err = boom(*PLAN, "--csv", "n" + name)
    assert code == 0
    code, _, err = boom(*PLAN, "--csv", "n" * 6 + name)
    assert (code, is_one_line(err)) == (2, True)
    assert "File name too long" in err


def test_a_picture_in_a_source_is_not_loaded(boom, motion, tmp_path):
    text = BOOM_FILE.read_text(encoding="utf-8")
    source = "not in the thesis; the motor allows 165 V"
    assert source in text
    remote = "![x](http://example.invalid/a.png) <img src='http://example.invalid/b.png'>"
    (tmp_path / "mine.toml").write_text(text.replace(source, remote))
    assert boom("check", motion, "--boom", "mine.toml", "--report", "r.html", "-q")[::2] == (0, "")
    html = (tmp_path / "r.html").read_text()
    assert "http://example.invalid/a.png" in html
    assert all('src="data:image/png;base64,' in tag for tag in re.findall("<img[^>]*>", html))
    assert "&lt;img src='http" in html.replace("&#x27;", "'")


# Signals


OUTPUTS = ("--csv", "m.csv", "--report", "r.md")


@pytest.mark.parametrize("at", np.round(np.random.default_rng(1).uniform(0.15, 1.5, 4), 3))
def test_an_interrupt_is_one_line_and_no_file(tmp_path, at):
    process = started(tmp_path, *PLAN, *OUTPUTS)
    time.sleep(at)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=100)
    assert (process.returncode, out, err) == (130, "", "boom: interrupted\n")
    assert os.listdir(tmp_path) == []


def while_writing(process, folder, seconds):
    """Waits until the hidden folder of the outputs holds a file, and a little."""
    give_up = time.monotonic() + 100.0
    while not any(os.path.isdir(folder / name) and os.listdir(folder / name) for name in hidden(folder)):
        assert process.poll() is None
        assert time.monotonic() < give_up
        time.sleep(0.002)
    time.sleep(seconds)


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGKILL])
def test_who_is_stopped_while_writing_leaves_the_old_files(tmp_path, number, seed):
    old = {"move.rrd": "old", "m.csv": "old", "r.md": "old"}
    for name, text in old.items():
        (tmp_path / name).write_text(text)
    process = started(tmp_path, *PLAN, *OUTPUTS)
    while_writing(process, tmp_path, random.Random(seed).uniform(0.0, 0.2))
    process.send_signal(number)
    _, err = process.communicate(timeout=100)
    expected = {
        signal.SIGTERM: (143, "boom: terminated\n"),
        signal.SIGINT: (130, "boom: interrupted\n"),
        signal.SIGKILL: (-9, ""),
    }
    assert (process.returncode, err) == expected[number]
    assert {name: (tmp_path / name).read_text() for name in os.listdir(tmp_path) if name[0] != "."} == old
    assert bool(hidden(tmp_path)) == (number == signal.SIGKILL)
    if number == signal.SIGKILL:
        assert run(tmp_path, *PLAN, "-q")[0] == 0
        assert hidden(tmp_path) == []
