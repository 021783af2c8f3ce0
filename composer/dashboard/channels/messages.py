"""``echo``, ``plot`` and ``image``: messages of topics; ``log``: lines of /rosout, filtered."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from composer.dashboard.context import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.observing.log_lines import SEVERITIES_BY_NAME
from composer.dashboard.observing.topics import TopicReader
from composer.dashboard.protocol.messages import (
    BadRequestError,
    RequestError,
    Values,
    json_safe,
    to_json,
)
from composer.dashboard.protocol.outbox import Delivery, Update

if TYPE_CHECKING:
    from composer.dashboard.observing.log_lines import LogLine


_ECHO_PERIOD_S = 0.1
#: Drops are reported with the next message, or after this time.
_DROPS_PERIOD_S = 1.0
_ECHO_DEPTH = 200
_MAX_TAKEN = 400
_PLOT_DEPTH = 1000
_MAX_SERIES = 16
IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
#: Larger compressed pictures are not sent: only the browser could make them smaller.
_MAX_COMPRESSED = 4 * 1024 * 1024
_MAX_WIDTH = 1920
_FORMATS = {b"\xff\xd8": "jpeg", b"\x89P": "png"}
_MAX_HISTORY = 1000


class EchoFeed(Feed):
    """The latest messages since the last poll; those beyond the rate are counted as dropped.

    Messages are deserialized only if they are sent.
    """

    delivery = Delivery.QUEUE
    period_s = _ECHO_PERIOD_S

    def __init__(self, values: Values, _: Declared | None) -> None:
        self._topic = values.text("topic")
        self._max_hz = values.number("max_hz", 10.0, 0.1, 100.0)
        self._max_items = int(values.number("max_items", 64, 1, 1024))
        self._allowed = 1.0
        self._dropped = 0
        self._sent_s = 0.0
        self._reader: TopicReader

    def start(self) -> None:
        """Prepare to read the topic."""
        self._reader = self.ros.reader(self._topic, None, _ECHO_DEPTH)
        self.resources.callback(self._reader.close)

    def poll(self) -> Iterator[Update]:
        """Yield the messages since the last poll."""
        self._allowed = min(self._allowed + self._max_hz * _ECHO_PERIOD_S, max(1.0, self._max_hz))
        samples = self._reader.take(_MAX_TAKEN)
        if not samples:
            return
        count = min(len(samples), int(self._allowed))
        self._allowed -= count
        self._dropped += len(samples) - count + sum(self._reader.missed)
        now_s = time.monotonic()
        if not count and now_s < self._sent_s + _DROPS_PERIOD_S:
            return
        messages = [
            {"at_s": sample.at_s, "value": self._shown(self._reader.message(sample))}
            for sample in samples[len(samples) - count :]
        ]
        data = {"topic": self._topic, "type": self._reader.type_name, "messages": messages}
        dropped, self._dropped, self._sent_s = self._dropped, 0, now_s
        yield Update(to_json(data), count=count, dropped=dropped)

    def _shown(self, message: Any) -> Any:
        """Return a message as plain data."""
        from composer.client.messages.values import to_short_plain

        return json_safe(to_short_plain(message, self._max_items))


class PlotFeed(Feed):
    """The values of several series, in batches. Series of the same topic share a subscription."""

    delivery = Delivery.QUEUE
    period_s = 0.1

    def __init__(self, values: Values, _: Declared | None) -> None:
        self._series: dict[str, list[str]] = {}
        for item in values.items("series", _MAX_SERIES):
            series = Values(item, "a series")
            fields = self._series.setdefault(series.text("topic"), [])
            fields.append(series.text("field"))
            series.end()
        if not self._series:
            raise BadRequestError("'series' is empty")
        self._readers: list[TopicReader] = []

    def start(self) -> None:
        """Prepare to read the topics."""
        self._readers = [self.ros.reader(topic, None, _PLOT_DEPTH) for topic in self._series]
        for reader in self._readers:
            self.resources.callback(reader.close)

    def poll(self) -> Iterator[Update]:
        """Yield all values since the last poll."""
        series: list[dict[str, Any]] = []
        count = dropped = 0
        for reader in self._readers:
            samples = reader.take(_PLOT_DEPTH)
            count += len(samples)
            dropped += sum(reader.missed)
            at_s = [sample.at_s for sample in samples]
            messages = [reader.message(sample) for sample in samples]
            for field in self._series[reader.topic] if samples else ():
                numbers = [_number(message, field) for message in messages]
                named = {"topic": reader.topic, "field": field}
                series.append({**named, "at_s": at_s, "values": numbers})
        if count:
            yield Update(to_json({"series": series}), count=count, dropped=dropped)


def _number(message: Any, path: str) -> Any:
    """Return the number at a path of a message. Raises InvalidValueError, BadRequestError."""
    from composer.client.messages.values import part
    from composer.runtime.ros.messages import to_plain

    value = to_plain(part(message, path))
    if not isinstance(value, int | float):
        raise BadRequestError(f"'{path}' is not a number, but {value!r:.60}")
    return json_safe(float(value) if not isinstance(value, int) else int(value))


class ImageFeed(Feed):
    """The latest picture of an Image or CompressedImage, a few times per second, made smaller."""

    def __init__(self, values: Values, _: Declared | None) -> None:
        self._topic = values.text("topic")
        self.period_s = 1.0 / values.number("max_hz", 5.0, 0.1, 15.0)
        self._max_width = int(values.number("max_width", 640, 16, _MAX_WIDTH))
        self._reader: TopicReader

    def start(self) -> None:
        """Prepare to read the topic; all but the last message are dropped by DDS."""
        self._reader = self.ros.reader(self._topic, None, depth=1)
        self.resources.callback(self._reader.close)

    def poll(self) -> Iterator[Update]:
        """Yield the latest picture, if there is a new one."""
        samples = self._reader.take(3)
        if self._reader.type_name not in (IMAGE, COMPRESSED):
            raise BadRequestError(
                f"'{self._topic}' has no pictures: its type is {self._reader.type_name}"
            )
        if not samples:
            return
        message: Any = self._reader.message(samples[-1])
        header, data = self._picture(message)
        header["at_s"] = samples[-1].at_s
        dropped = sum(self._reader.missed) + len(samples) - 1
        yield Update(data, header=to_json(header), dropped=dropped)

    def _picture(self, message: Any) -> tuple[dict[str, Any], bytes]:
        from composer.dashboard.observing.pixels import UnsupportedImageError, to_rgba

        if self._reader.type_name == COMPRESSED:
            return _compressed(message)
        try:
            width, height, data = to_rgba(message, self._max_width)
        except UnsupportedImageError as error:
            raise RequestError("failed", str(error)) from error
        header = {
            "encoding": "rgba8",
            "width": width,
            "height": height,
            "source_width": message.width,
            "source_height": message.height,
            "source_encoding": message.encoding,
        }
        return header, data


def _compressed(message: Any) -> tuple[dict[str, Any], bytes]:
    data = bytes(message.data)
    encoding = _FORMATS.get(data[:2])
    if encoding is None or len(data) > _MAX_COMPRESSED:
        raise RequestError(
            "failed",
            f"the picture is not a JPEG or PNG of at most {_MAX_COMPRESSED} bytes:"
            f" format '{message.format:.40}', {len(data)} bytes",
        )
    return {"encoding": encoding, "source_encoding": message.format}, data


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
