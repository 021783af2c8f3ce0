"""The vertex of a node: the same in every view but for its words and its frame."""

from __future__ import annotations

from composer.graph.diagram import Vertex, VertexKind
from composer.graph.scenes.scene import SceneNode, node_key


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
