"""Read the records of a run, also while it goes on."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

from composer.base.regular_files import NotRegularError, open_regular
from composer.client.run_log.record import Record, parse_line
from composer.client.run_log.rotation import log_files
from composer.client.run_log.runs import Run

_MAX_LINE_BYTES = 1_000_000


class RunReader:
    """Reads the records of a run, each of them once."""

    def __init__(self, run: Run) -> None:
        self._run = run
        self._path: Path | None = None
        self._lines: _LineReader | None = None

    def new(self) -> Iterator[Record]:
        """Yield the records that have been written since the last call. Raises OSError."""
        while True:
            later = self._later_files()  # first: a file with a successor does not grow any more
            if self._lines is not None:
                for line in self._lines.lines():
                    if (record := parse_line(line)) is not None:
                        yield record
            if not later:
                return
            self.close()
            self._path = later[0]
            try:
                self._lines = _LineReader(open_regular(self._path))
            except (FileNotFoundError, NotRegularError):  # the oldest file may just be removed
                continue

    def close(self) -> None:
        """Close the file that is being read."""
        if self._lines is not None:
            self._lines.close()
            self._lines = None

    def _later_files(self) -> list[Path]:
        files = log_files(self._run.folder)
        return [file for file in files if self._path is None or file.name > self._path.name]


def last_records(run: Run, max_bytes: int) -> list[Record]:
    """Return the records in the last ``max_bytes`` of a run, as far as they can be read."""
    lines: list[bytes] = []
    for path in reversed(log_files(run.folder)):
        with suppress(OSError), open_regular(path) as file:
            size = file.seek(0, os.SEEK_END)
            file.seek(max(0, size - max_bytes))
            read = file.read(max_bytes).splitlines()
            lines[:0] = read if size <= max_bytes else read[1:]
            max_bytes -= min(size, max_bytes)
        if not max_bytes:
            break
    return [record for line in lines if (record := parse_line(line)) is not None]


class _LineReader:
    """Reads complete lines of a file that grows."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._incomplete = b""

    def lines(self) -> Iterator[bytes]:
        """Yield the lines since the last call; of a longer one than any record, the end."""
        while part := self._file.readline(_MAX_LINE_BYTES):
            self._incomplete = (self._incomplete + part)[-_MAX_LINE_BYTES:]
            if part.endswith(b"\n"):
                line, self._incomplete = self._incomplete, b""
                yield line

    def close(self) -> None:
        """Close the file."""
        self._file.close()
