"""Read files that may be anything, and write whole ones.

A folder can hold pipes, devices and files without an end. Only regular files are opened, also
through symbolic links, and at most a given size is read. So reading never waits, and never takes
more memory than that.
"""

from __future__ import annotations

import errno
import os
import stat
from contextlib import suppress
from io import BufferedReader
from pathlib import Path

_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
}


class NotRegularError(OSError):
    """A path leads to something else than a regular file; ``strerror`` says to what."""


class FileTooLargeError(OSError):
    """A file is larger than the reader allows."""


def open_regular(path: Path) -> BufferedReader:
    """Open a regular file for reading. Raises OSError; ValueError for a path with a null byte."""
    # Checked before opening, since opening a device can have side effects, and again after, since
    # the file may have been replaced in between.
    _require_regular(path, path.stat().st_mode)
    flags = os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC | os.O_NOCTTY
    file = os.fdopen(os.open(path, flags), "rb")
    try:
        _require_regular(path, os.fstat(file.fileno()).st_mode)
    except OSError:
        file.close()
        raise
    return file


def read_regular(path: Path, limit: int) -> bytes:
    """Return the content of a regular file of at most ``limit`` bytes.

    Raises OSError; ValueError for a path with a null byte.
    """
    with open_regular(path) as file:
        data = file.read(limit + 1)
    if len(data) > limit:
        message = f"it is larger than {limit:,} bytes"
        raise FileTooLargeError(errno.EFBIG, message, str(path))
    return data


def write_whole(path: Path, text: str) -> None:
    """Write a new file, whole or not at all. Raises OSError, with the name of the file."""
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:  # on a full disk, it does not name the file
        with suppress(OSError):
            path.unlink()
        raise OSError(error.errno, error.strerror, str(path)) from error


def _require_regular(path: Path, mode: int) -> None:
    if not stat.S_ISREG(mode):
        kind = _KINDS.get(stat.S_IFMT(mode), "something else")
        raise NotRegularError(errno.EINVAL, f"expected a file, found {kind}", str(path))
