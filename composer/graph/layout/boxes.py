"""The working data of the layout: boxes on ranks, in nested groups.

"Along" is the axis of the arrows, "across" the other axis; only ``Axes`` knows x and y.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from typing import TypeAlias

from composer.base.fast_dataclass import dataclass
from composer.graph.diagram import Edge
from composer.graph.layout.geometry import Point, Size

#: Space on a rank between boxes, and between bends of edges.
BOX_GAP = 18.0
BEND_GAP = 8.0
#: Space between a frame and its contents, and for its label.
FRAME_PADDING = 14.0
FRAME_LABEL = 20.0
#: How far a self-loop reaches out of its box, and the space before its label.
LOOP_BOW = 30.0
LOOP_LABEL_GAP = 4.0


@dataclass(slots=True, eq=False)
class Link:
    """A segment of an edge, from a box to one on the next rank.

    The offsets of its ends across are relative to the centers of the boxes.
    """

    low: Box
    high: Box
    low_offset: float = 0.0
    high_offset: float = 0.0


@dataclass(slots=True, eq=False)
class Box:
    """A vertex, the bend of a long edge, or an edge's label."""

    rank: int
    along: float  # size along the arrows
    across: float
    gap: float = BOX_GAP
    tail: float = 0.0  # the part of ``along`` at its end for self-loops
    position: float = 0.0  # of its center, across
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
        """The lower bound, across."""
        return self.position - self.across / 2

    @property
    def high(self) -> float:
        """The upper bound, across."""
        return self.position + self.across / 2

    def shift(self, distance: float) -> None:
        """Move the box across."""
        self.position += distance

    def boxes(self) -> Iterator[Box]:
        """Yield the box itself."""
        yield self


@dataclass(slots=True, eq=False)
class Group:
    """A frame with its contents in order across; the root has ``padding`` 0."""

    padding: float = FRAME_PADDING
    label: float = 0.0  # space for the label across, at the start of the frame
    label_along: float = 0.0  # space for the label along
    least: float = 0.0  # minimum size across
    least_along: float = 0.0
    children: list[Item] = field(default_factory=list)
    low: float = 0.0
    high: float = 0.0
    first_rank: int = 0
    last_rank: int = 0
    gap: float = BOX_GAP

    def shift(self, distance: float) -> None:
        """Move the group and its contents across."""
        self.low += distance
        self.high += distance
        for child in self.children:
            child.shift(distance)

    def boxes(self) -> Iterator[Box]:
        """Yield all boxes of the group."""
        for child in self.children:
            yield from child.boxes()

    def inner(self) -> list[Group]:
        """Return the direct child groups."""
        return [child for child in self.children if isinstance(child, Group)]

    def groups(self) -> Iterator[Group]:
        """Yield all nested groups, outer ones first."""
        for child in self.inner():
            yield child
            yield from child.groups()

    def span_ranks(self) -> None:
        """Compute the first and last rank of the group and its child groups."""
        for child in self.inner():
            child.span_ranks()
        self.first_rank = min(child.first_rank for child in self.children)
        self.last_rank = max(child.last_rank for child in self.children)

    def fit(self) -> None:
        """Fit the frame and nested frames around their contents."""
        for child in self.inner():
            child.fit()
        low = min(child.low for child in self.children) - self.padding - self.label
        high = max(child.high for child in self.children) + self.padding
        self.high = max(high, min(self.high, low + self.least))
        self.low = min(low, self.high - self.least)


Item: TypeAlias = "Box | Group"


@dataclass(frozen=True, slots=True, eq=False)
class EdgeChain:
    """An edge as the boxes that it passes, in the order of the ranks.

    The offsets are its ends across, relative to the centers of the first and last box; None for any
    position.
    """

    edge: Edge
    boxes: tuple[Box, ...]
    label: Box | None
    backward: bool  # the arrow points against the ranks
    first_offset: float | None = None
    last_offset: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class SelfLoop:
    """An edge from a box to itself, drawn in the tail of the box."""

    edge: Edge
    box: Box
    source_offset: float
    target_offset: float
    label_offset: float
    label: tuple[float, float] | None  # its size along and across


def space_between(first: Item, second: Item) -> float:
    """Return the minimum space between two neighbors."""
    return max(first.gap, second.gap)


def link(chain: EdgeChain) -> None:
    """Link the boxes of a chain; shared segments are added once."""
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


@dataclass(frozen=True, slots=True)
class Axes:
    """The arrows run along x, or along y if ``down``."""

    down: bool

    def of_size(self, size: Size) -> tuple[float, float]:
        """Return the size along and across."""
        return (size.height, size.width) if self.down else (size.width, size.height)

    def size(self, along: float, across: float) -> Size:
        """Return the size with these two extents."""
        return Size(across, along) if self.down else Size(along, across)

    def point(self, along: float, across: float) -> Point:
        """Return the point with these two coordinates."""
        return Point(across, along) if self.down else Point(along, across)
