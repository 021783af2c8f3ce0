"""Lay out a graph for pages, so that each shows it as large as possible.

A large graph is laid out in parts, one for each outermost frame, in rows. Lines between two parts
are straight and have no label.
"""

from __future__ import annotations

import math
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import accumulate, combinations

from composer.graph.diagram import Cluster, Direction, Edge, Graph
from composer.graph.layout.alike import Alike
from composer.graph.layout.arrange import arrange, layered
from composer.graph.layout.components import outermost
from composer.graph.layout.result import Layout, Path, Point, Rectangle, Size
from composer.graph.layout.units import Sizes

#: A graph with more vertices is laid out in parts, if it has as many frames.
_MANY_VERTICES = 60
_SEVERAL_FRAMES = 4
_CLEARLY = 1.25
#: Pixels of the page around and between parts: names and titles that are enlarged exceed them.
_LEFT_AND_RIGHT = 24.0
_ABOVE = 20.0


class Arrangement(ABC):
    """A graph that is laid out. What a page makes of it takes little time."""

    @abstractmethod
    def on(self, page: Size) -> Layout:
        """Return the layout that is largest on a page of this size in pixels."""


def arrange_for_pages(graph: Graph, sizes: Sizes, directions: Collection[Direction]) -> Arrangement:
    """Lay out a graph for pages of any size, in one of the directions."""
    if _has_parts(graph):
        # From top to bottom, names that are enlarged have room: they are wider than high.
        inside, between = _parts(replace(graph, direction=Direction.DOWN))
        lay_out = Alike(layered)
        return _InParts([arrange(part, sizes, lay_out) for part in inside], between)
    return _Whole({item: arrange(replace(graph, direction=item), sizes) for item in directions})


class _Whole(Arrangement):
    """The layout in each direction."""

    def __init__(self, layouts: Mapping[Direction, Layout]) -> None:
        self._layouts = layouts

    def on(self, page: Size) -> Layout:
        """Return one along the longer side of the page, unless another is clearly larger."""
        longer = Direction.RIGHT if page.width >= page.height else Direction.DOWN
        usual = self._layouts.get(longer) or next(iter(self._layouts.values()))
        best = max(self._layouts.values(), key=lambda layout: _scale(layout.size, page))
        return best if _scale(best.size, page) > _CLEARLY * _scale(usual.size, page) else usual


class _InParts(Arrangement):
    """The layouts of the parts, and the edges between them."""

    def __init__(self, parts: Sequence[Layout], between: Sequence[Edge]) -> None:
        self._parts = parts
        self._between = between

    def on(self, page: Size) -> Layout:
        """Return the parts in rows."""
        parts = self._parts
        rows = _rows([part.size for part in parts], page)
        scale = _scale(
            _size([[part.size for part in parts[row.start : row.stop]] for row in rows]), page
        )
        room = Size(_LEFT_AND_RIGHT / scale, _ABOVE / scale)
        moved = []
        bottom = 0.0
        for row in rows:
            left, top = room.width, bottom + room.height
            for part in parts[row.start : row.stop]:
                moved.append(part.moved(Point(left, top)))
                left += part.size.width
            bottom = max(part.size.height for part in moved[row.start :])
        layout = Layout(
            size=Size(
                max(part.size.width for part in moved) + room.width, bottom + room.height / 2
            ),
            vertices={key: place for part in moved for key, place in part.vertices.items()},
            frames=tuple(frame for part in moved for frame in part.frames),
            paths=tuple(path for part in moved for path in part.paths),
        )
        return replace(layout, paths=(*layout.paths, *_lines(self._between, layout)))


def _scale(size: Size, page: Size) -> float:
    return min(page.width / size.width, page.height / size.height, 1.0)


def _has_parts(graph: Graph) -> bool:
    frames = [item for item in graph.clusters if not (item.parent or item.block)]
    return len(graph.vertices) > _MANY_VERTICES and len(frames) >= _SEVERAL_FRAMES


def _rows(sizes: Sequence[Size], page: Size) -> list[range]:
    """Return which parts are in each row, so that the whole is largest on the page."""
    ends = list(accumulate((size.width for size in sizes), initial=0.0))
    # In hundredths, so that there are few to compare.
    hundredths = {math.ceil((end - begin) / ends[-1] * 100) for begin, end in combinations(ends, 2)}
    found = (_fill(sizes, ends[-1] * limit / 100) for limit in sorted(hundredths, reverse=True))
    return max(
        found, key=lambda rows: _scale(_size([[sizes[part] for part in row] for row in rows]), page)
    )


def _fill(sizes: Sequence[Size], limit: float) -> list[range]:
    """Return rows that are not wider than the limit, unless they have only one part."""
    rows: list[range] = []
    start, width = 0, 0.0
    for index, size in enumerate(sizes):
        if index > start and width + size.width > limit:
            rows.append(range(start, index))
            start, width = index, 0.0
        width += size.width
    return [*rows, range(start, len(sizes))]


def _size(rows: Sequence[Sequence[Size]]) -> Size:
    return Size(
        max(sum(size.width for size in row) for row in rows),
        sum(max(size.height for size in row) for row in rows),
    )


def _parts(graph: Graph) -> tuple[list[Graph], list[Edge]]:
    """Return what is in each outermost frame and in none, and the edges between these parts."""
    around = outermost(graph)
    frames = {cluster.key: cluster for cluster in graph.clusters}

    def part_of(cluster: str) -> str:
        """Blocks without a frame around them stay together."""
        key = around.get(cluster, "")
        return "" if key and frames[key].block else key

    of_vertex = {vertex.key: part_of(vertex.cluster) for vertex in graph.vertices}
    of_edge = {
        edge.key: of_vertex[edge.source]
        for edge in graph.edges
        if of_vertex[edge.source] == of_vertex[edge.target]
    }
    parts = [
        replace(
            graph,
            vertices=tuple(item for item in graph.vertices if of_vertex[item.key] == name),
            edges=tuple(item for item in graph.edges if of_edge.get(item.key) == name),
            clusters=tuple(_clusters(graph, name, part_of)),
        )
        for name in dict.fromkeys(of_vertex.values())
    ]
    # What all use comes first.
    parts.sort(key=lambda part: [_natural(item.label) for item in part.clusters[:1]])
    return parts, [edge for edge in graph.edges if edge.key not in of_edge]


def _natural(name: str) -> list[tuple[int, str]]:
    """Return a key by which area2 comes before area10."""
    return [
        (int(item), "") if item.isdigit() else (-1, item) for item in re.split(r"([0-9]+)", name)
    ]


def _clusters(graph: Graph, part: str, part_of: Callable[[str], str]) -> Iterator[Cluster]:
    return (cluster for cluster in graph.clusters if part_of(cluster.key) == part)


def _lines(edges: Sequence[Edge], layout: Layout) -> Iterator[Path]:
    for edge in edges:
        source, target = layout.vertices[edge.source], layout.vertices[edge.target]
        ends = (_border(source, target.center), _border(target, source.center))
        yield Path(edge, tuple(_straight(*ends)), label=None, is_between_parts=True)


def _border(place: Rectangle, toward: Point) -> Point:
    """Return where the line from the center of the rectangle to a point outside leaves it."""
    x, y = toward.x - place.center.x, toward.y - place.center.y
    share = min(
        place.size.width / 2 / abs(x) if x else math.inf,
        place.size.height / 2 / abs(y) if y else math.inf,
    )
    return place.center.moved(Point(x * share, y * share))


def _straight(begin: Point, end: Point) -> Iterator[Point]:
    """Yield the points of a straight curve."""
    for share in (0.0, 1 / 3, 2 / 3, 1.0):
        yield Point(begin.x + (end.x - begin.x) * share, begin.y + (end.y - begin.y) * share)
