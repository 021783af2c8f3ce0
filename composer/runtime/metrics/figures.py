"""What is told of callbacks: their figures since the start, and their rates between two looks."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from composer.runtime.metrics.statistics import CallbackStatistics, ChainStatistics

_MS = 1e3


@dataclass(frozen=True, slots=True)
class CallbackFigures:
    """The callbacks of one port or timer of one node, since the node was made.

    ``total_ms`` is how long they kept their thread, all together; ``late_...`` is how long after
    their time the calls of a timer began. ``p99_ms`` is right within 10 %. ``kind``, ``overruns``
    and ``dropped`` are those of :class:`composer.runtime.metrics.statistics.CallbackStatistics`.
    """

    node: str
    kind: str
    name: str
    count: int = 0
    total_ms: float = 0.0
    mean_ms: float = 0.0
    p99_ms: float = 0.0
    longest_ms: float = 0.0
    late_p99_ms: float = 0.0
    late_longest_ms: float = 0.0
    overruns: int = 0
    dropped: int = 0

    @property
    def callback(self) -> str:
        """What people call it: ``timer 'tick'``."""
        return f"{self.kind} '{self.name}'"


def figures(node: str, counted: CallbackStatistics) -> CallbackFigures:
    """Return what is known of a callback of the node with that full name."""
    times, lateness = counted.times, counted.lateness
    return CallbackFigures(
        node=node,
        kind=counted.kind,
        name=counted.name,
        count=times.count,
        total_ms=times.total_s * _MS,
        mean_ms=times.mean_s * _MS,
        p99_ms=times.percentile_s(0.99) * _MS,
        longest_ms=times.longest_s * _MS,
        late_p99_ms=lateness.percentile_s(0.99) * _MS,
        late_longest_ms=lateness.longest_s * _MS,
        overruns=counted.overruns,
        dropped=counted.dropped,
    )


@dataclass(frozen=True, slots=True)
class ChainFigures:
    """A chain: how long data took from its first publisher to its last, and how long it may.

    ``late`` counts what took longer than ``latency_ms``.
    """

    chain: str
    latency_ms: float
    count: int = 0
    mean_ms: float = 0.0
    p99_ms: float = 0.0
    longest_ms: float = 0.0
    late: int = 0

    @property
    def text(self) -> str:
        """The figures in one line."""
        return (
            f"{self.count} times, mean {self.mean_ms:.3f} ms, "
            f"p99 {self.p99_ms:.3f} ms, max {self.longest_ms:.3f} ms, "
            f"{self.late} over {self.latency_ms:g} ms"
        )


def chain_figures(counted: ChainStatistics) -> ChainFigures:
    """Return what is known of a chain."""
    times = counted.times
    return ChainFigures(
        chain=counted.name,
        latency_ms=counted.latency_ms,
        count=times.count,
        mean_ms=times.mean_s * _MS,
        p99_ms=times.percentile_s(0.99) * _MS,
        longest_ms=times.longest_s * _MS,
        late=counted.late,
    )


@dataclass(frozen=True, slots=True)
class CallbackRates:
    """A callback between two looks: calls a second, and the share of one thread that it keeps."""

    figures: CallbackFigures
    calls_hz: float
    busy: float


def rates(
    before: Iterable[CallbackFigures], now: Iterable[CallbackFigures], passed_s: float
) -> list[CallbackRates]:
    """Return the callbacks as they are now, with what happened in the ``passed_s`` before."""
    known = {(item.node, item.kind, item.name): item for item in before}
    return [_rates(known.get((item.node, item.kind, item.name)), item, passed_s) for item in now]


def _rates(before: CallbackFigures | None, now: CallbackFigures, passed_s: float) -> CallbackRates:
    if before is None or passed_s <= 0.0:
        return CallbackRates(now, 0.0, 0.0)
    calls = max(0, now.count - before.count)
    busy_ms = max(0.0, now.total_ms - before.total_ms)
    return CallbackRates(now, calls / passed_s, busy_ms / (_MS * passed_s))
