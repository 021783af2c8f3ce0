"""Callbacks as tables: how long they took, how late they were called, and what was dropped."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from composer.cli.support.terminal import columns, lines
from composer.runtime.metrics.figures import CallbackMeter, CallbackRates
from composer.runtime.protocol.reports import CallbackFigures

if TYPE_CHECKING:
    from composer.runtime.protocol.reports import SystemReport

_DURATION_COLUMNS = ("mean ms", "p99 ms", "max ms", "late ms", "over", "dropped")
_SUMMARY_HEAD = ("node", "callback", "calls", *_DURATION_COLUMNS)
_TOP_HEAD = ("node", "callback", "calls/s", "busy %", *_DURATION_COLUMNS)


class SortKey(StrEnum):
    """What ``compose top`` sorts by: the largest value first, nodes by name."""

    BUSY = "busy"
    CALLS = "calls"
    MEAN = "mean"
    P99 = "p99"
    MAX = "max"
    LATE = "late"
    DROPPED = "dropped"
    NODE = "node"


def summary_table(callbacks: Sequence[CallbackFigures], limit: int) -> str:
    """Return the ``limit`` callbacks with the highest total time; a last line counts the others.

    ``late`` is the 99th percentile of how late a timer is called, ``over`` the number of calls that
    took longer than the budget.
    """
    busiest = sorted(callbacks, key=lambda item: -item.total_ms)
    rows = [_SUMMARY_HEAD, *map(_summary_row, busiest[:limit])]
    table = columns(rows, numbers_from=2)
    left = len(busiest) - limit
    return f"{table}\n{left} more callbacks took less time" if left > 0 else table


class SystemMeter:
    """The rates of the callbacks of a system, each process of which reports at its own times."""

    def __init__(self) -> None:
        self._meters: defaultdict[str, CallbackMeter] = defaultdict(CallbackMeter)

    def read(self, report: SystemReport) -> list[CallbackRates]:
        """Return the callbacks with their rates, from the reports read so far."""
        process_of = {node.node: node.process for node in report.nodes}
        callbacks: defaultdict[str, list[CallbackFigures]] = defaultdict(list)
        for item in report.callbacks:
            callbacks[process_of.get(item.node, "")].append(item)
        return [
            rates
            for process in ("", *report.processes)
            if (at_s := report.callbacks_at(process))
            for rates in self._meters[process].read(callbacks[process], at_s)
        ]

    def rated_s(self, report: SystemReport) -> dict[str, float | None]:
        """Return for each process when it reported what its rates are from; None without rates.

        Reports that are too close to the one before, or are the first one, have no rates.
        """
        return {process: self._meters[process].rated_s for process in ("", *report.processes)}


def in_order(callbacks: Iterable[CallbackRates], key: SortKey) -> list[CallbackRates]:
    """Return callbacks sorted by ``key``."""
    return sorted(callbacks, key=lambda item: (_rank(item, key), item.figures.node))


def top_table(
    report: SystemReport, callbacks: list[CallbackRates], max_lines: int | None = None
) -> str:
    """Return a report as text of at most ``max_lines`` lines."""
    busy = sum(item.busy or 0.0 for item in callbacks)
    title = (
        f"{report.name}: {report.activity}, {report.message} "
        f"(host {report.host}, process {report.pid}), callbacks {busy * 100:.1f} % busy"
    )
    text = columns([_TOP_HEAD, *map(_top_row, callbacks)], numbers_from=2)
    chains = [f"chain {chain.chain}: {chain.text}" for chain in report.chains]
    shown = [*lines([title, *chains]).split("\n"), *text.split("\n")]
    if max_lines is not None and len(shown) > max_lines:
        shown = [*shown[: max_lines - 1], f"{len(shown) - max_lines + 1} more"]
    return "\n".join(shown)


def top_data(report: SystemReport, callbacks: list[CallbackRates]) -> dict[str, Any]:
    """Return a report for JSON. Durations are since the start, rates since the last report."""
    return {
        "system": report.name,
        "time": report.callbacks_at_s,
        "activity": report.activity,
        "chains": [asdict(chain) for chain in report.chains],
        "callbacks": [
            _without_histogram(item.figures) | {"calls_hz": item.calls_hz, "busy": item.busy}
            for item in callbacks
        ],
    }


def _without_histogram(figures: CallbackFigures) -> dict[str, Any]:
    values = asdict(figures)
    values.pop("histogram")
    return values


def _summary_row(item: CallbackFigures) -> tuple[str, ...]:
    return (item.node, item.callback, str(item.count), *_durations(item))


def _top_row(item: CallbackRates) -> tuple[str, ...]:
    figures = item.figures
    rate = (_shown(item.calls_hz, 1), _shown(item.busy and item.busy * 100, 2))
    return (figures.node, figures.callback, *rate, *_durations(figures))


def _shown(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def _durations(item: CallbackFigures) -> tuple[str, ...]:
    """Return the cells below ``_DURATION_COLUMNS``."""
    return (
        f"{item.mean_ms:.3f}",
        f"{item.p99_ms:.3f}",
        f"{item.longest_ms:.3f}",
        f"{item.late_p99_ms:.3f}" if item.kind == "timer" else "",
        str(item.overruns or ""),
        str(item.dropped or ""),
    )


def _rank(item: CallbackRates, key: SortKey) -> float:
    """Return an ascending sort key."""
    figures = item.figures
    ranks = {
        SortKey.BUSY: item.busy or 0.0,
        SortKey.CALLS: item.calls_hz or 0.0,
        SortKey.MEAN: figures.mean_ms,
        SortKey.P99: figures.p99_ms,
        SortKey.MAX: figures.longest_ms,
        SortKey.LATE: figures.late_p99_ms,
        SortKey.DROPPED: figures.dropped,
    }
    return -ranks.get(key, 0.0)
