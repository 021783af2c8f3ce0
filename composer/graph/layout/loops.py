"""Edges from something to itself: a bow on the side where arrows leave."""

from __future__ import annotations

from composer.graph.layout.axes import Axes
from composer.graph.layout.boxes import Box, Loop
from composer.graph.layout.result import Path, Point, Size
from composer.graph.layout.solids import Sizes, Solids
from composer.graph.picture import Edge, Graph

_BOW = 30.0
_LABEL_GAP = 4.0


def loops_of(graph: Graph, solids: Solids) -> dict[str, list[Edge]]:
    """Return the edges that end where they begin, by the key of the solid."""
    found: dict[str, list[Edge]] = {}
    for edge in graph.edges:
        key = solids.key(edge.source)
        if key == solids.key(edge.target):
            found.setdefault(key, []).append(edge)
    return found


def make_room(box: Box, edges: list[Edge], sizes: Sizes, axes: Axes) -> list[Loop]:
    """Return the loops of a box; it grows a tail that holds them and their labels."""
    labels = [_size(sizes.labels.get(edge.key), axes) for edge in edges]
    said = [label for label in labels if label is not None]
    box.tail = _BOW + max((along + _LABEL_GAP for along, _ in said), default=0.0)
    box.along += box.tail
    box.across = max(box.across, sum(across + _LABEL_GAP for _, across in said))
    step = box.across / len(edges)
    found = []
    for index, (edge, label) in enumerate(zip(edges, labels, strict=True)):
        middle = (index + 0.5) * step - box.across / 2
        source = sizes.rows.get(edge.source, middle - step / 4)
        target = sizes.rows.get(edge.target, middle + step / 4)
        found.append(Loop(edge, box, source, target, middle, label))
    return found


def _size(label: Size | None, axes: Axes) -> tuple[float, float] | None:
    return None if label is None else axes.of_size(label)


def loop_path(loop: Loop, side: float, axes: Axes) -> Path:
    """Return the bow; ``side`` is where the box ends, along."""
    begin = loop.box.position + loop.source_offset
    end = loop.box.position + loop.target_offset
    out = side + _BOW
    points = [(side, begin), (out, begin), (out, end), (side, end)]
    label: Point | None = None
    if loop.label is not None:
        along = out + _LABEL_GAP + loop.label[0] / 2
        label = axes.point(along, loop.box.position + loop.label_offset)
    return Path(loop.edge, tuple(axes.point(*point) for point in points), label)
