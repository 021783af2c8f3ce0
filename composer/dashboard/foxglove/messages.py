"""The messages that a client subscribes to, and those that it publishes."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping

from composer.dashboard.foxglove.catalog import Channel
from composer.dashboard.foxglove.frames import WARNING, ClientMessage, number, status
from composer.dashboard.foxglove.link import Link, Running
from composer.dashboard.foxglove.topics import PublishedFeed, TopicFeed
from composer.dashboard.protocol.messages import BadRequestError, RequestError, Values
from composer.dashboard.protocol.outbox import Update

#: Of one client.
_MAX_SUBSCRIPTIONS = 1000
_MAX_CHANNELS = 100
_MAX_ITEMS = 10_000
_SKIPPED = "there are more bytes than the dashboard reads of one topic"


class Subscriptions:
    """The subscriptions of a client to channels of the server."""

    def __init__(self, link: Link) -> None:
        self._link = link
        self._running: dict[int, tuple[int, Running]] = {}
        self._slow: set[int] = set()

    def subscribe(self, values: Values, channels: Mapping[int, Channel]) -> None:
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
                raise BadRequestError(f"you have subscribed to '{channel.topic}' already")
            if len(self._running) >= _MAX_SUBSCRIPTIONS:
                raise RequestError("too_many", f"{_MAX_SUBSCRIPTIONS} subscriptions are the limit")
            feed = TopicFeed(channel)
            self._link.outbox.open(identifier, channel.topic, feed.delivery)
            take = self._sender(identifier, channel.topic)
            running = self._link.start(f"channel {channel.id}", feed, take)
            self._running[identifier] = channel.id, running

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
        _, running = self._running.pop(identifier)
        self._slow.discard(identifier)
        self._link.outbox.close(identifier)
        self._link.stop(running)

    def _sender(self, identifier: int, topic: str) -> Callable[[Update], None]:
        outbox = self._link.outbox
        skipped, reported = 0, 0

        def send(update: Update) -> None:
            nonlocal skipped, reported
            if update.is_error:
                self._link.say_error(update)
                return
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
        self._running: dict[int, tuple[PublishedFeed, Running]] = {}

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
            running = self._link.start(f"publisher {identifier}", feed, self._link.say_error)
            self._running[identifier] = feed, running

    def unadvertise(self, values: Values) -> None:
        """Destroy publishers as a message requests. Raises RequestError."""
        for item in values.items("channelIds", _MAX_ITEMS):
            identifier = number(item, "channelIds")
            self._find(identifier)
            self._end(identifier)

    def publish(self, message: ClientMessage) -> None:
        """Publish a message. Raises RequestError."""
        self._link.check_may_change("publishing")
        feed, running = self._find(message.channel)
        feed.put(message.data)
        self._link.poll_soon(running)

    def end(self) -> None:
        """Destroy all publishers."""
        for identifier in tuple(self._running):
            self._end(identifier)

    def _end(self, identifier: int) -> None:
        feed, running = self._running.pop(identifier)
        self._link.stop(running)
        feed.forget()
        self._link.outbox.budget.give(feed.size)

    def _find(self, identifier: int) -> tuple[PublishedFeed, Running]:
        found = self._running.get(identifier)
        if found is None:
            raise BadRequestError(f"you have not advertised channel {identifier}")
        return found
