"""A graph in Graphviz's language (graphviz.org/doc/info/lang.html)."""

from __future__ import annotations

from collections.abc import Iterator

from composer.base.characters import escape_line, escape_lines
from composer.graph.diagram import (
    Cluster,
    Edge,
    EdgeKind,
    Graph,
    Problem,
    Vertex,
    VertexKind,
)
from composer.graph.formats.theme import LIGHT_COLORS

_SHAPES = {
    VertexKind.NODE: 'shape=box, style="filled,rounded"',
    VertexKind.TOPIC: "shape=ellipse, style=filled",
    VertexKind.SERVICE: "shape=hexagon, style=filled",
    VertexKind.ACTION: "shape=box, peripheries=2, style=filled",
    VertexKind.PORT: 'shape=box, style="filled,rounded"',
    VertexKind.STATE: 'shape=box, style="filled,rounded"',
    VertexKind.FRAME: "shape=ellipse, style=filled",
}
_STROKES = {
    EdgeKind.SERVICE: ["style=dashed"],
    EdgeKind.ACTION: ["style=bold"],
    EdgeKind.IMPLIED: ["style=dashed"],
}


def render(graph: Graph) -> str:
    """Return the graph as DOT text with a newline at the end."""
    return "\n".join(_lines(graph)) + "\n"


def _lines(graph: Graph) -> Iterator[str]:
    yield f"digraph {_key(graph.title)} {{"
    yield f"  graph [rankdir={graph.direction}, compound=true, labelloc=t, {_font(14)}];"
    yield f"  graph [label={_text(f'{graph.title}: {graph.view}')}];"
    yield f"  node [{_font(11)}];"
    yield f"  edge [{_font(9)}];"
    yield from _inside("", graph, "  ")
    for edge in graph.edges:
        yield f"  {_edge(edge)};"
    yield "}"


def _font(size_points: int) -> str:
    return f'fontname="Helvetica,Arial,sans-serif", fontsize={size_points}'


def _inside(around: str, graph: Graph, indent: str) -> Iterator[str]:
    for vertex in graph.vertices:
        if vertex.cluster == around:
            yield f"{indent}{_vertex(vertex)};"
    for cluster in graph.clusters:
        if cluster.parent == around:
            yield from _frame(cluster, graph, indent)


def _frame(cluster: Cluster, graph: Graph, indent: str) -> Iterator[str]:
    yield f"{indent}subgraph {_key(f'cluster_{cluster.key}')} {{"
    yield f'{indent}  graph [label={_text(cluster.label)}, style=rounded, color="#94a3b8"];'
    yield from _inside(cluster.key, graph, indent + "  ")
    yield f"{indent}}}"


def _vertex(vertex: Vertex) -> str:
    fill, line = LIGHT_COLORS[vertex.kind], LIGHT_COLORS[f"{vertex.kind}-line"]
    attributes = [f"label={_label(vertex.lines)}", _SHAPES[vertex.kind]]
    attributes += [f'fillcolor="{fill}"', f'color="{line}"', *_mark(vertex.problem)]
    return f"{_key(vertex.key)} [{', '.join(attributes)}]"


def _edge(edge: Edge) -> str:
    attributes = [f'color="{LIGHT_COLORS[f"{edge.kind}-line"]}"', *_STROKES.get(edge.kind, ())]
    if edge.lines:
        attributes.append(f"label={_label(edge.lines)}")
    attributes += _mark(edge.problem)
    return f"{_key(edge.source)} -> {_key(edge.target)} [{', '.join(attributes)}]"


def _mark(problem: Problem | None) -> list[str]:
    if problem is None:
        return []
    color = LIGHT_COLORS[problem.mark]
    return [f'color="{color}"', "penwidth=3", f"tooltip={_text(problem.text)}"]


def _label(lines: tuple[str, ...]) -> str:
    return '"' + "\\n".join(map(_escaped, lines)) + '"'


def _key(key: str) -> str:
    """Quote an identifier. Its backslashes are doubled: the last one would escape the quote."""
    return '"' + escape_line(key).replace("\\", "\\\\").replace('"', '\\"') + '"'


def _text(text: str) -> str:
    return f'"{_escaped(text)}"'


def _escaped(text: str) -> str:
    """Escape a label, in which backslashes start sequences and ampersands HTML entities."""
    escaped = escape_lines(text).replace("\\", "\\\\").replace('"', '\\"').replace("&", "&amp;")
    return escaped.replace("\n", "\\n")
