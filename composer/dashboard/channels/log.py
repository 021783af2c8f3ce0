"""``log``: lines of /rosout, filtered before they are sent."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING

from composer.dashboard.declared import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.observing.log_lines import SEVERITIES_BY_NAME
from composer.dashboard.protocol.messages import Values, to_json
from composer.dashboard.protocol.outbox import Delivery, Update

if TYPE_CHECKING:
    from composer.dashboard.observing.log_lines import LogLine

_MAX_HISTORY = 1000


class LogFeed(Feed):
    """The lines that pass the filters: first the last ones, then new ones."""

    delivery = Delivery.QUEUE
    is_shared = False  # each begins with its own history
    period_s = 0.2

    def __init__(self, values: Values, _: Declared | None) -> None:
        self._severity = SEVERITIES_BY_NAME[
            values.choice("level", tuple(SEVERITIES_BY_NAME), "info")
        ]
        self._node = values.text("node", "").lower()
        self._text = values.text("text", "").lower()
        self._history = int(values.number("history", 200, 0, _MAX_HISTORY))
        self._next = 0
        self._is_first = True

    def start(self) -> None:
        """Subscribe to /rosout."""
        self._is_first = True
        self.resources.enter_context(self.ros.log.used())

    def poll(self) -> Iterator[Update]:
        """Yield new lines."""
        log = self.ros.log
        log.poll()
        lines, missed, self._next = log.since(0 if self._is_first else self._next)
        shown = [line for line in lines if self._passes(line)]
        if self._is_first:
            missed, shown = 0, shown[max(0, len(shown) - self._history) :]
        if shown or missed or self._is_first:
            self._is_first = False
            data = {"lines": [asdict(line) for line in shown]}
            yield Update(to_json(data), count=len(shown), dropped=missed)

    def _passes(self, line: LogLine) -> bool:
        return (
            SEVERITIES_BY_NAME[line.level] >= self._severity
            and self._node in line.node.lower()
            and self._text in line.text.lower()
        )
