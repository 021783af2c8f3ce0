"""Who runs what: executors as frames around their nodes, and what passes between nodes.

In a running graph, the frames are processes and hosts, and nodes have their states.
"""

from __future__ import annotations

from collections.abc import Iterator

from composer.graph.diagram import Cluster, Direction, Edge, EdgeKind, Graph
from composer.graph.scenes.scene import Scene, channels, node_key
from composer.graph.views.vertices import node_vertex
from composer.model import ChannelKind

#: An arrow that stands for more names than these says how many.
_MAX_NAMES = 3


def build(scene: Scene) -> Graph:
    """Return the graph of executors or processes, each with its nodes."""
    return Graph(
        title=scene.title,
        view="deployment",
        direction=Direction.RIGHT,
        vertices=tuple(
            node_vertex(node, node.full_name, node.note if scene.is_live else "", node.executor)
            for node in scene.nodes
        ),
        edges=tuple(_edges(scene)),
        clusters=tuple(Cluster(group.key, group.label, group.parent) for group in scene.executors),
    )


def _edges(scene: Scene) -> Iterator[Edge]:
    """Return one arrow per pair of nodes and kind of channel."""
    names: dict[tuple[str, str, ChannelKind], dict[str, None]] = {}
    for channel in channels(scene.nodes):
        for source in channel.sources:
            for sink in channel.sinks:
                keys = (node_key(source.node), node_key(sink.node))
                if channel.kind is not ChannelKind.TOPIC:
                    keys = keys[::-1]
                names.setdefault((*keys, channel.kind), {})[channel.name] = None
    for (begin, end, kind), joined in sorted(names.items()):
        yield Edge(
            key=f"{begin} -> {end} {kind}",
            source=begin,
            target=end,
            kind=EdgeKind(kind.value),
            lines=_label(tuple(joined), kind),
            details=(("carries", [*joined]),),
        )


def _label(names: tuple[str, ...], kind: ChannelKind) -> tuple[str, ...]:
    if len(names) <= _MAX_NAMES:
        return names
    return (*names[: _MAX_NAMES - 1], f"and {len(names) - _MAX_NAMES + 1} more {kind}s")
