"""Lay out whole graphs: connected components, and parts of large graphs, in rows on a page.

A connected graph is laid out in layers; the steps are listed in the package.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

from composer.graph.diagram import Cluster, Direction, Edge, Graph, Vertex, natural_order
from composer.graph.layout.boxes import Item
from composer.graph.layout.build import Parts, build
from composer.graph.layout.coordinates import Extent, assign_coordinates, extent_of, rank_extents
from composer.graph.layout.geometry import (
    Frame,
    Layout,
    Path,
    Point,
    Rectangle,
    Size,
    Sizes,
    measure,
)
from composer.graph.layout.ordering import order_boxes
from composer.graph.layout.routing import Router

#: The proportions of a screen.
_SCREEN = Size(1.6, 1.0)
_MARGIN = Size(16.0, 16.0)
#: A graph with more vertices is laid out in parts, if it has as many frames.
_MANY_VERTICES = 60
_SEVERAL_FRAMES = 4
#: A layout in the other direction is taken if it is larger on the page by this factor.
_CLEARLY = 1.25
#: Pixels of the page around and between parts: names and titles that are enlarged exceed them.
_LEFT_AND_RIGHT = 24.0
_ABOVE = 20.0


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


def arrange(graph: Graph) -> Layout:
    """Return the layout of a graph, in rows of its connected components, with a margin."""
    sizes = measure(graph)
    layouts = [lay_out(part, sizes) for part in _components(graph)]
    rows = _rows([layout.size for layout in layouts], _SCREEN)
    return _in_rows(layouts, rows, border=_MARGIN, gap=_MARGIN)


def arrange_for_pages(graph: Graph, directions: Collection[Direction]) -> Callable[[Size], Layout]:
    """Lay out a graph for pages of any size, in one of the directions.

    The result returns, in little time, the layout that is largest on a page of a size in pixels. A
    large graph is laid out in parts, one for each outermost frame. Lines between two parts are
    straight and have no label.
    """
    if _has_parts(graph):
        # From top to bottom, names that are enlarged have room: they are wider than high.
        parts, between = _parts(replace(graph, direction=Direction.DOWN))
        return partial(_parts_on_page, [arrange(part) for part in parts], between)
    layouts = {direction: arrange(replace(graph, direction=direction)) for direction in directions}
    return partial(_whole_on_page, layouts)


def _whole_on_page(layouts: Mapping[Direction, Layout], page: Size) -> Layout:
    """Return the layout along the longer side of the page, unless another is clearly larger."""
    longer = Direction.RIGHT if page.width >= page.height else Direction.DOWN
    usual = layouts.get(longer) or next(iter(layouts.values()))
    best = max(layouts.values(), key=lambda layout: _scale(layout.size, page))
    return best if _scale(best.size, page) > _CLEARLY * _scale(usual.size, page) else usual


def _parts_on_page(parts: Sequence[Layout], between: Sequence[Edge], page: Size) -> Layout:
    sizes = [part.size for part in parts]
    rows = _rows(sizes, page)
    scale = _scale(_size(sizes, rows), page)
    border = Size(_LEFT_AND_RIGHT / scale, _ABOVE / scale)
    layout = _in_rows(parts, rows, border=border, gap=Size(0.0, border.height))
    return replace(layout, paths=(*layout.paths, *_straight_paths(between, layout)))


def _scale(size: Size, page: Size) -> float:
    return min(page.width / size.width, page.height / size.height, 1.0)


def _rows(sizes: Sequence[Size], page: Size) -> list[range]:
    """Return which rectangles are in each row, so that the whole is largest on the page."""
    width = sum(size.width for size in sizes)
    # In hundredths, so that there are few to compare.
    shares = range(100, 0, -1) if sizes else ()
    candidates = (_fill(sizes, width * share / 100) for share in shares)
    return max(candidates, key=lambda rows: _scale(_size(sizes, rows), page), default=[])


def _fill(sizes: Sequence[Size], limit: float) -> list[range]:
    """Return rows that are not wider than the limit, unless they have only one rectangle."""
    rows: list[range] = []
    start, width = 0, 0.0
    for index, size in enumerate(sizes):
        if index > start and width + size.width > limit:
            rows.append(range(start, index))
            start, width = index, 0.0
        width += size.width
    return [*rows, range(start, len(sizes))]


def _size(sizes: Sequence[Size], rows: Sequence[range]) -> Size:
    """Return the size of rectangles in rows."""
    return Size(
        max(sum(sizes[index].width for index in row) for row in rows),
        sum(max(sizes[index].height for index in row) for row in rows),
    )


def _in_rows(
    layouts: Sequence[Layout], rows: Sequence[range], *, border: Size, gap: Size
) -> Layout:
    """Return the layouts as one, in rows."""
    moved: list[Layout] = []
    top = border.height
    for row in rows:
        left = border.width
        for index in row:
            moved.append(layouts[index].moved(Point(left, top)))
            left = moved[-1].size.width + gap.width
        top = max(part.size.height for part in moved[row.start :]) + gap.height
    return Layout(
        size=Size(
            max((part.size.width for part in moved), default=border.width) + border.width,
            max((part.size.height for part in moved), default=border.height) + border.height,
        ),
        vertices={key: place for part in moved for key, place in part.vertices.items()},
        frames=tuple(frame for part in moved for frame in part.frames),
        paths=tuple(path for part in moved for path in part.paths),
    )


def _components(graph: Graph) -> list[Graph]:
    """Return the parts joined by edges or frames, in the order of their first vertices."""
    around = _outermost(graph)
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
    return _split(graph, {vertex.key: root(vertex.key) for vertex in graph.vertices})


def _has_parts(graph: Graph) -> bool:
    frames = [item for item in graph.clusters if not (item.parent or item.block)]
    return len(graph.vertices) > _MANY_VERTICES and len(frames) >= _SEVERAL_FRAMES


def _parts(graph: Graph) -> tuple[list[Graph], list[Edge]]:
    """Return what is in each outermost frame and in none, and the edges between these parts."""
    blocks = {block.key for block in graph.blocks}
    # Blocks without a frame around them stay together.
    around = {key: "" if frame in blocks else frame for key, frame in _outermost(graph).items()}
    part_of = {vertex.key: around.get(vertex.cluster, "") for vertex in graph.vertices}
    parts = _split(graph, part_of)
    # What all use comes first.
    parts.sort(key=lambda part: [natural_order(item.label) for item in part.clusters[:1]])
    return parts, [edge for edge in graph.edges if part_of[edge.source] != part_of[edge.target]]


def _split(graph: Graph, part_of: Mapping[str, str]) -> list[Graph]:
    """Return the parts of a graph, each with its edges and frames; ``part_of`` is by vertex."""
    around = _outermost(graph)
    vertices: dict[str, list[Vertex]] = {}
    for vertex in graph.vertices:
        vertices.setdefault(part_of[vertex.key], []).append(vertex)
    edges: dict[str, list[Edge]] = {}
    for edge in graph.edges:
        if part_of[edge.source] == part_of[edge.target]:
            edges.setdefault(part_of[edge.source], []).append(edge)
    part_of_frame = {
        around[vertex.cluster]: part_of[vertex.key] for vertex in graph.vertices if vertex.cluster
    }
    clusters: dict[str | None, list[Cluster]] = {}
    for cluster in graph.clusters:
        clusters.setdefault(part_of_frame.get(around[cluster.key]), []).append(cluster)
    return [
        replace(
            graph,
            vertices=tuple(inside),
            edges=tuple(edges.get(part, ())),
            clusters=tuple(clusters.get(part, ())),
        )
        for part, inside in vertices.items()
    ]


def _outermost(graph: Graph) -> dict[str, str]:
    """Return the outermost cluster around each cluster; parents come before children."""
    outermost: dict[str, str] = {}
    for cluster in graph.clusters:
        outermost[cluster.key] = outermost[cluster.parent] if cluster.parent else cluster.key
    return outermost


def _straight_paths(edges: Sequence[Edge], layout: Layout) -> Iterator[Path]:
    for edge in edges:
        source, target = layout.vertices[edge.source], layout.vertices[edge.target]
        begin, end = _border(source, target.center), _border(target, source.center)
        points = tuple(
            Point(begin.x + (end.x - begin.x) * share, begin.y + (end.y - begin.y) * share)
            for share in (0.0, 1 / 3, 2 / 3, 1.0)
        )
        yield Path(edge, points, label=None, is_between_parts=True)


def _border(place: Rectangle, toward: Point) -> Point:
    """Return where the line from the center of the rectangle to a point outside leaves it."""
    x, y = toward.x - place.center.x, toward.y - place.center.y
    share = min(
        place.size.width / 2 / abs(x) if x else math.inf,
        place.size.height / 2 / abs(y) if y else math.inf,
    )
    return place.center.moved(Point(x * share, y * share))
