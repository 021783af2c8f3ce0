"""``image``: pictures of sensor_msgs/Image and CompressedImage, sampled and made smaller."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from composer.dashboard.declared import Declared
from composer.dashboard.feeds import Feed
from composer.dashboard.observing.topic_reader import TopicReader
from composer.dashboard.protocol.messages import BadRequestError, RequestError, Values, to_json
from composer.dashboard.protocol.outbox import Update

if TYPE_CHECKING:
    from composer.dashboard.ros_side import RosGraphSide

IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
#: Larger compressed pictures are not sent: only the browser could make them smaller.
_MAX_COMPRESSED = 4 * 1024 * 1024
_MAX_WIDTH = 1920
_FORMATS = {b"\xff\xd8": "jpeg", b"\x89P": "png"}


class ImageFeed(Feed):
    """The latest picture, at most a few times per second."""

    def __init__(self, values: Values, declared: Declared | None) -> None:
        """Read the parameters of the channel. Raises BadRequestError."""
        del declared
        self._topic = values.text("topic")
        self.period_s = 1.0 / values.number("max_hz", 5.0, 0.1, 15.0)
        self._max_width = int(values.number("max_width", 640, 16, _MAX_WIDTH))
        values.end()
        self._lost = 0
        self._reader: TopicReader

    def start(self, ros: RosGraphSide) -> None:
        """Prepare to read the topic; all but the last message are dropped by DDS."""
        self._reader = TopicReader(ros, self._topic, None, depth=1)

    def close(self) -> None:
        """Unsubscribe."""
        self._reader.close()

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
        lost, self._lost = self._reader.lost - self._lost, self._reader.lost
        header, data = self._picture(message)
        header["at_s"] = samples[-1].at_s
        yield Update(data, header=to_json(header), dropped=lost + len(samples) - 1)

    def _picture(self, message: Any) -> tuple[dict[str, Any], bytes]:
        from composer.dashboard.observing.pixels import UnsupportedImageError, to_rgba

        if self._reader.type_name == COMPRESSED:
            return self._compressed(message)
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

    def _compressed(self, message: Any) -> tuple[dict[str, Any], bytes]:
        data = bytes(message.data)
        encoding = _FORMATS.get(data[:2])
        if encoding is None or len(data) > _MAX_COMPRESSED:
            raise RequestError(
                "failed",
                f"the picture is not a JPEG or PNG of at most {_MAX_COMPRESSED} bytes:"
                f" format '{message.format:.40}', {len(data)} bytes",
            )
        return {"encoding": encoding, "source_encoding": message.format}, data
