"""Writes messages of many sources on a thread of its own, so that no callback waits for a disk."""

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

from composer.bags.bag import BagError, BagMessage, BagTopic
from composer.runtime.clock.clock import Clock

_PERIOD_S = 0.02
#: What a source keeps at most until the thread has written it.
_QUEUE_BYTES = 64_000_000
_SHORTEST_QUEUE, _LONGEST_QUEUE = 16, 10_000


class Sink(Protocol):
    """What receives the messages, on the thread of the recorder."""

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

        ``number()`` counts those of all sources: in virtual time, many have the same time.
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

    def taken(self) -> list[tuple[int, int, Any, str]]:
        """Take what was put so far: the time, the number, the message, and the topic."""
        queue = self._queue
        return [(*queue.popleft(), self.topic) for _ in range(len(queue))]

    def note_size(self, size_bytes: int) -> None:
        """Limit the queue, given the size of a message."""
        fitting = _QUEUE_BYTES // max(size_bytes, 1)
        self.limit = min(max(fitting, _SHORTEST_QUEUE), _LONGEST_QUEUE)


class Recorder:
    """Passes messages to a sink. Use it as a context manager.

    In virtual time nothing is dropped: a publisher waits for a full queue, and the system does not
    notice the wait.
    """

    def __init__(self, sink: Sink, clock: Clock) -> None:
        self._sink = sink
        self._clock = clock
        self._sources: dict[str, Source] = {}
        self._numbers = count()
        self._lock = threading.RLock()
        self._calls: deque[tuple[float, Callable[[], None]]] = deque()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        #: Why nothing more is recorded; None while it is.
        self.problem: str | None = None

    def __enter__(self) -> Recorder:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Write the rest. Afterwards, ``problem`` says whether that failed."""
        self._ended.set()
        self._thread.join()
        self._drain()
        self._run_calls(inf)
        with self._lock:
            try:
                self._sink.close()
            except BagError as error:
                self.problem = self.problem or str(error)

    @property
    def dropped(self) -> int:
        """The number of messages that came faster than they were written."""
        return sum(source.dropped for source in tuple(self._sources.values()))

    def source(self, topic: BagTopic) -> Source:
        """Return what receives the messages of a topic."""
        with self._lock:
            self._sink.add_topic(topic)
            if topic.name not in self._sources:
                number = self._numbers.__next__
                source = Source(topic.name, self._clock.time_ns, number, self._make_room)
                self._sources[topic.name] = source
            return self._sources[topic.name]

    def call_later(self, delay_s: float, function: Callable[[], None]) -> None:
        """Call a function on the thread, with all messages until then in the sink."""
        self._calls.append((time.monotonic() + delay_s, function))

    def _make_room(self) -> bool:
        if self._clock.is_virtual and self.problem is None:
            self._drain()
        return self._clock.is_virtual

    def _run(self) -> None:
        while not self._ended.wait(_PERIOD_S):
            self._drain()
            self._run_calls(time.monotonic())

    def _run_calls(self, until_s: float) -> None:
        while self._calls and self._calls[0][0] <= until_s:
            _, function = self._calls.popleft()
            with self._lock:
                function()

    def _drain(self) -> None:
        with self._lock:
            messages = [item for source in self._sources.values() for item in source.taken()]
            if self.problem is not None:
                return
            messages.sort(key=itemgetter(0, 1))
            try:
                for at_ns, _, content, topic in messages:
                    self._write(at_ns, topic, content)
                self._sink.flush_if_due()
            except BagError as error:
                self.problem = str(error)

    def _write(self, at_ns: int, topic: str, content: Any) -> None:
        source = self._sources[topic]
        try:
            data = content if isinstance(content, bytes) else bytes(serialize_message(content))
        except Exception:  # a message that no publisher could send
            source.dropped += 1
            return
        source.note_size(len(data))
        self._sink.write(BagMessage(topic, at_ns, at_ns, data))
