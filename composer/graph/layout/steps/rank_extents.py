"""Compute the extents of ranks and frames along the arrows."""

from __future__ import annotations

from composer.fast_dataclass import dataclass
from composer.graph.layout.steps.boxes import Box, Group, Item

_RANK_GAP = 22.0


@dataclass(frozen=True, slots=True)
class Extent:
    """An interval along the arrows."""

    begin: float
    end: float

    @property
    def middle(self) -> float:
        """The point halfway."""
        return (self.begin + self.end) / 2


def rank_extents(root: Group, start: float) -> list[Extent]:
    """Return the extent of each rank, with space for frames that begin or end there."""
    widths = [0.0] * (root.last_rank + 1)
    for box in root.boxes():
        widths[box.rank] = max(widths[box.rank], box.along)
    for group in root.groups():
        if group.first_rank == group.last_rank:
            needed = group.least_along - 2 * group.padding
            widths[group.first_rank] = max(widths[group.first_rank], needed)
    found = []
    for rank, width in enumerate(widths):
        begin = start + _room_before(root, rank)
        found.append(Extent(begin, begin + width))
        start = begin + width + _room_behind(root, rank) + _RANK_GAP
    return found


def extent_of(item: Item, ranks: list[Extent]) -> Extent:
    """Return the extent of a box, without the tail for its loops, or of a frame."""
    if isinstance(item, Box):
        middle = ranks[item.rank].middle
        return Extent(middle - item.along / 2, middle + item.along / 2 - item.tail)
    inside = [extent_of(child, ranks) for child in item.children]
    tails = [child.tail if isinstance(child, Box) else 0.0 for child in item.children]
    begin = min(extent.begin for extent in inside) - item.padding - item.label_along
    end = max(map(_end, inside, tails)) + item.padding
    missing = max(0.0, item.least_along - (end - begin))
    return Extent(begin - missing / 2, end + missing / 2)


def _room_before(group: Group, rank: int) -> float:
    own = group.padding + group.label_along if group.first_rank == rank else 0.0
    nested = [child for child in group.inner() if child.first_rank <= rank <= child.last_rank]
    return own + max((_room_before(child, rank) for child in nested), default=0.0)


def _room_behind(group: Group, rank: int) -> float:
    own = group.padding if group.last_rank == rank else 0.0
    nested = [child for child in group.inner() if child.first_rank <= rank <= child.last_rank]
    return own + max((_room_behind(child, rank) for child in nested), default=0.0)


def _end(extent: Extent, tail: float) -> float:
    return extent.end + tail
