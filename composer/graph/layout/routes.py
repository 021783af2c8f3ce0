"""The lines: from side to side through the bends, in curves that leave and arrive straight."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

from composer.graph.layout.axes import Axes
from composer.graph.layout.boxes import Box, Chain
from composer.graph.layout.columns import Extent, reach
from composer.graph.layout.result import Path

#: How much of a vertex's side lines may use, leaving its corners free.
_USED_SIDE = 0.6


class Router:
    """Draws chains once all boxes have their place; ``ranks`` are the extents along the arrows."""

    def __init__(self, axes: Axes, ranks: list[Extent]) -> None:
        self._axes = axes
        self._ranks = ranks

    def paths(self, chains: list[Chain]) -> tuple[Path, ...]:
        """Return a path for each chain. Lines that share a side of a vertex are spread over it."""
        leaving = _spread(chains, lambda chain: (chain.boxes[0], chain.boxes[1]))
        arriving = _spread(chains, lambda chain: (chain.boxes[-1], chain.boxes[-2]))
        return tuple(self._path(chain, leaving[id(chain)], arriving[id(chain)]) for chain in chains)

    def _path(self, chain: Chain, leaving: float, arriving: float) -> Path:
        points = _curve(self._stations(chain, leaving, arriving))
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

    def _stations(self, chain: Chain, leaving: float, arriving: float) -> list[tuple[float, float]]:
        """Return the points where the line is parallel to the ranks' direction."""
        first, last = chain.boxes[0], chain.boxes[-1]
        stations = [(reach(first, self._ranks).end, leaving)]
        for box in chain.boxes[1:-1]:
            rank = self._ranks[box.rank]
            stations.append((rank.begin, box.position))
            if rank.end > rank.begin:
                stations.append((rank.end, box.position))
        stations.append((reach(last, self._ranks).begin, arriving))
        return stations


def _spread(chains: list[Chain], side: Callable[[Chain], tuple[Box, Box]]) -> dict[int, float]:
    """Return, by chain, where on the side of its vertex the line begins or ends, across."""
    by_box: dict[int, list[Chain]] = {}
    for chain in chains:
        by_box.setdefault(id(side(chain)[0]), []).append(chain)
    found = {}
    for sharing in by_box.values():
        box = side(sharing[0])[0]
        sharing.sort(key=lambda chain: side(chain)[1].position)
        step = box.across * _USED_SIDE / len(sharing)
        for index, chain in enumerate(sharing):
            found[id(chain)] = box.position + (index - (len(sharing) - 1) / 2) * step
    return found


def _curve(stations: list[tuple[float, float]]) -> list[tuple[float, float]]:
    points = [stations[0]]
    for (along, across), (next_along, next_across) in pairwise(stations):
        middle = (along + next_along) / 2
        points += [(middle, across), (middle, next_across), (next_along, next_across)]
    return points
