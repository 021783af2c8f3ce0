"""A subscription that nobody publishes to."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.near_miss import nearest_channel
from composer.analysis.wiring import external_hint, lonely_ends, place_of
from composer.analysis.words import end_name
from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.model import PortKind

RULE = register(
    Rule(
        code="RC323",
        name="unfed-subscription",
        severity=Severity.WARNING,
        summary="Nothing in the system publishes on a topic that is subscribed to.",
        why=(
            "The node waits for messages that never come: most often a name differs on the two "
            "sides. Where the messages come from outside, 'external: true' says so; where the "
            "node can do without, 'required: false'."
        ),
        bad="""\
system: unfed
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, qos: command, external: true}}
  listener:
    subscriptions: {chater: {type: std_msgs/msg/String, qos: command}}
""",
        good="""\
system: unfed
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, qos: command, external: true}}
  listener:
    subscriptions: {chatter: {type: std_msgs/msg/String, qos: command}}
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Look for topics with subscriptions only."""
    for end in lonely_ends(context, PortKind.SUBSCRIPTION):
        if end.port.required is None:
            place, labels = place_of(end)
            yield Diagnostic(
                RULE,
                f"nobody in this system publishes '{end.port.full_name}', "
                f"which '{end_name(end)}' subscribes to",
                place,
                labels,
                nearest_channel(context, end) or external_hint(end),
            )
