"""Draw a graph as SVG: a self-contained picture for light and dark pages, or a part of a page."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

from composer.base.characters import is_safe
from composer.graph.diagram import EdgeKind, Graph, Mark, Problem, Vertex, VertexKind
from composer.graph.formats.theme import STYLE
from composer.graph.layout import Frame, Layout, Path, Point, Rectangle, Size
from composer.graph.layout.geometry import (
    EDGE_LINE_HEIGHT,
    HEAD_HEIGHT,
    HEXAGON_SLANT,
    LINE_HEIGHT,
    ROW_INDENT,
    label_size,
    text_width,
)

_TITLE_SIZE = 14.0
_TITLE_HEIGHT = 26.0


def render(graph: Graph, layout: Layout) -> str:
    """Return the picture as SVG text with a newline at the end."""
    return "\n".join(_lines(graph, layout)) + "\n"


def page_size(graph: Graph, layout: Layout) -> tuple[float, float]:
    """Return width and height of the whole picture, with its title."""
    width = max(layout.size.width, text_width(_title(graph), _TITLE_SIZE) + 32.0)
    return width, layout.size.height + _TITLE_HEIGHT


def _title(graph: Graph) -> str:
    return f"{graph.title}: {graph.view}"


def _lines(graph: Graph, layout: Layout) -> Iterator[str]:
    width, height = map(number, page_size(graph, layout))
    title = text(_title(graph))
    yield (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}"'
        f' width="{width}" height="{height}" role="img" aria-label="{title}">'
    )
    yield f"<title>{title}</title>"
    yield f"<style>{STYLE}</style>"
    yield markers()
    yield f'<rect class="page" width="{width}" height="{height}"/>'
    yield f'<text class="title" x="16" y="22">{title}</text>'
    yield f'<g transform="translate(0 {number(_TITLE_HEIGHT)})">'
    yield from contents(graph, layout)
    yield "</g>"
    yield "</svg>"


def contents(graph: Graph, layout: Layout) -> Iterator[str]:
    """Yield everything that is drawn, back to front."""
    blocks = {block.key for block in graph.blocks}
    for item in layout.frames:
        if not item.cluster.block:
            yield from _frame(item)
    for path in layout.paths:
        yield _edge(path)
    for item in layout.frames:
        if item.cluster.block:
            yield from _frame(item)
    for vertex in graph.vertices:
        draw = _port_row if vertex.cluster in blocks else _vertex
        yield from draw(vertex, layout.vertices[vertex.key])
    for path in layout.paths:
        if path.label is not None:
            yield from _label(path, path.label)


def markers() -> str:
    """Return arrow heads, one per color, since a marker cannot inherit the color of its line."""
    kinds = [*(kind.value for kind in EdgeKind), *Mark]
    return "<defs>" + "".join(map(_marker, kinds)) + "</defs>"


def _marker(kind: str) -> str:
    return (
        f'<marker id="head-{kind}" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="8"'
        ' markerHeight="8" markerUnits="userSpaceOnUse" orient="auto">'
        f'<path class="head {kind}" d="M0 1 L10 5 L0 9 z"/></marker>'
    )


def _frame(item: Frame) -> Iterator[str]:
    """Yield a frame with its label, or a block with its outline and head."""
    cluster, place = item.cluster, item.place
    if cluster.block:
        mark = _mark(cluster.problem)
        data = _data_attributes(cluster.key, "node", cluster.namespace)
        yield f"<g {data}>{_tooltip(cluster.problem)}"
        yield _rectangle(place, 6.0, f"shape node{mark}")
        y = place.top + HEAD_HEIGHT / 2 + 4.0
        yield f'<text x="{number(place.center.x)}" y="{number(y)}">{text(cluster.label)}</text>'
    else:
        yield f'<g class="cluster" data-cluster="{text(cluster.key)}">'
        yield _rectangle(place, 8.0, "frame")
        at = f'x="{number(place.left + 12.0)}" y="{number(place.top + 17.0)}"'
        yield f'<text class="frame-label" {at}>{text(cluster.label)}</text>'
    yield "</g>"


def _edge(path: Path) -> str:
    """Return the line of an edge, with its arrow head."""
    edge = path.edge
    begin, *others = path.points
    curves = " ".join(
        "C" + " ".join(map(_point, others[index : index + 3])) for index in range(0, len(others), 3)
    )
    mark = _mark(edge.problem)
    between = " between" if path.is_between_parts else ""
    head = edge.problem.mark if edge.problem else edge.kind.value
    return (
        f'<path class="edge {edge.kind}{mark}{between}" data-edge="{text(edge.key)}"'
        f' data-kind="{edge.kind}" data-source="{text(edge.source)}"'
        f' data-target="{text(edge.target)}" marker-end="url(#head-{head})"'
        f' d="M{_point(begin)} {curves}">{_tooltip(edge.problem)}</path>'
    )


def _label(path: Path, middle: Point) -> Iterator[str]:
    """Yield the label of an edge on an opaque background."""
    lines = path.edge.lines
    yield f'<g class="label" data-label="{text(path.edge.key)}">'
    yield _rectangle(Rectangle(middle, label_size(path.edge)), 3.0, "label-back")
    top = middle.y - (len(lines) - 1) * EDGE_LINE_HEIGHT / 2 + 3.5
    for index, line_text in enumerate(lines):
        y = top + index * EDGE_LINE_HEIGHT
        at = f'x="{number(middle.x)}" y="{number(y)}"'
        yield f'<text class="edge-label" {at}>{text(line_text)}</text>'
    yield "</g>"


def _vertex(item: Vertex, place: Rectangle) -> Iterator[str]:
    """Yield a vertex: its shape and the lines of text in it."""
    mark = _mark(item.problem)
    yield f"<g {_data_attributes(item.key, item.kind, item.namespace)}>{_tooltip(item.problem)}"
    yield _shape(item.kind, place, f"shape {item.kind}{mark}")
    top = place.center.y - (len(item.lines) - 1) * LINE_HEIGHT / 2 + 4.0
    for index, line_text in enumerate(item.lines):
        faint = ' class="faint"' if index else ""
        y = top + index * LINE_HEIGHT
        yield f'<text{faint} x="{number(place.center.x)}" y="{number(y)}">{text(line_text)}</text>'
    yield "</g>"


def _port_row(item: Vertex, place: Rectangle) -> Iterator[str]:
    """Yield a port as a row of its block: its name on the left, its kind on the right."""
    mark = _mark(item.problem)
    name, *others = item.lines
    y = number(place.center.y + 4.0)
    yield f"<g {_data_attributes(item.key, item.kind, item.namespace)}>{_tooltip(item.problem)}"
    yield _rectangle(place, 0.0, f"shape {item.kind}{mark}")
    left, right = number(place.left + ROW_INDENT), place.left + place.size.width - ROW_INDENT
    yield f'<text class="row" x="{left}" y="{y}">{text(name)}</text>'
    for line_text in others:
        yield f'<text class="row-end" x="{number(right)}" y="{y}">{text(line_text)}</text>'
    yield "</g>"


def number(value: float) -> str:
    """Format a coordinate with one decimal: short, and the same on every machine."""
    written = f"{value:.1f}".removesuffix(".0")
    return "0" if written == "-0" else written


def text(line_text: str) -> str:
    """Escape a text for XML and HTML."""
    return escape(
        "".join(letter if _is_shown(letter) else "\ufffd" for letter in line_text), quote=True
    )


def _is_shown(letter: str) -> bool:
    """Return whether XML allows the character (XML 1.0, section 2.2) and it is visible."""
    return letter == "\r" or is_safe(letter)


def _data_attributes(key: str, kind: str, namespace: str) -> str:
    return f'data-key="{text(key)}" data-kind="{kind}" data-namespace="{text(namespace)}"'


def _shape(kind: VertexKind, place: Rectangle, classes: str) -> str:
    if kind is VertexKind.SERVICE:
        return f'<polygon class="{classes}" points="{_hexagon(place)}"/>'
    is_round = kind in (VertexKind.TOPIC, VertexKind.FRAME)
    radius = place.size.height / 2 if is_round else 6.0
    outline = _rectangle(place, radius, classes)
    if kind is VertexKind.ACTION:
        inner = Rectangle(place.center, Size(place.size.width - 6.0, place.size.height - 6.0))
        return outline + _rectangle(inner, 4.0, classes)
    return outline


def _rectangle(place: Rectangle, radius: float, classes: str) -> str:
    round_corners = f' rx="{number(radius)}"' if radius else ""
    return (
        f'<rect class="{classes}" x="{number(place.left)}" y="{number(place.top)}"{round_corners}'
        f' width="{number(place.size.width)}" height="{number(place.size.height)}"/>'
    )


def _hexagon(place: Rectangle) -> str:
    x, y = place.center.x, place.center.y
    half, high = place.size.width / 2, place.size.height / 2
    corners = [
        Point(x - half, y),
        Point(x - half + HEXAGON_SLANT, y - high),
        Point(x + half - HEXAGON_SLANT, y - high),
        Point(x + half, y),
        Point(x + half - HEXAGON_SLANT, y + high),
        Point(x - half + HEXAGON_SLANT, y + high),
    ]
    return " ".join(map(_point, corners))


def _tooltip(problem: Problem | None) -> str:
    return f"<title>{text(problem.text)}</title>" if problem is not None else ""


def _mark(problem: Problem | None) -> str:
    """Return the class that marks a part, after those that it has."""
    return f" {problem.mark}" if problem is not None else ""


def _point(point: Point) -> str:
    return f"{number(point.x)},{number(point.y)}"
