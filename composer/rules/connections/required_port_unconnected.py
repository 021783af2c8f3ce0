"""A required port that is not connected."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.endpoints.unconnected import COUNTERPARTS, nearest_channel, unconnected_ports
from composer.analysis.formatting import port_name
from composer.diagnostics import Diagnostic, Label, error
from composer.model import PortKind

RULE = error(
    code="RC325",
    name="required-port-unconnected",
    summary="A port with 'required: true' has no counterpart in the system.",
    why=(
        "The node declares that it cannot work without the connection: for example, a motor "
        "without its emergency stop."
    ),
    bad="""\
system: required
nodes:
  motor:
    subscriptions: {stop: {type: std_msgs/msg/Bool, qos: state, required: true}}
""",
    good="""\
system: required
nodes:
  button:
    publishers: {stop: {type: std_msgs/msg/Bool, qos: state}}
  motor:
    subscriptions: {stop: {type: std_msgs/msg/Bool, qos: state, required: true}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the ports that are declared as required."""
    for kind in PortKind:
        for endpoint in unconnected_ports(context, kind):
            if endpoint.port.required:
                yield Diagnostic(
                    RULE,
                    f"port '{port_name(endpoint)}' must be connected, "
                    f"but '{endpoint.port.full_name}' has no {COUNTERPARTS[endpoint.port.kind]}",
                    endpoint.node.name.span,
                    (Label(endpoint.port.name.span, "declared as required"),),
                    nearest_channel(context, endpoint),
                )
