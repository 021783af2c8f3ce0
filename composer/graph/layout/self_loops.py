"""Self-loops: edges drawn as a curve on the side where arrows leave."""

from __future__ import annotations

from composer.graph.diagram import Edge, Graph
from composer.graph.layout.result import Path, Point, Size
from composer.graph.layout.steps.boxes import Axes, Box, SelfLoop
from composer.graph.layout.units import LayoutUnits, Sizes

_BOW = 30.0
_LABEL_GAP = 4.0


def loops_of(graph: Graph, units: LayoutUnits) -> dict[str, list[Edge]]:
    """Return the self-loops by the key of the unit."""
    found: dict[str, list[Edge]] = {}
    for edge in graph.edges:
        key = units.key(edge.source)
        if key == units.key(edge.target):
            found.setdefault(key, []).append(edge)
    return found


def make_room(box: Box, edges: list[Edge], sizes: Sizes, axes: Axes) -> list[SelfLoop]:
    """Return the loops of a box, and extend the box by a tail for them and their labels."""
    labels = [_size(sizes.labels.get(edge.key), axes) for edge in edges]
    label_sizes = [label for label in labels if label is not None]
    box.tail = _BOW + max((along + _LABEL_GAP for along, _ in label_sizes), default=0.0)
    box.along += box.tail
    box.across = max(box.across, sum(across + _LABEL_GAP for _, across in label_sizes))
    step = box.across / len(edges)
    found = []
    for index, (edge, label) in enumerate(zip(edges, labels, strict=True)):
        middle = (index + 0.5) * step - box.across / 2
        source = sizes.rows.get(edge.source, middle - step / 4)
        target = sizes.rows.get(edge.target, middle + step / 4)
        found.append(SelfLoop(edge, box, source, target, middle, label))
    return found


def _size(label: Size | None, axes: Axes) -> tuple[float, float] | None:
    return None if label is None else axes.of_size(label)


def loop_path(loop: SelfLoop, side: float, axes: Axes) -> Path:
    """Return the path of a loop; ``side`` is the end of the box along the arrows."""
    begin = loop.box.position + loop.source_offset
    end = loop.box.position + loop.target_offset
    out = side + _BOW
    points = [(side, begin), (out, begin), (out, end), (side, end)]
    label: Point | None = None
    if loop.label is not None:
        along = out + _LABEL_GAP + loop.label[0] / 2
        label = axes.point(along, loop.box.position + loop.label_offset)
    return Path(loop.edge, tuple(axes.point(*point) for point in points), label)
