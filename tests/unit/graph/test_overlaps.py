"""Pictures that can be read: at 3, 30 and 300 nodes no box and no label lies on another."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations

import pytest

from composer.graph.diagram import Graph
from composer.graph.layout import Layout, Point, Rectangle, Size, arrange
from composer.graph.layout.geometry import label_size, measure
from composer.graph.views import View
from tests.unit.support.fleets import fleet_graph


@dataclass(frozen=True)
class Box:
    what: str
    left: float
    top: float
    right: float
    bottom: float

    @classmethod
    def of(cls, what: str, place: Rectangle) -> Box:
        right, bottom = place.left + place.size.width, place.top + place.size.height
        return cls(what, place.left, place.top, right, bottom)

    def overlaps(self, other: Box) -> bool:
        return (
            min(self.right, other.right) - max(self.left, other.left) > 0.01
            and min(self.bottom, other.bottom) - max(self.top, other.top) > 0.01
        )


def solids(graph: Graph, layout: Layout) -> Iterator[Box]:
    """Yield boxes around vertices and blocks."""
    blocks = {cluster.key for cluster in graph.clusters if cluster.block}
    for vertex in graph.vertices:
        if vertex.cluster not in blocks:
            yield Box.of(vertex.key, layout.vertices[vertex.key])
    for frame in layout.frames:
        if frame.cluster.block:
            yield Box.of(frame.cluster.key, frame.place)


def labels(graph: Graph, layout: Layout) -> Iterator[Box]:
    """Yield boxes around what stands at edges and on frames."""
    for path in layout.paths:
        if path.label is not None:
            yield Box.of(f"label {path.edge.key}", Rectangle(path.label, label_size(path.edge)))
    needed = measure(graph).frames
    for frame in layout.frames:
        if not frame.cluster.block:
            size = Size(needed[frame.cluster.key].width, 10.0)
            center = Point(frame.place.left + 12.0 + size.width / 2, frame.place.top + 14.0)
            yield Box.of(f"title {frame.cluster.key}", Rectangle(center, size))


def overlaps(boxes: Sequence[Box]) -> list[tuple[str, str]]:
    """Return the pairs that lie on one another; sorted by their tops, few have to be compared."""
    found = []
    rows: dict[int, list[Box]] = {}
    for box in boxes:
        for row in range(int(box.top // 100), int(box.bottom // 100) + 1):
            rows.setdefault(row, []).append(box)
    for row in rows.values():
        found += [(one.what, two.what) for one, two in combinations(row, 2) if one.overlaps(two)]
    return sorted(set(found))


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
    graph, layout, _ = laid_out(count, view)
    boxes = [*solids(graph, layout), *labels(graph, layout)]
    assert len(boxes) >= min(count, 4)
    assert overlaps(boxes) == []


@pytest.mark.slow  # lays out 300 nodes
@pytest.mark.parametrize("view", list(View))
def test_a_picture_of_300_nodes_is_laid_out_in_seconds(view: View) -> None:
    assert laid_out(300, view)[2] < 20.0


def test_lines_run_under_no_vertex() -> None:
    """A curve lies between its control points: where these keep off a box, the line does."""
    graph, layout, _ = laid_out(30, View.NODES)
    boxes = {box.what: box for box in solids(graph, layout)}
    for path in layout.paths:
        others = [
            box for key, box in boxes.items() if key not in (path.edge.source, path.edge.target)
        ]
        for point in sampled(path.points):
            under = [box.what for box in others if inside(box, point)]
            assert under == [], path.edge.key


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


def inside(box: Box, point: Point) -> bool:
    return box.left < point.x < box.right and box.top < point.y < box.bottom
