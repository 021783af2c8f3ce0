"""An executor with little time to spare."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.timing.executor_load import executor_loads
from composer.diagnostics import Diagnostic, warning

RULE = warning(
    code="RC414",
    name="executor-busy",
    summary="The callbacks of an executor may use more than 70 % of its time.",
    why=(
        "Above that, callbacks that are due together wait for each other, and there is no "
        "margin for unexpected load."
    ),
    bad="""\
system: load
nodes:
  motor:
    timers: {control: {rate_hz: 100, budget_ms: 8, log: control}}
""",
    good="""\
system: load
nodes:
  motor:
    timers: {control: {rate_hz: 100, budget_ms: 5, log: control}}
""",
)

BUSY = 0.7


def check(context: Context) -> Iterator[Diagnostic]:
    """Add up the budgets of every executor that is not overloaded."""
    for load in context.once(executor_loads):
        if BUSY < load.ratio <= 1.0:
            yield Diagnostic(
                RULE,
                f"callbacks of {load.what} may use most of its time: {load.formula}",
                load.span,
                load.labels,
            )
