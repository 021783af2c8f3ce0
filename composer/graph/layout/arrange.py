"""The layout from graph to places: the steps in their order, and the way back to x and y."""

from __future__ import annotations

from collections.abc import Iterator

from composer.graph.layout.boxes import Item
from composer.graph.layout.build import Parts, Sizes, build
from composer.graph.layout.columns import Extent, columns, reach
from composer.graph.layout.order import put_in_order
from composer.graph.layout.result import Frame, Layout, Place, Point, Size
from composer.graph.layout.routes import Router
from composer.graph.layout.straighten import straighten
from composer.graph.picture import Graph

_MARGIN = 16.0


def arrange(graph: Graph, sizes: Sizes) -> Layout:
    """Return the layout of ``graph``; everything in it is as big as ``sizes`` says."""
    if not graph.vertices:
        return Layout(Size(2 * _MARGIN, 2 * _MARGIN), (), (), ())
    parts = build(graph, sizes)
    put_in_order(parts.root)
    straighten(parts.root)
    parts.root.shift(_MARGIN - parts.root.low)
    return _places(parts, columns(parts.root, _MARGIN))


def _places(parts: Parts, ranks: list[Extent]) -> Layout:
    end = reach(parts.root, ranks).end
    frames = tuple(_frames(parts, ranks))
    return Layout(
        size=parts.axes.size(end + _MARGIN, parts.root.high + _MARGIN),
        vertices=tuple(
            (vertex, _place(parts, parts.boxes[vertex.key], ranks))
            for vertex in parts.graph.vertices
        ),
        frames=frames,
        paths=Router(parts.axes, ranks).paths(parts.chains),
    )


def _frames(parts: Parts, ranks: list[Extent]) -> Iterator[Frame]:
    for cluster in parts.graph.clusters:
        group = parts.groups[cluster.key]
        if group.children:
            yield Frame(cluster, _place(parts, group, ranks))


def _place(parts: Parts, item: Item, ranks: list[Extent]) -> Place:
    along = reach(item, ranks)
    center: Point = parts.axes.point(along.middle, (item.low + item.high) / 2)
    return Place(center, parts.axes.size(along.end - along.begin, item.high - item.low))
