"""Route edges through their bends as smooth curves."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

from composer.graph.layout.result import Path
from composer.graph.layout.steps.bend_removal import Obstacles, Station
from composer.graph.layout.steps.boxes import Axes, Box, EdgeChain
from composer.graph.layout.steps.rank_extents import Extent, extent_of

#: The part of a side that edges may use, without the corners.
_USED_SIDE = 0.6


class Router:
    """Routes chains after the boxes have positions; ``ranks`` are the extents of ranks."""

    def __init__(self, axes: Axes, ranks: list[Extent], obstacles: Obstacles) -> None:
        self._axes = axes
        self._ranks = ranks
        self._obstacles = obstacles

    def paths(self, chains: list[EdgeChain]) -> list[Path]:
        """Return a path for each chain. Edges on a side of a vertex are spread over it."""
        leaving = _spread(chains, lambda chain: (chain.boxes[0], chain.boxes[1]), _first_offset)
        arriving = _spread(chains, lambda chain: (chain.boxes[-1], chain.boxes[-2]), _last_offset)
        return [self._path(chain, leaving[id(chain)], arriving[id(chain)]) for chain in chains]

    def _path(self, chain: EdgeChain, leaving: float, arriving: float) -> Path:
        stations = self._obstacles.shortened(self._stations(chain, leaving, arriving))
        points = _curve(stations)
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

    def _stations(self, chain: EdgeChain, leaving: float, arriving: float) -> list[Station]:
        """Return the straight sections of a path, along the arrows."""
        first, last = chain.boxes[0], chain.boxes[-1]
        begin, end = extent_of(first, self._ranks).end, extent_of(last, self._ranks).begin
        stations = [Station(begin, begin, leaving, first.rank, needed=True)]
        for box in chain.boxes[1:-1]:
            rank = self._ranks[box.rank]
            forks = len(box.before) > 1 or len(box.after) > 1
            needed = box is chain.label or forks
            stations.append(Station(rank.begin, rank.end, box.position, box.rank, needed))
        return [*stations, Station(end, end, arriving, last.rank, needed=True)]


def _first_offset(chain: EdgeChain) -> float | None:
    return chain.first_offset


def _last_offset(chain: EdgeChain) -> float | None:
    return chain.last_offset


def _spread(
    chains: list[EdgeChain],
    side: Callable[[EdgeChain], tuple[Box, Box]],
    fixed: Callable[[EdgeChain], float | None],
) -> dict[int, float]:
    """Return the position of each chain's end on the side of its vertex, across.

    Edges through the same bend share a position.
    """
    found = {}
    by_box: dict[int, list[EdgeChain]] = {}
    for chain in chains:
        offset = fixed(chain)
        if offset is None:
            by_box.setdefault(id(side(chain)[0]), []).append(chain)
        else:
            found[id(chain)] = side(chain)[0].position + offset
    for sharing in by_box.values():
        box = side(sharing[0])[0]
        bends = sorted(
            {id(side(chain)[1]): side(chain)[1] for chain in sharing}.values(),
            key=lambda bend: bend.position,
        )
        step = box.across * _USED_SIDE / len(bends)
        places = {
            id(bend): box.position + (index - (len(bends) - 1) / 2) * step
            for index, bend in enumerate(bends)
        }
        found.update({id(chain): places[id(side(chain)[1])] for chain in sharing})
    return found


def _curve(stations: list[Station]) -> list[tuple[float, float]]:
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
