"""A port that says it needs another end, and has none."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.near_miss import nearest_channel
from composer.analysis.wiring import lonely_ends
from composer.analysis.words import end_name
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register
from composer.model import PortKind

RULE = register(
    Rule(
        code="RC325",
        name="required-port-unconnected",
        severity=Severity.ERROR,
        summary="A port with 'required: true' has nothing at its other end.",
        why=(
            "Whoever wrote the node knows that it is of no use without: an emergency stop that "
            "nobody publishes, a brake that nobody listens to."
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
    """Look at the ports that ask to be connected."""
    for kind in PortKind:
        for end in lonely_ends(context, kind):
            if end.port.required:
                yield Diagnostic(
                    RULE,
                    f"port '{end_name(end)}' must be connected, "
                    f"but nothing is at the other end of '{end.port.full_name}'",
                    end.node.name.span,
                    (Label(end.port.name.span, "declared as required"),),
                    nearest_channel(context, end),
                )
