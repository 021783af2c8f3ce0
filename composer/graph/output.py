"""Write diagrams in a format."""

from __future__ import annotations

import math
from collections.abc import Sequence
from importlib.util import find_spec

from composer.graph.diagram import Graph
from composer.graph.diagram_options import Format
from composer.graph.formats import dot, html, json, mermaid, svg
from composer.graph.layout import arrange

#: Pixels per layout unit for high-resolution screens, reduced for very large pictures.
_ZOOM = 2.0
_MAX_PIXELS = 40_000_000
#: resvg draws no text if it knows none of the fonts of the SVG, and its own default is Arial.
_FALLBACK_FONT = "DejaVu Sans"


class PngMissing(Exception):
    """The renderer of PNG is not installed."""


def render(graphs: Sequence[Graph], form: Format, shown: int = 0) -> bytes:
    """Return the graph at index ``shown`` in the format; HTML contains all graphs.

    Raises PngMissing.
    """
    graph = graphs[shown]
    match form:
        case Format.MERMAID:
            return mermaid.render(graph).encode()
        case Format.DOT:
            return dot.render(graph).encode()
        case Format.JSON:
            return json.render(graph).encode()
        case Format.SVG:
            return svg.render(graph, arrange(graph)).encode()
        case Format.HTML:
            return html.render(graphs, shown).encode()
        case Format.PNG:
            return _png(graph)


def _png(graph: Graph) -> bytes:
    """Draw the SVG with resvg. Raises PngMissing."""
    if find_spec("resvg_py") is None:
        raise PngMissing("a PNG needs resvg, which is not installed")
    import resvg_py  # noqa: PLC0415 - an extra

    layout = arrange(graph)
    pixels = layout.size.width * layout.size.height
    zoom = min(_ZOOM, math.sqrt(_MAX_PIXELS / max(pixels, 1.0)))
    width, _ = svg.page_size(graph, layout)
    drawn = resvg_py.svg_to_bytes(
        svg_string=svg.render(graph, layout),
        width=max(1, round(width * zoom)),
        sans_serif_family=_FALLBACK_FONT,
    )
    return bytes(drawn)
