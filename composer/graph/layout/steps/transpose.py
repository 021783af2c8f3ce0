"""Transpose neighbors where that reduces crossings."""

from __future__ import annotations

from composer.graph.layout.steps.boxes import Box, Group, Item

#: The segments that leave an item: rank, target rank, and the positions of both ends.
_Pieces = dict[tuple[int, int], list[tuple[float, float]]]


def transpose(root: Group) -> bool:
    """Transpose neighbors in all groups once where that helps; return whether any were.

    Positions are read to know the order on each rank. Only the order of the children is to be
    used after: positions are those of the new order as far as it goes without packing.
    """
    changed = [_pass_over(group) for group in [root, *root.groups()]]
    return any(changed)


def _pass_over(group: Group) -> bool:
    changed = False
    index = 0
    while index < len(group.children) - 1:
        other = _next_in_the_way(group.children, index)
        if other is not None and _gain(group.children[index], group.children[other]) > 0:
            _exchange(group.children, index, other)
            changed = True
        index += 1
    return changed


def _next_in_the_way(children: list[Item], index: int) -> int | None:
    """Return the next child that shares a rank with the child at ``index``."""
    item = children[index]
    for other in range(index + 1, len(children)):
        following = children[other]
        if item.first_rank <= following.last_rank and following.first_rank <= item.last_rank:
            return other
    return None


def _exchange(children: list[Item], index: int, other: int) -> None:
    """Move the child at ``index`` after the one at ``other``; none in between shares a rank."""
    first, second = children[index], children[other]
    forward, backward = second.high - first.high, first.low - second.low
    first.shift(forward)
    second.shift(backward)
    children.insert(other, children.pop(index))


def _gain(first: Item, second: Item) -> int:
    """Return the number of crossings saved by putting the second before the first."""
    theirs = _pieces(second)
    gain = 0
    for key, lines in _pieces(first).items():
        for begin, end in lines:
            for other_begin, other_end in theirs.get(key, ()):
                gain += _sign((begin - other_begin) * (end - other_end))
    return -gain


def _sign(value: float) -> int:
    return (value > 0.0) - (value < 0.0)


def _pieces(item: Item) -> _Pieces:
    own = set(map(id, item.boxes()))
    found: _Pieces = {}
    for box in item.boxes():
        for begin, other, end in _around(box):
            if id(other) not in own:
                found.setdefault((box.rank, other.rank), []).append((begin, end))
    return found


def _around(box: Box) -> list[tuple[float, Box, float]]:
    leaving = [
        (box.position + piece.low_offset, piece.high, piece.high.position + piece.high_offset)
        for piece in box.after
    ]
    arriving = [
        (box.position + piece.high_offset, piece.low, piece.low.position + piece.low_offset)
        for piece in box.before
    ]
    return leaving + arriving
