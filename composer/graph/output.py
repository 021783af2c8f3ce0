"""Render diagrams in a format."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from composer.diagram_options import Engine, Format
from composer.graph.diagram import Graph
from composer.graph.engines import lay_out
from composer.graph.formats import dot, html, json, mermaid, png, svg

__all__ = ["Engine", "Format", "render"]


_TEXTS: dict[Format, Callable[[Graph], str]] = {
    Format.MERMAID: mermaid.render,
    Format.DOT: dot.render,
    Format.JSON: json.render,
}


def render(
    graphs: Sequence[Graph], form: Format, engine: Engine = Engine.AUTO, shown: int = 0
) -> bytes:
    """Return the graph at index ``shown`` in the format; HTML contains all graphs.

    Raises GraphvizFailed, PngMissing.
    """
    graph = graphs[shown]
    match form:
        case Format.HTML:
            pictures = [(each, lay_out(each, engine)) for each in graphs]
            return html.render(pictures, shown).encode()
        case Format.SVG:
            return svg.render(graph, lay_out(graph, engine)).encode()
        case Format.PNG:
            return png.render(graph, lay_out(graph, engine))
        case _:
            return _TEXTS[form](graph).encode()
