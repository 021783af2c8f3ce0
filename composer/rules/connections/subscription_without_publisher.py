"""A subscription to a topic without publishers."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.endpoints.unconnected import (
    external_hint,
    name_location,
    nearest_channel,
    unconnected_ports,
)
from composer.analysis.formatting import port_name
from composer.diagnostics import Diagnostic, warning
from composer.model import PortKind

RULE = warning(
    code="RC323",
    name="subscription-without-publisher",
    summary="No node in the system publishes to a subscribed topic.",
    why=(
        "The node waits for messages that never arrive. The usual cause is a name that "
        "differs between publisher and subscription. If an external node publishes the "
        "messages, set 'external: true'; if the node works without them, 'required: false'."
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


def check(context: Context) -> Iterator[Diagnostic]:
    """Check for topics that have only subscriptions."""
    for endpoint in unconnected_ports(context, PortKind.SUBSCRIPTION):
        if endpoint.port.required is None:
            place, labels = name_location(endpoint)
            yield Diagnostic(
                RULE,
                f"no node in this system publishes '{endpoint.port.full_name}', "
                f"which '{port_name(endpoint)}' subscribes to",
                place,
                labels,
                nearest_channel(context, endpoint) or external_hint(endpoint),
            )
