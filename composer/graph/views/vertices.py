"""The vertex of a node: the same in every view but for its words and its frame."""

from __future__ import annotations

from composer.graph.keys import node_key
from composer.graph.picture import Kind, Vertex
from composer.graph.scene import Actor


def node_vertex(actor: Actor, name: str, note: str, cluster: str) -> Vertex:
    """Return the vertex of a node, with ``note`` below its name where there is one."""
    return Vertex(
        key=node_key(actor),
        kind=Kind.NODE,
        lines=tuple(filter(None, (name, note))),
        cluster=cluster,
        namespace=actor.namespace,
        details=actor.details,
        wrong=actor.wrong,
    )
