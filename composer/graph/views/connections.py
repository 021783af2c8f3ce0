"""Every port, and what it is joined to with which type and QoS."""

from __future__ import annotations

from collections.abc import Iterator

from composer.graph.keys import end_key, node_key
from composer.graph.labels import rate, short_type
from composer.graph.namespaces import Namespaces
from composer.graph.picture import Cluster, Direction, Edge, Graph, Kind, Line, Vertex
from composer.graph.scene import Actor, Channel, Meeting, Scene, channels
from composer.graph.views.vertices import node_vertex
from composer.model import ChannelKind


def build(scene: Scene) -> Graph:
    """Return the graph of ports: nodes are blocks of their ports, arrows join ports."""
    namespaces = Namespaces(actor.namespace for actor in scene.actors)
    return Graph(
        title=scene.title,
        view="connections",
        direction=Direction.RIGHT,
        vertices=tuple(vertex for actor in scene.actors for vertex in _ports_of(actor, namespaces)),
        edges=tuple(edge for channel in channels(scene.actors) for edge in _edges(channel)),
        clusters=(
            *namespaces.clusters(),
            *(_block(actor, namespaces) for actor in scene.actors if actor.ends),
        ),
    )


def _block(actor: Actor, namespaces: Namespaces) -> Cluster:
    return Cluster(
        key=node_key(actor),
        label=actor.name,
        parent=namespaces.around(actor.namespace),
        details=actor.details,
        block=True,
        namespace=actor.namespace,
        wrong=actor.wrong,
    )


def _ports_of(actor: Actor, namespaces: Namespaces) -> Iterator[Vertex]:
    if not actor.ends:
        yield node_vertex(actor, actor.name, actor.note, namespaces.around(actor.namespace))
    for end in actor.ends:
        yield Vertex(
            key=end_key(actor, end),
            kind=Kind.PORT,
            lines=(end.name, end.kind.value),
            cluster=node_key(actor),
            namespace=actor.namespace,
            details=end.details,
            wrong=end.wrong,
        )


def _edges(channel: Channel) -> Iterator[Edge]:
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
                kind=Line(channel.kind.value),
                lines=(channel.name, *_said(source, sink)),
                details=(("from", dict(begin.end.details)), ("to", dict(end.end.details))),
                wrong=source.end.wrong or sink.end.wrong,
            )


def _said(source: Meeting, sink: Meeting) -> Iterator[str]:
    """Yield the type; of a topic the rate and the QoS of both ends, once where they agree."""
    yield " / ".join(dict.fromkeys(short_type(end.end.interface) for end in (source, sink)))
    if source.end.kind.channel is not ChannelKind.TOPIC:
        return
    if source.end.rate_hz is not None:
        yield rate(source.end.rate_hz)
    told = dict.fromkeys(end.end.qos for end in (source, sink) if end.end.qos)
    if told:
        yield " → ".join(told)


def _key(meeting: Meeting) -> str:
    return end_key(meeting.actor, meeting.end)
