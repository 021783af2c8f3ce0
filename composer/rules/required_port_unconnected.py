"""A required port that is not connected."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.near_miss import COUNTERPARTS, nearest_channel
from composer.analysis.wiring import lonely_ends
from composer.analysis.words import end_name
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register
from composer.model import PortKind

RULE = register(
    Rule(
        code="RC325",
        name="required-port-unconnected",
        severity=Severity.ERROR,
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
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the ports that are declared as required."""
    for kind in PortKind:
        for end in lonely_ends(context, kind):
            if end.port.required:
                yield Diagnostic(
                    RULE,
                    f"port '{end_name(end)}' must be connected, "
                    f"but '{end.port.full_name}' has no {COUNTERPARTS[end.port.kind]}",
                    end.node.name.span,
                    (Label(end.port.name.span, "declared as required"),),
                    nearest_channel(context, end),
                )
