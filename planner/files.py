"""Whole files or none: written under a temporary name and moved into place."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from boom_model.errors import InputError


def check_writable(*paths: str | Path | None) -> None:
    """Whether files can be written there, one each, before the work that would fill them.

    Raises:
        InputError: as `replacing`, or two of them are the same file.
    """
    given = [os.path.realpath(path) for path in paths if path is not None]
    for i, path in enumerate(given):
        if path in given[:i]:
            raise InputError(f"{path}: cannot be written: it is to hold two things")
        os.unlink(_beside(Path(path)))


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


@contextmanager
def replacing(path: str | Path) -> Iterator[str]:
    """A temporary name beside `path` to write to; moved onto `path` when the block ends well, removed when it does not.

    Raises:
        InputError: the folder is missing or cannot be written to, or the disk refuses; an old file is left as it was.
    """
    path = Path(os.path.realpath(path))  # a link stays a link, and its target is replaced
    temporary = _beside(path)
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None
    finally:
        with suppress(FileNotFoundError):
            os.unlink(temporary)


def write_text(path: str | Path, text: str) -> None:
    """The text as a file.

    Raises:
        InputError: as `replacing`.
    """
    with replacing(path) as temporary:
        Path(temporary).write_text(text, encoding="utf-8")


def _beside(path: Path) -> str:
    """The name of a new, empty temporary file in the folder of `path`."""
    if path.exists() and not path.is_file():
        raise InputError(f"{path}: cannot be written: it is no regular file")
    try:
        handle, temporary = tempfile.mkstemp(prefix=f".{path.name}.", suffix=path.suffix, dir=path.parent)
        os.close(handle)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)  # mkstemp's own mode would hide the file from everyone else
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None
    return temporary
