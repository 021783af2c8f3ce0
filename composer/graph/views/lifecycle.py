"""The bring-up order: the steps of each node and the nodes that it waits for."""

from __future__ import annotations

from composer.graph.diagram import Direction, Edge, EdgeKind, Graph
from composer.graph.namespaces import Namespaces
from composer.graph.scenes.scene import Scene
from composer.graph.views.vertices import node_vertex


def build(scene: Scene) -> Graph:
    """Return the graph of dependencies. Arrows point from a node to those that wait for it."""
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
        edges=tuple(
            Edge(
                key=f"node:{wait.waited_for} -> node:{wait.waiting} {wait.reason}",
                source=f"node:{wait.waited_for}",
                target=f"node:{wait.waiting}",
                kind=EdgeKind.IMPLIED if wait.implied else EdgeKind.DEPENDENCY,
                lines=(wait.reason,),
            )
            for wait in scene.waits
        ),
        clusters=namespaces.clusters(),
    )
