"""Positions and sizes: the result of a layout, and how much room texts need."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator, Mapping
from dataclasses import replace

from composer.base.fast_dataclass import dataclass
from composer.graph.diagram import Cluster, Edge, Graph, Vertex, VertexKind

FONT_SIZE = 12.0
SMALL = 10.0
LINE_HEIGHT = 15.0
EDGE_LINE_HEIGHT = SMALL + 3.0
ROW_HEIGHT = 20.0
#: The head of a block with its label.
HEAD_HEIGHT = 24.0
ROW_INDENT = 10.0
HEXAGON_SLANT = 12.0
_PADDING, _PADDING_ABOVE = 14.0, 8.0
_ROW_GAP = 16.0
#: Shapes whose ends are not straight.
_SLANTED = (VertexKind.SERVICE, VertexKind.TOPIC, VertexKind.FRAME)
#: Widths of Helvetica in thousandths of the font size (Adobe font metrics), by character.
_NARROW = dict.fromkeys("fijlt.,:;!|'`Iƒ/\\[]() ", 300) | dict.fromkeys("ijl'|", 230)
_WIDE = dict.fromkeys("mwMW%@", 900) | dict.fromkeys("ABCDEGHKNOPQRSTUVXYZ&", 710)
_WIDTHS = _NARROW | _WIDE
_USUAL = 560
_FULL = 1000
#: Extra width so that estimates for Helvetica fit wider fonts such as DejaVu Sans too.
_SAFETY = 1.14


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


@dataclass(frozen=True, slots=True)
class Sizes:
    """Sizes of vertices and clusters by key, and of edge labels by the key of the edge.

    ``frames`` are the sizes of cluster labels, ``blocks`` the sizes of whole blocks, and ``rows``
    the offsets of vertices from the middle of their block.
    """

    vertices: Mapping[str, Size]
    labels: Mapping[str, Size]
    frames: Mapping[str, Size]
    blocks: Mapping[str, Size]
    rows: Mapping[str, float]

    def of_box(self, key: str) -> Size:
        """Return the size of a block, or of a vertex outside blocks."""
        return self.blocks.get(key) or self.vertices[key]


def measure(graph: Graph) -> Sizes:
    """Return the sizes that the texts of a graph need."""
    blocks = dict(_blocks(graph))
    return Sizes(
        vertices={
            vertex.key: _row_size(vertex) if vertex.cluster in blocks else _vertex_size(vertex)
            for vertex in graph.vertices
        },
        labels={edge.key: label_size(edge) for edge in graph.edges if edge.lines},
        frames={
            cluster.key: Size(text_width(cluster.label, SMALL), LINE_HEIGHT)
            for cluster in graph.clusters
        },
        blocks={key: _block_size(cluster, ports) for key, (cluster, ports) in blocks.items()},
        rows={
            port.key: HEAD_HEIGHT / 2 + (index - (len(ports) - 1) / 2) * ROW_HEIGHT
            for _, ports in blocks.values()
            for index, port in enumerate(ports)
        },
    )


def label_size(edge: Edge) -> Size:
    """Return the size of an edge's label."""
    width = max(text_width(line, SMALL) for line in edge.lines)
    return Size(round(width + 8.0), len(edge.lines) * EDGE_LINE_HEIGHT + 4.0)


def _blocks(graph: Graph) -> Iterator[tuple[str, tuple[Cluster, list[Vertex]]]]:
    ports: dict[str, list[Vertex]] = {}
    for vertex in graph.vertices:
        ports.setdefault(vertex.cluster, []).append(vertex)
    for block in graph.blocks:
        if block.key in ports:
            yield block.key, (block, ports[block.key])


def _vertex_size(vertex: Vertex) -> Size:
    first, *others = vertex.lines
    width = max([text_width(first, FONT_SIZE), *(text_width(line, SMALL) for line in others)])
    slant = HEXAGON_SLANT if vertex.kind in _SLANTED else 0.0
    return Size(
        round(width + 2 * (_PADDING + slant / 2)),
        len(vertex.lines) * LINE_HEIGHT + 2 * _PADDING_ABOVE,
    )


def _row_size(vertex: Vertex) -> Size:
    first, *others = vertex.lines
    width = text_width(first, FONT_SIZE) + sum(
        _ROW_GAP + text_width(line, SMALL) for line in others
    )
    return Size(round(width + 2 * ROW_INDENT), ROW_HEIGHT)


def _block_size(cluster: Cluster, ports: list[Vertex]) -> Size:
    head = text_width(cluster.label, FONT_SIZE) + 2 * _PADDING
    widest = max(_row_size(port).width for port in ports)
    return Size(round(max(head, widest)), HEAD_HEIGHT + len(ports) * ROW_HEIGHT)


def text_width(text: str, size: float) -> float:
    """Return the width of one line of text, in the unit of the font's ``size``."""
    return sum(map(_thousandths, text)) * size * _SAFETY / 1000.0


def _thousandths(character: str) -> int:
    width = _WIDTHS.get(character)
    if width is not None:
        return width
    if unicodedata.combining(character):
        return 0
    wide = unicodedata.east_asian_width(character) in {"W", "F"}
    return _FULL if wide else _USUAL
