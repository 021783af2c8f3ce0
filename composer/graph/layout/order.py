"""The order of boxes across the ranks, found by the barycentre method.

Sweeps to and fro sort by the places of the neighbours; the order with the fewest crossings is kept.
A group is sorted as a whole.
"""

from __future__ import annotations

from bisect import bisect_right, insort
from collections.abc import Callable, Iterable, Sequence

from composer.graph.layout.boxes import Box, Group, Item, space_between

_SWEEPS = 16
#: Neighbours change places one by one in graphs up to so many boxes; beyond, it takes too long.
_MOST_BOXES = 160
_ROUNDS = 3

#: What an order costs: crossings first, then the length of the lines across, in pixels.
Cost = tuple[int, float]


def put_in_order(root: Group) -> None:
    """Sort the children of all groups for few crossings, and give every box a position."""
    pack(root)
    best = (cost(root), _children(root))
    for sweep in range(_SWEEPS):
        _sort(root, (_before, _after, _both)[sweep % 3])
        pack(root)
        reached = cost(root)
        if reached < best[0]:
            best = (reached, _children(root))
    for group, children in best[1]:
        group.children = children
    pack(root)
    if sum(1 for _ in root.boxes()) <= _MOST_BOXES:
        _switch(root)


def _switch(root: Group) -> None:
    """Let neighbours change places wherever that makes things better."""
    reached = cost(root)
    for _ in range(_ROUNDS):
        before = reached
        for group in [root, *root.groups()]:
            for index in range(len(group.children) - 1):
                reached = _try_switch(root, group, index, reached)
        if reached == before:
            break
    pack(root)


def _try_switch(root: Group, group: Group, index: int, reached: Cost) -> Cost:
    children = group.children
    children[index], children[index + 1] = children[index + 1], children[index]
    pack(root)
    found = cost(root)
    if found < reached:
        return found
    children[index], children[index + 1] = children[index + 1], children[index]
    return reached


def pack(group: Group, start: float = 0.0) -> None:
    """Place the children in their order, each as close to ``start`` as those before it allow."""
    group.low = start
    inside = start + group.padding + group.label
    last: dict[int, Item] = {}
    for child in group.children:
        covered = range(child.first_rank, child.last_rank + 1)
        above = [last[rank] for rank in covered if rank in last]
        low = max((item.high + space_between(item, child) for item in above), default=inside)
        if isinstance(child, Group):
            pack(child, low)
        else:
            child.position = low + child.across / 2
        last.update(dict.fromkeys(covered, child))
    high = max(child.high for child in group.children) + group.padding
    group.high = max(high, group.low + group.least)


def cost(root: Group) -> Cost:
    """Return how often lines between neighbouring ranks cross, and how far they go across."""
    by_rank: dict[int, list[tuple[float, float]]] = {}
    for box in root.boxes():
        for other in box.after:
            by_rank.setdefault(box.rank, []).append((box.position, other.position))
    length = sum(abs(begin - end) for lines in by_rank.values() for begin, end in lines)
    return sum(map(_inversions, by_rank.values())), round(length, 3)


def _inversions(lines: Iterable[tuple[float, float]]) -> int:
    count = 0
    seen: list[float] = []
    for _, end in sorted(lines):
        count += len(seen) - bisect_right(seen, end)
        insort(seen, end)
    return count


def _children(group: Group) -> list[tuple[Group, list[Item]]]:
    found = [(group, list(group.children))]
    for child in group.children:
        if isinstance(child, Group):
            found += _children(child)
    return found


def _before(box: Box) -> Sequence[Box]:
    return box.before


def _after(box: Box) -> Sequence[Box]:
    return box.after


def _both(box: Box) -> Sequence[Box]:
    return [*box.before, *box.after]


def _sort(group: Group, neighbours: Callable[[Box], Sequence[Box]]) -> None:
    wanted = {id(child): _wanted(child, neighbours) for child in group.children}
    group.children.sort(key=lambda child: wanted[id(child)])
    for child in group.children:
        if isinstance(child, Group):
            _sort(child, neighbours)


def _wanted(item: Item, neighbours: Callable[[Box], Sequence[Box]]) -> float:
    """Return the mean place of the neighbours outside the item; where it is if it has none."""
    own = set(map(id, item.boxes()))
    places = [
        other.position for box in item.boxes() for other in neighbours(box) if id(other) not in own
    ]
    return sum(places) / len(places) if places else (item.low + item.high) / 2
