"""The order of boxes along the arrows, by rank, and across, with few crossings.

Arrows lead to a higher rank, but for the few that have to point backwards to break a cycle. On the
ranks, boxes are ordered with the barycenter method: sweeps over the ranks in both directions move
every box to the mean position of its neighbors; groups move as a whole. The order with the fewest
crossings, of sweeps from several starts, is kept.
"""

from __future__ import annotations

import math
from bisect import bisect_right, insort
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from graphlib import TopologicalSorter

from composer.graph.layout.boxes import Box, Group, Item, Link, space_between

Pair = tuple[str, str]
_SWEEPS = 12
_MAX_SWEEPS_WITHOUT_GAIN = 4

#: The cost of an order: crossings, then the total length of edges across in pixels.
_Cost = tuple[int, float]
#: The children of every group.
_Order = list[tuple[Group, list[Item]]]


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


def order_boxes(root: Group) -> None:
    """Sort the children of all groups for few crossings, and give every box a position."""
    by_rank = _by_rank(root)
    swept = [_swept(root, by_rank, start) for start in (_as_declared, _reversed, _as_reached)]
    _, order = min(swept, key=lambda one: one[0])
    _restore(order)
    _pack(root)


def _swept(
    root: Group, by_rank: list[list[Box]], start: Callable[[Group], None]
) -> tuple[_Cost, _Order]:
    """Return the best order found by sweeps from a start; stop without improvement."""
    order = _children(root)
    start(root)
    _pack(root)
    best = (_cost(root), _children(root))
    without_gain = 0
    for sweep in range(_SWEEPS):
        _sweep(by_rank, backwards=bool(sweep % 2))
        _sort(root)
        _pack(root)
        reached = _cost(root)
        without_gain += 1
        if reached < best[0]:
            best = (reached, _children(root))
            without_gain = 0
        if without_gain == _MAX_SWEEPS_WITHOUT_GAIN:
            break
    _restore(order)
    return best


def _by_rank(root: Group) -> list[list[Box]]:
    ranks: list[list[Box]] = [[] for _ in range(root.last_rank + 1)]
    for box in root.boxes():
        ranks[box.rank].append(box)
    return ranks


def _children(group: Group) -> _Order:
    order: _Order = [(group, list(group.children))]
    for child in group.inner():
        order += _children(child)
    return order


def _restore(order: _Order) -> None:
    for group, children in order:
        group.children = list(children)


def _as_declared(root: Group) -> None:
    """Keep the declared order."""


def _reversed(root: Group) -> None:
    for group in (root, *root.groups()):
        group.children.reverse()


def _as_reached(root: Group) -> None:
    """Sort in breadth-first order, which keeps related boxes together."""
    number: dict[int, int] = {}
    for start in sorted(root.boxes(), key=lambda box: box.rank):
        waiting = deque([start])
        while waiting:
            box = waiting.popleft()
            if id(box) in number:
                continue
            number[id(box)] = len(number)
            waiting.extend(piece.high for piece in box.after)
            waiting.extend(piece.low for piece in box.before)
    for box in root.boxes():
        box.position = float(number[id(box)])
    _sort(root)


def _sweep(by_rank: list[list[Box]], *, backwards: bool) -> None:
    """Move every box to the mean position of its neighbors on the previous (or next) rank."""
    for rank in reversed(by_rank) if backwards else by_rank:
        for box in rank:
            places = _behind(box.after) if backwards else _before(box.before)
            if places:
                box.position = sum(places) / len(places)
        rank.sort(key=lambda box: box.position)
        _push_apart(rank)


def _before(pieces: list[Link]) -> list[float]:
    return [piece.low.position + piece.low_offset - piece.high_offset for piece in pieces]


def _behind(pieces: list[Link]) -> list[float]:
    return [piece.high.position + piece.high_offset - piece.low_offset for piece in pieces]


def _push_apart(rank: list[Box]) -> None:
    """Remove overlaps on a rank, keeping its order and its middle."""
    if len(rank) < 2:
        return
    middle = sum(box.position for box in rank) / len(rank)
    end = None
    for box in rank:
        least = box.position if end is None else end + box.gap + box.across / 2
        box.position = max(box.position, least)
        end = box.high
    drift = sum(box.position for box in rank) / len(rank) - middle
    for box in rank:
        box.position -= drift


def _sort(group: Group) -> float:
    """Sort all children by position, groups by their mean; return the mean of the group."""
    positions = {
        id(child): _sort(child) if isinstance(child, Group) else child.position
        for child in group.children
    }
    group.children.sort(key=lambda child: positions[id(child)])
    return sum(positions.values()) / len(positions)


def _pack(group: Group, start: float = 0.0) -> None:
    """Place the children in order, as close to ``start`` as possible."""
    group.low = start
    inside = start + group.padding + group.label
    last: dict[int, Item] = {}
    for child in group.children:
        if isinstance(child, Box):  # as below, for the most frequent case
            nearest = last.get(child.rank)
            low = inside if nearest is None else nearest.high + space_between(nearest, child)
            child.position = low + child.across / 2
            last[child.rank] = child
            continue
        covered = range(child.first_rank, child.last_rank + 1)
        above = [last[rank] for rank in covered if rank in last]
        low = max((item.high + space_between(item, child) for item in above), default=inside)
        _pack(child, low)
        last.update(dict.fromkeys(covered, child))
    high = max(child.high for child in group.children) + group.padding
    group.high = max(high, group.low + group.least)


def _cost(root: Group) -> _Cost:
    """Return the number of crossings between ranks, and the length of edges across."""
    by_rank: dict[int, list[tuple[float, float]]] = {}
    for box in root.boxes():
        for piece in box.after:
            ends = (box.position + piece.low_offset, piece.high.position + piece.high_offset)
            by_rank.setdefault(box.rank, []).append(ends)
    length = sum(abs(begin - end) for lines in by_rank.values() for begin, end in lines)
    return sum(map(_inversions, by_rank.values())), round(length, 3)


def _inversions(lines: Sequence[tuple[float, float]]) -> int:
    if len(lines) == 1:
        return 0
    count = 0
    seen: list[float] = []
    for _, end in sorted(lines):
        count += len(seen) - bisect_right(seen, end)
        insort(seen, end)
    return count
