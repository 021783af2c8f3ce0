"""PNG: by resvg, by Graphviz, or one sentence about what is missing."""

from __future__ import annotations

import shutil
import struct
from dataclasses import replace

import pytest

from composer.graph import View
from composer.graph.diagram import Graph
from composer.graph.engines import Engine, lay_out
from composer.graph.formats import png
from tests.unit.support.fleets import fleet_graph


def size(data: bytes) -> tuple[int, int]:
    """Return width and height (PNG specification, 11.2.2)."""
    assert data.startswith(b"\x89PNG\r\n\x1a\n")
    width, height = struct.unpack(">II", data[16:24])
    return width, height


def drawn(graph: Graph) -> bytes:
    return png.render(graph, lay_out(graph, Engine.BUNDLED))


def without(monkeypatch: pytest.MonkeyPatch, *names: str) -> None:
    """Make it look as if these were not installed."""
    if "resvg" in names:
        monkeypatch.setattr(png, "find_spec", lambda name: None)
    if "graphviz" in names:
        monkeypatch.setenv("PATH", "/nowhere")


def test_resvg_draws_it_twice_as_large_as_it_is_laid_out() -> None:
    pytest.importorskip("resvg_py")
    graph = fleet_graph(3, View.NODES)
    width, height = size(drawn(graph))
    layout = lay_out(graph, Engine.BUNDLED)
    assert width == pytest.approx(2 * layout.size.width, abs=2)
    assert height > 2 * layout.size.height  # the title is above


def test_a_large_picture_does_not_take_all_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("resvg_py")
    assert png._MAX_PIXELS <= 40_000_000
    monkeypatch.setattr(png, "_MAX_PIXELS", 400_000)  # quick to draw
    width, height = size(drawn(fleet_graph(100, View.DEPLOYMENT)))
    assert 350_000 < width * height < 450_000


@pytest.mark.skipif(shutil.which("dot") is None, reason="Graphviz is not installed")
def test_graphviz_draws_it_where_resvg_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    without(monkeypatch, "resvg")
    width, height = size(drawn(fleet_graph(3, View.NODES)))
    assert width > 100
    assert height > 50


def test_where_both_are_missing_one_sentence_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    without(monkeypatch, "resvg", "graphviz")
    with pytest.raises(png.PngMissing) as refusal:
        drawn(fleet_graph(3, View.NODES))
    assert str(refusal.value) == (
        'a PNG needs Graphviz (apt install graphviz) or pip install "ros2-composer[png]";'
        " -f svg and -f html need neither"
    )


def test_text_is_drawn_without_the_fonts_of_the_svg() -> None:
    pytest.importorskip("resvg_py")
    graph = fleet_graph(3, View.NODES)
    assert drawn(replace(graph, title="abcd")) != drawn(replace(graph, title="dcba"))
