"""Two ports of one node with one name."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_opaque
from composer.analysis.words import a
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register
from composer.model import Port

RULE = register(
    Rule(
        code="RC225",
        name="duplicate-port-name",
        severity=Severity.ERROR,
        summary="Two ports of different kinds have the same name in one node.",
        why=(
            "Connections say 'node.port', and handlers bind by name: each name must mean one "
            "port. In ROS the two may still share a topic: give it with 'topic:'."
        ),
        bad="""\
system: ports
nodes:
  relay:
    subscriptions: {speed: {type: std_msgs/msg/Float64, qos: command, external: true}}
    publishers: {speed: {type: std_msgs/msg/Float64, qos: command, topic: ~/speed, external: true}}
""",
        good="""\
system: ports
nodes:
  relay:
    subscriptions: {speed: {type: std_msgs/msg/Float64, qos: command, external: true}}
    publishers: {limited: {type: std_msgs/msg/Float64, qos: command, external: true}}
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Look for names that a node uses twice."""
    for node in context.system.nodes:
        first: dict[str, Port] = {}
        for port in node.ports:
            earlier = first.setdefault(port.name.value, port)
            if earlier is not port and not is_opaque(port.name.value):
                yield Diagnostic(
                    RULE,
                    f"'{port.name}' is {a(port.kind)} and {a(earlier.kind)} of one node",
                    port.name.span,
                    (Label(earlier.name.span, f"{a(earlier.kind)} already"),),
                    "rename one of them",
                )
