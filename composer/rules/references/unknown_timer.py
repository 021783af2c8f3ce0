"""An override of a timer that the node type does not have."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, error, suggestion

RULE = error(
    code="RC204",
    name="unknown-timer",
    summary="A node overrides a timer that its node type does not have.",
    why="A node has only the timers of its type, so the override would have no effect.",
    bad="""\
system: source
nodes:
  source:
    type: timer_source
    variables: {message_type: std_msgs/msg/String}
    publishers: {output: {external: true}}
    timers: {tock: {rate_hz: 2}}
""",
    good="""\
system: source
nodes:
  source:
    type: timer_source
    variables: {message_type: std_msgs/msg/String}
    publishers: {output: {external: true}}
    timers: {tick: {rate_hz: 2}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the timers that nodes override."""
    for node in context.system.nodes:
        for unknown in node.unknown:
            if unknown.section == "timers":
                yield Diagnostic(
                    RULE,
                    f"node type '{node.type_name}' has no timer '{unknown.name}'",
                    unknown.name.span,
                    hint=suggestion(unknown.name.value, unknown.known),
                )
