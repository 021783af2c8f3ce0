"""``publishing``: publishes a message again and again while it is subscribed to."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

from composer.dashboard.declared import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.protocol.messages import Values, to_json
from composer.dashboard.protocol.outbox import Update
from composer.dashboard.publishing import Outgoing, read_outgoing

if TYPE_CHECKING:
    from composer.dashboard.ros_side import RosGraphSide

_REPORT_PERIOD_S = 0.5


class PublishingFeed(Feed):
    """A publisher that repeats one message."""

    is_shared = False
    changes = True

    def __init__(self, values: Values, declared: Declared | None) -> None:
        """Read the parameters of the channel. Raises RequestError."""
        del declared
        self._outgoing: Outgoing = read_outgoing(values)
        self.period_s = 1.0 / values.number("rate_hz", 1.0, 0.01, 100.0)
        values.end()
        self._count = 0
        self._reported_s = 0.0

    def start(self, ros: RosGraphSide) -> None:
        """Create the publisher. Raises RosError."""
        self._outgoing.open(ros)

    def close(self) -> None:
        """Destroy the publisher."""
        self._outgoing.close()

    def poll(self) -> Iterator[Update]:
        """Publish, and yield the count from time to time."""
        self._outgoing.publish()
        self._count += 1
        now_s = time.monotonic()
        if now_s >= self._reported_s + _REPORT_PERIOD_S:
            self._reported_s = now_s
            data = {"count": self._count, "subscriptions": self._outgoing.subscriptions}
            yield Update(to_json(data))
