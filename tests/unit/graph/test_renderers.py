"""Texts that a format would read as syntax, and every example system in every format."""

from __future__ import annotations

import json
import re
import struct
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import pytest

from composer.base.characters import is_safe
from composer.base.folders import systems_folder
from composer.graph import output
from composer.graph.diagram import (
    Cluster,
    Direction,
    Edge,
    EdgeKind,
    Graph,
    Mark,
    Problem,
    Vertex,
    VertexKind,
)
from composer.graph.formats import mermaid, svg
from composer.graph.layout import arrange
from composer.graph.output import Format, PngMissing, render
from composer.graph.views import View, build_graph, scene_of
from composer.loading import load
from tests.unit.support.fleets import fleet_graph

EVIL = 'end "quoted" <b>&amp; #35; `code` \\n |pipe| [x] {y} --> z;'
SVG = "{http://www.w3.org/2000/svg}"


#: A name as a participant of DDS, but no ROS node, can announce it.
HOSTILE = "/a\x1b]0;b\x07\n%%{init: {}}%%\u202e\x9b\ud800\\"


def graph_with(name: str) -> Graph:
    """Return a graph with a text wherever one can be."""
    return Graph(
        title=name,
        view="nodes",
        direction=Direction.RIGHT,
        vertices=(
            Vertex(f"one {name}", VertexKind.NODE, (name, "second line"), cluster=name),
            Vertex("two", VertexKind.TOPIC, ("graph",), problem=Problem(name, Mark.DOUBTFUL)),
        ),
        edges=(Edge("edge", f"one {name}", "two", EdgeKind.TOPIC, (name,), problem=Problem(name)),),
        clusters=(Cluster(name, name),),
    )


def evil_graph() -> Graph:
    return graph_with(EVIL)


def test_mermaid_says_what_the_text_was_in_character_codes() -> None:
    text = mermaid.render(evil_graph()).split("---\n")[2]
    (label,) = re.findall(r'\["(.*?)<br/>second line"\]', text)
    assert not re.search(r"[<>&`\\]|#(?!\d+;)", label)
    assert re.sub(r"#(\d+);", lambda code: chr(int(code[1])), label) == EVIL


@pytest.mark.parametrize("form", [form for form in Format if form is not Format.PNG])
def test_no_format_holds_control_characters(form: Format) -> None:
    text = render([graph_with(HOSTILE)], form).decode()
    assert is_safe(text)
    if form is Format.JSON:
        assert json.loads(text)["title"] == HOSTILE
    if form is Format.SVG:
        ET.fromstring(text)
    if form is Format.MERMAID:  # a line break in a name starts no line
        assert not any(line.startswith("%%") for line in text.splitlines())


def test_svg_holds_the_texts_as_they_were() -> None:
    root = ET.fromstring(svg.render(evil_graph(), arrange(evil_graph())))
    texts = [text.text for text in root.iter(f"{SVG}text")]
    assert texts.count(EVIL) == 3  # frame, vertex, edge
    assert EVIL in {title.text for title in root.iter(f"{SVG}title")}


@pytest.mark.parametrize(
    "path", sorted(systems_folder().glob("*.yaml")), ids=lambda path: path.stem
)
def test_every_example_system_is_drawn_in_every_format(path: Path) -> None:
    loading = load(path)
    for view in View:
        graph = build_graph(scene_of([loading.system], loading.diagnostics), view)
        keys = {vertex.key for vertex in graph.vertices}
        assert len(keys) == len(graph.vertices)
        assert all({edge.source, edge.target} <= keys for edge in graph.edges)
        json.loads(render([graph], Format.JSON))
        ET.fromstring(render([graph], Format.SVG))
        text = render([graph], Format.MERMAID).decode()
        frames = re.findall(r"^ *subgraph ", text, re.MULTILINE)
        assert len(frames) == len(re.findall(r"^ *end$", text, re.MULTILINE))


def size(data: bytes) -> tuple[int, int]:
    """Return width and height (PNG specification, 11.2.2)."""
    assert data.startswith(b"\x89PNG\r\n\x1a\n")
    width, height = struct.unpack(">II", data[16:24])
    return width, height


def drawn(graph: Graph) -> bytes:
    return render([graph], Format.PNG)


def test_resvg_draws_it_twice_as_large_as_it_is_laid_out() -> None:
    pytest.importorskip("resvg_py")
    graph = fleet_graph(3, View.NODES)
    width, height = size(drawn(graph))
    layout = arrange(graph)
    assert width == pytest.approx(2 * layout.size.width, abs=2)
    assert height > 2 * layout.size.height  # the title is above
    # Text is drawn without the fonts of the SVG.
    assert drawn(replace(graph, title="abcd")) != drawn(replace(graph, title="dcba"))


def test_a_large_picture_does_not_take_all_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("resvg_py")
    assert output.MAX_PIXELS <= 40_000_000
    monkeypatch.setattr(output, "MAX_PIXELS", 400_000)  # quick to draw
    width, height = size(drawn(fleet_graph(100, View.DEPLOYMENT)))
    assert 350_000 < width * height < 450_000


def test_a_missing_renderer_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(output, "find_spec", lambda name: None)
    with pytest.raises(PngMissing, match="needs resvg, which is not installed"):
        drawn(fleet_graph(3, View.NODES))
