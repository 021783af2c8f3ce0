"""A flight recorder: keeps the last seconds in memory, to be written when something happens."""

from __future__ import annotations

from collections import deque

from composer.bags.bag import NANOSECONDS, BagMessage, BagTopic
from composer.bags.writer import BagWriter
from composer.model.qos import Durability

#: The memory for the messages of a system; the oldest are discarded earlier if need be.
LARGEST_BYTES = 256_000_000


class Ring:
    """Keeps the messages of the last ``seconds``, and the last one of each latched topic."""

    def __init__(self, seconds: float) -> None:
        self._length_ns = round(seconds * NANOSECONDS)
        self._topics: dict[str, BagTopic] = {}
        self._messages: deque[BagMessage] = deque()
        self._latched: dict[str, BagMessage] = {}
        self._size_bytes = 0

    def add_topic(self, topic: BagTopic) -> None:
        """Declare a topic."""
        self._topics[topic.name] = topic

    def write(self, message: BagMessage) -> None:
        """Keep a message."""
        self._messages.append(message)
        self._size_bytes += message.memory_bytes
        oldest_ns = message.recorded_ns - self._length_ns
        while self._messages[0].recorded_ns < oldest_ns or self._size_bytes > LARGEST_BYTES:
            self._discard()

    def flush_if_due(self) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""

    def save(self, writer: BagWriter) -> None:
        """Write what is kept, and keep it no longer: each message is written once.

        Latched messages from before are written with the time of the oldest message. Raises
        BagError.
        """
        for topic in self._topics.values():
            writer.add_topic(topic)
        if self._messages:
            start_ns = self._messages[0].recorded_ns
            for message in self._latched.values():
                writer.write(message._replace(recorded_ns=start_ns))
        while self._messages:
            writer.write(self._messages[0])
            self._discard()

    def _discard(self) -> None:
        message = self._messages.popleft()
        self._size_bytes -= message.memory_bytes
        profiles = self._topics[message.topic].qos
        if any(item.durability is Durability.TRANSIENT_LOCAL for item in profiles):
            self._latched[message.topic] = message
