"""A value that cannot be put where it is to go."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.fields import field_problems
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC305",
        name="unfit-value",
        severity=Severity.ERROR,
        summary="A constant or an expression does not fit the field it is to fill.",
        why=(
            "Message fields are typed and bounded: 300 does not fit a uint8, a text no number, "
            "and a condition must be true or false. At run time the reaction would fail."
        ),
        bad="""\
system: values
nodes:
  talker:
    publishers: {level: {type: std_msgs/msg/UInt8, qos: command, external: true}}
    timers: {tick: {period_ms: 1000, publish: {level: {data: 300}}}}
""",
        good="""\
system: values
nodes:
  talker:
    publishers: {level: {type: std_msgs/msg/UInt8, qos: command, external: true}}
    timers: {tick: {period_ms: 1000, publish: {level: {data: 200}}}}
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Report the values that do not fit."""
    for problem in context.once(field_problems):
        if not problem.missing:
            yield Diagnostic(RULE, problem.message, problem.span, hint=problem.hint)
