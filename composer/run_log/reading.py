"""Read the records of a run, and follow them."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO

from composer.run_log.record import Record, parse_line
from composer.run_log.rotation import log_files
from composer.run_log.runs import Run

_POLL_S = 0.1


def read(run: Run) -> Iterator[Record]:
    """Yield the records that are in the files of a run now. Raises OSError."""
    for path in log_files(run.folder):
        try:
            with path.open("rb") as file:
                yield from _records(_LineReader(file).lines())
        except FileNotFoundError:  # removed just now, as the oldest file
            continue


def follow(run: Run, wait: Callable[[float], None] = time.sleep) -> Iterator[Record]:
    """Yield the records of a run until its process has ended. Raises OSError.

    ``wait(seconds)`` is called while there are no new ones.
    """
    last: Path | None = None
    while True:
        is_running = run.is_running()  # first: what it wrote before its end is read below
        for path in _files_after(run, last):
            last = path
            try:
                with path.open("rb") as file:
                    yield from _records(_grown_lines(run, path, file, wait))
            except FileNotFoundError:  # removed just now, as the oldest file
                continue
        if not is_running and not _files_after(run, last):
            return
        if last is None:
            wait(_POLL_S)


def _grown_lines(
    run: Run, path: Path, file: BinaryIO, wait: Callable[[float], None]
) -> Iterator[bytes]:
    """Yield the lines of a file until the next one exists or the process has ended."""
    reader = _LineReader(file)
    yield from reader.lines()
    while not _files_after(run, path) and run.is_running():
        wait(_POLL_S)
        yield from reader.lines()
    yield from reader.lines()


class _LineReader:
    """Reads complete lines of a file that grows."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._incomplete = b""

    def lines(self) -> Iterator[bytes]:
        """Yield the lines since the last call."""
        for part in self._file:
            self._incomplete += part
            if part.endswith(b"\n"):
                line, self._incomplete = self._incomplete, b""
                yield line


def _records(lines: Iterator[bytes]) -> Iterator[Record]:
    return (record for line in lines if (record := parse_line(line)) is not None)


def _files_after(run: Run, path: Path | None) -> list[Path]:
    return [file for file in log_files(run.folder) if path is None or file.name > path.name]
