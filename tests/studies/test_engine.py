"""The engine: the same dataset to the bit from one process, local workers, a scheduler's workers,
and after kills."""

import errno
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from boom_model import InputError
from planner.studies.engine import run
from planner.studies.sample import compute
from planner.studies.store import Store
from planner.studies.study import load_study
from tests.studies.helpers import SMALL

SAMPLES = 95  # 20 chunks of 5, with the nominal and the four one-at-a-time points
ROOT = Path(__file__).parents[2]
ENVIRONMENT = os.environ | {"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with the small study and its dataset, made in this process without Dask."""
    folder = tmp_path_factory.mktemp("study")
    (folder / "s.toml").write_text(SMALL.format(samples=SAMPLES))
    make(folder, "one.parquet")
    return folder


def make(folder, name, *, resume=False, seed=None, track=iter):
    """The dataset of the small study, in this process."""
    store = Store(folder / name, load_study(str(folder / "s.toml"), seed=seed))
    with store.opened(resume):
        run(store, workers=1, track=track)
        store.join(folder / name)
        store.remove()


@contextmanager
def running(folder, *options):
    """The command `boom study`, which is killed in the end where it still runs."""
    command = [sys.executable, "-m", "planner", "study", "s.toml", "-q", *options]
    with subprocess.Popen(command, cwd=folder, env=ENVIRONMENT, text=True, stderr=subprocess.PIPE) as process:
        try:
            yield process
        finally:
            process.kill()


def parts(folder, name):
    return sorted((folder / f"{name}.parts").glob("*.parquet"))


def wait_until(true, seconds=100.0):
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end
        time.sleep(0.02)


def workers_of(pid):
    """Processes that Dask has started for a run."""
    found = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    threads = [Path(each, "children").read_text().split() for each in Path(f"/proc/{pid}/task").iterdir()]
    ids = {int(child) for child in (*found, *(child for each in threads for child in each))}
    return [child for child in ids if "spawn_main" in Path(f"/proc/{child}/cmdline").read_text()]


def stopped_after(count):
    """A way through chunks that is interrupted after some of them."""

    def track(steps):
        for i, step in enumerate(steps):
            if i == count:
                raise KeyboardInterrupt
            yield step

    return track


def test_a_row_is_its_sample_computed_alone(folder):
    study, table = load_study(str(folder / "s.toml")), pq.read_table(folder / "one.parquet")
    assert len(table) == SAMPLES + 5
    assert table["sample"].to_pylist() == list(range(len(table)))
    assert set(table["seed"].to_pylist()) == {3}
    for i in (0, 3, 40, 99):
        row = table.slice(i, 1).to_pylist()[0]
        values = study.design.values(i)
        assert (row["payload"], row["link mass"]) == values
        alone = compute(study.case, values)
        assert {name: row[name] for name in alone} == alone


def test_the_dataset_does_not_depend_on_the_size_of_chunks(folder, monkeypatch):
    """Nor do its types: a factor of numbers and words, and a refused sample without a response."""
    monkeypatch.setattr("planner.studies.store._GROUP", 16)
    made = []
    for chunk in (3, 16, 50):
        text = SMALL.format(samples=30).replace("chunk = 5", f"chunk = {chunk}").replace("std = 1.0", "std = 8.0")
        mixed = '\n[[factors]]\nname = "mixed"\nkey = "boom.name"\nvalues = ["a", 1.5]\nsource = "this test"\n'
        (folder / "chunks.toml").write_text(text + mixed)
        store = Store(folder / "chunks.parquet", load_study(str(folder / "chunks.toml")))
        with store.opened(resume=False):
            run(store, workers=1)
            store.join(folder / "chunks.parquet")
            store.remove()
        made.append((folder / "chunks.parquet").read_bytes())
    assert made[0] == made[1] == made[2]
    table = pq.read_table(folder / "chunks.parquet")
    assert set(table["mixed"].to_pylist()) == {"a", "1.5"}
    assert set(table["status"].to_pylist()) == {"done", "infeasible", "refused"}


def test_chunks_grow_with_the_study_up_to_a_bound(folder):
    (folder / "plain.toml").write_text(SMALL.format(samples=8).replace("chunk = 5\n", ""))
    sizes = [load_study(str(folder / "plain.toml"), samples=samples).chunk for samples in (8, 2000, 100_000)]
    assert sizes == [10, 20, 250]


def test_an_interrupted_run_goes_on_with_nothing_computed_twice(folder):
    with pytest.raises(KeyboardInterrupt):
        make(folder, "stopped.parquet", track=stopped_after(7))
    kept = {part: part.stat().st_mtime_ns for part in parts(folder, "stopped.parquet")}
    assert len(kept) == 7
    with pytest.raises(InputError, match="holds chunks of an earlier run; --resume goes on"):
        make(folder, "stopped.parquet")
    with pytest.raises(KeyboardInterrupt):
        make(folder, "stopped.parquet", resume=True, track=stopped_after(3))
    assert len(parts(folder, "stopped.parquet")) == 10
    assert all(part.stat().st_mtime_ns == kept[part] for part in kept)
    with pytest.raises(InputError, match="its chunks are of another study; different: points, seed"):
        make(folder, "stopped.parquet", resume=True, seed=4)
    make(folder, "stopped.parquet", resume=True)
    assert (folder / "stopped.parquet").read_bytes() == (folder / "one.parquet").read_bytes()
    assert not (folder / "stopped.parquet.parts").exists()


def test_after_a_killed_worker_and_a_killed_run_the_dataset_is_the_same(folder):
    with running(folder, "--workers", "2", "--out", "two.parquet") as process:
        wait_until(lambda: parts(folder, "two.parquet"))
        os.kill(workers_of(process.pid)[0], signal.SIGKILL)
        wait_until(lambda: len(parts(folder, "two.parquet")) >= 3 or process.poll() is not None)
    make(folder, "two.parquet", resume=True)
    assert (folder / "two.parquet").read_bytes() == (folder / "one.parquet").read_bytes()


def test_two_workers_behind_a_scheduler_give_the_same_dataset(folder):
    log, started = folder / "scheduler.json", []
    quiet = {"cwd": folder, "env": ENVIRONMENT, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}

    def dask(*options):
        started.append(subprocess.Popen([sys.executable, "-m", "dask", *options, "--no-dashboard"], **quiet))

    try:
        dask("scheduler", "--host", "127.0.0.1", "--port", "18786", "--scheduler-file", str(log))
        for _ in range(2):
            dask("worker", "--scheduler-file", str(log), "--nworkers", "1", "--nthreads", "1", "--no-nanny")
        wait_until(log.exists)
        with running(folder, "--scheduler", "tcp://127.0.0.1:18786", "--out", "far.parquet") as process:
            _, err = process.communicate(timeout=100)
        assert process.returncode == 0, err
        assert (folder / "far.parquet").read_bytes() == (folder / "one.parquet").read_bytes()
    finally:
        for process in started:
            process.kill()
            process.wait()


def test_a_scheduler_that_does_not_answer_is_named(folder):
    with running(folder, "--scheduler", "tcp://127.0.0.1:1", "--out", "no.parquet") as process:
        _, err = process.communicate(timeout=100)
    assert process.returncode == 2
    assert err.startswith("boom: the scheduler tcp://127.0.0.1:1 does not answer")
    assert len(err.splitlines()) == 1
    assert not (folder / "no.parquet").exists()


def test_a_full_disk_is_one_line_and_the_run_can_go_on(folder, monkeypatch):
    write, calls = pq.write_table, []

    def full(table, place):
        calls.append(place)
        if len(calls) == 4:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write(table, place)

    with monkeypatch.context() as patched:
        patched.setattr(pq, "write_table", full)
        with pytest.raises(InputError, match=r"0000003\.parquet: cannot be written: No space left on device"):
            make(folder, "full.parquet")
    assert len(parts(folder, "full.parquet")) == 3
    make(folder, "full.parquet", resume=True)
    assert (folder / "full.parquet").read_bytes() == (folder / "one.parquet").read_bytes()
