"""Route edges through their bends as smooth curves, straight where no box is in the way."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterable
from itertools import pairwise

from composer.base.fast_dataclass import dataclass
from composer.graph.layout.boxes import LOOP_BOW, LOOP_LABEL_GAP, Axes, Box, EdgeChain, SelfLoop
from composer.graph.layout.coordinates import Extent, extent_of
from composer.graph.layout.geometry import Path, Point

#: The part of a side that edges may use, without the corners.
_USED_SIDE = 0.6
#: Minimum distance of a shortened edge from boxes, in pixels.
_DISTANCE = 7.0
_HALVINGS = 12


@dataclass(frozen=True, slots=True)
class _Station:
    """A straight section of an edge on a rank, along the arrows."""

    begin: float
    end: float
    across: float
    rank: int
    needed: bool


class Router:
    """Routes edges after the boxes have positions; ``ranks`` are the extents of ranks."""

    def __init__(self, axes: Axes, ranks: list[Extent], boxes: Iterable[Box]) -> None:
        self._axes = axes
        self._ranks = ranks
        #: What edges keep off on each rank: boxes, without bends.
        self._solid: list[list[tuple[float, float]]] = [[] for _ in ranks]
        for box in boxes:
            if box.across > 0.0:
                self._solid[box.rank].append((box.low - _DISTANCE, box.high + _DISTANCE))
        for on_rank in self._solid:
            on_rank.sort()

    def paths(self, chains: list[EdgeChain]) -> list[Path]:
        """Return a path for each chain. Edges on a side of a vertex are spread over it."""
        leaving = _spread(
            chains, lambda chain: (chain.boxes[0], chain.boxes[1], chain.first_offset)
        )
        arriving = _spread(
            chains, lambda chain: (chain.boxes[-1], chain.boxes[-2], chain.last_offset)
        )
        return [self._path(chain, leaving[id(chain)], arriving[id(chain)]) for chain in chains]

    def loop(self, loop: SelfLoop) -> Path:
        """Return the path of a self-loop: a curve on the side of its box where arrows leave."""
        side = extent_of(loop.box, self._ranks).end
        begin = loop.box.position + loop.source_offset
        end = loop.box.position + loop.target_offset
        out = side + LOOP_BOW
        points = [(side, begin), (out, begin), (out, end), (side, end)]
        label: Point | None = None
        if loop.label is not None:
            along = out + LOOP_LABEL_GAP + loop.label[0] / 2
            label = self._axes.point(along, loop.box.position + loop.label_offset)
        return Path(loop.edge, tuple(self._axes.point(*point) for point in points), label)

    def _path(self, chain: EdgeChain, leaving: float, arriving: float) -> Path:
        points = _curve(self._shortened(self._stations(chain, leaving, arriving)))
        if chain.backward:
            points.reverse()
        label = chain.label
        return Path(
            chain.edge,
            tuple(self._axes.point(along, across) for along, across in points),
            None
            if label is None
            else self._axes.point(self._ranks[label.rank].middle, label.position),
        )

    def _stations(self, chain: EdgeChain, leaving: float, arriving: float) -> list[_Station]:
        """Return the straight sections of a path, along the arrows."""
        first, last = chain.boxes[0], chain.boxes[-1]
        begin, end = extent_of(first, self._ranks).end, extent_of(last, self._ranks).begin
        stations = [_Station(begin, begin, leaving, first.rank, needed=True)]
        for box in chain.boxes[1:-1]:
            rank = self._ranks[box.rank]
            forks = len(box.before) > 1 or len(box.after) > 1
            needed = box is chain.label or forks
            stations.append(_Station(rank.begin, rank.end, box.position, box.rank, needed))
        return [*stations, _Station(end, end, arriving, last.rank, needed=True)]

    def _shortened(self, stations: list[_Station]) -> list[_Station]:
        """Return the stations without those that a straight line can leave out."""
        kept = [stations[0]]
        index = 0
        while index < len(stations) - 1:
            index = self._furthest(stations, index)
            kept.append(stations[index])
        return kept

    def _furthest(self, stations: list[_Station], index: int) -> int:
        """Return the furthest station reachable in a straight line from ``index``."""
        reached = index + 1
        while not stations[reached].needed and self._is_free(stations, index, reached + 1):
            reached += 1
        return reached

    def _is_free(self, stations: list[_Station], first: int, last: int) -> bool:
        begin, end = stations[first], stations[last]
        return all(self._passes(begin, end, station.rank) for station in stations[first + 1 : last])

    def _passes(self, begin: _Station, end: _Station, rank: int) -> bool:
        solid = self._solid[rank]
        if not solid:
            return True
        extent = self._ranks[rank]
        at = sorted(_across(begin, end, along) for along in (extent.begin, extent.end))
        # The solid parts of a rank hardly overlap: checking the neighbors is enough.
        place = bisect_left(solid, (at[1], at[1]))
        return all(high <= at[0] or low >= at[1] for low, high in solid[max(place - 2, 0) : place])


def _across(begin: _Station, end: _Station, along: float) -> float:
    """Return the position across of the curve between two stations, at a point along it.

    The curve is the cubic of ``_curve``, with control points halfway along.
    """
    span = end.begin - begin.end
    if span <= 0.0 or begin.across == end.across:
        return end.across
    target = min(max((along - begin.end) / span, 0.0), 1.0)
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        if 1.5 * middle * (1 - middle) + middle**3 < target:
            low = middle
        else:
            high = middle
    share = 3 * low**2 - 2 * low**3
    return begin.across + (end.across - begin.across) * share


def _spread(
    chains: list[EdgeChain], end_of: Callable[[EdgeChain], tuple[Box, Box, float | None]]
) -> dict[int, float]:
    """Return the position of each chain's end on the side of its vertex, across.

    ``end_of`` returns the box, the bend next to it, and the offset from its middle if that is
    fixed. Edges through the same bend share a position.
    """
    positions = {}
    by_box: dict[int, list[EdgeChain]] = {}
    for chain in chains:
        box, _, offset = end_of(chain)
        if offset is None:
            by_box.setdefault(id(box), []).append(chain)
        else:
            positions[id(chain)] = box.position + offset
    for sharing in by_box.values():
        box = end_of(sharing[0])[0]
        bends = {id(end_of(chain)[1]): end_of(chain)[1] for chain in sharing}
        in_order = sorted(bends, key=lambda bend: bends[bend].position)
        step = box.across * _USED_SIDE / len(bends)
        places = {
            bend: box.position + (index - (len(bends) - 1) / 2) * step
            for index, bend in enumerate(in_order)
        }
        positions.update({id(chain): places[id(end_of(chain)[1])] for chain in sharing})
    return positions


def _curve(stations: list[_Station]) -> list[tuple[float, float]]:
    points = [(stations[0].end, stations[0].across)]
    for station, following in pairwise(stations):
        middle = (station.end + following.begin) / 2
        points += [
            (middle, station.across),
            (middle, following.across),
            (following.begin, following.across),
        ]
        if following.end > following.begin:
            third = (following.end - following.begin) / 3
            points += [
                (following.begin + third, following.across),
                (following.end - third, following.across),
                (following.end, following.across),
            ]
    return points
