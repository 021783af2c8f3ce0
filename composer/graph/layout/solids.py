"""Where lines meet a vertex: anywhere on its side, or at one of its rows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from composer.graph.layout.result import Size
from composer.graph.picture import Cluster, Graph, Vertex


@dataclass(frozen=True, slots=True)
class Sizes:
    """How big things are: vertices and clusters by key, the labels of edges by the edge's key.

    ``frames`` has the size of a cluster's label. ``blocks`` has the whole size of a cluster that
    is a block, and ``rows`` how far below the block's middle each of its vertices stands.
    """

    vertices: Mapping[str, Size]
    labels: Mapping[str, Size]
    frames: Mapping[str, Size]
    blocks: Mapping[str, Size]
    rows: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Solid:
    """What is laid out in one piece: a vertex that is in no block, or a block."""

    key: str
    cluster: str
    size: Size


class Solids:
    """The solids of a graph, and where an edge to a vertex meets one."""

    def __init__(self, graph: Graph, sizes: Sizes) -> None:
        self._blocks: dict[str, Cluster] = {
            cluster.key: cluster for cluster in graph.clusters if cluster.block
        }
        self._rows = sizes.rows
        self._of_vertex = {vertex.key: self._key(vertex) for vertex in graph.vertices}
        self.all: dict[str, Solid] = {}
        for vertex in graph.vertices:
            block = self._blocks.get(vertex.cluster)
            if block is None:
                solid = Solid(vertex.key, vertex.cluster, sizes.vertices[vertex.key])
            else:
                solid = Solid(block.key, block.parent, sizes.blocks[block.key])
            self.all.setdefault(solid.key, solid)

    def key(self, vertex: str) -> str:
        """Return the key of the solid that a vertex is, or is in."""
        return self._of_vertex[vertex]

    def offset(self, vertex: str) -> float | None:
        """Return how far below the middle of its solid an edge meets a vertex; None: anywhere."""
        return self._rows.get(vertex)

    def _key(self, vertex: Vertex) -> str:
        return vertex.cluster if vertex.cluster in self._blocks else vertex.key
