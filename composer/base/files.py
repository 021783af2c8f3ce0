"""Files: read when they may be anything, written as a whole, and results that are kept in them.

A folder can hold pipes, devices and files without an end. Only regular files are opened, also
through symbolic links, and at most a given size is read. So reading never waits, and never takes
more memory than that.

Results are kept by the content of all that they depend on, in a folder that belongs to the user
alone. Whatever goes wrong with it, the result is computed again.
"""

from __future__ import annotations

import errno
import os
import stat
import tempfile
from collections.abc import Iterable
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
#: Results that are kept of one kind, and the most bytes of one.
_MAXIMUM_ENTRIES = 500
_MAXIMUM_BYTES = 1_000_000
_DIGEST_BYTES = 32


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


try:
    from _blake2 import blake2b  # hashlib also loads OpenSSL, which takes 3 ms of each start
except ImportError:
    from hashlib import blake2b


class KeptResult:
    """A result of one kind; ``data`` is None if it is not kept, or damaged."""

    def __init__(self, kind: str, state: Iterable[str]) -> None:
        """Look for the result that depends on ``state``."""
        digest = blake2b(digest_size=_DIGEST_BYTES)
        for part in state:
            digest.update(part.encode(errors="surrogatepass") + b"\0")
        self._path = _cache_folder() / "ros2-composer" / kind / digest.hexdigest()
        self.data = self._read()

    def keep(self, data: bytes) -> None:
        """Keep a result, unless it is too large; the oldest ones make room."""
        if len(data) > _MAXIMUM_BYTES:
            return
        with suppress(OSError):
            folder = self._path.parent
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            _remove_oldest(folder)
            written = self._path.with_suffix(f".{os.getpid()}")
            written.write_bytes(_checksum(data) + data)
            written.replace(self._path)

    def _read(self) -> bytes | None:
        with suppress(OSError, ValueError):
            if self._path.stat(follow_symlinks=False).st_uid == os.geteuid():
                content = read_regular(self._path, _DIGEST_BYTES + _MAXIMUM_BYTES)
                data = content[_DIGEST_BYTES:]
                return data if content == _checksum(data) + data else None
        return None


def _checksum(data: bytes) -> bytes:
    return blake2b(data, digest_size=_DIGEST_BYTES).digest()


def _cache_folder() -> Path:
    chosen = Path(os.environ.get("XDG_CACHE_HOME", ""))
    if chosen.is_absolute():
        return chosen
    try:
        return Path.home() / ".cache"
    except RuntimeError:  # in a container, users may be missing in /etc/passwd
        return Path(tempfile.gettempdir())


def _remove_oldest(folder: Path) -> None:
    entries = [*folder.iterdir()]
    if len(entries) >= _MAXIMUM_ENTRIES:
        for path in sorted(entries, key=lambda path: path.stat().st_mtime)[: len(entries) // 2]:
            path.unlink(missing_ok=True)
