"""Lay out graphs that differ only in names once, as copies by ``include`` and ``for_each`` do."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import replace

from composer.graph.diagram import Graph
from composer.graph.layout.result import Frame, Layout
from composer.graph.layout.units import Sizes


class Alike:
    """A layout of graphs, each of which may be like one before."""

    def __init__(self, lay_out: Callable[[Graph, Sizes], Layout]) -> None:
        """``lay_out`` depends on nothing but structure and sizes."""
        self._lay_out = lay_out
        self._known: dict[Hashable, tuple[Graph, Layout]] = {}

    def __call__(self, graph: Graph, sizes: Sizes) -> Layout:
        """Return the layout of a graph."""
        structure = _structure(graph, sizes)
        known = self._known.get(structure)
        if known is not None:
            return _renamed(*known, graph)
        layout = self._lay_out(graph, sizes)
        self._known[structure] = (graph, layout)
        return layout


def _structure(graph: Graph, sizes: Sizes) -> Hashable:
    """Return all that the layout depends on, with indices instead of names."""
    clusters = {cluster.key: index for index, cluster in enumerate(graph.clusters)}
    vertices = {vertex.key: index for index, vertex in enumerate(graph.vertices)}
    return (
        graph.direction,
        tuple(
            (
                clusters.get(cluster.parent),
                cluster.block,
                sizes.frames.get(cluster.key),
                sizes.blocks.get(cluster.key),
            )
            for cluster in graph.clusters
        ),
        tuple(
            (clusters.get(vertex.cluster), sizes.vertices[vertex.key], sizes.rows.get(vertex.key))
            for vertex in graph.vertices
        ),
        tuple(
            (
                vertices[edge.source],
                vertices[edge.target],
                edge.kind,
                edge.problem and edge.problem.mark,
                sizes.labels.get(edge.key),
            )
            for edge in graph.edges
        ),
    )


def _renamed(known: Graph, layout: Layout, graph: Graph) -> Layout:
    """Return the layout of a known graph with the names of one that is like it."""
    clusters = {old.key: new for old, new in zip(known.clusters, graph.clusters, strict=True)}
    vertices = {old.key: new.key for old, new in zip(known.vertices, graph.vertices, strict=True)}
    edges = {old.key: new for old, new in zip(known.edges, graph.edges, strict=True)}
    return Layout(
        size=layout.size,
        vertices={vertices[key]: place for key, place in layout.vertices.items()},
        frames=tuple(Frame(clusters[frame.cluster.key], frame.place) for frame in layout.frames),
        paths=tuple(replace(path, edge=edges[path.edge.key]) for path in layout.paths),
    )
