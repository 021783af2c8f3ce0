"""Pack boxes in a given order, and count the crossings of that order."""

from __future__ import annotations

from bisect import bisect_right, insort
from collections.abc import Sequence

from composer.graph.layout.steps.boxes import Box, Group, Item, space_between

#: The cost of an order: crossings, then the total length of edges across in pixels.
Cost = tuple[int, float]


def pack(group: Group, start: float = 0.0) -> None:
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
        pack(child, low)
        last.update(dict.fromkeys(covered, child))
    high = max(child.high for child in group.children) + group.padding
    group.high = max(high, group.low + group.least)


def cost(root: Group) -> Cost:
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
