"""The order of the bring-up: which step each node takes when, and whom it waits for."""

from __future__ import annotations

from composer.graph.namespaces import Namespaces
from composer.graph.picture import Direction, Edge, Graph, Line
from composer.graph.scene import Scene
from composer.graph.views.vertices import node_vertex


def build(scene: Scene) -> Graph:
    """Return the graph of dependencies. Arrows point from a node to those that wait for it."""
    namespaces = Namespaces(actor.namespace for actor in scene.actors)
    return Graph(
        title=scene.title,
        view="lifecycle",
        direction=Direction.DOWN,
        vertices=tuple(
            node_vertex(
                actor,
                actor.name,
                actor.steps or "stays unconfigured",
                namespaces.around(actor.namespace),
            )
            for actor in scene.actors
        ),
        edges=tuple(
            Edge(
                key=f"node:{wait.waited_for} -> node:{wait.waiting} {wait.reason}",
                source=f"node:{wait.waited_for}",
                target=f"node:{wait.waiting}",
                kind=Line.IMPLIED if wait.implied else Line.DEPENDENCY,
                lines=(wait.reason,),
            )
            for wait in scene.waits
        ),
        clusters=namespaces.clusters(),
    )
