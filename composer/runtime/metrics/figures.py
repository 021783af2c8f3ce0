"""Snapshots of the statistics of callbacks and chains, and their rates."""

from __future__ import annotations

from collections.abc import Iterable

from composer.base.fast_dataclass import dataclass
from composer.runtime.metrics.statistics import CallbackStatistics, ChainStatistics
from composer.runtime.protocol.reports import CallbackFigures, ChainFigures

_MS = 1e3


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
    """A callback between two snapshots: calls per second, and the share of one thread in use."""

    figures: CallbackFigures
    calls_hz: float
    busy: float


def rates(
    before: Iterable[CallbackFigures], now: Iterable[CallbackFigures], elapsed_s: float
) -> list[CallbackRates]:
    """Return the current figures with the rates over the ``elapsed_s`` since ``before``."""
    known = {(item.node, item.kind, item.name): item for item in before}
    return [_rates(known.get((item.node, item.kind, item.name)), item, elapsed_s) for item in now]


def _rates(before: CallbackFigures | None, now: CallbackFigures, elapsed_s: float) -> CallbackRates:
    if before is None or elapsed_s <= 0.0:
        return CallbackRates(now, 0.0, 0.0)
    calls = max(0, now.count - before.count)
    busy_ms = max(0.0, now.total_ms - before.total_ms)
    return CallbackRates(now, calls / elapsed_s, busy_ms / (_MS * elapsed_s))
