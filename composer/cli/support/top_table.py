"""What ``compose top`` shows of a system: its callbacks, the ones that matter first."""

from __future__ import annotations

from dataclasses import asdict
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from composer.cli.support.callback_table import DURATIONS, durations
from composer.cli.support.terminal import columns
from composer.runtime.metrics.figures import CallbackRates, rates

if TYPE_CHECKING:
    from composer.remote.systems import SystemReport

_HEAD = ("node", "callback", "calls/s", "busy %", *DURATIONS)


class Sorting(StrEnum):
    """What comes first."""

    BUSY = "busy"
    CALLS = "calls"
    MEAN = "mean"
    P99 = "p99"
    MAX = "max"
    LATE = "late"
    DROPPED = "dropped"
    NODE = "node"


def sorted_rates(before: SystemReport, now: SystemReport, sorting: Sorting) -> list[CallbackRates]:
    """Return the callbacks with what they did between two reports, in order."""
    passed_s = now.callbacks_at_s - before.callbacks_at_s
    found = rates(before.callbacks, now.callbacks, passed_s)
    return sorted(found, key=lambda item: (_rank(item, sorting), item.figures.node))


def table(report: SystemReport, callbacks: list[CallbackRates], lines: int | None = None) -> str:
    """Return the report as text of at most so many lines."""
    busy = sum(item.busy for item in callbacks)
    title = (
        f"{report.name}: {report.activity}, {report.message} "
        f"(host {report.host}, process {report.pid}), callbacks {busy * 100:.1f} % busy"
    )
    text = columns([_HEAD, *map(_row, callbacks)], numbers_from=2)
    chains = [f"chain {chain.chain}: {chain.text}" for chain in report.chains]
    shown = [title, *chains, *text.splitlines()]
    if lines is not None and len(shown) > lines:
        shown = [*shown[: lines - 1], f"{len(shown) - lines + 1} more"]
    return "\n".join(shown)


def as_json(report: SystemReport, callbacks: list[CallbackRates]) -> dict[str, Any]:
    """Return the report as programs want it. Times are since the start, rates of the last look."""
    return {
        "system": report.name,
        "time": report.callbacks_at_s,
        "activity": report.activity,
        "chains": [asdict(chain) for chain in report.chains],
        "callbacks": [
            asdict(item.figures) | {"calls_hz": item.calls_hz, "busy": item.busy}
            for item in callbacks
        ],
    }


def _row(item: CallbackRates) -> tuple[str, ...]:
    figures = item.figures
    rate = (f"{item.calls_hz:.1f}", f"{item.busy * 100:.2f}")
    return (figures.node, figures.callback, *rate, *durations(figures))


def _rank(item: CallbackRates, sorting: Sorting) -> float:
    """Return what is smaller for what is to come first."""
    figures = item.figures
    ranks = {
        Sorting.BUSY: item.busy,
        Sorting.CALLS: item.calls_hz,
        Sorting.MEAN: figures.mean_ms,
        Sorting.P99: figures.p99_ms,
        Sorting.MAX: figures.longest_ms,
        Sorting.LATE: figures.late_p99_ms,
        Sorting.DROPPED: figures.dropped,
    }
    return -ranks.get(sorting, 0.0)
