"""Reads the log of a system: of its run, and of processes that its run does not log.

Each line of a log file is a record; a selection says which ones to show.
"""

from __future__ import annotations

import heapq
import json
import os
import re
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO

from composer.base.characters import escape_line
from composer.base.fast_dataclass import dataclass
from composer.base.files import NotRegularError, open_regular
from composer.client.run_log import Run, find_parts, find_runs, log_files
from composer.model.names import PROGRAM_LOGGER, is_selected

_MICROSECOND_NS = 1000
_SECOND_NS = 1_000_000_000
_END_NS = 2**63  # of the times of ROS, in the year 2262
_EPOCH = datetime.fromtimestamp(0, UTC)
LEVELS = ("debug", "info", "warn", "error", "fatal")
_PART = re.compile(r"(\d+(?:\.\d+)?)(ms|s|m|h|d)")
_UNITS_S = {"ms": 0.001, "s": 1.0, "m": 60.0, "h": 3600.0, "d": 86_400.0}
_MAX_LINE_BYTES = 1_000_000
_POLL_S = 0.1
#: What a process says about states, the one that coordinates it says as well.
_INFO = "info"


@dataclass(frozen=True, slots=True)
class Record:
    """A line of the log. ``time_ns`` counts from the Unix epoch.

    ``logger`` is the name of the logger, such as ``planning.planner``; ``node`` the full name of
    the node that the line is about, or empty. ``level`` is in lower case, such as ``warn``.
    """

    time_ns: int
    level: str
    logger: str
    node: str
    message: str

    def content(self) -> dict[str, str]:
        """Return the record as plain data; the time is in UTC, with microseconds."""
        seconds, rest_ns = divmod(self.time_ns, _SECOND_NS)
        time = datetime.fromtimestamp(seconds, UTC).replace(microsecond=rest_ns // _MICROSECOND_NS)
        return {
            "time": time.isoformat(timespec="microseconds").replace("+00:00", "Z"),
            "level": self.level,
            "node": self.node,
            "logger": self.logger,
            "message": self.message,
        }

    def to_line(self) -> str:
        """Return the record as a line of JSON, with its newline."""
        return f"{json.dumps(self.content(), ensure_ascii=False)}\n"


def parse_line(line: bytes) -> Record | None:
    """Return the record in a line of a log file; None if it is not one, as after a full disk.

    All but the message is safe to be shown in one line.
    """
    try:
        content: dict[str, Any] = json.loads(line)
        texts = {key: content[key] for key in ("level", "logger", "node", "message")}
        since_epoch = datetime.fromisoformat(content["time"]) - _EPOCH
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
        return None
    seconds = since_epoch.days * 86_400 + since_epoch.seconds
    time_ns = seconds * _SECOND_NS + since_epoch.microseconds * _MICROSECOND_NS
    if not (0 <= time_ns < _END_NS and all(isinstance(text, str) for text in texts.values())):
        return None
    message = texts.pop("message")
    safe = {key: escape_line(text) for key, text in texts.items()}
    return Record(time_ns=time_ns, message=message, **safe)


@dataclass(frozen=True, slots=True)
class Selection:
    """Selects records by their node, time and level.

    ``nodes`` are full names, last parts of names, or patterns; without any, all nodes are selected.
    ``level`` is the minimum level.
    """

    nodes: tuple[str, ...] = ()
    since_ns: int = 0
    level: str = LEVELS[0]

    def __contains__(self, record: Record) -> bool:
        return (
            record.time_ns >= self.since_ns
            and _rank(record.level) >= _rank(self.level)
            and (not self.nodes or any(is_of_node(record, node) for node in self.nodes))
        )


def is_of_node(record: Record, name: str) -> bool:
    """Return whether a record is about a node, or of a child of its logger."""
    return is_selected(record.node, name) or is_selected(record.node, f"{name}/*")


def parse_since(text: str, now: datetime) -> int | None:
    """Return the time of ``text`` in nanoseconds since the epoch; None if it is not one.

    It is a duration before ``now``, such as ``10m`` or ``1h30m``, or a time in ISO 8601, by default
    in the local time zone.
    """
    parts = _PART.findall(text)
    try:
        if parts and "".join(number + unit for number, unit in parts) == text:
            seconds = sum(float(number) * _UNITS_S[unit] for number, unit in parts)
            at = now - timedelta(seconds=seconds)
        else:
            at = datetime.fromisoformat(text)
        return int(at.timestamp() * _SECOND_NS)
    except (ValueError, OverflowError, OSError):
        return None


def _rank(level: str) -> int:
    """Return the rank of a level; an unknown one is shown in any case."""
    return LEVELS.index(level) if level in LEVELS else len(LEVELS)


class RunReader:
    """Reads the records of a run, each of them once."""

    def __init__(self, run: Run) -> None:
        self._run = run
        self._path: Path | None = None
        self._file: BinaryIO | None = None
        self._incomplete = b""

    def new(self) -> Iterator[Record]:
        """Yield the records that have been written since the last call. Raises OSError."""
        while True:
            later = self._later_files()  # first: a file with a successor does not grow any more
            for line in self._lines():
                if (record := parse_line(line)) is not None:
                    yield record
            if not later:
                return
            self.close()
            self._path = later[0]
            try:
                self._file = open_regular(self._path)
            except (FileNotFoundError, NotRegularError):  # the oldest file may just be removed
                continue

    def close(self) -> None:
        """Close the file that is being read."""
        if self._file is not None:
            self._file.close()
        self._file, self._incomplete = None, b""

    def _lines(self) -> Iterator[bytes]:
        """Yield the lines since the last call; of a longer one than any record, the end."""
        while self._file is not None and (part := self._file.readline(_MAX_LINE_BYTES)):
            self._incomplete = (self._incomplete + part)[-_MAX_LINE_BYTES:]
            if part.endswith(b"\n"):
                line, self._incomplete = self._incomplete, b""
                yield line

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


class SystemLog:
    """The records of a run and of its processes, in the order of their times, each of them once.

    What a process has logged belongs to the run that was the last one to start before, and to the
    first run if there was none.
    """

    def __init__(self, logs: Path, run: Run) -> None:
        """Find the processes of a run in ``logs``, the ROS log folder."""
        self._logs = logs
        self._run = run
        self._reader = RunReader(run)
        self._parts: dict[Path, RunReader] = {}
        same = (run.system, run.domain)
        runs = [each for each in find_runs(logs, run.system) if (each.system, each.domain) == same]
        names = [each.name for each in runs]
        number = names.index(run.name) if run.name in names else 0
        self._from_ns = _start_ns(run) if number > 0 else 0
        self._next = runs[number + 1] if number + 1 < len(runs) else None

    def __enter__(self) -> SystemLog:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        for reader in (self._reader, *self._parts.values()):
            reader.close()

    def new(self) -> Iterator[Record]:
        """Yield the records that have been written since the last call. Raises OSError."""
        for part in find_parts(self._logs, self._run):
            if part.folder not in self._parts and self._may_contain(part):
                self._parts[part.folder] = RunReader(part)
        parts = (filter(self._belongs, reader.new()) for reader in self._parts.values())
        return heapq.merge(self._reader.new(), *parts, key=lambda record: record.time_ns)

    def follow(self, wait: Callable[[float], None] = time.sleep) -> Iterator[Record]:
        """Yield new records until the process of the run has ended. Raises OSError.

        ``wait(seconds)`` is called while there are none.
        """
        while True:
            is_running = self._run.is_running()  # first: what it wrote before its end is read below
            yield from self.new()
            if not is_running:
                return
            wait(_POLL_S)

    def _may_contain(self, part: Run) -> bool:
        is_later = self._next is not None and part.name > self._next.name
        return not is_later and part.written_ns() >= self._from_ns

    def _belongs(self, record: Record) -> bool:
        if record.logger == PROGRAM_LOGGER and record.level == _INFO:
            return False
        is_later = self._next is not None and record.time_ns >= _start_ns(self._next)
        return not is_later and record.time_ns >= self._from_ns


def _start_ns(run: Run) -> int:
    return int(run.started.timestamp() * 1000) * (_SECOND_NS // 1000)
