"""Directed graphs of names: what uses each other, and cycles. Nothing here is recursive."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import TypeAlias

#: The names that each name needs, all of which are names themselves.
Graph: TypeAlias = Mapping[str, Collection[str]]


def cycles(graph: Graph) -> tuple[tuple[str, ...], ...]:
    """Return a shortest cycle for each set of names that need each other.

    ``("a", "b")`` means that a needs b, which needs a. Each cycle starts at its first name in the
    graph; cycles are ordered by these names.
    """
    rank = {name: index for index, name in enumerate(graph)}
    found = []
    for names in strong_groups(graph):
        first = min(names, key=rank.__getitem__)
        if len(names) > 1 or first in graph[first]:
            found.append(_shortest_cycle(graph, first, set(names)))
    return tuple(sorted(found, key=lambda cycle: rank[cycle[0]]))


def strong_groups(graph: Graph) -> Iterator[tuple[str, ...]]:
    """Yield the strongly connected components, each after those that it needs (Tarjan)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    open_names: dict[str, None] = {}
    for root in graph:
        if root in index:
            continue
        index[root] = low[root] = len(index)
        open_names[root] = None
        path = [(root, iter(graph[root]))]
        while path:
            name, rest = path[-1]
            successor = next(rest, None)
            if successor is None:
                path.pop()
                if path:
                    parent = path[-1][0]
                    low[parent] = min(low[parent], low[name])
                if low[name] == index[name]:
                    yield _close(open_names, name)
            elif successor not in index:
                index[successor] = low[successor] = len(index)
                open_names[successor] = None
                path.append((successor, iter(graph[successor])))
            elif successor in open_names:
                low[name] = min(low[name], index[successor])


def _close(open_names: dict[str, None], name: str) -> tuple[str, ...]:
    """Remove and return ``name`` and all names opened after it."""
    group = []
    while True:
        last, _ = open_names.popitem()
        group.append(last)
        if last == name:
            return tuple(group)


def _shortest_cycle(graph: Graph, start: str, allowed: set[str]) -> tuple[str, ...]:
    """Return the shortest path from ``start`` back to itself within a component."""
    came_from: dict[str, str] = {}
    frontier = [start]
    while frontier:
        reached = []
        for name in frontier:
            for other in graph[name]:
                if other == start:
                    return _path_back(came_from, start, name)
                if other in allowed and other not in came_from:
                    came_from[other] = name
                    reached.append(other)
        frontier = reached
    return (start,)


def _path_back(came_from: Mapping[str, str], start: str, last: str) -> tuple[str, ...]:
    path = [last]
    while path[-1] != start:
        path.append(came_from[path[-1]])
    return tuple(reversed(path))
