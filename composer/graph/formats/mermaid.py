"""A graph as a Mermaid flowchart, for README files and wikis (mermaid.js.org, flowchart syntax)."""

from __future__ import annotations

from collections.abc import Iterator

from composer.base.characters import escape_line
from composer.graph.diagram import Edge, EdgeKind, Graph, Mark, Vertex, VertexKind
from composer.graph.formats.theme import LIGHT_COLORS

#: Mermaid's default limits (``maxTextSize``, ``maxEdges``).
MAX_CHARACTERS = 50_000
MAX_EDGES = 500

#: The brackets around a label determine the shape.
_SHAPES = {
    VertexKind.NODE: ("[", "]"),
    VertexKind.TOPIC: ("([", "])"),
    VertexKind.SERVICE: ("{{", "}}"),
    VertexKind.ACTION: ("[[", "]]"),
    VertexKind.PORT: ("(", ")"),
    VertexKind.STATE: ("(", ")"),
    VertexKind.FRAME: ("([", "])"),
}

_ARROWS = {
    EdgeKind.TOPIC: "-->",
    EdgeKind.SERVICE: "-.->",
    EdgeKind.ACTION: "==>",
    EdgeKind.DEPENDENCY: "-->",
    EdgeKind.IMPLIED: "-.->",
    EdgeKind.TRANSITION: "-->",
    EdgeKind.TRANSFORM: "-->",
}

_MARKS = {mark: f"stroke:{LIGHT_COLORS[mark]},stroke-width:3px" for mark in Mark}
#: By the name of a class.
_STYLES = {
    kind.value: f"fill:{LIGHT_COLORS[kind]},stroke:{LIGHT_COLORS[f'{kind}-line']}"
    f",color:{LIGHT_COLORS['text']}"
    for kind in VertexKind
} | _MARKS


def render(graph: Graph) -> str:
    """Return the graph as Mermaid text with a newline at the end."""
    return "\n".join(_lines(graph)) + "\n"


def is_too_large(graph: Graph) -> bool:
    """Return whether the diagram exceeds Mermaid's limits."""
    return len(graph.edges) > MAX_EDGES or len(render(graph)) > MAX_CHARACTERS


def _lines(graph: Graph) -> Iterator[str]:
    identifiers = {vertex.key: f"v{number}" for number, vertex in enumerate(graph.vertices, 1)}
    yield "---"
    yield f"title: {_title(graph)}"
    yield "---"
    yield f"flowchart {graph.direction}"
    yield from _inside("", graph, identifiers, "  ")
    for edge in graph.edges:
        yield f"  {_arrow(edge, identifiers)}"
    used = _classes(graph)
    yield from (f"  classDef {name} {style}" for name, style in _STYLES.items() if name in used)
    yield from _marked_parts(graph, identifiers)


def _title(graph: Graph) -> str:
    """Return the title as quoted YAML for Mermaid's front matter."""
    text = escape_line(f"{graph.title}: {graph.view}").replace("\\", "\\\\").replace('"', '\\"')
    return f'"{text}"'


def _inside(around: str, graph: Graph, identifiers: dict[str, str], indent: str) -> Iterator[str]:
    for vertex in graph.vertices:
        if vertex.cluster == around:
            yield f"{indent}{_vertex(vertex, identifiers)}"
    for number, cluster in enumerate(graph.clusters, 1):
        if cluster.parent == around:
            yield f"{indent}subgraph c{number} [{_quoted((cluster.label,))}]"
            yield from _inside(cluster.key, graph, identifiers, indent + "  ")
            yield f"{indent}end"


def _vertex(vertex: Vertex, identifiers: dict[str, str]) -> str:
    begin, end = _SHAPES[vertex.kind]
    return f"{identifiers[vertex.key]}{begin}{_quoted(vertex.lines)}{end}:::{vertex.kind}"


def _arrow(edge: Edge, identifiers: dict[str, str]) -> str:
    label = f"|{_quoted(edge.lines)}|" if edge.lines else ""
    return f"{identifiers[edge.source]} {_ARROWS[edge.kind]}{label} {identifiers[edge.target]}"


def _classes(graph: Graph) -> set[str]:
    classes = {vertex.kind.value for vertex in graph.vertices}
    return classes | {vertex.problem.mark for vertex in graph.vertices if vertex.problem}


def _marked_parts(graph: Graph, identifiers: dict[str, str]) -> Iterator[str]:
    for mark, style in _MARKS.items():
        vertices = [
            identifiers[vertex.key]
            for vertex in graph.vertices
            if vertex.problem and vertex.problem.mark is mark
        ]
        if vertices:
            yield f"  class {','.join(vertices)} {mark}"
        edges = [
            str(number)
            for number, edge in enumerate(graph.edges)
            if edge.problem and edge.problem.mark is mark
        ]
        if edges:
            yield f"  linkStyle {','.join(edges)} {style}"


def _quoted(lines: tuple[str, ...]) -> str:
    return '"' + "<br/>".join(map(_escaped, lines)) + '"'


def _escaped(text: str) -> str:
    """Escape characters of Mermaid's and HTML's syntax as codes (``#35;`` is ``#``)."""
    special = '#&<>"`\\'
    line = escape_line(text)
    return "".join(f"#{ord(letter)};" if letter in special else letter for letter in line)
