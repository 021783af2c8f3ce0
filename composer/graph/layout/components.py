"""Split a graph into components joined by edges or frames, and pack their layouts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from composer.graph.diagram import Graph
from composer.graph.layout.result import Layout, Point, Size


def components(graph: Graph) -> list[Graph]:
    """Return the components in the order of their first vertices, with their frames."""
    around = outermost(graph)
    parent = {vertex.key: vertex.key for vertex in graph.vertices}

    def root(key: str) -> str:
        while parent[key] != key:
            parent[key] = parent[parent[key]]
            key = parent[key]
        return key

    first_in: dict[str, str] = {}
    for vertex in graph.vertices:
        frame = around.get(vertex.cluster)
        if frame is not None:
            parent[root(vertex.key)] = root(first_in.setdefault(frame, vertex.key))
    for edge in graph.edges:
        parent[root(edge.source)] = root(edge.target)
    members: dict[str, list[str]] = {}
    for vertex in graph.vertices:
        members.setdefault(root(vertex.key), []).append(vertex.key)
    return [_part(graph, set(keys), around) for keys in members.values()]


def outermost(graph: Graph) -> dict[str, str]:
    """Return the outermost cluster around each cluster; parents come before children."""
    found: dict[str, str] = {}
    for cluster in graph.clusters:
        found[cluster.key] = found[cluster.parent] if cluster.parent else cluster.key
    return found


def _part(graph: Graph, keys: set[str], around: dict[str, str]) -> Graph:
    vertices = tuple(vertex for vertex in graph.vertices if vertex.key in keys)
    frames = {around[vertex.cluster] for vertex in vertices if vertex.cluster}
    return replace(
        graph,
        vertices=vertices,
        edges=tuple(edge for edge in graph.edges if edge.source in keys),
        clusters=tuple(item for item in graph.clusters if around[item.key] in frames),
    )


MARGIN = 16.0
#: The target aspect ratio, width to height, of a screen.
_ASPECT = 1.6


def pack_components(layouts: Sequence[Layout]) -> Layout:
    """Pack layouts side by side in rows."""
    area = sum(layout.size.width * layout.size.height for layout in layouts)
    widest = max((layout.size.width for layout in layouts), default=0.0)
    limit = max(widest, math.sqrt(area * _ASPECT))
    moved = [
        layout.moved(corner)
        for layout, corner in zip(layouts, _corners(layouts, limit), strict=True)
    ]
    # Each part has a margin; between two parts, one is enough.
    return Layout(
        size=Size(
            max((part.size.width for part in moved), default=2 * MARGIN),
            max((part.size.height for part in moved), default=2 * MARGIN),
        ),
        vertices={key: place for part in moved for key, place in part.vertices.items()},
        frames=tuple(frame for part in moved for frame in part.frames),
        paths=tuple(path for part in moved for path in part.paths),
    )


def _corners(layouts: Sequence[Layout], limit: float) -> list[Point]:
    corners = []
    x = y = height = 0.0
    for layout in layouts:
        if x > 0.0 and x + layout.size.width > limit:
            x, y, height = 0.0, y + height - MARGIN, 0.0
        corners.append(Point(x, y))
        x += layout.size.width - MARGIN
        height = max(height, layout.size.height)
    return corners
