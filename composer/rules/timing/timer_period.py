"""A timer whose period is not valid or not practical."""

from __future__ import annotations

import math
from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import number
from composer.diagnostics import Diagnostic, error
from composer.expressions import Expression
from composer.model import Node, PeriodError, PeriodUnit, Timer

RULE = error(
    code="RC411",
    name="timer-period",
    summary="A timer's period is not positive, or outside the practical range.",
    why=(
        "rcl refuses periods that are not positive. Periods under 0.1 ms are too short for "
        "Python; periods over one day are almost always a unit error."
    ),
    bad="""\
system: timing
nodes:
  clock:
    timers: {tick: {period_ms: 0.001, log: tick}}
""",
    good="""\
system: timing
nodes:
  clock:
    timers: {tick: {period_ms: 1.0, log: tick}}
""",
)

SHORTEST_S = 0.0001
LONGEST_S = 86_400.0


def check(context: Context) -> Iterator[Diagnostic]:
    """Check every timer whose period is known."""
    for node in context.system.nodes:
        for timer in node.timers:
            problem = _problem(node, timer)
            if problem is not None:
                yield Diagnostic(
                    RULE,
                    f"timer '{timer.name}' {problem}{_origin(timer)}",
                    timer.period.span,
                    hint="use a period between 0.1 ms and one day",
                )


def _problem(node: Node, timer: Timer) -> str | None:
    period = timer.period
    try:
        value = period.evaluate(node.initial_parameters)
    except PeriodError:
        return None  # the expression is reported by the rules for expressions and parameters
    if not math.isfinite(value):
        return f"has a {period.unit} that is not finite"
    period_s = node.period_s(timer)
    if value <= 0 or period_s is None:
        return f"has a {period.unit} of {number(value)}, which is not positive"
    unit = "ms" if period.unit is PeriodUnit.MILLISECONDS else "Hz"
    if period_s < SHORTEST_S:
        return f"fires every {number(period_s * 1e6)} us ({number(value)} {unit}), too fast to keep"
    if period_s > LONGEST_S:
        return f"fires every {number(period_s / 3600)} h ({number(value)} {unit}), too rarely"
    return None


def _origin(timer: Timer) -> str:
    """Return which values an expression was evaluated with."""
    value = timer.period.value
    if not isinstance(value, Expression) or not value.paths:
        return ""
    return ", with the initial parameters"
