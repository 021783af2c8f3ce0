"""Pictures that can be read: no box and no label lies on another, and a page is filled."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from itertools import combinations, pairwise

import pytest

from composer.graph.diagram import Direction, Graph
from composer.graph.layout import Layout, Point, Rectangle, Size, arrange, arrange_for_pages
from composer.graph.layout.geometry import label_size, measure
from composer.graph.views import View
from tests.unit.graph.test_layout import graph_of, holds, overlap
from tests.unit.support.fleets import fleet_graph


def solids(graph: Graph, layout: Layout) -> dict[str, Rectangle]:
    """Return the places of vertices and blocks."""
    blocks = {cluster.key for cluster in graph.clusters if cluster.block}
    return {
        vertex.key: layout.vertices[vertex.key]
        for vertex in graph.vertices
        if vertex.cluster not in blocks
    } | {item.cluster.key: item.place for item in layout.frames if item.cluster.block}


def labels(graph: Graph, layout: Layout) -> Iterator[tuple[str, Rectangle]]:
    """Yield what stands at edges and on frames."""
    for path in layout.paths:
        if path.label is not None:
            yield f"label {path.edge.key}", Rectangle(path.label, label_size(path.edge))
    needed = measure(graph).frames
    for frame in layout.frames:
        if not frame.cluster.block:
            size = Size(needed[frame.cluster.key].width, 10.0)
            center = Point(frame.place.left + 12.0 + size.width / 2, frame.place.top + 14.0)
            yield f"title {frame.cluster.key}", Rectangle(center, size)


def overlaps(places: Sequence[tuple[str, Rectangle]]) -> set[tuple[str, str]]:
    """Return the pairs that lie on one another; in rows, few have to be compared."""
    rows: dict[int, list[tuple[str, Rectangle]]] = {}
    for name, place in places:
        for row in range(int(place.top // 100), int((place.top + place.size.height) // 100) + 1):
            rows.setdefault(row, []).append((name, place))
    return {
        (one, two)
        for row in rows.values()
        for (one, first), (two, second) in combinations(row, 2)
        if overlap(first, second)
    }


@cache
def laid_out(count: int, view: View) -> tuple[Graph, Layout, float]:
    """Return a diagram, its layout, and how long the processor worked on that, in seconds."""
    graph = fleet_graph(count, view)
    started_s = time.process_time()
    layout = arrange(graph)
    return graph, layout, time.process_time() - started_s


@pytest.mark.parametrize("view", list(View))
@pytest.mark.parametrize("count", [3, 30, pytest.param(300, marks=pytest.mark.slow)])
def test_no_box_and_no_label_lies_on_another(count: int, view: View) -> None:
    graph, layout, took_s = laid_out(count, view)
    places = [*solids(graph, layout).items(), *labels(graph, layout)]
    assert len(places) >= min(count, 4)
    assert overlaps(places) == set()
    assert took_s < 20.0


def test_lines_run_under_no_vertex() -> None:
    """A curve lies between its control points: where these keep off a box, the line does."""
    graph, layout, _ = laid_out(30, View.NODES)
    places = solids(graph, layout)
    for path in layout.paths:
        ends = (path.edge.source, path.edge.target)
        others = [place for key, place in places.items() if key not in ends]
        for point in sampled(path.points):
            at_point = Rectangle(point, Size(0.0, 0.0))
            assert not any(overlap(at_point, place) for place in others), path.edge.key


def sampled(points: Sequence[Point]) -> Iterator[Point]:
    """Yield points on cubic curves, close together."""
    for index in range(0, len(points) - 1, 3):
        start, first, second, end = points[index : index + 4]
        for step in range(21):
            t = step / 20
            a, b, c, d = (1 - t) ** 3, 3 * (1 - t) ** 2 * t, 3 * (1 - t) * t**2, t**3
            yield Point(
                a * start.x + b * first.x + c * second.x + d * end.x,
                a * start.y + b * first.y + c * second.y + d * end.y,
            )


BOTH = (Direction.RIGHT, Direction.DOWN)
PAGES = (Size(1280, 720), Size(1024, 1024), Size(390, 600))


def scale(layout: Layout, page: Size) -> float:
    return min(page.width / layout.size.width, page.height / layout.size.height)


@pytest.mark.slow
@pytest.mark.parametrize("view", [View.NODES, View.CONNECTIONS])
def test_a_large_graph_fills_the_page(view: View) -> None:
    graph = fleet_graph(100, view)
    others = [arrange(replace(graph, direction=item)) for item in BOTH]
    layout_on = arrange_for_pages(graph, BOTH)
    for page in PAGES:
        layout = layout_on(page)
        filled = layout.size.width * layout.size.height * scale(layout, page) ** 2
        assert filled > 0.7 * page.width * page.height
        assert scale(layout, page) > max(scale(other, page) for other in others)
        assert {path.edge.key for path in layout.paths} == {edge.key for edge in graph.edges}
        assert layout.vertices.keys() == {vertex.key for vertex in graph.vertices}


def test_the_parts_of_a_large_graph_are_in_rows_in_their_natural_order() -> None:
    graph = fleet_graph(100, View.NODES)
    layout = arrange_for_pages(graph, BOTH)(PAGES[0])
    outer = [frame for frame in layout.frames if not frame.cluster.parent]
    reading = sorted(outer, key=lambda frame: (round(frame.place.top), frame.place.left))
    assert [frame.cluster.label for frame in reading][8:11] == ["/area9", "/area10", "/area11"]
    assert not any(overlap(one.place, other.place) for one, other in combinations(outer, 2))
    places = layout.vertices.values()
    assert not any(overlap(one, other) for one, other in combinations(places, 2))
    for path in layout.paths:
        if path.is_between_parts:
            begin = layout.vertices[path.edge.source]
            assert holds(
                replace(begin, size=Size(begin.size.width + 1, begin.size.height + 1)),
                replace(begin, center=path.points[0], size=Size(0, 0)),
            )


def test_a_small_graph_has_the_direction_in_which_it_is_larger() -> None:
    names = "abcdefgh"
    graph = graph_of(dict.fromkeys(names, ""), list(pairwise(names)))
    layout_on = arrange_for_pages(graph, BOTH)
    wide, narrow = (layout_on(page).size for page in (PAGES[0], PAGES[2]))
    assert wide.width > wide.height
    assert narrow.width < narrow.height
