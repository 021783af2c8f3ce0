"""Counters of a node, updated where the events happen, and histograms in constant memory."""

from __future__ import annotations

import math
import threading
from bisect import bisect, bisect_left
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import field
from itertools import accumulate, pairwise
from typing import Protocol

from composer.base.fast_dataclass import dataclass

_SHORTEST_S = 1e-7
_LONGEST_S = 100.0
#: Each bucket is a fifth longer than the one before: a percentile is right within 10 %.
_GROWTH = 1.2
#: How many durations are added to the buckets together.
BATCH_SIZE = 256


def _bounds() -> Iterable[float]:
    bound_s = _SHORTEST_S
    while bound_s < _LONGEST_S:
        yield bound_s
        bound_s *= _GROWTH


#: The bounds of buckets, in seconds: bucket ``i`` ends at ``BOUNDS_S[i]``; the last is unbounded.
BOUNDS_S = tuple(_bounds())


class Histogram:
    """A histogram of durations in seconds. Any thread may add and read.

    Code that counts a million durations per second appends to ``batch`` itself, and calls
    :meth:`flush` every :data:`BATCH_SIZE`: a list stays in the cache, buckets do not.
    """

    __slots__ = ("_buckets", "_lock", "_longest_s", "_total_s", "_weight", "batch")

    def __init__(self) -> None:
        self.batch: list[float] = []
        self._weight = 1
        self._buckets = [0] * (len(BOUNDS_S) + 1)
        self._total_s = 0.0
        self._longest_s = 0.0
        self._lock = threading.Lock()

    def add(self, duration_s: float) -> None:
        """Add a duration."""
        self.batch.append(duration_s)
        if len(self.batch) >= BATCH_SIZE:
            self.flush()

    def flush(self) -> None:
        """Add the batch to the buckets."""
        with self._lock:
            added = sorted(self.batch)
            if not added:
                return
            # Other threads may append meanwhile, behind these.
            del self.batch[: len(added)]
            self._count(added)
            self._total_s += sum(added) * self._weight
            self._longest_s = max(self._longest_s, added[-1])

    def _count(self, durations: list[float]) -> None:
        """Count sorted durations: one search per bucket is faster than one per duration."""
        counted = 0
        for bucket in range(bisect(BOUNDS_S, durations[0]), bisect(BOUNDS_S, durations[-1])):
            below = bisect_left(durations, BOUNDS_S[bucket])
            self._buckets[bucket] += (below - counted) * self._weight
            counted = below
        last = bisect(BOUNDS_S, durations[-1])
        self._buckets[last] += (len(durations) - counted) * self._weight

    def set_weight(self, weight: int) -> None:
        """Count each duration that is added from now on ``weight`` times."""
        if weight != self._weight:
            self.flush()
            self._weight = weight

    @property
    def total_s(self) -> float:
        """The sum of all durations."""
        with self._lock:  # without flushing: this is read every second
            return self._total_s + sum(self.batch) * self._weight

    @property
    def longest_s(self) -> float:
        """The longest duration; 0 without any."""
        self.flush()
        return self._longest_s

    @property
    def count(self) -> int:
        """The number of durations."""
        self.flush()
        return sum(self._buckets)

    @property
    def mean_s(self) -> float:
        """The mean; 0 without any."""
        return self.total_s / max(1, self.count)

    @property
    def text(self) -> str:
        """The buckets that are not empty, with their counts: ``45:3 46:12``."""
        self.flush()
        return " ".join(f"{index}:{count}" for index, count in enumerate(self._buckets) if count)

    def percentile_s(self, share: float) -> float:
        """Return the duration that ``share`` (0 to 1) of them do not exceed, within 10 %; or 0."""
        self.flush()
        counted = list(accumulate(self._buckets))
        if not counted[-1]:
            return 0.0
        rank = share * counted[-1]
        index = next(index for index, below in enumerate(counted) if below >= rank and below)
        return min(self._longest_s, _MIDDLES_S[index])


def parse_buckets(text: str) -> list[tuple[float, int]]:
    """Return the bounds of the buckets in :attr:`Histogram.text`, in seconds, and the counts.

    The longest durations have no bound: infinity. Raises ValueError.
    """
    buckets = []
    for item in text.split():
        index, _, count = item.partition(":")
        bucket = int(index)
        if not 0 <= bucket <= len(BOUNDS_S):
            raise ValueError(f"there is no bucket {bucket}")
        buckets.append((BOUNDS_S[bucket] if bucket < len(BOUNDS_S) else math.inf, int(count)))
    return buckets


_MIDDLES_S = (
    _SHORTEST_S,
    *(before + (after - before) / 2.0 for before, after in pairwise(BOUNDS_S)),
    float("inf"),
)


class HasLastCall(Protocol):
    """Keeps the time of its last call."""

    last_s: float


@dataclass(slots=True)
class CallbackStatistics:
    """The counters of the callbacks of one port or timer.

    ``timer`` refers to what times them while the port exists, with the time of the last call.
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
    timer: Callable[[], HasLastCall | None] = lambda: None

    @property
    def last_s(self) -> float:
        """When the last timed call began, in seconds of ``monotonic()``; 0 if it is not known."""
        timer = self.timer()
        return 0.0 if timer is None else timer.last_s

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
    def last_sent_s(self) -> float:
        """When the last callback began: what it published was published then."""
        return max((item.last_s for item in tuple(self.callbacks.values())), default=0.0)

    @property
    def last_received_s(self) -> float:
        """When the last callback of a subscription began."""
        received = [
            item for item in tuple(self.callbacks.values()) if item.name in self.subscriptions
        ]
        return max((item.last_s for item in received), default=0.0)

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
