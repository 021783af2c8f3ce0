"""Straight lines: boxes and groups move towards their neighbours as far as others leave room.

The order stays as it is, and so does every frame: nothing that did not overlap does so after.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from composer.graph.layout.boxes import Box, Group, Item, space_between

_ROUNDS = 24
#: A bend wants to lie in line more than a vertex does: long lines look best straight.
_BEND_WEIGHT = 4.0


@dataclass(slots=True)
class _Room:
    """A child of a group, and what bounds its movement."""

    item: Item
    group: Group
    above: list[Item]
    below: list[Item]
    pulls: list[tuple[Box, Box, float]]  # (own box, neighbour outside, weight)


def straighten(root: Group) -> None:
    """Move everything towards its neighbours, across."""
    rooms = _rooms(root, root)
    for number in range(_ROUNDS):
        for room in rooms if number % 2 else reversed(rooms):
            _move(room, root)
    root.fit()


def _rooms(group: Group, root: Group) -> list[_Room]:
    found = {id(child): _Room(child, group, [], [], _pulls(child)) for child in group.children}
    last: dict[int, Item] = {}
    for child in group.children:
        for rank in range(child.first_rank, child.last_rank + 1):
            above = last.get(rank)
            if above is not None and above not in found[id(child)].above:
                found[id(child)].above.append(above)
                found[id(above)].below.append(child)
            last[rank] = child
    rooms = []
    for room in found.values():
        rooms.append(room)
        if isinstance(room.item, Group):
            rooms += _rooms(room.item, root)
    return rooms


def _pulls(item: Item) -> list[tuple[Box, Box, float]]:
    own = set(map(id, item.boxes()))
    return [
        (box, other, _weight(box) * _weight(other))
        for box in item.boxes()
        for other in (*box.before, *box.after)
        if id(other) not in own
    ]


def _weight(box: Box) -> float:
    return _BEND_WEIGHT if box.across == 0.0 else 1.0


def _move(room: _Room, root: Group) -> None:
    weight = sum(pull for _, _, pull in room.pulls)
    if not weight:
        return
    wanted = sum((other.position - box.position) * pull for box, other, pull in room.pulls) / weight
    item, group = room.item, room.group
    up = min(
        (item.low - other.high - space_between(item, other) for other in room.above),
        default=math.inf,
    )
    down = min(
        (other.low - item.high - space_between(item, other) for other in room.below),
        default=math.inf,
    )
    if group is not root:
        up = min(up, item.low - group.low - group.padding - group.label)
        down = min(down, group.high - group.padding - item.high)
    item.shift(max(-max(up, 0.0), min(max(down, 0.0), wanted)))
