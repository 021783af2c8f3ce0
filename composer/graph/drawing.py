"""The parts of a picture as SVG elements: what a vertex, an edge, a frame looks like."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

from composer.graph.layout import Frame, Path, Place, Point, Size
from composer.graph.measure import (
    EDGE_LINE_HEIGHT,
    HEAD_HEIGHT,
    HEXAGON_SLANT,
    LINE_HEIGHT,
    ROW_INDENT,
    label_size,
)
from composer.graph.picture import Kind, Line, Vertex


def markers() -> str:
    """Return arrow heads, one for each colour: a marker cannot take its line's."""
    kinds = [*(kind.value for kind in Line), "wrong"]
    return "<defs>" + "".join(map(_marker, kinds)) + "</defs>"


def _marker(kind: str) -> str:
    return (
        f'<marker id="head-{kind}" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="8"'
        ' markerHeight="8" markerUnits="userSpaceOnUse" orient="auto">'
        f'<path class="head {kind}" d="M0 1 L10 5 L0 9 z"/></marker>'
    )


def frame(item: Frame) -> Iterator[str]:
    """Yield a frame and its name; of a block, its outline and its head."""
    cluster, place = item.cluster, item.place
    if cluster.block:
        wrong = " wrong" if cluster.wrong else ""
        yield f"<g {_known(cluster.key, 'node', cluster.namespace)}>{_tooltip(cluster.wrong)}"
        yield _rectangle(place, 6.0, f"shape node{wrong}")
        y = place.top + HEAD_HEIGHT / 2 + 4.0
        yield f'<text x="{number(place.center.x)}" y="{number(y)}">{text(cluster.label)}</text>'
    else:
        yield f'<g class="cluster" data-cluster="{text(cluster.key)}">'
        yield _rectangle(place, 8.0, "frame")
        at = f'x="{number(place.left + 12.0)}" y="{number(place.top + 17.0)}"'
        yield f'<text class="frame-label" {at}>{text(cluster.label)}</text>'
    yield "</g>"


def line(path: Path) -> str:
    """Return the line of an edge, with its arrow head."""
    edge = path.edge
    begin, *others = path.points
    curves = " ".join(
        "C" + " ".join(map(_point, others[index : index + 3])) for index in range(0, len(others), 3)
    )
    wrong = " wrong" if edge.wrong else ""
    head = "wrong" if edge.wrong else edge.kind.value
    return (
        f'<path class="edge {edge.kind}{wrong}" data-edge="{text(edge.key)}"'
        f' data-kind="{edge.kind}" data-source="{text(edge.source)}"'
        f' data-target="{text(edge.target)}" marker-end="url(#head-{head})"'
        f' d="M{_point(begin)} {curves}">{_tooltip(edge.wrong)}</path>'
    )


def label(path: Path, middle: Point) -> Iterator[str]:
    """Yield what stands at an edge, on something that keeps it readable."""
    lines = path.edge.lines
    yield f'<g class="label" data-label="{text(path.edge.key)}">'
    yield _rectangle(Place(middle, label_size(path.edge)), 3.0, "label-back")
    top = middle.y - (len(lines) - 1) * EDGE_LINE_HEIGHT / 2 + 3.5
    for index, said in enumerate(lines):
        y = top + index * EDGE_LINE_HEIGHT
        at = f'x="{number(middle.x)}" y="{number(y)}"'
        yield f'<text class="edge-label" {at}>{text(said)}</text>'
    yield "</g>"


def vertex(item: Vertex, place: Place) -> Iterator[str]:
    """Yield a vertex: its shape and the lines of text in it."""
    wrong = " wrong" if item.wrong else ""
    yield f"<g {_known(item.key, item.kind, item.namespace)}>{_tooltip(item.wrong)}"
    yield _shape(item.kind, place, f"shape {item.kind}{wrong}")
    top = place.center.y - (len(item.lines) - 1) * LINE_HEIGHT / 2 + 4.0
    for index, said in enumerate(item.lines):
        faint = ' class="faint"' if index else ""
        y = top + index * LINE_HEIGHT
        yield f'<text{faint} x="{number(place.center.x)}" y="{number(y)}">{text(said)}</text>'
    yield "</g>"


def row(item: Vertex, place: Place) -> Iterator[str]:
    """Yield a port in its block: the name on the left, what it is on the right."""
    wrong = " wrong" if item.wrong else ""
    name, *others = item.lines
    y = number(place.center.y + 4.0)
    yield f"<g {_known(item.key, item.kind, item.namespace)}>{_tooltip(item.wrong)}"
    yield _rectangle(place, 0.0, f"shape {item.kind}{wrong}")
    left, right = number(place.left + ROW_INDENT), place.left + place.size.width - ROW_INDENT
    yield f'<text class="row" x="{left}" y="{y}">{text(name)}</text>'
    for said in others:
        yield f'<text class="row-end" x="{number(right)}" y="{y}">{text(said)}</text>'
    yield "</g>"


def number(value: float) -> str:
    """Write a coordinate with a tenth of a pixel: short, and the same on every machine."""
    written = f"{value:.1f}".removesuffix(".0")
    return "0" if written == "-0" else written


def text(said: str) -> str:
    """Write a text so that no reader of XML or HTML takes it for more than that."""
    return escape("".join(letter if _is_shown(letter) else "\ufffd" for letter in said), quote=True)


def _is_shown(letter: str) -> bool:
    """Say whether XML has the character at all (Extensible Markup Language 1.0, 2.2)."""
    return letter in "\t\n\r" or (letter >= " " and letter not in "\ufffe\uffff")


def _known(key: str, kind: str, namespace: str) -> str:
    return f'data-key="{text(key)}" data-kind="{kind}" data-namespace="{text(namespace)}"'


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
    round_corners = f' rx="{number(radius)}"' if radius else ""
    return (
        f'<rect class="{classes}" x="{number(place.left)}" y="{number(place.top)}"{round_corners}'
        f' width="{number(place.size.width)}" height="{number(place.size.height)}"/>'
    )


def _hexagon(place: Place) -> str:
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


def _tooltip(said: str) -> str:
    return f"<title>{text(said)}</title>" if said else ""


def _point(point: Point) -> str:
    return f"{number(point.x)},{number(point.y)}"
