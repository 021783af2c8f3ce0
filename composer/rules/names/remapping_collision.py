"""Two ports of one node that a remapping gives the same name."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.analysis.endpoints.references import matched_ports, own_name
from composer.diagnostics import Diagnostic, Label, warning
from composer.model import Node, Port, PortKind, Remapping

RULE = warning(
    code="RC226",
    name="remapping-collision",
    summary="A remapping gives a port a name that another port of the node already has.",
    why=(
        "Two streams of the node become one, and subscribers cannot distinguish the messages "
        "of the two ports."
    ),
    bad="""\
system: collision
nodes:
  camera:
    publishers:
      left: {type: sensor_msgs/msg/Image, qos: sensor_data, external: true}
      right: {type: sensor_msgs/msg/Image, qos: sensor_data, external: true}
    remappings: {left: right}
""",
    good="""\
system: collision
nodes:
  camera:
    publishers:
      left: {type: sensor_msgs/msg/Image, qos: sensor_data, external: true}
      right: {type: sensor_msgs/msg/Image, qos: sensor_data, external: true}
    remappings: {left: left_eye}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the ports that each remapping renames."""
    for node in context.system.nodes:
        if not node.remappings:
            continue
        joined: dict[tuple[PortKind, str], list[Port]] = defaultdict(list)
        for port in node.ports:
            joined[port.kind, port.full_name].append(port)
        reported: set[tuple[PortKind, str]] = set()
        for remapping in node.remappings:
            yield from _remapping(node, remapping, joined, reported)


def _remapping(
    node: Node,
    remapping: Remapping,
    joined: dict[tuple[PortKind, str], list[Port]],
    reported: set[tuple[PortKind, str]],
) -> Iterator[Diagnostic]:
    """Report each name once, for the first remapping that causes it."""
    if is_unresolved(remapping.target.value):
        return
    target = own_name(node, remapping.target.value)
    for port in matched_ports(node, remapping):
        others = [other for other in joined[port.kind, target] if other is not port]
        if port.full_name == target and others and (port.kind, target) not in reported:
            reported.add((port.kind, target))
            yield Diagnostic(
                RULE,
                f"remapping '{remapping.source}' to '{remapping.target}' gives {port.kind}s "
                f"'{port.name}' and '{others[0].name}' of one node the name '{target}'",
                remapping.target.span,
                (Label(others[0].name.span, "already has this name"),),
            )
