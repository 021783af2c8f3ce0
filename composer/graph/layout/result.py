"""A finished layout: what a renderer draws."""

from __future__ import annotations

from dataclasses import dataclass

from composer.graph.picture import Cluster, Edge, Vertex


@dataclass(frozen=True, slots=True)
class Point:
    """A point; x to the right, y down."""

    x: float
    y: float


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


@dataclass(frozen=True, slots=True)
class Layout:
    """Everything in its place, from (0, 0) to ``size``."""

    size: Size
    vertices: tuple[tuple[Vertex, Place], ...]
    frames: tuple[Frame, ...]  # outer ones first
    paths: tuple[Path, ...]
