"""Remove bends where an edge can run straight without hitting a box."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable

from composer.fast_dataclass import dataclass
from composer.graph.layout.steps.boxes import Box
from composer.graph.layout.steps.rank_extents import Extent

#: Minimum distance of a shortened edge from boxes, in pixels.
_DISTANCE = 7.0
_HALVINGS = 12


@dataclass(frozen=True, slots=True)
class Station:
    """A straight section of an edge on a rank, along the arrows."""

    begin: float
    end: float
    across: float
    rank: int
    needed: bool


class Obstacles:
    """The boxes on each rank, without bends."""

    def __init__(self, boxes: Iterable[Box], ranks: list[Extent]) -> None:
        self._ranks = ranks
        self._solid: list[list[tuple[float, float]]] = [[] for _ in ranks]
        for box in boxes:
            if box.across > 0.0:
                self._solid[box.rank].append((box.low - _DISTANCE, box.high + _DISTANCE))
        for unit in self._solid:
            unit.sort()

    def shortened(self, stations: list[Station]) -> list[Station]:
        """Return the stations without unnecessary ones."""
        kept = [stations[0]]
        index = 0
        while index < len(stations) - 1:
            index = self._furthest(stations, index)
            kept.append(stations[index])
        return kept

    def _furthest(self, stations: list[Station], index: int) -> int:
        """Return the furthest station reachable in a straight line from ``index``."""
        reached = index + 1
        while not stations[reached].needed and self._is_free(stations, index, reached + 1):
            reached += 1
        return reached

    def _is_free(self, stations: list[Station], first: int, last: int) -> bool:
        begin, end = stations[first], stations[last]
        return all(self._passes(begin, end, station.rank) for station in stations[first + 1 : last])

    def _passes(self, begin: Station, end: Station, rank: int) -> bool:
        solid = self._solid[rank]
        if not solid:
            return True
        extent = self._ranks[rank]
        at = sorted(_across(begin, end, along) for along in (extent.begin, extent.end))
        # The solid parts of a rank hardly overlap: checking the neighbors is enough.
        place = bisect_left(solid, (at[1], at[1]))
        return all(high <= at[0] or low >= at[1] for low, high in solid[max(place - 2, 0) : place])


def _across(begin: Station, end: Station, along: float) -> float:
    """Return the position across of the curve between two stations, at a point along it.

    The curve is the cubic of ``routing``, with control points halfway along.
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
