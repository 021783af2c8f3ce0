"""The tree of frames of tf2, with the nodes that broadcast the transforms."""

from __future__ import annotations

from collections.abc import Iterator

from composer.graph.diagram import (
    Cluster,
    Details,
    Direction,
    Edge,
    EdgeKind,
    Graph,
    Vertex,
    VertexKind,
)
from composer.graph.scenes.scene import Scene, SceneTransform


def build(scene: Scene) -> Graph:
    """Return the graph of frames. Arrows point from a parent to its child."""
    topics = tuple(dict.fromkeys(item.topic for item in scene.transforms))
    several = len(topics) > 1
    return Graph(
        title=scene.title,
        view="frames",
        direction=Direction.DOWN,
        vertices=tuple(_vertices(scene.transforms, several=several)),
        edges=tuple(_edges(scene.transforms)),
        clusters=tuple(Cluster(_cluster(topic), topic) for topic in topics) if several else (),
    )


def _vertices(transforms: tuple[SceneTransform, ...], *, several: bool) -> Iterator[Vertex]:
    frames = dict.fromkeys(
        (item.topic, name) for item in transforms for name in (item.parent, item.child)
    )
    for topic, name in frames:
        own = [item for item in transforms if (item.topic, item.child) == (topic, name)]
        details: Details = (("broadcast by", [item.node for item in own]),) if own else ()
        yield Vertex(
            key=_key(topic, name),
            kind=VertexKind.FRAME,
            lines=(name,),
            cluster=_cluster(topic) if several else "",
            details=details,
        )


def _edges(transforms: tuple[SceneTransform, ...]) -> Iterator[Edge]:
    for number, item in enumerate(transforms, 1):
        parent, child = _key(item.topic, item.parent), _key(item.topic, item.child)
        yield Edge(
            key=f"{parent} -> {child} {number}",
            source=parent,
            target=child,
            kind=EdgeKind.TRANSFORM,
            lines=(item.node, item.kind),
            details=(("node", item.node), ("kind", item.kind), *item.details),
            problem=item.problem,
        )


def _key(topic: str, frame: str) -> str:
    return f"frame:{topic}:{frame}"


def _cluster(topic: str) -> str:
    return f"topic:{topic}"
