"""A field that the message does not have."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.endpoints.type_mismatches import certain_field_problems
from composer.diagnostics import Diagnostic, error

RULE = error(
    code="RC304",
    name="unknown-field",
    summary="An expression reads, or a map sets, a field that the message does not have.",
    why="The reaction would fail on every message.",
    bad="""\
system: fields
nodes:
  listener:
    subscriptions:
      chatter: {type: std_msgs/msg/String, qos: command, external: true, log: "{message.text}"}
""",
    good="""\
system: fields
nodes:
  listener:
    subscriptions:
      chatter: {type: std_msgs/msg/String, qos: command, external: true, log: "{message.data}"}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Report the fields in YAML that do not exist."""
    for problem in certain_field_problems(context):
        if problem.missing:
            yield Diagnostic(RULE, problem.message, problem.span, hint=problem.hint)
