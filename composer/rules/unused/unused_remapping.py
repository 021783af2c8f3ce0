"""A remapping that has no effect."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.analysis.endpoints.references import matched_ports, own_name
from composer.diagnostics import Diagnostic, shown, warning
from composer.model import ImplementationKind, Node, Port, Remapping

RULE = warning(
    code="RC241",
    name="unused-remapping",
    summary="A remapping, or the name of a port, has no effect because of a connection.",
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

_NAMES_IN_CODE = (ImplementationKind.CLASS, ImplementationKind.EXECUTABLE)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the final names of remapped ports."""
    for node in context.system.nodes:
        for remapping in node.remappings:
            yield from _remapping(node, remapping)
        # In a class or a program, the name of a port is what the connection renames.
        if not node.remappings and node.implementation not in _NAMES_IN_CODE:
            for port in node.ports:
                yield from _port(node, port)


def _port(node: Node, port: Port) -> Iterator[Diagnostic]:
    """Report the name of a port of an inline node that its connection, too, gives a name."""
    name = port.ros_name
    is_inline = name.span.file == node.name.span.file and name.span != port.name.span
    if not is_inline or is_unresolved(name.value) or is_unresolved(port.full_name):
        return
    if own_name(node, name.value) != port.full_name:
        word = port.kind.channel.value
        yield Diagnostic(
            RULE,
            f"{word} '{shown(name.value)}' has no effect: the connection gives "
            f"'{node.name}.{port.name}' the name '{port.full_name}'",
            name.span,
            hint=f"remove '{word}' here, or the port from the connection",
        )


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
