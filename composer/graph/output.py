"""A diagram in the format somebody asked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import StrEnum

from composer.graph import dot, html, json, mermaid, png, svg
from composer.graph.picture import Graph
from composer.graph.placing import Engine, placed

__all__ = ["Engine", "Format", "render"]


class Format(StrEnum):
    """What a diagram is written as."""

    MERMAID = "mermaid"
    DOT = "dot"
    SVG = "svg"
    PNG = "png"
    JSON = "json"
    HTML = "html"


_TEXTS: dict[Format, Callable[[Graph], str]] = {
    Format.MERMAID: mermaid.render,
    Format.DOT: dot.render,
    Format.JSON: json.render,
}


def render(
    graphs: Sequence[Graph], form: Format, engine: Engine = Engine.AUTO, shown: int = 0
) -> bytes:
    """Return the graph at index ``shown`` in the format; a page (HTML) has them all.

    Raises GraphvizFailed, PngMissing.
    """
    graph = graphs[shown]
    match form:
        case Format.HTML:
            pictures = [(each, placed(each, engine)) for each in graphs]
            return html.render(pictures, shown).encode()
        case Format.SVG:
            return svg.render(graph, placed(graph, engine)).encode()
        case Format.PNG:
            return png.render(graph, placed(graph, engine))
        case _:
            return _TEXTS[form](graph).encode()
