"""The last lines of /rosout, while anything shows them.

What the nodes of this computer have logged before comes from the log files of their runs.
"""

from __future__ import annotations

import os
import time
from collections import Counter, deque
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import islice
from typing import TYPE_CHECKING, Any

from composer.base.fast_dataclass import dataclass
from composer.client.run_log import current_domain, find_parts, find_runs
from composer.client.run_log.reading import last_records
from composer.model import SEVERITIES
from composer.model.names import PROGRAM_LOGGER
from composer.model.qos import Durability, QosProfile, Reliability
from composer.runtime.middleware.environment import log_folder

if TYPE_CHECKING:
    from composer.client.shared_session import SampledTopic, SharedSession

_TOPIC, _TYPE = "/rosout", "rcl_interfaces/msg/Log"
#: As the publishers of rcl: late joiners get the lines of the last ten seconds.
_PROFILE = QosProfile(
    depth=1000, reliability=Reliability.RELIABLE, durability=Durability.TRANSIENT_LOCAL
)
_MAX_LINES = 2000
_MAX_TAKEN = 500
#: Of each log file, as much as has about that many lines.
_MAX_BYTES = 500_000
_MAX_LENGTH = 4000
#: Of the names in a line, which any node can publish.
_MAX_NAME = 500
SEVERITIES_BY_NAME = {level.value: number for level, number in SEVERITIES.items()}


@dataclass(frozen=True, slots=True)
class LogLine:
    """A line of the log. ``level`` is one of SEVERITIES_BY_NAME."""

    at_s: float
    level: str
    node: str
    logger: str
    text: str
    file: str
    line: int
    function: str


class LogLines:
    """The last lines, with a number for each. Use it on the thread of feeds."""

    def __init__(self, session: SharedSession) -> None:
        self._session = session
        self._users = 0
        self._sampled: SampledTopic | None = None
        self._lines: deque[LogLine] = deque(maxlen=_MAX_LINES)
        self._count = 0
        #: How often the log files have each line, and when they were read.
        self._repeated: Counter[tuple[str, str]] = Counter()
        self._acquired_s = 0.0

    @contextmanager
    def used(self) -> Iterator[None]:
        """Collect lines in a ``with`` block; the first user subscribes, the last unsubscribes."""
        self._users += 1
        if self._sampled is None:
            self._sampled = self._session.sample(_TOPIC, _TYPE, _PROFILE)
            self._lines.extend(_lines_of_runs())
            self._count += len(self._lines)
            self._repeated = Counter(map(_identity, self._lines))
            self._acquired_s = time.time()
        try:
            yield
        finally:
            self._users -= 1
            if not self._users:
                self.close()

    def close(self) -> None:
        """Unsubscribe, and forget the lines."""
        if self._sampled is not None:
            self._sampled.close()
            self._sampled = None
        self._lines.clear()

    def poll(self) -> None:
        """Take the lines that have arrived."""
        if self._sampled is not None:
            for sample in self._sampled.take(_MAX_TAKEN):
                line = _line(sample.content)
                if self._is_repeated(line):
                    continue
                self._lines.append(line)
                self._count += 1

    def _is_repeated(self, line: LogLine) -> bool:
        """Return whether a line that was sent again, to a late joiner, is in a log file as well."""
        key = _identity(line)
        if line.at_s > self._acquired_s or not self._repeated[key]:
            return False
        self._repeated[key] -= 1
        return True

    def since(self, number: int) -> tuple[list[LogLine], int, int]:
        """Return the lines from a number on, how many are gone already, and the next number."""
        first = self._count - len(self._lines)
        start = max(number, first)
        return list(islice(self._lines, start - first, None)), start - number, self._count


def _identity(line: LogLine) -> tuple[str, str]:
    return line.logger, line.text


def _lines_of_runs() -> list[LogLine]:
    """Return the last lines of the nodes of all systems that run here, in this ROS domain."""
    logs = log_folder(os.environ)
    if logs is None:
        return []
    domain = current_domain()
    records = [
        record
        for whole in find_runs(logs)
        if whole.domain == domain and whole.is_running()
        for run in (whole, *(part for part in find_parts(logs, whole) if part.is_running()))
        for record in last_records(run, _MAX_BYTES)
        if record.logger != PROGRAM_LOGGER
    ]
    records.sort(key=lambda record: record.time_ns)
    return [
        LogLine(
            at_s=record.time_ns * 1e-9,
            level=record.level if record.level in SEVERITIES_BY_NAME else "info",
            node=f"/{record.logger.replace('.', '/')}",
            logger=record.logger,
            text=record.message[:_MAX_LENGTH],
            file="",
            line=0,
            function="",
        )
        for record in records[-_MAX_LINES:]
    ]


def _line(message: Any) -> LogLine:
    logger = str(message.name)[:_MAX_NAME]
    level = next(
        (name for name, least in SEVERITIES_BY_NAME.items() if message.level <= least), "fatal"
    )
    return LogLine(
        at_s=message.stamp.sec + message.stamp.nanosec * 1e-9,
        level=level,
        node=f"/{logger.replace('.', '/')}",
        logger=logger,
        text=message.msg[:_MAX_LENGTH],
        file=message.file[:_MAX_NAME],
        line=int(message.line),
        function=message.function[:_MAX_NAME],
    )
