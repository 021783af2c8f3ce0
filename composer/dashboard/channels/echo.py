"""``echo``: the messages of a topic, or fields of them, at a limited rate."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from composer.dashboard.declared import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.observing.topic_reader import TopicReader
from composer.dashboard.protocol.messages import Values, json_safe, to_json
from composer.dashboard.protocol.outbox import Delivery, Update

if TYPE_CHECKING:
    from composer.dashboard.ros_side import RosGraphSide

_PERIOD_S = 0.1
#: Drops are reported with the next message, or after this time.
_DROPS_PERIOD_S = 1.0
_DEPTH = 200
_MAX_TAKEN = 400
_MAX_FIELDS = 32


class EchoFeed(Feed):
    """The latest messages since the last poll; those beyond the rate are counted as dropped.

    Messages are deserialized only if they are sent.
    """

    delivery = Delivery.QUEUE
    period_s = _PERIOD_S

    def __init__(self, values: Values, declared: Declared | None) -> None:
        """Read the parameters of the channel. Raises BadRequestError."""
        del declared
        self._topic = values.text("topic")
        self._type = values.optional_text("type")
        self._fields = values.texts("fields", _MAX_FIELDS)
        self._max_hz = values.number("max_hz", 10.0, 0.1, 100.0)
        self._max_items = int(values.number("max_items", 64, 1, 1024))
        values.end()
        self._allowed = 1.0
        self._lost = 0
        self._dropped = 0
        self._sent_s = 0.0
        self._reader: TopicReader

    def start(self, ros: RosGraphSide) -> None:
        """Prepare to read the topic."""
        self._reader = TopicReader(ros, self._topic, self._type, _DEPTH)

    def close(self) -> None:
        """Unsubscribe."""
        self._reader.close()

    def poll(self) -> Iterator[Update]:
        """Yield the messages since the last poll."""
        self._allowed = min(self._allowed + self._max_hz * _PERIOD_S, max(1.0, self._max_hz))
        samples = self._reader.take(_MAX_TAKEN)
        if not samples:
            return
        count = min(len(samples), int(self._allowed))
        self._allowed -= count
        lost, self._lost = self._reader.lost - self._lost, self._reader.lost
        self._dropped += len(samples) - count + lost
        now_s = time.monotonic()
        if not count and now_s < self._sent_s + _DROPS_PERIOD_S:
            return
        messages = [
            {"at_s": sample.at_s, "value": self._shown(self._reader.message(sample))}
            for sample in samples[len(samples) - count :]
        ]
        dropped, self._dropped, self._sent_s = self._dropped, 0, now_s
        yield Update(to_json(self._data(messages)), count=count, dropped=dropped)

    def _data(self, messages: list[dict[str, Any]]) -> dict[str, Any]:
        return {"topic": self._topic, "type": self._reader.type_name, "messages": messages}

    def _shown(self, message: Any) -> Any:
        """Return a message, or the requested fields of it, as plain data."""
        from composer.client.messages.values import part, to_short_plain

        if not self._fields:
            return json_safe(to_short_plain(message, self._max_items))
        return {
            path: json_safe(to_short_plain(part(message, path), self._max_items))
            for path in self._fields
        }
