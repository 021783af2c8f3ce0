"""Render a graph as JSON. The format is part of the command's interface: only add to it."""

from __future__ import annotations

import json
from typing import Any

from composer.base.characters import escape_json
from composer.graph.diagram import Cluster, Edge, Graph, Vertex


def render(graph: Graph) -> str:
    """Return the graph as indented JSON text with a newline at the end."""
    data = {
        "title": graph.title,
        "view": graph.view,
        "clusters": [
            {"key": cluster.key, "label": cluster.label, "parent": cluster.parent or None}
            | _facts(cluster)
            for cluster in graph.clusters
        ],
        "vertices": [
            {
                "key": vertex.key,
                "kind": vertex.kind.value,
                "label": vertex.lines,
                "cluster": vertex.cluster or None,
            }
            | _facts(vertex)
            for vertex in graph.vertices
        ],
        "edges": [
            {
                "key": edge.key,
                "source": edge.source,
                "target": edge.target,
                "kind": edge.kind.value,
                "label": edge.lines,
            }
            | _facts(edge)
            for edge in graph.edges
        ],
    }
    return escape_json(json.dumps(data, indent=2, ensure_ascii=False)) + "\n"


def _facts(thing: Cluster | Vertex | Edge) -> dict[str, Any]:
    """Return the details, the text of a problem, and how the part is marked."""
    problem = thing.problem
    marked = {} if problem is None else {"mark": problem.mark.value}
    return {
        "details": dict(thing.details),
        "wrong": None if problem is None else problem.text,
        **marked,
    }
