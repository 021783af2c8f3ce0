"""Snapshots of the statistics of callbacks and chains, their rates, and their reports."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields
from typing import Any

from composer.base.fast_dataclass import dataclass
from composer.runtime.metrics.statistics import CallbackStatistics, ChainStatistics
from composer.runtime.ros.diagnostic_arrays import Level, Status, finite

_MS = 1e3


@dataclass(frozen=True, slots=True)
class CallbackFigures:
    """The callbacks of one port or timer of a node, since the node was created.

    ``total_ms`` is the time that they kept a thread; ``late_...`` the time from when a timer call
    was due to its start. ``p99_ms`` is right within 10 %. ``kind``, ``overruns`` and ``dropped``
    are those of :class:`composer.runtime.metrics.statistics.CallbackStatistics`. ``histogram`` is
    the text of :attr:`composer.runtime.metrics.statistics.Histogram.text`.
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
    histogram: str = ""

    @property
    def callback(self) -> str:
        """The kind and name: ``timer 'tick'``."""
        return f"{self.kind} '{self.name}'"


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


@dataclass(frozen=True, slots=True)
class ChainFigures:
    """The latencies of a chain, from its first publisher to its last.

    ``late`` counts latencies above ``latency_ms``.
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


Figures = CallbackFigures | ChainFigures


def to_statuses(system: str, figures: Iterable[Figures]) -> list[Status]:
    """Return one status for each; overruns, drops and late data are warnings."""
    return [_status(system, item) for item in figures]


def from_statuses(
    statuses: Iterable[Status],
) -> tuple[tuple[CallbackFigures, ...], tuple[ChainFigures, ...]]:
    """Return the callbacks and chains of statuses of :func:`to_statuses`.

    Raises ValueError, KeyError or TypeError for any others.
    """
    return _from_values(status.values for status in statuses)


def to_text(figures: Iterable[Figures]) -> str:
    """Return callbacks and chains as text, without histograms."""
    values = [status.values for status in to_statuses("", figures)]
    for item in values:
        item.pop("histogram", None)
    return json.dumps(values)


def from_text(text: str) -> tuple[tuple[CallbackFigures, ...], tuple[ChainFigures, ...]]:
    """Return the callbacks and chains of a text of :func:`to_text`. Raises ValueError."""
    try:
        return _from_values(json.loads(text))
    except (KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ValueError("not the timings of this version") from error


def _from_values(
    values: Iterable[Mapping[str, str]],
) -> tuple[tuple[CallbackFigures, ...], tuple[ChainFigures, ...]]:
    typed = [{key: _TYPES[key](value) for key, value in item.items()} for item in values]
    return (
        tuple(CallbackFigures(**item) for item in typed if "chain" not in item),
        tuple(ChainFigures(**item) for item in typed if "chain" in item),
    )


_PARSERS: dict[str, Callable[[str], Any]] = {"int": int, "float": finite, "str": str}
#: Converts each field back from text.
_TYPES = {
    field.name: _PARSERS[str(field.type)]
    for kind in (CallbackFigures, ChainFigures)
    for field in fields(kind)
}


def _status(system: str, figures: Figures) -> Status:
    if isinstance(figures, ChainFigures):
        name, is_ok, text = f"chain {figures.chain}", not figures.late, figures.text
    else:
        name = f"{figures.node} {figures.callback}"
        is_ok = not (figures.overruns or figures.dropped)
        text = f"{figures.overruns} over budget, {figures.dropped} dropped"
    values = {field.name: getattr(figures, field.name) for field in fields(figures)}
    level = Level.OK if is_ok else Level.WARN
    texts = {key: _text(value) for key, value in values.items()}
    return Status(level, f"{system}: {name}", text, system, texts)


def _text(value: str | float) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
