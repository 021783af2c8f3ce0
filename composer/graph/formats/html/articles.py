"""What is known about each thing in the pictures, as text: for a click, and for print."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from composer.graph.diagram import Details, Graph, Problem
from composer.graph.formats.svg import text
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


def articles(graphs: Iterable[Graph]) -> Iterator[str]:
    """Yield an article for everything in the graphs that has facts or diagnostics, each once."""
    seen: set[str] = set()
    for graph in graphs:
        for key, details, problem in _things(graph):
            if key not in seen and (details or problem):
                seen.add(key)
                yield _article(key, details, problem)


def _things(graph: Graph) -> Iterator[tuple[str, Details, Problem | None]]:
    for cluster in graph.clusters:
        if cluster.block:
            yield cluster.key, cluster.details, cluster.problem
    for vertex in graph.vertices:
        yield vertex.key, vertex.details, vertex.problem
    for edge in graph.edges:
        yield edge.key, edge.details, edge.problem


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
            ", ".join(_policy(policy, policy_value) for policy, policy_value in value.items())
        )
    if isinstance(value, list):
        return _list(value)
    unit = _UNITS.get(name)
    return f"{_scalar(value)} {unit}" if unit else _scalar(value)


def _policy(name: str, value: Plain) -> str:
    if name in _PLAIN_POLICIES:
        return str(value)
    words, _, unit = name.partition("_ms")
    written = f"{value:g} ms" if isinstance(value, float) and name.endswith("_ms") else str(value)
    return f"{words.replace('_', ' ')}{unit} {written}"


def _list(values: Sequence[Plain]) -> str:
    return "<ul>" + "".join(f"<li>{_scalar(value)}</li>" for value in values) + "</ul>"


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
