"""Diagrams, to the byte. ``graph/depot.<view>.<ending>`` is what is expected of ``depot.yaml``.

After a change that is meant: ``pytest tests/golden --update-golden``, then look at
the difference, and at the pictures.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.graph import View, build_graph, scene_of
from composer.graph.output import Format, render
from composer.graph.placing import Engine
from composer.loading import load

HERE = Path(__file__).parent / "graph"
ENDINGS = {Format.MERMAID: "mmd", Format.DOT: "dot", Format.JSON: "json", Format.SVG: "svg"}


@pytest.mark.parametrize("view", list(View))
@pytest.mark.parametrize("form", list(ENDINGS))
def test_diagram(view: View, form: Format, request: pytest.FixtureRequest) -> None:
    loading = load(HERE / "depot.yaml", shown="depot.yaml")
    assert loading.system is not None
    graph = build_graph(scene_of([loading.system], loading.diagnostics), view)
    text = render([graph], form, Engine.BUNDLED).decode()
    expected = HERE / f"depot.{view}.{ENDINGS[form]}"
    if request.config.getoption("--update-golden"):
        expected.write_text(text, encoding="utf-8")
    assert text == expected.read_text(encoding="utf-8")


def test_every_expected_diagram_is_made() -> None:
    made = {f"depot.{view}.{ending}" for view in View for ending in ENDINGS.values()}
    assert {path.name for path in HERE.glob("depot.*.*")} == made
