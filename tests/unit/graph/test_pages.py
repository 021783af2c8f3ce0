"""Layouts for a page: all of it is used, in the order of names, and nothing overlaps."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, pairwise

import pytest

from composer.graph.diagram import Direction
from composer.graph.layout import Layout, Size, arrange, arrange_for_pages
from composer.graph.views import View
from tests.unit.graph.test_layout import graph_of, holds, overlap
from tests.unit.support.fleets import fleet_graph

BOTH = (Direction.RIGHT, Direction.DOWN)
PAGES = (Size(1280, 720), Size(1024, 1024), Size(390, 600))


def scale(layout: Layout, page: Size) -> float:
    return min(page.width / layout.size.width, page.height / layout.size.height)


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
@pytest.mark.parametrize("view", [View.NODES, View.CONNECTIONS])
def test_a_large_graph_fills_the_page(view: View, page: Size) -> None:
    graph = fleet_graph(100, view)
    layout = arrange_for_pages(graph, BOTH)(page)
    filled = layout.size.width * layout.size.height * scale(layout, page) ** 2
    assert filled > 0.7 * page.width * page.height
    others = [arrange(replace(graph, direction=item)) for item in BOTH]
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
