"""PNG: drawn by resvg, or one sentence about what is missing."""

from __future__ import annotations

import struct
from dataclasses import replace

import pytest

from composer.graph import output
from composer.graph.diagram import Graph
from composer.graph.layout import arrange
from composer.graph.output import Format, PngMissing, render
from composer.graph.views import View
from tests.unit.support.fleets import fleet_graph


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
