"""Fixtures that several test files share."""

import os
import sys

import pytest

# The matrices here are small: BLAS's own threads only get in each other's way, and in that of
# pytest's workers.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from planner import cli  # imports NumPy, which reads the variable then


@pytest.fixture
def boom(tmp_path, monkeypatch, capsys):
    """Runs the command in an empty folder; returns exit code, standard output and
    standard error."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["boom", *arguments])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        captured = capsys.readouterr()
        return stop.value.code or 0, captured.out, captured.err

    return run
