"""Write the guide's pages of transcripts: what every command answers in a terminal of 80 columns.

Run it as `python demos/transcripts.py`. With `--check` it writes nothing, and fails if a page
differs in more than digits, or an answer is longer than LONGEST lines.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

GUIDE = Path(__file__).parent / "guide"
WIDTH, LONGEST = 80, 24
INTRODUCTION = "As a terminal of 80 columns shows them; `--all` shows more. `demos/transcripts.py` wrote this page.\n"

PAGES = {
    "answers-moves": (
        "Answers about moves",
        (
            "boom",
            "boom plan transport phenotyping --csv move.csv",
            "boom plan transport tip=1.4,0,1.0 --constraint extension=0.25 --payload 25",
            "boom profiles transport phenotyping",
            "boom check move.csv --payload 8",
            "boom torque move.csv --out torques.csv",
            "boom fk phenotyping",
            "boom ik 1.4 0 1.0 --constraint extension=0.25",
            "boom reach --constraint least-torque",
        ),
    ),
    "answers-drives": (
        "Answers about drives, loops and links",
        (
            "boom mission field-day",
            "boom mission table-2-4 table-3-1",
            "boom size field-day",
            "boom require field-day",
            "boom study lighter-motor --samples 32 --workers 1",
            "boom control transport phenotyping",
            "boom link",
            "boom catalogue",
        ),
    ),
    "answers-geotags": (
        "Answers about geotags",
        (
            "boom plots demos/field/trial.toml --at 52.130029,-106.619911 --std 0.05",
            "boom rig demos/field/manoeuvre.csv demos/field/prism.csv --rig demos/field/rig.toml --out measured.toml",
            "boom geotag demos/field/vehicle.csv demos/field/joints.csv demos/field/triggers.csv --rig demos/field/rig.toml "
            "--plots demos/field/trial.toml",
        ),
    ),
    "answers-files": (
        "Answers about booms and files",
        (
            "boom info",
            "boom new mine.toml",
            "boom compare move.csv move.csv --tolerance 0.005",
            "boom calibrate --suggest 30 --out poses.csv",
            "boom export move.csv move.yaml",
            "boom export-model boom.urdf",
            "boom validate",
        ),
    ),
    "answers-field": (
        "Answers about row scans",
        (
            "boom scan demos/field/trial.toml --footprint 0.5,0.5 --profile cubic",
            "boom scan demos/field/trial.toml --footprint 0.5,0.5 --profile cubic --speed 0.5 --mission scan.toml",
            "boom scan demos/field/trial.toml --footprint 0.5,0.5 --profile cubic --speed 0.5 --passes 1",
            "boom mission scan.toml",
            "boom scan demos/field/row.toml --footprint 0.7,0.5 --track demos/field/row.csv --rig demos/field/rig.toml",
        ),
    ),
    "answers-machine": (
        "Answers about a measured machine",
        (
            "boom calibrate measured.csv --sd 0.0005 --check others.csv --out calibrated.toml",
            "boom identify excited.csv --payload 0 --out identified.toml",
            "boom calibrate measured.csv --sd 0.0005 --boom identified.toml --out mine.toml",
            "boom info --boom mine.toml",
            "boom new cad.toml",
            "boom compare excited.csv --payload 0 --boom identified.toml --before cad.toml --report better.pdf",
            "boom fk phenotyping --boom calibrated.toml",
            "boom plan transport phenotyping --boom identified.toml",
        ),
    ),
}
DEMOS = {"answers-machine": ("10_calibrate_a_machine.py", "11_identify_the_dynamics.py")}
"""Scripts that write the files of a page."""


def main() -> int:
    """Write or check every page; return 1 if one is not as it should be."""
    check, wrong = "--check" in sys.argv[1:], []
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(GUIDE.parent / "field", Path(folder) / "demos" / "field")
        for name, (title, commands) in PAGES.items():
            parts = [f"# {title}\n", INTRODUCTION]
            for script in DEMOS.get(name, ()):
                subprocess.run(
                    [sys.executable, GUIDE.parent / script], cwd=folder, env=_environment(), check=True, capture_output=True
                )
            for command in commands:
                answer = run(command, folder)
                if len(answer.splitlines()) > LONGEST:
                    wrong.append(f"{command}: {len(answer.splitlines())} lines; at most {LONGEST}")
                parts.append(f"```text\n$ {command}\n{answer}```\n")
            page, text = GUIDE / f"{name}.md", "\n".join(parts)
            if not check:
                page.write_text(text, encoding="utf-8")
            elif words(text) != words(page.read_text(encoding="utf-8")):
                wrong.append(f"{page.name}: is not what the commands answer; python demos/transcripts.py writes it")
    print("\n".join(wrong) or f"{len(PAGES)} pages of answers, each of at most {LONGEST} lines")
    return 1 if wrong else 0


def run(command: str, folder: str) -> str:
    """Return what a command prints in a folder, without spaces at the ends of lines."""
    arguments = [sys.executable, "-m", "planner", *command.split()[1:]]
    done = subprocess.run(
        arguments, cwd=folder, env=_environment(), text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    if done.returncode > 1:
        raise SystemExit(f"{command}: exit {done.returncode}: {done.stdout}")
    return "".join(f"{line.rstrip()}\n" for line in done.stdout.splitlines())


def _environment() -> dict[str, str]:
    environment = os.environ | {"COLUMNS": str(WIDTH), "NO_COLOR": "1"}
    environment["PYTHONPATH"] = os.pathsep.join([str(GUIDE.parents[1]), environment.get("PYTHONPATH", "")])
    return environment


def words(text: str) -> str:
    """Return a page without what may differ between processors: digits and columns' widths."""
    return re.sub(r"[─\s]+", " ", re.sub(r"-?\d[\d.e+-]*", "#", text))


if __name__ == "__main__":
    sys.exit(main())
