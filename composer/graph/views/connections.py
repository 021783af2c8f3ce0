"""All ports and their connections, with types and QoS."""

from __future__ import annotations

from collections.abc import Iterator

from composer.graph.diagram import (
    Cluster,
    Direction,
    Edge,
    EdgeKind,
    Graph,
    Vertex,
    VertexKind,
    worst,
)
from composer.graph.labels import rate, short_type
from composer.graph.namespaces import Namespaces
from composer.graph.scenes.scene import (
    Scene,
    SceneChannel,
    SceneEndpoint,
    SceneNode,
    channels,
    node_key,
    port_key,
)
from composer.graph.views.vertices import node_vertex
from composer.model import ChannelKind


def build(scene: Scene) -> Graph:
    """Return the graph of ports: nodes are blocks of their ports, arrows join ports."""
    namespaces = Namespaces(node.namespace for node in scene.nodes)
    return Graph(
        title=scene.title,
        view="connections",
        direction=Direction.RIGHT,
        vertices=tuple(vertex for node in scene.nodes for vertex in _ports_of(node, namespaces)),
        edges=tuple(edge for channel in channels(scene.nodes) for edge in _edges(channel)),
        clusters=(
            *namespaces.clusters(),
            *(_block(node, namespaces) for node in scene.nodes if node.ports),
        ),
    )


def _block(node: SceneNode, namespaces: Namespaces) -> Cluster:
    return Cluster(
        key=node_key(node),
        label=node.name,
        parent=namespaces.around(node.namespace),
        details=node.details,
        block=True,
        namespace=node.namespace,
        problem=node.problem,
    )


def _ports_of(node: SceneNode, namespaces: Namespaces) -> Iterator[Vertex]:
    if not node.ports:
        yield node_vertex(node, node.name, node.note, namespaces.around(node.namespace))
    for port in node.ports:
        yield Vertex(
            key=port_key(node, port),
            kind=VertexKind.PORT,
            lines=(port.name, port.kind.value),
            cluster=node_key(node),
            namespace=node.namespace,
            details=port.details,
            problem=port.problem,
        )


def _edges(channel: SceneChannel) -> Iterator[Edge]:
    for source in channel.sources:
        for sink in channel.sinks:
            # A message goes from source to sink, a request from the client to the server.
            towards_sink = channel.kind is ChannelKind.TOPIC
            begin, end = (source, sink) if towards_sink else (sink, source)
            source_key, target_key = _key(begin), _key(end)
            yield Edge(
                key=f"{source_key} -> {target_key}",
                source=source_key,
                target=target_key,
                kind=EdgeKind(channel.kind.value),
                lines=(channel.name, *_label_lines(source, sink)),
                details=(("from", dict(begin.port.details)), ("to", dict(end.port.details))),
                problem=worst((source.port.problem, sink.port.problem)),
            )


def _label_lines(source: SceneEndpoint, sink: SceneEndpoint) -> Iterator[str]:
    """Yield the type; for a topic also the rate and the QoS of both endpoints, once if equal."""
    yield " / ".join(dict.fromkeys(short_type(end.port.interface) for end in (source, sink)))
    if source.port.kind.channel is not ChannelKind.TOPIC:
        return
    if source.port.rate_hz is not None:
        yield rate(source.port.rate_hz)
    labels = dict.fromkeys(end.port.qos for end in (source, sink) if end.port.qos)
    if labels:
        yield " → ".join(labels)


def _key(endpoint: SceneEndpoint) -> str:
    return port_key(endpoint.node, endpoint.port)
