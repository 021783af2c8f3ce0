"""Diagrams as one self-contained HTML page: no network, no server, no installed program.

``articles`` are the details of everything in the pictures. The style is in ``page.css`` and
``picture.css``, the behavior in the ``.js`` files; both are put into the page.
"""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from composer.graph.diagram import Graph, VertexKind, natural_order, with_ancestors
from composer.graph.formats.html.articles import articles
from composer.graph.formats.svg import contents, markers, number, text
from composer.graph.formats.theme import page_style
from composer.graph.layout import arrange

#: The modules of the script, each before those that import it.
_SCRIPTS = (
    "picture.js",
    "viewport.js",
    "filter.js",
    "search.js",
    "selection.js",
    "tabs.js",
    "appearance.js",
    "main.js",
)
#: What modules have and scripts do not.
_MODULE_SYNTAX = re.compile(r"^(import .*\n+|export )", re.MULTILINE)
_KINDS = (VertexKind.NODE, VertexKind.TOPIC, VertexKind.SERVICE, VertexKind.ACTION)


def render(graphs: Sequence[Graph], shown: int = 0) -> str:
    """Return the page with one picture or more, each of another view.

    The page first shows the picture at index ``shown``.
    """
    return "\n".join(_lines(graphs, shown)) + "\n"


def _lines(graphs: Sequence[Graph], shown: int) -> Iterator[str]:
    title = text(graphs[0].title)
    script = _script()
    yield "<!DOCTYPE html>"
    yield '<html lang="en">'
    yield "<head>"
    yield '<meta charset="utf-8">'
    yield '<meta name="viewport" content="width=device-width, initial-scale=1">'
    yield f'<meta http-equiv="Content-Security-Policy" content="{_policy(script)}">'
    yield '<meta name="generator" content="compose graph">'
    yield f"<title>{title}</title>"
    yield f"<style>{_style()}</style>"
    yield "<noscript><style>.listing{display:block}.tools{display:none}</style></noscript>"
    yield "</head>"
    yield "<body>"
    yield from _toolbar(title, graphs, shown)
    yield "<main>"
    for index, graph in enumerate(graphs):
        yield from _view(graph, shown=index == shown)
    yield from _panel()
    yield "</main>"
    yield '<section class="listing" aria-label="All details">'
    yield from articles(graphs)
    yield "</section>"
    yield f'<svg class="heads" aria-hidden="true">{markers()}</svg>'
    yield f"<script>{script}</script>"
    yield "</body>"
    yield "</html>"


def _policy(script: str) -> str:
    """Allow our own style and script and nothing else: the page cannot load anything."""
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return (
        f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}';"
        " base-uri 'none'; form-action 'none'"
    )


def _toolbar(title: str, graphs: Sequence[Graph], shown: int) -> Iterator[str]:
    yield '<header class="bar">'
    yield f"<h1>{title}</h1>"
    yield '<div class="tools">'
    yield from _tabs([graph.view for graph in graphs], shown)
    yield (
        '<div class="search" role="search"><input type="search" id="search" autocomplete="off"'
        ' spellcheck="false" placeholder="Search ( / )" aria-label="Search names, types, notes">'
        '<output id="matches" for="search" aria-live="polite"></output></div>'
    )
    yield from _filters(graphs)
    yield (
        '<div class="group" role="group" aria-label="Zoom">'
        '<button type="button" data-zoom="out" aria-label="Zoom out" title="-">-</button>'
        '<button type="button" data-zoom="in" aria-label="Zoom in" title="+">+</button>'
        '<button type="button" data-zoom="fit" title="Show everything (0)">Fit</button></div>'
    )
    yield '<button type="button" id="appearance" title="Light or dark">Theme: auto</button>'
    yield "</div>"
    yield "</header>"


def _tabs(views: Sequence[str], shown: int) -> Iterator[str]:
    if len(views) < 2:
        return
    yield '<div class="group" role="tablist" aria-label="View">'
    for index, view in enumerate(views):
        selected = "true" if index == shown else "false"
        yield (
            f'<button type="button" role="tab" id="tab-{view}" aria-controls="view-{view}"'
            f' aria-selected="{selected}" tabindex="{0 if index == shown else -1}">{view}</button>'
        )
    yield "</div>"


def _filters(graphs: Sequence[Graph]) -> Iterator[str]:
    vertices = [vertex for graph in graphs for vertex in graph.vertices]
    blocks = [cluster for graph in graphs for cluster in graph.clusters if cluster.block]
    kinds = {vertex.kind for vertex in vertices} | ({VertexKind.NODE} if blocks else set())
    namespaces = {vertex.namespace for vertex in vertices if vertex.kind is VertexKind.NODE}
    namespaces |= {block.namespace for block in blocks}
    namespaces |= with_ancestors(namespaces)
    if len(namespaces) > 1:
        namespaces.add("/")
    yield '<details class="filter"><summary>Filter</summary><div class="menu">'
    yield "<fieldset><legend>Kind</legend>"
    yield from (_choice("kind", kind.value, f"{kind.value}s") for kind in _KINDS if kind in kinds)
    yield "</fieldset><fieldset><legend>Namespace</legend>"
    yield from (
        _choice("namespace", name, name, depth=name.rstrip("/").count("/"))
        for name in sorted(namespaces, key=natural_order)
    )
    yield "</fieldset>"
    yield '<button type="button" id="everything">Show everything</button></div></details>'


def _choice(group: str, value: str, label: str, depth: int = 0) -> str:
    return (
        f'<label style="padding-left:{depth * 16}px"><input type="checkbox" name="{group}"'
        f' value="{text(value)}" checked> {text(label)}</label>'
    )


def _view(graph: Graph, *, shown: bool) -> Iterator[str]:
    layout = arrange(graph)
    width, height = number(layout.size.width), number(layout.size.height)
    hidden = "" if shown else " hidden"
    yield (
        f'<section class="view" id="view-{graph.view}" role="tabpanel" data-view="{graph.view}"'
        f' aria-label="{text(graph.view)}"{hidden}>'
    )
    yield (
        f'<svg class="picture" viewBox="0 0 {width} {height}" role="group"'
        f' aria-label="{text(f"{graph.title}: {graph.view}")}">'
    )
    yield '<g class="world">'
    yield from contents(graph, layout)
    yield "</g></svg></section>"


def _panel() -> Iterator[str]:
    yield '<aside id="details" aria-label="Details" tabindex="-1" hidden>'
    yield '<button type="button" id="close" aria-label="Close details">Close</button>'
    yield '<div id="about"></div>'
    yield '<nav id="neighbors" aria-label="Connected to"></nav>'
    yield "</aside>"


def _script() -> str:
    """Join the modules into one script: a page that is opened as a file cannot import modules."""
    parts = "\n".join(_MODULE_SYNTAX.sub("", _asset(name)) for name in _SCRIPTS)
    return f'(() => {{\n"use strict";\n{parts}}})();\n'


def _style() -> str:
    return f"{page_style()}\n{_asset('page.css')}\n{_asset('picture.css')}"


def _asset(name: str) -> str:
    return (Path(__file__).parent / name).read_text(encoding="utf-8")
