"""Views of nodes: bring-up order, deployment, lifecycle states, and the frames of tf2."""

from __future__ import annotations

from collections.abc import Iterator

from composer.graph.diagram import (
    Cluster,
    Details,
    Direction,
    Edge,
    EdgeKind,
    Graph,
    Namespaces,
    Vertex,
    VertexKind,
    worst,
)
from composer.graph.scene import (
    MAX_PAIRS,
    Scene,
    SceneNode,
    SceneTransform,
    channels,
    drawn_pairs,
    node_key,
)
from composer.model import ChannelKind
from composer.model.lifecycle import PRIMARY_STATES, TRANSITIONS

#: An arrow that stands for more names than these says how many.
_MAX_NAMES = 3

#: A state with more nodes than these says how many more there are.
_MAX_NODES = 24


def node_vertex(node: SceneNode, name: str, note: str, cluster: str) -> Vertex:
    """Return the vertex of a node, with an optional ``note`` below its name."""
    return Vertex(
        key=node_key(node),
        kind=VertexKind.NODE,
        lines=(name, note) if note else (name,),
        cluster=cluster,
        namespace=node.namespace,
        details=node.details,
        problem=node.problem,
    )


def lifecycle_view(scene: Scene) -> Graph:
    """Return the bring-up order. Arrows point from a node to those that wait for it."""
    namespaces = Namespaces(node.namespace for node in scene.nodes)
    return Graph(
        title=scene.title,
        view="lifecycle",
        direction=Direction.DOWN,
        vertices=tuple(
            node_vertex(
                node,
                node.name,
                node.steps or "stays unconfigured",
                namespaces.around(node.namespace),
            )
            for node in scene.nodes
        ),
        edges=scene.waits,
        clusters=namespaces.clusters(),
    )


def deployment_view(scene: Scene) -> Graph:
    """Return the graph of executors with their nodes, and of what passes between nodes.

    In a running graph, the frames are processes and hosts, and nodes have their states.
    """
    return Graph(
        title=scene.title,
        view="deployment",
        direction=Direction.RIGHT,
        vertices=tuple(
            node_vertex(node, node.full_name, node.note if scene.is_live else "", node.executor)
            for node in scene.nodes
        ),
        edges=tuple(_deployment_edges(scene)),
        clusters=scene.executors,
    )


def _deployment_edges(scene: Scene) -> Iterator[Edge]:
    """Return one arrow per pair of nodes and kind of channel."""
    names: dict[tuple[str, str, ChannelKind], dict[str, None]] = {}
    for channel in channels(scene.nodes):
        sources = [*dict.fromkeys(node_key(end.node) for end in channel.sources)]
        sinks = [*dict.fromkeys(node_key(end.node) for end in channel.sinks)]
        is_complete = len(sources) * len(sinks) <= MAX_PAIRS
        name = channel.name if is_complete else f"{channel.name}, not all are drawn"
        for keys in drawn_pairs(sources, sinks):
            begin, end = keys if channel.kind is ChannelKind.TOPIC else keys[::-1]
            names.setdefault((begin, end, channel.kind), {})[name] = None
    for (begin, end, kind), joined in sorted(names.items()):
        yield Edge(
            key=f"{begin} -> {end} {kind}",
            source=begin,
            target=end,
            kind=EdgeKind(kind.value),
            lines=_names_in_short(tuple(joined), kind),
            details=(("carries", [*joined]),),
        )


def _names_in_short(names: tuple[str, ...], kind: ChannelKind) -> tuple[str, ...]:
    if len(names) <= _MAX_NAMES:
        return names
    return (*names[: _MAX_NAMES - 1], f"and {len(names) - _MAX_NAMES + 1} more {kind}s")


def states_view(scene: Scene) -> Graph:
    """Return the state machine; each state lists the nodes that are in it."""
    others = sorted({node.state for node in scene.nodes} - {*PRIMARY_STATES, ""})
    return Graph(
        title=scene.title,
        view="states",
        direction=Direction.RIGHT,
        vertices=tuple(_state(state, scene) for state in (*PRIMARY_STATES, *others)),
        edges=tuple(
            Edge(
                f"state:{begin} -> state:{transition.goal}",
                f"state:{begin}",
                f"state:{transition.goal}",
                EdgeKind.TRANSITION,
                (name,),
            )
            for name, transition in TRANSITIONS.items()
            for begin in transition.ids
        ),
    )


def _state(state: str, scene: Scene) -> Vertex:
    nodes = [node for node in scene.nodes if node.state == state]
    names = [node.full_name for node in nodes]
    shown = names if len(names) <= _MAX_NODES else names[: _MAX_NODES - 1]
    more = [f"and {len(names) - len(shown)} more"] if len(names) > len(shown) else []
    return Vertex(
        key=f"state:{state}",
        kind=VertexKind.STATE,
        lines=(state, *shown, *more),
        details=(("nodes", [*names]),),
        problem=worst(node.problem for node in nodes),
    )


def frames_view(scene: Scene) -> Graph:
    """Return the tree of frames of tf2. Arrows point from a parent to its child."""
    topics = tuple(dict.fromkeys(item.topic for item in scene.transforms))
    several = len(topics) > 1
    return Graph(
        title=scene.title,
        view="frames",
        direction=Direction.DOWN,
        vertices=tuple(_frame_vertices(scene.transforms, several=several)),
        edges=tuple(_frame_edges(scene.transforms)),
        clusters=tuple(Cluster(_topic_cluster(topic), topic) for topic in topics)
        if several
        else (),
    )


def _frame_vertices(transforms: tuple[SceneTransform, ...], *, several: bool) -> Iterator[Vertex]:
    frames = dict.fromkeys(
        (item.topic, name) for item in transforms for name in (item.parent, item.child)
    )
    by_frame: dict[tuple[str, str], list[str]] = {}
    for item in transforms:
        by_frame.setdefault((item.topic, item.child), []).append(item.node)
    for topic, name in frames:
        broadcasters = by_frame.get((topic, name), [])
        details: Details = (("broadcast by", [*broadcasters]),) if broadcasters else ()
        yield Vertex(
            key=_frame_key(topic, name),
            kind=VertexKind.FRAME,
            lines=(name,),
            cluster=_topic_cluster(topic) if several else "",
            details=details,
        )


def _frame_edges(transforms: tuple[SceneTransform, ...]) -> Iterator[Edge]:
    for number, item in enumerate(transforms, 1):
        parent, child = _frame_key(item.topic, item.parent), _frame_key(item.topic, item.child)
        yield Edge(
            key=f"{parent} -> {child} {number}",
            source=parent,
            target=child,
            kind=EdgeKind.TRANSFORM,
            lines=(item.node, item.kind),
            details=(("node", item.node), ("kind", item.kind), *item.details),
            problem=item.problem,
        )


def _frame_key(topic: str, frame: str) -> str:
    return f"frame:{topic}:{frame}"


def _topic_cluster(topic: str) -> str:
    return f"topic:{topic}"
