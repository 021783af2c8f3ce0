"""The result of a layout, for renderers."""

from __future__ import annotations

from dataclasses import replace

from composer.base.fast_dataclass import dataclass
from composer.graph.diagram import Cluster, Edge


@dataclass(frozen=True, slots=True)
class Point:
    """A point; x to the right, y down."""

    x: float
    y: float

    def moved(self, by: Point) -> Point:
        """Return the point moved by an offset."""
        return Point(self.x + by.x, self.y + by.y)


@dataclass(frozen=True, slots=True)
class Size:
    """The size of a rectangle."""

    width: float
    height: float


@dataclass(frozen=True, slots=True)
class Rectangle:
    """A rectangle with its center and size."""

    center: Point
    size: Size

    @property
    def left(self) -> float:
        """The x of its left side."""
        return self.center.x - self.size.width / 2

    @property
    def top(self) -> float:
        """The y of its upper side."""
        return self.center.y - self.size.height / 2

    def row(self, below_middle: float, height: float) -> Rectangle:
        """Return a row of full width, at an offset below the middle."""
        center = Point(self.center.x, self.center.y + below_middle)
        return Rectangle(center, Size(self.size.width, height))

    def moved(self, by: Point) -> Rectangle:
        """Return the rectangle moved by an offset."""
        return Rectangle(self.center.moved(by), self.size)


@dataclass(frozen=True, slots=True)
class Frame:
    """A cluster and its rectangle."""

    cluster: Cluster
    place: Rectangle


@dataclass(frozen=True, slots=True)
class Path:
    """An edge as cubic Bézier curves: a start, then three points for each curve.

    It begins at the edge's source. ``label`` is the center of the label, if it has one.
    ``is_between_parts`` says that the line may cross boxes.
    """

    edge: Edge
    points: tuple[Point, ...]
    label: Point | None
    is_between_parts: bool = False

    def moved(self, by: Point) -> Path:
        """Return the path moved by an offset."""
        return replace(
            self,
            points=tuple(point.moved(by) for point in self.points),
            label=None if self.label is None else self.label.moved(by),
        )


@dataclass(frozen=True, slots=True)
class Layout:
    """The positions of everything, from (0, 0) to ``size``; vertices by key."""

    size: Size
    vertices: dict[str, Rectangle]
    frames: tuple[Frame, ...]  # outer ones first
    paths: tuple[Path, ...]

    def moved(self, by: Point) -> Layout:
        """Return the layout moved by an offset, and enlarged by it."""
        return Layout(
            size=Size(self.size.width + by.x, self.size.height + by.y),
            vertices={key: place.moved(by) for key, place in self.vertices.items()},
            frames=tuple(Frame(frame.cluster, frame.place.moved(by)) for frame in self.frames),
            paths=tuple(path.moved(by) for path in self.paths),
        )
