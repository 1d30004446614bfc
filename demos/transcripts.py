"""Write the guide's pages of transcripts: what every command answers in a terminal of 80 columns.

Run it as `python demos/transcripts.py`. With `--check` it writes nothing, and fails if a page
differs in more than digits, or an answer is longer than LONGEST lines.
"""

import os
import re
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
}


def main() -> int:
    """Write or check every page; return 1 if one is not as it should be."""
    check, wrong = "--check" in sys.argv[1:], []
    with tempfile.TemporaryDirectory() as folder:
        for name, (title, commands) in PAGES.items():
            parts = [f"# {title}\n", INTRODUCTION]
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
    environment = os.environ | {"COLUMNS": str(WIDTH), "NO_COLOR": "1"}
    environment["PYTHONPATH"] = os.pathsep.join([str(GUIDE.parents[1]), environment.get("PYTHONPATH", "")])
    arguments = [sys.executable, "-m", "planner", *command.split()[1:]]
    done = subprocess.run(arguments, cwd=folder, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    if done.returncode > 1:
        raise SystemExit(f"{command}: exit {done.returncode}: {done.stdout}")
    return "".join(f"{line.rstrip()}\n" for line in done.stdout.splitlines())


def words(text: str) -> str:
    """Return a page without what may differ between processors: digits, and the width of columns."""
    return re.sub(r"[─\s]+", " ", re.sub(r"-?\d[\d.e+-]*", "#", text))


if __name__ == "__main__":
    sys.exit(main())
