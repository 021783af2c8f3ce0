"""Writes messages of many sources on threads of its own, so that no callback waits for a disk."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from itertools import count
from math import inf
from operator import itemgetter
from typing import Any, Protocol

from rclpy.serialization import serialize_message

from composer.bags.bag import NANOSECONDS, BagError, BagMessage, BagTopic
from composer.bags.writer import BagWriter
from composer.model.qos import Durability
from composer.runtime.clock import Clock

_SERIALIZE_PERIOD_S = 0.02
_WRITE_PERIOD_S = 0.1
#: Serialized messages that wait for the sink.
LARGEST_PENDING_BYTES = 256_000_000
#: Messages of one source that wait to be serialized.
_LARGEST_QUEUE_BYTES = 64_000_000
_SHORTEST_QUEUE, _LONGEST_QUEUE = 16, 10_000
#: The memory for the messages of a system; the oldest are discarded earlier if need be.
LARGEST_BYTES = 256_000_000


class Sink(Protocol):
    """What receives the messages, one call at a time."""

    def add_topic(self, topic: BagTopic) -> None:
        """Declare a topic."""

    def write(self, message: BagMessage) -> None:
        """Keep a message. Raises BagError."""

    def flush_if_due(self) -> None:
        """Do what is due without a message as well. Raises BagError."""

    def close(self) -> None:
        """Complete what was kept. Raises BagError."""


class Source:
    """Receives the messages of one topic, from any thread.

    ``dropped`` counts those that came faster than they were written.
    """

    __slots__ = ("_number", "_on_full", "_queue", "_time_ns", "dropped", "limit", "topic")

    def __init__(
        self,
        topic: str,
        time_ns: Callable[[], int],
        number: Callable[[], int],
        on_full: Callable[[], bool],
    ) -> None:
        """Receive the messages of a topic.

        ``number()`` counts the messages of all sources: in virtual time, many have the same time.
        ``on_full()`` may make room, and returns whether it has.
        """
        self.topic = topic
        self.dropped = 0
        self.limit = _LONGEST_QUEUE
        self._queue: deque[tuple[int, int, Any]] = deque()
        self._time_ns = time_ns
        self._number = number
        self._on_full = on_full

    def put(self, message: Any) -> None:
        """Record a message, or its serialized bytes."""
        if len(self._queue) >= self.limit and not self._on_full():
            self.dropped += 1
            return
        self._queue.append((self._time_ns(), self._number(), message))

    def taken(self) -> list[tuple[int, int, Any, Source]]:
        """Take what was put so far: the time, the number, the message, and the source."""
        queue = self._queue
        return [(*queue.popleft(), self) for _ in range(len(queue))]

    def note_size(self, size_bytes: int) -> None:
        """Limit the queue, given the size of a message."""
        fitting = _LARGEST_QUEUE_BYTES // max(size_bytes, 1)
        self.limit = min(max(fitting, _SHORTEST_QUEUE), _LONGEST_QUEUE)


class Recorder:
    """Passes messages to a sink. Use it as a context manager.

    One thread serializes messages, another one writes them. If the disk stalls, messages wait in a
    limited memory, and then they are dropped.

    In virtual time nothing is dropped: a publisher waits for a full queue, and the system does not
    notice the wait.
    """

    def __init__(
        self, sink: Sink, clock: Clock, on_problem: Callable[[str], None] = lambda _: None
    ) -> None:
        """``on_problem`` receives why nothing more is recorded, on the thread that writes."""
        self._sink = sink
        self._on_problem = on_problem
        self._clock = clock
        self._sources: dict[str, Source] = {}
        self._numbers = count()
        #: For the sink: a topic comes before its messages.
        self._pending: deque[BagTopic | BagMessage] = deque()
        self._serialized_bytes = self._written_bytes = 0  # each is changed under its own lock
        self._serializing, self._writing = threading.Lock(), threading.Lock()  # in this order
        self._calls: deque[tuple[float, Callable[[], None]]] = deque()
        self._ended = threading.Event()
        self._threads = [
            threading.Thread(target=self._repeat, args=args, name=name, daemon=True)
            for name, *args in (
                ("recorder", self._serialize, _SERIALIZE_PERIOD_S),
                ("bag writer", self._write_and_call, _WRITE_PERIOD_S),
            )
        ]
        #: Why nothing more is recorded; None while it is.
        self.problem: str | None = None

    def __enter__(self) -> Recorder:
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Write the rest. Afterwards, ``problem`` says whether that failed."""
        self._ended.set()
        for thread in self._threads:
            thread.join()
        self._write_and_call(until_s=inf)
        try:
            self._sink.close()
        except BagError as error:
            self.problem = self.problem or str(error)

    @property
    def dropped(self) -> int:
        """The number of messages that came faster than they were written."""
        return sum(source.dropped for source in tuple(self._sources.values()))

    def source(self, topic: BagTopic) -> Source:
        """Return what receives the messages of a topic. It does not wait for the sink."""
        self._pending.append(topic)
        clock, number = self._clock, self._numbers.__next__
        new = Source(topic.name, clock.time_ns, number, self._on_full)
        return self._sources.setdefault(topic.name, new)

    def call_later(self, delay_s: float, function: Callable[[], None]) -> None:
        """Call a function on the thread that writes, with all messages until then in the sink."""
        self._calls.append((time.monotonic() + delay_s, function))

    def _on_full(self) -> bool:
        if self._clock.is_virtual:
            self._serialize()
        return self._clock.is_virtual

    def _repeat(self, function: Callable[[], None], period_s: float) -> None:
        while not self._ended.wait(period_s):
            function()

    def _serialize(self) -> None:
        """Serialize what the sources have received, in the order in which they received it."""
        with self._serializing:
            sources = tuple(self._sources.values())
            messages = [item for source in sources for item in source.taken()]
            if self.problem is not None:
                return
            messages.sort(key=itemgetter(0, 1))
            for at_ns, _, content, source in messages:
                try:
                    data = content if isinstance(content, bytes) else serialize_message(content)
                except Exception:  # a message that no publisher could send
                    source.dropped += 1
                    continue
                source.note_size(len(data))
                if self._serialized_bytes - self._written_bytes > LARGEST_PENDING_BYTES:
                    if not self._clock.is_virtual:
                        source.dropped += 1
                        continue
                    self._write()
                message = BagMessage(source.topic, at_ns, at_ns, bytes(data))
                self._pending.append(message)
                self._serialized_bytes += message.memory_bytes

    def _write(self) -> None:
        """Pass what is pending to the sink, until there is a problem."""
        with self._writing:
            try:
                while self._pending:
                    item = self._pending.popleft()
                    if isinstance(item, BagTopic):
                        self._sink.add_topic(item)
                        continue
                    self._written_bytes += item.memory_bytes
                    if self.problem is None:
                        self._sink.write(item)
                if self.problem is None:
                    self._sink.flush_if_due()
            except BagError as error:
                self.problem = str(error)
                self._on_problem(self.problem)

    def _write_and_call(self, until_s: float | None = None) -> None:
        """Write what is pending, and make the calls that are due."""
        until_s = time.monotonic() if until_s is None else until_s
        is_due = bool(self._calls) and self._calls[0][0] <= until_s
        if is_due or until_s == inf:
            self._serialize()
        self._write()
        while self._calls and self._calls[0][0] <= until_s:
            _, function = self._calls.popleft()
            with self._writing:
                function()


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
