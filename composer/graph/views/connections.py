"""Every port, and what it is joined to with which type and QoS."""

from __future__ import annotations

from collections.abc import Iterator

from composer.graph.facts import node_facts, port_facts
from composer.graph.findings import Findings
from composer.graph.labels import qos_label, short_type
from composer.graph.namespaces import Namespaces
from composer.graph.picture import Cluster, Direction, Edge, Graph, Kind, Line, Vertex
from composer.model import Channel, ChannelKind, Node, Port, PortOfNode, System, channels


def build(system: System, findings: Findings) -> Graph:
    """Return the graph of ports: nodes are frames around their ports, arrows join ports."""
    namespaces = Namespaces(system.nodes)
    return Graph(
        title=system.name.value,
        view="connections",
        direction=Direction.RIGHT,
        vertices=tuple(
            vertex for node in system.nodes for vertex in _ports_of(node, namespaces, findings)
        ),
        edges=tuple(
            edge for channel in channels(system.nodes) for edge in _edges(channel, findings)
        ),
        clusters=(
            *namespaces.clusters(),
            *(_frame(node, namespaces) for node in system.nodes if node.ports),
        ),
    )


def _frame(node: Node, namespaces: Namespaces) -> Cluster:
    around = namespaces.around(node.namespace.value)
    return Cluster(f"node:{node.name.value}", node.name.value, around, node_facts(node))


def _ports_of(node: Node, namespaces: Namespaces, findings: Findings) -> Iterator[Vertex]:
    if not node.ports:
        yield Vertex(
            key=f"node:{node.name.value}",
            kind=Kind.NODE,
            lines=(node.name.value,),
            cluster=namespaces.around(node.namespace.value),
            details=node_facts(node),
            wrong=findings.about_node(node),
        )
    for port in node.ports:
        yield Vertex(
            key=_key(node, port),
            kind=Kind.PORT,
            lines=(port.name.value, port.kind.value),
            cluster=f"node:{node.name.value}",
            details=port_facts(node, port),
            wrong=findings.about_port(port),
        )


def _edges(channel: Channel, findings: Findings) -> Iterator[Edge]:
    for source in channel.sources:
        for sink in channel.sinks:
            # A message goes from source to sink, a request from the client to the server.
            towards_sink = channel.kind is ChannelKind.TOPIC
            begin, end = (source, sink) if towards_sink else (sink, source)
            yield Edge(
                source=_key(begin.node, begin.port),
                target=_key(end.node, end.port),
                kind=Line(channel.kind.value),
                lines=(channel.name, *_type_and_qos(source, sink)),
                details=(
                    ("from", dict(port_facts(begin.node, begin.port))),
                    ("to", dict(port_facts(end.node, end.port))),
                ),
                wrong=findings.about_port(source.port) or findings.about_port(sink.port),
            )


def _type_and_qos(source: PortOfNode, sink: PortOfNode) -> tuple[str, ...]:
    types = dict.fromkeys(short_type(end.port.interface.value) for end in (source, sink))
    if source.port.kind.channel is not ChannelKind.TOPIC:
        return (" / ".join(types),)
    qos = dict.fromkeys(qos_label(end.port.qos.profile) for end in (source, sink))
    return (" / ".join(types), " → ".join(qos))


def _key(node: Node, port: Port) -> str:
    return f"port:{node.name.value}.{port.name.value}"
