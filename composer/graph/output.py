"""Write diagrams in a format."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any

from composer.base.characters import escape_json
from composer.graph.diagram import Cluster, Edge, Format, Graph, Vertex
from composer.graph.formats import html, mermaid, svg
from composer.graph.layout import arrange

#: Pixels per layout unit for high-resolution screens, reduced for very large pictures.
_ZOOM = 2.0
MAX_PIXELS = 40_000_000
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
        case Format.JSON:
            return _json(graph).encode()
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
    zoom = min(_ZOOM, math.sqrt(MAX_PIXELS / max(pixels, 1.0)))
    width, _ = svg.page_size(graph, layout)
    drawn = resvg_py.svg_to_bytes(
        svg_string=svg.render(graph, layout),
        width=max(1, round(width * zoom)),
        sans_serif_family=_FALLBACK_FONT,
    )
    return bytes(drawn)


def _json(graph: Graph) -> str:
    """Return the graph as JSON. Scripts read it: only add to it."""
    data = {
        "title": graph.title,
        "view": graph.view,
        "clusters": [
            {"key": cluster.key, "label": cluster.label, "parent": cluster.parent or None}
            | _json_facts(cluster)
            for cluster in graph.clusters
        ],
        "vertices": [
            {
                "key": vertex.key,
                "kind": vertex.kind.value,
                "label": vertex.lines,
                "cluster": vertex.cluster or None,
            }
            | _json_facts(vertex)
            for vertex in graph.vertices
        ],
        "edges": [
            {
                "key": edge.key,
                "source": edge.source,
                "target": edge.target,
                "kind": edge.kind.value,
                "label": edge.lines,
            }
            | _json_facts(edge)
            for edge in graph.edges
        ],
    }
    return escape_json(json.dumps(data, indent=2, ensure_ascii=False)) + "\n"


def _json_facts(thing: Cluster | Vertex | Edge) -> dict[str, Any]:
    """Return the details, the text of a problem, and how the part is marked."""
    problem = thing.problem
    marked = {} if problem is None else {"mark": problem.mark.value}
    return {
        "details": dict(thing.details),
        "wrong": None if problem is None else problem.text,
        **marked,
    }
