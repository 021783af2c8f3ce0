"""Assign a rank to each vertex: its layer along the arrows.

Arrows lead to a higher rank, but for the few that have to point backwards to break a cycle.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from graphlib import TopologicalSorter

Pair = tuple[str, str]


def break_cycles(keys: Sequence[str], pairs: Sequence[Pair]) -> list[Pair]:
    """Return the pairs, reversed where they close a cycle.

    Which ones is found as Eades, Lin and Smyth (1993) do: take sinks from the end, sources from
    the start, and else the vertex with the most arrows out and the fewest in.
    """
    place = {key: index for index, key in enumerate(_acyclic_order(keys, pairs))}
    return [pair if place[pair[0]] <= place[pair[1]] else pair[::-1] for pair in pairs]


def assign_ranks(clusters: Mapping[str, str], pairs: Sequence[Pair]) -> dict[str, int]:
    """Return the rank of each key of ``clusters``, from 0. ``pairs`` has no cycles.

    Vertices without edges form a block with others of their cluster.
    """
    keys = list(clusters)
    outgoing = _neighbors(keys, pairs)
    incoming = _neighbors(keys, [pair[::-1] for pair in pairs])
    order = list(TopologicalSorter(incoming).static_order())
    ranks: dict[str, int] = {}
    for key in order:
        ranks[key] = max((ranks[other] + 1 for other in incoming[key]), default=0)
    for _ in range(4):  # move vertices to the rank with the shortest edges
        for key in reversed(order):
            ranks[key] = _best_rank(key, ranks, incoming[key], outgoing[key])
        for key in order:
            ranks[key] = _best_rank(key, ranks, incoming[key], outgoing[key])
    lonely = [key for key in order if not incoming[key] and not outgoing[key]]
    for cluster in dict.fromkeys(clusters[key] for key in lonely):
        _spread(ranks, [key for key in lonely if clusters[key] == cluster])
    lowest = min(ranks.values(), default=0)
    return {key: rank - lowest for key, rank in ranks.items()}


def _neighbors(keys: Sequence[str], pairs: Sequence[Pair]) -> dict[str, list[str]]:
    neighbors: dict[str, list[str]] = {key: [] for key in keys}
    for source, target in pairs:
        if source != target:
            neighbors[source].append(target)
    return neighbors


def _acyclic_order(keys: Sequence[str], pairs: Sequence[Pair]) -> list[str]:
    outgoing = _neighbors(keys, pairs)
    incoming = _neighbors(keys, [pair[::-1] for pair in pairs])
    left = dict.fromkeys(keys)
    out_degree = {key: len(outgoing[key]) for key in keys}
    in_degree = {key: len(incoming[key]) for key in keys}
    start: list[str] = []
    end: list[str] = []
    while left:
        key = _next(left, out_degree, in_degree)
        (end if out_degree[key] == 0 else start).append(key)
        del left[key]
        for other in outgoing[key]:
            in_degree[other] -= 1
        for other in incoming[key]:
            out_degree[other] -= 1
    return start + end[::-1]


def _next(left: dict[str, None], out_degree: dict[str, int], in_degree: dict[str, int]) -> str:
    for degrees in (out_degree, in_degree):
        key = next((key for key in left if degrees[key] == 0), None)
        if key is not None:
            return key
    return max(left, key=lambda key: out_degree[key] - in_degree[key])


def _best_rank(key: str, ranks: dict[str, int], incoming: list[str], outgoing: list[str]) -> int:
    """Return the rank between the neighbors with the shortest edges."""
    if len(incoming) == len(outgoing):
        return ranks[key]
    if len(incoming) > len(outgoing):
        return max(ranks[other] for other in incoming) + 1
    return min(ranks[other] for other in outgoing) - 1


def _spread(ranks: dict[str, int], lonely: list[str]) -> None:
    """Place vertices in a roughly square block."""
    columns = max(1, round(math.sqrt(len(lonely) / 2)))
    for index, key in enumerate(lonely):
        ranks[key] = index % columns
