"""The nodes and the topics, services and actions between them."""

from __future__ import annotations

from collections.abc import Iterator

from composer.graph.diagram import Direction, Edge, EdgeKind, Graph, Problem, Vertex, VertexKind
from composer.graph.labels import rate, short_type
from composer.graph.namespaces import Namespaces, parent_of
from composer.graph.scenes.facts import channel_facts
from composer.graph.scenes.scene import (
    SENDING,
    Scene,
    SceneChannel,
    SceneEndpoint,
    channel_key,
    channels,
    node_key,
    port_key,
)
from composer.graph.views.vertices import node_vertex
from composer.model import ChannelKind, PortKind


def build(scene: Scene) -> Graph:
    """Return the graph of nodes and channels. Arrows point in the direction of data or requests."""
    namespaces = Namespaces(node.namespace for node in scene.nodes)
    joined = channels(scene.nodes)
    return Graph(
        title=scene.title,
        view="nodes",
        direction=Direction.RIGHT,
        vertices=(
            *(
                node_vertex(node, node.name, node.note, namespaces.around(node.namespace))
                for node in scene.nodes
            ),
            *(_channel(channel, namespaces, scene) for channel in joined),
        ),
        edges=tuple(edge for channel in joined for edge in _edges(channel)),
        clusters=namespaces.clusters(),
    )


def _channel(channel: SceneChannel, namespaces: Namespaces, scene: Scene) -> Vertex:
    measured = scene.rates_hz.get(channel.name) if channel.kind is ChannelKind.TOPIC else None
    return Vertex(
        key=channel_key(channel),
        kind=VertexKind(channel.kind.value),
        lines=(
            channel.name,
            " / ".join(dict.fromkeys(map(short_type, channel.types))),
            *([] if measured is None else [rate(measured)]),
        ),
        cluster=namespaces.around_name(channel.name),
        namespace=parent_of(channel.name),
        details=channel_facts(channel),
        problem=Problem(f"more than one type: {', '.join(channel.types)}")
        if len(channel.types) > 1
        else None,
    )


def _edges(channel: SceneChannel) -> Iterator[Edge]:
    """Yield an arrow for each port: node to channel where it sends, channel to node elsewhere."""
    for endpoint in channel.endpoints:
        node, port = endpoint.node, endpoint.port
        keys = (node_key(node), channel_key(channel))
        source, target = keys if port.kind in SENDING else keys[::-1]
        yield Edge(
            key=port_key(node, port),
            source=source,
            target=target,
            kind=EdgeKind(channel.kind.value),
            lines=_label(channel, endpoint),
            details=port.details,
            problem=port.problem,
        )


def _label(channel: SceneChannel, endpoint: SceneEndpoint) -> tuple[str, ...]:
    """Say the rate of a publisher, and the QoS; a subscription's only if it differs from that."""
    if channel.kind is not ChannelKind.TOPIC:
        return ()
    port = endpoint.port
    lines = []
    if port.kind is PortKind.PUBLISHER and port.rate_hz is not None:
        lines.append(rate(port.rate_hz))
    offered = {source.port.qos for source in channel.sources}
    has_rate = port.kind is PortKind.SUBSCRIPTION and offered == {port.qos}
    if port.qos and not has_rate:
        lines.append(port.qos)
    return tuple(lines)
