"""The parser of Mermaid reads every diagram as intended.

Requires Node.js and ``npm ci --prefix tests/mermaid``.
"""

from __future__ import annotations

import html
import re
from pathlib import Path
from typing import Any

import pytest

from composer.base.folders import systems_folder
from composer.graph.diagram import Graph
from composer.graph.formats import mermaid
from composer.graph.views import View, build_graph, scene_of
from composer.loading import load
from tests.programs import require_package, run_node
from tests.unit.graph.test_renderers import EVIL, evil_graph
from tests.unit.support.fleets import fleet_graph

HERE = Path(__file__).parent
SYSTEMS = sorted(systems_folder().glob("*.yaml"))


@pytest.fixture(scope="module", autouse=True)
def parser() -> None:
    require_package(HERE, "mermaid")


def plain(text: str) -> str:
    """Return the displayed text: Mermaid encodes entities as ``ﬂ°°35¶ß`` until it draws them."""
    return html.unescape(re.sub(r"ﬂ°°(\d+)¶ß", r"&#\1;", text))


def check(graph: Graph, parsed: dict[str, Any]) -> None:
    assert "error" not in parsed, parsed
    assert parsed["type"] == "flowchart-v2"
    numbers = {vertex.key: f"v{number}" for number, vertex in enumerate(graph.vertices, 1)}
    assert {numbers[vertex.key]: vertex.lines for vertex in graph.vertices} == {
        name: tuple(map(plain, re.split("<br ?/?>", text)))
        for name, text in parsed["vertices"].items()
    }
    assert [[numbers[edge.source], numbers[edge.target], edge.lines] for edge in graph.edges] == [
        [begin, end, tuple(map(plain, re.split("<br ?/?>", text))) if text else ()]
        for begin, end, text in parsed["edges"]
    ]
    drawn = {vertex.cluster for vertex in graph.vertices}
    titles = {plain(title) for title in parsed["frames"]}
    assert {cluster.label for cluster in graph.clusters if cluster.key in drawn} <= titles


def test_example_systems_thirty_nodes_and_evil_texts() -> None:
    scenes = []
    for path in SYSTEMS:
        loading = load(path)
        assert loading.system is not None
        scenes.append(scene_of([loading.system], loading.diagnostics))
    graphs = [build_graph(scene, view) for scene in scenes for view in View]
    graphs += [fleet_graph(30, view) for view in View]
    graphs += [evil_graph()]  # its texts look like syntax
    diagrams = run_node(HERE, "read.mjs", [mermaid.render(graph) for graph in graphs])
    for graph, parsed in zip(graphs, diagrams, strict=True):
        check(graph, parsed)
    assert plain(diagrams[-1]["vertices"]["v1"]).startswith(EVIL)
