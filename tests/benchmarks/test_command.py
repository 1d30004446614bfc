"""Time of the whole command, against a process that only imports Rerun, which every recording
needs."""

import os
import resource
import subprocess
import sys
from pathlib import Path

ROUNDS = 5
"""Runs of each process in turn. The quickest counts."""


def cpu_seconds(*arguments: str, where: Path) -> float:
    """Return the processor time [s] of a Python process."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}
    subprocess.run([sys.executable, *arguments], cwd=where, env=environment, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def test_a_plan_takes_about_three_imports_of_rerun(tmp_path: Path):
    """2.1, or 2.5 to 3.2 where pandas is installed, which pyarrow then imports.

    The move itself is a tenth of it.
    """
    processes = {"rerun": ("-c", "import rerun"), "plan": ("-m", "planner", "plan", "transport", "phenotyping")}
    spent = {name: [] for name in processes}
    for _ in range(ROUNDS):
        for name, arguments in processes.items():
            spent[name].append(cpu_seconds(*arguments, where=tmp_path))
    ratio = min(spent["plan"]) / min(spent["rerun"])
    print(f"boom plan takes {ratio:.2f} of `import rerun`")
    assert ratio < 3.4


def test_a_plan_imports_neither_pictures_nor_control_nor_scipy(tmp_path: Path):
    code = (
        "import sys; from planner.cli import cli\n"
        "cli.main(['plan', 'transport', 'phenotyping'], standalone_mode=False)\n"
        "print(sorted({'control', 'matplotlib', 'scipy', 'toppra'} & set(sys.modules)))"
    )
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=environment, check=True, capture_output=True, text=True
    )
    assert done.stdout.splitlines()[-1] == "[]"
