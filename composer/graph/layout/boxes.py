"""What is laid out: boxes on ranks, in nested groups. The working data of the layout.

"Along" is the axis the arrows follow, "across" the other one; the steps know nothing of x and y.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeAlias

from composer.graph.picture import Edge

#: Space between things on one rank: boxes, and the bends of lines that pass between them.
BOX_GAP = 18.0
BEND_GAP = 8.0
#: Space between a frame and what it holds, and for its label.
FRAME_PADDING = 14.0
FRAME_LABEL = 20.0


@dataclass(slots=True, eq=False)
class Link:
    """A piece of a line, from a box to one on the next rank.

    The offsets say where it leaves and arrives, across, from the boxes' centres.
    """

    low: Box
    high: Box
    low_offset: float = 0.0
    high_offset: float = 0.0


@dataclass(slots=True, eq=False)
class Box:
    """A vertex, the bend of a long edge, or an edge's label."""

    rank: int
    along: float  # its size along the arrows
    across: float
    gap: float = BOX_GAP
    tail: float = 0.0  # the part of ``along``, at its end, that is for lines back to itself
    position: float = 0.0  # of its centre, across
    before: list[Link] = field(default_factory=list)  # from the rank before
    after: list[Link] = field(default_factory=list)  # to the rank after

    @property
    def first_rank(self) -> int:
        """Its only rank."""
        return self.rank

    @property
    def last_rank(self) -> int:
        """Its only rank."""
        return self.rank

    @property
    def low(self) -> float:
        """Where it begins, across."""
        return self.position - self.across / 2

    @property
    def high(self) -> float:
        """Where it ends, across."""
        return self.position + self.across / 2

    def shift(self, distance: float) -> None:
        """Move it, across."""
        self.position += distance

    def boxes(self) -> Iterator[Box]:
        """Yield the box itself."""
        yield self


@dataclass(slots=True, eq=False)
class Group:
    """A frame and what is in it, in order across; or all there is (``padding`` 0)."""

    padding: float = FRAME_PADDING
    label: float = 0.0  # room for the label across, where the frame begins
    label_along: float = 0.0  # room for the label along
    least: float = 0.0  # its least size across
    least_along: float = 0.0
    children: list[Item] = field(default_factory=list)
    low: float = 0.0
    high: float = 0.0
    first_rank: int = 0
    last_rank: int = 0
    gap: float = BOX_GAP

    def shift(self, distance: float) -> None:
        """Move it with all it holds, across."""
        self.low += distance
        self.high += distance
        for child in self.children:
            child.shift(distance)

    def boxes(self) -> Iterator[Box]:
        """Yield every box in it."""
        for child in self.children:
            yield from child.boxes()

    def inner(self) -> list[Group]:
        """Return the groups directly in it."""
        return [child for child in self.children if isinstance(child, Group)]

    def groups(self) -> Iterator[Group]:
        """Yield every group in it, outer ones first."""
        for child in self.inner():
            yield child
            yield from child.groups()

    def span_ranks(self) -> None:
        """Work out from which to which rank it and its groups reach."""
        for child in self.inner():
            child.span_ranks()
        self.first_rank = min(child.first_rank for child in self.children)
        self.last_rank = max(child.last_rank for child in self.children)

    def fit(self) -> None:
        """Draw the frame, and those in it, as close around the contents as they may be."""
        for child in self.inner():
            child.fit()
        low = min(child.low for child in self.children) - self.padding - self.label
        high = max(child.high for child in self.children) + self.padding
        self.high = max(high, min(self.high, low + self.least))
        self.low = min(low, self.high - self.least)


Item: TypeAlias = "Box | Group"


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """An edge as the boxes it passes, in the order of the ranks.

    The offsets say where it leaves the first box and reaches the last one, across, from their
    centres; None where any place on the side will do.
    """

    edge: Edge
    boxes: tuple[Box, ...]
    label: Box | None
    backward: bool  # the arrow points against the ranks
    first_offset: float | None = None
    last_offset: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Loop:
    """An edge from a box to itself; it runs through the box's tail."""

    edge: Edge
    box: Box
    source_offset: float
    target_offset: float
    label_offset: float
    label: tuple[float, float] | None  # its size along and across


def space_between(first: Item, second: Item) -> float:
    """Return the least space between two neighbours."""
    return max(first.gap, second.gap)


def link(chain: Chain) -> None:
    """Join the boxes of a chain; pieces that lines share are there once."""
    last = len(chain.boxes) - 1
    for index in range(last):
        low, high = chain.boxes[index], chain.boxes[index + 1]
        low_offset = (chain.first_offset or 0.0) if index == 0 else 0.0
        high_offset = (chain.last_offset or 0.0) if index + 1 == last else 0.0
        if any(known.high is high and known.low_offset == low_offset for known in low.after):
            continue
        joined = Link(low, high, low_offset, high_offset)
        low.after.append(joined)
        high.before.append(joined)
