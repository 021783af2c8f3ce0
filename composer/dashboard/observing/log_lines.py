"""The last lines of /rosout, while anything shows them."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any

from composer.qos import Durability, QosProfile, Reliability

if TYPE_CHECKING:
    from composer.remote.shared_session import SampledTopic, SharedSession

_TOPIC, _TYPE = "/rosout", "rcl_interfaces/msg/Log"
#: As the publishers of rcl: late joiners get the lines of the last ten seconds.
_PROFILE = QosProfile(
    depth=1000, reliability=Reliability.RELIABLE, durability=Durability.TRANSIENT_LOCAL
)
_MAX_LINES = 2000
_MAX_TAKEN = 500
_MAX_LENGTH = 4000


@dataclass(frozen=True, slots=True)
class LogLine:
    """A line of the log. ``severity`` is that of rcl_interfaces/msg/Log: 10 is debug, 50 fatal."""

    at_s: float
    severity: int
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

    def acquire(self) -> None:
        """Subscribe for the first user."""
        self._users += 1
        if self._sampled is None:
            self._sampled = self._session.sample(_TOPIC, _TYPE, _PROFILE)

    def release(self) -> None:
        """Unsubscribe after the last user, and forget the lines."""
        self._users -= 1
        if not self._users:
            self.close()

    def close(self) -> None:
        """Unsubscribe."""
        if self._sampled is not None:
            self._sampled.close()
            self._sampled = None
        self._lines.clear()

    def poll(self) -> None:
        """Take the lines that have arrived."""
        if self._sampled is not None:
            for sample in self._sampled.take(_MAX_TAKEN):
                self._lines.append(_line(sample.content))
                self._count += 1

    def since(self, number: int) -> tuple[list[LogLine], int, int]:
        """Return the lines from a number on, how many are gone already, and the next number."""
        first = self._count - len(self._lines)
        start = max(number, first)
        return list(islice(self._lines, start - first, None)), start - number, self._count


def _line(message: Any) -> LogLine:
    logger = str(message.name)
    return LogLine(
        at_s=message.stamp.sec + message.stamp.nanosec * 1e-9,
        severity=int(message.level),
        node=f"/{logger.replace('.', '/')}",
        logger=logger,
        text=message.msg[:_MAX_LENGTH],
        file=message.file,
        line=int(message.line),
        function=message.function,
    )
