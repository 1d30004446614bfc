"""Answers fit the terminal: at four widths no line is wider, no number is cut, and at 80 columns no
answer is long."""

import re
import shlex
from pathlib import Path

import pytest

from planner.motion.motion_files import write_motion
from tests.builders import main_move

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
WIDTHS = (60, 80, 100, 140)
LONGEST = 24

COMMANDS = (
    "boom",
    "boom plan transport phenotyping",
    "boom plan transport tip=1.4,0,1.0 --constraint extension=0.25 --profile time-optimal",
    "boom plan transport tip=1.4,0,1.0 --constraint extension=0.25 --payload 25",
    "boom profiles transport phenotyping",
    "boom profiles transport phenotyping --payload 20",
    "boom check move.csv --payload 8",
    "boom mission field-day",
    "boom mission table-2-4 table-3-1",
    "boom mission table-2-4 table-3-1 --joint inner --joint lower",
    "boom plan transport phenotyping --payload 40 --vehicle slope",
    "boom size field-day --joint inner --joint lower",
    "boom require table-3-1",
    "boom control transport phenotyping",
    "boom link",
    "boom fk phenotyping",
    "boom ik 1.4 0 1.0 --constraint extension=0.25",
    "boom reach",
    "boom torque move.csv --out torques.csv",
    "boom compare move.csv move.csv",
    "boom calibrate --suggest 12",
    "boom export move.csv move.yaml",
    "boom export-model boom.urdf",
    "boom validate",
    "boom info",
    "boom catalogue",
    "boom new mine.toml",
)
ELSEWHERE = {"view", "jog", "study", "calibrate", "identify", "geotag", "rig", "plots", "scan"}
"""Commands that need files or a browser; the tests of their rooms look at what they print."""
SLOW = ("planner.control.study.study", "planner.links.design.design_link", "planner.sizing.choice.choose")


@pytest.fixture
def remembering(monkeypatch):
    """Work that takes long is done once; how it is printed does not depend on it."""
    for name in SLOW:
        module, _, function = name.rpartition(".")
        whole, known = __import__(module, fromlist=[function]), []
        work = getattr(whole, function)

        def once(*arguments, _work=work, _known=known, **named):
            if not _known:
                _known.append(_work(*arguments, **named))
            return _known[0]

        monkeypatch.setattr(whole, function, once)


@pytest.mark.parametrize("command", COMMANDS)
def test_an_answer_fits_every_width(boom, remembering, monkeypatch, command):
    write_motion(main_move().trajectory, "move.csv")
    answers = {}
    for width in WIDTHS:
        monkeypatch.setenv("COLUMNS", str(width))
        _, answers[width], _ = boom(*shlex.split(command)[1:])
        for line in answers[width].splitlines():
            assert len(line) <= width, (width, line)
        assert "…" not in answers[width]
    numbers = {width: set(re.findall(r"(?<![\w.])-?\d+\.\d+(?![\w.])", answer)) for width, answer in answers.items()}
    for width in WIDTHS[:-1]:
        assert numbers[width] <= numbers[WIDTHS[-1]], width
    assert len(answers[80].splitlines()) <= LONGEST


def test_every_command_of_the_readme_is_here():
    table = README[README.index("## Commands") :]
    named = set(re.findall(r"`boom ([a-z-]+)", table[: table.index("\n\n##")]))
    assert named - ELSEWHERE <= {command.split()[1] for command in COMMANDS[1:]}
