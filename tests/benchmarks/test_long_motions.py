"""Ten minutes at 1 kHz through reading, check, recording and export: cost and memory grow as the
samples do, and no faster.

Each length runs in a process of its own, whose memory is the largest it ever had over what its
imports take (VmHWM: the libraries' own allocations count). Figures are printed with `pytest
tests/benchmarks -s`.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

SHORT, LONG = 60_000, 600_000

RUN = """
import json, sys, time
from pathlib import Path
import numpy as np
from boom_model import Boom
from planner import Trajectory
from planner.motion.motion_files import read_motion, write_motion
from planner.planning import check_motion
from planner.recording import write_recording

count, boom = int(sys.argv[1]), Boom.load()

def peak():
    line = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM"))
    return 1024 * int(line.split()[1])

def motion(n):
    t = np.arange(n) * 1e-3
    w, size = np.array([0.1, 0.2, 0.15, 0.3, 0.4]), np.array([0.5, 0.3, 0.3, 0.3, 0.5])
    phase = t[:, None] * w
    q = np.array([1.0, 0.8, 2.0, 0.5, 0.0]) + size * np.sin(phase)
    return Trajectory.from_samples(t, q, size * w * np.cos(phase), -size * w**2 * np.sin(phase))

def run(n, seconds):
    def timed(name, work):
        start = time.process_time()
        result = work()
        seconds[name] = time.process_time() - start
        return result

    made = motion(n)
    timed("write CSV", lambda: write_motion(made, "m.csv"))
    read = timed("read CSV", lambda: read_motion("m.csv"))
    move = timed("check", lambda: check_motion(boom, read))
    for name in ("m.parquet", "m.yaml", "m.json"):
        timed(f"write {name}", lambda: write_motion(read, name, move.loads.tau))
    timed("read Parquet", lambda: read_motion("m.parquet"))
    timed("record", lambda: write_recording("m.rrd", move))
    assert move.report.rows

run(100, {})
before, seconds = peak(), {}
run(count, seconds)
print(json.dumps({"bytes": peak() - before, "seconds": seconds}))
"""


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[int, dict]:
    """Of each length, the peak of memory and the seconds of the processor that each step took."""
    found = {}
    for count in (SHORT, LONG):
        folder = tmp_path_factory.mktemp("long")
        (folder / "run.py").write_text(RUN)
        root = Path(__file__).parents[2]
        done = subprocess.run(
            [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(root)!r}); exec(open('run.py').read())", str(count)],
            cwd=folder, capture_output=True, text=True, check=True,
        )  # fmt: skip
        found[count] = json.loads(done.stdout)
        for file in folder.iterdir():
            file.unlink()
        steps = ", ".join(f"{name} {seconds:.1f}" for name, seconds in found[count]["seconds"].items())
        print(f"\n{count:,} samples: {found[count]['bytes'] / count:.0f} bytes a sample at most; seconds: {steps}")
    return found


def test_memory_grows_no_faster_than_the_samples(runs: dict[int, dict]):
    assert runs[LONG]["bytes"] < 1.2 * LONG / SHORT * runs[SHORT]["bytes"]


def test_time_grows_no_faster_than_the_samples(runs: dict[int, dict]):
    """Of all steps together: the short ones' seconds are few."""
    total = {count: sum(run["seconds"].values()) for count, run in runs.items()}
    assert total[LONG] < 2.0 * LONG / SHORT * total[SHORT]
