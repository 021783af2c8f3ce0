"""Feeds of messages: those of a topic, simulated time, and those that a client publishes."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import TYPE_CHECKING

from composer.dashboard.feeds import Feed
from composer.dashboard.foxglove.catalog import Channel
from composer.dashboard.observing.large_messages import LARGE_TYPES
from composer.dashboard.protocol.errors import BadRequestError, RequestError, from_ros
from composer.dashboard.protocol.messages import to_json
from composer.dashboard.protocol.outbox import Delivery, Update
from composer.qos import QosProfile, Reliability

if TYPE_CHECKING:
    from composer.dashboard.observing.topic_reader import TopicReader
    from composer.dashboard.ros_side import RosGraphSide
    from composer.remote.messages.serialized import SerializedPublisher
    from composer.remote.shared_session import SampledTopic

_DEPTH = 200
_POLL_S = 0.02
_CLOCK_S = 0.05
_CLOCK_PROFILE = QosProfile(depth=1, reliability=Reliability.BEST_EFFORT)
#: Messages of a client that wait to be published.
_MAX_WAITING = 256


class TopicFeed(Feed):
    """The messages of a topic, as bytes.

    Of large messages, a client gets the latest, and all clients share one subscription. Of others,
    each has a subscription of its own, so that it gets the latched messages.
    """

    period_s = _POLL_S

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self.is_shared = channel.type in LARGE_TYPES
        self.delivery = Delivery.LATEST if self.is_shared else Delivery.QUEUE
        self._lost = 0
        self._reader: TopicReader

    def start(self, ros: RosGraphSide) -> None:
        """Begin to read."""
        from composer.dashboard.observing.topic_reader import TopicReader

        self._reader = TopicReader(ros, self._channel.topic, self._channel.type, _DEPTH)

    def poll(self) -> Iterator[Update]:
        """Yield the messages that have arrived."""
        for sample in self._reader.take(_DEPTH):
            lost, self._lost = self._reader.lost - self._lost, self._reader.lost
            yield Update(sample.content, dropped=lost, at_ns=sample.received_ns)

    def close(self) -> None:
        """Unsubscribe."""
        self._reader.close()


class ClockFeed(Feed):
    """The simulated time."""

    period_s = _CLOCK_S

    def __init__(self) -> None:
        self._clock: SampledTopic

    def start(self, ros: RosGraphSide) -> None:
        """Subscribe."""
        self._clock = ros.session.sample("/clock", "rosgraph_msgs/msg/Clock", _CLOCK_PROFILE)

    def poll(self) -> Iterator[Update]:
        """Yield the latest time."""
        for sample in self._clock.take(1):
            stamp = sample.content.clock
            yield Update(b"", at_ns=stamp.sec * 10**9 + stamp.nanosec)

    def close(self) -> None:
        """Unsubscribe."""
        self._clock.close()


class PublishedFeed(Feed):
    """The messages that a client publishes on one of its channels.

    They are published in their order, on the thread of feeds; the updates are only errors.
    """

    is_shared = False
    changes = True

    def __init__(self, topic: str, type_name: str, encoding: str) -> None:
        """Raise BadRequestError for an encoding other than CDR."""
        if encoding != "cdr":
            raise BadRequestError(
                f"the encoding of '{topic:.80}' must be cdr, not '{encoding:.20}'"
            )
        self.topic = topic
        package, *folder, name = type_name.split("/")
        # Some clients write package/Name.
        self._type_name = f"{package}/msg/{name}" if not folder else type_name
        self._waiting: deque[bytes] = deque()
        self._publisher: SerializedPublisher | None = None

    def put(self, data: bytes) -> None:
        """Add a message, on any thread. Raises RequestError if too many wait."""
        if len(self._waiting) >= _MAX_WAITING:
            raise RequestError("busy", f"'{self.topic}': {_MAX_WAITING} messages wait already")
        self._waiting.append(data)

    def start(self, ros: RosGraphSide) -> None:
        """Create the publisher."""
        from composer.dashboard.publishing import suitable_profile
        from composer.remote.messages.serialized import SerializedPublisher

        profile = suitable_profile(ros, self.topic)
        self._publisher = SerializedPublisher(ros.session, self.topic, self._type_name, profile)

    def poll(self) -> Iterator[Update]:
        """Publish what waits; yield errors."""
        from composer.remote.session import RosError

        assert self._publisher is not None  # noqa: S101 - set by start
        while self._waiting:
            try:
                self._publisher.publish(self._waiting.popleft())
            except RosError as error:
                failed = from_ros(error)
                message = to_json({**failed.as_data(), "message": f"'{self.topic}': {failed}"})
                yield Update(message, is_error=True)

    def close(self) -> None:
        """Destroy the publisher."""
        if self._publisher is not None:
            self._publisher.close()
