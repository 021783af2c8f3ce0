"""The nodes and the topics, services and actions between them."""

from __future__ import annotations

from collections.abc import Iterator

from composer.graph.facts import channel_facts
from composer.graph.keys import channel_key, end_key, node_key
from composer.graph.labels import rate, short_type
from composer.graph.namespaces import Namespaces, parent_of
from composer.graph.picture import Direction, Edge, Graph, Kind, Line, Vertex
from composer.graph.scene import SENDING, Channel, Meeting, Scene, channels
from composer.graph.views.vertices import node_vertex
from composer.model import ChannelKind, PortKind


def build(scene: Scene) -> Graph:
    """Return the graph of who talks to whom over what. Arrows point where data or requests go."""
    namespaces = Namespaces(actor.namespace for actor in scene.actors)
    joined = channels(scene.actors)
    return Graph(
        title=scene.title,
        view="nodes",
        direction=Direction.RIGHT,
        vertices=(
            *(
                node_vertex(actor, actor.name, actor.note, namespaces.around(actor.namespace))
                for actor in scene.actors
            ),
            *(_channel(channel, namespaces, scene) for channel in joined),
        ),
        edges=tuple(edge for channel in joined for edge in _edges(channel)),
        clusters=namespaces.clusters(),
    )


def _channel(channel: Channel, namespaces: Namespaces, scene: Scene) -> Vertex:
    measured = scene.rates_hz.get(channel.name) if channel.kind is ChannelKind.TOPIC else None
    return Vertex(
        key=channel_key(channel),
        kind=Kind(channel.kind.value),
        lines=(
            channel.name,
            " / ".join(dict.fromkeys(map(short_type, channel.types))),
            *([] if measured is None else [rate(measured)]),
        ),
        cluster=namespaces.around_name(channel.name),
        namespace=parent_of(channel.name),
        details=channel_facts(channel),
        wrong=f"more than one type: {', '.join(channel.types)}" if len(channel.types) > 1 else "",
    )


def _edges(channel: Channel) -> Iterator[Edge]:
    """Yield an arrow for each port: node to channel where it sends, channel to node elsewhere."""
    for meeting in channel.ends:
        actor, end = meeting.actor, meeting.end
        ends = (node_key(actor), channel_key(channel))
        source, target = ends if end.kind in SENDING else ends[::-1]
        yield Edge(
            key=end_key(actor, end),
            source=source,
            target=target,
            kind=Line(channel.kind.value),
            lines=_label(channel, meeting),
            details=end.details,
            wrong=end.wrong,
        )


def _label(channel: Channel, meeting: Meeting) -> tuple[str, ...]:
    """Say the rate of a publisher, and the QoS; a subscription's only if it differs from that."""
    if channel.kind is not ChannelKind.TOPIC:
        return ()
    end = meeting.end
    lines = []
    if end.kind is PortKind.PUBLISHER and end.rate_hz is not None:
        lines.append(rate(end.rate_hz))
    offered = {source.end.qos for source in channel.sources}
    is_told = end.kind is PortKind.SUBSCRIPTION and offered == {end.qos}
    if end.qos and not is_told:
        lines.append(end.qos)
    return tuple(lines)
