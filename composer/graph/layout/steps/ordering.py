"""Order the boxes on the ranks with the barycenter method.

Sweeps over the ranks in both directions move every box to the mean position of its neighbors;
groups move as a whole. The order with the fewest crossings is kept and improved by transposing
neighbors.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from composer.graph.layout.steps.boxes import Box, Group, Item, Link
from composer.graph.layout.steps.packing import Cost, cost, pack
from composer.graph.layout.steps.transpose import transpose

_SWEEPS = 12
_MAX_SWEEPS_WITHOUT_GAIN = 4
_ROUNDS = 8

#: The children of every group.
_Order = list[tuple[Group, list[Item]]]


def order_boxes(root: Group) -> None:
    """Sort the children of all groups for few crossings, and give every box a position."""
    by_rank = _by_rank(root)
    found = [_swept(root, by_rank, start) for start in (_as_declared, _as_reached)]
    best = min(found, key=lambda one: one[0])
    _restore(best[1])
    _transpose(root, best)
    pack(root)


def _swept(
    root: Group, by_rank: list[list[Box]], start: Callable[[Group], None]
) -> tuple[Cost, _Order]:
    """Return the best order found by sweeps from a start; stop without improvement."""
    order = _children(root)
    start(root)
    pack(root)
    best = (cost(root), _children(root))
    without_gain = 0
    for sweep in range(_SWEEPS):
        _sweep(by_rank, backwards=bool(sweep % 2))
        _sort(root)
        pack(root)
        reached = cost(root)
        without_gain += 1
        if reached < best[0]:
            best = (reached, _children(root))
            without_gain = 0
        if without_gain == _MAX_SWEEPS_WITHOUT_GAIN:
            break
    _restore(order)
    return best


def _transpose(root: Group, best: tuple[Cost, _Order]) -> None:
    for _ in range(_ROUNDS):
        pack(root)
        if not transpose(root):
            break
        pack(root)
        reached = cost(root)
        if reached < best[0]:
            best = (reached, _children(root))
    _restore(best[1])


def _by_rank(root: Group) -> list[list[Box]]:
    ranks: list[list[Box]] = [[] for _ in range(root.last_rank + 1)]
    for box in root.boxes():
        ranks[box.rank].append(box)
    return ranks


def _children(group: Group) -> _Order:
    found: _Order = [(group, list(group.children))]
    for child in group.inner():
        found += _children(child)
    return found


def _restore(order: _Order) -> None:
    for group, children in order:
        group.children = list(children)


def _as_declared(root: Group) -> None:
    """Keep the declared order."""


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
