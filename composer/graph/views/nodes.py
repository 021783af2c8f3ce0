"""The nodes and the topics, services and actions between them."""

from __future__ import annotations

from collections.abc import Iterator

from composer.graph.facts import channel_facts, node_facts, port_facts
from composer.graph.findings import Findings
from composer.graph.labels import qos_label, rate, short_type
from composer.graph.namespaces import Namespaces
from composer.graph.picture import Direction, Edge, Graph, Kind, Line, Vertex
from composer.graph.rates import publishing_rate_hz
from composer.model import Channel, ChannelKind, Node, PortKind, PortOfNode, System, channels


def build(system: System, findings: Findings) -> Graph:
    """Return the graph of who talks to whom over what. Arrows point where data or requests go."""
    namespaces = Namespaces(system.nodes)
    joined = channels(system.nodes)
    return Graph(
        title=system.name.value,
        view="nodes",
        direction=Direction.RIGHT,
        vertices=(
            *(_node(node, namespaces, findings) for node in system.nodes),
            *(_channel(channel, namespaces) for channel in joined),
        ),
        edges=tuple(edge for channel in joined for edge in _edges(channel, findings)),
        clusters=namespaces.clusters(),
    )


def _node(node: Node, namespaces: Namespaces, findings: Findings) -> Vertex:
    lines = [node.name.value]
    if node.type_name is not None and node.type_name.value != node.name.value:
        lines.append(node.type_name.value)
    return Vertex(
        key=f"node:{node.name.value}",
        kind=Kind.NODE,
        lines=tuple(lines),
        cluster=namespaces.around(node.namespace.value),
        details=node_facts(node),
        wrong=findings.about_node(node),
    )


def _channel(channel: Channel, namespaces: Namespaces) -> Vertex:
    types = dict.fromkeys(short_type(end.port.interface.value) for end in channel.ends)
    return Vertex(
        key=f"{channel.kind}:{channel.name}",
        kind=Kind(channel.kind.value),
        lines=(channel.name, " / ".join(types)),
        cluster=namespaces.around_name(channel.name),
        details=channel_facts(channel),
    )


def _edges(channel: Channel, findings: Findings) -> Iterator[Edge]:
    """Yield an arrow for each port: node to channel where it sends, channel to node elsewhere."""
    key = f"{channel.kind}:{channel.name}"
    for end in channel.ends:
        node_key = f"node:{end.node.name.value}"
        into_channel = end.port.kind in _SENDING
        yield Edge(
            source=node_key if into_channel else key,
            target=key if into_channel else node_key,
            kind=Line(channel.kind.value),
            lines=_label(channel, end),
            details=port_facts(end.node, end.port),
            wrong=findings.about_port(end.port),
        )


_SENDING = (PortKind.PUBLISHER, PortKind.CLIENT, PortKind.ACTION_CLIENT)


def _label(channel: Channel, end: PortOfNode) -> tuple[str, ...]:
    """Say the rate of a publisher, and the QoS; a subscription's only if it differs from that."""
    if channel.kind is not ChannelKind.TOPIC:
        return ()
    lines = []
    hertz = publishing_rate_hz(end.node, end.port)
    if end.port.kind is PortKind.PUBLISHER and hertz is not None:
        lines.append(rate(hertz))
    offered = {source.port.qos.profile for source in channel.sources}
    is_told = end.port.kind is PortKind.SUBSCRIPTION and offered == {end.port.qos.profile}
    if end.port.qos.explicit and not is_told:
        lines.append(qos_label(end.port.qos.profile))
    return tuple(lines)
