"""Counters of a node, updated where the events happen."""

from __future__ import annotations

from collections import Counter
from dataclasses import field
from typing import Protocol

from composer.fast_dataclass import dataclass
from composer.runtime.metrics.histogram import Histogram


@dataclass(slots=True)
class CallbackStatistics:
    """The counters of the callbacks of one port or timer.

    ``kind`` is ``timer`` or the value of a :class:`composer.model.PortKind`. ``lateness`` is for
    timers: the time from when a call is due to its start. ``overruns`` counts calls that took
    longer than their ``budget_ms``. ``dropped`` counts messages that a full queue dropped, or calls
    of a timer that were skipped because the previous one was still running.
    """

    kind: str
    name: str
    times: Histogram = field(default_factory=Histogram)
    lateness: Histogram = field(default_factory=Histogram)
    overruns: int = 0
    dropped: int = 0

    def __str__(self) -> str:
        return f"{self.kind} '{self.name}'"


class HasCount(Protocol):
    """Counts the messages that pass through it, in an attribute because that costs least."""

    count: int


class MessageCount:
    """The messages of a port, across its configurations, each of which creates new endpoints."""

    __slots__ = ("_before", "_current")

    def __init__(self) -> None:
        self._before = 0
        self._current: HasCount | None = None

    @property
    def count(self) -> int:
        """The number of messages so far."""
        return self._before + (0 if self._current is None else self._current.count)

    def begin(self, current: HasCount) -> None:
        """Include the messages that ``current`` counts from now on."""
        self._current = current

    def end(self) -> None:
        """Keep the count and release the current endpoint."""
        self._before = self.count
        self._current = None


@dataclass(slots=True)
class ChainStatistics:
    """The latencies of a chain, and how many exceeded its ``latency_ms``."""

    name: str
    latency_ms: float
    times: Histogram = field(default_factory=Histogram)
    late: int = 0

    def add(self, latency_s: float) -> None:
        """Add the latency of data that reached the end of the chain."""
        self.times.add(latency_s)
        self.late += latency_s * 1e3 > self.latency_ms


@dataclass(slots=True)
class Statistics:
    """The counters of one node. See ``NodeSummary`` for their meaning.

    ``qos_events`` counts the events of :mod:`composer.runtime.ports.qos_events` by name. Without
    ``tracing``, callbacks are not timed.
    """

    tracing: bool = True
    calls: int = 0
    dropped: int = 0
    skipped: int = 0
    errors: int = 0
    qos_events: Counter[str] = field(default_factory=Counter)
    callbacks: dict[tuple[str, str], CallbackStatistics] = field(default_factory=dict)
    publishers: dict[str, MessageCount] = field(default_factory=dict)
    subscriptions: dict[str, MessageCount] = field(default_factory=dict)

    def publisher(self, name: str) -> MessageCount:
        """Return the message count of a publisher, a new one the first time."""
        return self.publishers.setdefault(name, MessageCount())

    def subscription(self, name: str) -> MessageCount:
        """Return the message count of a subscription, a new one the first time."""
        return self.subscriptions.setdefault(name, MessageCount())

    def callback(self, kind: str, name: str) -> CallbackStatistics:
        """Return the counters of a port or timer, new ones the first time."""
        return self.callbacks.setdefault((kind, name), CallbackStatistics(kind, name))

    @property
    def sent(self) -> int:
        """The number of messages that all publishers have sent."""
        return sum(publisher.count for publisher in tuple(self.publishers.values()))

    @property
    def received(self) -> int:
        """The number of messages that all subscriptions received while the node was active."""
        return sum(subscription.count for subscription in tuple(self.subscriptions.values()))

    @property
    def sent_by_port(self) -> dict[str, int]:
        """The number of messages that each publisher has sent."""
        return {name: counted.count for name, counted in tuple(self.publishers.items())}

    @property
    def received_by_port(self) -> dict[str, int]:
        """The number of messages that each subscription received while the node was active."""
        return {name: counted.count for name, counted in tuple(self.subscriptions.items())}

    @property
    def dropped_by_port(self) -> dict[str, int]:
        """The number of messages that the full queue of a subscription dropped, if any."""
        return {
            callback.name: callback.dropped
            for callback in tuple(self.callbacks.values())
            if callback.dropped and callback.name in self.subscriptions
        }

    @property
    def busy_s(self) -> float:
        """The total time that callbacks kept a thread."""
        return sum(callback.times.total_s for callback in tuple(self.callbacks.values()))

    @property
    def slowest(self) -> str:
        """The callback with the longest call, and its duration: ``timer 'tick' 12.3 ms``."""
        known = tuple(self.callbacks.values())
        callback = max(known, key=lambda item: item.times.longest_s, default=None)
        if callback is None or not callback.times.longest_s:
            return ""
        return f"{callback} {callback.times.longest_s * 1e3:.1f} ms"

    @property
    def overruns(self) -> int:
        """The number of calls that took longer than their ``budget_ms``."""
        return sum(callback.overruns for callback in tuple(self.callbacks.values()))

    @property
    def queue_drops(self) -> int:
        """The number of messages that full queues dropped, including skipped timer calls."""
        return sum(callback.dropped for callback in tuple(self.callbacks.values()))
