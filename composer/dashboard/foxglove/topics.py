"""Feeds of messages: those of a topic, simulated time, and those that a client publishes."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import TYPE_CHECKING

from composer.dashboard.feeds import Feed
from composer.dashboard.foxglove.catalog import Channel
from composer.dashboard.observing.large_messages import LARGE_TYPES
from composer.dashboard.protocol.messages import BadRequestError, RequestError, from_ros, to_json
from composer.dashboard.protocol.outbox import Budget, Delivery, Update
from composer.model.qos import QosProfile, Reliability

if TYPE_CHECKING:
    from composer.client.messages.serialized import SerializedPublisher
    from composer.client.shared_session import SampledTopic
    from composer.dashboard.observing.topic_reader import TopicReader
    from composer.dashboard.ros_side import RosGraphSide

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

    def __init__(self, topic: str, type_name: str, encoding: str, budget: Budget) -> None:
        """Raise BadRequestError for an encoding other than CDR, and for a wrong type."""
        if encoding != "cdr":
            raise BadRequestError(
                f"the encoding of '{topic:.80}' must be cdr, not '{encoding:.20}'"
            )
        self.topic = topic
        package, separator, name = type_name.partition("/")
        if not package or not separator or not name:
            raise BadRequestError(
                f"'schemaName' must be a type such as std_msgs/msg/String, not '{type_name:.80}'"
            )
        # Some clients write package/Name.
        self._type_name = type_name if "/" in name else f"{package}/msg/{name}"
        self._budget = budget
        self._waiting: deque[bytes] = deque()
        self._publisher: SerializedPublisher | None = None
        self._problem = ""  # why there is no publisher

    @property
    def size(self) -> int:
        """The size of its names in bytes."""
        return len(self.topic) + len(self._type_name)

    def put(self, data: bytes) -> None:
        """Add a message, on any thread. Raises RequestError if it cannot wait."""
        if self._problem:
            raise RequestError("failed", f"'{self.topic:.80}': {self._problem}")
        if len(self._waiting) >= _MAX_WAITING:
            raise RequestError("busy", f"'{self.topic:.80}': {_MAX_WAITING} messages wait already")
        self._budget.take(len(data))
        self._waiting.append(data)

    def forget(self) -> None:
        """Discard what waits, on any thread."""
        while self._take() is not None:
            pass

    def start(self, ros: RosGraphSide) -> None:
        """Create the publisher; what waits is lost if that is not possible."""
        from composer.client.messages.serialized import SerializedPublisher
        from composer.dashboard.publishing import suitable_profile

        try:
            profile = suitable_profile(ros, self.topic)
            self._publisher = SerializedPublisher(ros.session, self.topic, self._type_name, profile)
        except Exception as error:
            self._problem = f"{error!s:.200}"
            self.forget()
            raise
        self._problem = ""

    def poll(self) -> Iterator[Update]:
        """Publish what waits; yield errors."""
        from composer.client.session import RosError

        assert self._publisher is not None  # noqa: S101 - set by start
        while (data := self._take()) is not None:
            try:
                self._publisher.publish(data)
            except RosError as error:
                failed = from_ros(error)
                message = to_json({**failed.as_data(), "message": f"'{self.topic}': {failed}"})
                yield Update(message, is_error=True)

    def close(self) -> None:
        """Destroy the publisher."""
        if self._publisher is not None:
            self._publisher.close()

    def _take(self) -> bytes | None:
        try:
            data = self._waiting.popleft()
        except IndexError:
            return None
        self._budget.give(len(data))
        return data
