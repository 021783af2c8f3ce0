"""A finished layout: what a renderer draws."""

from __future__ import annotations

from dataclasses import dataclass, replace

from composer.graph.picture import Cluster, Edge


@dataclass(frozen=True, slots=True)
class Point:
    """A point; x to the right, y down."""

    x: float
    y: float

    def moved(self, by: Point) -> Point:
        """Return the point so much further."""
        return Point(self.x + by.x, self.y + by.y)


@dataclass(frozen=True, slots=True)
class Size:
    """The size of a rectangle."""

    width: float
    height: float


@dataclass(frozen=True, slots=True)
class Place:
    """A rectangle by its centre."""

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

    def row(self, below_middle: float, height: float) -> Place:
        """Return the row of it, over all its width, that is so far below its middle."""
        center = Point(self.center.x, self.center.y + below_middle)
        return Place(center, Size(self.size.width, height))

    def moved(self, by: Point) -> Place:
        """Return the rectangle so much further."""
        return Place(self.center.moved(by), self.size)


@dataclass(frozen=True, slots=True)
class Frame:
    """A cluster and the rectangle around what it holds."""

    cluster: Cluster
    place: Place


@dataclass(frozen=True, slots=True)
class Path:
    """An edge as cubic Bézier curves: a start, then three points for each curve.

    It begins at the edge's source. ``label`` is the middle of the label, where there is one.
    """

    edge: Edge
    points: tuple[Point, ...]
    label: Point | None

    def moved(self, by: Point) -> Path:
        """Return the path so much further."""
        return replace(
            self,
            points=tuple(point.moved(by) for point in self.points),
            label=None if self.label is None else self.label.moved(by),
        )


@dataclass(frozen=True, slots=True)
class Layout:
    """Everything in its place, from (0, 0) to ``size``. Vertices are named by their keys."""

    size: Size
    vertices: dict[str, Place]
    frames: tuple[Frame, ...]  # outer ones first
    paths: tuple[Path, ...]

    def moved(self, by: Point) -> Layout:
        """Return the layout with everything so much further, and as much bigger."""
        return Layout(
            size=Size(self.size.width + by.x, self.size.height + by.y),
            vertices={key: place.moved(by) for key, place in self.vertices.items()},
            frames=tuple(Frame(frame.cluster, frame.place.moved(by)) for frame in self.frames),
            paths=tuple(path.moved(by) for path in self.paths),
        )
