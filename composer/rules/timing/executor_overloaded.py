"""An executor that cannot keep up with its callbacks."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.timing.executor_load import executor_loads
from composer.diagnostics import Diagnostic, error

RULE = error(
    code="RC413",
    name="executor-overloaded",
    summary="The callbacks of an executor may need more time than it has.",
    why=(
        "The sum of rate times 'budget_ms' over the callbacks of an executor exceeds the "
        "capacity of its threads: timers fire later and later, and queues overflow."
    ),
    bad="""\
system: load
nodes:
  motor:
    timers: {control: {rate_hz: 100, budget_ms: 8, log: control}}
  camera:
    timers: {frame: {rate_hz: 30, budget_ms: 10, log: frame}}
""",
    good="""\
system: load
executors:
  perception: {kind: single_threaded}
nodes:
  motor:
    timers: {control: {rate_hz: 100, budget_ms: 6, log: control}}
  camera:
    executor: perception
    timers: {frame: {rate_hz: 30, budget_ms: 10, log: frame}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Add up the budgets of every executor."""
    for load in context.once(executor_loads):
        if load.ratio > 1.0:
            yield Diagnostic(
                RULE,
                f"callbacks of {load.what} may need more time than it has: {load.formula}",
                load.primary,
                load.labels,
                "lower a rate or a budget, or move nodes to another executor",
            )
