"""Assign coordinates: across, by moving boxes and groups towards their neighbors; along, by ranks.

The order stays as it is, and so does every frame: nothing that did not overlap does so after.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import field
from itertools import groupby
from typing import TypeAlias

from composer.base.fast_dataclass import dataclass
from composer.graph.layout.boxes import Box, Group, Item, space_between

#: Sweeps propagate positions over all ranks; rounds balance pulls from both sides.
_SWEEPS = 4
_ROUNDS = 24
#: Stop after a round that moves everything less than this, in pixels.
_STILL = 0.5
#: Bends have a higher weight than vertices, to keep long edges straight.
_BEND_WEIGHT = 4.0
#: The space between ranks.
_RANK_GAP = 22.0

#: A box of an item, the neighbor to align it with, the offset of the box from the neighbor for a
#: straight edge, and the weight.
_Pull: TypeAlias = tuple[Box, Box, float, float]


@dataclass(slots=True)
class _Room:
    """A child of a group, and the limits of its movement: its neighbors, with the space between."""

    item: Item
    group: Group
    above: list[tuple[Item, float]]
    below: list[tuple[Item, float]]
    before: list[_Pull]
    after: list[_Pull]
    both: list[_Pull] = field(default_factory=list)


def assign_coordinates(root: Group) -> None:
    """Move everything towards its neighbors, across."""
    rooms = _rooms(root, root)
    by_rank = sorted(rooms, key=lambda room: room.item.first_rank)
    for number in range(_SWEEPS):
        if number % 2:
            _sweep(by_rank[::-1], root, lambda room: room.after)
        else:
            _sweep(by_rank, root, lambda room: room.before)
    for room in rooms:
        room.both = room.before + room.after
    pulled = [room for room in rooms if room.both]
    for number in range(_ROUNDS):
        in_turn = pulled if number % 2 else pulled[::-1]
        if max((_move(room, root, room.both) for room in in_turn), default=0.0) < _STILL:
            break
    root.fit()


def _sweep(rooms: list[_Room], root: Group, pulls: Callable[[_Room], list[_Pull]]) -> None:
    """Sweep over the ranks; on each, move items from one end, then from the other."""
    for _, on_rank in groupby(rooms, key=lambda room: room.item.first_rank):
        in_order = sorted(on_rank, key=lambda room: room.item.low)
        for room in (*reversed(in_order), *in_order):
            _move(room, root, pulls(room))


def _rooms(group: Group, root: Group) -> list[_Room]:
    by_item = {id(child): _Room(child, group, [], [], *_pulls(child)) for child in group.children}
    last: dict[int, Item] = {}
    neighbors: set[tuple[int, int]] = set()
    for child in group.children:
        for rank in range(child.first_rank, child.last_rank + 1):
            above = last.get(rank)
            if above is not None and (id(above), id(child)) not in neighbors:
                neighbors.add((id(above), id(child)))
                space = space_between(above, child)
                by_item[id(child)].above.append((above, space))
                by_item[id(above)].below.append((child, space))
            last[rank] = child
    rooms = []
    for room in by_item.values():
        rooms.append(room)
        if isinstance(room.item, Group):
            rooms += _rooms(room.item, root)
    return rooms


def _pulls(item: Item) -> tuple[list[_Pull], list[_Pull]]:
    boxes = list(item.boxes())
    inside = set(map(id, boxes))
    before = [
        (box, piece.low, piece.low_offset - piece.high_offset, _weight(box, piece.low))
        for box in boxes
        for piece in box.before
        if id(piece.low) not in inside
    ]
    after = [
        (box, piece.high, piece.high_offset - piece.low_offset, _weight(box, piece.high))
        for box in boxes
        for piece in box.after
        if id(piece.high) not in inside
    ]
    return before, after


def _weight(box: Box, other: Box) -> float:
    bends = (box.across == 0.0) + (other.across == 0.0)
    return _BEND_WEIGHT**bends


def _move(room: _Room, root: Group, pulls: list[_Pull]) -> float:
    """Move an item towards its pull within its limits; return the distance."""
    if not pulls:
        return 0.0
    sum_of_weights = target = 0.0
    for box, other, offset, weight in pulls:
        sum_of_weights += weight
        target += (other.position + offset - box.position) * weight
    item = room.item
    distance = target / sum_of_weights
    if distance < 0.0:
        distance = -min(-distance, max(_room_above(room, root), 0.0))
    else:
        distance = min(distance, max(_room_below(room, root), 0.0))
    item.shift(distance)
    return abs(distance)


def _room_above(room: _Room, root: Group) -> float:
    item, group = room.item, room.group
    limit = math.inf
    low = item.low
    if group is not root:
        limit = low - group.low - group.padding - group.label
    for other, space in room.above:
        limit = min(limit, low - other.high - space)
    return limit


def _room_below(room: _Room, root: Group) -> float:
    item, group = room.item, room.group
    limit = math.inf
    high = item.high
    if group is not root:
        limit = group.high - group.padding - high
    for other, space in room.below:
        limit = min(limit, other.low - high - space)
    return limit


@dataclass(frozen=True, slots=True)
class Extent:
    """An interval along the arrows."""

    begin: float
    end: float

    @property
    def middle(self) -> float:
        """The point halfway."""
        return (self.begin + self.end) / 2


def rank_extents(root: Group) -> list[Extent]:
    """Return the extent of each rank, with space for frames that begin or end there."""
    widths = [0.0] * (root.last_rank + 1)
    for box in root.boxes():
        widths[box.rank] = max(widths[box.rank], box.along)
    for group in root.groups():
        if group.first_rank == group.last_rank:
            needed = group.least_along - 2 * group.padding
            widths[group.first_rank] = max(widths[group.first_rank], needed)
    before, behind = _frame_spaces(root, before=True), _frame_spaces(root, before=False)
    extents = []
    start = 0.0
    for rank, width in enumerate(widths):
        begin = start + before.get(rank, 0.0)
        extents.append(Extent(begin, begin + width))
        start = begin + width + behind.get(rank, 0.0) + _RANK_GAP
    return extents


def extent_of(item: Item, ranks: list[Extent]) -> Extent:
    """Return the extent of a box, without the tail for its loops, or of a frame."""
    if isinstance(item, Box):
        middle = ranks[item.rank].middle
        return Extent(middle - item.along / 2, middle + item.along / 2 - item.tail)
    inside = [extent_of(child, ranks) for child in item.children]
    tails = [child.tail if isinstance(child, Box) else 0.0 for child in item.children]
    begin = min(extent.begin for extent in inside) - item.padding - item.label_along
    end = max(extent.end + tail for extent, tail in zip(inside, tails, strict=True)) + item.padding
    missing = max(0.0, item.least_along - (end - begin))
    return Extent(begin - missing / 2, end + missing / 2)


def _frame_spaces(group: Group, *, before: bool) -> dict[int, float]:
    """Return the space before or behind the ranks where the group, or a frame in it, ends."""
    spaces: dict[int, float] = {}
    for child in group.inner():
        for rank, space in _frame_spaces(child, before=before).items():
            spaces[rank] = max(space, spaces.get(rank, 0.0))
    end = group.first_rank if before else group.last_rank
    own = group.padding + (group.label_along if before else 0.0)
    spaces[end] = spaces.get(end, 0.0) + own
    return spaces
