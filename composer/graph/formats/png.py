"""Render PNG from our SVG with resvg if it is installed, else with Graphviz."""

from __future__ import annotations

import math
from importlib.util import find_spec

from composer.graph import graphviz
from composer.graph.diagram import Graph
from composer.graph.formats import dot, svg
from composer.graph.layout import Layout

#: Pixels per layout unit for high-resolution screens, reduced for very large pictures.
_ZOOM = 2.0
_MAX_PIXELS = 40_000_000
#: resvg draws no text if it knows none of the fonts of the SVG, and its own default is Arial.
_FALLBACK_FONT = "DejaVu Sans"


class PngMissing(Exception):
    """No PNG renderer is installed."""


def render(graph: Graph, layout: Layout) -> bytes:
    """Return the picture as PNG. Raises PngMissing."""
    if find_spec("resvg_py") is not None:
        return _by_resvg(graph, layout)
    try:
        return graphviz.run_dot(dot.render(graph), "png")
    except graphviz.GraphvizFailed as error:
        raise PngMissing(
            'a PNG needs Graphviz (apt install graphviz) or pip install "ros2-composer[png]";'
            " -f svg and -f html need neither"
        ) from error


def _by_resvg(graph: Graph, layout: Layout) -> bytes:
    import resvg_py  # noqa: PLC0415 - an extra

    pixels = layout.size.width * layout.size.height
    zoom = min(_ZOOM, math.sqrt(_MAX_PIXELS / max(pixels, 1.0)))
    width, _ = svg.page_size(graph, layout)
    drawn = resvg_py.svg_to_bytes(
        svg_string=svg.render(graph, layout),
        width=max(1, round(width * zoom)),
        sans_serif_family=_FALLBACK_FONT,
    )
    return bytes(drawn)
