"""From a graph to boxes in groups: vertices on even ranks, bends and labels between them."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from composer.graph.layout.axes import Axes
from composer.graph.layout.boxes import (
    BEND_GAP,
    FRAME_LABEL,
    FRAME_PADDING,
    Box,
    Chain,
    Group,
    Loop,
    link,
)
from composer.graph.layout.loops import loops_of, make_room
from composer.graph.layout.ranks import forward, ranks
from composer.graph.layout.result import Size
from composer.graph.layout.solids import Sizes, Solids
from composer.graph.picture import Cluster, Direction, Edge, Graph


@dataclass(slots=True)
class Parts:
    """Everything of a graph on its way to a place."""

    graph: Graph
    axes: Axes
    root: Group
    groups: dict[str, Group]  # by cluster key; "" is the root
    boxes: dict[str, Box] = field(default_factory=dict)  # by the solid's key
    chains: list[Chain] = field(default_factory=list)
    loops: list[Loop] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class _Way:
    """An edge in the direction of the ranks: from ``low`` to ``high``, which are vertex keys."""

    edge: Edge
    low: str
    high: str

    @property
    def backward(self) -> bool:
        return self.low != self.edge.source

    @property
    def looks(self) -> tuple[str, bool, bool]:
        """What lines must have in common to be drawn over one another."""
        return (self.edge.kind.value, bool(self.edge.wrong), self.backward)


def build(graph: Graph, sizes: Sizes) -> Parts:
    """Return the boxes and groups of a graph, not placed yet. It has at least one vertex."""
    solids = Solids(graph, sizes)
    through = [edge for edge in graph.edges if solids.key(edge.source) != solids.key(edge.target)]
    pairs = [(solids.key(edge.source), solids.key(edge.target)) for edge in through]
    clusters = {key: solid.cluster for key, solid in solids.all.items()}
    turned = forward(list(clusters), pairs)
    rank = ranks(clusters, turned)
    axes = Axes(graph.direction is Direction.DOWN)
    root = Group(padding=0.0)
    parts = Parts(graph, axes, root, _groups(graph, root, axes, sizes))
    for key, solid in solids.all.items():
        along, across = axes.of_size(solid.size)
        box = Box(2 * rank[key], along, across)
        parts.boxes[key] = box
        parts.groups[solid.cluster].children.append(box)
    for key, edges in loops_of(graph, solids).items():
        parts.loops += make_room(parts.boxes[key], edges, sizes, axes)
    ways = [
        _Way(edge, edge.source, edge.target)
        if pair == straight
        else _Way(edge, edge.target, edge.source)
        for edge, pair, straight in zip(through, turned, pairs, strict=True)
    ]
    _Chains(parts, solids, ways).add(sizes)
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
    """Joins boxes by bends on the ranks between them; a label stands on one of these.

    Lines that come from one place, or lead to one, run together for as long as they can: what
    everybody listens to would else be a thicket.
    """

    def __init__(self, parts: Parts, solids: Solids, ways: list[_Way]) -> None:
        self._parts = parts
        self._solids = solids
        self._ways = ways
        self._frames = _Frames(parts.graph, solids)
        self._shared: dict[tuple[object, ...], Box] = {}
        self._leaving = Counter((way.low, *way.looks) for way in ways)
        self._arriving = Counter((way.high, *way.looks) for way in ways)

    def add(self, sizes: Sizes) -> None:
        for way in self._ways:
            chain = self._chain(way, sizes.labels.get(way.edge.key))
            link(chain)
            self._parts.chains.append(chain)

    def _chain(self, way: _Way, label: Size | None) -> Chain:
        low, high = self._solids.key(way.low), self._solids.key(way.high)
        begin, end = self._parts.boxes[low], self._parts.boxes[high]
        inside = self._frames.around_both(low, high)
        leaving, arriving = self._leaving[way.low, *way.looks], self._arriving[way.high, *way.looks]
        ranks = range(begin.rank + 1, end.rank)
        hub = ("leaving", way.low) if leaving >= arriving else ("arriving", way.high)
        own = ranks[-1] if leaving >= arriving else ranks[0]
        if leaving == arriving == 1:
            own = ranks[-1] if way.backward else ranks[0]
            hub = ("alone", way.edge.key)
        bends = {
            rank: self._bend(rank, inside, None if rank == own else (*hub, *way.looks))
            for rank in ranks
        }
        if label is not None:
            bends[own].along, bends[own].across = self._parts.axes.of_size(label)
        return Chain(
            edge=way.edge,
            boxes=(begin, *bends.values(), end),
            label=bends[own] if label is not None else None,
            backward=way.backward,
            first_offset=self._solids.offset(way.low),
            last_offset=self._solids.offset(way.high),
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
    """Which frames are around which solid."""

    def __init__(self, graph: Graph, solids: Solids) -> None:
        self._clusters: dict[str, Cluster] = {cluster.key: cluster for cluster in graph.clusters}
        self._around = {key: solid.cluster for key, solid in solids.all.items()}

    def around_both(self, first: str, second: str) -> str:
        """Return the innermost cluster that holds both; empty for none."""
        outer = set(self._outwards(first))
        return next((key for key in self._outwards(second) if key in outer), "")

    def _outwards(self, solid: str) -> list[str]:
        found = []
        key = self._around[solid]
        while key:
            found.append(key)
            key = self._clusters[key].parent
        return found
