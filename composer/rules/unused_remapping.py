"""A remapping that has no effect."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.analysis.references import matched_ports, own_name
from composer.diagnostics import Diagnostic, Rule, Severity, register
from composer.model import Node, Remapping

RULE = register(
    Rule(
        code="RC241",
        name="unused-remapping",
        severity=Severity.WARNING,
        summary="A remapping has no effect, because a connection renames the port.",
        why=(
            "The name in a connection takes precedence over a remapping, so the port does not "
            "have the name that the remapping suggests."
        ),
        bad="""\
system: renamed
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, qos: command}}
    remappings: {chatter: news}
  listener:
    subscriptions: {chatter: {type: std_msgs/msg/String, qos: command}}
connections:
  - {topic: /chatter, from: talker.chatter, to: listener.chatter}
""",
        good="""\
system: renamed
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, qos: command}}
  listener:
    subscriptions: {chatter: {type: std_msgs/msg/String, qos: command}}
connections:
  - {topic: /chatter, from: talker.chatter, to: listener.chatter}
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the final names of remapped ports."""
    for node in context.system.nodes:
        for remapping in node.remappings:
            yield from _remapping(node, remapping)


def _remapping(node: Node, remapping: Remapping) -> Iterator[Diagnostic]:
    target = remapping.target.value
    ports = list(matched_ports(node, remapping))
    if not ports or is_unresolved(target):
        return
    expected = own_name(node, target)
    actual = sorted({port.full_name for port in ports} - {expected})
    if any(port.full_name == expected for port in ports) or not actual:
        return
    yield Diagnostic(
        RULE,
        f"remapping '{remapping.source}' to '{target}' has no effect: "
        f"the final name is '{actual[0]}'",
        remapping.source.span,
        hint="remove the remapping, or remove the port from its connection",
    )
