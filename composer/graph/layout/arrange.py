"""The layout from graph to places: the steps in their order, and the way back to x and y."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeAlias

from composer.graph.layout.boxes import Item
from composer.graph.layout.build import Parts, build
from composer.graph.layout.columns import Extent, columns, reach
from composer.graph.layout.components import components
from composer.graph.layout.loops import loop_path
from composer.graph.layout.order import put_in_order
from composer.graph.layout.result import Frame, Layout, Place
from composer.graph.layout.routes import Router
from composer.graph.layout.shelves import MARGIN, side_by_side
from composer.graph.layout.shortcuts import Obstacles
from composer.graph.layout.solids import Sizes
from composer.graph.layout.straighten import straighten
from composer.graph.picture import Graph

#: Lays out a graph in one piece, with a margin around.
LayOut: TypeAlias = Callable[[Graph, Sizes], Layout]


def arrange(graph: Graph, sizes: Sizes, lay_out: LayOut | None = None) -> Layout:
    """Return the layout of ``graph``; everything in it is as big as ``sizes`` says.

    What no arrow and no frame joins is laid out apart, and set side by side. ``lay_out`` lays out
    what arrows join; by itself this module does.
    """
    joined = _layered if lay_out is None else lay_out
    return side_by_side(
        [joined(part, sizes) if part.edges else _layered(part, sizes) for part in components(graph)]
    )


def _layered(graph: Graph, sizes: Sizes) -> Layout:
    parts = build(graph, sizes)
    put_in_order(parts.root)
    straighten(parts.root)
    parts.root.shift(MARGIN - parts.root.low)
    ranks = columns(parts.root, MARGIN)
    obstacles = Obstacles(parts.root.boxes(), ranks)
    loops = [loop_path(loop, reach(loop.box, ranks).end, parts.axes) for loop in parts.loops]
    end = _end(parts, ranks)
    return Layout(
        size=parts.axes.size(end + MARGIN, parts.root.high + MARGIN),
        vertices=dict(_vertices(parts, sizes, ranks)),
        frames=tuple(_frames(parts, ranks)),
        paths=(*Router(parts.axes, ranks, obstacles).paths(parts.chains), *loops),
    )


def _end(parts: Parts, ranks: list[Extent]) -> float:
    tails = [reach(box, ranks).end + box.tail for box in parts.boxes.values()]
    return max(reach(parts.root, ranks).end, *tails)


def _vertices(parts: Parts, sizes: Sizes, ranks: list[Extent]) -> Iterator[tuple[str, Place]]:
    blocks = {cluster.key for cluster in parts.graph.clusters if cluster.block}
    for vertex in parts.graph.vertices:
        if vertex.cluster not in blocks:
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


def _place(parts: Parts, item: Item, ranks: list[Extent]) -> Place:
    along = reach(item, ranks)
    across = (item.low + item.high) / 2
    center = parts.axes.point(along.middle, across)
    return Place(center, parts.axes.size(along.end - along.begin, item.high - item.low))
