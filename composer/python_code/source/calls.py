"""The calls and names in the body of a method, collected in one walk over its syntax tree."""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping

from composer.fast_dataclass import dataclass
from composer.python_code.source.trees import (
    SCOPES,
    Function,
    bindings,
    dotted,
    full_names,
    imports_in,
    span_of,
)
from composer.source import SourceFile, Span

#: Maximum number of aliases to follow from a name.
_MAXIMUM_ALIASES = 4
_PUBLISH = re.compile(r"self\.publishers\.(\w+)\.publish")


@dataclass(frozen=True, slots=True)
class Call:
    """A call: the dotted name of the callee, and whether it is awaited.

    Imports and local names are resolved in the name. ``deferred`` is true in a nested function,
    which may run later, or in a thread.
    """

    name: str
    span: Span
    awaited: bool
    deferred: bool
    node: ast.Call


@dataclass(frozen=True, slots=True)
class Body:
    """The calls in a method in source order, and the names that it uses without calling them."""

    calls: tuple[Call, ...] = ()
    mentioned: tuple[str, ...] = ()


def read_body(function: Function, names: Mapping[str, str], source: SourceFile) -> Body:
    """Read a method; ``names`` maps the imports of its file to full names."""
    pending: list[tuple[ast.AST, bool]] = [(item, False) for item in reversed(function.body)]
    deferred: dict[ast.AST, bool] = {}
    while pending:
        node, is_inside = pending.pop()
        deferred[node] = is_inside
        is_inside = is_inside or isinstance(node, SCOPES)
        pending += [(child, is_inside) for child in [*ast.iter_child_nodes(node)][::-1]]
    names = {**names, **full_names(imports_in(deferred))}
    # A name that is assigned twice is ambiguous, so it is not an alias.
    aliases = {
        name: values[0]
        for name, values in bindings(function).items()
        if len(values) == 1 and "." not in name and values[0] is not None and dotted(values[0])
    }
    awaited = {node.value for node in deferred if isinstance(node, ast.Await)}
    # The parts of longer names, and the names that are calls or aliases, are not mentioned.
    hidden: set[ast.AST] = {node.value for node in deferred if isinstance(node, ast.Attribute)}
    hidden |= {node.func for node in deferred if isinstance(node, ast.Call)}
    hidden |= {*aliases.values()}
    calls, mentioned = [], []
    for node, is_inside in deferred.items():
        if isinstance(node, ast.Call) and dotted(node.func):
            name = _resolved(dotted(node.func), aliases, names)
            span = span_of(node.func, source)
            calls.append(Call(name, span, node in awaited, is_inside, node))
        elif node not in hidden and isinstance(getattr(node, "ctx", None), ast.Load):
            mentioned.append(_resolved(dotted(node), aliases, names))
    return Body(tuple(calls), tuple(filter(None, mentioned)))


def published_port(name: str) -> str | None:
    """Return ``x`` for ``self.publishers.x.publish``."""
    match = _PUBLISH.fullmatch(name)
    return match[1] if match else None


def _resolved(name: str, aliases: Mapping[str, ast.expr], names: Mapping[str, str]) -> str:
    for _ in range(_MAXIMUM_ALIASES):
        head, dot, rest = name.partition(".")
        if head not in aliases:
            break
        name = f"{dotted(aliases[head])}{dot}{rest}"
    head, dot, rest = name.partition(".")
    return f"{names.get(head, head)}{dot}{rest}"
