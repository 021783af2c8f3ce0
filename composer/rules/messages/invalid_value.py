"""A value that does not fit its field."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.endpoints.type_mismatches import certain_field_problems
from composer.diagnostics import Diagnostic, error

RULE = error(
    code="RC305",
    name="invalid-value",
    summary="A constant or an expression does not fit the field it is assigned to.",
    why=(
        "Message fields are typed and bounded: 300 does not fit a uint8, text does not fit a "
        "number, and a condition must be a bool. The reaction would fail at run time."
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


def check(context: Context) -> Iterator[Diagnostic]:
    """Report the values in YAML that do not fit."""
    for problem in certain_field_problems(context):
        if not problem.missing:
            yield Diagnostic(RULE, problem.message, problem.span, hint=problem.hint)
