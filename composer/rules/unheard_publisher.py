"""A publisher without subscriptions."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.wiring import external_hint, lonely_ends, place_of
from composer.analysis.words import end_name
from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.model import PortKind

RULE = register(
    Rule(
        code="RC324",
        name="unheard-publisher",
        severity=Severity.INFO,
        summary="No node in the system subscribes to a published topic.",
        why=(
            "If the topic is for tools or another system, set 'external: true'. Otherwise a name "
            "is wrong on one side, or the messages are not needed."
        ),
        bad="""\
system: unheard
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, qos: command}}
""",
        good="""\
system: unheard
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, qos: command, external: true}}
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check for topics that have only publishers."""
    for end in lonely_ends(context, PortKind.PUBLISHER):
        if end.port.required is None:
            place, labels = place_of(end)
            yield Diagnostic(
                RULE,
                f"no node in this system subscribes to '{end.port.full_name}', "
                f"which '{end_name(end)}' publishes",
                place,
                labels,
                external_hint(end),
            )
