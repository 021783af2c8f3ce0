"""Lay out a graph: run the steps in order and convert the result to x and y."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeAlias

from composer.graph.diagram import Graph
from composer.graph.layout.alike import Alike
from composer.graph.layout.build import Parts, build
from composer.graph.layout.components import MARGIN, components, pack_components
from composer.graph.layout.result import Frame, Layout, Rectangle
from composer.graph.layout.self_loops import loop_path
from composer.graph.layout.steps.bend_removal import Obstacles
from composer.graph.layout.steps.boxes import Item
from composer.graph.layout.steps.coordinates import assign_coordinates
from composer.graph.layout.steps.ordering import order_boxes
from composer.graph.layout.steps.rank_extents import Extent, extent_of, rank_extents
from composer.graph.layout.steps.routing import Router
from composer.graph.layout.units import Sizes

#: Lays out a connected graph with a margin.
LayOut: TypeAlias = Callable[[Graph, Sizes], Layout]


def arrange(graph: Graph, sizes: Sizes, lay_out: LayOut | None = None) -> Layout:
    """Return the layout of ``graph`` with the given ``sizes``.

    Connected components are laid out separately and packed side by side. ``lay_out`` replaces the
    layered layout of components with edges.
    """
    lay_out_component = Alike(layered) if lay_out is None else lay_out
    return pack_components(
        [
            lay_out_component(part, sizes) if part.edges else layered(part, sizes)
            for part in components(graph)
        ]
    )


def layered(graph: Graph, sizes: Sizes) -> Layout:
    """Return the layered layout of a connected graph."""
    parts = build(graph, sizes)
    order_boxes(parts.root)
    assign_coordinates(parts.root)
    parts.root.shift(MARGIN - parts.root.low)
    ranks = rank_extents(parts.root, MARGIN)
    obstacles = Obstacles(parts.root.boxes(), ranks)
    loops = [loop_path(loop, extent_of(loop.box, ranks).end, parts.axes) for loop in parts.loops]
    end = _end(parts, ranks)
    return Layout(
        size=parts.axes.size(end + MARGIN, parts.root.high + MARGIN),
        vertices=dict(_vertices(parts, sizes, ranks)),
        frames=tuple(_frames(parts, ranks)),
        paths=(*Router(parts.axes, ranks, obstacles).paths(parts.chains), *loops),
    )


def _end(parts: Parts, ranks: list[Extent]) -> float:
    tails = [extent_of(box, ranks).end + box.tail for box in parts.boxes.values()]
    return max(extent_of(parts.root, ranks).end, *tails)


def _vertices(parts: Parts, sizes: Sizes, ranks: list[Extent]) -> Iterator[tuple[str, Rectangle]]:
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


def _place(parts: Parts, item: Item, ranks: list[Extent]) -> Rectangle:
    along = extent_of(item, ranks)
    across = (item.low + item.high) / 2
    center = parts.axes.point(along.middle, across)
    return Rectangle(center, parts.axes.size(along.end - along.begin, item.high - item.low))
