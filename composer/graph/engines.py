"""Lay out graphs with Graphviz if it is installed, else with the bundled engine."""

from __future__ import annotations

from collections.abc import Iterator

from composer.diagram_options import Engine
from composer.graph import graphviz
from composer.graph.diagram import Graph
from composer.graph.layout import Layout, Point, Rectangle, Size, Sizes, arrange
from composer.graph.measure import sizes

__all__ = ["Engine", "has_overlaps", "lay_out"]


def lay_out(graph: Graph, engine: Engine) -> Layout:
    """Return the layout of a graph. Raises GraphvizFailed for the engine ``graphviz``.

    ``auto`` falls back to the bundled engine if Graphviz is missing, fails, or gives overlaps.
    """
    needed = sizes(graph)
    if engine is Engine.BUNDLED:
        return arrange(graph, needed)
    try:
        found = arrange(graph, needed, graphviz.lay_out)
    except graphviz.GraphvizFailed:
        if engine is Engine.GRAPHVIZ:
            raise
        return arrange(graph, needed)
    if engine is Engine.AUTO and has_overlaps(graph, found, needed):
        return arrange(graph, needed)
    return found


#: Rounding tolerance in pixels.
_TOLERANCE = 0.5


def has_overlaps(graph: Graph, layout: Layout, sizes: Sizes) -> bool:
    """Return whether any boxes, labels or titles of frames overlap."""
    open_places: list[Rectangle] = []
    for place in sorted(_places(graph, layout, sizes), key=lambda place: place.top):
        open_places = [
            other for other in open_places if other.top + other.size.height > place.top + _TOLERANCE
        ]
        if any(_overlap(place, other) for other in open_places):
            return True
        open_places.append(place)
    return False


def _places(graph: Graph, layout: Layout, sizes: Sizes) -> Iterator[Rectangle]:
    blocks = {cluster.key for cluster in graph.clusters if cluster.block}
    for vertex in graph.vertices:
        if vertex.cluster not in blocks:
            yield layout.vertices[vertex.key]
    for frame in layout.frames:
        yield frame.place if frame.cluster.block else _title(frame.place, sizes, frame.cluster.key)
    for path in layout.paths:
        if path.label is not None:
            yield Rectangle(path.label, sizes.labels[path.edge.key])


def _title(frame: Rectangle, sizes: Sizes, key: str) -> Rectangle:
    """Return the rectangle of a frame's title."""
    size = Size(sizes.frames[key].width, 10.0)
    return Rectangle(Point(frame.left + 12.0 + size.width / 2, frame.top + 14.0), size)


def _overlap(first: Rectangle, second: Rectangle) -> bool:
    room = Size(
        (first.size.width + second.size.width) / 2 - abs(first.center.x - second.center.x),
        (first.size.height + second.size.height) / 2 - abs(first.center.y - second.center.y),
    )
    return room.width > _TOLERANCE and room.height > _TOLERANCE
