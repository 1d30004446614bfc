"""Slow work of one tab, off the event loop."""

import asyncio
import threading
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from boom_model import BoomError
from planner.progress import Track

T = TypeVar("T")


class Worker:
    """Runs one job at a time in a thread.

    A new job, or `stop`, ends the one before at its next step.
    """

    def __init__(self, progress: Callable[[str, float | None], None]) -> None:
        """Args: progress: is told title and share of the running job; ("", None) when none runs."""
        self._progress = progress
        self._stopped: threading.Event | None = None

    @property
    def is_busy(self) -> bool:
        """Whether a job runs."""
        return self._stopped is not None

    async def run(
        self, title: str, work: Callable[[Track], T], done: Callable[[T], None], refused: Callable[[str], None]
    ) -> None:
        """Run a job, and tell its result or its refusal on the event loop, unless it was stopped.

        Args:
            title: of the job.
            work: the job; it goes through its steps with the function that it is given.
            done: takes the result.
            refused: takes the message of a BoomError.
        """
        self.stop()
        stopped = self._stopped = threading.Event()
        loop = asyncio.get_running_loop()
        self._progress(title, 0.0)

        def show(share: float) -> None:
            if not stopped.is_set():
                self._progress(title, share)

        def track(steps: list[Any]) -> Iterable[Any]:
            for k, step in enumerate(steps):
                if stopped.is_set():
                    raise _Stopped
                loop.call_soon_threadsafe(show, k / len(steps))
                yield step

        try:
            result = await loop.run_in_executor(None, work, track)
        except _Stopped:
            return
        except BoomError as error:
            if not stopped.is_set():
                refused(str(error))
        else:
            if not stopped.is_set():
                done(result)
        finally:
            if self._stopped is stopped:
                self._stopped = None
                self._progress("", None)

    def stop(self) -> None:
        """End the running job at its next step; its result is dropped."""
        if self._stopped is not None:
            self._stopped.set()
            self._stopped = None
            self._progress("", None)


class _Stopped(Exception):  # noqa: N818 - it is no error
    """Ends a job that was stopped."""
