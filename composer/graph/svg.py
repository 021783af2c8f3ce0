"""A graph as a self-contained SVG picture, for light and dark pages, laid out by ``layout``."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

from composer.graph.layout import Frame, Layout, Path, Place, Point, Size, Sizes, arrange
from composer.graph.picture import Graph, Kind, Vertex
from composer.graph.text_size import text_width
from composer.graph.theme import STYLE

_TITLE_SIZE = 14.0
_TITLE_HEIGHT = 26.0
_FONT_SIZE = 12.0
_SMALL = 10.0
_LINE_HEIGHT = 15.0
_PADDING = Size(14.0, 8.0)
_HEXAGON_SLANT = 12.0


def render(graph: Graph) -> str:
    """Return the picture as SVG text with a newline at the end."""
    return "\n".join(_lines(graph, arrange(graph, sizes(graph)))) + "\n"


def sizes(graph: Graph) -> Sizes:
    """Return how much room the texts of a graph need."""
    return Sizes(
        vertices={vertex.key: _vertex_size(vertex) for vertex in graph.vertices},
        labels={
            number: _label_size(edge.lines) for number, edge in enumerate(graph.edges) if edge.lines
        },
        frames={
            cluster.key: Size(text_width(cluster.label, _SMALL), _LINE_HEIGHT)
            for cluster in graph.clusters
        },
    )


def _vertex_size(vertex: Vertex) -> Size:
    first, *others = vertex.lines
    width = max([text_width(first, _FONT_SIZE), *(text_width(line, _SMALL) for line in others)])
    slant = _HEXAGON_SLANT if vertex.kind in (Kind.SERVICE, Kind.TOPIC) else 0.0
    return Size(
        round(width + 2 * (_PADDING.width + slant / 2)),
        len(vertex.lines) * _LINE_HEIGHT + 2 * _PADDING.height,
    )


def _label_size(lines: tuple[str, ...]) -> Size:
    width = max(text_width(line, _SMALL) for line in lines)
    return Size(round(width + 8.0), len(lines) * (_SMALL + 3.0) + 4.0)


def _lines(graph: Graph, layout: Layout) -> Iterator[str]:
    title = f"{graph.title}: {graph.view}"
    width = max(layout.size.width, text_width(title, _TITLE_SIZE) + 32.0)
    height = layout.size.height + _TITLE_HEIGHT
    yield (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_n(width)} {_n(height)}"'
        f' width="{_n(width)}" height="{_n(height)}" role="img" aria-label="{_text(title)}">'
    )
    yield f"<title>{_text(title)}</title>"
    yield f"<style>{STYLE}</style>"
    yield _markers()
    yield f'<rect class="page" width="{_n(width)}" height="{_n(height)}"/>'
    yield f'<text class="title" x="16" y="22">{_text(title)}</text>'
    yield f'<g transform="translate(0 {_n(_TITLE_HEIGHT)})">'
    for frame in layout.frames:
        yield from _frame(frame)
    for path in layout.paths:
        yield _path(path)
    for vertex, place in layout.vertices:
        yield from _vertex(vertex, place)
    for path in layout.paths:
        if path.label is not None:
            yield from _label(path, path.label)
    yield "</g>"
    yield "</svg>"


def _markers() -> str:
    """Return arrow heads, one for each colour: a marker cannot take its line's."""
    kinds = ["topic", "service", "action", "dependency", "transition", "wrong"]
    return "<defs>" + "".join(map(_marker, kinds)) + "</defs>"


def _marker(kind: str) -> str:
    return (
        f'<marker id="head-{kind}" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="8"'
        ' markerHeight="8" markerUnits="userSpaceOnUse" orient="auto">'
        f'<path class="head {kind}" d="M0 1 L10 5 L0 9 z"/></marker>'
    )


def _frame(frame: Frame) -> Iterator[str]:
    place = frame.place
    yield (
        f'<rect class="frame" x="{_n(place.left)}" y="{_n(place.top)}" rx="8"'
        f' width="{_n(place.size.width)}" height="{_n(place.size.height)}"/>'
    )
    yield (
        f'<text class="frame-label" x="{_n(place.left + 12.0)}" y="{_n(place.top + 17.0)}">'
        f"{_text(frame.cluster.label)}</text>"
    )


def _path(path: Path) -> str:
    begin, *others = path.points
    curves = " ".join(
        "C" + " ".join(map(_point, others[index : index + 3])) for index in range(0, len(others), 3)
    )
    kind = path.edge.kind.value
    wrong = " wrong" if path.edge.wrong else ""
    head = "wrong" if path.edge.wrong else kind
    return (
        f'<path class="edge {kind}{wrong}" marker-end="url(#head-{head})"'
        f' d="M{_point(begin)} {curves}">{_tooltip(path.edge.wrong)}</path>'
    )


def _vertex(vertex: Vertex, place: Place) -> Iterator[str]:
    wrong = " wrong" if vertex.wrong else ""
    yield f'<g data-key="{_text(vertex.key)}">{_tooltip(vertex.wrong)}'
    yield _shape(vertex.kind, place, f"shape {vertex.kind}{wrong}")
    top = place.center.y - (len(vertex.lines) - 1) * _LINE_HEIGHT / 2 + 4.0
    for number, line in enumerate(vertex.lines):
        faint = ' class="faint"' if number else ""
        y = top + number * _LINE_HEIGHT
        yield f'<text{faint} x="{_n(place.center.x)}" y="{_n(y)}">{_text(line)}</text>'
    yield "</g>"


def _shape(kind: Kind, place: Place, classes: str) -> str:
    if kind is Kind.SERVICE:
        return f'<polygon class="{classes}" points="{_hexagon(place)}"/>'
    radius = place.size.height / 2 if kind is Kind.TOPIC else 6.0
    outline = _rectangle(place, radius, classes)
    if kind is Kind.ACTION:
        inner = Place(place.center, Size(place.size.width - 6.0, place.size.height - 6.0))
        return outline + _rectangle(inner, 4.0, classes)
    return outline


def _rectangle(place: Place, radius: float, classes: str) -> str:
    return (
        f'<rect class="{classes}" x="{_n(place.left)}" y="{_n(place.top)}" rx="{_n(radius)}"'
        f' width="{_n(place.size.width)}" height="{_n(place.size.height)}"/>'
    )


def _hexagon(place: Place) -> str:
    x, y = place.center.x, place.center.y
    half, high = place.size.width / 2, place.size.height / 2
    corners = [
        Point(x - half, y),
        Point(x - half + _HEXAGON_SLANT, y - high),
        Point(x + half - _HEXAGON_SLANT, y - high),
        Point(x + half, y),
        Point(x + half - _HEXAGON_SLANT, y + high),
        Point(x - half + _HEXAGON_SLANT, y + high),
    ]
    return " ".join(map(_point, corners))


def _label(path: Path, middle: Point) -> Iterator[str]:
    size = _label_size(path.edge.lines)
    back = Place(middle, size)
    yield (
        f'<rect class="label-back" x="{_n(back.left)}" y="{_n(back.top)}"'
        f' width="{_n(size.width)}" height="{_n(size.height)}" rx="3"/>'
    )
    step = _SMALL + 3.0
    top = middle.y - (len(path.edge.lines) - 1) * step / 2 + 3.5
    for number, line in enumerate(path.edge.lines):
        y = top + number * step
        yield f'<text class="edge-label" x="{_n(middle.x)}" y="{_n(y)}">{_text(line)}</text>'


def _tooltip(text: str) -> str:
    return f"<title>{_text(text)}</title>" if text else ""


def _point(point: Point) -> str:
    return f"{_n(point.x)},{_n(point.y)}"


def _n(value: float) -> str:
    """Write a coordinate with a tenth of a pixel: short, and the same on every machine."""
    return f"{value:.1f}".removesuffix(".0")


def _text(text: str) -> str:
    return escape(text, quote=True)
