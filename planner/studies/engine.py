"""The engine: a study's chunks on this process, on local processes, or on a Dask cluster.

A chunk depends on the study and its number alone, so the dataset does not depend on how many
workers there are, or on which of them did what.
"""

import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import islice
from typing import TYPE_CHECKING, Any

from boom_model.errors import BoomError, InputError
from planner.progress import Track
from planner.studies.extra import required
from planner.studies.sample import compute_chunk
from planner.studies.store import Store

if TYPE_CHECKING:
    import pyarrow as pa

_AHEAD = 3
"""Chunks under way for each worker: enough to keep it busy, few enough to keep memory flat."""

_ANSWER = 10.0  # [s] within which a scheduler must answer and have a worker
_DEATHS = 10
"""Workers that may die over one chunk before the run gives up."""


def run(
    store: Store,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    track: Track = iter,
) -> int:
    """Compute the chunks that are missing, and return how many there were.

    Args:
        store: the study and its finished chunks.
        workers: number of local processes; None is one for each core. With one, or with fewer
            than two chunks to compute, this process does the work itself.
        scheduler: address of a Dask scheduler that runs, in place of local processes.
        track: goes through the chunks, and may show progress.

    Raises:
        InputError: the scheduler does not answer or has no worker, its workers cannot import this
            package, or a file cannot be written.
        BoomError: workers die over a chunk again and again, or the scheduler is lost.
    """
    missing = store.missing()
    study = store.study
    if not missing:
        return 0
    count = min(os.cpu_count() or 1 if workers is None else workers, len(missing))
    if scheduler is None and count <= 1:
        for chunk in track(missing):
            store.write(chunk, compute_chunk(study.case, store.points(chunk), study.seed))
        return len(missing)
    with _client(count, scheduler) as client:
        done = _computed(client, store, missing)
        for _ in track(missing):
            store.write(*next(done))
    return len(missing)


def _computed(client: Any, store: Store, missing: list[int]) -> "Iterator[tuple[int, pa.Table]]":
    """Yield chunks as they are finished, with a few for each worker under way."""
    distributed = required("distributed")
    study, rest = store.study, iter(missing)
    ahead = max(len(client.scheduler_info(n_workers=-1)["workers"]), 1) * _AHEAD
    numbers: dict[str, int] = {}

    def submitted(count: int) -> list[Any]:
        futures = []
        for chunk in islice(rest, count):
            future = client.submit(compute_chunk, study.case, store.points(chunk), study.seed, pure=False)
            numbers[future.key] = chunk
            futures.append(future)
        return futures

    pending = distributed.as_completed(submitted(ahead))
    try:
        for future in pending:
            yield numbers.pop(future.key), future.result()
            future.release()
            for more in submitted(1):
                pending.add(more)
    except distributed.KilledWorker as error:
        raise BoomError(
            f"workers died {_DEATHS} times over one chunk of samples, the last at {error.last_worker.address}"
        ) from None
    except ImportError as error:
        raise InputError(f"the workers cannot import boom ({error}); install the same version beside them") from None
    except (OSError, distributed.CancelledError) as error:
        raise BoomError(f"the scheduler is lost: {error}; --resume goes on where it stopped") from None


@contextmanager
def _client(workers: int, scheduler: str | None) -> Iterator[Any]:
    """Yield a client of local processes or of a scheduler that runs.

    Raises:
        InputError: the scheduler does not answer or has no worker.
    """
    distributed, dask = required("distributed"), required("dask")
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    dask.config.set(
        {
            "distributed.scheduler.allowed-failures": _DEATHS,
            "distributed.admin.log-format": "%(message)s",
            # What would interrupt the samples up to a hundred times a second, for a dashboard that
            # nobody looks at.
            "distributed.worker.profile.enabled": False,
            "distributed.admin.tick.interval": "1s",
            "distributed.admin.system-monitor.interval": "10s",
            # Each connection would keep its last 1,000 messages, with the study in every one.
            "distributed.admin.low-level-log-length": 10,
            # Dask would have every array above 128 kB given back to the system at once; the next
            # sample would fetch the same pages again, which takes a tenth of its time.
            "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": None,
        }
    )
    if scheduler is None:
        # A killed run leaves its semaphores to Python's resource tracker, which would complain to
        # the user.
        os.environ.setdefault("PYTHONWARNINGS", "ignore::UserWarning:multiprocessing.resource_tracker")
        try:
            cluster = distributed.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                host="127.0.0.1",
                dashboard_address="127.0.0.1:0",
                silence_logs=logging.CRITICAL,
            )
        except RuntimeError as error:  # a worker was killed before it was ready
            raise BoomError(f"the local processes do not start: {error}; --resume goes on, --workers 1 needs none") from None
        with cluster, distributed.Client(cluster) as client:
            yield client
        return
    try:
        client = distributed.Client(scheduler, timeout=_ANSWER)
    except (OSError, ValueError, TimeoutError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"the scheduler {scheduler} does not answer: {reason}") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=_ANSWER)
        except TimeoutError:
            raise InputError(f"the scheduler {scheduler} has no worker; start one with: dask worker {scheduler}") from None
        yield client
