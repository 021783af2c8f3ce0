"""Convert a graph to boxes in groups: vertices on even ranks, bends and labels between them.

A block is one box, with its ports as rows.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import field

from composer.base.fast_dataclass import dataclass
from composer.graph.diagram import Direction, Edge, Graph
from composer.graph.layout.boxes import (
    BEND_GAP,
    FRAME_LABEL,
    FRAME_PADDING,
    LOOP_BOW,
    LOOP_LABEL_GAP,
    Axes,
    Box,
    EdgeChain,
    Group,
    SelfLoop,
    link,
)
from composer.graph.layout.geometry import Size, Sizes
from composer.graph.layout.ordering import assign_ranks, break_cycles


@dataclass(slots=True)
class Parts:
    """The parts of a graph during layout."""

    graph: Graph
    axes: Axes
    root: Group
    groups: dict[str, Group]  # by cluster key; "" is the root
    boxes: dict[str, Box] = field(default_factory=dict)  # by the key of a vertex or block
    chains: list[EdgeChain] = field(default_factory=list)
    loops: list[SelfLoop] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class _DirectedEdge:
    """An edge in the direction of the ranks: from ``low`` to ``high``, which are vertex keys."""

    edge: Edge
    low: str
    high: str

    @property
    def backward(self) -> bool:
        return self.low != self.edge.source

    @property
    def style(self) -> tuple[object, ...]:
        """The style that edges must have in common to share segments."""
        mark = self.edge.problem.mark if self.edge.problem else None
        return (self.edge.kind, mark, self.backward)


def build(graph: Graph, sizes: Sizes) -> Parts:
    """Return the boxes and groups of a graph, without positions. It has at least one vertex."""
    nesting = _Nesting(graph, sizes)
    between = [edge for edge in graph.edges if nesting.box[edge.source] != nesting.box[edge.target]]
    pairs = [(nesting.box[edge.source], nesting.box[edge.target]) for edge in between]
    turned = break_cycles(list(nesting.around), pairs)
    rank = assign_ranks(nesting.around, turned)
    axes = Axes(graph.direction is Direction.DOWN)
    root = Group(padding=0.0)
    parts = Parts(graph, axes, root, _groups(graph, root, axes, sizes))
    for key, cluster in nesting.around.items():
        along, across = axes.of_size(sizes.of_box(key))
        parts.boxes[key] = Box(2 * rank[key], along, across)
        parts.groups[cluster].children.append(parts.boxes[key])
    loops: dict[str, list[Edge]] = {}
    for edge in graph.edges:
        if nesting.box[edge.source] == nesting.box[edge.target]:
            loops.setdefault(nesting.box[edge.source], []).append(edge)
    for key, edges in loops.items():
        parts.loops += _self_loops(parts.boxes[key], edges, sizes, axes)
    directed = [
        _DirectedEdge(edge, edge.source, edge.target)
        if pair == straight
        else _DirectedEdge(edge, edge.target, edge.source)
        for edge, pair, straight in zip(between, turned, pairs, strict=True)
    ]
    parts.chains += _Chains(parts, nesting, sizes, directed).all()
    _drop_empty(root)
    root.span_ranks()
    return parts


class _Nesting:
    """The box of each vertex, and the frames around each box."""

    def __init__(self, graph: Graph, sizes: Sizes) -> None:
        self._parents: Mapping[str, str] = {item.key: item.parent for item in graph.clusters}
        self.box: dict[str, str] = {}  # of each vertex: its own key, or that of its block
        self.around: dict[str, str] = {}  # the innermost cluster of each box
        for vertex in graph.vertices:
            in_block = vertex.cluster in sizes.blocks
            box = self.box[vertex.key] = vertex.cluster if in_block else vertex.key
            self.around[box] = self._parents[vertex.cluster] if in_block else vertex.cluster

    def around_both(self, first: str, second: str) -> str:
        """Return the innermost cluster around two boxes; empty for none."""
        outer = set(self._outwards(first))
        return next((key for key in self._outwards(second) if key in outer), "")

    def _outwards(self, box: str) -> Iterator[str]:
        key = self.around[box]
        while key:
            yield key
            key = self._parents[key]


def _groups(graph: Graph, root: Group, axes: Axes, sizes: Sizes) -> dict[str, Group]:
    groups = {"": root}
    for cluster in graph.clusters:
        if cluster.block:
            continue
        needed = sizes.frames[cluster.key].width + 2 * FRAME_PADDING
        group = (
            Group(label_along=FRAME_LABEL, least=needed)
            if axes.down
            else Group(label=FRAME_LABEL, least_along=needed)
        )
        groups[cluster.key] = group
        groups[cluster.parent].children.append(group)
    return groups


def _drop_empty(group: Group) -> None:
    for child in group.inner():
        _drop_empty(child)
    group.children = [child for child in group.children if isinstance(child, Box) or child.children]


def _self_loops(box: Box, edges: list[Edge], sizes: Sizes, axes: Axes) -> Iterator[SelfLoop]:
    """Yield the loops of a box, and extend the box by a tail for them and their labels."""
    labels = [sizes.labels.get(edge.key) for edge in edges]
    extents = [None if label is None else axes.of_size(label) for label in labels]
    needed = [extent for extent in extents if extent is not None]
    box.tail = LOOP_BOW + max((along + LOOP_LABEL_GAP for along, _ in needed), default=0.0)
    box.along += box.tail
    box.across = max(box.across, sum(across + LOOP_LABEL_GAP for _, across in needed))
    step = box.across / len(edges)
    for index, (edge, extent) in enumerate(zip(edges, extents, strict=True)):
        middle = (index + 0.5) * step - box.across / 2
        source = sizes.rows.get(edge.source, middle - step / 4)
        target = sizes.rows.get(edge.target, middle + step / 4)
        yield SelfLoop(edge, box, source, target, middle, extent)


class _Chains:
    """Joins boxes by bends on the ranks between them. One bend holds the label.

    Edges with a common source or target share segments as long as possible.
    """

    def __init__(
        self, parts: Parts, nesting: _Nesting, sizes: Sizes, directed_edges: list[_DirectedEdge]
    ) -> None:
        self._parts = parts
        self._nesting = nesting
        self._sizes = sizes
        self._edges = directed_edges
        self._shared: dict[tuple[object, ...], Box] = {}
        self._leaving = Counter((directed.low, *directed.style) for directed in directed_edges)
        self._arriving = Counter((directed.high, *directed.style) for directed in directed_edges)

    def all(self) -> Iterator[EdgeChain]:
        """Yield the chain of each edge, with its boxes linked."""
        for directed in self._edges:
            chain = self._chain(directed, self._sizes.labels.get(directed.edge.key))
            link(chain)
            yield chain

    def _chain(self, directed: _DirectedEdge, label: Size | None) -> EdgeChain:
        low, high = self._nesting.box[directed.low], self._nesting.box[directed.high]
        begin, end = self._parts.boxes[low], self._parts.boxes[high]
        inside = self._nesting.around_both(low, high)
        leaving = self._leaving[directed.low, *directed.style]
        arriving = self._arriving[directed.high, *directed.style]
        ranks = range(begin.rank + 1, end.rank)
        hub = ("leaving", directed.low) if leaving >= arriving else ("arriving", directed.high)
        single = ranks[-1] if leaving >= arriving else ranks[0]
        if leaving == arriving == 1:
            single = ranks[-1] if directed.backward else ranks[0]
            hub = ("alone", directed.edge.key)
        bends = {
            rank: self._bend(rank, inside, None if rank == single else (*hub, *directed.style))
            for rank in ranks
        }
        if label is not None:
            bends[single].along, bends[single].across = self._parts.axes.of_size(label)
        return EdgeChain(
            edge=directed.edge,
            boxes=(begin, *bends.values(), end),
            label=bends[single] if label is not None else None,
            backward=directed.backward,
            first_offset=self._sizes.rows.get(directed.low),
            last_offset=self._sizes.rows.get(directed.high),
        )

    def _bend(self, rank: int, inside: str, shared_by: tuple[object, ...] | None) -> Box:
        bend = Box(rank, 0.0, 0.0, gap=BEND_GAP)
        if shared_by is not None:
            shared = self._shared.setdefault((*shared_by, inside, rank), bend)
            if shared is not bend:
                return shared
        self._parts.groups[inside].children.append(bend)
        return bend
