"""Two ports of one node with the same name."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.analysis.formatting import a
from composer.diagnostics import Diagnostic, Label, error
from composer.model import Port

RULE = error(
    code="RC225",
    name="duplicate-port-name",
    summary="Two ports of different kinds have the same name in one node.",
    why=(
        "Connections refer to 'node.port' and handlers bind by name, so a name must identify "
        "one port. The two ports can still share a topic: set it with 'topic:'."
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


def check(context: Context) -> Iterator[Diagnostic]:
    """Check for names that a node uses twice."""
    for node in context.system.nodes:
        first: dict[str, Port] = {}
        for port in node.ports:
            earlier = first.setdefault(port.name.value, port)
            if earlier is not port and not is_unresolved(port.name.value):
                yield Diagnostic(
                    RULE,
                    f"'{port.name}' names both {a(port.kind)} and {a(earlier.kind)} of one node",
                    port.name.span,
                    (Label(earlier.name.span, f"the {earlier.kind}"),),
                    "rename one of them",
                )
