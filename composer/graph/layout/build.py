"""Convert a graph to boxes in groups: vertices on even ranks, bends and labels between them."""

from __future__ import annotations

from collections import Counter
from dataclasses import field

from composer.fast_dataclass import dataclass
from composer.graph.diagram import Cluster, Direction, Edge, Graph, Mark
from composer.graph.layout.result import Size
from composer.graph.layout.self_loops import loops_of, make_room
from composer.graph.layout.steps.boxes import (
    BEND_GAP,
    FRAME_LABEL,
    FRAME_PADDING,
    Axes,
    Box,
    EdgeChain,
    Group,
    SelfLoop,
    link,
)
from composer.graph.layout.steps.ranks import assign_ranks, break_cycles
from composer.graph.layout.units import LayoutUnits, Sizes


@dataclass(slots=True)
class Parts:
    """The parts of a graph during layout."""

    graph: Graph
    axes: Axes
    root: Group
    groups: dict[str, Group]  # by cluster key; "" is the root
    boxes: dict[str, Box] = field(default_factory=dict)  # by the unit's key
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
    def style(self) -> tuple[str, Mark | None, bool]:
        """The style that edges must have in common to share segments."""
        mark = self.edge.problem.mark if self.edge.problem else None
        return (self.edge.kind.value, mark, self.backward)


def build(graph: Graph, sizes: Sizes) -> Parts:
    """Return the boxes and groups of a graph, without positions. It has at least one vertex."""
    units = LayoutUnits(graph, sizes)
    through = [edge for edge in graph.edges if units.key(edge.source) != units.key(edge.target)]
    pairs = [(units.key(edge.source), units.key(edge.target)) for edge in through]
    clusters = {key: unit.cluster for key, unit in units.all.items()}
    turned = break_cycles(list(clusters), pairs)
    rank = assign_ranks(clusters, turned)
    axes = Axes(graph.direction is Direction.DOWN)
    root = Group(padding=0.0)
    parts = Parts(graph, axes, root, _groups(graph, root, axes, sizes))
    for key, unit in units.all.items():
        along, across = axes.of_size(unit.size)
        box = Box(2 * rank[key], along, across)
        parts.boxes[key] = box
        parts.groups[unit.cluster].children.append(box)
    for key, edges in loops_of(graph, units).items():
        parts.loops += make_room(parts.boxes[key], edges, sizes, axes)
    directed_edges = [
        _DirectedEdge(edge, edge.source, edge.target)
        if pair == straight
        else _DirectedEdge(edge, edge.target, edge.source)
        for edge, pair, straight in zip(through, turned, pairs, strict=True)
    ]
    _Chains(parts, units, directed_edges).add(sizes)
    _drop_empty(root)
    root.span_ranks()
    return parts


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


class _Chains:
    """Joins boxes by bends on the ranks between them, one of which holds the label.

    Edges with a common source or target share segments as long as possible.
    """

    def __init__(
        self, parts: Parts, units: LayoutUnits, directed_edges: list[_DirectedEdge]
    ) -> None:
        self._parts = parts
        self._units = units
        self._ways = directed_edges
        self._frames = _Frames(parts.graph, units)
        self._shared: dict[tuple[object, ...], Box] = {}
        self._leaving = Counter((directed.low, *directed.style) for directed in directed_edges)
        self._arriving = Counter((directed.high, *directed.style) for directed in directed_edges)

    def add(self, sizes: Sizes) -> None:
        for directed in self._ways:
            chain = self._chain(directed, sizes.labels.get(directed.edge.key))
            link(chain)
            self._parts.chains.append(chain)

    def _chain(self, directed: _DirectedEdge, label: Size | None) -> EdgeChain:
        low, high = self._units.key(directed.low), self._units.key(directed.high)
        begin, end = self._parts.boxes[low], self._parts.boxes[high]
        inside = self._frames.around_both(low, high)
        leaving, arriving = (
            self._leaving[directed.low, *directed.style],
            self._arriving[directed.high, *directed.style],
        )
        ranks = range(begin.rank + 1, end.rank)
        hub = ("leaving", directed.low) if leaving >= arriving else ("arriving", directed.high)
        own = ranks[-1] if leaving >= arriving else ranks[0]
        if leaving == arriving == 1:
            own = ranks[-1] if directed.backward else ranks[0]
            hub = ("alone", directed.edge.key)
        bends = {
            rank: self._bend(rank, inside, None if rank == own else (*hub, *directed.style))
            for rank in ranks
        }
        if label is not None:
            bends[own].along, bends[own].across = self._parts.axes.of_size(label)
        return EdgeChain(
            edge=directed.edge,
            boxes=(begin, *bends.values(), end),
            label=bends[own] if label is not None else None,
            backward=directed.backward,
            first_offset=self._units.offset(directed.low),
            last_offset=self._units.offset(directed.high),
        )

    def _bend(self, rank: int, inside: str, shared_by: tuple[object, ...] | None) -> Box:
        bend = Box(rank, 0.0, 0.0, gap=BEND_GAP)
        if shared_by is not None:
            known = self._shared.setdefault((*shared_by, inside, rank), bend)
            if known is not bend:
                return known
        self._parts.groups[inside].children.append(bend)
        return bend


def _drop_empty(group: Group) -> None:
    for child in group.inner():
        _drop_empty(child)
    group.children = [child for child in group.children if isinstance(child, Box) or child.children]


class _Frames:
    """The nested frames around each unit."""

    def __init__(self, graph: Graph, units: LayoutUnits) -> None:
        self._clusters: dict[str, Cluster] = {cluster.key: cluster for cluster in graph.clusters}
        self._around = {key: unit.cluster for key, unit in units.all.items()}

    def around_both(self, first: str, second: str) -> str:
        """Return the innermost cluster that holds both; empty for none."""
        outer = set(self._outwards(first))
        return next((key for key in self._outwards(second) if key in outer), "")

    def _outwards(self, unit: str) -> list[str]:
        found = []
        key = self._around[unit]
        while key:
            found.append(key)
            key = self._clusters[key].parent
        return found
