"""A connection with another QoS than a program has."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import listed
from composer.diagnostics import Diagnostic, Label, warning
from composer.model import ChannelKind, Node, Port
from composer.qos import QosProfile
from composer.source import Span

RULE = warning(
    code="RC531",
    name="outside-qos",
    summary="A connection sets another QoS than a port of a program or external node declares.",
    why=(
        "The composer cannot set the QoS of nodes outside its process. They keep their own, so "
        "the other ports of the connection may not match them."
    ),
    bad="""\
system: lidar
nodes:
  lidar:
    external: true
    publishers: {scan: {type: sensor_msgs/msg/LaserScan, qos: sensor_data}}
  mapper:
    subscriptions: {scan: {type: sensor_msgs/msg/LaserScan, qos: sensor_data, log: received}}
connections:
  - {topic: /scan, from: lidar.scan, to: mapper.scan, qos: command}
""",
    good="""\
system: lidar
nodes:
  lidar:
    external: true
    publishers: {scan: {type: sensor_msgs/msg/LaserScan, qos: sensor_data}}
  mapper:
    subscriptions: {scan: {type: sensor_msgs/msg/LaserScan, qos: command, log: received}}
connections:
  - {topic: /scan, from: lidar.scan, to: mapper.scan, qos: sensor_data}
""",
)

#: The policies that decide whether two endpoints match.
_POLICIES = (
    "reliability",
    "durability",
    "deadline_ms",
    "liveliness",
    "liveliness_lease_duration_ms",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the QoS of connections with that of ports outside the process."""
    reported: set[Span] = set()
    for node in context.system.nodes:
        if node.implementation.in_process:
            continue
        for port in node.ports:
            if port.kind.channel is ChannelKind.TOPIC and port.qos.span not in reported:
                found = list(_port(node, port))
                reported.update(item.primary for item in found)
                yield from found


def _port(node: Node, port: Port) -> Iterator[Diagnostic]:
    declared = port.declared_qos
    if declared is None or not (declared.explicit and declared.known and port.qos.known):
        return
    different = _different(declared.profile, port.qos.profile)
    if different:
        yield Diagnostic(
            RULE,
            f"'{node.name}.{port.name}' keeps its own {listed(different)}: "
            f"the node runs outside the process",
            port.qos.span,
            (Label(declared.span, "its own QoS"),),
            "use the QoS of that port for the connection",
        )


def _different(first: QosProfile, second: QosProfile) -> tuple[str, ...]:
    return tuple(name for name in _POLICIES if getattr(first, name) != getattr(second, name))
