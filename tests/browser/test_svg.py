"""SVG pictures, in a real browser."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from composer.base.resources import systems_folder
from composer.graph.output import Format, render
from composer.graph.views import View, build_graph, scene_of
from composer.loading import load
from tests.browser.conftest import Opened


@pytest.mark.parametrize("name", [path.stem for path in sorted(systems_folder().glob("*.yaml"))])
def test_every_example_is_shown_and_loads_nothing(
    name: str, open_file: Callable[..., Opened], tmp_path: Path
) -> None:
    loading = load(systems_folder() / f"{name}.yaml")
    assert loading.system is not None
    scene = scene_of([loading.system], loading.diagnostics)
    paths = [tmp_path / f"{name}.{view}.svg" for view in View]
    for path, view in zip(paths, View, strict=True):
        path.write_bytes(render([build_graph(scene, view)], Format.SVG))
    opened = open_file(paths[0])
    page = opened.page
    for path in paths:
        opened.go(path)
        assert page.evaluate("document.documentElement.tagName") == "svg"
        drawn = page.evaluate("document.documentElement.width.baseVal.value")
        size = page.evaluate("document.documentElement.getBoundingClientRect().width")
        assert size == pytest.approx(drawn, abs=0.5)
