"""Callbacks as a table: what they took, how late they came, what was lost."""

from __future__ import annotations

from collections.abc import Sequence

from composer.cli.support.terminal import columns
from composer.runtime.metrics.figures import CallbackFigures

#: The columns of :func:`durations`.
DURATIONS = ("mean ms", "p99 ms", "max ms", "late ms", "over", "dropped")


def callback_table(callbacks: Sequence[CallbackFigures], at_most: int) -> str:
    """Return the callbacks that took most time, all calls together; a last line tells of others.

    ``late`` is how late the calls of a timer begin (p99), ``over`` counts calls over the budget.
    """
    busiest = sorted(callbacks, key=lambda item: -item.total_ms)
    rows = [("node", "callback", "calls", *DURATIONS), *map(_row, busiest[:at_most])]
    table = columns(rows, numbers_from=2)
    left = len(busiest) - at_most
    return f"{table}\n{left} more callbacks took less time" if left > 0 else table


def _row(item: CallbackFigures) -> tuple[str, ...]:
    return (item.node, item.callback, str(item.count), *durations(item))


def durations(item: CallbackFigures) -> tuple[str, ...]:
    """Return the cells that all tables of callbacks have in common."""
    return (
        f"{item.mean_ms:.3f}",
        f"{item.p99_ms:.3f}",
        f"{item.longest_ms:.3f}",
        f"{item.late_p99_ms:.3f}" if item.kind == "timer" else "",
        str(item.overruns or ""),
        str(item.dropped or ""),
    )
