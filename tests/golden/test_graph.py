"""Diagrams of ``depot.yaml``, byte for byte; ``graph/depot.<view>.<suffix>`` is expected.

After an intended change, run ``pytest tests/golden --update-golden`` and review the diff and the
images.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.graph.output import Format, render
from composer.graph.views import View, build_graph, scene_of
from composer.loading import load

HERE = Path(__file__).parent / "graph"
SUFFIXES = {Format.MERMAID: "mmd", Format.JSON: "json", Format.SVG: "svg"}


@pytest.mark.parametrize("view", list(View))
@pytest.mark.parametrize("form", list(SUFFIXES))
def test_diagram(view: View, form: Format, request: pytest.FixtureRequest) -> None:
    loading = load(HERE / "depot.yaml", shown="depot.yaml")
    assert loading.system is not None
    graph = build_graph(scene_of([loading.system], loading.diagnostics), view)
    text = render([graph], form).decode()
    expected = HERE / f"depot.{view}.{SUFFIXES[form]}"
    if request.config.getoption("--update-golden"):
        expected.write_text(text, encoding="utf-8")
    assert text == expected.read_text(encoding="utf-8")


def test_every_expected_diagram_is_generated() -> None:
    generated = {f"depot.{view}.{ending}" for view in View for ending in SUFFIXES.values()}
    assert {path.name for path in HERE.glob("depot.*.*")} == generated
