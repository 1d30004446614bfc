"""Whole files or none: written under a temporary name and moved into place."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from boom_model.errors import InputError


@contextmanager
def replacing(path: str | Path) -> Iterator[str]:
    """A temporary name beside `path` to write to; moved onto `path` when the block ends well, removed when it does not.

    Raises:
        InputError: the folder is missing or cannot be written to, or the disk refuses; an old file is left as it was.
    """
    path = Path(path)
    if path.is_dir():
        raise InputError(f"{path}: cannot be written: it is a folder")
    try:
        handle, temporary = tempfile.mkstemp(prefix=f".{path.name}.", suffix=path.suffix, dir=path.parent)
        os.close(handle)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)  # mkstemp's own mode would hide the file from everyone else
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None
    finally:
        with suppress(FileNotFoundError):
            os.unlink(temporary)
