"""Which of x and y the arrows follow."""

from __future__ import annotations

from dataclasses import dataclass

from composer.graph.layout.result import Point, Size


@dataclass(frozen=True, slots=True)
class Axes:
    """The arrows run along x, or along y where ``down``."""

    down: bool

    def of_size(self, size: Size) -> tuple[float, float]:
        """Return the size along and across."""
        return (size.height, size.width) if self.down else (size.width, size.height)

    def size(self, along: float, across: float) -> Size:
        """Return the size of which the two extents are given."""
        return Size(across, along) if self.down else Size(along, across)

    def point(self, along: float, across: float) -> Point:
        """Return the point of which the two coordinates are given."""
        return Point(across, along) if self.down else Point(along, across)
