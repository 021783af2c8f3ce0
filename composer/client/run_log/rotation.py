"""Numbered log files of limited size: a new one when one is full; the oldest is removed.

No file is renamed, so a reader that follows the log misses nothing.
"""

from __future__ import annotations

import os
import re
from contextlib import suppress
from pathlib import Path

MAX_FILE_BYTES = 10 * 1024 * 1024
MAX_FILES = 5
_NAME = re.compile(r"log-(\d{6,12})\.jsonl")


def log_files(folder: Path) -> list[Path]:
    """Return the log files in ``folder``, oldest first."""
    with suppress(OSError):
        found = [(int(match[1]), path) for path in folder.iterdir() if (match := _match(path))]
        return [path for _, path in sorted(found)]
    return []


class RotatingFile:
    """Writes lines to numbered files in a folder. Use it from one thread."""

    def __init__(
        self, folder: Path, max_bytes: int = MAX_FILE_BYTES, max_files: int = MAX_FILES
    ) -> None:
        """Keep the newest ``max_files`` files of about ``max_bytes`` bytes."""
        self._folder = folder
        self._max_bytes = max_bytes
        self._max_files = max_files
        self._number = 0
        self._size = 0
        self._fd = -1
        self._is_line_complete = True

    def write(self, data: bytes) -> int:
        """Write the beginning of ``data``; return the number of bytes written. Raises OSError."""
        is_full = self._size >= self._max_bytes and self._is_line_complete
        if self._fd < 0 or is_full:
            self._open_next()
        count = os.write(self._fd, data[: self._end(data)])
        self._size += count
        self._is_line_complete = data[:count].endswith(b"\n")
        return count

    def close(self) -> None:
        """Close the file."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1

    def _end(self, data: bytes) -> int:
        """Return how much of ``data`` belongs into this file: up to the line that fills it."""
        newline = data.find(b"\n", max(0, self._max_bytes - self._size - 1))
        return len(data) if newline < 0 else newline + 1

    def _open_next(self) -> None:
        path = self._path(self._number + 1)
        fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
        self.close()
        self._fd, self._size, self._number = fd, 0, self._number + 1
        with suppress(OSError):
            self._path(self._number - self._max_files).unlink(missing_ok=True)

    def _path(self, number: int) -> Path:
        return self._folder / f"log-{number:06}.jsonl"


def _match(path: Path) -> re.Match[str] | None:
    return _NAME.fullmatch(path.name)
