"""An executor that cannot do what it is asked to."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.load import loads
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC413",
        name="executor-overloaded",
        severity=Severity.ERROR,
        summary="The callbacks of an executor may take more time than there is.",
        why=(
            "The sum of rate times 'budget_ms' over the callbacks of an executor is more than its "
            "threads have: timers come later and later, and queues overflow."
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
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Add up the budgets on every executor."""
    for load in context.once(loads):
        if load.ratio > 1.0:
            yield Diagnostic(
                RULE,
                f"callbacks of {load.what} may need more time than there is: {load.told}",
                load.span,
                load.labels,
                "lower a rate or a budget, or put nodes on an executor of their own",
            )
