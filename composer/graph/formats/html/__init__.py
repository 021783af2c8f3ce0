"""Diagrams as one self-contained HTML page: no network, no server, no installed program.

``articles`` are the details of everything in the pictures. They are put into ``page.html``, with
the style in ``page.css`` and ``picture.css`` and the behavior in the ``.js`` files.
"""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from string import Template

from composer.graph.diagram import (
    Details,
    Graph,
    Problem,
    VertexKind,
    natural_order,
    with_ancestors,
)
from composer.graph.formats.svg import contents, markers, number, text
from composer.graph.formats.theme import page_style
from composer.graph.layout import arrange
from composer.language.tree import Plain

#: Labels for the keys of facts.
_WORDS = {"rate_hz": "rate", "timeout_ms": "timeout", "qos": "QoS"}
_UNITS = {"rate_hz": "Hz", "timeout_ms": "ms"}
#: Policies whose value alone says which one it is.
_PLAIN_POLICIES = ("reliability", "durability", "history")
_SEPARATOR = " -> "
#: Kinds with an article of their own; ports are part of their nodes.
_WHOLE = ("node", "topic", "service", "action")

Facts = Mapping[str, Plain]
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


def articles(graphs: Iterable[Graph]) -> Iterator[str]:
    """Yield an article for everything in the graphs that has facts or diagnostics, each once."""
    seen: set[str] = set()
    for graph in graphs:
        for thing in graph.things:
            if thing.key not in seen and (thing.details or thing.problem):
                seen.add(thing.key)
                yield _article(thing.key, thing.details, thing.problem)


def _article(key: str, details: Details, problem: Problem | None) -> str:
    kind, name = _title(key)
    diagnostic = ""
    if problem is not None:
        diagnostic = f'<p class="diagnostic {problem.mark}">{text(problem.text)}</p>'
    facts = {word: value for word, value in details if value != name}
    return (
        f'<article data-about="{text(key)}"{_role(kind)}><h2>{text(name)}</h2>'
        f'<p class="kind">{text(kind)}</p>{diagnostic}{_facts(facts)}{_sections(facts)}</article>'
    )


def _title(key: str) -> tuple[str, str]:
    """Return what a thing is and its name; keys are ``kind:name``, or two of them."""
    if _SEPARATOR in key:
        names = [end.partition(":")[2] or end for end in key.split(_SEPARATOR)]
        return "connection", " → ".join(names)
    kind, _, name = key.partition(":")
    return kind.replace("_", " "), name


def _role(kind: str) -> str:
    """Mark an article that repeats a part of its node's: print omits it."""
    return "" if kind in _WHOLE else ' class="part"'


def _facts(facts: Facts) -> str:
    """Write the short facts, a line each."""
    rows = [
        f"<dt>{text(_words(name))}</dt><dd>{_short(name, value)}{_aside(name, facts)}</dd>"
        for name, value in facts.items()
        if not _is_long(name, value) and name != "qos_explicit"
    ]
    return f"<dl>{''.join(rows)}</dl>" if rows else ""


def _aside(name: str, facts: Facts) -> str:
    return " (by default)" if name == "qos" and facts.get("qos_explicit") is False else ""


def _sections(facts: Facts) -> str:
    """Write the facts that are many: ports, timers, parameters."""
    return "".join(
        f"<h3>{text(_words(name).capitalize())}</h3>{_long(value)}"
        for name, value in facts.items()
        if _is_long(name, value)
    )


def _is_long(name: str, value: Plain) -> bool:
    if isinstance(value, dict):
        return name != "qos"
    return isinstance(value, list) and any(isinstance(item, dict) for item in value)


def _long(value: Plain) -> str:
    if isinstance(value, list):
        return "".join(_record(item) for item in value if isinstance(item, dict))
    if isinstance(value, dict) and "port" in value:
        return _record(value)
    return _table(value) if isinstance(value, dict) else ""


def _record(facts: Facts) -> str:
    """Write one of several: what it is called, what it is, and the rest."""
    head = facts.get("port", facts.get("name"))
    kind = facts.get("kind", "")
    rest = {name: value for name, value in facts.items() if value != head and name != "kind"}
    return (
        f'<div class="record"><h4>{text(str(head))} <span>{text(str(kind))}</span></h4>'
        f"{_facts(rest)}</div>"
    )


def _table(values: Facts) -> str:
    rows = [
        f'<tr><th scope="row">{text(name)}</th><td>{_scalar(value)}</td></tr>'
        for name, value in values.items()
    ]
    return f"<table>{''.join(rows)}</table>"


def _short(name: str, value: Plain) -> str:
    if isinstance(value, dict):
        return text(
            ", ".join(_qos_policy(policy, policy_value) for policy, policy_value in value.items())
        )
    if isinstance(value, list):
        return "<ul>" + "".join(f"<li>{_scalar(item)}</li>" for item in value) + "</ul>"
    unit = _UNITS.get(name)
    return f"{_scalar(value)} {unit}" if unit else _scalar(value)


def _qos_policy(name: str, value: Plain) -> str:
    if name in _PLAIN_POLICIES:
        return str(value)
    words, _, unit = name.partition("_ms")
    written = f"{value:g} ms" if isinstance(value, float) and name.endswith("_ms") else str(value)
    return f"{words.replace('_', ' ')}{unit} {written}"


def _scalar(value: Plain) -> str:
    if value is None:
        return "<em>not set</em>"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_scalar, value)) + "]"
    return text(str(value))


def _words(name: str) -> str:
    return _WORDS.get(name, name.replace("_", " "))


def render(graphs: Sequence[Graph], shown: int = 0) -> str:
    """Return the page with one picture or more, each of another view.

    The page first shows the picture at index ``shown``.
    """
    script = _script()
    views = (_view(graph, shown=index == shown) for index, graph in enumerate(graphs))
    return Template(_asset("page.html")).substitute(
        title=text(graphs[0].title),
        policy=_policy(script),
        style=f"{page_style()}\n{_asset('page.css')}\n{_asset('picture.css')}",
        tabs=_lines(_tabs([graph.view for graph in graphs], shown)),
        filters=_lines(_filters(graphs)),
        views=_lines(chain.from_iterable(views)),
        articles=_lines(articles(graphs)),
        markers=markers(),
        script=script,
    )


def _lines(lines: Iterable[str]) -> str:
    return "".join(f"{line}\n" for line in lines)


def _policy(script: str) -> str:
    """Allow our own style and script and nothing else: the page cannot load anything."""
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return (
        f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}';"
        " base-uri 'none'; form-action 'none'"
    )


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
    blocks = [block for graph in graphs for block in graph.blocks]
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


def _script() -> str:
    """Join the modules into one script: a page that is opened as a file cannot import modules."""
    parts = "\n".join(_MODULE_SYNTAX.sub("", _asset(name)) for name in _SCRIPTS)
    return f'(() => {{\n"use strict";\n{parts}}})();\n'


def _asset(name: str) -> str:
    return (Path(__file__).parent / name).read_text(encoding="utf-8")
