"""Diagrams, to the byte. ``graph/depot.<view>.<ending>`` is what is expected of ``depot.yaml``.

After a change that is meant: ``UPDATE_GOLDEN=1 pytest tests/golden/test_graph.py``, then look at
the difference, and at the pictures.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from composer.graph import RENDERERS, View, build_graph
from composer.loading import load

HERE = Path(__file__).parent / "graph"
ENDINGS = {"mermaid": "mmd", "dot": "dot", "json": "json", "svg": "svg"}


@pytest.mark.parametrize("view", list(View))
@pytest.mark.parametrize("form", sorted(RENDERERS))
def test_diagram(view: View, form: str) -> None:
    loading = load(HERE / "depot.yaml", shown="depot.yaml")
    assert loading.system is not None
    text = RENDERERS[form](build_graph(loading.system, view, loading.diagnostics))
    expected = HERE / f"depot.{view}.{ENDINGS[form]}"
    if os.environ.get("UPDATE_GOLDEN"):
        expected.write_text(text, encoding="utf-8")
    assert text == expected.read_text(encoding="utf-8")


def test_every_expected_diagram_is_made() -> None:
    made = {f"depot.{view}.{ending}" for view in View for ending in ENDINGS.values()}
    assert {path.name for path in HERE.glob("depot.*.*")} == made
