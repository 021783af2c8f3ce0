"""The page as text: nothing in it leads elsewhere, and no name can become markup."""

from __future__ import annotations

import base64
import hashlib
import os
import re
import subprocess
import sys
from html.parser import HTMLParser

from composer.base.folders import systems_folder
from composer.graph.formats import html
from composer.graph.output import Format, render
from composer.graph.views import View, build_graph, scene_of
from composer.loading import load
from tests.unit.graph.test_renderers import EVIL, evil_graph


def page_of(system: str) -> str:
    loading = load(systems_folder() / f"{system}.yaml")
    scene = scene_of([loading.system], loading.diagnostics)
    return html.render([build_graph(scene, view) for view in View])


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


def test_nothing_in_it_leads_elsewhere_and_everything_that_can_be_clicked_has_an_article() -> None:
    page = page_of("pipeline")
    names = {name for name, _ in Elements(page).attributes}
    assert not names & {"src", "href", "xlink:href", "action", "srcset", "background"}
    assert not re.search(r"https?://|@import|url\((?!#)", page)
    # The policy allows the script that is in it and nothing else.
    (script,) = re.findall(r"<script>(.*?)</script>", page, re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}';" in page
    articles = set(re.findall(r'data-about="([^"]*)"', page))
    keys = set(re.findall(r'data-key="([^"]*)"', page))
    assert keys
    assert keys <= articles


def test_no_name_becomes_markup() -> None:
    evil = Elements(html.render([evil_graph()]))
    harmless = Elements(html.render([build_graph(scene_of([]))]))
    added = {"g", "rect", "text", "title", "article", "p", "h2", "path", "label", "input"}
    assert set(evil.tags) - set(harmless.tags) <= added
    assert "b" not in evil.tags
    assert evil.texts.count(EVIL) >= 3


def test_the_chosen_view_is_the_one_that_is_shown() -> None:
    scene = scene_of([load(systems_folder() / "minimal.yaml").system])
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
from composer.base.folders import systems_folder
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
