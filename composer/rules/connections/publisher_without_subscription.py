"""A publisher without subscriptions."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.endpoints.unconnected import (
    external_hint,
    is_meant_by_another,
    name_location,
    unconnected_ports,
)
from composer.analysis.formatting import port_name
from composer.diagnostics import Diagnostic, info
from composer.model import PortKind

RULE = info(
    code="RC324",
    name="publisher-without-subscription",
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


def check(context: Context) -> Iterator[Diagnostic]:
    """Check for topics that have only publishers."""
    for endpoint in unconnected_ports(context, PortKind.PUBLISHER):
        if endpoint.port.required is None and not is_meant_by_another(context, endpoint):
            place, labels = name_location(endpoint)
            yield Diagnostic(
                RULE,
                f"no node in this system subscribes to '{endpoint.port.full_name}', "
                f"which '{port_name(endpoint)}' publishes",
                place,
                labels,
                external_hint(endpoint),
            )
