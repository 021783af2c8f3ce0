"""The views of a scene: what nodes exchange through channels or port by port, and all others."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from composer.graph.declared import scene_of
from composer.graph.diagram import (
    Cluster,
    Direction,
    Edge,
    EdgeKind,
    Graph,
    Namespaces,
    Problem,
    Vertex,
    VertexKind,
    View,
    parent_of,
    worst,
)
from composer.graph.facts import channel_facts, rate, short_type
from composer.graph.live import live_scene_of
from composer.graph.node_views import (
    deployment_view,
    frames_view,
    lifecycle_view,
    node_vertex,
    states_view,
)
from composer.graph.scene import (
    MAX_PAIRS,
    SENDING,
    Scene,
    SceneChannel,
    SceneEndpoint,
    SceneNode,
    channel_key,
    channels,
    drawn_pairs,
    node_key,
    port_key,
)
from composer.model import ChannelKind, PortKind

__all__ = ["View", "build_graph", "live_scene_of", "scene_of"]


def nodes_view(scene: Scene) -> Graph:
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
            *(_channel_vertex(channel, namespaces, scene) for channel in joined),
        ),
        edges=tuple(edge for channel in joined for edge in _channel_edges(channel)),
        clusters=namespaces.clusters(),
    )


def _channel_vertex(channel: SceneChannel, namespaces: Namespaces, scene: Scene) -> Vertex:
    measured = scene.rates_hz.get(channel.name) if channel.kind is ChannelKind.TOPIC else None
    return Vertex(
        key=channel_key(channel),
        kind=VertexKind(channel.kind.value),
        lines=(
            channel.name,
            " / ".join(dict.fromkeys(map(short_type, channel.types))),
            *([] if measured is None else [rate(measured)]),
        ),
        cluster=namespaces.around(parent_of(channel.name)),
        namespace=parent_of(channel.name),
        details=channel_facts(channel),
        problem=Problem(f"more than one type: {', '.join(channel.types)}")
        if len(channel.types) > 1
        else None,
    )


def _channel_edges(channel: SceneChannel) -> Iterator[Edge]:
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
            lines=_channel_label(channel, endpoint),
            details=port.details,
            problem=port.problem,
        )


def _channel_label(channel: SceneChannel, endpoint: SceneEndpoint) -> tuple[str, ...]:
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


def connections_view(scene: Scene) -> Graph:
    """Return the graph of ports: nodes are blocks of their ports, arrows join ports."""
    namespaces = Namespaces(node.namespace for node in scene.nodes)
    return Graph(
        title=scene.title,
        view="connections",
        direction=Direction.RIGHT,
        vertices=tuple(vertex for node in scene.nodes for vertex in _ports_of(node, namespaces)),
        edges=tuple(edge for channel in channels(scene.nodes) for edge in _port_edges(channel)),
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


def _port_edges(channel: SceneChannel) -> Iterator[Edge]:
    sources, sinks = channel.sources, channel.sinks
    is_complete = len(sources) * len(sinks) <= MAX_PAIRS
    note = () if is_complete else (f"{len(sources)} by {len(sinks)}, not all are drawn",)
    for source, sink in drawn_pairs(sources, sinks):
        # A message goes from source to sink, a request from the client to the server.
        towards_sink = channel.kind is ChannelKind.TOPIC
        begin, end = (source, sink) if towards_sink else (sink, source)
        source_key, target_key = _key(begin), _key(end)
        yield Edge(
            key=f"{source_key} -> {target_key}",
            source=source_key,
            target=target_key,
            kind=EdgeKind(channel.kind.value),
            lines=(channel.name, *_label_lines(source, sink), *note),
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


_VIEWS: dict[View, Callable[[Scene], Graph]] = {
    View.NODES: nodes_view,
    View.CONNECTIONS: connections_view,
    View.LIFECYCLE: lifecycle_view,
    View.DEPLOYMENT: deployment_view,
    View.STATES: states_view,
    View.FRAMES: frames_view,
}


def build_graph(scene: Scene, view: View = View.NODES) -> Graph:
    """Return the diagram of a scene."""
    return _VIEWS[view](scene)
