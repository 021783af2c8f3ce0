"""Lay out a connected graph: run the steps in order and convert the result to x and y."""

from __future__ import annotations

from collections.abc import Iterator

from composer.graph.diagram import Graph
from composer.graph.layout.boxes import Item
from composer.graph.layout.build import Parts, build
from composer.graph.layout.coordinates import (
    Extent,
    assign_coordinates,
    extent_of,
    rank_extents,
)
from composer.graph.layout.measure import Sizes
from composer.graph.layout.ordering import order_boxes
from composer.graph.layout.result import Frame, Layout, Rectangle
from composer.graph.layout.routing import Router


def lay_out(graph: Graph, sizes: Sizes) -> Layout:
    """Return the layered layout of a connected graph, without a margin."""
    parts = build(graph, sizes)
    order_boxes(parts.root)
    assign_coordinates(parts.root)
    parts.root.shift(-parts.root.low)
    ranks = rank_extents(parts.root)
    router = Router(parts.axes, ranks, parts.root.boxes())
    tails = [extent_of(box, ranks).end + box.tail for box in parts.boxes.values()]
    end = max(extent_of(parts.root, ranks).end, *tails)
    return Layout(
        size=parts.axes.size(end, parts.root.high),
        vertices=dict(_vertices(parts, sizes, ranks)),
        frames=tuple(_frames(parts, ranks)),
        paths=(*router.paths(parts.chains), *map(router.loop, parts.loops)),
    )


def _vertices(parts: Parts, sizes: Sizes, ranks: list[Extent]) -> Iterator[tuple[str, Rectangle]]:
    for vertex in parts.graph.vertices:
        if vertex.cluster not in sizes.blocks:
            yield vertex.key, _place(parts, parts.boxes[vertex.key], ranks)
            continue
        block = _place(parts, parts.boxes[vertex.cluster], ranks)
        yield vertex.key, block.row(sizes.rows[vertex.key], sizes.vertices[vertex.key].height)


def _frames(parts: Parts, ranks: list[Extent]) -> Iterator[Frame]:
    for cluster in parts.graph.clusters:
        if cluster.block:
            if cluster.key in parts.boxes:
                yield Frame(cluster, _place(parts, parts.boxes[cluster.key], ranks))
        elif parts.groups[cluster.key].children:
            yield Frame(cluster, _place(parts, parts.groups[cluster.key], ranks))


def _place(parts: Parts, item: Item, ranks: list[Extent]) -> Rectangle:
    along = extent_of(item, ranks)
    across = (item.low + item.high) / 2
    center = parts.axes.point(along.middle, across)
    return Rectangle(center, parts.axes.size(along.end - along.begin, item.high - item.low))
