"""What a node has done so far, counted where it happens."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Protocol

from composer.runtime.metrics.histogram import Durations


@dataclass(slots=True)
class CallbackStatistics:
    """What is counted of the callbacks of one port or timer.

    ``kind`` is the word for what it is: ``timer``, or that of a :class:`composer.model.PortKind`.
    ``lateness`` is for timers: how long after its time a call begins. ``overruns`` are calls that
    took longer than their ``budget_ms``; ``dropped`` is what a full queue pushed out, of a timer
    the calls left out because the one before was not through.
    """

    kind: str
    name: str
    times: Durations = field(default_factory=Durations)
    lateness: Durations = field(default_factory=Durations)
    overruns: int = 0
    dropped: int = 0

    def __str__(self) -> str:
        return f"{self.kind} '{self.name}'"


class Counting(Protocol):
    """Counts the messages that pass through it: in itself, where that costs least."""

    count: int


class Tally:
    """How many messages have passed through a port, which is another each time it is configured."""

    __slots__ = ("_before", "_now")

    def __init__(self) -> None:
        self._before = 0
        self._now: Counting | None = None

    @property
    def count(self) -> int:
        """All of them."""
        return self._before + (0 if self._now is None else self._now.count)

    def begin(self, counting: Counting) -> None:
        """Add what ``counting`` counts, from now on."""
        self._now = counting

    def end(self) -> None:
        """Keep what was counted, and nothing of who did."""
        self._before = self.count
        self._now = None


@dataclass(slots=True)
class ChainStatistics:
    """What is counted of a chain: how long data took, and how often longer than it may."""

    name: str
    latency_ms: float
    times: Durations = field(default_factory=Durations)
    late: int = 0

    def take(self, took_s: float) -> None:
        """Count data that has come to the end."""
        self.times.take(took_s)
        self.late += took_s * 1e3 > self.latency_ms


@dataclass(slots=True)
class Statistics:
    """Counters of one node. See ``NodeSummary`` for their meaning.

    ``qos_events`` counts what :mod:`composer.runtime.ports.qos_events` tells of, by the name of the
    event. With ``tracing`` false, the times of callbacks are not taken.
    """

    tracing: bool = True
    calls: int = 0
    dropped: int = 0
    skipped: int = 0
    errors: int = 0
    qos_events: Counter[str] = field(default_factory=Counter)
    callbacks: dict[tuple[str, str], CallbackStatistics] = field(default_factory=dict)
    publishers: dict[str, Tally] = field(default_factory=dict)
    subscriptions: dict[str, Tally] = field(default_factory=dict)

    def publisher(self, name: str) -> Tally:
        """Return the tally of a publisher, from now on or as before."""
        return self.publishers.setdefault(name, Tally())

    def subscription(self, name: str) -> Tally:
        """Return the tally of a subscription, from now on or as before."""
        return self.subscriptions.setdefault(name, Tally())

    def callback(self, kind: str, name: str) -> CallbackStatistics:
        """Return where the callbacks of a port or timer are counted, from now on or as before."""
        return self.callbacks.setdefault((kind, name), CallbackStatistics(kind, name))

    @property
    def sent(self) -> int:
        """How many messages went through all publishers."""
        return sum(publisher.count for publisher in tuple(self.publishers.values()))

    @property
    def received(self) -> int:
        """How many messages came to all subscriptions while the node was active."""
        return sum(subscription.count for subscription in tuple(self.subscriptions.values()))

    @property
    def busy_s(self) -> float:
        """For how long callbacks kept their thread, all together."""
        return sum(callback.times.total_s for callback in tuple(self.callbacks.values()))

    @property
    def slowest(self) -> str:
        """The callback that took longest at once, and how long: ``timer 'tick' 12.3 ms``."""
        known = tuple(self.callbacks.values())
        callback = max(known, key=lambda item: item.times.longest_s, default=None)
        if callback is None or not callback.times.longest_s:
            return ""
        return f"{callback} {callback.times.longest_s * 1e3:.1f} ms"

    @property
    def overruns(self) -> int:
        """How many calls took longer than their ``budget_ms``."""
        return sum(callback.overruns for callback in tuple(self.callbacks.values()))

    @property
    def queue_drops(self) -> int:
        """How much full queues pushed out, left out calls of timers included."""
        return sum(callback.dropped for callback in tuple(self.callbacks.values()))
