"""What a client subscribes to and publishes, the simulated time, and how anything is sent to it."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Collection, Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

from composer.dashboard.feeds import Feed
from composer.dashboard.foxglove.catalog import Offer, Offers
from composer.dashboard.foxglove.encoding import CDR, ERROR, WARNING, ClientMessage, number, status
from composer.dashboard.observing.topics import LARGE_TYPES
from composer.dashboard.protocol.messages import (
    BadRequestError,
    RequestError,
    Values,
    from_ros,
    to_json,
)
from composer.dashboard.protocol.outbox import Budget, Delivery, Outbox, Update
from composer.dashboard.web.client import POLICY_VIOLATION, Client, End
from composer.model.qos import QosProfile, Reliability

if TYPE_CHECKING:
    from composer.client.messages.topics import TopicPublisher
    from composer.client.shared_session import SampledTopic
    from composer.dashboard.observing.topics import TopicReader

#: Of one client.
_MAX_SUBSCRIPTIONS = 1000
_MAX_CHANNELS = 100
_MAX_ITEMS = 10_000
#: Messages of a client that wait to be published.
_MAX_WAITING = 256
_SKIPPED = "there are more bytes than the dashboard reads of one topic"
_DEPTH = 200
_POLL_S = 0.02
_CLOCK_S = 0.05
_CLOCK_PROFILE = QosProfile(depth=1, reliability=Reliability.BEST_EFFORT)


class Link(Client):
    """The connection of one client of the protocol, without what it requests."""

    @property
    def outbox(self) -> Outbox:
        """What waits to be sent."""
        return self._outbox

    def post(self, content: dict[str, Any] | bytes) -> None:
        """Send something that must not get lost; a client that does not read is disconnected."""
        if not self._outbox.is_full_of_replies:
            self._outbox.reply(content if isinstance(content, bytes) else to_json(content))
        elif self._is_open:
            self._is_open = False
            self._spawn(partial(self._close, POLICY_VIOLATION, "messages are not read"))

    def say(self, level: int, message: str) -> None:
        """Send a message for the user of the client."""
        self.post(status(level, message))

    def refuse(self, error: RequestError) -> None:
        """Say why a request is refused."""
        self.say(ERROR, error_text(error))

    def say_error(self, update: Update) -> None:
        """Send the error of a feed."""
        error = json.loads(update.data)
        self.say(WARNING, error_text(RequestError(error["code"], error["message"], error["hint"])))

    def follow(self, name: str, feed: Feed, take: Any) -> End:
        """Receive a feed, whose errors are said; ``take`` gets its other updates."""

        def receive(update: Update) -> None:
            if update.is_error:
                self.say_error(update)
            else:
                take(update)

        return self.start(f"foxglove {name}", feed, receive)


def error_text(error: RequestError | Any) -> str:
    """Return an error with its hint."""
    return f"{error} ({error.hint})" if error.hint else str(error)


class TopicFeed(Feed):
    """The messages of a topic, as bytes.

    All clients share one subscription to large messages, and get the latest one. For other
    messages, each client has a subscription of its own, so that it gets the latched messages.
    """

    period_s = _POLL_S

    def __init__(self, channel: Offer) -> None:
        self._channel = channel
        self.is_shared = channel.type in LARGE_TYPES
        self.delivery = Delivery.LATEST if self.is_shared else Delivery.QUEUE
        self._reader: TopicReader

    def start(self) -> None:
        """Begin to read."""
        self._reader = self.ros.reader(self._channel.name, self._channel.type, _DEPTH)
        self.resources.callback(self._reader.close)

    def poll(self) -> Iterator[Update]:
        """Yield the messages that have arrived."""
        samples = self._reader.take(_DEPTH)
        for sample, missed in zip(samples, self._reader.missed, strict=True):
            yield Update(sample.content, dropped=missed, at_ns=sample.received_ns)


class ClockFeed(Feed):
    """The simulated time."""

    period_s = _CLOCK_S

    def __init__(self) -> None:
        self._clock: SampledTopic

    def start(self) -> None:
        """Subscribe."""
        self._clock = self.ros.session.sample("/clock", "rosgraph_msgs/msg/Clock", _CLOCK_PROFILE)
        self.resources.callback(self._clock.close)

    def poll(self) -> Iterator[Update]:
        """Yield the latest time."""
        for sample in self._clock.take(1):
            stamp = sample.content.clock
            yield Update(b"", at_ns=stamp.sec * 10**9 + stamp.nanosec)


class PublishedFeed(Feed):
    """The messages that a client publishes on one of its channels.

    They are published in their order, on the thread of feeds; the updates are only errors.
    """

    is_shared = False

    def __init__(self, topic: str, type_name: str, encoding: str, budget: Budget) -> None:
        """Raise BadRequestError for an encoding other than CDR, and for a wrong type."""
        if encoding != CDR:
            raise BadRequestError(
                f"the encoding of '{topic:.80}' must be {CDR}, not '{encoding:.20}'"
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
        self._publisher: TopicPublisher
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
        self.poll_soon()

    def forget(self) -> None:
        """Discard what waits, on any thread."""
        while self._take() is not None:
            pass

    def start(self) -> None:
        """Create the publisher; what waits is lost if that is not possible."""
        from composer.client.messages.topics import TopicPublisher
        from composer.dashboard.channels.sending import suitable_profile

        try:
            profile = suitable_profile(self.ros, self.topic)
            session = self.ros.session
            self._publisher = TopicPublisher(session, self.topic, self._type_name, profile)
        except Exception as error:
            self._problem = f"{error!s:.200}"
            self.forget()
            raise
        self.resources.callback(self._publisher.close)
        self._problem = ""

    def poll(self) -> Iterator[Update]:
        """Publish what waits; yield errors."""
        from composer.client.session import RosError

        while (data := self._take()) is not None:
            try:
                self._publisher.publish_checked(data)
            except RosError as error:
                failed = from_ros(error)
                message = to_json({**failed.as_data(), "message": f"'{self.topic}': {failed}"})
                yield Update(message, is_error=True)

    def _take(self) -> bytes | None:
        try:
            data = self._waiting.popleft()
        except IndexError:
            return None
        self._budget.give(len(data))
        return data


class Subscriptions:
    """The subscriptions of a client to channels of the server."""

    def __init__(self, link: Link) -> None:
        self._link = link
        self._running: dict[int, tuple[int, End]] = {}
        self._slow: set[int] = set()

    def subscribe(self, values: Values, channels: Offers) -> None:
        """Subscribe as a message requests. Raises RequestError."""
        for item in values.items("subscriptions", _MAX_ITEMS):
            wanted = Values(item, "a subscription")
            identifier = number(wanted.any("id"), "id")
            wanted_channel = number(wanted.any("channelId"), "channelId")
            channel = channels.get(wanted_channel)
            if channel is None:
                raise BadRequestError(f"there is no channel {wanted_channel}")
            if identifier in self._running:
                raise BadRequestError(f"the subscription {identifier} exists already")
            if any(known == channel.id for known, _ in self._running.values()):
                raise BadRequestError(f"you have subscribed to '{channel.name}' already")
            if len(self._running) >= _MAX_SUBSCRIPTIONS:
                raise RequestError("too_many", f"{_MAX_SUBSCRIPTIONS} subscriptions are the limit")
            feed = TopicFeed(channel)
            self._link.outbox.open(identifier, channel.name, feed.delivery)
            send = self._sender(identifier, channel.name)
            self._running[identifier] = (
                channel.id,
                self._link.follow(f"channel {channel.id}", feed, send),
            )

    def unsubscribe(self, values: Values) -> None:
        """Unsubscribe as a message requests. Raises RequestError."""
        for item in values.items("subscriptionIds", _MAX_ITEMS):
            identifier = number(item, "subscriptionIds")
            if identifier not in self._running:
                raise BadRequestError(f"there is no subscription {identifier}")
            self._end(identifier)

    def end(self, gone: Collection[int] | None = None) -> None:
        """End the subscriptions to channels that are gone, by default all."""
        for identifier, (channel, _) in tuple(self._running.items()):
            if gone is None or channel in gone:
                self._end(identifier)

    def _end(self, identifier: int) -> None:
        _, end = self._running.pop(identifier)
        self._slow.discard(identifier)
        self._link.outbox.close(identifier)
        end()

    def _sender(self, identifier: int, topic: str) -> Callable[[Update], None]:
        outbox = self._link.outbox
        skipped, reported = 0, 0

        def send(update: Update) -> None:
            nonlocal skipped, reported
            outbox.put(identifier, update)
            skipped += update.dropped
            if skipped > 2 * reported:
                reported = skipped
                text = f"{skipped} messages of '{topic}' were skipped: {_SKIPPED}"
                self._link.post(status(WARNING, text, f"skipped {topic}"))
            if identifier not in self._slow and outbox.dropped(identifier) > skipped:
                self._slow.add(identifier)
                text = f"messages of '{topic}' are dropped: they are read too slowly"
                self._link.say(WARNING, text)

        return send


class Publications:
    """The channels on which a client publishes."""

    def __init__(self, link: Link) -> None:
        self._link = link
        self._running: dict[int, tuple[PublishedFeed, End]] = {}

    def advertise(self, values: Values) -> None:
        """Create publishers as a message requests. Raises RequestError."""
        self._link.check_may_change("publishing")
        for item in values.items("channels", _MAX_ITEMS):
            wanted = Values(item, "a channel")
            identifier = number(wanted.any("id"), "id")
            if identifier in self._running:
                raise BadRequestError(f"you have advertised channel {identifier} already")
            if len(self._running) >= _MAX_CHANNELS:
                raise RequestError("too_many", f"{_MAX_CHANNELS} channels are the limit")
            topic, type_name = wanted.text("topic"), wanted.text("schemaName")
            budget = self._link.outbox.budget
            feed = PublishedFeed(topic, type_name, wanted.text("encoding"), budget)
            budget.take(feed.size)
            end = self._link.start("foxglove publisher", feed, self._link.say_error)
            self._running[identifier] = feed, end

    def unadvertise(self, values: Values) -> None:
        """Destroy publishers as a message requests. Raises RequestError."""
        for item in values.items("channelIds", _MAX_ITEMS):
            identifier = number(item, "channelIds")
            self._find(identifier)
            self._end(identifier)

    def publish(self, message: ClientMessage) -> None:
        """Publish a message. Raises RequestError."""
        self._link.check_may_change("publishing")
        self._find(message.channel).put(message.data)

    def end(self) -> None:
        """Destroy all publishers."""
        for identifier in tuple(self._running):
            self._end(identifier)

    def _end(self, identifier: int) -> None:
        feed, end = self._running.pop(identifier)
        end()
        feed.forget()
        self._link.outbox.budget.give(feed.size)

    def _find(self, identifier: int) -> PublishedFeed:
        if identifier not in self._running:
            raise BadRequestError(f"you have not advertised channel {identifier}")
        return self._running[identifier][0]
