"""The parts of a graph that nothing joins: no arrow, and no frame around them."""

from __future__ import annotations

from dataclasses import replace

from composer.graph.picture import Graph


def components(graph: Graph) -> list[Graph]:
    """Return the parts, in the order of their first vertices, with the frames they need."""
    outermost = _outermost(graph)
    parent = {vertex.key: vertex.key for vertex in graph.vertices}

    def root(key: str) -> str:
        while parent[key] != key:
            parent[key] = parent[parent[key]]
            key = parent[key]
        return key

    first_in: dict[str, str] = {}
    for vertex in graph.vertices:
        frame = outermost.get(vertex.cluster)
        if frame is not None:
            parent[root(vertex.key)] = root(first_in.setdefault(frame, vertex.key))
    for edge in graph.edges:
        parent[root(edge.source)] = root(edge.target)
    members: dict[str, list[str]] = {}
    for vertex in graph.vertices:
        members.setdefault(root(vertex.key), []).append(vertex.key)
    return [_part(graph, set(keys), outermost) for keys in members.values()]


def _outermost(graph: Graph) -> dict[str, str]:
    """Return the outermost cluster around each cluster; parents come before children."""
    found: dict[str, str] = {}
    for cluster in graph.clusters:
        found[cluster.key] = found[cluster.parent] if cluster.parent else cluster.key
    return found


def _part(graph: Graph, keys: set[str], outermost: dict[str, str]) -> Graph:
    vertices = tuple(vertex for vertex in graph.vertices if vertex.key in keys)
    frames = {outermost[vertex.cluster] for vertex in vertices if vertex.cluster}
    return replace(
        graph,
        vertices=vertices,
        edges=tuple(edge for edge in graph.edges if edge.source in keys),
        clusters=tuple(item for item in graph.clusters if outermost[item.key] in frames),
    )
