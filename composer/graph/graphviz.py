"""Lay out graphs with Graphviz's ``dot``, if it is installed.

Graphviz gets boxes with our sizes and we draw the result, so that pictures look the same with
either layout engine.
"""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Iterator
from typing import Any

from composer.graph.diagram import Edge, Graph
from composer.graph.layout import Frame, Layout, Path, Point, Rectangle, Size, Sizes
from composer.graph.layout.components import MARGIN
from composer.graph.layout.steps.ranks import break_cycles
from composer.graph.layout.units import LayoutUnits
from composer.graph.measure import HEAD_HEIGHT, ROW_HEIGHT

_POINTS_PER_INCH = 72.0
#: Timeout of Graphviz; 300 nodes take about one second.
_TIMEOUT_S = 30.0


class GraphvizFailed(Exception):
    """Graphviz is not installed or failed."""


def run_dot(source: str, form: str) -> bytes:
    """Return the output of ``dot -T<form>`` for ``source``. Raises GraphvizFailed."""
    program = shutil.which("dot")
    if program is None:
        raise GraphvizFailed("Graphviz is not installed")
    try:
        done = subprocess.run(  # noqa: S603 - a fixed command; names are quoted in the source
            [program, f"-T{form}"],
            input=source.encode(),
            capture_output=True,
            check=False,
            timeout=_TIMEOUT_S,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise GraphvizFailed(f"Graphviz failed: {error}") from error
    if done.returncode or not done.stdout:
        lines = done.stderr.decode(errors="replace").strip().splitlines()
        raise GraphvizFailed(f"Graphviz failed: {lines[0] if lines else done.returncode}")
    return done.stdout


def lay_out(graph: Graph, sizes: Sizes) -> Layout:
    """Return Graphviz's layout of ``graph``. Raises GraphvizFailed."""
    source = "\n".join(_DotSource(graph, sizes).lines()) + "\n"
    return _DotResult(graph, sizes, json.loads(run_dot(source, "json0"))).layout()


class _DotSource:
    """The input of Graphviz, with numbers as names and without text."""

    def __init__(self, graph: Graph, sizes: Sizes) -> None:
        self._graph = graph
        self._sizes = sizes
        self._units = LayoutUnits(graph, sizes)
        self._number = {key: number for number, key in enumerate(self._units.all)}
        self._row = {vertex.key: number for number, vertex in enumerate(graph.vertices)}
        self._backward = _backward(graph, self._units)

    def lines(self) -> Iterator[str]:
        yield "digraph {"
        yield f"graph [rankdir={self._graph.direction}, newrank=true, nodesep=0.25, ranksep=0.4];"
        yield 'node [shape=box, label=""];'
        yield from self._inside("")
        for number, edge in enumerate(self._graph.edges):
            yield self._edge(number, edge)
        yield "}"

    def _inside(self, around: str) -> Iterator[str]:
        for unit in self._units.all.values():
            if unit.cluster == around:
                yield f"n{self._number[unit.key]} [{self._node(unit.key, unit.size)}];"
        for number, cluster in enumerate(self._graph.clusters):
            if cluster.parent == around and not cluster.block:
                label = _blank(self._sizes.frames[cluster.key])
                yield f"subgraph cluster_{number} {{ graph [label={label}, labeljust=l];"
                yield from self._inside(cluster.key)
                yield "}"

    def _node(self, key: str, size: Size) -> str:
        if key not in self._sizes.blocks:
            inches = (size.width / _POINTS_PER_INCH, size.height / _POINTS_PER_INCH)
            return f"fixedsize=true, width={inches[0]:.4f}, height={inches[1]:.4f}"
        ports = [vertex for vertex in self._graph.vertices if vertex.cluster == key]
        rows = [_cell(size.width, HEAD_HEIGHT)]
        rows += [_cell(size.width, ROW_HEIGHT, f"p{self._row[port.key]}") for port in ports]
        return f"shape=plain, label=<{_table(*rows)}>"

    def _end(self, vertex: str) -> str:
        unit = self._units.key(vertex)
        port = f":p{self._row[vertex]}" if unit != vertex else ""
        return f"n{self._number[unit]}{port}"

    def _edge(self, number: int, edge: Edge) -> str:
        """Return an edge in the direction of the ranks, so that Graphviz ranks units as we do."""
        ends = (self._end(edge.source), self._end(edge.target))
        begin, end = ends[::-1] if number in self._backward else ends
        back = ", dir=back" if number in self._backward else ""
        label = f", label={_blank(self._sizes.labels[edge.key])}" if edge.lines else ""
        return f"{begin} -> {end} [id={number}{back}{label}];"


def _backward(graph: Graph, units: LayoutUnits) -> set[int]:
    """Return the numbers of the edges that are reversed to break cycles."""
    pairs = [(units.key(edge.source), units.key(edge.target)) for edge in graph.edges]
    turned = break_cycles(list(units.all), pairs)
    return {number for number, pair in enumerate(pairs) if pair != turned[number]}


def _blank(size: Size) -> str:
    return f"<{_table(_cell(size.width, size.height))}>"


def _table(*rows: str) -> str:
    return (
        f'<TABLE BORDER="0" CELLBORDER="0" CELLSPACING="0" CELLPADDING="0">{"".join(rows)}</TABLE>'
    )


def _cell(width: float, height: float, port: str = "") -> str:
    named = f' PORT="{port}"' if port else ""
    size = f'FIXEDSIZE="TRUE" WIDTH="{width:.0f}" HEIGHT="{height:.0f}"'
    return f"<TR><TD{named} {size}></TD></TR>"


class _DotResult:
    """The output of Graphviz, in points with y upwards."""

    def __init__(self, graph: Graph, sizes: Sizes, data: dict[str, Any]) -> None:
        self._graph = graph
        self._sizes = sizes
        self._units = LayoutUnits(graph, sizes)
        self._data = data
        self._objects = {item["name"]: item for item in data.get("objects", [])}
        left, bottom, right, top = _numbers(data["bb"])
        self._left, self._top = left, top
        self._size = Size(right - left + 2 * MARGIN, top - bottom + 2 * MARGIN)

    def layout(self) -> Layout:
        places = {
            key: Rectangle(self._point(self._objects[f"n{number}"]["pos"]), unit.size)
            for number, (key, unit) in enumerate(self._units.all.items())
        }
        return Layout(
            size=self._size,
            vertices={
                vertex.key: self._vertex(vertex.key, places) for vertex in self._graph.vertices
            },
            frames=tuple(self._frames(places)),
            paths=tuple(self._paths()),
        )

    def _vertex(self, key: str, places: dict[str, Rectangle]) -> Rectangle:
        unit = self._units.key(key)
        if unit == key:
            return places[key]
        return places[unit].row(self._sizes.rows[key], self._sizes.vertices[key].height)

    def _frames(self, places: dict[str, Rectangle]) -> Iterator[Frame]:
        for number, cluster in enumerate(self._graph.clusters):
            place = places.get(cluster.key) if cluster.block else self._frame(number)
            if place is not None:
                yield Frame(cluster, place)

    def _frame(self, number: int) -> Rectangle | None:
        found = self._objects.get(f"cluster_{number}", {}).get("bb")
        if found is None:
            return None
        left, bottom, right, top = _numbers(found)
        center = self._at((left + right) / 2, (bottom + top) / 2)
        return Rectangle(center, Size(right - left, top - bottom))

    def _paths(self) -> Iterator[Path]:
        edges: dict[int, dict[str, Any]] = {int(item["id"]): item for item in self._data["edges"]}
        for number, edge in enumerate(self._graph.edges):
            found = edges[number]
            label = self._point(found["lp"]) if "lp" in found else None
            yield Path(edge, tuple(self._spline(found["pos"])), label)

    def _spline(self, position: str) -> list[Point]:
        """Return a start and three points per curve, with a straight line to the arrow head.

        The format is splineType (graphviz.org/docs/attr-types/splineType).
        """
        parts = position.split(";", maxsplit=1)[0].split(" ")
        tips = {part[0]: self._point(part[2:]) for part in parts if part[0] in "se"}
        points = [self._point(part) for part in parts if part[0] not in "se"]
        if "s" in tips:  # drawn from the target
            tips["e"] = tips["s"]
            points.reverse()
        tip = tips.get("e", points[-1])
        return [*points, points[-1], tip, tip]

    def _point(self, text: str) -> Point:
        x, y, *_ = _numbers(text)
        return self._at(x, y)

    def _at(self, x: float, y: float) -> Point:
        return Point(x - self._left + MARGIN, self._top - y + MARGIN)


def _numbers(text: str) -> list[float]:
    return [float(number) for number in text.rstrip("!").split(",")]
