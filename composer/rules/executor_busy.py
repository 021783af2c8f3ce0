"""An executor that has little time to spare."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.load import loads
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC414",
        name="executor-busy",
        severity=Severity.WARNING,
        summary="The callbacks of an executor may take more than 70 % of its time.",
        why=(
            "Beyond that, callbacks that fall due together wait for each other for long, and "
            "nothing is left for what was not foreseen."
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
)

BUSY = 0.7


def check(context: Context) -> Iterator[Diagnostic]:
    """Add up the budgets on every executor that is not overloaded."""
    for load in context.once(loads):
        if BUSY < load.ratio <= 1.0:
            yield Diagnostic(
                RULE,
                f"callbacks of {load.what} may need most of the time: {load.told}",
                load.span,
                load.labels,
            )
