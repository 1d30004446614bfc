"""Whole files or none: written in a hidden folder beside their place, and moved there together."""

import errno
import fcntl
import os
import shutil
import signal
import tempfile
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType

from boom_model.errors import InputError

_PREFIX = ".boom-"
_TRIES = 20
_UNFINISHED: set[str] = set()
"""Hidden folders of this process, for `discard`."""


class Outputs:
    """The files of one command: all of them move into place together when the block ends well, and none otherwise.

    A hidden folder stands beside the places until then, and a lock on it for as long as this process lives: a folder without
    one was left by a process that was killed, and the next to write there removes it.
    """

    def __init__(self, *paths: str | Path | None, inputs: Iterable[str | Path | None] = ()) -> None:
        """Checks that the files can be written, one each, before the work that fills them; None stands for no file.

        Args:
            inputs: files that the same command reads.

        Raises:
            InputError: two of the files are the same, one is read as well, it exists and is no regular file, or its folder is
                missing or cannot be written to.
        """
        read = {os.path.realpath(path) for path in inputs if path is not None}
        self._given: dict[Path, str] = {}
        self._folders: dict[Path, tuple[str, int]] = {}
        for path in paths:
            if path is None:
                continue
            place = Path(os.path.realpath(path))  # a link stays a link, and its target is replaced
            if place in self._given:
                raise InputError(f"{path}: cannot be written: it is to hold two things")
            if str(place) in read:
                raise InputError(f"{path}: cannot be written: the same command reads it")
            _require_regular(place, str(path))
            self._given[place] = str(path)
        with self:
            pass

    def temporary(self, path: str | Path) -> str:
        """Where to write what becomes `path`; what else is written in that folder is moved along."""
        place = Path(os.path.realpath(path))
        return os.path.join(self._folders[place.parent][0], place.name)

    def __enter__(self) -> "Outputs":
        for place, given in self._given.items():
            if place.parent not in self._folders:
                try:
                    _remove_abandoned(place.parent)
                    self._folders[place.parent] = _hidden_folder(place.parent)
                except OSError as error:
                    self._remove()
                    raise InputError(f"{given}: cannot be written: {error.strerror}") from None
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        try:
            if error is None:
                self._move()
            elif isinstance(error, InputError):
                raise InputError(self._named(str(error))) from None
        finally:
            self._remove()

    def _move(self) -> None:
        moves = [
            (Path(folder) / name, place / name)
            for place, (folder, _) in self._folders.items()
            for name in sorted(os.listdir(folder))
        ]
        for _, place in moves:
            _require_regular(place, self._given.get(place, str(place)))
        with _uninterrupted():
            for temporary, place in moves:
                try:
                    os.replace(temporary, place)
                except OSError as error:
                    given = self._given.get(place, place)
                    raise InputError(f"{given}: cannot be written: {error.strerror}") from None

    def _remove(self) -> None:
        for folder, lock in self._folders.values():
            shutil.rmtree(folder, ignore_errors=True)
            _UNFINISHED.discard(folder)
            os.close(lock)
        self._folders = {}

    def _named(self, message: str) -> str:
        """The message with the places in it, and not the hidden folders."""
        for place, given in self._given.items():
            message = message.replace(self.temporary(place), given)
        for parent, (folder, _) in self._folders.items():
            message = message.replace(folder, str(parent))
        return message


@contextmanager
def replacing(path: str | Path) -> Iterator[str]:
    """A temporary name to write to; moved onto `path` when the block ends well, removed when it does not.

    Raises:
        InputError: the folder is missing or cannot be written to, or the disk refuses; an old file is left as it was.
    """
    with Outputs(path) as files:
        try:
            yield files.temporary(path)
        except OSError as error:
            raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None


def discard() -> None:
    """Removes what this process has not finished writing, before it ends without unwinding."""
    for folder in list(_UNFINISHED):
        shutil.rmtree(folder, ignore_errors=True)


def named_file(folder: Path, name: str, kind: str) -> Path:
    """A TOML file by its name in a folder of the toolkit, or by its path (a name that ends in .toml).

    Raises:
        InputError: no file of that name; lists those there are.
    """
    if name.endswith(".toml"):
        return Path(name)
    known = sorted(path.stem for path in folder.glob("*.toml"))
    if name not in known:
        raise InputError(f"unknown {kind} {name!r}; there are: {', '.join(known)}, or a FILE.toml")
    return folder / f"{name}.toml"


def _require_regular(place: Path, given: str) -> None:
    try:
        if place.exists() and not place.is_file():
            raise InputError(f"{given}: cannot be written: it is no regular file")
    except OSError as error:  # a name that is too long, a folder that may not be entered
        raise InputError(f"{given}: cannot be written: {error.strerror}") from None


def _hidden_folder(parent: Path) -> tuple[str, int]:
    """A new folder in `parent` and the handle of its lock."""
    for _ in range(_TRIES):
        folder = tempfile.mkdtemp(prefix=_PREFIX, dir=parent)
        with suppress(FileNotFoundError, BlockingIOError):  # another process took it for abandoned
            handle = os.open(folder, os.O_RDONLY)
            if _lock(handle) and os.path.isdir(folder):
                _UNFINISHED.add(folder)
                return folder, handle
            os.close(handle)
    raise OSError(errno.EAGAIN, f"no hidden folder stays in {parent}")


def _remove_abandoned(parent: Path) -> None:
    """Removes the hidden folders in `parent` that no living process holds."""
    with os.scandir(parent) as entries:
        folders = [entry.path for entry in entries if entry.name.startswith(_PREFIX) and entry.is_dir(follow_symlinks=False)]
    for folder in folders:
        with suppress(OSError):  # it has gone meanwhile, belongs to somebody else, or is in use
            handle = os.open(folder, os.O_RDONLY)
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(folder, ignore_errors=True)
            finally:
                os.close(handle)


def _lock(handle: int) -> bool:
    """Whether the lock is this process's now; a file system without locks has nobody who could take it."""
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Puts signals off until the block ends; signals reach the main thread alone."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    held: list[int] = []
    stops = (signal.SIGINT, signal.SIGTERM)
    handlers = {stop: signal.signal(stop, lambda number, _: held.append(number)) for stop in stops}
    try:
        yield
    finally:
        for stop, handler in handlers.items():
            signal.signal(stop, signal.SIG_DFL if handler is None else handler)
        for number in held:
            signal.raise_signal(number)
