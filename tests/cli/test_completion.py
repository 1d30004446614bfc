"""Shell completion: what bash, zsh and fish are told when they ask."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.shell_completion import ShellComplete

from boom_model import JOINTS, Boom
from boom_model.kinematics.constraints import WORDS
from planner.cli import cli
from planner.control.design import Controller
from planner.missions.mission import named_missions
from planner.motion.vehicle import named_cases
from planner.timing.profile import Profile

ROOT = Path(__file__).parents[2]
TARGETS = {*Boom.load().poses, "tip=", "q="}
A_FILE = "a file"
VARIABLE = "_BOOM_COMPLETE"


def completions(*words: str) -> set[str]:
    """Return what may stand for the last word; A_FILE where the shell is to complete files."""
    *before, last = words
    found = ShellComplete(cli, {}, "boom", VARIABLE).get_completions(before, last)
    return {A_FILE if item.type == "file" else item.value for item in found}


def asked(shell: str, words: list[str]) -> list[str]:
    """Return the lines that the command prints to a shell which completes the last of the words."""
    place = {"COMP_WORDS": " ".join(words), "COMP_CWORD": words[-1] if shell == "fish" else str(len(words) - 1)}
    given = {**os.environ, **place, VARIABLE: f"{shell}_complete", "PYTHONPATH": str(ROOT)}
    run = subprocess.run([sys.executable, "-m", "planner"], env=given, capture_output=True, text=True, timeout=60)
    assert (run.returncode, run.stderr) == (0, "")
    return run.stdout.splitlines()


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["pro"], {"profiles"}),
        (["plan", ""], TARGETS),
        (["plan", "transport", "ph"], {"phenotyping"}),
        (["plan", "transport", "phenotyping", "--via", "tr"], {"transport"}),
        (["profiles", ""], TARGETS),
        (["fk", ""], TARGETS),
        (["plan", "--constraint", ""], {*WORDS, "actuator=", "extension=", "nearest="}),
        (["ik", "--constraint", "least-t"], {"least-torque", "least-time"}),
        (["plan", "--profile", ""], {*Profile}),
        (["plan", "--pitch", ""], {"down", "level", "up", "free"}),
        (["plan", "--along", "a"], {"arc="}),
        (["plan", "--vehicle", ""], {*named_cases()}),
        (["check", "move.csv", "--vehicle", "sl"], {"slope"}),
        (["plan", "--vehicle", "my"], {A_FILE}),
        (["mission", ""], {*named_missions()}),
        (["mission", "table-2-4", "table-3"], {"table-3-1"}),
        (["mission", "my"], {A_FILE}),
        (["mission", "field-day", "--joint", ""], {*JOINTS}),
        (["size", ""], {*named_missions()}),
        (["size", "--joint", "i"], {"inner"}),
        (["require", "--joint", "w"], {"wrist"}),
        (["study", "light"], {"lighter-boom", "lighter-motor"}),
        (["control", "transport", ""], TARGETS),
        (["control", "--controller", ""], {"all", *Controller}),
        (["control", "--controller", "pd,p"], {"pd,pid"}),
        (["control", "--profile", "cubic,ti"], {"cubic,time-optimal"}),
        (["control", "--shaper", "zv"], {"zv", "zvd"}),
        (["link", "--link", ""], {"inner", "lower", "outer", "extension"}),
        (["link", "--material", "al"], {"aluminium"}),
        (["torque", "--payload-as", ""], {"mass", "force"}),
        (["plan", "--prof"], {"--profile"}),
    ],
)
def test_names_are_completed(words, expected):
    assert completions(*words) == expected


@pytest.mark.parametrize(
    "words",
    [
        ["check", ""],
        ["torque", "m"],
        ["compare", ""],
        ["compare", "plan.csv", ""],
        ["export", ""],
        ["export", "move.csv", ""],
        ["export-model", ""],
        ["identify", ""],
        ["calibrate", ""],
        ["geotag", ""],
        ["plots", ""],
        ["scan", ""],
        ["view", ""],
        ["new", ""],
        *(["plan", option, ""] for option in ("--boom", "--catalogue", "--out", "--csv", "--report", "--picture")),
        *(["control", option, ""] for option in ("--out", "--loops", "--errors", "--report")),
        *(["link", option, ""] for option in ("--links", "--out", "--picture", "--contour", "--csv", "--dxf", "--out-boom")),
    ],
)
def test_files_are_completed(words):
    assert completions(*words) == {A_FILE}


def test_every_option_that_is_a_file_completes_files():
    for name, command in cli.commands.items():
        for parameter in command.params:
            form = parameter.metavar or ""
            if isinstance(parameter, click.Option) and form.startswith("FILE."):
                assert completions(name, parameter.opts[0], "") == {A_FILE}, (name, parameter.opts)


def test_poses_of_the_boom_that_is_named(boom, tmp_path):
    boom("new", "mine.toml")
    text = (tmp_path / "mine.toml").read_text()
    assert "[poses.transport]" in text or "transport" in text
    (tmp_path / "mine.toml").write_text(text.replace("phenotyping", "over_the_plot"))
    assert completions("plan", "--boom", str(tmp_path / "mine.toml"), "") == {"transport", "over_the_plot", "tip=", "q="}


def test_a_boom_that_cannot_be_read_is_left_to_the_command():
    assert completions("plan", "--boom", "nosuch.toml", "") == {"tip=", "q="}


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_shell_is_answered_in_its_own_form(shell):
    plain, file = asked(shell, ["boom", "plan", "ph"]), asked(shell, ["boom", "check", "mov"])
    assert (plain, file) == {
        "bash": (["plain,phenotyping"], ["file,mov"]),
        "zsh": (["plain", "phenotyping", "_"], ["file", "mov", "_"]),
        "fish": (["plain,phenotyping"], ["file,mov"]),
    }[shell]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_that_a_shell_sources(shell):
    given = {**os.environ, VARIABLE: f"{shell}_source", "PYTHONPATH": str(ROOT)}
    run = subprocess.run([sys.executable, "-m", "planner"], env=given, capture_output=True, text=True, timeout=60)
    assert run.returncode == 0
    assert f"{VARIABLE}={shell}_complete" in run.stdout
    program = shutil.which(shell)
    if program is not None:
        subprocess.run([program, "-n"], input=run.stdout, text=True, check=True, timeout=60)


def test_bash_itself_completes(tmp_path):
    """Bash runs the sourced script, with a `boom` on its path that is this one."""
    command = tmp_path / "boom"
    command.write_text(f'#!/bin/sh\nPYTHONPATH="{ROOT}" exec "{sys.executable}" -m planner "$@"\n')
    command.chmod(0o755)
    script = f"""
        PATH="{tmp_path}:$PATH"
        eval "$({VARIABLE}=bash_source boom)"
        COMP_WORDS=(boom mission table) COMP_CWORD=2
        _boom_completion boom
        echo "${{COMPREPLY[@]}}"
    """
    run = subprocess.run(["bash", "-c", script], capture_output=True, text=True, timeout=60)
    assert run.stdout.split() == ["table-2-4", "table-3-1"]


def test_the_readme_says_how_to_switch_it_on():
    page = (ROOT / "README.md").read_text()
    for shell in ("bash", "zsh", "fish"):
        assert f"{VARIABLE}={shell}_source boom" in page
