"""What a node has done so far, counted where it happens."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from composer.runtime.durations import Durations


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


@dataclass(slots=True)
class PublisherStatistics:
    """How many messages went through a publisher."""

    sent: int = 0


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
    """Counters of one node. See :class:`composer.runtime.events.NodeSummary` for their meaning.

    ``qos_events`` counts what :mod:`composer.runtime.ports.qos_events` tells of, by the name of the
    event. With ``tracing`` false, the times of callbacks are not taken.
    """

    tracing: bool = True
    received: int = 0
    calls: int = 0
    dropped: int = 0
    skipped: int = 0
    errors: int = 0
    qos_events: Counter[str] = field(default_factory=Counter)
    callbacks: dict[tuple[str, str], CallbackStatistics] = field(default_factory=dict)
    publishers: dict[str, PublisherStatistics] = field(default_factory=dict)

    def publisher(self, name: str) -> PublisherStatistics:
        """Return where the messages of a publisher are counted, from now on or as before."""
        return self.publishers.setdefault(name, PublisherStatistics())

    def callback(self, kind: str, name: str) -> CallbackStatistics:
        """Return where the callbacks of a port or timer are counted, from now on or as before."""
        return self.callbacks.setdefault((kind, name), CallbackStatistics(kind, name))

    @property
    def sent(self) -> int:
        """How many messages went through all publishers."""
        return sum(publisher.sent for publisher in tuple(self.publishers.values()))

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
