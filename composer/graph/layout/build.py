"""From a graph to boxes in groups: vertices on even ranks, bends and labels between them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise

from composer.graph.layout.axes import Axes
from composer.graph.layout.boxes import BEND_GAP, FRAME_LABEL, FRAME_PADDING, Box, Chain, Group
from composer.graph.layout.ranks import forward, ranks
from composer.graph.layout.result import Size
from composer.graph.picture import Cluster, Direction, Edge, Graph


@dataclass(frozen=True, slots=True)
class Sizes:
    """How big things are: vertices and the labels of clusters by key, of edges by number."""

    vertices: Mapping[str, Size]
    labels: Mapping[int, Size]
    frames: Mapping[str, Size]


@dataclass(slots=True)
class Parts:
    """Everything of a graph on its way to a place."""

    graph: Graph
    axes: Axes
    root: Group
    groups: dict[str, Group]  # by cluster key; "" is the root
    boxes: dict[str, Box] = field(default_factory=dict)  # by vertex key
    chains: list[Chain] = field(default_factory=list)


def build(graph: Graph, sizes: Sizes) -> Parts:
    """Return the boxes and groups of a graph, not placed yet. It has at least one vertex."""
    keys = [vertex.key for vertex in graph.vertices]
    pairs = forward(keys, [(edge.source, edge.target) for edge in graph.edges])
    rank = ranks(keys, pairs)
    axes = Axes(graph.direction is Direction.DOWN)
    root = Group(padding=0.0)
    parts = Parts(graph, axes, root, _groups(graph, root, axes, sizes))
    for vertex in graph.vertices:
        along, across = axes.of_size(sizes.vertices[vertex.key])
        box = Box(2 * rank[vertex.key], along, across)
        parts.boxes[vertex.key] = box
        parts.groups[vertex.cluster].children.append(box)
    frames = _Frames(graph)
    for number, (edge, pair) in enumerate(zip(graph.edges, pairs, strict=True)):
        if edge.source != edge.target:
            inside = parts.groups[frames.around_both(*pair)]
            parts.chains.append(_chain(parts, inside, edge, pair, sizes.labels.get(number)))
    _drop_empty(root)
    root.span_ranks()
    return parts


def _groups(graph: Graph, root: Group, axes: Axes, sizes: Sizes) -> dict[str, Group]:
    groups = {"": root}
    for cluster in graph.clusters:
        needed = sizes.frames[cluster.key].width + 2 * FRAME_PADDING
        group = (
            Group(label_along=FRAME_LABEL, least=needed)
            if axes.down
            else Group(label=FRAME_LABEL, least_along=needed)
        )
        groups[cluster.key] = group
        groups[cluster.parent].children.append(group)
    return groups


def _chain(
    parts: Parts, inside: Group, edge: Edge, pair: tuple[str, str], label: Size | None
) -> Chain:
    """Join two boxes by bends on the ranks between them; the label stands on one of these."""
    begin, end = parts.boxes[pair[0]], parts.boxes[pair[1]]
    backward = pair[0] != edge.source
    bends = [Box(rank, 0.0, 0.0, gap=BEND_GAP) for rank in range(begin.rank + 1, end.rank)]
    labelled = None
    if label is not None:
        labelled = bends[-1 if backward else 0]
        labelled.along, labelled.across = parts.axes.of_size(label)
    inside.children += bends
    chain = (begin, *bends, end)
    for first, second in pairwise(chain):
        first.after.append(second)
        second.before.append(first)
    return Chain(edge, chain, labelled, backward)


def _drop_empty(group: Group) -> None:
    for child in group.inner():
        _drop_empty(child)
    group.children = [child for child in group.children if isinstance(child, Box) or child.children]


class _Frames:
    """Which frames are around which vertex."""

    def __init__(self, graph: Graph) -> None:
        self._clusters: dict[str, Cluster] = {cluster.key: cluster for cluster in graph.clusters}
        self._around = {vertex.key: vertex.cluster for vertex in graph.vertices}

    def around_both(self, first: str, second: str) -> str:
        """Return the innermost cluster that holds both vertices; empty for none."""
        outer = set(self._outwards(first))
        return next((key for key in self._outwards(second) if key in outer), "")

    def _outwards(self, vertex: str) -> list[str]:
        found = []
        key = self._around[vertex]
        while key:
            found.append(key)
            key = self._clusters[key].parent
        return found
