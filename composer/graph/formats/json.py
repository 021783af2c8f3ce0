"""Render a graph as JSON. The format is part of the command's interface: only add to it."""

from __future__ import annotations

import json
from typing import Any

from composer.characters import escape_json
from composer.graph.diagram import Cluster, Edge, Graph, Problem, Vertex


def render(graph: Graph) -> str:
    """Return the graph as indented JSON text with a newline at the end."""
    return escape_json(json.dumps(as_data(graph), indent=2, ensure_ascii=False)) + "\n"


def as_data(graph: Graph) -> dict[str, Any]:
    """Return the graph as plain data."""
    return {
        "title": graph.title,
        "view": graph.view,
        "clusters": [_cluster(cluster) for cluster in graph.clusters],
        "vertices": [_vertex(vertex) for vertex in graph.vertices],
        "edges": [_edge(edge) for edge in graph.edges],
    }


def _cluster(cluster: Cluster) -> dict[str, Any]:
    return {
        "key": cluster.key,
        "label": cluster.label,
        "parent": cluster.parent or None,
        "details": dict(cluster.details),
        **_problem(cluster.problem),
    }


def _vertex(vertex: Vertex) -> dict[str, Any]:
    return {
        "key": vertex.key,
        "kind": vertex.kind.value,
        "label": list(vertex.lines),
        "cluster": vertex.cluster or None,
        "details": dict(vertex.details),
        **_problem(vertex.problem),
    }


def _edge(edge: Edge) -> dict[str, Any]:
    return {
        "key": edge.key,
        "source": edge.source,
        "target": edge.target,
        "kind": edge.kind.value,
        "label": list(edge.lines),
        "details": dict(edge.details),
        **_problem(edge.problem),
    }


def _problem(problem: Problem | None) -> dict[str, str | None]:
    """Return the text of a problem, and how the part is marked."""
    if problem is None:
        return {"wrong": None}
    return {"wrong": problem.text, "mark": problem.mark.value}
