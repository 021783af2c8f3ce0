"""Snapshots of the statistics of callbacks and chains, and their rates."""

from __future__ import annotations

from collections.abc import Iterable

from composer.base.fast_dataclass import dataclass
from composer.runtime.metrics.message_rate import CountedRate
from composer.runtime.metrics.statistics import CallbackStatistics, ChainStatistics
from composer.runtime.protocol.reports import CallbackFigures, ChainFigures

_MS = 1e3
#: Reports about changes of state are closer to the last one, too close to measure rates.
_APART_S = 0.5


def figures(node: str, statistics: CallbackStatistics) -> CallbackFigures:
    """Return the figures of a callback; ``node`` is the full name of its node."""
    times, lateness = statistics.times, statistics.lateness
    return CallbackFigures(
        node=node,
        kind=statistics.kind,
        name=statistics.name,
        count=times.count,
        total_ms=times.total_s * _MS,
        mean_ms=times.mean_s * _MS,
        p99_ms=times.percentile_s(0.99) * _MS,
        longest_ms=times.longest_s * _MS,
        late_p99_ms=lateness.percentile_s(0.99) * _MS,
        late_longest_ms=lateness.longest_s * _MS,
        overruns=statistics.overruns,
        dropped=statistics.dropped,
        histogram=times.text,
    )


def chain_figures(statistics: ChainStatistics) -> ChainFigures:
    """Return the figures of a chain."""
    times = statistics.times
    return ChainFigures(
        chain=statistics.name,
        latency_ms=statistics.latency_ms,
        count=times.count,
        mean_ms=times.mean_s * _MS,
        p99_ms=times.percentile_s(0.99) * _MS,
        longest_ms=times.longest_s * _MS,
        late=statistics.late,
    )


def merged_chains(
    chains: Iterable[ChainFigures], of_others: Iterable[ChainFigures]
) -> tuple[ChainFigures, ...]:
    """Return chains as other processes know them: the one with all nodes of a chain measures it."""
    merged = {chain.chain: chain for chain in chains}
    for chain in of_others:
        if chain.chain in merged and chain.count > merged[chain.chain].count:
            merged[chain.chain] = chain
    return tuple(merged.values())


@dataclass(frozen=True, slots=True)
class CallbackRates:
    """A callback with its calls per second, and the share of one thread in the last interval.

    The calls are counted from burst to burst, as messages are; until there are two bursts, in the
    last interval. Both are None before the second report.
    """

    figures: CallbackFigures
    calls_hz: float | None = None
    busy: float | None = None


@dataclass(slots=True)
class _Reading:
    """The last rates of a callback, and what they follow from."""

    at_s: float
    calls: CountedRate
    rates: CallbackRates


class CallbackMeter:
    """The rates of the callbacks of a process, from its reports."""

    def __init__(self) -> None:
        self._readings: dict[tuple[str, str, str], _Reading] = {}

    def read(self, callbacks: Iterable[CallbackFigures], at_s: float) -> list[CallbackRates]:
        """Return the rates of callbacks that were reported ``at_s``."""
        before = self._readings
        self._readings = {
            key: _next(before.get(key), item, at_s)
            for item in callbacks
            for key in ((item.node, item.kind, item.name),)
        }
        return [reading.rates for reading in self._readings.values()]


def _next(before: _Reading | None, now: CallbackFigures, at_s: float) -> _Reading:
    last = None if before is None else before.rates.figures
    if before is None or last is None or now.count < last.count or at_s < before.at_s:
        calls = CountedRate()  # the first report, or a node that was created again
        calls.read(now.count, at_s)
        return _Reading(at_s, calls, CallbackRates(now))
    elapsed_s = at_s - before.at_s
    if elapsed_s < _APART_S:
        return before
    before.calls.read(now.count, at_s)
    calls_hz = before.calls.current_hz(at_s)
    if calls_hz is None:
        calls_hz = (now.count - last.count) / elapsed_s
    busy = max(0.0, now.total_ms - last.total_ms) / (_MS * elapsed_s)
    return _Reading(at_s, before.calls, CallbackRates(now, calls_hz, busy))
