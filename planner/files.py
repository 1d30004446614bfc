"""Output files that are either all complete or all left as they were.

They are written in a hidden folder next to their destination and moved into place together.
"""

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
from boom_model.words import unknown

_PREFIX = ".boom-"
_TRIES = 20
_UNFINISHED: set[str] = set()
"""Hidden folders of this process, for `discard`."""


class Outputs:
    """Output files of one command, as a context manager.

    All of them move into place when the block ends without an exception, and none otherwise. Until
    then they are in a hidden folder next to their destination, which this process locks while it
    lives. A hidden folder without a lock was left by a killed process; the next process that writes
    there removes it.
    """

    def __init__(self, *paths: str | Path | None, inputs: Iterable[str | Path | None] = ()) -> None:
        """Check that the files can be written, before the work that fills them.

        Args:
            *paths: the files to write; None stands for no file.
            inputs: files that the same command reads.

        Raises:
            InputError: two of the files are the same; or a file is read as well, exists and is not
                a regular file, or has a folder that is missing or not writable.
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
        self.replaced = frozenset(given for place, given in self._given.items() if place.exists())
        """Names, as given, of files that were there before."""
        with self:
            pass

    def temporary(self, path: str | Path) -> str:
        """Return the name to write to instead of `path`.

        Other files in the folder of that name are moved into place as well.
        """
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
        """Return a message with the given names in place of the hidden ones."""
        for place, given in self._given.items():
            message = message.replace(self.temporary(place), given)
        for parent, (folder, _) in self._folders.items():
            message = message.replace(folder, str(parent))
        return message


@contextmanager
def replacing(path: str | Path) -> Iterator[str]:
    """Yield a temporary name to write to, which becomes `path` when the block ends.

    If the block raises, the temporary file is removed and an existing file is left as it was.

    Raises:
        InputError: the folder is missing or not writable, or writing fails.
    """
    with Outputs(path) as files:
        try:
            yield files.temporary(path)
        except OSError as error:
            raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None


def discard() -> None:
    """Remove unfinished files of this process, before it ends without unwinding."""
    for folder in list(_UNFINISHED):
        shutil.rmtree(folder, ignore_errors=True)


def named_file(folder: Path, name: str, kind: str) -> Path:
    """Return the path of a TOML file, given its name in a folder of the toolkit or its path.

    A name that ends in .toml is a path.

    Raises:
        InputError: there is no file of that name; the message lists the known names.
    """
    if name.endswith(".toml"):
        return Path(name)
    known = sorted(path.stem for path in folder.glob("*.toml"))
    if name not in known:
        raise unknown(kind, name, known, "a FILE.toml")
    return folder / f"{name}.toml"


def _require_regular(place: Path, given: str) -> None:
    try:
        if place.exists() and not place.is_file():
            raise InputError(f"{given}: cannot be written: it is no regular file")
    except OSError as error:  # a name that is too long, a folder that may not be entered
        raise InputError(f"{given}: cannot be written: {error.strerror}") from None


def _hidden_folder(parent: Path) -> tuple[str, int]:
    """Make a new folder in `parent`; return it and the handle of its lock."""
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
    """Remove the hidden folders in `parent` that no living process has locked."""
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
    """Lock a folder; return whether this process has the lock.

    On a file system without locks this is taken for granted.
    """
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Defer signals until the block ends. Only the main thread receives signals."""
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
