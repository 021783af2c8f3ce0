"""Render a graph as a self-contained SVG picture for light and dark pages."""

from __future__ import annotations

from collections.abc import Iterator

from composer.graph.diagram import Graph
from composer.graph.formats import svg_elements
from composer.graph.formats.theme import STYLE
from composer.graph.layout import Layout, arrange
from composer.graph.measure import sizes, text_width

_TITLE_SIZE = 14.0
_TITLE_HEIGHT = 26.0


def render(graph: Graph, layout: Layout | None = None) -> str:
    """Return the picture as SVG text with a newline at the end; by default with our layout."""
    found = arrange(graph, sizes(graph)) if layout is None else layout
    return "\n".join(_lines(graph, found)) + "\n"


def page_size(graph: Graph, layout: Layout) -> tuple[float, float]:
    """Return width and height of the whole picture, with its title."""
    width = max(layout.size.width, text_width(_title(graph), _TITLE_SIZE) + 32.0)
    return width, layout.size.height + _TITLE_HEIGHT


def _title(graph: Graph) -> str:
    return f"{graph.title}: {graph.view}"


def _lines(graph: Graph, layout: Layout) -> Iterator[str]:
    width, height = map(svg_elements.number, page_size(graph, layout))
    title = svg_elements.text(_title(graph))
    yield (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}"'
        f' width="{width}" height="{height}" role="img" aria-label="{title}">'
    )
    yield f"<title>{title}</title>"
    yield f"<style>{STYLE}</style>"
    yield svg_elements.markers()
    yield f'<rect class="page" width="{width}" height="{height}"/>'
    yield f'<text class="title" x="16" y="22">{title}</text>'
    yield f'<g transform="translate(0 {svg_elements.number(_TITLE_HEIGHT)})">'
    yield from contents(graph, layout)
    yield "</g>"
    yield "</svg>"


def contents(graph: Graph, layout: Layout) -> Iterator[str]:
    """Yield everything that is drawn, back to front."""
    blocks = {cluster.key for cluster in graph.clusters if cluster.block}
    for item in layout.frames:
        if not item.cluster.block:
            yield from svg_elements.frame(item)
    for path in layout.paths:
        yield svg_elements.line(path)
    for item in layout.frames:
        if item.cluster.block:
            yield from svg_elements.frame(item)
    for vertex in graph.vertices:
        draw = svg_elements.row if vertex.cluster in blocks else svg_elements.vertex
        yield from draw(vertex, layout.vertices[vertex.key])
    for path in layout.paths:
        if path.label is not None:
            yield from svg_elements.label(path, path.label)
