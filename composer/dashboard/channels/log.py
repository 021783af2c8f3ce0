"""``log``: lines of /rosout, filtered before they are sent."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from composer.dashboard.declared import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.observing.log_lines import SEVERITIES_BY_NAME
from composer.dashboard.protocol.messages import Values, to_json
from composer.dashboard.protocol.outbox import Delivery, Update

if TYPE_CHECKING:
    from composer.dashboard.observing.log_lines import LogLine
    from composer.dashboard.ros_side import RosGraphSide

_MAX_HISTORY = 1000


class LogFeed(Feed):
    """The lines that pass the filters: first those that are known, then new ones."""

    delivery = Delivery.QUEUE
    is_shared = False  # each begins with its own history
    period_s = 0.2

    def __init__(self, values: Values, declared: Declared | None) -> None:
        """Read the parameters of the channel. Raises BadRequestError."""
        del declared
        self._severity = SEVERITIES_BY_NAME[
            values.choice("level", tuple(SEVERITIES_BY_NAME), "info")
        ]
        self._node = values.text("node", "").lower()
        self._text = values.text("text", "").lower()
        self._history = int(values.number("history", 200, 0, _MAX_HISTORY))
        values.end()
        self._next = 0
        self._is_first = True
        self._ros: RosGraphSide

    def start(self, ros: RosGraphSide) -> None:
        """Subscribe to /rosout."""
        self._ros = ros
        self._is_first = True
        ros.observed.log.acquire()

    def close(self) -> None:
        """Unsubscribe."""
        self._ros.observed.log.release()

    def poll(self) -> Iterator[Update]:
        """Yield new lines."""
        log = self._ros.observed.log
        log.poll()
        lines, missed, self._next = log.since(0 if self._is_first else self._next)
        shown = [line for line in lines if self._passes(line)]
        if self._is_first:
            missed, shown = 0, shown[max(0, len(shown) - self._history) :]
        if shown or missed or self._is_first:
            self._is_first = False
            data = {"lines": [_as_data(line) for line in shown]}
            yield Update(to_json(data), count=len(shown), dropped=missed)

    def _passes(self, line: LogLine) -> bool:
        return (
            line.severity >= self._severity
            and self._node in line.node.lower()
            and self._text in line.text.lower()
        )


def _as_data(line: LogLine) -> dict[str, Any]:
    level = next(
        (name for name, least in SEVERITIES_BY_NAME.items() if line.severity <= least), "fatal"
    )
    return {
        "at_s": line.at_s,
        "level": level,
        "node": line.node,
        "logger": line.logger,
        "text": line.text,
        "file": line.file,
        "line": line.line,
        "function": line.function,
    }
