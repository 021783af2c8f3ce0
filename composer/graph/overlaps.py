"""Whether a layout can be read: no box, no label and no frame's title on another."""

from __future__ import annotations

from collections.abc import Iterator

from composer.graph.layout import Layout, Place, Point, Size, Sizes
from composer.graph.picture import Graph

#: So much is rounding.
_TOLERANCE = 0.5


def has_overlaps(graph: Graph, layout: Layout, sizes: Sizes) -> bool:
    """Say whether any two of the things that must be seen lie on one another."""
    open_places: list[Place] = []
    for place in sorted(_places(graph, layout, sizes), key=lambda place: place.top):
        open_places = [
            other for other in open_places if other.top + other.size.height > place.top + _TOLERANCE
        ]
        if any(_overlap(place, other) for other in open_places):
            return True
        open_places.append(place)
    return False


def _places(graph: Graph, layout: Layout, sizes: Sizes) -> Iterator[Place]:
    blocks = {cluster.key for cluster in graph.clusters if cluster.block}
    for vertex in graph.vertices:
        if vertex.cluster not in blocks:
            yield layout.vertices[vertex.key]
    for frame in layout.frames:
        yield frame.place if frame.cluster.block else _title(frame.place, sizes, frame.cluster.key)
    for path in layout.paths:
        if path.label is not None:
            yield Place(path.label, sizes.labels[path.edge.key])


def _title(frame: Place, sizes: Sizes, key: str) -> Place:
    """Return where ``drawing`` writes a frame's title."""
    size = Size(sizes.frames[key].width, 10.0)
    return Place(Point(frame.left + 12.0 + size.width / 2, frame.top + 14.0), size)


def _overlap(first: Place, second: Place) -> bool:
    room = Size(
        (first.size.width + second.size.width) / 2 - abs(first.center.x - second.center.x),
        (first.size.height + second.size.height) / 2 - abs(first.center.y - second.center.y),
    )
    return room.width > _TOLERANCE and room.height > _TOLERANCE
