"""The page as text: nothing in it leads elsewhere, and no name can become markup."""

from __future__ import annotations

import base64
import hashlib
import os
import re
import subprocess
import sys
from html.parser import HTMLParser

from composer.base.resources import systems_folder
from composer.graph.diagram import Graph
from composer.graph.formats import html
from composer.graph.output import Format, render
from composer.graph.views import View, build_graph, scene_of
from composer.loading import load
from tests.unit.graph.test_renderers import EVIL, evil_graph


def page_of(*graphs: Graph) -> str:
    return html.render(graphs)


def pipeline_page() -> str:
    loading = load(systems_folder() / "pipeline.yaml")
    assert loading.system is not None
    scene = scene_of([loading.system], loading.diagnostics)
    return page_of(*(build_graph(scene, view) for view in View))


class Elements(HTMLParser):
    """Collects what elements there are, and the texts between them."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.texts: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attrs

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


def test_nothing_in_it_leads_elsewhere() -> None:
    names = {name for name, _ in Elements(pipeline_page()).attributes}
    assert not names & {"src", "href", "xlink:href", "action", "srcset", "background"}
    assert not re.search(r"https?://|@import|url\((?!#)", pipeline_page())


def test_the_policy_allows_the_script_that_is_in_it_and_nothing_else() -> None:
    page = pipeline_page()
    (script,) = re.findall(r"<script>(.*?)</script>", page, re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}';" in page


def test_no_name_becomes_markup() -> None:
    evil = Elements(page_of(evil_graph()))
    harmless = Elements(page_of(build_graph(scene_of([]))))
    assert set(evil.tags) - set(harmless.tags) <= {
        "g",
        "rect",
        "text",
        "title",
        "article",
        "p",
        "h2",
        "path",
        "label",
        "input",
    }
    assert "b" not in evil.tags
    assert evil.texts.count(EVIL) >= 3


def test_everything_that_can_be_clicked_has_its_article() -> None:
    page = pipeline_page()
    articles = set(re.findall(r'data-about="([^"]*)"', page))
    keys = set(re.findall(r'data-key="([^"]*)"', page))
    assert keys
    assert keys <= articles


def test_the_chosen_view_is_the_one_that_is_shown() -> None:
    loading = load(systems_folder() / "minimal.yaml")
    assert loading.system is not None
    scene = scene_of([loading.system])
    graphs = [build_graph(scene, view) for view in View]
    page = render(graphs, Format.HTML, shown=2).decode()
    shown = re.findall(r'<section class="view" id="([^"]*)"[^>]*?(hidden)?>', page)
    assert [name for name, hidden in shown if not hidden] == ["view-lifecycle"]
    assert page.count('aria-selected="true" tabindex') == 1


ALL_FORMATS = """
import hashlib, sys
from composer.graph.views import View, build_graph, scene_of
from composer.graph.output import Format, render
from composer.loading import load
from composer.base.resources import systems_folder
loading = load(systems_folder() / "navigation.yaml")
scene = scene_of([loading.system], loading.diagnostics)
graphs = [build_graph(scene, view) for view in View]
for form in Format:
    if form is not Format.PNG:
        print(form, hashlib.sha256(render(graphs, form)).hexdigest())
"""


def test_the_same_input_gives_the_same_bytes_in_every_process() -> None:
    printed = {
        subprocess.run(
            [sys.executable, "-c", ALL_FORMATS],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            check=True,
            text=True,
        ).stdout
        for seed in ("1", "2")
    }
    assert len(printed) == 1
    assert len(printed.pop().splitlines()) == 4
