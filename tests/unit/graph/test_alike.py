"""Graphs that differ only in names have the same layout, which is computed once."""

from __future__ import annotations

from itertools import pairwise

from composer.graph.diagram import Graph
from composer.graph.layout import Layout, Sizes
from composer.graph.layout.alike import Alike
from composer.graph.layout.arrange import layered
from composer.graph.measure import sizes
from tests.unit.graph.test_layout import graph_of


def test_a_copy_is_laid_out_once() -> None:
    laid_out = []

    def lay_out(graph: Graph, measured: Sizes) -> Layout:
        laid_out.append(graph)
        return layered(graph, measured)

    alike = Alike(lay_out)
    graphs = [chain("abcd"), chain("nopq"), chain("abc"), chain("nop", back=True)]
    for graph in graphs:
        assert alike(graph, sizes(graph)) == layered(graph, sizes(graph))
    assert laid_out == [graphs[0], *graphs[2:]]


def chain(names: str, *, back: bool = False) -> Graph:
    """Return a graph with an edge from each node to the next, the last two in a frame."""
    edges = [*pairwise(names), (names[0], names[-1])]
    *outside, first, last = names
    frames = dict.fromkeys(outside, "") | dict.fromkeys((first, last), first)
    return graph_of(frames, [*edges, (last, names[1])] if back else edges, [(first, "")])
