"""``plot``: numeric fields of topics over time, every message."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from composer.dashboard.declared import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.observing.topic_reader import TopicReader
from composer.dashboard.protocol.messages import BadRequestError, Values, json_safe, to_json
from composer.dashboard.protocol.outbox import Delivery, Update

if TYPE_CHECKING:
    from composer.dashboard.ros_side import RosGraphSide

_DEPTH = 1000
_MAX_SERIES = 16


class PlotFeed(Feed):
    """The values of several series, in batches. Series of the same topic share a subscription."""

    delivery = Delivery.QUEUE
    period_s = 0.1

    def __init__(self, values: Values, declared: Declared | None) -> None:
        """Read the parameters of the channel. Raises BadRequestError."""
        del declared
        self._series: dict[str, list[str]] = {}
        for item in values.items("series", _MAX_SERIES):
            series = Values(item, "a series")
            fields = self._series.setdefault(series.text("topic"), [])
            fields.append(series.text("field"))
            series.end()
        values.end()
        if not self._series:
            raise BadRequestError("'series' is empty")
        self._lost = 0
        self._readers: list[TopicReader] = []

    def start(self, ros: RosGraphSide) -> None:
        """Prepare to read the topics."""
        self._readers = [TopicReader(ros, topic, None, _DEPTH) for topic in self._series]

    def close(self) -> None:
        """Unsubscribe."""
        for reader in self._readers:
            reader.close()

    def poll(self) -> Iterator[Update]:
        """Yield all values since the last poll."""
        series: list[dict[str, Any]] = []
        count = 0
        for reader in self._readers:
            samples = reader.take(_DEPTH)
            if samples:
                count += len(samples)
                at_s = [sample.at_s for sample in samples]
                messages = [reader.message(sample) for sample in samples]
                for field in self._series[reader.topic]:
                    numbers = [_number(message, field) for message in messages]
                    series.append(
                        {"topic": reader.topic, "field": field, "at_s": at_s, "values": numbers}
                    )
        lost = sum(reader.lost for reader in self._readers)
        dropped, self._lost = lost - self._lost, lost
        if count:
            yield Update(to_json({"series": series}), count=count, dropped=dropped)


def _number(message: Any, path: str) -> Any:
    """Return the number at a path of a message. Raises InvalidValueError, BadRequestError."""
    from composer.client.messages.values import part, to_plain

    value = to_plain(part(message, path))
    if not isinstance(value, int | float):
        raise BadRequestError(f"'{path}' is not a number, but {value!r:.60}")
    return json_safe(float(value) if not isinstance(value, int) else int(value))
