"""Units of the layout: vertices, and blocks whose ports are rows."""

from __future__ import annotations

from collections.abc import Mapping

from composer.fast_dataclass import dataclass
from composer.graph.diagram import Cluster, Graph, Vertex
from composer.graph.layout.result import Size


@dataclass(frozen=True, slots=True)
class Sizes:
    """Sizes of vertices and clusters by key, and of edge labels by the key of the edge.

    ``frames`` are the sizes of cluster labels, ``blocks`` the sizes of whole blocks, and ``rows``
    the offsets of vertices from the middle of their block.
    """

    vertices: Mapping[str, Size]
    labels: Mapping[str, Size]
    frames: Mapping[str, Size]
    blocks: Mapping[str, Size]
    rows: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class LayoutUnit:
    """A block, or a vertex outside blocks."""

    key: str
    cluster: str
    size: Size


class LayoutUnits:
    """The units of a graph, and the positions where edges meet them."""

    def __init__(self, graph: Graph, sizes: Sizes) -> None:
        self._blocks: dict[str, Cluster] = {
            cluster.key: cluster for cluster in graph.clusters if cluster.block
        }
        self._rows = sizes.rows
        self._of_vertex = {vertex.key: self._key(vertex) for vertex in graph.vertices}
        self.all: dict[str, LayoutUnit] = {}
        for vertex in graph.vertices:
            block = self._blocks.get(vertex.cluster)
            if block is None:
                unit = LayoutUnit(vertex.key, vertex.cluster, sizes.vertices[vertex.key])
            else:
                unit = LayoutUnit(block.key, block.parent, sizes.blocks[block.key])
            self.all.setdefault(unit.key, unit)

    def key(self, vertex: str) -> str:
        """Return the key of the unit of a vertex."""
        return self._of_vertex[vertex]

    def offset(self, vertex: str) -> float | None:
        """Return the offset of a vertex from the middle of its unit; None for any position."""
        return self._rows.get(vertex)

    def _key(self, vertex: Vertex) -> str:
        return vertex.cluster if vertex.cluster in self._blocks else vertex.key
