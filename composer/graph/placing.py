"""Who lays a picture out: Graphviz where it is installed, else the composer itself."""

from __future__ import annotations

from enum import StrEnum

from composer.graph import graphviz
from composer.graph.layout import Layout, arrange
from composer.graph.measure import sizes
from composer.graph.overlaps import has_overlaps
from composer.graph.picture import Graph


class Engine(StrEnum):
    """What lays pictures out. ``bundled`` gives the same bytes on every machine."""

    AUTO = "auto"
    GRAPHVIZ = "graphviz"
    BUNDLED = "bundled"


def placed(graph: Graph, engine: Engine) -> Layout:
    """Return the layout of a graph. Raises GraphvizFailed where Graphviz was asked for.

    ``auto`` does without it where it is missing, fails, or lays labels on one another.
    """
    needed = sizes(graph)
    if engine is Engine.BUNDLED:
        return arrange(graph, needed)
    try:
        found = arrange(graph, needed, graphviz.lay_out)
    except graphviz.GraphvizFailed:
        if engine is Engine.GRAPHVIZ:
            raise
        return arrange(graph, needed)
    if engine is Engine.AUTO and has_overlaps(graph, found, needed):
        return arrange(graph, needed)
    return found
